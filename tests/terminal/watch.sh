#!/usr/bin/env bash
# usage: watch.sh SOURCE_DIR BIN_DIR
# Starts an emulated pack and looks at "bmuctl watch" in a terminal that tmux plays: at 80 columns, resized, by its keys,
# with few signs; and whether the terminal is what it was, whatever ends the picture.
set -euo pipefail

source_dir=$1
bin=$2
command -v tmux >/dev/null || { echo "skipped: no tmux (tools/packages.sh test)"; exit 77; }
export LC_ALL=C.UTF-8

folder=$(mktemp -d)
bus=unix:w$$
server=bmud-watch-$$
emulator_pid=
daemon_pid=
limit_s=120
events=

clean_up() {
  tm kill-server 2>/dev/null || true
  stop "$daemon_pid"
  stop "$emulator_pid"
  rm -f "/dev/shm/bmud-bus.${bus#unix:}"
  rm -rf "$folder"
}
trap clean_up EXIT

# usage: stop PID: and waits until it has ended
stop() {
  [[ -n $1 ]] || return 0
  kill "$1" 2>/dev/null || true
  wait "$1" 2>/dev/null || true
}

tm() { tmux -u -L "$server" -f /dev/null "$@"; }
screen() { tm capture-pane -p -t watch; }
keys() { tm send-keys -t watch "$@"; }
resize() { tm resize-window -t watch -x "$1" -y "$2"; }

fail() {
  echo "FAIL: $*"
  echo "--- the screen:"
  screen || true
  echo "--- bmud, its status and its log:"
  ask_daemon --json status | jq -c '(.. | .clients_dropped? // empty), .state.phase, .faults_present' || true
  cat "$folder/bmud.log" || true
  exit 1
}

# usage: until_true WHAT COMMAND...
until_true() {
  local what=$1 end=$((SECONDS + limit_s))
  shift
  until "$@"; do
    ((SECONDS < end)) || fail "not within $limit_s s: $what"
    sleep 0.05
  done
  echo "ok: $what"
}

shows() { grep -qF -- "$1" <<<"$(screen)"; }
# Of an extended regular expression: for numbers that a busy machine makes others.
shows_like() { grep -qE -- "$1" <<<"$(screen)"; }
# usage: row_shows ROW TEXT: rows from 1; -1 is the last
row_shows() {
  local rows
  mapfile -t rows <<<"$(tm capture-pane -p -t watch -S 0 -E "$(($(tm display -p -t watch '#{pane_height}') - 1))" | cat; echo .)"
  unset 'rows[-1]'
  local at=$(($1 > 0 ? $1 - 1 : ${#rows[@]} + $1))
  [[ ${rows[at]:-} == *"$2"* ]]
}
wait_for() { until_true "the screen shows '$1'" shows "$1"; }
wait_for_row() { until_true "row $1 shows '$2'" row_shows "$1" "$2"; }
wait_until_gone() { until_true "no '$1' any more" eval "! shows '$1'"; }
must_show() { shows "$1" || fail "the screen does not show '$1'"; echo "ok: '$1'"; }
must_show_like() { shows_like "$1" || fail "the screen shows nothing like '$1'"; echo "ok: like '$1'"; }
must_not_show() { ! shows "$1" || fail "the screen shows '$1'"; echo "ok: no '$1'"; }

# What a machine that is too busy adds to the faults: their names, and their meanings on the screen.
machine_faults='tick_overrun|control_loop_gap|frames_lost'
machine_meanings='control cycle too late|control loop stalled|received frames lost'

# In the overview: none, or those of the machine and no other.
shows_no_fault_of_the_pack() {
  local rows others
  rows=$(screen)
  others=$(grep -E '● .*\[[a-z]+\]' <<<"$rows" | grep -vE "$machine_meanings" || true)
  [[ -z $others ]] && grep -qE "no faults|$machine_meanings" <<<"$rows"
}

# None, or those of the machine and no other. The page has to show which.
shows_the_faults() {
  local seen name
  seen=$("$bin/bmuctl" --socket "$folder/s" --json faults |
    jq -r '.faults[] | select(.count > 0 or .count_since_start > 0 or .is_warning or .stage != "good") | .name') ||
    fail "the daemon's faults cannot be read"
  [[ -n $seen ]] || { shows 'No fault recorded'; return; }
  ! grep -qvxE "$machine_faults" <<<"$seen" || fail "the daemon has seen: $seen"
  ! shows 'No fault recorded' || return 1
  for name in $seen; do shows "$name: " || return 1; done
}

# usage: send_event LINE: an event of mmusim's scripts, without its time
send_event() { echo "$1" >&"$events"; }
ask_daemon() { "$bin/bmuctl" --socket "$folder/s" "$@"; }
is_ready_to_close() {
  ask_daemon --json status | jq -e ".state.inputs.vehicle_on == false and .permission.may_close" >"$folder/jq" && return 0
  # What an emulator that was held up has caused stays until it is cleared.
  ask_daemon clear >"$folder/cleared" || true
  return 1
}
# The pack closes for an edge of vehicle-on alone, so the daemon must have received off before; and without a load.
turn_key() {
  send_event 'load current_A 0'
  send_event 'vehicle off'
  until_true "vehicle-on is received as off, and the pack may close" is_ready_to_close
  send_event 'vehicle on'
}
# A daemon that was starved opens, or forgets the edge of vehicle-on; one whose emulator was held up opens for its silence. Then only a new
# edge closes. In other cases the phase leaves "open" with the edge.
turn_key_if_open() {
  ask_daemon --json status | jq -e '.state.phase == "open" and .state.inputs.vehicle_on == true' >"$folder/jq" || return 0
  turn_key
}
# usage: shows_driving PATTERN: of a closed pack with its load
shows_driving() {
  if shows 'CLOSED for'; then
    ! shows_like "$1" || return 0
    send_event 'load current_A 20'
  else
    turn_key_if_open
  fi
  return 1
}
wait_for_driving() { until_true "the closed pack shows '$1'" shows_driving "$1"; }
# usage: shows_closed TEXT: of a closed pack, where the picture has other words
shows_closed() {
  ! shows "$1" || return 0
  turn_key_if_open
  return 1
}
wait_for_closed() { until_true "the closed pack shows '$1'" shows_closed "$1"; }

# usage: prefer COMMAND...: instead of this shell; where this is permitted the scheduler prefers it to whatever else the
# machine does. A starved pack opens, as it should.
prefer() {
  renice -n -15 -p "$BASHPID" >"$folder/renice" 2>&1 || true
  exec "$@"
}

start_programs() {
  cat >"$folder/drive.scn" <<'TEXT'
0   pack soc_permille 700
0   cell 3.9 soc_permille 690
0   cell 1.2 soc_permille 712
TEXT
  mkfifo "$folder/events"
  exec {events}<>"$folder/events"
  local pack=$source_dir/config/packs/demo-48s.json
  prefer "$bin/mmusim" --bus "$bus" --pack "$pack" --scenario "$folder/drive.scn" --events "$folder/events" \
    >"$folder/mmusim.log" 2>&1 </dev/null &
  emulator_pid=$!
  prefer "$bin/bmud" --config "$pack" --bus-internal "$bus" --bus-vehicle "$bus" --socket "$folder/s" >"$folder/bmud.log" \
    2>&1 </dev/null &
  daemon_pid=$!
  until_true "the daemon is there" test -S "$folder/s"
  turn_key
}

# In the terminal: remembers its settings, shows the picture, and says how that ended.
start_terminal() {
  cat >"$folder/run" <<TEXT
stty -g >"$folder/before"
sh -c 'echo \$\$ >"$folder/pid"; exec "$bin/bmuctl" --socket "$folder/s" watch'
echo "ended with \$?"
stty -g >"$folder/after"
TEXT
  tm new-session -d -s watch -x 80 -y 24 "env PS1='ready> ' bash --noprofile --norc -i"
  wait_for 'ready>'
}

# usage: begin_watch [ENVIRONMENT...]: the picture, on an empty terminal
begin_watch() {
  rm -f "$folder/after" "$folder/pid"
  keys "clear; env $* bash '$folder/run'" Enter
}

flag() { tm display -p -t watch "#{$1}"; }

# usage: must_be_restored STATUS: of the picture's end, and the terminal as it was
must_be_restored() {
  wait_for "ended with $1"
  until_true "the settings are there" test -s "$folder/after"
  cmp "$folder/before" "$folder/after" || fail "the terminal's settings are others now"
  [[ $(flag alternate_on) == 0 ]] || fail "the terminal is still on its other screen"
  [[ $(flag cursor_flag) == 1 ]] || fail "the cursor is hidden"
  [[ $(flag wrap_flag) == 1 ]] || fail "lines do not wrap any more"
  keys "echo still \$((40 + 2))" Enter
  wait_for 'still 42'
}

look_at_80_columns() {
  begin_watch
  wait_for_driving 'load +[0-9]'
  wait_for_driving 'current  20.0'
  local text
  for text in ' demo 48s  48 cells' 'bmud up' '● main +' 'SOC ' ' +-' 'discharge  ' 'for long' '▼3.' 'cell 3.9 (no. 33)' '▲3.' \
    'cell 1.2 (no. 2)' M1 M2 M3 M4 '▆▆▆▆' 'errors 0' 'late ' 'missed ' 'bad CRC 0' 'drive: '; do
    must_show "$text"
  done
  must_show_like 'lost [0-9]'
  shows_no_fault_of_the_pack || fail "the screen shows a fault of the pack, or not that there is none"
  echo "ok: no fault of the pack"
  must_not_show '…'
  [[ $(flag cursor_flag) == 0 ]] || fail "the cursor is there"
  wait_for_row -1 'q quit'
  wait_for_row 1 'demo 48s'
}

# tmux tells a program of its new size a moment later: until then there may be anything on the screen.
resize_it() {
  resize 120 40
  wait_for_row -1 'q quit'
  wait_for 'temperature 25'
  wait_until_gone '…'
  resize 60 15
  wait_until_gone 'temperature 25'
  wait_for_row 10 'M2  ▆'
  wait_for_row 11 'M4  ▆'
  wait_for_row -1 'q quit  ? help  arrows scroll  f faults'
  wait_for_row 1 'demo 48s'
  # What has no room is marked.
  until_true "a cut row or a count of missing rows" eval "shows '…' || shows 'more lines'"
  resize 30 8
  wait_until_gone 'M2'
  wait_for_row -1 'q quit'
  resize 80 24
  wait_for_row -1 'z zoom'
  wait_for_row 1 'bmud up'
  wait_until_gone '…'
}

# usage: scrolls_to TEXT: behind the last opening, where there was one
scrolls_to() {
  ! shows "$1" || return 0
  keys Down
  return 1
}

press_keys() {
  keys '?'
  wait_for 'all faults, with readings'
  keys Escape
  wait_for 'pack +'
  keys u
  wait_for 'accepted'
  must_show_like 'load +[0-9]'
  keys l
  wait_for 'Limits'
  until_true "the page goes on to the steps of the discharge limit" scrolls_to 'Discharge limit:'
  keys Tab
  wait_for 'Buses and modules'
  keys f
  until_true "the page of faults shows what the daemon has seen" shows_the_faults
  keys b
  wait_for 'modules 1 to '
  keys End
  wait_for ' to 4 of 4'
  keys Up
  wait_for ' to 3 of 4'
  keys Home
  wait_for 'modules 1 to '
  keys n
  wait_for_row 10 'M1   3.8'
  keys z
  wait_for 'zoomed'
  keys a
  wait_until_gone 'modules 1 to '
}

end_it() {
  keys q
  must_be_restored 0
  begin_watch
  wait_for_driving 'current  20.0'
  keys C-c
  must_be_restored 0
  begin_watch
  wait_for_driving 'current  20.0'
  kill -TERM "$(<"$folder/pid")"
  must_be_restored 0
}

look_with_few_signs() {
  begin_watch LC_ALL=C TERM=vt100
  wait_for_row -1 'q quit'
  wait_for_driving 'load +[0-9]'
  wait_for_closed '# main +'
  if screen | LC_ALL=C grep -q '[^ -~]'; then fail "there is more than ASCII on the screen"; fi
  echo "ok: nothing but ASCII"
  keys q
  must_be_restored 0
  # What cannot place its cursor gets lines.
  begin_watch TERM=dumb
  wait_for_closed 'closed         '
  must_not_show 'q quit'
  keys C-c
  must_be_restored 0
}

lose_it() {
  begin_watch
  wait_for_driving 'current  20.0'
  stop "$emulator_pid"
  emulator_pid=
  wait_for '● receive timeout of a module'
  wait_for '[active]'
  wait_for ' s ago'
  wait_for 'close inhibit'
  stop "$daemon_pid"
  daemon_pid=
  wait_for 'connection lost'
  must_be_restored 1
}

start_programs
start_terminal
look_at_80_columns
resize_it
press_keys
end_it
look_with_few_signs
lose_it
echo "PASS"
