#!/bin/bash
# Guest script: how the process of the installed service ends, with an emulated pack whose contactors are closed again for each case. It is
# killed, crashed, stopped for good, stuck, short of memory and of processor, restarted too often, and told to end; a system call of its
# control loop fails. A program that only listens measures on the bus when the contactors open. What the packages do is in
# service_package.sh. Needs systemd as the machine's first program.
#   usage: service.sh REPOSITORY PACKAGES   (a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 packages=$2
scenario=$RIG_OUT/keys.scn
# shellcheck source-path=SCRIPTDIR source=service-env.sh
source "$(dirname "$0")/service-env.sh"

watchdog_ms=500
command_period_ms=50
# systemd lets its timers be this late, to wake for several at once: the accuracy of sd_event_add_time(3) where none is given, as its
# watchdog does. How much of it is used depends on the identifier of the boot.
timer_late_ms=250
turn_ms=100

# A process that ends while the pack is closed.
end_while_closed() {
  local name=$1 before at
  shift
  step "$name"
  wait_until_closed
  before=$(main_pid)
  at=$EPOCHREALTIME
  "$@" "$before"
  expect_opened_by_itself "$name" "$at"
  expect_successor "$before"
}

# Too little is left for what it has: the kernel ends it. The next one has room again.
take_memory() {
  local group
  group=/sys/fs/cgroup$(property ControlGroup)
  echo 1M >"$group/memory.max"
  wait_for 10 "the kernel has ended it" is_new_process "$1"
}

# hold_loop PID: strace holds the first thread, which is the control loop, in one of its next waits, for longer than the watchdog's time.
# The daemon's other threads go on.
hold_loop() { start strace strace -qq -ttt -o "$RIG_OUT/strace.txt" -p "$1" -e inject=epoll_wait:delay_enter=5s:when=3; }
# fail_wait PID: each wait of the control loop fails from now on.
fail_wait() { start strace strace -qq -ttt -o "$RIG_OUT/strace.txt" -p "$1" -e inject=epoll_wait:error=EIO; }
failed_at() { awk '/INJECTED/ { print $1; exit }' "$RIG_OUT/strace.txt"; }

watchdog_at() { journalctl -q --no-pager -o short-unix -u bmud | awk '/Watchdog timeout/ { at = $1 } END { print at }'; }

step "install"
expect "the packages are installed" install_packages
read_ahead strace

step "start"
start_service
pid=$(main_pid)
expect_sandboxed

# Another process begins while the key is still on, and closes only when it has been turned.
end_while_closed "killed" kill -KILL  # [F59][F64]
end_while_closed "crashed" kill -SEGV  # [F62]
end_while_closed "aborted" kill -ABRT  # [F62]
end_while_closed "out of memory" take_memory  # [F66]
expect "it was for want of memory" log_has 'oom-kill'

step "stopped by SIGSTOP"  # [F61]
wait_until_closed
before=$(main_pid)
stopped_at=$EPOCHREALTIME
kill -STOP "$before"
expect_opened_by_itself "stopped by SIGSTOP" "$stopped_at"
wait_for 15 "the watchdog has ended it" is_new_process "$before"
expect "it was the watchdog" log_has "Watchdog timeout (limit ${watchdog_ms}ms)"
ended_after_ms=$(awk "BEGIN { printf \"%.0f\", ($(watchdog_at) - $stopped_at) * 1000 }")
measured+=("stopped by SIGSTOP: the watchdog's time was over after $ended_after_ms ms")
expect "after $ended_after_ms ms: its time, and how late systemd may be" test "$ended_after_ms" -le $((watchdog_ms + timer_late_ms + turn_ms))
expect_successor "$before"

step "stuck in its loop"  # [F61]
wait_until_closed
before=$(main_pid)
stuck_at=$EPOCHREALTIME
timeouts_before=$(log_count "Watchdog timeout")
hold_loop "$before"
expect_opened_by_itself "stuck in its loop" "$stuck_at"
wait_for 15 "the watchdog has ended it" is_new_process "$before"
expect "it was the watchdog" test "$(log_count "Watchdog timeout")" -gt "$timeouts_before"
stop strace || true
ended_after_ms=$(awk "BEGIN { printf \"%.0f\", ($(watchdog_at) - $lost_at) * 1000 }")
measured+=("stuck in its loop: the watchdog's time was over $ended_after_ms ms after the last command")
# It may have fed its watchdog for the last time just before the next command.
expect "$ended_after_ms ms after the last command: its time, and how late systemd may be" test "$ended_after_ms" -le $((watchdog_ms + command_period_ms + timer_late_ms + turn_ms))
expect_successor "$before"

step "a call that the control loop needs fails"  # [F71]
wait_until_closed
before=$(main_pid)
fail_wait "$before"
wait_for 15 "it has ended, and another one has begun" is_new_process "$before"
stop strace || true
expect_opened_by_command "a failing call" "$(failed_at)" $((2 * command_period_ms))
expect "it ended with the error" log_has 'code=exited, status=71'
expect "which is in the log" log_has 'epoll_wait: Input/output error'
expect_successor "$before"

step "no processor left"  # [F67]
wait_until_closed
before=$(main_pid)
group=/sys/fs/cgroup$(property ControlGroup)
is_held_back() { grep -q '^nr_throttled [1-9]' "$group/cpu.stat"; }
expect "it was never held back before" not is_held_back
starved_at=$EPOCHREALTIME
# One turn of a millisecond, and then none for the rest of the second.
echo "1000 1000000" >"$group/cpu.max"
wait_for 5 "the kernel holds it back" is_held_back
expect_opened_by_itself "no processor left" "$starved_at"
# Its watchdog's time is over then, too, and the next one has its turns again.
sleep 0.5
[[ ! -e $group ]] || echo max >"$group/cpu.max"
lapse_ms=$(awk "BEGIN { printf \"%.1f\", ($(first_opening "$starved_at" | cut -d' ' -f1) - $starved_at) * 1000 }")
measured+=("no processor left: $lapse_ms ms in all")
expect "open $lapse_ms ms after the last of it was taken" test "${lapse_ms%.*}" -le 300
expect_successor "$before"

step "killed again and again"  # [F65]
wait_until_closed
before=$(main_pid)
# What was started until now does not count.
systemctl reset-failed bmud
stormed_at=$EPOCHREALTIME
for ((kills = 0; kills < 12; ++kills)); do
  [[ $before != 0 ]] || break
  kill -KILL "$before" 2>/dev/null || true
  wait_for 15 "it is over, or begun anew" is_over_or_new "$before"
  ! is_active failed || break
  before=$(main_pid)
done
expect "systemd gives up" is_active failed
expect "after six new ones: $kills" test "$kills" -eq 6
expect "and says that they were too many" log_has 'Start request repeated too quickly'
expect "nobody has closed since" test "$(commands_until_key "$stormed_at" | cut -d' ' -f2)" -le 4
wait_for 10 "the pack is open" is_open_since "$stormed_at"
lost_at=$(first_opening "$stormed_at" | cut -d' ' -f1)
systemctl reset-failed bmud
systemctl start bmud
wait_until_serving
clear_faults
expect_open_until_key

step "systemctl stop"  # [F63]
wait_until_closed
systemctl stop bmud
expect_opened_by_command "systemctl stop" "$(stopping_at)" 300
expect "it ended well" test "$(property Result):$(property ExecMainStatus)" = success:0
ended_ms=$((($(property ExecMainExitTimestampMonotonic) - $(property ActiveExitTimestampMonotonic)) / 1000))
measured+=("systemctl stop: ended after $ended_ms ms")
expect "after $ended_ms ms, at most 300" test "$ended_ms" -le 300

step "end"
stop mmusim || true
tell_measured
