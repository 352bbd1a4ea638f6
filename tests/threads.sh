#!/usr/bin/env bash
# Runs what has threads (the daemon itself with its clients, and the tests of stores, recorder, console, readers and bmureplay) under ThreadSanitizer.
# A daemon that a test starts writes its report beside those of the test's own: where one is found, this fails, whatever the test saw.
# usage: tests/threads.sh [BUILD_FOLDER [WORDS_FOR_CATCH...]]
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$(realpath -m "${1:-$repository/build-threads}")
shift $(($# > 0 ? 1 : 0))
# Its runtime cannot place itself where the kernel spreads addresses widely.
plainly=()
if setarch --addr-no-randomize true 2>/dev/null; then plainly=(setarch --addr-no-randomize); fi

CC=clang CXX=clang++ cmake -S "$repository" -B "$build" -G Ninja -DBMUD_SANITIZE_THREADS=ON
"${plainly[@]}" cmake --build "$build" --parallel 2 --target test_threads

reports=$(mktemp -d "${TMPDIR:-/tmp}/bmud-threads.XXXXXX")
trap 'rm -rf "$reports"' EXIT
# Some tests start programs as another user.
chmod 1777 "$reports"
# A report does not end the program: the test goes on, and the one report may be followed by another that says more. Nor does a program
# wait a second at its end for races there: tests say how soon a daemon ends.
export TSAN_OPTIONS="log_path=$reports/report halt_on_error=0 exitcode=66 atexit_sleep_ms=20 history_size=4 suppressions=$repository/tests/threads.suppressions"
# Memory cannot be made short under it (tests/support/allocation_count.cpp). What processes share on the embedded bus it does not see: only
# the test with threads on it is asked for. And its runtime writes out standard error before a process ends, which nobody can whose log
# takes nothing.
[[ $# -gt 0 ]] || set -- '~[embedded_bus]~"where memory is short*"~"a log that takes nothing*","threads with ports of their own*"'
# Into a file and not a pipe, which a daemon that is left behind would hold open. It says what was skipped, too: a stage of CI looks there.
log=$build/threads.log
echo "threads.sh: the tests run, into $log"
status=0
"${plainly[@]}" "$build/bin/test_threads" "$@" --durations no >"$log" 2>&1 || status=$?
cat "$log"

for report in "$reports"/report*; do
  [[ -s $report ]] || continue
  echo "threads.sh: ${report##*.} reported:" >&2
  cat "$report" >&2
  status=1
done
exit $status
