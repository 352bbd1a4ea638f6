#!/usr/bin/env bash
# Runs what has threads (the daemon itself with its clients, and the unit tests of stores, recorder and readers) under ThreadSanitizer.
# A race that it finds ends the program that has it, and so the test.   usage: tests/threads.sh [BUILD_FOLDER]
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$(realpath -m "${1:-$repository/build-threads}")
# Its runtime cannot place itself where the kernel spreads addresses widely.
plainly=()
if setarch --addr-no-randomize true 2>/dev/null; then plainly=(setarch --addr-no-randomize); fi

CC=clang CXX=clang++ cmake -S "$repository" -B "$build" -G Ninja -DBMUD_SANITIZE_THREADS=ON
"${plainly[@]}" cmake --build "$build" --parallel 2 --target test_threads test_integration
export TSAN_OPTIONS="halt_on_error=1 exitcode=66 history_size=4 suppressions=$repository/tests/threads.suppressions"
for program in test_threads test_integration; do
  echo "threads.sh: $program"
  # What other programs are asked for has no threads of ours.
  "${plainly[@]}" "$build/bin/$program" '~[slow]~[bmucell]~[bmudump]~[allocation]' --durations no
done
