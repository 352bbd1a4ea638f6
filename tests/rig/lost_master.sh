#!/bin/bash
# Guest script: bmud is killed, stopped, starved and frozen, and its bus is taken away, each time with the pack closed. Somebody who
# only listens measures on the bus how long after the last command the contactors open; a daemon that goes on must say "open" first and
# may close again only for a new wish. The machine's own: it changes how the scheduler treats real-time programs. This is the program by
# itself; service.sh kills, stops and starves the installed service, from its packages and in its sandbox.
#   usage: lost_master.sh [--short] REPOSITORY PROGRAM_FOLDER...   (the folders of bmud, mmusim, bmuctl and bmudump)
#   --short: only killed and stopped
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

is_short=no
if [[ $1 == --short ]]; then
  is_short=yes
  shift
fi
repository=$1
shift
for folder in "$@"; do PATH=$folder:$PATH; done

bus=vcan0
scenario=$RIG_OUT/keys.scn
# shellcheck source-path=SCRIPTDIR source=pack-env.sh
source "$(dirname "$0")/pack-env.sh"

# With its memory locked: a page of the program that is first needed while the pack is closed would come from the host's disk, and while
# the emulated machine waits for that its clock runs ahead, which is a gap in the control loop that no part of the test has made.
start_daemon() {
  local daemon_bus=${1:-$bus}
  start bmud as_service bmud --lock-memory --config "$pack" --bus-internal "$daemon_bus" --bus-vehicle "$daemon_bus" --socket "$socket" --log-level info
  daemon=${started_pids[bmud]}
}

# Holds the daemon by the first command, lets it go by the second, each a function.
hold_and_let_go() {
  local name=$1 hold=$2 let_go=$3 gaps_before held_at
  step "$name"
  wait_until_closed
  gaps_before=$(fault_count control_loop_gap)
  expect "they still are when it is held" is_closed_on_bus
  held_at=$EPOCHREALTIME
  "$hold"
  expect_opened_by_itself "$name" "$held_at"
  "$let_go"
  expect_gap_told "$gaps_before"
  expect "it is the same daemon" running bmud
  clear_faults
  expect_open_until_key
}

stop_daemon() { kill -STOP "$daemon"; }
continue_daemon() { kill -CONT "$daemon"; }

# A program of higher priority, which never waits, on a machine of one processor; we must be above it to end it.
spin() { exec chrt -f 30 bash -c 'while :; do :; done'; }
starve_daemon() {
  chrt -f -p 40 $$
  start hog spin
}
feed_daemon() {
  stop hog KILL || true
  chrt -o -p 0 $$
}

freeze_daemon() {
  mkdir -p /run/cgroup
  mount -t cgroup2 cgroup2 /run/cgroup
  mkdir /run/cgroup/bmud
  echo "$daemon" >/run/cgroup/bmud/cgroup.procs
  echo 1 >/run/cgroup/bmud/cgroup.freeze
}
thaw_daemon() { echo 0 >/run/cgroup/bmud/cgroup.freeze; }

end_programs() {
  step "end"
  expect "bmud exits with 0" stop bmud TERM
  stop mmusim || true
  stop words || true
  tell_measured
}

step "start"
mkdir -p "$(dirname "$socket")"
write_keys "$scenario"
# The hog must have the processor to itself, and who measures must not wait for anybody.
echo -1 >/proc/sys/kernel/sched_rt_runtime_us
# Frames that do not get through at once are handed on by a thread of the kernel, which the hog would starve as well.
for name in /proc/[0-9]*/comm; do
  if [[ $(cat "$name" 2>/dev/null) == ksoftirqd/* ]]; then chrt -f -p 70 "$(basename "$(dirname "$name")")"; fi
done
record_words
start_pack "$scenario"
start_daemon
wait_for "$start_limit_s" "bmud answers" daemon_answers

step "killed"  # [F59]
wait_until_closed
killed_at=$EPOCHREALTIME
stop bmud KILL || true
expect_opened_by_itself "killed" "$killed_at"
start_daemon
wait_for "$start_limit_s" "bmud answers" daemon_answers
wait_for 10 "everything is known anew" view_is_complete
clear_faults
expect_open_until_key

hold_and_let_go "stopped by SIGSTOP" stop_daemon continue_daemon  # [F60]
if [[ $is_short == yes ]]; then
  wait_until_closed
  end_programs
  exit 0
fi
hold_and_let_go "starved by a real-time program" starve_daemon feed_daemon  # [F67]
hold_and_let_go "frozen in its control group" freeze_daemon thaw_daemon  # [F60]

step "bus down"  # [F40]
wait_until_closed
downs_before=$(fault_count internal_bus_down)
ip link set "$bus" down
wait_for 5 "bmud has opened" phase_is open
expect "and says why" fault_came internal_bus_down "$downs_before"
# Longer than the command lives; on a bus that is down nobody can be heard.
sleep 0.5
up_at=$EPOCHREALTIME
ip link set "$bus" up
wait_for 10 "the power distribution unit is heard again" is_heard_since "$up_at"
expect "its first word is open" test "$(first_word "$up_at")" = open
wait_for 10 "everything is known anew" view_is_complete
expect "it is the same daemon" running bmud
clear_faults
lost_at=$up_at
expect_open_until_key
wait_until_closed
expect "bmud exits with 0" stop bmud TERM

step "its interface down"  # [F40]
# Two interfaces of one bus, joined by the kernel: the others go on hearing each other, and can be heard.
own_bus=vcan1
ip link add "$own_bus" type vcan && ip link set "$own_bus" mtu 16 up
cangw -A -s "$bus" -d "$own_bus" -e
cangw -A -s "$own_bus" -d "$bus" -e
start_daemon "$own_bus"
wait_for "$start_limit_s" "bmud answers" daemon_answers
clear_faults
wait_until_closed
downs_before=$(fault_count internal_bus_down)
down_at=$EPOCHREALTIME
ip link set "$own_bus" down
expect_opened_by_itself "its interface down" "$down_at"
wait_for 5 "bmud has opened" phase_is open
expect "and says why" fault_came internal_bus_down "$downs_before"
ip link set "$own_bus" up
wait_for 10 "everything is known anew" view_is_complete
expect "it is the same daemon" running bmud
clear_faults
expect_open_until_key
wait_until_closed

end_programs
