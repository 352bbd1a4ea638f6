#!/usr/bin/env bash
# Builds the unit and scenario tests with counters, runs them, and fails if a line or branch of the safety files
# (files.txt) was not run by any; coverage_report.py says which. Takes the folder to build in, default build-coverage.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$(realpath -m "${1:-$repository/build-coverage}")
jobs=2
programs=(test_unit test_scenario)

CC=clang CXX=clang++ cmake -S "$repository" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=None -DBMUD_COVERAGE=ON
cmake --build "$build" --parallel "$jobs" --target "${programs[@]}"

# What takes minutes reaches nothing that the others do not.
running=()
for program in "${programs[@]}"; do
  LLVM_PROFILE_FILE=$build/$program.profraw "$build/bin/$program" '~[slow]' &
  running+=($!)
done
for one in "${running[@]}"; do wait "$one"; done

exports=()
for program in "${programs[@]}"; do
  llvm-profdata merge -sparse "$build/$program.profraw" -o "$build/$program.profdata"
  llvm-cov export -format=text -instr-profile="$build/$program.profdata" "$build/bin/$program" >"$build/$program.json"
  exports+=("$build/$program.json")
done
"$repository/tests/mutation/coverage_report.py" "${exports[@]}"
