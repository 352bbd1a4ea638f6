#!/usr/bin/env bash
# The pure parts stay pure: protocol, devices, mmu and daemon/core may include only the standard headers listed here,
# libexpected, and each other in the direction of the arrows (devices -> protocol; mmu, daemon/core -> devices, protocol). No clock, no I/O, no thread,
# no log, no heap container. What a person may need as text lives in files named here.
set -euo pipefail

cd "$(dirname "$0")/../.."

standard='algorithm|array|bit|bitset|charconv|chrono|cmath|compare|concepts|cstddef|cstdint|cstdio|cstdlib|cstring|functional|limits|numeric|optional|span|string_view|tuple|type_traits|utility|variant'
# Whole texts for people are made on demand, never in a tick; these files may build strings for them.
text_files='daemon/core/records/event\.(hpp|cpp)|protocol/dbc\.(hpp|cpp)|mmu/scenario/scenario.*|mmu/scenario/simulator\.(hpp|cpp)|mmu/scenario/world\.(hpp|cpp)'

declare -A may_include=(
  [protocol]='protocol/'
  [devices]='protocol/|devices/'
  [mmu]='protocol/|devices/|mmu/|daemon/core/(types/core_config|cell/cell_model)\.hpp'
  [daemon/core]='protocol/|devices/|daemon/core/'
)

status=0
complain() {
  printf '%s\n' "$1" >&2
  status=1
}

for part in protocol devices mmu daemon/core; do
  while IFS=: read -r file line include; do
    [[ $file =~ ^($text_files)$ ]] && standard_here="$standard|string|vector|map|memory" || standard_here=$standard
    if [[ $include =~ \<(.*)\> ]]; then
      header=${BASH_REMATCH[1]}
      [[ $header =~ ^($standard_here)$ || $header == tl/expected.hpp ]] ||
        complain "$file:$line: includes <$header>; the pure parts have no use for it"
    elif [[ $include =~ \"(.*)\" ]]; then
      header=${BASH_REMATCH[1]}
      [[ $header =~ ^(${may_include[$part]}) ]] || complain "$file:$line: includes \"$header\", against the arrows"
    fi
  done < <(grep -rnE '^#include' "$part" --include='*.hpp' --include='*.cpp')
  while IFS= read -r use; do
    complain "$use: a clock, a log or the heap in a pure part"
  done < <(grep -rnE 'steady_clock::now|system_clock|clock_gettime|std::cout|std::cerr|spdlog|(= |return |\()new [A-Za-z]|malloc\(' \
    "$part" --include='*.hpp' --include='*.cpp' | grep -vE '^[^:]+:[0-9]+: *//' || true)
done
exit $status
