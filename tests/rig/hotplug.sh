#!/bin/bash
# Guest script: a controller with a real driver is pulled out of the machine while the pack is closed, and put back. Needs can0 and can1
# of boot.sh --can-bus: the daemon is on the one, the pack on the other.
#   usage: hotplug.sh REPOSITORY PROGRAM_FOLDER...
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1
shift
for folder in "$@"; do PATH=$folder:$PATH; done

own_bus=can0 bus=can1
scenario=/run/keys.scn
# shellcheck source-path=SCRIPTDIR source=pack-env.sh
source "$(dirname "$0")/pack-env.sh"

set_up() {
  ip link set "$1" type can bitrate 500000
  ip link set "$1" up
}
is_there() { [[ -e /sys/class/net/$1 ]]; }
ask_emulator() { echo "$1" >"$RIG_OUT/monitor.new" && mv "$RIG_OUT/monitor.new" "$RIG_OUT/monitor"; }

step "start"
mkdir -p "$(dirname "$socket")"
read_ahead bmud mmusim bmuctl candump jq awk ip chrt
set_up "$own_bus"
set_up "$bus"
record_words
write_keys "$scenario"
start_pack "$scenario"
start bmud bmud --config "$pack" --bus-internal "$own_bus" --bus-vehicle "$own_bus" --socket "$socket"
wait_for "$start_limit_s" "bmud answers" daemon_answers

step "pulled out"  # [F41]
wait_until_closed
downs_before=$(fault_count internal_bus_down)
pulled_at=$EPOCHREALTIME
ask_emulator "device_del controller0"
wait_for 20 "the interface is gone" not is_there "$own_bus"
wait_for 10 "the daemon has opened" phase_is open
expect "it says why" fault_came internal_bus_down "$downs_before"
expect "it is the same daemon" running bmud
# Who pulled it is the host, whose clock is another: the last command tells when.
expect_opened_by_itself "pulled out" "$pulled_at"

step "and put back"
ask_emulator "device_add kvaser_pci,canbus=bus,id=controller0"
wait_for 20 "the interface is there" is_there "$own_bus"
back_at=$EPOCHREALTIME
set_up "$own_bus"
first_command_since() { ask_recording 'is_command && t > after && !done { printf "%.6f", t; done = 1 }' -v "after=$1"; }
commands_again() { [[ -n $(first_command_since "$back_at") ]]; }
wait_for 10 "the daemon commands again" commands_again
lapse_ms=$(awk "BEGIN { printf \"%.1f\", ($(first_command_since "$back_at") - $back_at) * 1000 }")
measured+=("put back: commanded again after $lapse_ms ms")
expect "within 1 s: after $lapse_ms ms" test "${lapse_ms%.*}" -le 1000
wait_for 10 "everything is known anew" view_is_complete
expect "it is the same daemon" running bmud
clear_faults
expect_open_until_key
wait_for "$close_limit_s" "a new wish closes it" phase_is closed

step "end"
expect "bmud exits with 0" stop bmud TERM
stop mmusim || true
tell_measured
