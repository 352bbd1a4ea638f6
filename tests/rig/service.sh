#!/bin/bash
# Guest script: the installed package as a service of systemd, with an emulated pack whose contactors are closed again for each case.
# The service is stopped, killed, crashed and restarted too often; its disk is full, then read-only; the journal hangs; the wall clock
# jumps; its interface goes and comes back; and in the end it is purged. Somebody who only listens measures on the bus when the
# contactors open. Needs systemd as the machine's first program.
#   usage: service.sh REPOSITORY PACKAGES   (a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 packages=$2
bus=vcan0
scenario=$RIG_OUT/keys.scn
keys=16
# shellcheck source-path=SCRIPTDIR source=pack-env.sh
source "$(dirname "$0")/pack-env.sh"

# The daemon's own way to the bus, which can be taken away while the others go on hearing each other.
own_bus=vcan1
watchdog_ms=500
state=/var/lib/bmud

is_active() { [[ $(systemctl is-active bmud) == "$1" ]]; }
property() { systemctl show --value -p "$1" bmud; }
main_pid() { property MainPID; }
is_new_process() { local pid; pid=$(main_pid) && [[ $pid != 0 && $pid != "$1" ]]; }
is_over_or_new() { is_active failed || is_new_process "$1"; }
cannot_keep() { fault_came store_write_failed 0 || fault_came history_write_failed 0; }
log_has() { journalctl -q --no-pager -u bmud | grep -q "$1"; }

# Everything on this machine whose name has to do with us.
our_files() {
  find /etc /var /usr/lib/systemd /lib/systemd /usr/lib/sysusers.d /usr/lib/sysctl.d /usr/sbin /usr/bin /usr/share /run -xdev \
    \( -name '*bmu*' -o -name '*mmusim*' \) -not -path '/run/rig*' -not -path '/var/log/*' 2>/dev/null | sort
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

# After an end that the service manager saw: another process, which opens first and closes only for a new wish.
expect_successor() {
  local before=$1
  wait_for 15 "systemd has started another" is_new_process "$before"
  wait_until_serving
  clear_faults
  expect_open_until_key
}

# A process that ends while the pack is closed.
end_while_closed() {
  local name=$1 signal=$2 before at
  step "$name"
  wait_until_closed
  before=$(main_pid)
  at=$EPOCHREALTIME
  kill -s "$signal" "$before"
  expect_opened_by_itself "$name" "$at"
  expect_successor "$before"
}

# Something happens to its surroundings while the pack is closed, and it does not mind: no opening but by the key, and closed when the
# key wants it.
opened_by_key_only() {
  local cause
  cause=$(status_json | jq -r '.last_opening.cause // "none"')
  [[ $cause == none || $cause == "request over" || $cause == "precharge to be tried again" ]]
}
expect_undisturbed() {
  local name=$1 before=$2
  expect "$name: it is the same process" test "$(main_pid)" = "$before"
  expect "$name: nothing but the key has opened the pack" opened_by_key_only
  wait_for "$close_limit_s" "$name: it is closed" phase_is closed
}

# Whatever is used later has been read once then: see pack-env.sh for what waiting for the host's disk does to the clock.
warm_up() {
  {
    bmud --version && bmuctl --help && mmusim --version && chrt --version && jq -n 1 && awk 'BEGIN {}' && dd --version
    systemctl show bmud && systemctl is-active bmud && journalctl -q -n 1 && ip link show && cangw -L && date
  } >/dev/null 2>&1 || true
}
# Of asking systemd; the default is shorter than a slow host makes it.
export SYSTEMD_BUS_TIMEOUT=600

step "install"
before_installation=$(our_files)
# The index of all manual pages takes longer to make here than everything else.
rm -f /var/lib/man-db/auto-update
expect "the packages are installed" dpkg --install "$packages"/bmud_*.deb "$packages"/bmud-tools_*.deb "$packages"/mmusim_*.deb >"$RIG_OUT/dpkg.txt"
expect "there is a user" getent passwd bmud
expect "and a group of those who command" getent group bmud-admin
expect "buffers are as wished" test "$(</proc/sys/net/core/rmem_max)" = 4194304
expect "it has not started by itself" not is_active active
expect "nor will it" test "$(systemctl is-enabled bmud 2>/dev/null || true)" = disabled
expect "every unit is right" systemd-analyze verify --man=no bmud.service bmud@other.service
expect "there is a manual" man -w bmud bmuctl bmudump bmureplay bmucell mmusim bmud-pack bmud-socket >/dev/null

warm_up

step "a wrong pack is refused, once"
echo '{}' >/etc/bmud/pack.json
expect "systemctl start says so" not systemctl start bmud 2>/dev/null
expect "its exit status is that of a wrong configuration" test "$(property ExecMainStatus)" = 78
expect "nobody tries again" test "$(property NRestarts)" = 0
systemctl reset-failed bmud

step "start"
for name in /proc/[0-9]*/comm; do
  if [[ $(cat "$name" 2>/dev/null) == ksoftirqd/* ]]; then chrt -f -p 70 "$(basename "$(dirname "$name")")"; fi
done
start bmud journalctl -q -f -o short-monotonic -u bmud
join_buses
record_words
write_keys "$scenario" "$keys"
start_pack "$scenario"
write_pack
expect "the pack file is good" bmud --check-config /etc/bmud/pack.json >/dev/null
expect "it starts" systemctl enable --now bmud
wait_until_serving
pid=$(main_pid)
expect "as its own user" test "$(stat -c %U "/proc/$pid")" = bmud
expect "without any capability" grep -q '^CapEff:\s*0000000000000000$' "/proc/$pid/status"
expect "it cannot get one" grep -q '^NoNewPrivs:\s*1$' "/proc/$pid/status"
expect "its system calls are filtered" grep -q '^Seccomp:\s*2$' "/proc/$pid/status"
systemd-analyze security --no-pager bmud >"$RIG_OUT/security.txt"
exposure=$(sed -n 's/.*exposure level for bmud.service: \([0-9.]*\).*/\1/p' "$RIG_OUT/security.txt")
measured+=("exposure: $exposure")
expect "its exposure is $exposure, at most 1.5" awk "BEGIN { exit !($exposure <= 1.5) }"
expect "the state is its own" test "$(stat -c %U:%a "$state")" = bmud:750

step "stopped by SIGSTOP"
wait_until_closed
before=$(main_pid)
stopped_at=$EPOCHREALTIME
kill -STOP "$before"
expect_opened_by_itself "stopped by SIGSTOP" "$stopped_at"
wait_for 15 "the watchdog has ended it" is_new_process "$before"
expect "it was the watchdog" log_has "Watchdog timeout (limit ${watchdog_ms}ms)"
expect_successor "$before"

end_while_closed "killed" KILL
end_while_closed "crashed" SEGV

step "systemctl stop"
wait_until_closed
stopped_at=$EPOCHREALTIME
systemctl stop bmud
expect_opened_by_command "systemctl stop" "$stopped_at" 300
expect "it ended well" test "$(property Result):$(property ExecMainStatus)" = success:0
systemctl start bmud
wait_until_serving
expect_open_until_key

step "killed again and again"
wait_until_closed
stormed_at=$EPOCHREALTIME
for ((kills = 0; kills < 12; ++kills)); do
  before=$(main_pid)
  [[ $before != 0 ]] || break
  kill -KILL "$before" 2>/dev/null || true
  wait_for 15 "it is over, or begun anew" is_over_or_new "$before"
  ! is_active failed || break
done
expect "systemd gives up after $kills" is_active failed
expect "nobody has closed since" test "$(commands_until_key "$stormed_at" | cut -d' ' -f2)" -le 4
wait_for 10 "the pack is open" is_open_since "$stormed_at"
lost_at=$(first_opening "$stormed_at" | cut -d' ' -f1)
systemctl reset-failed bmud
systemctl start bmud
wait_until_serving
clear_faults
expect_open_until_key

step "the disk is full"
wait_until_closed
before=$(main_pid)
systemctl stop bmud
image=$RIG_OUT/../disk
truncate -s 24M "$image"
mkfs.ext4 -q "$image"
mount -o loop "$image" "$state"
chown bmud:bmud "$state"
chmod 750 "$state"
systemctl start bmud
wait_until_serving
wait_until_closed
before=$(main_pid)
dd if=/dev/zero of="$state/full" bs=64k 2>/dev/null || true
wait_for 90 "it says that the disk is nearly full" fault_came disk_low 0
expect_undisturbed "a full disk" "$before"
rm "$state/full"

step "the disk is read-only"
# As the kernel does after an error of the disk: whoever has files open for writing is not asked.
echo u >/proc/sysrq-trigger
wait_for 10 "it is read-only" not touch "$state/probe" 2>/dev/null
wait_for 180 "it says that it cannot keep what it should" cannot_keep
expect_undisturbed "a read-only disk" "$before"
stopped_at=$EPOCHREALTIME
systemctl stop bmud
expect_opened_by_command "systemctl stop with a read-only disk" "$stopped_at" 300
systemctl start bmud || true
wait_for "$start_limit_s" "it starts with a read-only disk" is_active active
wait_for "$start_limit_s" "and answers" daemon_answers
systemctl stop bmud
umount "$state"
systemctl start bmud
wait_until_serving
clear_faults
lost_at=$EPOCHREALTIME

step "the journal hangs"
wait_until_closed
before=$(main_pid)
journal=$(systemctl show --value -p MainPID systemd-journald)
kill -STOP "$journal"
# Each is a line in the log.
for ((i = 0; i < 400; ++i)); do bmuctl --socket "$socket" balance --off >/dev/null; done
expect_undisturbed "a journal that hangs" "$before"
kill -CONT "$journal"
expect "no tick was late by more than two cycles" test "$(fault_count control_loop_gap)" = 0

step "the wall clock jumps"
for jump in '1 year' '-2 years' '1 year'; do
  date -s "$jump" >/dev/null
  sleep 2
  expect_undisturbed "the clock set by $jump" "$before"
done
expect "it is told as such" log_has 'clock'

step "the interface goes, and comes back"
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

step "purge"
wait_until_closed
purged_at=$EPOCHREALTIME
expect "it is removed" dpkg --remove bmud >>"$RIG_OUT/dpkg.txt"
expect_opened_by_command "removed" "$purged_at" 3000
expect "the pack's file has stayed" test -f /etc/bmud/pack.json
expect "so has what was remembered" test -f "$state/state.json"
expect "it is purged" dpkg --purge bmud bmud-tools mmusim >>"$RIG_OUT/dpkg.txt"
our_files | diff <(echo "$before_installation") - >"$RIG_OUT/left.txt" || fail "left behind: $(cat "$RIG_OUT/left.txt")"
echo "  ok: nothing is left behind"
expect "nor the user" not getent passwd bmud
expect "nor its groups" not getent group bmud bmud-admin
tell_measured
