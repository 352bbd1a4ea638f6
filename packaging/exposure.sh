#!/usr/bin/env bash
# How exposed the service is, by systemd-analyze: as it is installed, and with every set of the drop-ins that come with it. Ends
# with 1 if any of that is above 1.5.   usage: exposure.sh [BUILD_FOLDER]
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
units=$(realpath "${1:-$repository/build}")/packaging
exposure_max=1.5

command -v systemd-analyze >/dev/null || { echo "exposure.sh: no systemd-analyze here" >&2; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Of a unit and drop-ins, as one file: a later line of a list adds to it, or clears what it names with ~, as in a drop-in.
exposure_of() {
  cat "$@" >"$work/bmud.service"
  systemd-analyze security --offline=true --no-pager "$work/bmud.service" | sed -n 's/.*exposure level for .*: \([0-9.]*\).*/\1/p'
}

status=0
# show NAME FILES...
show() {
  local name=$1 exposure
  shift
  exposure=$(exposure_of "$@")
  printf '%-58s %s\n' "$name" "$exposure"
  awk "BEGIN { exit !(\"$exposure\" != \"\" && \"$exposure\" + 0 <= $exposure_max) }" ||
    { echo "exposure.sh: found $exposure for $name, wanted at most $exposure_max" >&2; status=1; }
}

for unit in bmud.service bmud@.service; do show "$unit" "$units/$unit"; done
# Every set of drop-ins.
drop_ins=(gpio serial realtime interfaces)
for ((set = 1; set < 1 << ${#drop_ins[@]}; ++set)); do
  chosen=() files=()
  for k in "${!drop_ins[@]}"; do
    if ((set >> k & 1)); then chosen+=("${drop_ins[k]}") files+=("$repository/systemd/${drop_ins[k]}.conf"); fi
  done
  show "bmud.service with ${chosen[*]}" "$units/bmud.service" "${files[@]}"
done
exit $status
