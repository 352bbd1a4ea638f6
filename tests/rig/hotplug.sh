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
by_itself_ms=$((command_life_ms + 50 + contactor_opening_ms + machine_late_ms))

set_up() {
  ip link set "$1" type can bitrate 500000
  ip link set "$1" up
}
is_there() { [[ -e /sys/class/net/$1 ]]; }
ask_emulator() { echo "$1" >"$RIG_OUT/monitor.new" && mv "$RIG_OUT/monitor.new" "$RIG_OUT/monitor"; }

step "start"
mkdir -p "$(dirname "$socket")"
set_up "$own_bus"
set_up "$bus"
record_words
write_keys "$scenario" 8
start_pack "$scenario"
start bmud bmud --config "$pack" --bus-internal "$own_bus" --bus-vehicle "$own_bus" --socket "$socket"
wait_for "$start_limit_s" "bmud answers" daemon_answers

step "pulled out"
wait_until_closed
downs_before=$(fault_count internal_bus_down)
ask_emulator "device_del controller0"
wait_for 20 "the interface is gone" not is_there "$own_bus"
wait_for 10 "the daemon has opened" phase_is open
expect "it says why" fault_came internal_bus_down "$downs_before"
expect "it is the same daemon" running bmud
# Who pulled it was the host, whose clock is another: the last command tells when.
opened=$(ask_recording 'is_command { command = t } is_status && closed { was = 1 } is_status && was && !closed { printf "%.6f %.6f\n", t, command; exit }')
read -r opened_at command_at <<<"$opened"
lapse_ms=$(awk "BEGIN { printf \"%.1f\", ($opened_at - $command_at) * 1000 }")
measured+=("pulled out: $lapse_ms ms after the last command")
expect "open $lapse_ms ms after the last command" test "${lapse_ms%.*}" -le "$by_itself_ms"
lost_at=$opened_at

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
wait_for "$close_limit_s" "a new wish closes it" phase_is closed

step "end"
expect "bmud exits with 0" stop bmud TERM
stop mmusim || true
tell_measured
