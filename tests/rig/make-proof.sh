#!/usr/bin/env bash
# Makes golden logs of the proof anew: runs its scenarios on vcan, in the emulated machine where this one has none, looks into the
# recordings, and puts them into vcan-fixtures/proof with what the core of this build decides of them.
# usage: make-proof.sh [--build FOLDER] [--keep | NAME...]
#   NAME    these scenarios only
#   --keep  no new recordings, only what this build decides of those that are there
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
build=$root/build
[[ ${1:-} != --build ]] || { build=$(realpath "$2"); shift 2; }
out=$build/tests/rig/out/make_proof

if [[ ${1:-} != --keep ]]; then
  for name in "$@"; do
    [[ -f $root/vcan-fixtures/proof/$name.scn ]] || { echo "make-proof.sh: found $name, expected names of vcan-fixtures/proof/*.scn" >&2; exit 1; }
  done
  BMUD_BUILD_DIR=$build "$here/run-on-can.sh" --out "$out" --limit 1800 "$here/proof.sh" "$root" "$build/bin" -- "$@"
  BMUD_PROOF_RECORDINGS=$out "$build/bin/test_golden" "what was recorded*"
  for recording in "$out"/*.log.zst; do zstd -dcq "$recording" | zstd -19 -q -f -o "$root/vcan-fixtures/proof/$(basename "$recording")"; done
fi
BMUD_REWRITE=1 "$build/bin/test_golden" "what was recorded*"
git -C "$root" --no-pager diff --stat -- vcan-fixtures/proof
