#!/bin/bash
# Guest script: the packages on a machine, from their installation to their purge, and what the service does for those who look after it.
# A wrong pack is refused; users have their rights; another pack file is taken up while the pack is open, and another pack runs beside it;
# an upgrade leaves the running daemon as it is; it gets real time; a purge leaves nothing behind. How the process ends is in service.sh.
# Needs systemd as the machine's first program.
#   usage: service_package.sh REPOSITORY PACKAGES   (a folder with the packages)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1 packages=$2
scenario=$RIG_OUT/keys.scn
# Five seconds off: in that time systemd has to pass on a reload.
key_period_s=24
# shellcheck source-path=SCRIPTDIR source=service-env.sh
source "$(dirname "$0")/service-env.sh"

# Everything on this machine whose name has to do with us, a line each; no line at all where there is nothing. A folder that is not
# there has nothing of ours in it.
our_files() {
  { find /etc /var /usr/lib/systemd /lib/systemd /usr/lib/sysusers.d /usr/lib/sysctl.d /usr/sbin /usr/bin /usr/share /run -xdev \
    \( -name '*bmu*' -o -name '*mmusim*' \) -not -path '/run/rig*' -not -path '/var/log/*' 2>/dev/null || true; } | sort
}

# A warning, too, is wrong.
units_are_right() { systemd-analyze verify --man=no --recursive-errors=no bmud.service bmud@house.service; }
# Later versions of systemd warn of each variable of a command line that is not set, at every start.
variables_are_set() {
  local name
  for name in $(systemctl cat bmud | sed -n 's/^ExecStart=//p' | grep -o '\$[A-Z_]*'); do
    [[ " $(property Environment)" == *" ${name#?}="* ]] || return 1
  done
}
put_drop_ins() {
  local drop_in unit
  for drop_in in gpio interfaces realtime serial; do
    for unit in bmud bmud@; do
      install -D -m 644 "/usr/share/doc/bmud/examples/$drop_in.conf" "/etc/systemd/system/$unit.service.d/$drop_in.conf"
    done
  done
}
take_drop_ins_away() { rm -r /etc/systemd/system/bmud.service.d /etc/systemd/system/bmud@.service.d; }

# The same program in a package of a later version, whose configuration file is another one, too.
make_later_package() {
  local folder=/run/later
  dpkg-deb --raw-extract "$packages"/bmud_*.deb "$folder"
  sed -i 's/^Version: .*/&+later/' "$folder/DEBIAN/control"
  echo '# of a later version' >>"$folder/etc/default/bmud"
  dpkg-deb --build -Zgzip -z1 "$folder" /run/later.deb >/dev/null
  rm -r "$folder"
}
# As an upgrade at night does it: a configuration file that was changed stays, without a question.
install_later_package() { dpkg --install --force-confdef --force-confold /run/later.deb >"$RIG_OUT/upgrade.txt" 2>&1; }
house_pid() { systemctl show --value -p MainPID bmud@house; }

# What an operator may do to units besides enabling them, and to instances that never ran. The full copy is as "systemctl edit --full"
# makes it; the target is one that is not active, as it would end with the service.
put_unit_settings() {
  local unit
  unit=$(systemctl show --value -p FragmentPath bmud@house) &&
    systemctl mask bmud@garage &&
    systemctl mask --runtime bmud@attic &&
    install -m 644 "$unit" /etc/systemd/system/bmud@shed.service &&
    systemctl add-requires rescue.target bmud@house &&
    systemctl set-property bmud@house CPUWeight=100
}
unit_settings_are_there() {
  local system=/etc/systemd/system
  [[ $(readlink "$system/bmud@garage.service") == /dev/null && $(readlink /run/systemd/system/bmud@attic.service) == /dev/null ]] &&
    [[ -f $system/bmud@shed.service && -L $system/rescue.target.requires/bmud@house.service ]] &&
    [[ -f $system.control/bmud@house.service.d/50-CPUWeight.conf ]]
}

# A maintainer script of the installed package as dpkg runs it, on a machine whose service manager cannot be reached.
run_without_manager() {
  local script=$1
  shift
  mkdir -p /run/no-manager
  printf '#!/bin/sh\necho "Failed to connect to bus" >&2\nexit 1\n' >/run/no-manager/systemctl
  chmod 755 /run/no-manager/systemctl
  PATH=/run/no-manager:$PATH "/var/lib/dpkg/info/bmud.$script" "$@" >>"$RIG_OUT/no-manager.txt" 2>&1
}

# As one of these users, with the groups of that user.
ask_as() {
  local user=$1
  shift
  setpriv --reuid "$user" --regid "$user" --init-groups bmuctl --socket "$socket" "$@" >"$RIG_OUT/asked.txt" 2>&1
}
answer_says() { grep -q "$1" "$RIG_OUT/asked.txt"; }

# Of all its threads, each once, the highest first.
priorities() { chrt --all-tasks -p "$1" | sed -n 's/.*priority: //p' | sort -rnu | paste -sd' '; }
is_recording() { [[ -n $(find "$state/recordings" -name '*.log.zst' -size +0 2>/dev/null) ]]; }

other_file_counts() { [[ $(config_hash) != "$1" ]]; }
is_reloaded() { phase_is open && run_shown installing reload && other_file_counts "$1"; }

step "install"
# In a file: a variable does not tell a list without lines from one with an empty line.
our_files >"$RIG_OUT/before.txt"
expect "the packages are installed" install_packages
expect "there is a user" getent passwd bmud
expect "and a group of those who command" getent group bmud-admin
expect "buffers are as wished" test "$(</proc/sys/net/core/rmem_max)" = 4194304
expect "it has not started by itself" not is_active active
expect "nor will it" test "$(systemctl is-enabled bmud 2>/dev/null || true)" = disabled
our_files >"$RIG_OUT/installed.txt"
expect "its files are found" test "$(wc -l <"$RIG_OUT/installed.txt")" -gt $(($(wc -l <"$RIG_OUT/before.txt") + 20))
expect "every unit is right" units_are_right
expect "every variable of its command line is set" variables_are_set
put_drop_ins
expect "and with every drop-in" units_are_right
take_drop_ins_away
expect "without a service manager it can be installed" run_without_manager postinst configure ''
expect "and upgraded" run_without_manager postinst configure 0.0.1
expect "and removed" run_without_manager prerm remove
expect "to the end" run_without_manager postrm remove
expect "there is a manual" man -w bmud bmuctl bmudump bmureplay bmucell mmusim bmud-pack bmud-socket >/dev/null

step "a wrong pack is refused, once"  # [F78]
echo '{}' >/etc/bmud/pack.json
expect "systemctl start says so" not systemctl start bmud 2>/dev/null
expect "its exit status is that of a wrong configuration" test "$(property ExecMainStatus)" = 78
wait_for 10 "it has failed" is_active failed
# Longer than systemd waits before it starts one again.
sleep 1
expect "nobody tries again" test "$(property ActiveState):$(property NRestarts)" = failed:0
systemctl reset-failed bmud

step "start"
start_service
pid=$(main_pid)
expect_sandboxed
systemd-analyze security --no-pager bmud >"$RIG_OUT/security.txt"
exposure=$(sed -n 's/.*exposure level for bmud.service: \([0-9.]*\).*/\1/p' "$RIG_OUT/security.txt")
measured+=("exposure: $exposure")
expect "its exposure is $exposure, at most 1.5" awk "BEGIN { exit !($exposure <= 1.5) }"
expect "its stop hook will find the lines it drives, which are none" grep -q '"outputs":{}' /run/bmud/driven-lines.json
expect "without a service manager it is not removed while it runs" not run_without_manager prerm remove
expect "and the refusal gives the way out" grep -q 'bmud: still running; stop it' "$RIG_OUT/no-manager.txt"
expect "the state is its own" test "$(stat -c %U:%a "$state")" = bmud:750

step "who may do what"
useradd --system --user-group alice
useradd --system --user-group bob
expect "users get their rights as the page has it" run_shown installing rights >"$RIG_OUT/adduser.txt"
useradd --system --user-group stranger
expect "a member of bmud may read" ask_as alice status
expect "but not clear" not ask_as alice clear
expect "and is told so" answer_says bmud-admin
expect "a member of bmud-admin may" ask_as bob balance --off
expect "and on again" ask_as bob balance --on
expect "a stranger may not even read" not ask_as stranger status
expect "and is told so" answer_says 'may not read here'
# By number: the daemon has read the names of users when it started, before there were these.
expect "who did what is in the log" log_has "balancing switched off by .*user $(id -u bob), process"
expect "and what was refused to whom" log_has "refused: .*user $(id -u alice), process [0-9]*)* may not \"clear\""

step "another pack file"  # [F80]
wait_to_disturb
hash_before=$(config_hash)
sed -i 's/"open_mV": 4230/"open_mV": 4225/' /etc/bmud/pack.json
expect "not while it is closed" not bmuctl --socket "$socket" reload >"$RIG_OUT/reload.txt" 2>&1
expect_undisturbed "a reload that is refused"
expect "the old file counts" test "$(config_hash)" = "$hash_before"
wait_for $((2 * close_limit_s)) "systemctl reload, once it is open" is_reloaded "$hash_before"
expect "it is the same process" test "$(main_pid)" = "$before"
wait_until_serving

step "another pack beside it"
wait_to_disturb
ip link add vcan2 type vcan && ip link set vcan2 up
sed "s/$own_bus/vcan2/g" /etc/bmud/pack.json >/etc/bmud/house.json
expect "its order is set as the page has it" run_shown installing order >/dev/null
expect "it starts after its own interface" grep -q 'net-devices-can1\.device' <<<"$(systemctl show --value -p After bmud@house)"
expect "it starts, and has a socket of its own" run_shown installing several >"$RIG_OUT/house.txt"
expect "and its own state" test -d "$state/house"
expect_undisturbed "another pack"

step "an upgrade"
make_later_package
echo '# of this gateway' >>/etc/default/bmud
wait_to_disturb
house_before=$(house_pid)
expect "the later version is installed" install_later_package
expect "and says that the daemon goes on" grep -q 'bmud goes on running as it was before this upgrade' "$RIG_OUT/upgrade.txt"
expect_undisturbed "an upgrade"
expect "the other pack's is the same process, too" test "$(systemctl is-active bmud@house):$(house_pid)" = "active:$house_before"
expect "it is the later version" test "$(dpkg-query --show --showformat='${Version}' bmud)" = "$(dpkg-deb --field /run/later.deb Version)"
expect "what was changed in a configuration file is kept" grep -qx '# of this gateway' /etc/default/bmud
expect "and has not become the later version's" not grep -qx '# of a later version' /etc/default/bmud

step "real time, and an option of this gateway"
# As docs/commissioning.md has it for the first drives.
sed -i 's|^BMUD_OPTIONS=.*|BMUD_OPTIONS="--record recordings --record-total-MB 4000"|' /etc/default/bmud
wait_until_closed
house_before=$(house_pid)
run_shown installing realtime
expect_opened_by_command "started anew" "$(stopping_at)" 300
# A start with the priority would hold up the other daemon, without one, on the one processor for more than its watchdog's time.
expect "the start has not held up the other pack" test "$(systemctl is-active bmud@house):$(house_pid)" = "active:$house_before"
# Begun again at the end: two daemons share one slow processor.
systemctl stop bmud@house
expect "the other pack's ends in order" test "$(systemctl is-active bmud@house)" = inactive
wait_until_serving
clear_faults
pid=$(main_pid)
wait_for 15 "it records, as its option says" is_recording
expect "the loop's thread has the priority" test "$(chrt -p "$pid" | sed -n 's/.*priority: //p')" = 50
expect "and no other thread has one" test "$(priorities "$pid")" = "50 0"
expect "which it may not take by itself" test "$(property RestrictRealtime)" = yes
expect "its memory is locked" test "$(sed -n 's/^VmLck:[^0-9]*\([0-9]*\).*/\1/p' "/proc/$pid/status")" -gt 4096
expect_open_until_key

step "a machine that refuses the priority"
expect_stopped_well
mount --bind /bin/false /usr/bin/chrt
expect "the start ends with that" not systemctl start bmud
expect "and the log says so" log_has 'Control process exited, code=exited, status=1'
umount /usr/bin/chrt
systemctl stop bmud
systemctl reset-failed bmud
systemctl start bmud
wait_until_serving
clear_faults

step "purge"
# Running and enabled when the packages are purged.
systemctl enable --now bmud@house
wait_until_closed
expect "a drop-in and an enabled instance are there" test -f /etc/systemd/system/bmud.service.d/realtime.conf \
  -a -L /etc/systemd/system/multi-user.target.wants/bmud@house.service
expect "units are masked, edited, required and given properties" put_unit_settings >>"$RIG_OUT/dpkg.txt" 2>&1
expect "and these settings are there" unit_settings_are_there
expect "it is removed" dpkg --remove bmud >>"$RIG_OUT/dpkg.txt"
# Before it asks for that, dpkg reads for seconds what all packages have.
expect_opened_by_command "removed" "$(stopping_at)" 300
systemctl status --no-pager --lines=60 bmud@house >"$RIG_OUT/house-end.txt" 2>&1 || true
expect "the other pack's has ended, too" test "$(systemctl is-active bmud@house)" = inactive
expect "the pack's file has stayed" test -f /etc/bmud/pack.json
expect "so has what was remembered" test -f "$state/state.json"
cp /var/lib/dpkg/info/bmud.postrm /run/postrm
expect "it is purged" dpkg --purge bmud bmud-tools mmusim >>"$RIG_OUT/dpkg.txt"
our_files | diff "$RIG_OUT/before.txt" - >"$RIG_OUT/left.txt" || fail "left behind: $(cat "$RIG_OUT/left.txt")"
echo "  ok: nothing is left behind"
expect "nor the user" not getent passwd bmud
# Of several that are asked for, getent fails where one is missing.
expect "nor its groups" test -z "$(getent group bmud bmud-admin || true)"
expect "the limit of receive buffers stays until the next start" test "$(</proc/sys/net/core/rmem_max)" = 4194304
groupadd --system bmud-admin
useradd --system --gid bmud-admin operator
expect "a group that is the primary one of a user does not fail a purge" /run/postrm purge 2>>"$RIG_OUT/dpkg.txt"
expect "and stays" getent group bmud-admin
tell_measured
