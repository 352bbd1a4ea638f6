#!/usr/bin/env bash
# Makes vcan-fixtures/first-drive.log anew from the last run of rig.first_drive, and its expected summary.
# usage: make-golden.sh [BUILD_FOLDER]
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
build=${1:-$root/build}
recorded=$build/tests/rig/out/first_drive/first_drive.can.log
fixture=$root/vcan-fixtures/first-drive.log

[[ -s $recorded ]] || { echo "make-golden.sh: found no $recorded, wanted the output of ctest -R rig.first_drive" >&2; exit 1; }
{
  echo '# Name: first drive'
  echo '# Origin: candump -L in the rig, bmud and mmusim on vcan0 of a Debian kernel in an emulated machine'
  echo '# Pack: config/packs/demo-48s.json with vcan-fixtures/demo.scn'
  echo "# Date: $(date -u +%Y-%m-%d)"
  echo '# Shows: start, set-up of the modules, measured precharge, drive, sagging cell 2.7, opening, end of the daemon'
  echo '# Requirement: BMS_F.1, BMS_F.8, FS_2'
  cat "$recorded"
} >"$fixture"
"$build/bin/bmudump" --summary --strict -r "$fixture" >"${fixture%.log}.expected"
echo "$fixture: $(grep -c '^(' "$fixture") frames"
