#!/usr/bin/env bash
# tests/ci/runner.sh keeps to its budget, its deadline and each stage's limit, and its table and record say what happened; the tables of
# stages name stages that are there, tests/nightly has each of them, and each kind of test is built by some compiler.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
folder=$(mktemp -d "${TMPDIR:-/tmp}/bmud-ci-runner.XXXXXX")
trap 'rm -rf "$folder"' EXIT
# shellcheck source-path=SCRIPTDIR source=../ci/runner.sh
source "$repository/tests/ci/runner.sh"
runner_kill_after_s=1

fail() {
  echo "ci_runner.sh: $*" >&2
  exit 1
}

# expect NAME FOUND EXPECTED
expect() { [[ $2 == "$3" ]] || fail "$1: found '$2', expected '$3'"; }

# Stages: their names say what they do. One that hangs ignores the signal that asks it to end.
cat >"$folder/stages" <<'STAGES'
#!/usr/bin/env bash
echo "$1" >>"$(dirname "$0")/began"
case $1 in
  good*) exit 0 ;;
  bad*) exit 3 ;;
  hangs*) trap '' TERM; while :; do sleep 1; done ;;
esac
STAGES
chmod +x "$folder/stages"

# run_tables BUDGET_S DEADLINE_S FIRST REQUIRED OPTIONAL [URGENT]: tables as printf writes them; sets status
run_tables() {
  printf '# a comment\n%b' "$4" >"$folder/required"
  printf '%b' "$5" >"$folder/optional"
  : >"$folder/began"
  rm -f "$folder/record"
  status=0
  runner_start "$1" "$2" "$folder/stages"
  { runner_required "$folder/required" && { [[ -z $5 ]] || runner_optional "$folder/optional" "$3" "${6:-}"; }; } >"$folder/out" 2>&1 || status=1
  runner_record "$folder/record" 0123456789012345678901234567890123456789 cold
}
without_numbers() { tr '\t' ' ' | sed 's/[0-9][0-9]*/#/g'; }
began() { paste -sd' ' "$folder/began"; }
results() { printf '%s\n' "${runner_rows[@]}" | cut -f 1,3 | tr '\t' = | paste -sd' '; }

run_tables 100 200 1 'good-a\t50\ngood-b\t50\n' 'good-x\t10\ngood-y\t10\ngood-z\t10\n'
expect "all that fits runs, optional stages from their turn on" "$(began)" "good-a good-b good-y good-z good-x"
expect "nothing fails" "$status ${runner_failed:-none}" "0 none"
[[ $(cut -f 1,3,5 "$folder/record") == $'0123456789012345678901234567890123456789\tcold\tpassed' ]] || fail "record: $(cat "$folder/record")"
expect "the record's stages" "$(cut -f 6- "$folder/record" | without_numbers)" "good-a=# good-b=# good-y=# good-z=# good-x=#"

run_tables 100 200 1 'good-a\t50\n' 'good-x\t10\ngood-y\t10\ngood-z\t10\n' good-x
expect "what is urgent goes first, once" "$(began)" "good-a good-x good-y good-z"

run_tables 100 200 0 'good-a\t50\nbad\t50\ngood-b\t50\n' 'good-x\t10\n'
expect "a stage that fails ends the run" "$(began)" "good-a bad"
expect "and is named" "$status $runner_failed" "1 bad"
expect "with its status" "$(results)" "good-a=ok bad=failed: status 3"
expect "in the record" "$(cut -f 5 "$folder/record")" bad
expect "and in the table" "$(runner_table | tail -n 1 | awk '{ print $1, $3, $4 }')" "together failed: bad"

run_tables 100 200 0 '' ''
expect "a table without rows is nothing that passed" "$status $runner_failed" "1 reading $folder/required"
expect "what is put behind the stages of the record" "$(runner_record "$folder/more" 0 cold tree=changed; cut -f 6- "$folder/more")" "tree=changed"

run_tables 100 200 0 'hangs\t1\ngood-b\t50\n' ''
expect "a stage that exceeds its limit fails by name" "$(results)" "hangs=failed: exceeded 1 s"

# Seconds that have passed, as this machine may be slow.
own_clock=$(declare -f runner_elapsed_s)
elapsed_is() { eval "runner_elapsed_s() { echo $1; }"; }
elapsed_by_clock() { eval "$own_clock"; }
elapsed_is 3
run_tables 100 5 0 'hangs-a\t50\n' ''
expect "the deadline shortens the limit" "$(results)" "hangs-a=failed: exceeded 2 s"
elapsed_by_clock

run_tables 100 0 0 'good-a\t50\n' ''
expect "behind the deadline nothing begins" "$(began)$(results)" "good-a=failed: no time left of 0 s"

run_tables 100 200 0 'good-a\t50\n' 'good-x\t101\ngood-y\t5\n'
expect "an optional stage that does not fit is skipped by name" "$(results | sed 's/, [0-9]* s left//')" \
  "good-a=ok good-x=skipped: needs 101 s good-y=ok"
if cut -f 6- "$folder/record" | grep -q good-x; then fail "a skipped stage is in the record"; fi

run_tables 100 30 0 'good-a\t20\n' 'good-x\t50\ngood-y\t10\n'
expect "nor one that does not fit before the deadline" "$(results | sed 's/, [0-9]* s left//')" \
  "good-a=ok good-x=skipped: needs 50 s of 30 s good-y=ok"

run_tables 100 200 0 'good-a\t50\n' 'hangs\t1\ngood-y\t5\n'
expect "an optional stage that is late fails nothing" "$status $(results)" "0 good-a=ok hangs=no result: exceeded 2 s good-y=ok"

elapsed_is 97
run_tables 100 200 0 'good-a\t50\n' 'hangs\t2\n'
expect "and ends with the budget" "$status $(results)" "0 good-a=ok hangs=no result: exceeded 3 s"
run_tables 200 100 0 'good-a\t50\n' 'hangs\t2\n'
expect "and at the deadline" "$status $(results)" "0 good-a=ok hangs=no result: exceeded 3 s"
elapsed_by_clock

run_tables 100 200 0 'good-a\t50\n' 'bad\t10\ngood-y\t5\n'
expect "an optional stage that fails is reported and does not decide" "$status $(results)" \
  "0 good-a=ok bad=FOUND SOMETHING: status 3 good-y=ok"
expect "but is named in the record" "$(cut -f 5- "$folder/record" | without_numbers)" "passed good-a=# bad=# good-y=# found=bad"
expect "and in the last line of the table" "$(runner_table | tail -n 1 | without_numbers | tr -s ' ')" \
  "together # passed, but found something: bad"

note() { echo "$1=$3" >>"$folder/notes"; }
runner_note=note
run_tables 100 200 0 'good-a\t50\n' 'bad\t10\nhangs\t1\ngood-y\t5\n'
runner_note=''
expect "who wants to know learns how each stage ended, but for one that was ended" "$(paste -sd' ' "$folder/notes")" \
  "good-a=passed bad=status 3 good-y=passed"

# What ctest said last.
runner_start 100 200 "$folder/stages"
printf '1/2 Test #1: one\n\n100%% tests passed, 0 tests failed out of 2\n' >"$folder/one.log"
printf '1/2 Test #1: two\n\n50%% tests passed, 1 tests failed out of 2\n\t1 - two (Failed)\n' >"$folder/two.log"
summaries() { runner_summaries one="$folder/one.log" two="$folder/two.log" three="$folder/three.log" 2>&1 | paste -sd'|'; }
expect "a run that passes ends with ctest's summaries" "$(summaries)" \
  "100% tests passed, 0 tests failed out of 2|50% tests passed, 1 tests failed out of 2|$(printf '\t')1 - two (Failed)"
runner_failed=two
expect "one that fails with that of the stage that failed, and says so" "$(summaries)" \
  "50% tests passed, 1 tests failed out of 2|$(printf '\t')1 - two (Failed)|ci: FAILED in stage \"two\""
for runner_failed in three other; do
  expect "and with no other" "$(summaries)" "ci: FAILED in stage \"$runner_failed\""
done

# The tables themselves.
stages=$("$repository/tests/ci/stages.sh" --list)
rows_of() { runner_rows_of "$repository/tests/ci/$1.tsv"; }
named=$({ rows_of required | cut -f 1; rows_of optional | cut -f 1; rows_of nightly | cut -f 2 | cut -d ' ' -f 1; } | sort -u)
expect "every stage is in a table, and every row has its stage" "$named" "$(sort <<<"$stages")"
# What every run has with one compiler only, or of a part, tests/nightly has whole under another name.
for optional in $(rows_of optional | cut -f 1 | sed -E 's/-(recent|part|safety)$//'); do
  rows_of nightly | cut -f 2 | cut -d ' ' -f 1 | grep -qx "$optional" ||
    fail "tests/ci/nightly.tsv lacks the optional stage $optional"
done
# Without a compiler cache the required stages take 1447 s of the budget of 44 minutes (docs/testing.md).
rows_of optional | awk -F'\t' '$2 > 44 * 60 - 1447 { print; long = 1 } END { exit long }' || fail "a stage that a cold run has no room for"
rows_of optional | awk -F'\t' '$2 <= 60 { print; short = 1 } END { exit short }' || fail "what takes at most a minute is required, or no run need have it"
rows_of nightly | awk -F'\t' '$3 > 1800 { print; late = 1 } END { exit late }' || fail "a slice of tests/nightly may take more than 30 minutes"
kinds=$(sed -n 's/^\(sanitized_kinds\|other_kinds\)=//p' "$repository/tests/ci/stages.sh" | tr , '\n' | sort | paste -sd' ')
all_kinds=$(sed -n 's/^set(all_test_kinds \(.*\))$/\1/p' "$repository/tests/CMakeLists.txt" | tr ' ' '\n' | sort | paste -sd' ')
expect ".ci/run builds each kind of test once" "$kinds" "$all_kinds"

# The stages themselves, in a project whose programs only note what they are asked, and print as tests do: nothing, or what SAYS says.
fake=$folder/fake
mkdir -p "$fake"/{bin,build,build-threads/bin,build-coverage/bin,packaging,tests/ci,tests/meta,tests/mutation,tools}
cp "$repository"/tests/ci/{stages.sh,recent.sh,skips.txt} "$fake/tests/ci/"
cp "$repository/tests/threads.sh" "$fake/tests/"
cp "$repository/tests/mutation/coverage.sh" "$fake/tests/mutation/"
cp "$repository/tools/packages.sh" "$fake/tools/"
cat >"$fake/bin/ctest" <<'PROGRAM'
#!/usr/bin/env bash
project=$(cd "$(dirname "$(realpath "$0")")/.." && pwd)
name=$(basename "$0")
echo "$name $*" >>"$project/calls"
# And what runs beside it in the same stage. grep goes on where a process ends before its status is read; awk ends there.
[[ $name != test ]] || echo $(($(grep -hs '^PPid:' /proc/[0-9]*/status | grep -cw "$PPID") - 1)) >>"$project/calls"
folder=build log=''
while [[ $# -gt 0 ]]; do
  case $1 in
    --test-dir | --build) folder=$2 ;;
    --output-log) log=$2 ;;
  esac
  shift
done
case=''
[[ $SAYS != case ]] || case='skipped: no such thing here'
[[ $SAYS != listed ]] || case='skipped: a sanitizer needs descriptors to look at objects'
printf 'of a case\n  %s\n' "$case"
if [[ -n $log ]]; then
  mkdir -p "$folder/Testing/Temporary"
  [[ $SAYS == 'no log of cases' ]] || printf 'of a case\n  %s\n' "$case" >"$folder/Testing/Temporary/LastTest.log"
  result='   Passed'
  [[ $SAYS != test ]] || result='***Skipped'
  [[ $SAYS != 'disabled test' ]] || result='***Not Run (Disabled)'
  [[ $SAYS == 'no log' ]] || echo "1/1 Test #7: some test ........$result    0.01 sec" >"$log"
fi
PROGRAM
chmod +x "$fake/bin/ctest"
for program in bin/{cmake,llvm-cov,llvm-profdata} tools/test build-threads/bin/test_threads build-coverage/bin/test_{unit,scenario} \
  packaging/make-packages.sh tests/meta/each_case_once.py tests/mutation/{coverage_report,other_coverage}.py; do
  ln "$fake/bin/ctest" "$fake/$program"
done
# run_stage SAYS STAGE [ARGUMENT]: sets status and the file out
run_stage() {
  rm -rf "$fake/calls" "$fake"/build*/{Testing,logs,*.log}
  status=0
  SAYS=$1 PATH="$fake/bin:$PATH" "$fake/tests/ci/stages.sh" "${@:2}" >"$folder/out" 2>&1 || status=$?
}
stages_with_tests=(tests 'all-sanitizers-slow 1/6' all-clang all-sanitizers-tests all-tests coverage coverage-safety load 'rig smoke' rig-short sanitizers-tests threads)
# shellcheck disable=SC2016  # the other shell's
bodies=$(bash -c 'source "$1"; declare -f' - "$repository/tests/ci/stages.sh")
# calls PATTERN: stages whose function has it
calls() { awk -v called="$1" '/^[a-z]/ { name = $1 } $0 ~ called { print name }' <<<"$bodies" | sed -n 's/^stage_//p' | tr _ - | sort -u; }
expect "every stage that runs tests is one of those that are tried here" \
  "$(calls ' ctest |tools/test .*-- |test_with_sanitizers|test_rig_short|tests/(threads|mutation/coverage).sh' | paste -sd' ')" \
  "$(printf '%s\n' "${stages_with_tests[@]%% *}" | sort -u | paste -sd' ')"
for stage in "${stages_with_tests[@]}"; do
  read -ra words <<<"$stage"
  run_stage case "${words[@]}"
  expect "stage $stage, of which a case is skipped" "$status $(tail -n 2 "$folder/out" | paste -sd' ')" \
    "1 stages.sh: skipped, and not in tests/ci/skips.txt: no such thing here"
done
for stage in tests coverage; do
  for says in nothing listed; do
    run_stage "$says" "$stage"
    expect "stage $stage of which all runs, or what is left out may be" "$status $(grep 'stages.sh:' "$folder/out" || true)" "0 "
  done
  for says in test 'disabled test'; do
    run_stage "$says" "$stage"
    expect "stage $stage, of which a $says is not run" "$status $(tail -n 1 "$folder/out")" "1 some test"
  done
  for lost in 'no log' 'no log of cases'; do
    run_stage "$lost" "$stage"
    expect "stage $stage with $lost" "$status $(tail -n 1 "$folder/out" | sed 's/ in .*\.log,/ in LOG,/')" \
      "1 stages.sh: found nothing to read in LOG, expected what tests have printed"
  done
done
for stage in all-clang rig-short; do
  run_stage nothing "$stage"
  expect "stage $stage has each short test of the emulated machine" "$(grep -c -e '^ctest .* -L ^rig\$ -LE ^rig_long\$ ' "$fake/calls")" 1
done
run_stage nothing packages-built
expect "packages are those of the build that the run has tested" "$(cat "$fake/calls")" "make-packages.sh --build build"
run_stage nothing load
expect "what is compiled is compiled before other programs make the machine busy" \
  "$(sed 's/^test .*\(--build-only\|-LE\).*/\1/' "$fake/calls" | paste -sd' ')" "--build-only 0 -LE 4"

# Slices that say by whom what they need is built, and stages that call what builds it.
built_by() { rows_of nightly | awk -F'\t' -v builder="$1" '(" " $5 " ") ~ (" " builder " ") { print $2 }' | cut -d ' ' -f 1 | sort -u; }
expect "what uses GCC's build has it built before" "$(built_by all-build)" \
  "$(calls '[ ]stage_all_build|build_programs build |^ *tools/test --( |$)|make-packages' | grep -xFf <(rows_of nightly | cut -f 2 | cut -d ' ' -f 1))"
expect "and what uses that with sanitizers" "$(built_by all-sanitizers-build)" \
  "$(calls '[ ]stage_all_sanitizers_build|build_programs build-asan ' | grep -xFf <(rows_of nightly | cut -f 2 | cut -d ' ' -f 1))"
packages_max_s=$(sed -n 's/^packages_max_s=//p' "$repository/tests/nightly")
expect "packages may take tests/nightly as long as .ci/run" "$packages_max_s" "$(rows_of required | awk '$1 == "packages" { print $2 }')"

# Its results, in a working copy: where there is no git there are no keys.
if git -C "$repository" rev-parse --quiet --verify HEAD >/dev/null 2>&1; then
  # Nothing is published to it.
  nightly() { XDG_STATE_HOME=$folder BMUD_NIGHTLY_PUBLISHED=$folder/passed.tsv "$repository/tests/nightly" "$@"; }
  note() { nightly --note "$@" "$(nightly --tree)"; }
  state_of() { nightly --list "$1" | head -n 1 | tr -s ' ' | cut -f 1; }
  expect "a slice that never ran" "$(state_of scripts)" "scripts has not run"
  note scripts 7 passed
  expect "a stage that passed elsewhere" "$(state_of scripts)" "scripts passed"
  note scripts 7 'status 1'
  expect "the last result counts" "$(state_of scripts)" "scripts status 1"
  note sanitizers-build 7 passed
  expect "a stage that is no slice leaves no result" "$(wc -l <"$folder/bmud/nightly.tsv")" 2
  nightly --note scripts 7 passed 0123456789012345678901234567890123456789 2>"$folder/out"
  expect "nor one for which the sources have changed" "$(wc -l <"$folder/bmud/nightly.tsv")" 2

  # What a slice needs to be built is built before it, once, also where it has passed.
  in_folder() { BMUD_NIGHTLY_TABLE=$folder/nightly.tsv BMUD_NIGHTLY_STAGES=$folder/stages BMUD_NIGHTLY_LOGS=$folder/logs nightly "$@"; }
  # began_of SLICES: the stages that a call for these begins, and how it ends
  began_of() {
    : >"$folder/began"
    status=0
    in_folder "$@" >"$folder/out" 2>&1 || status=$?
    echo "$(began): $(tail -n 1 "$folder/out")"
  }
  printf 'build\tgood-build\t9\tproduct\nother-build\tgood-other\t9\tproduct\n' >"$folder/nightly.tsv"
  printf 'one\tgood x\t9\tproduct\tbuild other-build\ntwo\tgood y\t9\tproduct\tbuild\nalone\tgood z\t9\tproduct\n' >>"$folder/nightly.tsv"
  expect "packages come first, and what is built for others once" "$(began_of)" \
    "packages good-build good-other good good good: every slice has passed for these sources"
  expect "where nothing is left to be run nothing is installed" "$(began_of)" ": every slice has passed for these sources"
  expect "what has passed is built again for what runs" "$(began_of --again two alone)" \
    "packages good-build good good: every slice has passed for these sources"
  expect "and for nothing else" "$(began_of --again alone)" "packages good: every slice has passed for these sources"
  sed -i 's/\tgood-build\t9/\tgood-build\t90/' "$folder/nightly.tsv"
  expect "nor if it may end too late" "$(began_of --minutes 1 --again two alone)" "packages good: not run: two"
  sed -i 's/\tgood-build\t90/\tbad-build\t9/' "$folder/nightly.tsv"
  expect "what cannot be built is not run" "$(began_of --again one two alone)" "packages bad-build good: failed: build"
  sed -i 's/^  good\*) exit 0/  packages) echo no network; exit 5 ;;\n&/' "$folder/stages"
  expect "nor anything without its packages" "$(began_of --again alone)" "packages: tests/nightly: no slice was run: the packages that they \
need are not there and could not be installed (status 5, $folder/logs/packages.log)"
  sed -i '/^  packages) /d' "$folder/stages"

  # Slices of the same stage pass in a row or not at all.
  printf 'one\tgood x\t9\tproduct\nload-1\tgood\t9\tproduct\nload-2\tgood\t9\tproduct\nother\tbad\t9\ttests\n' >"$folder/nightly.tsv"
  all_states() { in_folder --list | sed -n 's/  */ /gp' | cut -f 1 | paste -sd,; }
  if in_folder >"$folder/out"; then fail "a slice that fails fails the run"; fi
  expect "each slice has its result" "$(all_states)" "one passed,load-1 passed,load-2 passed,other status 3,failed: other"
  sed -i 's/^  good\*) exit 0/  good) exit 4/' "$folder/stages"
  if in_folder --again load-2 >"$folder/out"; then fail "a slice that no longer passes fails the run"; fi
  expect "one of a row that fails makes the others open again" "$(all_states)" \
    "one passed,load-1 open again: load-2 did not pass,load-2 status 4,other status 3,failed: load-1 load-2 other"

  # What a result depends on, in a repository of its own.
  mkdir -p "$folder/other/tests"/{rig,unit,ci,meta}
  cp "$repository/tests/nightly" "$folder/other/tests/nightly"
  touch "$folder/other/tests"/{rig/pull.sh,unit/cell_test.cpp,ci/nightly.tsv,ci/stages.sh,meta/layers.py,meta/cppcheck.py}
  git -C "$folder/other" init --quiet
  git -C "$folder/other" -c user.name=test -c user.email=test@localhost commit --quiet --allow-empty --message=first
  printf 'rig-pull\tgood\t9\tproduct rig\nall\tgood\t9\tproduct tests\nchecks\tgood\t9\tproduct tests meta\n' >"$folder/nightly.tsv"
  in_other() { BMUD_NIGHTLY_TABLE=$folder/nightly.tsv XDG_STATE_HOME=$folder/other-state "$folder/other/tests/nightly" "$@"; }
  note_in_other() { in_other --note "$@" "$(in_other --tree)"; }
  note_in_other good 7 passed
  opened_by() {
    echo changed >>"$folder/other/tests/$1"
    in_other --list | tail -n 1
    note_in_other good 7 passed
  }
  expect "a script of the emulated machine opens its slices" "$(opened_by rig/pull.sh)" "not run: rig-pull"
  expect "a test those that run it" "$(opened_by unit/cell_test.cpp)" "not run: all checks"
  expect "a check of the project those that run it" "$(opened_by meta/layers.py)" "not run: checks"
  expect "one that a stage calls all" "$(opened_by meta/cppcheck.py)" "not run: rig-pull all checks"
  expect "a stage all" "$(opened_by ci/stages.sh)" "not run: rig-pull all checks"
  expect "a limit none" "$(opened_by ci/nightly.tsv)" "every slice has passed for these sources"

  # Another machine knows only what is published.
  printf 'rig-pull\tgood\t9\tproduct rig\nall\tbad\t9\tproduct tests\nwhole\tgood\t9\teverything\n' >"$folder/nightly.tsv"
  note_in_other good 7 passed
  note_in_other bad 7 'status 3'
  if in_other --publish 2>"$folder/out"; then fail "what passes with changes that are not committed is not published"; fi
  commit_all() {
    git -C "$folder/other" add --all
    git -C "$folder/other" -c user.name=test -c user.email=test@localhost commit --quiet --message=next
  }
  commit_all
  expect "what has passed is published" "$(in_other --publish)" "tests/ci/nightly-passed.tsv has 2 of 3 slices"
  elsewhere() { BMUD_NIGHTLY_TABLE=$folder/nightly.tsv XDG_STATE_HOME=$folder/third-state "$folder/other/tests/nightly" "$@"; }
  expect "and counts elsewhere, also for the slice that depends on everything" "$(elsewhere --list | tail -n 1)" "not run: all"
  # Later than what is published, in seconds.
  until [[ $(date --utc +%Y-%m-%dT%H:%M:%SZ) > $(tail -n 1 "$folder/other/tests/ci/nightly-passed.tsv" | cut -f 3) ]]; do sleep 0.05; done
  elsewhere --note good 7 'status 4' "$(elsewhere --tree)"
  expect "until it fails there" "$(elsewhere --list | tail -n 1 | cut -d ' ' -f 1-3)" "failed: rig-pull whole"
  expect "where it can no longer be published" "$(elsewhere --publish)" "tests/ci/nightly-passed.tsv has 0 of 3 slices"
  in_other --publish >"$folder/out"
  echo changed >>"$folder/other/tests/rig/pull.sh"
  expect "nor when its sources have changed" "$(XDG_STATE_HOME=$folder/fourth BMUD_NIGHTLY_TABLE=$folder/nightly.tsv "$folder/other/tests/nightly" --list | tail -n 1)" "not run: rig-pull all whole"
fi
