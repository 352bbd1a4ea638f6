#!/usr/bin/env bash
# How exposed the service is, by systemd-analyze: as it is installed, and with every set of the drop-ins that come with it. Ends
# with 1 if any of that is above 1.5, or devices, real time and interfaces together above 1.7.   usage: exposure.sh [BUILD_FOLDER]
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
units=$(realpath "${1:-$repository/build}")/packaging
exposure_max=1.5
# Of devices, real time and interfaces together: docs/decisions/0025-exposure-of-the-service.md.
exposure_max_of_all=1.7

command -v systemd-analyze >/dev/null || { echo "exposure.sh: no systemd-analyze here" >&2; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Of a unit and drop-ins, as one file: a later line of a list adds to it, or clears what it names with ~, as in a drop-in.
exposure_of() {
  cat "$@" >"$work/bmud.service"
  systemd-analyze security --offline=true --no-pager "$work/bmud.service" | sed -n 's/.*exposure level for .*: \([0-9.]*\).*/\1/p'
}

status=0
# show NAME MOST FILES...
show() {
  local name=$1 most=$2 exposure
  shift 2
  exposure=$(exposure_of "$@")
  printf '%-58s %s\n' "$name" "$exposure"
  awk "BEGIN { exit !(\"$exposure\" != \"\" && \"$exposure\" + 0 <= $most) }" ||
    { echo "exposure.sh: found $exposure for $name, wanted at most $most" >&2; status=1; }
}

for unit in bmud.service bmud@.service; do show "$unit" "$exposure_max" "$units/$unit"; done
# Every set of drop-ins. The one above the limit is named in docs/installing.md with the way around it: the network manager sets up the
# interfaces then.
drop_ins=(gpio serial realtime interfaces)
for ((set = 1; set < 1 << ${#drop_ins[@]}; ++set)); do
  chosen=() files=()
  for k in "${!drop_ins[@]}"; do
    if ((set >> k & 1)); then chosen+=("${drop_ins[k]}") files+=("$repository/systemd/${drop_ins[k]}.conf"); fi
  done
  most=$exposure_max
  [[ "${chosen[*]}" != *"realtime interfaces" || ${#chosen[@]} -eq 2 ]] || most=$exposure_max_of_all
  show "bmud.service with ${chosen[*]}" "$most" "$units/bmud.service" "${files[@]}"
done
exit $status
