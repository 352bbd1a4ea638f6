#!/usr/bin/env bash
# tests/fuzz/explore.sh ends with 1 for each target that failed, and its log holds the input: what it prints makes the same file again.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
folder=$(mktemp -d "${TMPDIR:-/tmp}/bmud-explore-findings.XXXXXX")
trap 'rm -rf "$folder"' EXIT
# shellcheck source-path=SCRIPTDIR source=../fuzz/explore.sh
source "$repository/tests/fuzz/explore.sh"

fail() {
  echo "explore_findings.sh: $*" >&2
  exit 1
}

# As explore() leaves them, in a folder whose name has a space.
build="$folder/a build"
targets=(candump packed pack state)
for target in "${targets[@]}"; do
  mkdir -p "$build/fuzz/$target"
  echo "x.cpp:1: does not hold: $target" >"$build/fuzz/$target/log"
done
tell_failures >"$folder/none" || fail "it fails though no target did"
[[ ! -s $folder/none ]] || fail "without a failure it says '$(cat "$folder/none")'"

small=$build/fuzz/packed/crash-0123456789abcdef
head -c 3000 /dev/urandom >"$small"
printf 'a line\n\0\xFF of zeros' >>"$small"
head -c 60000 /dev/zero >>"$small"
large=$build/fuzz/pack/timeout-0123456789abcdef
head -c 5000 /dev/urandom >"$large"
touch "$build/fuzz/"{packed,pack,state}/failed

if tell_failures >"$folder/told"; then fail "it does not fail though targets did"; fi
for target in packed pack state; do
  grep -q "^fuzz_$target: x.cpp:1: does not hold: $target\$" "$folder/told" || fail "$target is missing: $(cat "$folder/told")"
done
! grep -q candump "$folder/told" || fail "it tells of a target that did not fail"
grep -q "^  its input: 50[0-9][0-9] bytes when packed are too many to print\$" "$folder/told" || fail "the size of a large input is missing"
grep -q "(no input was kept: see $build/fuzz/state/log)" "$folder/told" || fail "the place of the log is missing"

mapfile -t commands < <(sed -n 's/^  its input: \(base64 .*\)$/\1/p' "$folder/told")
[[ ${#commands[@]} -eq 1 ]] || fail "found ${#commands[@]} commands, expected 1"
(cd "$folder" && bash -c "${commands[0]}")
cmp "$folder/$(basename "$small")" "$small" || fail "the printed command makes another input"
