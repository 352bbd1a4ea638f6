#!/bin/bash
# Guest script: proves the rig itself. candump records on vcan0 exactly what cansend sent. With "--exit N" it ends with N instead,
# to prove that a failing script is seen as one; with "--hang" it never ends.
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

case ${1:-} in
  --exit) step "ending with status $2 on purpose"; exit "$2" ;;
  --hang) step "hanging on purpose"; sleep 100000 ;;
esac

frames=(123#DEADBEEF 080#008F000000002A1F 040#06F90000000005 143#R 1ABCDE55#0102)

recorded() { [[ $(wc -l <"$RIG_OUT/smoke.can.log") -ge $1 ]]; }

record() { exec candump -L vcan0 >"$RIG_OUT/smoke.can.log"; }

# candump says nothing when it is ready: frames are sent until one arrives, and that one is not counted.
listening() {
  cansend vcan0 7FF#
  recorded 1
}

step "vcan0 is up"
expect "vcan0 is there and up" grep -q UP <(ip -o link show vcan0)

step "record what is sent"
start candump record
wait_for 10 "candump records" listening
for frame in "${frames[@]}"; do cansend vcan0 "$frame"; done
wait_for 10 "the last frame was recorded" grep -q " ${frames[-1]}\$" "$RIG_OUT/smoke.can.log"
stop candump || true
printf '%s\n' "${frames[@]}" >"$RIG_OUT/sent"
awk '$3 != "7FF#" { print $3 }' "$RIG_OUT/smoke.can.log" >"$RIG_OUT/received"
expect "every frame once, in order" cmp "$RIG_OUT/sent" "$RIG_OUT/received"
