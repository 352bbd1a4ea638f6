#!/bin/bash
# Guest script: a controller with a real driver is pulled out of the machine while the pack of the installed service is closed, and put back.
# Needs systemd as the machine's first program, and can0 and can1 of boot.sh --can-bus: the service is on the one, the pack on the other.
#   usage: hotplug.sh REPOSITORY PACKAGES   (a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 packages=$2
scenario=/run/keys.scn
# shellcheck source-path=SCRIPTDIR source=service-env.sh
source "$(dirname "$0")/service-env.sh"
own_bus=can0 bus=can1

set_up() {
  ip link set "$1" type can bitrate 500000
  ip link set "$1" up
}
is_there() { [[ -e /sys/class/net/$1 ]]; }
ask_emulator() { echo "$1" >"$RIG_OUT/monitor.new" && mv "$RIG_OUT/monitor.new" "$RIG_OUT/monitor"; }

step "start"
expect "the packages are installed" install_packages
set_up "$own_bus"
set_up "$bus"
prepare_service
expect "it starts" systemctl start bmud
wait_until_serving
pid=$(main_pid)
expect_sandboxed

step "pulled out"  # [F41]
wait_until_closed
downs_before=$(fault_count internal_bus_down)
pulled_at=$EPOCHREALTIME
ask_emulator "device_del controller0"
wait_for 20 "the interface is gone" not is_there "$own_bus"
wait_for 10 "the daemon has opened" phase_is open
expect "it says why" fault_came internal_bus_down "$downs_before"
expect "it is the same process" test "$(main_pid)" = "$pid"
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
expect_recovered
wait_for "$close_limit_s" "a new wish closes it" phase_is closed

step "end"
expect_stopped_well
stop mmusim || true
tell_measured
