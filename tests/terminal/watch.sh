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
limit_s=60

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
  echo "--- bmud:"
  tail -n 5 "$folder/bmud.log" || true
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
must_not_show() { ! shows "$1" || fail "the screen shows '$1'"; echo "ok: no '$1'"; }

# None, or, on a machine that was too busy, a decision that came late and nothing else. The page has to show which.
shows_the_faults() {
  local seen
  seen=$("$bin/bmuctl" --socket "$folder/s" --json faults |
    jq -r '.faults[] | select(.count > 0 or .count_since_start > 0 or .is_warning or .stage != "good") | .name') ||
    fail "the daemon's faults cannot be read"
  case $seen in
    '') shows 'No fault has ever been seen' ;;
    tick_overrun) shows 'tick_overrun: a decision came too late' && ! shows 'No fault has ever been seen' ;;
    *) fail "the daemon has seen: $seen" ;;
  esac
}

start_programs() {
  cat >"$folder/drive.scn" <<'TEXT'
0   pack soc_permille 700
0   cell 3.9 soc_permille 690
0   cell 1.2 soc_permille 712
1   vehicle on
+3  load current_A 20
TEXT
  local pack=$source_dir/config/packs/demo-48s.json
  "$bin/mmusim" --bus "$bus" --pack "$pack" --scenario "$folder/drive.scn" >"$folder/mmusim.log" 2>&1 </dev/null &
  emulator_pid=$!
  "$bin/bmud" --config "$pack" --bus-internal "$bus" --bus-vehicle "$bus" --socket "$folder/s" >"$folder/bmud.log" 2>&1 </dev/null &
  daemon_pid=$!
  until_true "the daemon is there" test -S "$folder/s"
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
  wait_for 'CLOSED for'
  wait_for 'load 1'
  wait_for 'current  20.0'
  local text
  for text in ' demo 48s  48 cells' 'bmud up' '● main +' 'SOC ' ' +-' 'discharge  ' 'for long' '▼3.' 'cell 3.9 (no. 33)' '▲3.' \
    'cell 1.2 (no. 2)' M1 M2 M3 M4 '▆▆▆▆' 'no faults' 'errors 0' 'lost 0' 'late ' 'missed ' 'bad CRC 0' 'drive: '; do
    must_show "$text"
  done
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

press_keys() {
  keys '?'
  wait_for 'all faults, with what was seen'
  keys Escape
  wait_for 'pack +'
  keys u
  wait_for 'accepted'
  must_show 'load 1'
  keys l
  wait_for 'The discharge limit, step by step'
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
  wait_for 'CLOSED for'
  keys C-c
  must_be_restored 0
  begin_watch
  wait_for 'CLOSED for'
  kill -TERM "$(<"$folder/pid")"
  must_be_restored 0
}

look_with_few_signs() {
  begin_watch LC_ALL=C TERM=vt100
  wait_for_row -1 'q quit'
  wait_for 'load 1'
  must_show '# main +'
  if screen | LC_ALL=C grep -q '[^ -~]'; then fail "there is more than ASCII on the screen"; fi
  echo "ok: nothing but ASCII"
  keys q
  must_be_restored 0
  # What cannot place its cursor gets lines.
  begin_watch TERM=dumb
  wait_for 'closed         '
  must_not_show 'q quit'
  keys C-c
  must_be_restored 0
}

lose_it() {
  begin_watch
  wait_for 'CLOSED for'
  stop "$emulator_pid"
  emulator_pid=
  wait_for '● a module does not answer'
  wait_for '[active] module '
  wait_for ' s ago'
  wait_for 'may not close'
  stop "$daemon_pid"
  daemon_pid=
  wait_for 'the daemon has gone'
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
