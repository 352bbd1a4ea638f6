# What guest scripts share that run bmud as a service of systemd, from its packages. Sourced behind guest-env.sh, with `repository`,
# `packages` (the folder they are in) and `scenario` set:
#   install_packages      all three, as dpkg does it, and what they run on is read ahead
#   prepare_service       an emulated pack whose key is turned again and again, who measures, and the pack file
#   start_service         the same, and what docs/installing.md shows of the start
#   serve_in_real_time    it starts, or starts again, with the priority and the locked memory of realtime.conf
#   main_pid, property, is_active, log_has ...   what systemd says of it
#   expect_successor      what must be after an end of the process
#   expect_recovered      what must be after an opening by the process that goes on
#   wait_to_disturb, expect_undisturbed ...      around what the daemon must bear
# shellcheck shell=bash

: "${repository:?}" "${packages:?}" "${scenario:?}"

bus=vcan0
# shellcheck source-path=SCRIPTDIR source=pack-env.sh
source "$(dirname "${BASH_SOURCE[0]}")/pack-env.sh"

# The daemon's own way to the bus, which can be taken away while the others go on hearing each other.
own_bus=vcan1
# shellcheck disable=SC2034  # for those who source this
state=/var/lib/bmud
# Of asking systemd; the default is shorter than a slow host makes it.
export SYSTEMD_BUS_TIMEOUT=600

is_active() { [[ $(systemctl is-active bmud) == "$1" ]]; }
property() { systemctl show --value -p "$1" bmud; }
main_pid() { property MainPID; }
is_new_process() { local pid; pid=$(main_pid) && [[ $pid != 0 && $pid != "$1" ]]; }
is_over_or_new() { is_active failed || is_new_process "$1"; }
# In a variable: a journalctl whose reader has found enough fails.
log_has() { local log; log=$(journalctl -q --no-pager -u bmud) && grep -q "$1" <<<"$log"; }
log_count() { journalctl -q --no-pager -o cat -u bmud | grep -c "$1" || true; }
log_count_is() { [[ $(log_count "$2") == "$1" ]]; }
config_hash() { status_json | jq -er .pack.config_hash; }
# When systemd last began to stop it: later than its command, which has to be read and started first.
stopping_at() { journalctl -q --no-pager -o short-unix -u bmud | awk '/Stopping bmud/ { at = $1 } END { print at }'; }

# --- install and start ---

# The index of all manual pages takes longer to make here than everything else; and where the host is a container it may have a rule
# against services, which is not for the guest.
install_packages() {
  rm -f /var/lib/man-db/auto-update /usr/sbin/policy-rc.d
  dpkg --install "$packages"/bmud_*.deb "$packages"/bmud-tools_*.deb "$packages"/mmusim_*.deb >"$RIG_OUT/dpkg.txt" || return 1
  warm_up
}

# Whatever is used later has been read once then: see pack-env.sh for what waiting for the host's disk does to the clock.
warm_up() {
  read_ahead bmud bmuctl mmusim candump cangw ip chrt jq awk sed grep dd date setpriv stat systemctl journalctl systemd-analyze deb-systemd-invoke perl
  # What the manager does where a service fails, it does here for the first time.
  read_ahead /lib/systemd/systemd
  {
    bmud --version && bmuctl --help && mmusim --version && chrt --version && jq -n 1 && awk 'BEGIN {}' && dd --version
    systemctl show bmud && systemctl is-active bmud && journalctl -q -n 1 && ip link show && cangw -L && date
  } >/dev/null 2>&1 || true
}

join_buses() {
  ip link add "$own_bus" type vcan && ip link set "$own_bus" mtu 16 up
  cangw -A -s "$bus" -d "$own_bus" -e
  cangw -A -s "$own_bus" -d "$bus" -e
}

# As somebody does who begins with the pack that comes with it.
write_pack() {
  sed -e "s/unix:demo/$own_bus/g" -e 's|"\.\./|"/usr/share/bmud/|g' /usr/share/bmud/packs/demo-48s.json >/etc/bmud/pack.json
}

wait_until_serving() {
  wait_for "$start_limit_s" "it is active" is_active active
  wait_for "$start_limit_s" "it answers" daemon_answers
  wait_for 10 "everything is known anew" view_is_complete
}

# Frames must not wait for a turn of the one processor: they would not, on a machine of one's own.
let_frames_through() {
  local name
  for name in /proc/[0-9]*/comm; do
    if [[ $(cat "$name" 2>/dev/null) == ksoftirqd/* ]]; then chrt -f -p 70 "$(basename "$(dirname "$name")")"; fi
  done
}

# The nice values of the daemon's first thread, the loop, and of its others, each once. A thread may end meanwhile.
thread_nices() {
  local pid
  pid=$(main_pid)
  { grep -hs . /proc/"$pid"/task/*/stat || true; } | awk -v loop="$pid" '{ print ($1 == loop ? "loop " : "others ") $19 }' | sort -u | paste -sd' '
}

prepare_service() {
  let_frames_through
  start bmud journalctl -q -f -o short-monotonic -u bmud
  record_words
  write_keys "$scenario"
  start_pack "$scenario"
  write_pack
  expect "the pack file is good" bmud --check-config /etc/bmud/pack.json >/dev/null
}

start_service() {
  join_buses
  prepare_service
  expect "it starts as the page has it" run_shown installing start >"$RIG_OUT/start.txt"
  wait_until_serving
  expect "the control loop comes before the daemon's other threads" test "$(thread_nices)" = "loop -15 others 0"
}

# Ahead of who measures, and its memory on no disk: a daemon that waits for either opens for that.
start_in_real_time() {
  run_shown installing realtime
  wait_for "$start_limit_s" "it is active" is_active active
  wait_for "$start_limit_s" "it answers" daemon_answers
  pid=$(main_pid)
}
serve_in_real_time() {
  start_in_real_time
  wait_for 10 "everything is known anew" view_is_complete
}

# --- what must be ---

expect_sandboxed() {
  expect "as its own user" test "$(stat -c %U "/proc/$pid")" = bmud
  expect "without any capability" grep -q '^CapEff:\s*0000000000000000$' "/proc/$pid/status"
  expect "it cannot get one" grep -q '^NoNewPrivs:\s*1$' "/proc/$pid/status"
  expect "its system calls are filtered" grep -q '^Seccomp:\s*2$' "/proc/$pid/status"
}

# The contactors opened, the process is the one it was, and only a new wish closes.
expect_recovered() { expect_recovered_by clear_faults; }
expect_recovered_by() {
  wait_for 15 "everything is known anew" view_is_complete
  expect "it is the same process" test "$(main_pid)" = "$pid"
  expect "what waited for somebody is cleared" "$1"
  expect_open_until_key
}

expect_stopped_well() {
  systemctl stop bmud
  expect "it ended well" test "$(property Result):$(property ExecMainStatus)" = success:0
}

# After an end that the service manager saw: another process, which opens first and closes only for a new wish.
expect_successor() {
  local before=$1
  wait_for 15 "systemd has started another" is_new_process "$before"
  wait_until_serving
  clear_faults
  expect_open_until_key
}

# Something happens to its surroundings while the pack is closed, and it does not mind: no opening but by the key, and closed when the
# key wants it. Frames are counted: the wall clock may be what happens.
wait_to_disturb() {
  wait_until_closed
  before=$(main_pid)
  heard_before=$(wc -l <"$recording")
}
openings_with_key_on() {
  ask_recording '
    NR > heard && is_status {
      if (substr(data, 2, 1) ~ /[37BF]/) was_closed = 1
      if (was_closed && !closed) { was_closed = 0; if (key) ++n }
    }
    END { print n + 0 }' -v "heard=$heard_before"
}
expect_undisturbed() {
  local name=$1
  expect "$name: it is the same process" test "$(main_pid)" = "$before"
  wait_for "$close_limit_s" "$name: it is closed" phase_is closed
  expect "$name: nothing but the key has opened the pack" test "$(openings_with_key_on)" -eq 0
}
