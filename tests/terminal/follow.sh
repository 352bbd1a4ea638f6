#!/usr/bin/env bash
# bmudump --follow on a terminal, as a person sees it: the table is there and goes on, fits the window when that changes,
# scrolls, has colours only where they are wanted, and gives the terminal back as it was. Needs tmux; skipped (77) without.
#
#   follow.sh BIN_DIRECTORY SOURCE_DIRECTORY
set -euo pipefail

bin=${1:?usage: follow.sh BIN_DIRECTORY SOURCE_DIRECTORY}
source=${2:?usage: follow.sh BIN_DIRECTORY SOURCE_DIRECTORY}
command -v tmux >/dev/null || { echo "skipped: tmux is missing; tools/packages.sh test installs it"; exit 77; }

work=$(mktemp -d)
bus=follow-test-$$
emulator=
clean_up() {
  terminal kill-server 2>/dev/null || true
  [[ -z $emulator ]] || { kill "$emulator" 2>/dev/null || true; wait "$emulator" 2>/dev/null || true; }
  rm -rf "$work" "/dev/shm/bmud-bus.$bus"
}
trap clean_up EXIT

terminal() { tmux -S "$work/tmux" -f /dev/null "$@"; }
screen() { terminal capture-pane -p -t test "$@"; }

fail() {
  echo "follow: $*; the screen has:"
  screen || true
  exit 1
}

# until_screen WORDS PATTERN: waits until a line matches.
until_screen() {
  for ((try = 0; try < 1200; ++try)); do
    if screen | grep -qE -- "$2"; then return; fi
    sleep 0.05
  done
  fail "$1 (no line matches '$2')"
}
until_no_screen() {
  for ((try = 0; try < 1200; ++try)); do
    if ! screen | grep -qE -- "$2"; then return; fi
    sleep 0.05
  done
  fail "$1 (a line matches '$2')"
}
is() { [[ $(terminal display-message -p -t test "$1") == "$2" ]] || fail "$3"; }
frames_shown() { screen | sed -nE 's/^unix:[^ ]* +([0-9]+) frames.*/\1/p'; }
start() { terminal send-keys -t test "$1" Enter; }
# The shell shows how the program ended, and that it has echo and a cursor again.
ended() {
  until_screen "$1: the shell is not back" 'ended with 0, echo on'
  is '#{alternate_on}' 0 "$1: the other screen is still on"
  is '#{cursor_flag}' 1 "$1: the cursor is not back"
  terminal send-keys -t test clear Enter
  until_no_screen "$1: cannot clear" 'ended with'
}

"$bin/mmusim" --bus "unix:$bus" --pack "$source/config/packs/demo-48s.json" --quiet >"$work/mmusim" 2>&1 &
emulator=$!
cat >"$work/follow" <<SCRIPT
"$bin/bmudump" --follow "\$@"
status=\$?
stty -a | grep -qE '(^| )echo( |;|\$)' && echo "ended with \$status, echo on"
SCRIPT
TERM=xterm-256color LC_ALL=C.UTF-8 PS1='$ ' terminal new-session -d -s test -x 110 -y 14 "bash --norc --noprofile"

start "bash $work/follow unix:$bus"
until_screen "the table does not come" '^041 +PDU_STATUS +[0-9]+ +[0-9.]+/s '
is '#{alternate_on}' 1 "the table is not on the other screen"
is '#{cursor_flag}' 0 "the cursor is in the way"
screen -e | grep -q $'\x1b\[' || fail "a terminal has no colours"
before=$(frames_shown)
for ((try = 0; try < 1200; ++try)); do
  after=$(frames_shown)
  [[ ${after:-0} -le $before ]] || break
  sleep 0.05
done
[[ ${after:-0} -gt $before ]] || fail "the table does not go on"

terminal resize-window -t test -x 60 -y 5
until_screen "a small window has no foot line" 'rows 1 to 2 of [0-9]+'
if screen | LC_ALL=C.UTF-8 grep -qE '^.{61,}$'; then fail "a row is too long"; fi
terminal send-keys -t test Down
until_screen "the arrow does not scroll" 'rows 2 to 3 of'
terminal send-keys -t test Up
until_screen "the arrow does not scroll back" 'rows 1 to 2 of'
terminal resize-window -t test -x 110 -y 14
until_screen "the table does not grow again" '^52[0-9] +'

# The values get the room, whatever the width; what is cut has a mark and can be moved to.
terminal resize-window -t test -x 80 -y 24
until_screen "80 columns have no values" '^521 SENSOR_CURRENT +[0-9.]+/s  pack_current -?[0-9.]+ A '
until_screen "80 columns have a mark nowhere" '^041 PDU_STATUS +[0-9.]+/s  [a-z_]+  .*…$'
if screen | LC_ALL=C.UTF-8 grep -qE '^.{81,}$'; then fail "a row is too long"; fi
terminal resize-window -t test -x 120 -y 40
until_screen "120 columns do not have all" '^id +message +frames +rate +gap max +age  values$'
until_screen "120 columns do not count" '^521 SENSOR_CURRENT +[0-9]+ +[0-9.]+/s +[0-9.]+ s +[0-9.]+ s  pack_current '
terminal resize-window -t test -x 40 -y 24
until_screen "40 columns have no values" '^521 SENSOR_CURRENT +pack_current -?[0-9.]+'
until_screen "40 columns have no short head" '^unix:[^ ]+ +[0-9.]+/s +load '
terminal send-keys -t test Right
until_screen "the arrow does not move the values" '^id +message +<- values$'
terminal send-keys -t test Left
until_screen "the arrow does not move the values back" '^id +message +values$'
terminal send-keys -t test q
ended "q"

start "NO_COLOR=1 bash $work/follow unix:$bus"
until_screen "without colours there is no table" '^041 +PDU_STATUS'
if screen -e | grep -q $'\x1b\['; then fail "NO_COLOR is not honoured"; fi
terminal send-keys -t test C-c
ended "Ctrl-C"
echo "ok"
