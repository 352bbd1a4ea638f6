#!/usr/bin/env bash
# The checks of this project, each a stage with a name: .ci/run and tests/nightly run the same ones. A stage runs from the repository's
# folder, prints what it does, and fails with a status other than 0. Stages share the build folders build, build-asan and build-tidy, so
# that what one has compiled is there for the next.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=../../tools/packages.sh
source "$repository/tools/packages.sh"
# shellcheck source-path=SCRIPTDIR source=recent.sh
source "$repository/tests/ci/recent.sh"

jobs=2
# Tests that compute count for two of these, and those that wait most of the time for one (tests/CMakeLists.txt).
tests_beside=8
# A test that hangs fails and does not take the whole stage with it.
test_max_s=600
# Of those that take minutes with sanitizers three took longer than that beside an emulated machine and a compiler.
slow_test_max_s=1500
# In one run of CI each kind of test is built by one compiler: with sanitizers where memory errors are plausible, by GCC elsewhere.
# tests/nightly runs every kind with both.
sanitized_kinds=unit,integration,fuzz
other_kinds=scenario,catalogue,property,simulation,script,golden,terminal,docs,dbc,rig,bench,meta

stages_usage() {
  cat <<'TEXT'
usage: tests/ci/stages.sh STAGE [ARGUMENT]     runs one stage
       tests/ci/stages.sh --list               prints the names of all stages

  tests/ci/stages.sh format
  tests/ci/stages.sh tidy 3/16       of all sources the third sixteenth, and what the last commits changed

Exit status: that of the stage; 2 if there is no such stage.
TEXT
}

stage_packages() { packages_install build test rig package lint mutation; }

stage_format() { git ls-files -z --cached --others --exclude-standard -- '*.cpp' '*.hpp' | xargs -0 --no-run-if-empty clang-format --dry-run -Werror; }

# Every script, by its first line: some have no suffix.
shell_scripts() {
  local file first
  git ls-files --cached --others --exclude-standard | while read -r file; do
    # Not a link, and not one that is deleted but not yet committed.
    if [[ ! -f $file ]] || ! IFS= read -r first <"$file"; then continue; fi
    if [[ $first =~ ^#!.*[/\ ](ba|da)?sh$ ]]; then echo "$file"; fi
  done 2>/dev/null
}

stage_scripts() {
  local scripts
  mapfile -t scripts < <(shell_scripts)
  [[ ${#scripts[@]} -gt 0 ]] || { echo "no scripts found"; return 1; }
  echo "${scripts[*]}"
  shellcheck --external-sources "${scripts[@]}"
}

stage_duplicates() { tests/meta/duplicates.py; }
stage_cppcheck() { tests/meta/cppcheck.py; }

# GCC: the product, and the kinds of tests that the sanitizers do not have in the same run.
stage_build() { tools/test --kinds "$other_kinds" --build-only; }
# Charges of hours, and two thirds of the pairs of faults, are left to tests/nightly.
stage_tests() {
  BMUD_PAIRS_PART=$(part_by_commit 3) tools/test --kinds "$other_kinds" -- -LE '^(rig_long|hours)$' --output-log build/ci-tests.log
  check_ctest build build/ci-tests.log
}

# check_skips LOG...: fails if tests, by what they have printed, have skipped what is not on the list. A test that a container cannot
# run is no failure for a user; in CI it would be a check that is lost unnoticed, as it would be with a log that is not there.
check_skips() {
  local log skipped one unexpected=()
  for log in "$@"; do
    [[ -f $log && -r $log && -s $log ]] || { echo "stages.sh: found nothing to read in $log, expected what tests have printed" >&2; return 1; }
  done
  skipped=$(sed -n -e 's/^.*Test *#[0-9]*: \(.*[^ .]\) *\.*\*\*\*\(Skipped\|Not Run\).*$/\1/p' -e 's/^ *skipped: //p' "$@" | sort -u)
  while IFS= read -r one; do
    [[ -z $one ]] || grep -qxF -e "$one" tests/ci/skips.txt || unexpected+=("$one")
  done <<<"$skipped"
  [[ ${#unexpected[@]} -gt 0 ]] || return 0
  echo "stages.sh: skipped, and not in tests/ci/skips.txt:" >&2
  printf '%s\n' "${unexpected[@]}" >&2
  return 1
}

# check_ctest FOLDER LOG: of the last run of ctest there, with its --output-log. What test cases print is in a log of ctest's own. And
# each case of the programs that ctest knew has a test that runs it.
check_ctest() {
  check_skips "$1/Testing/Temporary/LastTest.log" "$2"
  without_address_randomization tests/meta/each_case_once.py "$1"
}

# The sanitizer runtime of older clang fails now and then where the kernel spreads addresses widely; without it where that is not allowed.
without_address_randomization() {
  if setarch --addr-no-randomize true 2>/dev/null; then setarch --addr-no-randomize "$@"; else "$@"; fi
}

# build_with_sanitizers KINDS
build_with_sanitizers() {
  CC=clang CXX=clang++ cmake -S . -B build-asan -G Ninja -DBMUD_SANITIZE=ON -DBMUD_TEST_KINDS="${1//,/;}"
  without_address_randomization cmake --build build-asan --parallel "$jobs"
}

# test_with_sanitizers LOG MAX_S CTEST_ARGUMENTS...: no test may take longer than that.
test_with_sanitizers() {
  local log=$1 max_s=$2
  shift 2
  without_address_randomization ctest --test-dir build-asan --timeout "$max_s" --output-on-failure --no-tests=error \
    --parallel "$tests_beside" --output-log "$log" "$@"
  check_ctest build-asan "$log"
}

stage_sanitizers_build() { build_with_sanitizers "$sanitized_kinds"; }
# What takes minutes with them has its place in tests/nightly.
stage_sanitizers_tests() { test_with_sanitizers build-asan/ci-tests.log "$test_max_s" -L "^(${sanitized_kinds//,/|})\$"; }

# Every kind but the benchmarks, the emulated machine, and the scripts that run whole programs for pages, terminals and DBC files: the parts of
# these programs are under the sanitizers in the other kinds.
stage_all_sanitizers_build() { build_with_sanitizers unit,integration,fuzz,scenario,catalogue,property,simulation,script,golden,meta; }
stage_all_sanitizers_tests() {
  stage_all_sanitizers_build
  test_with_sanitizers build-asan/nightly-tests.log "$test_max_s" -L '^(unit|scenario|script|golden|integration|property|simulation|fuzz|meta)$'
}
# stage_all_sanitizers_slow K/N: of what takes minutes with them every Nth test, beginning with the Kth.
stage_all_sanitizers_slow() {
  stage_all_sanitizers_build
  test_with_sanitizers build-asan/nightly-slow.log "$slow_test_max_s" -L '^(catalogue|slow|hours)$' -I "${1%/*},,${1#*/}"
}

# GCC and every kind of test that needs no emulated machine.
stage_all_build() { tools/test --build-only; }
stage_all_tests() {
  tools/test -- -LE '^rig$' --output-log build/nightly-tests.log
  check_ctest build build/nightly-tests.log
}

# The other compiler without sanitizers, for the kinds that they leave out.
stage_all_clang() {
  CC=clang CXX=clang++ tools/test --build "$PWD/build-clang" -- -L '^(dbc|docs|terminal|bench)$' --output-log build-clang/nightly-tests.log
  check_ctest build-clang build-clang/nightly-tests.log
  test_rig_short build-clang
}

# What GCC doubts is not asked where common headers are precompiled: here it is, and each source includes what it needs.
stage_all_doubts() {
  cmake -S . -B build-doubts -G Ninja -DBMUD_TESTS=ON -DBMUD_PRECOMPILE=OFF
  cmake --build build-doubts --parallel "$jobs"
}

# As many build who do not know ours, and as distributions may: all programs with -O3, without tests.
stage_release_build() {
  cmake -S . -B build-release -G Ninja -DCMAKE_BUILD_TYPE=Release -DBMUD_TESTS=OFF
  cmake --build build-release --parallel "$jobs"
}

# build_programs FOLDER TARGETS...: in a folder that has been configured, or else as GCC's build of everything
build_programs() {
  local folder=$1
  shift
  if [[ ! -f $folder/build.ninja ]]; then
    [[ $folder == build ]] || { stage_all_sanitizers_build; return; }
    tools/test --build-only
  fi
  without_address_randomization cmake --build "$folder" --parallel "$jobs" --target "$@"
}

# The compiler and optimisation of what is shipped, and those of the sanitizers.
stage_same_decisions() {
  build_programs build mmusim bmureplay
  build_programs build-asan mmusim bmureplay
  without_address_randomization tests/meta/same_decisions.sh build/bin build-asan/bin
}
# And none at all.
stage_same_decisions_debug() {
  build_programs build mmusim bmureplay
  cmake -S . -B build-debug -G Ninja -DCMAKE_BUILD_TYPE=Debug -DBMUD_TESTS=OFF
  cmake --build build-debug --parallel "$jobs" --target mmusim bmureplay
  without_address_randomization tests/meta/same_decisions.sh build/bin build-debug/bin
}

# stage_tidy [K/N]: of the sources that the build compiles every Nth, beginning with the Kth; without K/N the part that follows from the
# commit, and what the last commits changed. Generated sources and headers of others are left to the configuration of clang-tidy.
recent_commits=7
recent_max=12
stage_tidy() {
  local part=${1:-$(part_by_commit 16)} recent file chosen=()
  # A requested part is one of all parts, which together have the recent changes.
  if [[ $# -eq 0 ]]; then
    # A clone without that many commits has all sources to choose from.
    recent=$(git diff --name-only "HEAD~$recent_commits" -- '*.cpp' 2>/dev/null) || recent=$(git ls-files '*.cpp')
    while read -r file; do chosen+=(--and "$file"); done < <(head -n "$recent_max" <<<"$recent")
  fi
  # Without precompiled headers a source that forgets to include something is seen.
  CC=clang CXX=clang++ cmake -S . -B build-tidy -G Ninja -DBMUD_SANITIZE=ON -DBMUD_PRECOMPILE=OFF
  # Sources that are compiled for the example of docs/adding-a-device.md, too, include a header that is written from the page.
  cmake --build build-tidy --target example_device_files
  tests/ci/tidy.py --build build-tidy --part "$part" --jobs "$jobs" "${chosen[@]}"
}

# What all slices of the mutants share.
stage_mutation_build() { tests/mutation/mutate.py --prepare; }
# stage_mutation K/N: of all mutants every Nth, beginning with the Kth.
stage_mutation() { tests/mutation/mutate.py --part "$1"; }
# Those of lines that recent commits changed: all, or a part of so many that can be tried in CI.
recent_mutants_max=200
recent_mutants_s=600
stage_mutation_recent() {
  tests/mutation/mutate.py --since "$(recent_base)" --at-most "$recent_mutants_max" --seconds "$recent_mutants_s" --turn "$((0x$(git rev-parse --short=7 HEAD)))"
}
stage_coverage() {
  tests/mutation/coverage.sh
  check_skips build-coverage/logs/{test_unit,test_scenario,test_unit_threads,ctest}.log build-coverage/Testing/Temporary/LastTest.log
}
# Of the safety files alone, which two programs of tests have to reach.
stage_coverage_safety() {
  tests/mutation/coverage.sh --safety
  check_skips build-coverage/logs/{test_unit,test_scenario}.log
}
stage_threads() {
  tests/threads.sh
  check_skips build-threads/threads.log
}
# Inputs of the parsers that no corpus holds.
stage_explore() { tests/fuzz/explore.sh --seconds "$1"; }
stage_explore_part() { tests/fuzz/explore.sh --seconds 15 --part "$(part_by_commit 3)"; }

# A thousand simulated sessions with faults by the optimised program; a failing one prints how to repeat it.
stage_thousand_seeds() {
  build_programs build bmud_simulation
  build/bin/bmud_simulation --seeds 1..1000 --minimise
}
stage_sixty_days() {
  build_programs build bmud_simulation
  build/bin/bmud_simulation --days 60
}
# Fails above 1.5, with the unit's drop-ins or without.
stage_exposure() {
  build_programs build bmud
  packaging/exposure.sh build
}

# test_rig_short FOLDER: those of the emulated machine's tests that tools/test runs
test_rig_short() {
  ctest --test-dir "$1" --output-on-failure --no-tests=error -L '^rig$' -LE '^rig_long$' --output-log "$1/rig-short.log"
  check_ctest "$1" "$1/rig-short.log"
}
stage_rig_short() {
  stage_all_build
  test_rig_short build
}

# The Debian packages of GCC's build: lintian finds no error in them.
stage_packages_built() { packaging/make-packages.sh --build build; }

# stage_rig NAME: one test of the emulated machine, with what it depends on.
stage_rig() {
  stage_all_build
  ctest --test-dir build --output-on-failure --no-tests=error -R "^rig\\.$1\$" --output-log "build/rig-$1.log"
  check_ctest build "build/rig-$1.log"
}

# The suite beside four programs that never wait, at normal priority. No verdict may depend on how much processor a test gets.
stage_load() {
  local busy=() status=0 pid
  # Before they begin: what it takes to compile is not what is asked.
  stage_all_build
  for _ in 1 2 3 4; do
    (while :; do :; done) &
    busy+=($!)
  done
  # The stage's own timeout ends it by a signal.
  # shellcheck disable=SC2064
  trap "kill ${busy[*]} 2>/dev/null" EXIT
  tools/test -- -LE '^rig$' --timeout $((test_max_s * 3)) --output-log build/load-tests.log || status=$?
  for pid in "${busy[@]}"; do kill "$pid"; done
  trap - EXIT
  [[ $status -eq 0 ]] || return "$status"
  check_ctest build build/load-tests.log
}

stage_names() { declare -F | sed -n 's/^declare -f stage_//p' | grep -vx names | tr _ - ; }

stages_main() {
  local function
  case ${1:-} in
    --list) stage_names; return ;;
    -h | --help) stages_usage; return ;;
    '') stages_usage >&2; return 2 ;;
  esac
  function=stage_${1//-/_}
  if ! stage_names | grep -qxF -e "$1"; then
    echo "stages.sh: found '$1', expected one of: $(stage_names | paste -sd' ')" >&2
    return 2
  fi
  shift
  cd "$repository"
  "$function" "$@"
}

if [[ ${BASH_SOURCE[0]} == "$0" ]]; then stages_main "$@"; fi
