#!/bin/bash
# Guest script: what else a machine and a bus do to the installed service while its pack is closed. Signals without end, floods of error
# frames, of a babbling node and of frames that it listens to, a receive queue that overflows while it is stopped for a moment, sends that
# fail for moments, a service manager that is gone, which it must bear; and what it cannot bear: frames lost while it was stopped for
# longer, a way that delays everything, a cable that lost its other end, an interface that comes back while no socket is to be had. Needs
# systemd as the machine's first program.
#   usage: surroundings.sh REPOSITORY PACKAGES   (a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 packages=$2
scenario=/run/keys.scn
# shellcheck source-path=SCRIPTDIR source=service-env.sh
source "$(dirname "$0")/service-env.sh"

# The daemon's own way to the bus: a virtual cable whose other end is joined with it.
own_bus=vxcan0 far_end=vxcan1
# Two periods of commands: whoever has let so much time pass has missed one. And how long the loop may be away before it opens.
two_commands_ms=99 gap_ms=130
plug_in() {
  ip link add "$own_bus" type vxcan peer name "$far_end"
  ip link set "$own_bus" mtu 16 up
  ip link set "$far_end" mtu 16 up
  cangw -A -s "$bus" -d "$far_end" -e
  cangw -A -s "$far_end" -d "$bus" -e
}

# From flood0 to the cable, each frame so many times; until the cable is removed.
copies=8
join_flood() {
  local i
  for ((i = 0; i < copies; ++i)); do cangw -A -s flood0 -d "$far_end" -e; done
}
# Cells with a wrong checksum, of a node that the pack does not have: each is taken, checked and refused.
refused_frame=170#2710271027101F00

answers_missed() { status_json | jq '[.modules[].answers_missed] | add'; }
frames_refused() { status_json | jq '.receive.rejected'; }
sends_failed() { status_json | jq '.ports[0].sends_failed'; }
frames_lost() { status_json | jq '.ports[0].frames_lost'; }
has_lost() { (($(frames_lost) >= $1)); }
knows_nothing() {
  status_json | jq -e '.modules_answering == 0 and .values.pack_voltage_mV == null and .values.current_mA == null and .state.feedback == null' >/dev/null
}
received_file=/sys/class/net/$own_bus/statistics/rx_packets
told_in_vain() { (($(status_json | jq .daemon.notify_sends_failed) > 0)); }
has_counted_errors() { (($(status_json | jq '.ports[0].error_frames') >= $1)); }
has_refused() { (($(frames_refused) >= $1)); }

second_free_descriptor() {
  local folder number=0 free=0
  folder=/proc/$pid/fd
  while :; do
    [[ -e $folder/$number ]] || [[ -L $folder/$number ]] || ((++free < 2)) || break
    ((++number))
  done
  echo "$number"
}

# The pack is closed before and after, nothing was judged late, and nothing forgotten.
expect_borne() {
  local name=$1
  expect "$name: the pack is still closed" phase_is closed
  expect "$name: everything is known" view_is_complete
  expect "$name: the loop was never away" test "$(fault_count control_loop_gap)" = 0
}

# Nobody ever writes to what it reads.
pass() { [[ $1 == 0 ]] || ! read -r -t "$1" -u "$silence"; }
ticks_late() { status_json | jq .daemon.ticks_late; }
# stop_again_and_again COUNT LENGTH_S. Sets: seen_stopped, how often the daemon was seen stopped before it went on. Shell builtins only: a
# program that is started meanwhile may wait for the host's disk, and the daemon would be held for as long.
stop_again_and_again() {
  local count=$1 length_s=$2 stat
  seen_stopped=0
  while ((count-- > 0)); do
    kill -STOP "$pid"
    pass "$length_s"
    read -r stat <"/proc/$pid/stat"
    # The name before the state may hold anything, but for this.
    if [[ ${stat##*) } == T* ]]; then ((++seen_stopped)); fi
    kill -CONT "$pid"
    pass "$length_s"
  done
}
# The longest time between two commands since AFTER.
longest_silence_ms() {
  ask_recording 'is_command && t > after { if (last && t - last > longest) longest = t - last; last = t } END { printf "%.0f", longest * 1000 }' -v "after=$1"
}
expect_no_command_missed() {
  local name=$1 after=$2 limit_ms=$3 silence_ms
  silence_ms=$(longest_silence_ms "$after")
  measured+=("$name: $silence_ms ms between two commands")
  expect "$name: $silence_ms ms between two commands, at most $limit_ms" test "$silence_ms" -le "$limit_ms"
}

# The unit's own clock opens, for it hears nothing new; the daemon has noticed, too.
expect_opened() {
  expect_opened_by_itself "$1" "$2"
  wait_for 5 "$1: the daemon has opened, too" phase_is open
}

# A frame so many times on a bus, as fast as it goes. Sets: rate, in frames a second.
play() {
  local to=$1 count=$2 frame=$3 file=/run/flood.log began
  awk -v count="$count" -v line="(0.000000) $to $frame" 'BEGIN { while (count--) print line }' >"$file"
  began=$EPOCHREALTIME
  canplayer -t -g 0 -I "$file" || fail "canplayer refused $file"
  rate=$(awk "BEGIN { printf \"%.0f\", $count / ($EPOCHREALTIME - $began) }")
}

step "start"
expect "the packages are installed" install_packages
read_ahead canplayer tc prlimit
plug_in
prepare_service
serve_in_real_time
expect_sandboxed

mkfifo /run/silence
exec {silence}<>/run/silence

step "signals without end"  # [F72]
# A stop ends the wait for events early, and whatever else its threads wait in, though no handler runs.
wait_until_closed
missed_before=$(answers_missed)
signals_at=$EPOCHREALTIME
stops=1000
stop_again_and_again "$stops" 0
expect "it was stopped $seen_stopped times, each time anew" test "$seen_stopped" -eq "$stops"
expect_borne "short stops"
expect "no answer was missed" test "$(answers_missed)" -eq "$missed_before"
expect_no_command_missed "short stops" "$signals_at" "$two_commands_ms"
# Longer than a tick, shorter than the gap that opens.
wait_until_closed
late_before=$(ticks_late)
signals_at=$EPOCHREALTIME
stops=30
stop_again_and_again "$stops" 0.06
expect "it was stopped $seen_stopped times, each time anew" test "$seen_stopped" -eq "$stops"
expect "decisions were late for it" test "$(ticks_late)" -gt "$late_before"
expect_borne "longer stops"
expect_no_command_missed "longer stops" "$signals_at" "$gap_ms"

step "reloads without end"  # [F72]
wait_until_closed
hash_before=$(config_hash)
missed_before=$(answers_missed)
signals_at=$EPOCHREALTIME
reloads=500
for ((i = 0; i < reloads; ++i)); do kill -HUP "$pid"; done
expect_borne "reloads"
wait_for 10 "each of $reloads was refused, and is in the log" log_count_is "$reloads" 'with SIGHUP refused: contactors not open'
expect "the same file counts" test "$(config_hash)" = "$hash_before"
expect "no answer was missed" test "$(answers_missed)" -eq "$missed_before"
expect_no_command_missed "reloads" "$signals_at" "$two_commands_ms"

step "error frames without end"  # [F54]
# A controller's own word to its machine, which no bus carries: it comes out of the cable.
wait_until_closed
errors=20000
play "$far_end" "$errors" 20000088#0000080000000000
measured+=("error frames: $rate a second")
expect_borne "error frames"
wait_for 10 "each has been counted" has_counted_errors "$errors"

step "a node that babbles"  # [F51]
wait_until_closed
play "$bus" 20000 000#
measured+=("babbling: $rate a second")
expect_borne "babbling"

step "a flood of frames that the daemon listens to"  # [F52]
# As many as this machine carries, which is somewhat less than the 21,000 a second of a full bus of 1 Mbit/s. No program here sends half of
# that: the kernel makes several of each, on their way to the daemon.
ip link add flood0 type vcan
ip link set flood0 up
join_flood
wait_until_closed
refused_before=$(frames_refused)
missed_before=$(answers_missed)
flood_at=$EPOCHREALTIME
flood=15000
play flood0 "$flood" "$refused_frame"
flood_rate=$((rate * copies))
measured+=("flood: $flood_rate a second")
expect_borne "flood"
# By the machine's own clock, which a busy host does not make slower.
expect "it was a flood: $flood_rate frames a second, at least 10000" test "$flood_rate" -ge 10000
wait_for 10 "each has been refused" has_refused $((refused_before + flood * copies))
expect "no answer was missed" test "$(answers_missed)" -eq "$missed_before"
expect_no_command_missed "flood" "$flood_at" "$two_commands_ms"

step "sends fail for moments"  # [F50]
# Its interface takes no frame for 60 ms, again and again.
wait_until_closed
sends_failed_before=$(sends_failed)
missed_at=$EPOCHREALTIME
refusals=10
{
  for ((i = 0; i < refusals; ++i)); do
    echo "qdisc replace dev $own_bus root pfifo limit 0"
    pass 0.06
    echo "qdisc del dev $own_bus root"
    pass 0.3
  done
} | tc -batch -
expect_borne "sends that fail for moments"
failed=$(($(sends_failed) - sends_failed_before))
measured+=("sends that fail for moments: $failed failed in $refusals times 60 ms")
expect "$failed sends failed in $refusals times, and are counted" test "$failed" -ge "$refusals"
expect_no_command_missed "sends that fail for moments" "$missed_at" "$gap_ms"

step "frames lost by its own machine"  # [F53]
# Some forty frames instead of thousands. A queue has its size from the socket's first moment, so the interface goes and comes back.
queue_limit_before=$(</proc/sys/net/core/rmem_max)
echo 16384 >/proc/sys/net/core/rmem_max
wait_until_closed
removed_at=$EPOCHREALTIME
ip link del "$own_bus"
expect_opened "interface removed for a short queue" "$removed_at"
plug_in
join_flood
expect_recovered
# Stopped for less than what opens, while a flood is on its way: nothing of that time is known, all of before is fresh.
wait_until_closed
lost_before=$(frames_lost)
told_before=$(fault_count frames_lost)
play flood0 4000 "$refused_frame" &
flood_pid=$!
read -r received_before <"$received_file"
while read -r received <"$received_file" && ((received < received_before + 2000)); do pass 0.001; done
stop_again_and_again 1 0.06
wait "$flood_pid" || fail "the flood has ended with an error"
expect "it was stopped" test "$seen_stopped" -eq 1
wait_for 10 "what was lost is counted" has_lost $((lost_before + 100))
measured+=("stopped for 60 ms in a flood: $(($(frames_lost) - lost_before)) frames lost")
expect "and is a warning" fault_came frames_lost "$told_before"
expect_borne "frames lost in 60 ms"
# For longer, and when it goes on nobody is on the bus any more: what it knows then, it would have from the time that it has missed.
wait_until_closed
lost_before=$(frames_lost)
gaps_before=$(fault_count control_loop_gap)
# The service manager would end it after half a second.
systemctl service-watchdogs no
stopped_at=$EPOCHREALTIME
kill -STOP "$pid"
play flood0 1000 "$refused_frame"
expect_opened_by_itself "frames lost while it was stopped" "$stopped_at"
cangw -D -s "$bus" -d "$far_end" -e
kill -CONT "$pid"
# At once: what it had taken for news would be fresh for a while.
expect "it knows nothing of the pack" knows_nothing
wait_for 5 "the daemon has opened, too" phase_is open
expect "it knows that it was away" fault_came control_loop_gap "$gaps_before"
cangw -A -s "$bus" -d "$far_end" -e
wait_for 10 "each frame of the flood is counted as lost" has_lost $((lost_before + 1000 * copies))
expect_recovered
systemctl service-watchdogs yes
echo "$queue_limit_before" >/proc/sys/net/core/rmem_max

step "a way that delays everything"  # [F58]
wait_until_closed
delayed_at=$EPOCHREALTIME
tc qdisc add dev "$own_bus" root netem delay 300ms
expect_opened "delay of 300 ms" "$delayed_at"
# What is under way is of a closed pack: this unit obeys it when it arrives (docs/bus-protocol.md), and for the daemon, which has
# opened, a contact is closed that should not be. Whoever has looked at the pack may clear that.
sleep 1
tc qdisc del dev "$own_bus" root
sleep 1
lost_at=$(ask_recording 'is_command && t > after && closed { last = t } END { printf "%.6f", last ? last : after }' -v "after=$delayed_at")
old_ms=$(awk "BEGIN { printf \"%.0f\", ($lost_at - $(first_opening "$delayed_at" | cut -d' ' -f1)) * 1000 }")
measured+=("delay of 300 ms: the last old command $old_ms ms behind the opening")
expect "the last old command is $old_ms ms behind the opening, no more than was under way" test "$old_ms" -le 600
expect_recovered_by clear_with_authority

step "a cable that lost its other end"  # [F57]
wait_until_closed
lost_end_at=$EPOCHREALTIME
ip link set "$far_end" down
expect_opened "other end down" "$lost_end_at"
ip link set "$far_end" up
expect_recovered

step "no socket to be had for an interface that comes back"  # [F70]
wait_until_closed
gaps_before=$(fault_count control_loop_gap)
removed_at=$EPOCHREALTIME
ip link del "$own_bus"
expect_opened "interface removed" "$removed_at"
sleep 1
expect "looking for it again and again keeps nobody away" test "$(fault_count control_loop_gap)" = "$gaps_before"
# One is left, with which it can answer us; a way to the bus takes two.
prlimit --pid "$pid" --nofile="$(second_free_descriptor)":
plug_in
sleep 2
expect "it goes on without, and open" phase_is open
expect "nobody is heard" test "$(status_json | jq .modules_answering)" -eq 0
prlimit --pid "$pid" --nofile=256:
expect_recovered

step "its service manager is gone"  # [F73]
# What it tells goes to a socket that is not there; the manager does not wait for it.
cat >/etc/systemd/system/bmud.service.d/nobody.conf <<'UNIT'
[Service]
Type=exec
NotifyAccess=none
WatchdogSec=0
Environment=NOTIFY_SOCKET=/run/nobody WATCHDOG_USEC=500000
UNIT
systemctl daemon-reload
systemctl restart bmud
wait_until_serving
pid=$(main_pid)
expect "it speaks to nobody" grep -qz '^NOTIFY_SOCKET=/run/nobody$' "/proc/$pid/environ"
clear_faults
wait_until_closed
# Several times as long as its watchdog's time.
sleep 2
expect "what it told was in vain" told_in_vain
expect_borne "nobody to tell"

step "end"
expect_stopped_well
stop mmusim || true
tell_measured
