#!/bin/bash
# Guest script: the scenarios of the proof, each played by mmusim to the daemon on buses of the kernel. The script says when the
# contacts have to be open, the daemon's own recording who opened them; bmureplay must decide it all again. The recordings are left as
# RIG_OUT/NAME.log.zst: test_golden looks into them, and make-proof.sh makes the golden logs of them.
#   usage: proof.sh REPOSITORY PROGRAM_FOLDER... [-- NAME...]   (the folders of bmud, mmusim, bmuctl and bmureplay; default: all)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1
shift
while [[ $# -gt 0 && $1 != -- ]]; do
  PATH=$1:$PATH
  shift
done
names=("${@:2}")

scenarios=$repository/vcan-fixtures/proof
internal_bus=vcan0
vehicle_bus=vcan1
second_bus=vcan2
own_charger_bus=vcan3
# Only reached when something is wrong.
start_limit_s=30
script_limit_s=60

pack_of() { echo "$repository/$(sed -n 's/^# Pack: //p' "$scenarios/$1.scn")"; }
answers() { bmuctl --socket "$1" status --json >/dev/null 2>&1; }
knows_second_pack() { bmuctl --socket "$1" status --json | jq -e '.second_pack.soc_permille != null' >/dev/null 2>&1; }

# In memory: a recording on the host's disk would make the emulated machine's clock run ahead with each write.
start_daemon() {
  local name=$1 pack=$2 bus=$3
  shift 3
  start "$name" as_service bmud --config "$pack" --bus-internal "$bus" --bus-vehicle "$vehicle_bus" --socket "/run/$name.sock" --log-level info "$@"
  wait_for "$start_limit_s" "$name answers" answers "/run/$name.sock"
}

# The second of two packs: heard, and then silent while the first is driven.
start_second_pack() {
  start second_world mmusim --bus "$second_bus" --pack "$scenarios/second-48s.json"
  start_daemon second_bmud "$scenarios/second-48s.json" "$second_bus"
}
silence_second_pack() {
  wait_for 10 "the second pack is heard" knows_second_pack "/run/$1.sock"
  expect "the second daemon exits with 0" stop second_bmud TERM
  stop second_world || true
}

record_scenario() {
  local name=$1 folder=/run/recorded/$1 status=0 daemon_buses=() pack_buses=()
  step "$name"
  mkdir -p "$folder"
  [[ $name != second_pack_silent ]] || start_second_pack
  if [[ $name == charger_own_bus ]]; then
    daemon_buses=(--bus-charger "$own_charger_bus")
    pack_buses=(--charger-bus "$own_charger_bus")
  fi
  start_daemon "bmud_$name" "$(pack_of "$name")" "$internal_bus" --record "$folder" "${daemon_buses[@]}"
  start "mmusim_$name" mmusim --bus "$internal_bus" "${pack_buses[@]}" --inverter-bus "$vehicle_bus" --second-pack-bus "$vehicle_bus" \
    --pack "$(pack_of "$name")" --scenario "$scenarios/$name.scn"
  [[ $name != second_pack_silent ]] || silence_second_pack "bmud_$name"
  wait_for "$script_limit_s" "its script is over" stopped "mmusim_$name"
  stop "mmusim_$name" || status=$?
  expect "its script has passed ($status)" test "$status" -eq 0
  expect "bmud exits with 0" stop "bmud_$name" TERM
  expect "it has left one recording" test "$(find "$folder" -name '*.log.zst' | wc -l)" -eq 1
  cp "$folder"/*.log.zst "$RIG_OUT/$name.log.zst"
  expect "bmureplay decides the same" bmureplay --quiet "$RIG_OUT/$name.log.zst"
}

has_program() { command -v "$1" >/dev/null; }

step "start"
for program in bmud mmusim bmuctl bmureplay jq strip; do expect "$program is there" has_program "$program"; done
rm -f "$RIG_OUT"/*.log.zst
for bus in "$vehicle_bus" "$second_bus" "$own_charger_bus"; do make_vcan "$bus"; done
# Out of memory, too: an emulated machine that waits for the next page of a program lets its clock run ahead, and a module falls silent.
mkdir -p /run/programs
for program in bmud mmusim bmuctl; do strip -o "/run/programs/$program" "$(command -v "$program")"; done
PATH=/run/programs:$PATH

if [[ ${#names[@]} -eq 0 ]]; then
  for script in "$scenarios"/*.scn; do names+=("$(basename "$script" .scn)"); done
fi
for name in "${names[@]}"; do record_scenario "$name"; done
