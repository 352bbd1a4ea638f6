#!/usr/bin/env bash
# Host script: a rig that calls every run a success proves nothing. A failing script's own status must come back, and a hang must be
# ended at the limit and named.  usage: exit_status.sh DIR   (DIR for the consoles' logs)
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=$1

expect_status() {
  local wanted=$1 name=$2 limit_s=$3 status=0
  shift 3
  "$here/boot.sh" --out "$out/$name" --limit "$limit_s" -- "$here/smoke.sh" "$@" 2>&1 | tee "$out/$name.txt" || status=$?
  if [[ $status -ne $wanted ]]; then
    echo "FAILED: smoke.sh $* came back as $status, wanted $wanted"
    exit 1
  fi
  echo "  ok: smoke.sh $* came back as $wanted"
}

mkdir -p "$out"
expect_status 7 failing 90 --exit 7
# Boot included, which takes a busy host more than 45 s.
expect_status 124 hanging 150 --hang
grep -q "last step: hanging on purpose" "$out/hanging.txt" || { echo "FAILED: the hang's report does not name the step"; exit 1; }
