# What guest scripts share that watch an emulated pack with its key and measure when its contactors open. Sourced behind
# guest-env.sh, with `repository` and `bus` set:
#   record_words               starts candump on the words between daemon and power distribution unit; it listens when this returns
#   write_keys SCENARIO        a scenario whose key goes off and on for longer than any script lasts
#   start_pack SCENARIO [OPTION...]   the emulated pack, with options of mmusim
#   status_json, phase_is, fault_came ...   what the daemon says of itself
#   first_opening, expect_opened_by_itself, expect_open_until_key ...   what the recording bears out
# shellcheck shell=bash

: "${repository:?}" "${bus:?}" "${started_pids[*]-}"

pack=$repository/config/packs/demo-48s.json
socket=${socket:-/run/bmud/bmud.sock}
# In memory. Whenever the emulated machine waits for the host's disk and has nothing else to do, its clock runs ahead to the next
# timer: a recording on the host would make time pass with each frame.
recording=/run/words.can.log

# The key goes off and on again every 21 s, or as who sources this says. It stays on for longer than a pack that was opened waits before
# it may close again (10 s): whoever closes by himself would do it in that time. The rest is for what comes before the opening on a
# machine that is slow.
key_period_s=${key_period_s:-21}
key_on_s=19
lock_out_s=10
fresh_s=3
# The command's life at the power distribution unit, and what its contactors take to open (docs/scenarios.md).
command_life_ms=200
contactor_opening_ms=10
# One step of the emulated pack, and its turn on the emulated machine's one processor.
machine_late_ms=10
# Generous, and only reached when something is wrong.
# shellcheck disable=SC2034  # for those who source this
start_limit_s=30
close_limit_s=$((3 * key_period_s))

# Ample: the machine's clock may run ahead by minutes, and a key that is never turned again closes nothing.
keys=400

write_keys() {
  local scenario=$1 i
  grep '^0 ' "$repository/vcan-fixtures/calm.scn" >"$scenario"
  for ((i = 0; i < keys; ++i)); do
    echo "$((4 + i * key_period_s)) vehicle on"
    echo "$((4 + i * key_period_s + key_on_s)) vehicle off"
  done >>"$scenario"
}

# Of a higher priority than all it is watched with: what it does late would be taken for the daemon's doing.
start_pack() {
  start mmusim mmusim --bus "$bus" --pack "$pack" --scenario "$@"
  chrt -f -p 60 "${started_pids[mmusim]}"
}

# --- how the daemon is asked ---

status_json() { bmuctl --socket "$socket" status --json; }
daemon_answers() { status_json >/dev/null 2>&1; }
phase_is() { [[ $(status_json 2>/dev/null | jq -r .state.phase) == "$1" ]]; }
view_is_complete() { status_json 2>/dev/null | jq -e '.complete_cycles >= 3 and .modules_answering == 4' >/dev/null; }
fault_count() { bmuctl --socket "$socket" faults --json | jq -e --arg name "$1" '.faults[] | select(.name == $name) | .count_since_start'; }
fault_came() { (($(fault_count "$1") > $2)); }
fault_is_gone() { bmuctl --socket "$socket" faults --json | jq -e --arg name "$1" '.faults[] | select(.name == $name) | (.is_present or .is_warning) | not' >/dev/null; }

# What waits for it is cleared as somebody would; whether it may be is the daemon's to say.
clear_faults() { bmuctl --socket "$socket" clear >>"$RIG_OUT/clear.txt"; }
clear_with_authority() { bmuctl --socket "$socket" clear --authorised >>"$RIG_OUT/clear.txt"; }

# Just closed, with nearly all of the key's time ahead: whoever closes by himself after what comes now would be seen doing it.
# The recording first: it takes less to ask than the daemon.
is_just_closed() { key_turned_on_within "$fresh_s" && phase_is closed; }
wait_until_closed() { wait_for "$close_limit_s" "the contactors are closed" is_just_closed; }

# --- what the recording says ---

# Reads it frame by frame: t its time in s; is_command, is_status; closed: any of the four contactors; key, by_timeout of PDU_STATUS.
ask_recording() {
  local question=$1
  shift
  awk "$@" '
    { t = substr($1, 2, length($1) - 2) + 0; is_command = $3 ~ /^040#/; is_status = $3 ~ /^041#/; data = substr($3, 5) }
    is_command || is_status { closed = substr(data, 2, 1) != "0" }
    is_status { key = substr(data, 4, 1) ~ /[13579BDF]/; by_timeout = substr(data, 1, 1) ~ /[89A-F]/ }
    '"$question" "$recording"
}

# Only what is asked for: the recording is read again and again.
listen_to_words() { exec candump -D -r 1000000 -L "$bus,040:7FF,041:7FF" >"$recording"; }
keep_recording() { [[ ! -e $recording ]] || cp "$recording" "$RIG_OUT"; }
hears_words() { grep -Eqh "^ *$bus +041 .*raw" /proc/net/can/rcvlist_{sff,fil}; }
record_words() {
  at_end+=(keep_recording)
  start words listen_to_words
  wait_for 10 "candump listens" hears_words
  chrt -f -p 50 "${started_pids[words]}"
}

# The first opening after AFTER, which is a word "open" of the power distribution unit behind its word "closed": its time, that of the
# last command before it, "timeout" or "command". A pack that is open already does not open.
first_opening() {
  ask_recording '
    is_command { command = t }
    is_status {
      if (t > after && was_closed && !closed && !done) { printf "%.6f %.6f %s\n", t, command, by_timeout ? "timeout" : "command"; done = 1 }
      was_closed = closed
    }' -v "after=$1"
}
is_open_since() { [[ -n $(first_opening "$1") ]]; }
first_word() { ask_recording 'is_status && t > after && !done { print closed ? "closed" : "open"; done = 1 }' -v "after=$1"; }
is_closed_on_bus() { ask_recording 'is_status { is_closed = closed } END { exit !is_closed }'; }
is_heard_since() { [[ -n $(first_word "$1") ]]; }
# Commands after AFTER, up to the key's next turn to on: the first of them, how many close, and how long the key was on.
commands_until_key() {
  ask_recording '
    t <= after || is_over { next }
    is_status { if (key && was_off) is_over = 1; if (!key && !was_off) { was_off = 1; off_at = t } }
    is_command { if (!count++) first = closed ? "closed" : "open"; if (closed) ++closing }
    END { printf "%s %d %.0f\n", count ? first : "none", closing, (is_over ? off_at : 0) - after }' -v "after=$1"
}
# By the clock of the recording's last frame.
key_turned_on_within() {
  ask_recording 'is_status { if (!key) was_off = 1; if (key && was_off) { on_at = t; was_off = 0 } last = t } END { exit !(on_at && last - on_at <= within) }' -v "within=$1"
}
key_turned_since() { [[ $(commands_until_key "$1") != *" -"* ]]; }

# --- what must be ---

measured=()

# From the last command until the contactors' word "open"; the bound is the unit's own.
expect_opened_by_itself() {
  local name=$1 after=$2 opened_at command_at why lapse_ms
  wait_for 10 "the power distribution unit says open" is_open_since "$after"
  read -r opened_at command_at why <<<"$(first_opening "$after")"
  lapse_ms=$(awk "BEGIN { printf \"%.1f\", ($opened_at - $command_at) * 1000 }")
  measured+=("$name: $lapse_ms ms")
  echo "  $name: open $lapse_ms ms after the last command, by $why"
  expect "it opened by itself" test "$why" = timeout
  expect "not before the command's life was over" test "${lapse_ms%.*}" -ge "$command_life_ms"
  expect "and at once then" test "${lapse_ms%.*}" -le $((command_life_ms + contactor_opening_ms + machine_late_ms))
  lost_at=$command_at
}

# The daemon opened: so long after AFTER, at most.
expect_opened_by_command() {
  local name=$1 after=$2 limit_ms=$3 opened_at command_at why lapse_ms
  wait_for 10 "the power distribution unit says open" is_open_since "$after"
  read -r opened_at command_at why <<<"$(first_opening "$after")"
  lapse_ms=$(awk "BEGIN { printf \"%.1f\", ($opened_at - $after) * 1000 }")
  measured+=("$name: $lapse_ms ms")
  echo "  $name: open after $lapse_ms ms, by $why"
  expect "a command opened it" test "$why" = command
  expect "within $limit_ms ms" test "${lapse_ms%.*}" -le "$limit_ms"
  lost_at=$opened_at
}

# The key is turned off and on, and only that closes.
expect_open_until_key() {
  local first closing on_s
  wait_for "$((key_period_s + 5))" "the key is turned" key_turned_since "$lost_at"
  read -r first closing on_s <<<"$(commands_until_key "$lost_at")"
  expect "the first command after it is open" test "$first" = open
  expect "none closes before the key is turned" test "$closing" -eq 0
  expect "though it stayed on for longer than the lock-out ($on_s s)" test "$on_s" -gt "$lock_out_s"
}

expect_gap_told() {
  wait_for 5 "control_loop_gap is told" fault_came control_loop_gap "$1"
  wait_for 5 "everything is known anew" view_is_complete
  expect "and the contactors are open" phase_is open
}

tell_measured() { printf '  %s\n' "${measured[@]}" | tee "$RIG_OUT/measured.txt"; }
