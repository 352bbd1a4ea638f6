#!/usr/bin/env bash
# commit_splits.sh STEP...: each header split as a commit of its own, in the checkout that is the working folder.
set -euo pipefail
here=$(dirname "$(realpath "$0")")
declare -A subject=(
  [element]="Element has a header of its own"
  [contactors]="What all stages know of contactors is in types/contactors.hpp"
  [opening_cause]="OpeningCause has a header of its own"
  [soc_method]="SocMethod has a header of its own"
  [charge_plateau_model]="The model of a charge plateau belongs to the cell"
  [cell_forecast_input]="What a forecast begins with belongs to the estimation"
  [bleed_current]="The current of a balancing resistor has a header of its own"
  [event_queue]="The event queue does not need the decisions"
  [loop_counters]="The status does not need the control loop"
  [config]="Pack, problems and cell file have headers below their readers"
)
for step in "$@"; do
  python3 "$here/splits.py" "$step"
  git add -A config daemon mmu tests tools
  git diff --cached --name-only --diff-filter=d -- '*.cpp' '*.hpp' | xargs --no-run-if-empty nice -n 19 clang-format -i
  git add -A config daemon mmu tests tools
  git commit -q -m "${subject[$step]}"
  git show --stat --format=%s | tail -30
done
