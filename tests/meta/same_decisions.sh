#!/usr/bin/env bash
# Builds of different compilers and optimisation decide the same: each records a drive of the emulated pack, and each runs the
# recordings of all again (bmureplay).
set -euo pipefail

usage() {
  cat <<'TEXT'
usage: tests/meta/same_decisions.sh BIN BIN...

Each BIN is the folder of a build with mmusim and bmureplay in it, as build/bin and build-asan/bin.
Exit status: 0 all decide the same; 1 they do not, with the first difference; 2 command line.
TEXT
}

[[ ${1:-} != --help ]] || { usage; exit 0; }
[[ $# -ge 2 ]] || { usage >&2; exit 2; }

cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

packs=(demo-48s lfp-96s)
cat >"$folder/drive.scn" <<'TEXT'
0       pack soc_permille 800
2       vehicle on
+6      load profile drive
+30     load current_A 0
+1      vehicle off
TEXT
status=0
number=0
for bin in "$@"; do
  number=$((number + 1))
  for pack in "${packs[@]}"; do
    "$bin/mmusim" --pack "config/packs/$pack.json" --with-master --scenario "$folder/drive.scn" --seconds 60 --quiet \
      --record "$folder/$pack-$number.log"
  done
done
for bin in "$@"; do
  for pack in "${packs[@]}"; do
    for ((recorded = 1; recorded <= number; ++recorded)); do
      echo "== $bin runs what ${!recorded} recorded of $pack"
      "$bin/bmureplay" --quiet --differences 1 "$folder/$pack-$recorded.log" || status=1
    done
  done
done
exit $status
