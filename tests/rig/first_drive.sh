#!/bin/bash
# Guest script: the programs of this project as a user starts them, on a CAN bus of the kernel. The emulated pack is driven, bad frames
# are thrown at it, one of its cells sags, and the daemon is ended; the recording must bear out all of it.
#   usage: first_drive.sh REPOSITORY PROGRAM_FOLDER...   (the folders of bmud, mmusim, bmuctl and bmudump)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1
shift
for folder in "$@"; do PATH=$folder:$PATH; done

bus=vcan0
pack=$repository/config/packs/demo-48s.json
scenario=$repository/vcan-fixtures/demo.scn
calm_scenario=$repository/vcan-fixtures/calm.scn
socket=/run/bmud/bmud.sock
recording=$RIG_OUT/drive.can.log

# What the scenario does to which cell, as "bmuctl why" names it.
sagging_cell='cell 2\.7'
drive_s=40
# The daemon's commands and polls alone are 30 a second; the modules' answers are several times as many.
least_frames=$((30 * 20))
# Nothing below depends on how fast the guest is, but for these: generous, and only reached when something is wrong.
start_limit_s=30
close_limit_s=30
trip_limit_s=60

# --- how the programs are asked; all this script knows of their output is in these functions ---

status_json() { bmuctl --socket "$socket" status --json; }
status_field() { status_json | jq -er "$1"; }
daemon_answers() { status_json >/dev/null 2>&1; }
pack_state() { status_field .state.phase 2>/dev/null; }
active_faults() { status_field '.faults_present | length'; }
# Of two statuses: was each kind of bad frame counted so many times more?  usage: counted_more BEFORE AFTER TIMES KIND...
# Late ones may be more: in an emulated machine with a busy host the modules of mmusim are late by themselves now and then.
counted_more() {
  jq -en --slurpfile before "$1" --slurpfile after "$2" --argjson times "$3" --args '
    def count($status; $kind): $status[0].receive.rejected_by_reason[$kind] // 0;
    def more($kind): count($after; $kind) - count($before; $kind);
    all($ARGS.positional[]; more(.) == $times or (. == "late" and more(.) > $times))' "${@:4}" >/dev/null
}
why() { bmuctl --socket "$socket" why; }
# Frames that bmudump does not know ("ok": null) or finds wrong ("ok": false).
frames_not_ok() { bmudump --json -r "$1" | jq -c 'select(.ok != true)'; }
late_only() { jq -c 'select(.reason == "late")'; }
all_but_late() { jq -c 'select(.reason != "late")'; }

state_is() { [[ $(pack_state) == "$1" ]]; }
state_is_not() { [[ -n $(pack_state) ]] && not state_is "$1"; }

# --- frames ---

# The checksum of internal frames: CRC-8H2F over the identifier, two bytes, and bytes 0 to 6, all in hex.
crc8h2f() {
  local hex=$1 crc=255 i bit
  for ((i = 0; i < ${#hex}; i += 2)); do
    crc=$((crc ^ 16#${hex:i:2}))
    for ((bit = 0; bit < 8; ++bit)); do crc=$(((crc & 128 ? crc << 1 ^ 16#2F : crc << 1) & 255)); done
  done
  printf '%02X' $((crc ^ 255))
}

# Half the circle away from the POLL just heard, so more than ten seconds from being an answer to any.
counter_of_no_poll() {
  local poll
  poll=$(candump -L -n 1 "$bus,080:7FF") && poll=${poll#*#} && printf '%02X' $(((16#${poll:12:2} + 128) & 255))
}

# Cells of 1 V: had a single one of these been believed, the pack would have opened.
dead_cells=2710271027102A
bad_frame_of_kind() {
  local crc
  crc=$(crc8h2f "0143$dead_cells")
  case $1 in
    'wrong crc') echo "143#$dead_cells$(printf '%02X' $((16#$crc ^ 1)))" ;;
    'wrong length') echo "143#$dead_cells" ;;
    late) echo "143#271027102710$late_counter$(crc8h2f "0143271027102710$late_counter")" ;;
    'wrong form') echo '143#R' ;;
    'unknown id') echo '5F3#2710271027102A00' ;;
  esac
}
# The first three reach the daemon and are counted; the others are what the kernel's filter keeps away from it.
counted_kinds=('wrong crc' 'wrong length' late)
kinds=("${counted_kinds[@]}" 'wrong form' 'unknown id')
copies=3

# --- what must hold ---

all_counted() {
  status_json >"$RIG_OUT/status-closed.json" &&
    counted_more "$RIG_OUT/status-before.json" "$RIG_OUT/status-closed.json" "$copies" "${counted_kinds[@]}"
}

# Three damaged ones among ten frames of a module are a fault, on a machine quick enough to send them between two answers; so two
# answers of the module come between two rounds.
throw_bad_frames() {
  local frame copy
  for ((copy = 0; copy < copies; ++copy)); do
    for frame in "${bad_frames[@]}"; do cansend "$bus" "$frame"; done
    candump -n 2 "$bus,143:7FF" >/dev/null
  done
}

has_program() { command -v "$1" >/dev/null; }

why_names_the_cell() { why >"$RIG_OUT/why.txt" && grep -Eiq "$sagging_cell" "$RIG_OUT/why.txt"; }

# CONTACTOR_COMMAND, b0 the outputs and b1 its complement; the low nibble of b0 has main positive, main negative and precharge.
were_closed_on_the_bus() { grep -Eq ' 040#.[37BF]' "$1"; }
last_command_is_all_open() { grep ' 040#' "$1" | tail -n 1 | grep -q ' 040#00FF'; }
# PDU_STATUS, b0: the low nibble are the auxiliary contacts.
last_feedback_is_all_open() { grep ' 041#' "$1" | tail -n 1 | grep -Eq ' 041#.0'; }

only_the_injected_are_wrong() {
  [[ $(frames_not_ok "$recording" | all_but_late | wc -l) -eq $((copies * (${#kinds[@]} - 1))) ]] &&
    [[ $(frames_not_ok "$recording" | late_only | wc -l) -ge $copies ]]
}
none_is_wrong() {
  frames_not_ok "$1" | all_but_late >"$RIG_OUT/not_ok.json" || return 1
  [[ ! -s $RIG_OUT/not_ok.json ]] || { head -n 5 "$RIG_OUT/not_ok.json"; return 1; }
}

step "programs"
for program in bmud mmusim bmuctl bmudump jq candump cansend; do expect "$program is there" has_program "$program"; done
expect "the checksum is the protocol's" test "$(crc8h2f 01438EA08E928EB22A)" = B2
mkdir -p "$(dirname "$socket")"
# A program that is read from the host's disk between two answers of a module lets the clock run ahead, and the module falls silent.
read_ahead bmud mmusim bmuctl bmudump jq candump cansend

step "ended while the pack is closed"
record calm "$bus"
start calm_world mmusim --bus "$bus" --pack "$pack" --scenario "$calm_scenario"
start bmud as_service bmud --config "$pack" --bus-internal "$bus" --bus-vehicle "$bus" --socket "$socket"
wait_for "$start_limit_s" "bmud answers" daemon_answers
wait_for "$close_limit_s" "the contactors are closed" state_is closed
expect "bmud exits with 0" stop bmud TERM
stop calm_world || true
stop calm || true
expect "the contactors were closed on the bus" were_closed_on_the_bus "$RIG_OUT/calm.can.log"
expect "the last command is all open" last_command_is_all_open "$RIG_OUT/calm.can.log"
expect "the power distribution unit says so too" last_feedback_is_all_open "$RIG_OUT/calm.can.log"

step "start"
record drive "$bus"
start mmusim mmusim --bus "$bus" --pack "$pack" --scenario "$scenario" --seconds "$drive_s"
start bmud as_service bmud --config "$pack" --bus-internal "$bus" --bus-vehicle "$bus" --socket "$socket"
wait_for "$start_limit_s" "bmud answers" daemon_answers
wait_for "$close_limit_s" "the contactors are closed" state_is closed

step "bad frames change nothing"
late_counter=$(counter_of_no_poll)
expect "a POLL was heard" test -n "$late_counter"
bad_frames=()
for kind in "${kinds[@]}"; do bad_frames+=("$(bad_frame_of_kind "$kind")"); done
printf ' %s\n' "${bad_frames[@]}" >"$RIG_OUT/injected"
status_json >"$RIG_OUT/status-before.json"
throw_bad_frames
wait_for 10 "each was counted by its kind" all_counted
expect "the pack is still closed" state_is closed
expect "no fault is active" test "$(active_faults)" -eq 0

step "a cell sags"
wait_for "$trip_limit_s" "the contactors are open" state_is_not closed
status_json >"$RIG_OUT/status-open.json"
expect "why names the cell" why_names_the_cell

step "the daemon is ended"
expect "bmud exits with 0" stop bmud TERM
stop mmusim || true
stop drive || true
expect "the contactors were closed on the bus" were_closed_on_the_bus "$recording"
expect "the last command is all open" last_command_is_all_open "$recording"

step "the recording"
expect "bmudump finds wrong what was injected, and that only" only_the_injected_are_wrong
# The golden log: the drive as it would have been without our interference.
grep -vFf "$RIG_OUT/injected" "$recording" >"$RIG_OUT/first_drive.can.log"
expect "the rest is a drive" test "$(wc -l <"$RIG_OUT/first_drive.can.log")" -ge "$least_frames"
expect "bmudump reads the rest without an unknown or damaged frame" none_is_wrong "$RIG_OUT/first_drive.can.log"
echo "  $(wc -l <"$RIG_OUT/first_drive.can.log") frames in first_drive.can.log," \
  "$(frames_not_ok "$RIG_OUT/first_drive.can.log" | wc -l) of them late; as a golden log it must have none"
