#!/usr/bin/env bash
# Host script: GPIO lines on a chip of the kernel, in the emulated machine; no host is asked for a chip of its own, since something may
# be wired to it.  usage: gpio.sh OUT_DIR LIMIT_SECONDS TEST_PROGRAM
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=$1 limit_s=$2 test_program=$3

module=$("$here/gpio-module.sh")
exec "$here/boot.sh" --out "$out" --limit "$limit_s" -- "$here/gpio_guest.sh" "$module" "$test_program"
