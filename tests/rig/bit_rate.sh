#!/bin/bash
# Guest script: real interfaces and their controllers. The bit rate, set by ip and read by the daemon; interfaces that the
# daemon sets up itself; and how a controller is. Needs can0 and can1 of boot.sh --can-bus, under a
# driver with bit timing; vcan has none.
#   usage: bit_rate.sh REPOSITORY PROGRAM_FOLDER...   (the folders of bmud, mmusim, bmuctl and bmudump)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1
shift
for folder in "$@"; do PATH=$folder:$PATH; done

small_pack=$repository/config/packs/demo-48s.json
large_pack=$repository/config/packs/traction-16x12.json
scenario=$RIG_OUT/keys.scn
socket=/run/bmud/bmud.sock
start_limit_s=30
exit_config=78

status_json() { bmuctl --socket "$socket" status --json; }
daemon_answers() { status_json >/dev/null 2>&1; }
# Of the internal bus: "500000 500000 as wanted".
rate_shown() { status_json | jq -r '.ports[0] | "\(.rate_bit_per_s) \(.rate_wanted_bit_per_s) \(.rate_verdict)"'; }
all_modules_heard() { [[ $(status_json | jq .modules_answering) -eq 4 ]]; }
phase_is() { [[ $(status_json | jq -r .state.phase) == "$1" ]]; }
shows_rate() { [[ $(rate_shown) == "$1" ]]; }
# The text is read first: one that bmuctl does not give has nothing, and lacks nothing.
text_shows() { local text; text=$(bmuctl --socket "$socket" status) && grep -q "$1" <<<"$text"; }
text_lacks() { local text; text=$(bmuctl --socket "$socket" status) && ! grep -q "$1" <<<"$text"; }
why_has() { local why; why=$(bmuctl --socket "$socket" why) && grep -q "$1" <<<"$why"; }
why_lacks() { local why; why=$(bmuctl --socket "$socket" why) && ! grep -q "$1" <<<"$why"; }
opened_for() { [[ $(status_json | jq -r .last_opening.fault) == "$1" ]]; }
# Of the internal bus: "error-active 0 0".
controller_shown() { status_json | jq -r '.ports[0].controller | "\(.state) \(.send_errors) \(.receive_errors)"'; }
shows_controller() { [[ $(controller_shown) == "$1" ]]; }
controller_value() { status_json | jq -r ".ports[0].controller.$1"; }
controller_is() { [[ $(controller_value "$1") == "$2" ]]; }
# "500000 200 UP" of an interface, as ip has it.
link_is() { [[ $(ip -json -details link show "$1" | jq -r '.[0] | "\(.linkinfo.info_data.bittiming.bitrate) \(.linkinfo.info_data.restart_ms) \([.flags[] | select(. == "UP")][0])"') == "$2" ]]; }
link_is_down() { ip -json link show "$1" | jq -e '.[0].flags | index("UP") | not' >/dev/null; }
log_has() { grep -q "$2" "$RIG_OUT/$1.log"; }
log_lacks() { [[ -s $RIG_OUT/$1.log ]] && ! grep -q "$2" "$RIG_OUT/$1.log"; }

set_rate() {
  ip link set "$1" down
  ip link set "$1" type can bitrate "$2"
  ip link set "$1" up
}
start_daemon() { start "$1" as_service bmud --config "$2" --bus-internal "$3" --bus-vehicle "$3" --socket "$socket"; }

# A daemon that must not start: its exit status, and what it says.
expect_refused() {
  local name=$1 pack=$2 status=0
  start_daemon "$name" "$pack" can0
  wait_for "$start_limit_s" "$name: it has ended" stopped "$name"
  stop "$name" || status=$?
  expect "$name: its exit status is $exit_config" test "$status" -eq "$exit_config"
}

step "the rate that is wanted"
mkdir -p "$(dirname "$socket")"
# The key is turned every ten seconds, so that a daemon that starts at any time may close.
{
  grep '^0 ' "$repository/vcan-fixtures/calm.scn"
  for ((turn_s = 5; turn_s < 9000; turn_s += 10)); do
    echo "$turn_s vehicle on"
    echo "$((turn_s + 8)) vehicle off"
  done
} >"$scenario"
set_rate can0 500000
set_rate can1 500000
start modules mmusim --bus can1 --pack "$small_pack" --scenario "$scenario"
start_daemon wanted "$small_pack" can0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "status has the rate" shows_rate "500000 500000 as wanted"
expect "and shows it" text_shows ' kbit/s'
wait_for 10 "the log has it" log_has wanted 'can0: bitrate 500 kbit/s as configured'
wait_for 20 "modules are heard" all_modules_heard

step "another rate while it runs"  # [F56]
# Just closed: the key, which opens as well, stays on for as long as this takes.
wait_for 40 "the contactors are open" phase_is open
wait_for 40 "the contactors are closed" phase_is closed
# No rate is set without setting the interface down, and that opens. This bus itself carries frames at any rate.
set_rate can0 250000
wait_for 5 "the contactors are open" phase_is open
expect "for the interface was down" opened_for internal_bus_down
wait_for 10 "status has the new rate" shows_rate "250000 500000 differs"
expect "and shows it" text_shows '250, expected 500'
wait_for 10 "the log has found and wanted" log_has wanted 'found can0 at 250 kbit/s, expected 500 kbit/s'
set_rate can0 10000
wait_for 10 "a rate that is too slow is told" shows_rate "10000 500000 too slow"
expect "and the daemon stays" running wanted
set_rate can0 500000
wait_for 10 "the right one is told, too" shows_rate "500000 500000 as wanted"
expect "bmud exits with 0" stop wanted TERM

step "another rate at the start, which fits"
set_rate can0 250000
start_daemon fits "$small_pack" can0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "status says so" shows_rate "250000 500000 differs"
wait_for 10 "so does the log" log_has fits 'found can0 at 250 kbit/s, expected 500 kbit/s; .* which is sufficient'
expect "bmud exits with 0" stop fits TERM

step "a rate that is too slow at the start"  # [F55]
expect_refused slow "$large_pack"
expect "the log names interface, found and wanted" log_has slow 'found can0 at 250 kbit/s, expected 500 kbit/s; .* bus load too high for /poll/period_ms 50'
expect "and nobody answers" not daemon_answers

step "an interface that is down at the start"  # [F43]
ip link set can0 down
start_daemon down "$large_pack" can0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "nothing is said of a rate" shows_rate "null null unknown"
expect "it is open" phase_is open
expect "and says why" why_has "internal bus down"
ip link set can0 up
wait_for 10 "it is once the interface is up" shows_rate "250000 500000 too slow"
expect "and the daemon stays" running down
wait_for 5 "the bus is no reason any more" why_lacks "internal bus down"
expect "it is still open" phase_is open
expect "bmud exits with 0" stop down TERM

step "a bus without a bit rate"
start_daemon virtual "$small_pack" vcan0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "status has none" shows_rate "null null unknown"
expect "the text has no column for it" text_lacks 'kbit/s'
expect "bmud exits with 0" stop virtual TERM
expect "the log has no word of it" log_lacks virtual 'is set to\|found vcan0'

step "how the controller is"
set_rate can0 500000
start_daemon state "$small_pack" can0
wait_for "$start_limit_s" "bmud answers" daemon_answers
wait_for 10 "the controller is well" shows_controller "error-active 0 0"
expect "and the text shows it" text_shows 'can0 .*error-active'
expect "nobody was asked to set it up" controller_is set_up 'not asked for'
expect "bmud exits with 0" stop state TERM
start_daemon virtual_state "$small_pack" vcan0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "a bus without a controller has an unknown one" shows_controller "unknown null null"
expect "the text has no row for it" text_lacks '^Controller'
expect "bmud exits with 0" stop virtual_state TERM

step "interfaces that the daemon sets up"
wishing_pack=$RIG_OUT/wishing.json
sed "s#\"\.\./cells/#\"$repository/config/cells/#; s#\"poll\"#\"interfaces\": {\"set_up\": true, \"restart_ms\": 150}, \"poll\"#" \
  "$small_pack" >"$wishing_pack"
ip link set can0 down
ip link set can0 type can bitrate 125000 restart-ms 0
start_daemon set_up "$wishing_pack" can0
wait_for "$start_limit_s" "bmud answers" daemon_answers
wait_for 10 "the interface is up as the pack file has it" link_is can0 '500000 150 UP'
wait_for 10 "the log says so" log_has set_up 'can0: configured: 500 kbit/s, restart 150 ms after bus-off'
wait_for 10 "so does the status" controller_is set_up 'done'
expect "the status has its restart time" controller_is restart_ms 150
wait_for 20 "modules are heard" all_modules_heard
ip link set can0 down
wait_for 10 "set down, it is set up again" link_is can0 '500000 150 UP'
# Held, or it might set the interface up again before it has the other rate.
kill -STOP "${started_pids[set_up]}"
set_rate can0 250000
kill -CONT "${started_pids[set_up]}"
wait_for 10 "one that is up with another rate is told" shows_rate "250000 500000 differs"
expect "and left so" link_is can0 '250000 150 UP'
expect "bmud exits with 0" stop set_up TERM
expect "and leaves the interface up" link_is can0 '250000 150 UP'

step "interfaces that it has no right to set up"
ip link set can0 down
start no_right setpriv --bounding-set=-net_admin --inh-caps=-net_admin bmud --config "$wishing_pack" --bus-internal can0 --bus-vehicle can0 --socket "$socket"
wait_for "$start_limit_s" "bmud answers" daemon_answers
wait_for 10 "the log says who has to" log_has no_right 'CAP_NET_ADMIN.*80-can0.network'
expect "the interface is still down" link_is_down can0
set_rate can0 500000
wait_for 20 "set up by somebody else, modules are heard" all_modules_heard
expect "bmud exits with 0" stop no_right TERM

step "end"
stop modules || true
