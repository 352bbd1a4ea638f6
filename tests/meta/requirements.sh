#!/usr/bin/env bash
# Every requirement that docs/requirements.md calls met is borne by at least one test as a tag, and every requirement a
# test bears is in that list.
set -euo pipefail

cd "$(dirname "$0")/../.."

borne=$(grep -rhoE "\[(BMS_F\.[0-9]+|BMS_NF\.[0-9]+|MMU_[A-Z0-9]+|BMU_[0-9]+|FS_[0-9]+|RR_[0-9]+)\]" tests --include='*.cpp' | tr -d '[]' | sort -u)
listed=$(grep -E '^\| *(BMS_F\.|BMS_NF\.|MMU_|BMU_|FS_|RR_)' docs/requirements.md)
met=$(awk -F'|' '$3 ~ /^ *(met|part) *$/ {gsub(/ /, "", $2); print $2}' <<<"$listed" | sort -u)
known=$(awk -F'|' '{gsub(/ /, "", $2); print $2}' <<<"$listed" | sort -u)

status=0
for id in $met; do
  grep -qx -- "$id" <<<"$borne" || { echo "docs/requirements.md: $id is called met, but no test bears [$id]" >&2; status=1; }
done
for id in $borne; do
  grep -qx -- "$id" <<<"$known" || { echo "a test bears [$id], which docs/requirements.md does not list" >&2; status=1; }
done
exit $status
