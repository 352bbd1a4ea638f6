#!/usr/bin/env bash
# Builds with counters and says what the tests run, twice. Of the safety files (files.txt) every line and branch is run by a unit or
# scenario test, or this fails; coverage_report.py says which is not. Of all other files at least nine lines in ten are, in each part of
# the project, by those tests, by those that run the programs, and by what pages show; other_coverage.py says where it is less.
# usage: tests/mutation/coverage.sh [--safety] [BUILD_FOLDER]     --safety: only the safety files; default folder: build-coverage
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
safety_only=no
[[ ${1:-} != --safety ]] || { safety_only=yes; shift; }
build=$(realpath -m "${1:-$repository/build-coverage}")
here=$repository/tests/mutation
profiles=$build/profiles
# What tests print, with what they skip: a stage of CI looks there.
logs=$build/logs
jobs=2
deciding=(test_unit test_scenario)
programs=(bmucell bmuctl bmud bmudump bmureplay mmusim)
# What takes minutes, and what walks through millions of combinations, reaches nothing that the others do not. And where the core runs in
# several threads counts may get lost, so that a branch would look as if it was never taken.
quick='~[slow]~[exhaustive]~[threads]'

# Each source by itself: where clang 14 has headers precompiled and sources in groups, counts of inline functions fit no source any more.
CC=clang CXX=clang++ cmake -S "$repository" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=None -DBMUD_COVERAGE=ON -DBMUD_PRECOMPILE=OFF
targets=("${deciding[@]}")
[[ $safety_only == yes ]] || targets+=(test_integration test_example_device make_every_frame "${programs[@]}")
cmake --build "$build" --parallel "$jobs" --target "${targets[@]}"

rm -rf "$profiles" "$logs"
mkdir "$profiles" "$logs"
# Some tests start programs as another user.
chmod 1777 "$profiles"
# Where a program runs again, or beside itself, its counts are added to those that are there.
export LLVM_PROFILE_FILE=$profiles/other-%m.profraw

merge_into() {
  local name=$1
  shift
  llvm-profdata merge -sparse "$@" -o "$build/$name.profdata"
}

# run_into NAME COMMAND...: shows what it has printed when it has ended
run_into() {
  local log=$logs/$1.log status=0
  shift
  "$@" >"$log" 2>&1 || status=$?
  cat "$log"
  return "$status"
}

running=()
for program in "${deciding[@]}"; do
  LLVM_PROFILE_FILE=$profiles/$program.profraw run_into "$program" "$build/bin/$program" "$quick" &
  running+=($!)
done
for one in "${running[@]}"; do wait "$one"; done

exports=()
for program in "${deciding[@]}"; do
  merge_into "$program" "$profiles/$program.profraw"
  llvm-cov export -format=text -instr-profile="$build/$program.profdata" "$build/bin/$program" >"$build/$program.json"
  exports+=("$build/$program.json")
done
"$here/coverage_report.py" "${exports[@]}"
[[ $safety_only == no ]] || exit 0

run_into test_unit_threads "$build/bin/test_unit" '[threads]'
# Most of them wait for something most of the time.
ctest --test-dir "$build" --timeout 600 --output-on-failure --no-tests=error --parallel $((2 * jobs)) \
  -L '^(integration|docs|golden|script|terminal|dbc)$' --output-log "$logs/ctest.log"
merge_into all "$profiles"/*.profraw
objects=("${deciding[@]}" test_integration "${programs[@]}")
llvm-cov export -summary-only -instr-profile="$build/all.profdata" "${objects[@]/#/-object=$build/bin/}" >"$build/all.json"
"$here/other_coverage.py" "$build/all.json"
