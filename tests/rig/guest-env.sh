#!/bin/bash
# What guest scripts are written with; source it first. Works the same in the emulated machine and on a host with vcan:
#   RIG_OUT            folder whose files reach whoever started the rig
#   step TEXT          names what comes next; the last one is reported when something hangs or fails
#   expect WHAT CMD    fails the script with WHAT unless CMD succeeds
#   wait_for S WHAT CMD  the same, but tries again and again for up to S seconds
#   read_ahead PROGRAM...  reads programs and their libraries, so that no later step waits for the host's disk
#   start NAME CMD     runs CMD in the background, its output in RIG_OUT/NAME.log
#   as_service CMD     runs CMD in place of this shell with the priority that the unit file gives the control loop
#   stop NAME [SIG]    ends it by SIG (TERM), returns its exit status; 137 if it had to be killed after stop_limit_s
#   running NAME       succeeds while it runs
#   record NAME BUS    starts candump as NAME, returns when it listens; the recording is RIG_OUT/NAME.can.log
# Everything started is ended when the script ends, however it ends.
set -euo pipefail

make_vcan() {
  ip link add "$1" type vcan && ip link set "$1" mtu 16 up
}

if [[ ${BASH_SOURCE[0]} == "$0" ]]; then
  [[ ${1:-} == --make-vcan && $# -eq 2 ]] || { echo "usage: guest-env.sh --make-vcan NAME (or source it)" >&2; exit 64; }
  make_vcan "$2"
  exit
fi

: "${RIG_OUT:?no output folder: start guest scripts with boot.sh or run-on-can.sh}"
# Reports go to the output that the script began with: "expect WHAT CMD >FILE" redirects the output of CMD alone.
exec 3>&1
stop_limit_s=${stop_limit_s:-10}
# While the emulated machine waits for the host's disk, its clock may run ahead by more than a limit: that alone must not end a wait.
tries_behind_limit=20
# The longest pause between two tries of wait_for. Each try runs a program or two, which the emulated machine has to compute; a pause costs
# nothing, since its clock skips the time in which nothing runs. Shorter than what a try may miss (fresh_s in pack-env.sh).
longest_pause_ms=800
declare -A started_pids=()
# Commands that are run when the script ends, however it ends.
at_end=()
current_step="(before the first step)"

step() {
  current_step=$*
  echo "step: $*  [$(uptime_text)]"
}

uptime_text() { echo "$(cut -d' ' -f1 /proc/uptime) s"; }

fail() {
  {
    echo "FAILED: $*"
    echo "  in step: $current_step"
    show_log_tails
  } >&3
  exit 1
}

show_log_tails() {
  local log
  for log in "$RIG_OUT"/*.log; do
    # Of what the programs said; not of a recording, nor of the console itself.
    case ${log##*/} in *.can.log | console.log) continue ;; esac
    [[ -s $log ]] || continue
    echo "  --- end of ${log##*/}"
    tail -n 8 "$log" | sed 's/^/  /'
  done
}

expect() {
  local what=$1
  shift
  "$@" || fail "$what"
  echo "  ok: $what" >&3
}

# The time is the clock's, for each try is slow under emulation.
wait_for() {
  local limit_s=$1 what=$2 end_s tries=0 pause_ms=50
  shift 2
  end_s=$((SECONDS + limit_s))
  until "$@"; do
    ((SECONDS <= end_s || ++tries <= tries_behind_limit)) || fail "$what: not within $limit_s s"
    sleep "0.$(printf %03d "$pause_ms")"
    pause_ms=$((pause_ms * 5 / 4 < longest_pause_ms ? pause_ms * 5 / 4 : longest_pause_ms))
  done
  echo "  ok: $what" >&3
}

read_ahead() {
  local program path
  for program in "$@"; do
    path=$(command -v "$program") || fail "there is no $program"
    # A script has no libraries.
    { ldd "$path" || true; } 2>/dev/null | { grep -o '/[^ ]*' || true; } | xargs cat "$path" >/dev/null
  done
}

start() {
  local name=$1
  shift
  "$@" >"$RIG_OUT/$name.log" 2>&1 </dev/null 3>&- &
  started_pids[$name]=$!
}

# Among programs of its own priority, on one slow processor, the daemon may wait for longer than its control loop may.
as_service() { exec chrt --reset-on-fork --other 0 nice -n -15 "$@"; }

running() { kill -0 "${started_pids[$1]}" 2>/dev/null; }

stopped() { ! running "$1"; }

stop() {
  local name=$1 signal=${2:-TERM} status=0 end_s=$((SECONDS + stop_limit_s)) tries=0
  kill -s "$signal" "${started_pids[$name]}" 2>/dev/null || true
  while running "$name" && ((SECONDS <= end_s || ++tries <= tries_behind_limit)); do sleep 0.05; done
  kill -KILL "${started_pids[$name]}" 2>/dev/null || true
  wait "${started_pids[$name]}" || status=$?
  unset "started_pids[$name]"
  return "$status"
}

# The kernel's list of receivers of everything tells when candump has begun: frames sent from then on are recorded.
listens_to() { grep -Eq "^ *$1 .*raw" /proc/net/can/rcvlist_all; }

# With -D it goes on listening when its bus goes down and comes up again.
record_to_file() { exec candump -D -r 1000000 -L "$2" >"$RIG_OUT/$1.can.log"; }

record() {
  # A receiver of the frames of a moment ago must not pass for the new one.
  wait_for 10 "nobody else records $2" not listens_to "$2"
  start "$1" record_to_file "$1" "$2"
  wait_for 10 "candump listens to $2" listens_to "$2"
}

not() { ! "$@"; }

# The commands of docs/PAGE.md in the block that bears the mark "<!-- rig NAME -->", a line each as they stand in the page.
shown_commands() {
  awk -v mark="<!-- rig $2 -->" '
    $0 == mark { is_marked = 1; next }
    is_marked && /^    / { was_begun = 1; print substr($0, 5); next }
    was_begun { exit }' "${repository:?}/docs/$1.md"
}

# run_shown PAGE NAME: runs that block as the reader of the page does it, in the current folder; "sudo" is nothing here, the guest's user is
# root. Fails with the first command that fails. tests/docs/check_shown.py holds marks and calls against each other.
run_shown() {
  local commands
  commands=$(shown_commands "$1" "$2")
  [[ -n $commands ]] || fail "docs/$1.md: found no block with the mark <!-- rig $2 -->"
  bash -ec 'sudo() { "$@"; }'$'\n'"$commands"
}

end_everything() {
  local name command
  for command in "${at_end[@]}"; do "$command" || true; done
  for name in "${!started_pids[@]}"; do stop "$name" || true; done
}
trap end_everything EXIT
trap 'exit 143' TERM INT
