#!/usr/bin/env bash
# Runs a test if this machine gives what it needs, as needs.hpp has it for test cases: needs.sh "[pty] [bus]" COMMAND...
# Exit status 77, skipped: something is missing, which is then said; else that of the command.
set -euo pipefail

needs=$1
shift

missing() {
  echo "skipped: $*"
  exit 77
}

if [[ $needs == *"[pty]"* ]]; then
  python3 -c 'import os; os.openpty()' 2>/dev/null || missing "no pseudo-terminals (/dev/ptmx, /dev/pts)"
fi
if [[ $needs == *"[bus]"* ]]; then
  free_kB=$(df --output=avail /dev/shm 2>/dev/null | tail -n 1) || free_kB=0
  [[ $free_kB -ge 16000 ]] || missing "less than 16 MB free in /dev/shm"
fi
exec "$@"
