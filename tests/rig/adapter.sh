#!/bin/bash
# Guest script: what goes wrong between a controller and its bus. The installed service is behind a serial CAN adapter that can be told to
# misbehave (adapter/slcan_adapter.cpp): one that is not there yet, error states, a cut wire, nobody who acknowledges, bus-off once and again
# and again, an adapter that takes nothing any more, and one that is pulled out and comes back. The pack is closed before each. Needs systemd
# as the machine's first program.
#   usage: adapter.sh REPOSITORY PACKAGES ADAPTER   (a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 packages=$2 adapter_program=$3
scenario=$RIG_OUT/keys.scn
# shellcheck source-path=SCRIPTDIR source=service-env.sh
source "$(dirname "$0")/service-env.sh"

# The daemon's interface, made by the adapter.
own_bus=slcan0

# Not in the output folder: a queue of words cannot be on the host.
orders=/run/adapter.orders answers=/run/adapter.answers
adapter_said() { grep -c "^ok $1\$" "$answers" || true; }
adapter_said_more() { (($(adapter_said "$1") > $2)); }
# A word to the adapter, done when this returns.
tell_adapter() {
  local before
  before=$(adapter_said "$1")
  echo "$1" >&"$to_adapter"
  wait_for 10 "the adapter: $1" adapter_said_more "$1" "$before"
}

run_adapter() { exec "$adapter_program" "$own_bus" "$bus" <"$orders" >"$answers"; }
plug_in() {
  : >"$answers"
  rm -f "$orders"
  mkfifo "$orders"
  start adapter run_adapter
  exec {to_adapter}>"$orders"
  wait_for 10 "the adapter is plugged in" adapter_said_more ready 0
  # It is a wire: like the pack, it is never later than it would be on a desk.
  chrt -f -p 55 "${started_pids[adapter]}"
  # Before the bus has it to itself: a frame that waits for long is worth nothing.
  ip link set "$own_bus" type can bitrate 500000 2>/dev/null || true
  ip link set "$own_bus" up
}
unplug() {
  tell_adapter unplug
  exec {to_adapter}>&-
  stop adapter || true
}
# As whoever looks after the adapter does when its driver cannot restart it.
restart_controller() {
  ip link set "$own_bus" down
  ip link set "$own_bus" up
  tell_adapter active
}

bus_field() { status_json | jq -r ".ports[0].$1"; }
bus_is() { [[ $(bus_field "$1") == "$2" ]]; }
frames_sent() { bus_field frames_sent; }
controller_is() { bus_is controller.state "$1"; }

# With nearly all of the key's time ahead: whoever closes by himself after that would be seen doing it.
clears_behind_key() { key_turned_on_within "$fresh_s" && clear_faults; }

page_has() { local page; page=$(bmuctl --socket "$socket" status) && grep -Eq "$1" <<<"$page"; }
why_has() { local why; why=$(bmuctl --socket "$socket" why) && grep -q "$1" <<<"$why"; }

step "install"
expect "the packages are installed" install_packages
read_ahead "$adapter_program" mkfifo
prepare_service

step "no interface at the start"  # [F42]
expect "the interface is not there" not test -e "/sys/class/net/$own_bus"
start_in_real_time
expect_sandboxed
# The key is turned meanwhile, at its own time.
missing_at=$EPOCHREALTIME
wait_for "$((key_period_s + 5))" "the key is turned" key_turned_since "$missing_at"
expect "it goes on waiting" test "$(main_pid):$(property NRestarts)" = "$pid:0"
expect "and stays open" phase_is open
expect "and says so" log_has "fault: .*internal bus"
expect "and why" why_has "internal bus down"
plug_in
wait_for 10 "the interface is there, and everything is known" view_is_complete
expect "it is the same process" test "$(main_pid)" = "$pid"
clear_faults
wait_until_closed

step "warning and passive"  # [F47]
wait_until_closed
warnings_before=$(fault_count bus_error_passive)
tell_adapter warning
wait_for 10 "the status has the warning" controller_is error-warning
expect "which is no fault yet" test "$(fault_count bus_error_passive)" -eq "$warnings_before"
tell_adapter passive
wait_for 5 "error-passive is a fault" fault_came bus_error_passive "$warnings_before"
wait_for 10 "and is in the status" controller_is error-passive
# As docs/bmuctl.md shows it; the driver of a serial adapter does not give its error counters.
expect "and on the page of bmuctl" page_has "^$own_bus +error-passive +-- "
sleep 1
expect "the pack stays closed: all is fresh" phase_is closed
tell_adapter active
wait_for 5 "the fault is gone when the controller is well again" fault_is_gone bus_error_passive
wait_for 10 "the status has it, too" controller_is error-active
expect "the pack is still closed" phase_is closed

step "the wire is cut"  # [F48]
wait_until_closed
cut_at=$EPOCHREALTIME
tell_adapter cut
expect_opened_by_itself "wire cut" "$cut_at"
wait_for 5 "the daemon has opened" phase_is open
tell_adapter joined
expect_recovered

step "nobody acknowledges"  # [F48]
wait_until_closed
sent_before=$(frames_sent)
sleep 1
sent_usual=$(($(frames_sent) - sent_before))
errors_before=$(bus_field error_frames)
passive_before=$(fault_count bus_error_passive)
alone_at=$EPOCHREALTIME
tell_adapter alone
expect_opened_by_itself "no acknowledge" "$alone_at"
wait_for 5 "the daemon has opened" phase_is open
wait_for 5 "the controller is error-passive" fault_came bus_error_passive "$passive_before"
sent_before=$(frames_sent)
sleep 1
sent_alone=$(($(frames_sent) - sent_before))
measured+=("no acknowledge: $sent_alone frames in the second, $sent_usual with a good bus")
expect "it goes on sending, $sent_alone frames in a second" test "$sent_alone" -gt 0
expect "and not more than with a good bus, $sent_usual" test "$sent_alone" -le $((sent_usual * 5 / 4))
errors=$(($(bus_field error_frames) - errors_before))
expect "for each there was an error, of $errors in all" test "$errors" -ge "$sent_alone"
tell_adapter joined
wait_for 5 "the controller is well again" fault_is_gone bus_error_passive
expect_recovered

step "bus-off"  # [F44]
wait_until_closed
downs_before=$(fault_count internal_bus_down)
off_at=$EPOCHREALTIME
tell_adapter busoff
expect_opened_by_itself "bus-off" "$off_at"
wait_for 5 "it says why" fault_came internal_bus_down "$downs_before"
restart_controller
expect_recovered

step "bus-off again and again"  # [F45]
wait_until_closed
storm_at=$EPOCHREALTIME
for ((i = 0; i < 5; ++i)); do
  tell_adapter busoff
  restart_controller
  sleep 3
done
wait_for 5 "it is one fault now that waits for somebody" fault_came bus_off_storm 0
wait_for 10 "everything is known anew" view_is_complete
expect "nobody has closed" test "$(ask_recording 'is_command && t > after + 1 && closed { ++n } END { print n + 0 }' -v "after=$storm_at")" -eq 0
expect "it cannot be cleared as long as it is one" not clear_faults
wait_for $((80 + 2 * key_period_s)) "but a minute later" clears_behind_key
lost_at=$EPOCHREALTIME
expect_open_until_key

step "an adapter that takes nothing any more"  # [F49]
wait_until_closed
stall_at=$EPOCHREALTIME
tell_adapter stall
expect_opened_by_itself "stalled adapter" "$stall_at"
wait_for 5 "the daemon has opened, too" phase_is open
sleep 2
going_at=$EPOCHREALTIME
tell_adapter go
wait_for 10 "the daemon's word is heard again" is_heard_since "$going_at"
sleep 1
# Commands that were on their way when it stalled come now, and nobody can call them back: as many as there are in the time in which
# the daemon sees that its modules are silent, and right behind them the one that opens. A unit that waits for an open command after
# a time-out (docs/bus-protocol.md) does not obey them at all; this one does.
stale=$(ask_recording 'is_command && t > after && closed { ++n } END { print n + 0 }' -v "after=$going_at")
closed_ms=$(ask_recording 'is_status && t > after { if (closed && !since) since = t; if (!closed && since) { sum += t - since; since = 0 } } END { printf "%.0f", sum * 1000 }' -v "after=$going_at")
measured+=("stalled adapter: $stale old commands, obeyed for $closed_ms ms")
expect "$stale old commands, at most those of 300 ms" test "$stale" -le 6
expect "obeyed for $closed_ms ms, less than a contactor takes to close" test "$closed_ms" -le 10
# Behind them the rule is the usual one.
lost_at=$(ask_recording 'is_command && t > after && closed { last = t } END { printf "%.6f", last ? last : after }' -v "after=$going_at")
expect_recovered

step "pulled out, and back"  # [F41]
wait_until_closed
unplugged_at=$EPOCHREALTIME
unplug
expect_opened_by_itself "pulled out" "$unplugged_at"
wait_for 5 "the daemon has opened, too" phase_is open
expect "the interface is gone" not test -e "/sys/class/net/$own_bus"
plug_in
expect_recovered

step "end"
wait_until_closed
expect_stopped_well
expect_opened_by_command "systemctl stop" "$(stopping_at)" 300
unplug
stop mmusim || true
tell_measured
