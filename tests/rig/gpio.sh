#!/usr/bin/env bash
# Host script: a guest script with GPIO lines on a chip of the kernel, in the emulated machine; no host is asked for a chip of its own, since
# something may be wired to it. SCRIPT is given the path of the chip's driver first.
#   usage: gpio.sh BOOT_OPTIONS... -- SCRIPT [ARGUMENTS...]   (options of boot.sh)
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
options=()
while [[ $# -gt 0 && $1 != -- ]]; do options+=("$1"); shift; done
[[ $# -ge 2 ]] || { echo "usage: gpio.sh BOOT_OPTIONS... -- SCRIPT [ARGUMENTS...]" >&2; exit 64; }

module=$("$here/gpio-module.sh")
exec "$here/boot.sh" "${options[@]}" -- "$2" "$module" "${@:3}"
