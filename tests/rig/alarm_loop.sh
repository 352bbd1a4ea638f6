#!/bin/bash
# Guest script: the way of opening that needs no daemon. The modules' alarm outputs are in the enable loop of the power distribution unit;
# with the pack closed the daemon is frozen while its last command is repeated (alarm_loop/live_sender.cpp), as if its decision hung
# and its sending went on. That keeps the pack closed, until a cell is overcharged; then it opens and stays open.
#   usage: alarm_loop.sh REPOSITORY LIVE_SENDER PROGRAM_FOLDER...   (the folders of bmud, mmusim, bmuctl and bmudump)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 live_sender=$2
shift 2
for folder in "$@"; do PATH=$folder:$PATH; done

bus=vcan0
scenario=$RIG_OUT/keys.scn
# shellcheck source-path=SCRIPTDIR source=pack-env.sh
source "$(dirname "$0")/pack-env.sh"

# Fifteen times as long as a command lives.
hold_s=3
# 3.3 s (docs/safety.md), and what the emulated machine may be late.
alarm_limit_ms=5000
# Of each second the sender has 50; an emulated machine may be late.
least_commands=$((hold_s * 25))

# Not in the output folder: a queue of words cannot be on the host.
events=/run/pack.events
tell_pack() { echo "$1" >&"$to_pack"; }

start_daemon() {
  start bmud as_service bmud --lock-memory --config "$pack" --bus-internal "$bus" --bus-vehicle "$bus" --socket "$socket" --log-level info
  daemon=${started_pids[bmud]}
}

start_sender() {
  start sender "$live_sender" "$bus"
  # Like the pack, it is never later than it would be on a desk.
  chrt -f -p 55 "${started_pids[sender]}"
}
sender_has_command() { grep -q "has a command" "$RIG_OUT/sender.log"; }

# Of what was recorded after AFTER: commands that close, and words "closed" and "alarm loop open" of the power distribution unit.
closing_commands_since() { ask_recording 'is_command && t > after && closed { ++count } END { print count + 0 }' -v "after=$1"; }
is_closed_since() { ask_recording 'is_status && t > after && closed { found = 1 } END { exit !found }' -v "after=$1"; }
is_alarm_told() { ask_recording 'is_status { told = substr(data, 3, 1) ~ /[89A-F]/ } END { exit !told }'; }
is_loop_closed() { ! is_alarm_told; }
is_still_closed() { ! is_open_since "$1" && is_closed_on_bus; }
stays_open() { ! is_closed_since "$1"; }

step "start"
mkdir -p "$(dirname "$socket")"
write_keys "$scenario"
echo "0 pdu alarm_loop on" >>"$scenario"
mkfifo "$events"
# Open at both ends, so that neither waits for the other.
exec {to_pack}<>"$events"
record_words
start_pack "$scenario" --events "$events"
start_daemon
wait_for "$start_limit_s" "bmud answers" daemon_answers
start_sender
wait_for 10 "the live sender has a command" sender_has_command

step "a frozen daemon with a live sender"
wait_until_closed
gaps_before=$(fault_count control_loop_gap)
alarms_before=$(fault_count alarm_loop_open)
expect "they still are when it is frozen" is_closed_on_bus
frozen_at=$EPOCHREALTIME
kill -STOP "$daemon"
kill -USR1 "${started_pids[sender]}"
sleep "$hold_s"
expect "the live sender sends" running sender
expect "and commands the contactors to close" test "$(closing_commands_since "$frozen_at")" -ge "$least_commands"
expect "the pack has stayed closed for $hold_s s" is_still_closed "$frozen_at"
expect "the alarm loop is closed" is_loop_closed

step "an overcharged cell"
overcharged_at=$EPOCHREALTIME
tell_pack "cell 1.2 voltage_mV 4600"
wait_for 15 "the power distribution unit says open" is_open_since "$overcharged_at"
read -r opened_at _ why <<<"$(first_opening "$overcharged_at")"
lapse_ms=$(awk "BEGIN { printf \"%.0f\", ($opened_at - $overcharged_at) * 1000 }")
measured+=("overcharged: $lapse_ms ms")
expect "it opened by itself, after $lapse_ms ms" test "$why" = timeout
expect "within $alarm_limit_ms ms" test "$lapse_ms" -le "$alarm_limit_ms"
expect "and says that the alarm loop is open" is_alarm_told
sleep "$hold_s"
expect "which it is still commanded to close" test "$(closing_commands_since "$opened_at")" -ge "$least_commands"
expect "the pack has stayed open" stays_open "$opened_at"

step "the daemon goes on"
stop sender || true
kill -CONT "$daemon"
expect_gap_told "$gaps_before"
wait_for 5 "and it names the alarm loop" fault_came alarm_loop_open "$alarms_before"
expect "the pack has stayed open" stays_open "$opened_at"

step "end"
expect "bmud exits with 0" stop bmud TERM
stop mmusim || true
stop words || true
tell_measured
