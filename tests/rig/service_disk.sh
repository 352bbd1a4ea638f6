#!/bin/bash
# Guest script: what a gateway does to the service that runs on it while the pack is closed. Its disk is full, then read-only; power fails
# while the state file is written, or something damages that file; the journal hangs; the wall clock jumps; its interface goes and comes
# back. The contactors may open for the last alone. Needs systemd as the machine's first program.
#   usage: service_disk.sh REPOSITORY PACKAGES   (a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 packages=$2
scenario=$RIG_OUT/keys.scn
# shellcheck source-path=SCRIPTDIR source=service-env.sh
source "$(dirname "$0")/service-env.sh"

# How often writing has failed until now: of the state file, and of the history.
write_failures() { echo "$(fault_count store_write_failed) $(fault_count history_write_failed)"; }
# cannot_keep STATE_FILE_FAILURES HISTORY_FAILURES: one more of either
cannot_keep() { fault_came store_write_failed "$1" || fault_came history_write_failed "$2"; }

keeps_again() { fault_is_gone store_write_failed && fault_is_gone history_write_failed; }
written_at() { stat -c %y "$state/state.json"; }
is_written_since() { [[ $(written_at) != "$1" ]]; }

# The daemon dates the latest jump by the clock that was set, so the date shows that it followed the jump by its size.
is_jump_dated_by_clock() {
  local dated_s
  dated_s=$(bmuctl --socket "$socket" faults --json | jq -e '.faults[] | select(.name == "clock_jump") | .last_unix_time_ms / 1000 | floor') &&
    ((dated_s >= EPOCHSECONDS - 10 && dated_s <= EPOCHSECONDS))
}

# strace's option for each thread of PID but the first.
other_threads() {
  local task
  for task in /proc/"$1"/task/*; do [[ ${task##*/} == "$1" ]] || echo "-p ${task##*/}"; done
}
is_between_renames() { [[ -e $state/state.json.new && ! -e $state/state.json ]]; }
# What is read where the newest is not there.
whole_state() { if [[ -e $state/state.json ]]; then echo "$state/state.json"; else echo "$state/state.json.previous"; fi; }
# One of these was found at the start.
state_was() { [[ " $* " == *" $(status_json | jq -r .store.found_at_start) "* ]]; }
fault_came_and_stays() { fault_came "$1" 0 && ! fault_is_gone "$1"; }

# Small enough to be filled, and large enough for the daemon (50 MB are to be free), in place of the folder that is the service's own.
mount_state() {
  local image=$1
  truncate -s 120M "$image"
  mkfs.ext4 -q "$image"
  mkdir -p "$state"
  mount -o loop "$image" "$state"
  chown bmud:bmud "$state"
  chmod 750 "$state"
}

step "start"
expect "the packages are installed" install_packages
read_ahead strace
mount_state /run/state.image
start_service

step "the disk is full"  # [F75]
wait_to_disturb
expect "disk_low is not present yet" fault_is_gone disk_low
expect "no write has failed yet" test "$(write_failures)" = "0 0"
dd if=/dev/zero of="$state/full" bs=1M 2>/dev/null || true
wait_for 90 "it says that the disk is nearly full" fault_came disk_low 0
# disk_low is a threshold, and present without any write. The state file is written when the pack opens or closes.
wait_for 180 "writing the state file has failed" fault_came store_write_failed 0
expect_undisturbed "a full disk"
written_before=$(written_at)
rm "$state/full"
wait_for 90 "disk_low clears once there is room" fault_is_gone disk_low
wait_for 180 "it writes the state file again" is_written_since "$written_before"
wait_for 180 "and its write faults clear" keeps_again

step "the disk is read-only"  # [F75]
# As the kernel does after an error of the disk: whoever has files open for writing is not asked.
failures_before=$(write_failures)
echo u >/proc/sysrq-trigger
wait_for 10 "it is read-only" not touch "$state/probe" 2>/dev/null
# shellcheck disable=SC2086  # two numbers
wait_for 180 "it says that it cannot keep what it should" cannot_keep $failures_before
expect_undisturbed "a read-only disk"
written_before=$(written_at)
mount -o remount,rw "$state"
wait_for 180 "it writes the state file again" is_written_since "$written_before"
wait_for 180 "and its write faults clear" keeps_again
expect_undisturbed "a disk that may be written again"
echo u >/proc/sysrq-trigger
wait_for 10 "it is read-only again" not touch "$state/probe" 2>/dev/null
wait_until_closed
systemctl stop bmud
expect_opened_by_command "systemctl stop with a read-only disk" "$(stopping_at)" 300
systemctl start bmud || true
wait_for "$start_limit_s" "it starts with a read-only disk" is_active active
wait_for "$start_limit_s" "and answers" daemon_answers
systemctl stop bmud
umount "$state"
systemctl start bmud
wait_until_serving
clear_faults

step "power fails between two steps of writing"  # [F77]
# The thread that writes is held before it puts the new state in the old one's place. What its disk has then is what a power cut leaves.
systemctl stop bmud
mount_state /run/state-2.image
systemctl start bmud
wait_until_serving
clear_faults
wait_until_closed
before=$(main_pid)
old_state=$(md5sum <"$state/state.json")
# shellcheck disable=SC2046  # a word for each thread
start strace strace -qq -o "$RIG_OUT/strace.txt" $(other_threads "$before") -P "$state/state.json.new" -e inject=rename:delay_enter=10s:when=1
wait_for $((2 * key_period_s)) "it is between the two renames" is_between_renames
cp --sparse=always /run/state-2.image /run/state-cut.image
expect "it still is" is_between_renames
stop strace || true
expect "the loop was never away" test "$(fault_count control_loop_gap)" = 0
systemctl stop bmud
umount "$state"
mount -o loop /run/state-cut.image "$state"
expect "the old state is there" test "$(md5sum <"$(whole_state)")" = "$old_state"
systemctl start bmud
wait_until_serving
expect "and it is read" state_was newest previous
clear_faults
wait_until_closed

step "the state file is cut, or changed"  # [F76]
systemctl stop bmud
truncate -s "$(($(stat -c %s "$state/state.json") / 2))" "$state/state.json"
systemctl start bmud
wait_until_serving
expect "it takes the one of before" state_was previous
expect "and keeps the cut one" test -s "$state/state.json.damaged"
clear_faults
wait_until_closed
systemctl stop bmud
for file in "$state/state.json" "$state/state.json.previous"; do printf X | dd of="$file" bs=1 seek=200 conv=notrunc status=none; done
systemctl start bmud
wait_until_serving
expect "it takes neither" state_was unreadable
expect "which is a fault" fault_came store_unreadable 0
clear_faults || true
expect "that an ordinary clear leaves" fault_came_and_stays store_unreadable
expect "and nothing closes" test "$(status_json | jq .permission.may_close)" = false
clear_with_authority
wait_until_closed
systemctl stop bmud
umount "$state"
systemctl start bmud
wait_until_serving
clear_faults

step "the journal hangs"  # [F74]
wait_to_disturb
journal=$(systemctl show --value -p MainPID systemd-journald)
kill -STOP "$journal"
# Each is a line in the log: more than sockets and the daemon's own queue have room for.
lines=6000
awk -v n="$lines" 'BEGIN { while (n--) print "{\"cmd\": \"balance\", \"switch\": \"off\"}" }' >/run/lines
socat -t 60 - "UNIX-CONNECT:$socket" </run/lines >/run/answers
expect "each was answered" test "$(grep -c '"ok":true' /run/answers)" = "$lines"
expect_undisturbed "a journal that hangs"
kill -CONT "$journal"
expect "the loop was never away" test "$(fault_count control_loop_gap)" = 0
wait_for 30 "what the log lacks is told in it" log_has 'log lines lost'

step "the wall clock jumps"  # [F68]
for jump in '1 year' '-2 years' '1 year'; do
  jumps_before=$(fault_count clock_jump)
  date -s "$jump" >/dev/null
  wait_for 30 "it says that the clock was set by $jump" fault_came clock_jump "$jumps_before"
  expect "and dates that by the clock as it was set" is_jump_dated_by_clock
  # Time for what must not happen.
  sleep 2
  expect_undisturbed "the clock set by $jump"
done
expect "each jump is in the log" log_count_is 3 'fault: wall clock jumped$'
# What was heard in another year would be taken for what is still to come.
stop words || true
record_words

step "the interface goes, and comes back"  # [F41]
wait_until_closed
removed_at=$EPOCHREALTIME
ip link del "$own_bus"
expect_opened_by_itself "interface removed" "$removed_at"
wait_for 5 "it says so" fault_came internal_bus_down 0
expect "it is the same process" test "$(main_pid)" = "$before"
join_buses
wait_for 10 "everything is known anew" view_is_complete
expect "it is still the same" test "$(main_pid)" = "$before"
clear_faults
expect_open_until_key

step "end"
systemctl stop bmud
stop mmusim || true
tell_measured
