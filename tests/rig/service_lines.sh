#!/bin/bash
# Guest script: can0 as docs/wiring.md sets it up, by hand and by systemd-networkd; then the installed service with contactors on GPIO lines
# and a CAN interface that it sets up itself, both by the drop-ins that the package has as examples, in its sandbox. However its process
# ends, the stop hook opens the lines that it drove; and a controller that went off the bus comes back by itself. Needs systemd as the machine's first program, and can0 and can1 of boot.sh --can-bus.
#   usage: service_lines.sh MODULE.ko REPOSITORY PACKAGES   (the chip's driver; a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

module=$1 repository=$2 packages=$3
scenario=$RIG_OUT/calm.scn
# shellcheck source-path=SCRIPTDIR source=service-env.sh
source "$(dirname "$0")/service-env.sh"

chip=/sys/kernel/debug/rig_gpio
# Outputs, and the auxiliary contacts that follow them; both of main_positive are active low. Of the inputs a low estop is an emergency.
positive=3 negative=4 precharge=5 estop=7 key=9
wires=(3:13 4:14 5:15)
drop_ins=/etc/systemd/system/bmud.service.d

level_of() { cat "$chip/line$1"; }
set_wire() { echo "$2" >"$chip/line$1"; }
turn_key() { set_wire "$key" "$1"; }

# Shell builtins only: a process for each reading would take the machine's time.
follow_contacts() {
  local wire level contact
  exec 9<>"$1"
  until read -r -t 0.005 -u 9; do
    for wire in "${wires[@]}"; do
      read -r level <"$chip/line${wire%:*}"
      read -r contact <"$chip/line${wire#*:}"
      [[ $level == "$contact" ]] || echo "$level" >"$chip/line${wire#*:}"
    done
  done
}

lines_are() { [[ $(level_of "$positive")$(level_of "$negative")$(level_of "$precharge") == "$1" ]]; }
lines_are_closed() { lines_are 010; }
lines_are_open() { lines_are 100; }

# The daemon closes only after the key has been turned off and on.
close_pack() {
  turn_key 0
  wait_for 30 "it may close" may_close
  turn_key 1
  wait_for 60 "it is closed" phase_is closed
  expect "and the lines are" lines_are_closed
}
may_close() { status_json | jq -e .permission.may_close >/dev/null; }

write_lines_pack() {
  jq '. + {
    buses: {internal: "can0", vehicle: "can0"}, interfaces: {set_up: true, restart_ms: 1000},
    gpio: {
      chip: "/dev/gpiochip0",
      outputs: {main_positive: {line: 3, active_low: true}, main_negative: {line: 4}, precharge: {line: 5}, watchdog: {line: 2}},
      feedback: {main_positive: {line: 13, active_low: true}, main_negative: {line: 14}, precharge: {line: 15}},
      inputs: [{name: "cockpit", kind: "estop", line: 7, debounce_ms: 0}, {name: "key", kind: "vehicle_on", line: 9, debounce_ms: 0}]}
    } | .cell = "/usr/share/bmud/cells/" + (.cell | split("/") | last)' \
    <(sed 's#^ *//.*##' /usr/share/bmud/packs/demo-48s.json) >/etc/bmud/pack.json
}

# As an administrator does it, from the examples of the package.
put_drop_in() { install -D -m 644 "/usr/share/doc/bmud/examples/$1.conf" "$drop_ins/$1.conf"; }
write_drop_in() {
  printf '[Service]\n%s\n' "$2" >"$drop_ins/$1.conf"
  systemctl daemon-reload
}

in_folder() { (cd "$1" && "${@:2}"); }

link_is() {
  [[ $(ip -json -details link show "$1" | jq -r '.[0] | "\(.linkinfo.info_data.bittiming.bitrate) \(.linkinfo.info_data.restart_ms) \([.flags[] | select(. == "UP")][0])"') == "$2" ]]
}

queue_length_is() { [[ $(ip -json link show "$1" | jq -r '.[0].txqlen') == "$2" ]]; }

# --- bus-off ---

# The emulated controller counts no errors: gpio/rig_bus_off.c does to it what one does that has counted too many. What comes after it is the
# kernel's and the driver's own.
take_off_bus() { echo can0 >"/sys/kernel/debug/rig_bus_off/$1"; }
# What can0's driver has counted: "times off the bus, restarts".
link_counts() { ip -json -details -statistics link show can0 | jq -r '.[0].linkinfo.info_xstats | "\(.bus_off) \(.restarts)"'; }
link_counts_are() { [[ $(link_counts) == "$1" ]]; }
controller_counts_are() { [[ $(status_json | jq -r '.ports[0].controller | "\(.times_bus_off) \(.restarts) \(.state)"') == "$1" ]]; }

# expect_back_by_itself COUNT: nobody but the kernel has restarted it, and that often
expect_back_by_itself() {
  wait_for 10 "its driver has restarted it" link_counts_are "$1 $1"
  wait_for 10 "the status has it" controller_counts_are "$1 $1 error-active"
  wait_for 10 "everything is known anew" view_is_complete
  expect "it is the same process" test "$(main_pid)" = "$pid"
  clear_faults
  sleep "$((lock_out_s + 1))"
  expect "with the key still on it has stayed open" lines_are_open
  close_pack
}

step "install"
expect "the packages are installed" install_packages
mount -t debugfs debugfs /sys/kernel/debug
insmod "$module"
groupadd --system gpio
chgrp gpio /dev/gpiochip0
chmod 660 /dev/gpiochip0
ip link set can1 type can bitrate 500000
ip link set can1 up
expect "can0 is down" not link_is can0 "500000 200 UP"

step "can0 by hand"
# The kernel's own length for CAN is that of the page.
ip link set can0 txqueuelen 1000
expect "its transmit queue is long" queue_length_is can0 1000
run_shown wiring by-hand
expect "it is set up and up" link_is can0 "500000 200 UP"
expect "its transmit queue is as short as the page has it" queue_length_is can0 10
expect "its state is shown" grep -q 'state ERROR-ACTIVE' <<<"$(run_shown wiring look)"
ip link set can0 down
ip link set can0 type can bitrate 125000 restart-ms 0

step "can0 by networkd"
# This machine has no udev, which networkd waits for before it touches an interface. Where /sys is read-only it does not, as in a container.
mkdir -p /run/systemd/system/systemd-networkd.service.d
printf '[Service]\nReadOnlyPaths=/sys\n' >/run/systemd/system/systemd-networkd.service.d/no-udev.conf
systemctl daemon-reload
systemctl start dbus
# It runs before the files are there, so that only the page's reload can bring them to it.
systemctl start systemd-networkd
expect "can0 is down" not link_is can0 "500000 200 UP"
expect "the page's commands succeed" in_folder /usr/share/doc/bmud/examples run_shown wiring networkd
wait_for 30 "networkd has set up can0 as the example has it" link_is can0 "500000 200 UP"
systemctl disable --now systemd-networkd.socket systemd-networkd
rm /etc/systemd/network/80-can0.*
ip link set can0 down
ip link set can0 type can bitrate 125000 restart-ms 0

step "the drop-ins"
write_lines_pack
expect "the pack file is good" bmud --check-config /etc/bmud/pack.json >/dev/null
put_drop_in gpio
put_drop_in interfaces
# An opening by the successor must not pass for an opening by the hook.
write_drop_in no-restart 'Restart=no'
expect "the unit is right with them" systemd-analyze verify --man=no --recursive-errors=no bmud.service
systemd-analyze security --no-pager bmud >"$RIG_OUT/security.txt"
exposure=$(sed -n 's/.*exposure level for bmud.service: \([0-9.]*\).*/\1/p' "$RIG_OUT/security.txt")
expect "its exposure is $exposure, at most 1.5" awk "BEGIN { exit !($exposure <= 1.5) }"

step "start"
set_wire "$estop" 1
mkfifo /run/contacts
start contacts follow_contacts /run/contacts
chrt -f -p 60 "${started_pids[contacts]}"
grep '^0 ' "$repository/vcan-fixtures/calm.scn" >"$scenario"
start mmusim mmusim --bus can1 --pack /etc/bmud/pack.json --scenario "$scenario"
chrt -f -p 60 "${started_pids[mmusim]}"
start bmud journalctl -q -f -o short-monotonic -u bmud
expect "it starts" systemctl start bmud
wait_until_serving
pid=$(main_pid)
expect "as its own user" test "$(stat -c %U "/proc/$pid")" = bmud
expect "with CAP_NET_ADMIN and no other capability" grep -q '^CapEff:\s*0000000000001000$' "/proc/$pid/status"
expect "it has set up can0" link_is can0 "500000 1000 UP"
expect "its lines are open" lines_are_open
expect "it has written which lines it drives" grep -q '"main_positive"' /run/bmud/driven-lines.json

step "bus-off, and back by itself"  # [F44]
insmod "$(dirname "$module")/rig_bus_off.ko"
close_pack
downs_before=$(fault_count internal_bus_down)
take_off_bus told
wait_for 5 "its lines are open" lines_are_open
expect "it says why" fault_came internal_bus_down "$downs_before"
expect_back_by_itself 1

step "bus-off, untold, with sending that seems to work"  # [F46]
take_off_bus untold
wait_for 5 "its lines are open" lines_are_open
expect "it is still off the bus" link_counts_are "2 1"
expect_back_by_itself 2

step "systemctl stop"
systemctl stop bmud
expect "its lines are open" lines_are_open

# ends NAME COMMAND...: ends the process by COMMAND PID while the pack is closed and the pack file damaged
ends() {
  local name=$1
  shift
  step "$name"
  systemctl start bmud
  wait_until_serving
  clear_faults
  close_pack
  cp /etc/bmud/pack.json /run/good.json
  echo '{ damaged' >/etc/bmud/pack.json
  "$@" "$(main_pid)"
  wait_for 10 "the unit has failed" is_active failed
  cp /run/good.json /etc/bmud/pack.json
}
expect_opened_by_hook() {
  expect "$1: its lines are open" lines_are_open
  systemctl reset-failed bmud
}

ends "killed" kill -KILL  # [F59]
expect_opened_by_hook "killed"
ends "crashed" kill -SEGV  # [F62]
expect_opened_by_hook "crashed"
ends "stopped by SIGSTOP" kill -STOP
expect "it was the watchdog" log_has 'Watchdog timeout'
expect_opened_by_hook "stopped by SIGSTOP"

# dpkg takes nothing away, and so leaves the hook to the daemon that runs on.
remove_and_kill() {
  printf '#!/bin/sh\nexit 101\n' >/usr/sbin/policy-rc.d
  chmod 755 /usr/sbin/policy-rc.d
  expect "the package is not removed" not dpkg --remove bmud >"$RIG_OUT/remove.txt" 2>&1
  expect "it is told what to do" grep -q 'bmud: still running; stop it' "$RIG_OUT/remove.txt"
  expect "it is still installed" test "$(dpkg-query --show --showformat='${db:Status-Status}' bmud)" = installed
  expect "the daemon runs on" test "$(main_pid)" = "$1"
  expect "its lines are closed" lines_are_closed
  rm /usr/sbin/policy-rc.d
  kill -KILL "$1"
}
ends "a removal where a policy forbids to stop services, and killed" remove_and_kill
expect_opened_by_hook "killed after a refused removal"

# The chip keeps levels: without the hook the lines stay closed, so the steps above show the hook and not the chip.
write_drop_in no-hook 'ExecStopPost='
ends "killed, and no hook" kill -KILL
expect "its lines have stayed closed" lines_are_closed
rm "$drop_ins/no-hook.conf"
systemctl daemon-reload
systemctl reset-failed bmud

step "the next one opens first"
systemctl start bmud
wait_until_serving
expect "its lines are open though the key is on" lines_are_open
systemctl stop bmud
