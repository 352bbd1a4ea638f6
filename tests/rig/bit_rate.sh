#!/bin/bash
# Guest script: the bit rate of a real interface, set by ip and read by the daemon. Needs can0 and can1 of boot.sh --can-bus, under a
# driver with bit timing; vcan has none.
#   usage: bit_rate.sh REPOSITORY PROGRAM_FOLDER...   (the folders of bmud, mmusim, bmuctl and bmudump)
# shellcheck source-path=SCRIPTDIR source=guest-env.sh
source "$(dirname "$0")/guest-env.sh"

repository=$1
shift
for folder in "$@"; do PATH=$folder:$PATH; done

small_pack=$repository/config/packs/demo-48s.json
large_pack=$repository/config/packs/traction-16x12.json
scenario=$repository/vcan-fixtures/calm.scn
socket=/run/bmud/bmud.sock
start_limit_s=30
exit_config=78

status_json() { bmuctl --socket "$socket" status --json; }
daemon_answers() { status_json >/dev/null 2>&1; }
# Of the internal bus: "500000 500000 as wanted".
rate_shown() { status_json | jq -r '.ports[0] | "\(.rate_bit_per_s) \(.rate_wanted_bit_per_s) \(.rate_verdict)"'; }
all_modules_heard() { [[ $(status_json | jq .modules_answering) -eq 4 ]]; }
shows_rate() { [[ $(rate_shown) == "$1" ]]; }
text_shows() { bmuctl --socket "$socket" status | grep -q "$1"; }
log_has() { grep -q "$2" "$RIG_OUT/$1.log"; }

set_rate() {
  ip link set "$1" down
  ip link set "$1" type can bitrate "$2"
  ip link set "$1" up
}
start_daemon() { start "$1" bmud --config "$2" --bus-internal "$3" --bus-vehicle "$3" --socket "$socket"; }

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
set_rate can0 500000
set_rate can1 500000
start modules mmusim --bus can1 --pack "$small_pack" --scenario "$scenario"
start_daemon wanted "$small_pack" can0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "status has the rate" shows_rate "500000 500000 as wanted"
expect "and shows it" text_shows ' kbit/s'
wait_for 10 "the log has it" log_has wanted 'can0 is set to 500 kbit/s, as wanted'
wait_for 20 "modules are heard" all_modules_heard

step "another rate while it runs"
set_rate can0 250000
wait_for 10 "status has the new rate" shows_rate "250000 500000 differs"
expect "and shows it" text_shows '250, not 500'
wait_for 10 "the log has found and wanted" log_has wanted 'found can0 set to 250 kbit/s, wanted 500 kbit/s'
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
wait_for 10 "so does the log" log_has fits 'found can0 set to 250 kbit/s, wanted 500 kbit/s; .* which fits'
expect "bmud exits with 0" stop fits TERM

step "a rate that is too slow at the start"
expect_refused slow "$large_pack"
expect "the log names interface, found and wanted" log_has slow 'found can0 set to 250 kbit/s, wanted 500 kbit/s; .* too long for /poll/period_ms 50'
expect "and nobody answers" not daemon_answers

step "an interface that is down at the start"
ip link set can0 down
start_daemon down "$large_pack" can0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "nothing is said of a rate" shows_rate "null null unknown"
ip link set can0 up
wait_for 10 "it is once the interface is up" shows_rate "250000 500000 too slow"
expect "and the daemon stays" running down
expect "bmud exits with 0" stop down TERM

step "a bus without a bit rate"
start_daemon virtual "$small_pack" vcan0
wait_for "$start_limit_s" "bmud answers" daemon_answers
expect "status has none" shows_rate "null null unknown"
expect "the text has no column for it" not text_shows 'kbit/s'
expect "bmud exits with 0" stop virtual TERM
expect "the log has no word of it" not log_has virtual 'is set to\|found vcan0'

step "end"
stop modules || true
