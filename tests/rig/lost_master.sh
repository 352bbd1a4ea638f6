#!/bin/bash
# Guest script: bmud is killed, stopped, starved and frozen, and its bus is taken away, each time with the pack closed. Somebody who
# only listens measures on the bus how long after the last command the contactors open; a daemon that goes on must say "open" first and
# may close again only for a new wish. The machine's own: it changes how the scheduler treats real-time programs.
#   usage: lost_master.sh REPOSITORY PROGRAM_FOLDER...   (the folders of bmud, mmusim, bmuctl and bmudump)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1
shift
for folder in "$@"; do PATH=$folder:$PATH; done

bus=vcan0
pack=$repository/config/packs/demo-48s.json
socket=/run/bmud/bmud.sock
recording=$RIG_OUT/lost.can.log
scenario=$RIG_OUT/keys.scn

# The key goes off and on again every 20 s. It stays on for longer than a pack that was opened waits before it may close again (10 s):
# whoever closes by himself would do it in that time.
key_period_s=20
key_on_s=18
lock_out_s=10
keys=9
# The command's life at the power distribution unit, and what its contactors take to open (docs/scenarios.md).
command_life_ms=200
contactor_opening_ms=10
# One step of the emulated pack, and its turn on the emulated machine's one processor.
machine_late_ms=10
start_limit_s=30
close_limit_s=$((key_period_s + 15))

# --- how the programs are asked ---

status_json() { bmuctl --socket "$socket" status --json; }
daemon_answers() { status_json >/dev/null 2>&1; }
phase_is() { [[ $(status_json 2>/dev/null | jq -r .state.phase) == "$1" ]]; }
view_is_complete() { status_json | jq -e '.complete_cycles >= 3 and .modules_answering == 4' >/dev/null; }
fault_count() { bmuctl --socket "$socket" faults --json | jq -e --arg name "$1" '.faults[] | select(.name == $name) | .count_since_start'; }
fault_came() { (($(fault_count "$1") > $2)); }

# --- what the recording says ---

# Reads it frame by frame: t its time in s; is_command, is_status; closed: any of the four contactors; key, by_timeout of PDU_STATUS.
ask_recording() {
  local question=$1
  shift
  awk "$@" '
    { t = substr($1, 2, length($1) - 2) + 0; is_command = $3 ~ /^040#/; is_status = $3 ~ /^041#/; data = substr($3, 5) }
    is_command || is_status { closed = substr(data, 2, 1) != "0" }
    is_status { key = substr(data, 4, 1) ~ /[13579BDF]/; by_timeout = substr(data, 1, 1) ~ /[89A-F]/ }
    '"$question" "$recording"
}

# Only what is asked for: the recording is read again and again.
record_words() { exec candump -D -r 1000000 -L "$bus,040:7FF,041:7FF" >"$recording"; }
hears_words() { grep -Eqh "^ *$bus +041 .*raw" /proc/net/can/rcvlist_{sff,fil}; }

# The first word "open" of the power distribution unit after AFTER: its time, that of the last command before it, "timeout" or "command".
first_opening() {
  ask_recording '
    is_command { command = t }
    is_status && t > after && !closed && !done { printf "%.6f %.6f %s\n", t, command, by_timeout ? "timeout" : "command"; done = 1 }' -v "after=$1"
}
is_open_since() { [[ -n $(first_opening "$1") ]]; }
first_word() { ask_recording 'is_status && t > after && !done { print closed ? "closed" : "open"; done = 1 }' -v "after=$1"; }
is_heard_since() { [[ -n $(first_word "$1") ]]; }
# Commands after AFTER, up to the key's next turn to on: the first of them, how many close, and how long the key was on.
commands_until_key() {
  ask_recording '
    t <= after || is_over { next }
    is_status { if (key && was_off) is_over = 1; if (!key && !was_off) { was_off = 1; off_at = t } }
    is_command { if (!count++) first = closed ? "closed" : "open"; if (closed) ++closing }
    END { printf "%s %d %.0f\n", count ? first : "none", closing, (is_over ? off_at : 0) - after }' -v "after=$1"
}
key_turned_since() { [[ $(commands_until_key "$1") != *" -"* ]]; }

# --- one case ---

measured=()

# From the last command until the contactors' word "open"; the bound is the unit's own.
expect_opened_by_itself() {
  local name=$1 after=$2 opened_at command_at why lapse_ms
  wait_for 10 "the power distribution unit says open" is_open_since "$after"
  read -r opened_at command_at why <<<"$(first_opening "$after")"
  lapse_ms=$(awk "BEGIN { printf \"%.1f\", ($opened_at - $command_at) * 1000 }")
  measured+=("$name: $lapse_ms ms")
  echo "  $name: open $lapse_ms ms after the last command, by $why"
  expect "it opened by itself" test "$why" = timeout
  expect "not before the command's life was over" test "${lapse_ms%.*}" -ge "$command_life_ms"
  expect "and at once then" test "${lapse_ms%.*}" -le $((command_life_ms + contactor_opening_ms + machine_late_ms))
  lost_at=$command_at
}

# The key is turned off and on, and only that closes.
expect_open_until_key() {
  local first closing on_s
  wait_for "$((key_period_s + 5))" "the key is turned" key_turned_since "$lost_at"
  read -r first closing on_s <<<"$(commands_until_key "$lost_at")"
  expect "the first command after it is open" test "$first" = open
  expect "none closes before the key is turned" test "$closing" -eq 0
  expect "though it stayed on for longer than the lock-out ($on_s s)" test "$on_s" -gt "$lock_out_s"
}

expect_gap_told() {
  wait_for 5 "control_loop_gap is told" fault_came control_loop_gap "$1"
  wait_for 5 "everything is known anew" view_is_complete
  expect "and the contactors are open" phase_is open
}

# What waits for it is cleared as somebody would; whether it may be is the daemon's to say.
clear_faults() { bmuctl --socket "$socket" clear >>"$RIG_OUT/clear.txt"; }

start_daemon() {
  local daemon_bus=${1:-$bus}
  start bmud bmud --config "$pack" --bus-internal "$daemon_bus" --bus-vehicle "$daemon_bus" --socket "$socket" --log-level info
  daemon=${started_pids[bmud]}
}

wait_until_closed() { wait_for "$close_limit_s" "the contactors are closed" phase_is closed; }

# Holds the daemon by the first command, lets it go by the second, each a function.
hold_and_let_go() {
  local name=$1 hold=$2 let_go=$3 gaps_before held_at
  step "$name"
  wait_until_closed
  gaps_before=$(fault_count control_loop_gap)
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

write_scenario() {
  local i
  grep '^0 ' "$repository/vcan-fixtures/calm.scn" >"$scenario"
  for ((i = 0; i < keys; ++i)); do
    echo "$((4 + i * key_period_s)) vehicle on"
    echo "$((4 + i * key_period_s + key_on_s)) vehicle off"
  done >>"$scenario"
}

step "start"
mkdir -p "$(dirname "$socket")"
write_scenario
# The hog must have the processor to itself, and who measures must not wait for anybody.
echo -1 >/proc/sys/kernel/sched_rt_runtime_us
# Frames that do not get through at once are handed on by a thread of the kernel, which the hog would starve as well.
for name in /proc/[0-9]*/comm; do
  if [[ $(cat "$name" 2>/dev/null) == ksoftirqd/* ]]; then chrt -f -p 70 "$(basename "$(dirname "$name")")"; fi
done
start lost record_words
wait_for 10 "candump listens" hears_words
chrt -f -p 50 "${started_pids[lost]}"
start mmusim mmusim --bus "$bus" --pack "$pack" --scenario "$scenario"
chrt -f -p 60 "${started_pids[mmusim]}"
start_daemon
wait_for "$start_limit_s" "bmud answers" daemon_answers

step "killed"
wait_until_closed
killed_at=$EPOCHREALTIME
stop bmud KILL || true
expect_opened_by_itself "killed" "$killed_at"
start_daemon
wait_for "$start_limit_s" "bmud answers" daemon_answers
wait_for 10 "everything is known anew" view_is_complete
clear_faults
expect_open_until_key

hold_and_let_go "stopped by SIGSTOP" stop_daemon continue_daemon
hold_and_let_go "starved by a real-time program" starve_daemon feed_daemon
hold_and_let_go "frozen in its control group" freeze_daemon thaw_daemon

step "bus down"
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

step "its interface down"
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

step "end"
expect "bmud exits with 0" stop bmud TERM
stop mmusim || true
stop lost || true
printf '  %s\n' "${measured[@]}" | tee "$RIG_OUT/measured.txt"
