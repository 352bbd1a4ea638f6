# shellcheck shell=bash
# Runs stages one after the other within a budget of time, and keeps what each took. Sourced by .ci/run; tests/meta/ci_runner.sh tests it.
#
#   runner_start BUDGET_S DEADLINE_S COMMAND   COMMAND STAGE runs a stage. Optional stages end within the budget, required ones before the deadline.
#   runner_required FILE                       the stages of a table, until one fails: returns 1
#   runner_optional FILE FIRST [URGENT]        those of a table that fit the budget, beginning with the stage URGENT, if one is named, and
#                                              then with row FIRST modulo their number; returns 1 only if interrupted
#   runner_table                               prints stage, seconds, result
#   runner_summaries STAGE=LOG...              prints ctest's own last words in these logs: how many passed, which failed, how long it took;
#                                              of a run that failed only those of the stage that did, and last that it failed
#   runner_record FILE COMMIT KIND [FIELD...]  appends the run to a file, tab-separated
#   runner_note=COMMAND                        before that: COMMAND STAGE SECONDS passed|"status N" learns of each stage that ended
#
# A required stage that fails or exceeds its limit fails the run by name. An optional one is reported, and does not decide: whether it runs
# is a property of the machine, and the verdict on a commit is not. tests/nightly has it with a verdict.

# Time between the signal that ends a stage and the one that cannot be caught.
runner_kill_after_s=20

runner_start() {
  runner_budget_s=$1
  runner_deadline_s=$2
  runner_command=$3
  runner_began_s=$SECONDS
  runner_rows=()
  runner_failed=''
  runner_pid=''
  runner_found=()
  trap 'runner_end_stage' INT TERM
}

runner_elapsed_s() { echo $((SECONDS - runner_began_s)); }

runner_end_stage() {
  [[ -z $runner_pid ]] || kill "$runner_pid" 2>/dev/null
  runner_failed=${runner_failed:-interrupted}
  trap - INT TERM
}

# runner_rows_of FILE: its rows without comments
runner_rows_of() { grep -v '^#' "$1"; }

# runner_stage NAME LIMIT_S: sets runner_status and runner_seconds
runner_stage() {
  local name=$1 limit_s=$2 began_s=$SECONDS
  echo "ci: === $name (at most $limit_s s)"
  runner_status=0
  timeout --kill-after="$runner_kill_after_s" "$limit_s" "$runner_command" "$name" </dev/null &
  runner_pid=$!
  wait "$runner_pid" || runner_status=$?
  runner_pid=''
  runner_seconds=$((SECONDS - began_s))
  if [[ -n ${runner_note:-} && -z $runner_failed ]] && ! runner_timed_out; then
    "$runner_note" "$name" "$runner_seconds" "$([[ $runner_status -eq 0 ]] && echo passed || echo "status $runner_status")"
  fi
}

# timeout's own status, and that of a process it had to kill.
runner_timed_out() { [[ $runner_status -eq 124 || $runner_status -eq 137 ]]; }

runner_add_row() {
  runner_rows+=("$1"$'\t'"$2"$'\t'"$3")
  echo "ci: === $1: $3, $2 s"
}

runner_required() {
  local name limit_s left_s count=0
  while IFS=$'\t' read -r name limit_s <&3; do
    count=$((count + 1))
    left_s=$((runner_deadline_s - $(runner_elapsed_s)))
    [[ $left_s -ge $limit_s ]] || limit_s=$left_s
    if [[ $limit_s -le 0 ]]; then
      runner_failed=$name
      runner_add_row "$name" 0 "failed: no time left of $runner_deadline_s s"
      return 1
    fi
    runner_stage "$name" "$limit_s"
    if [[ $runner_status -eq 0 && -z $runner_failed ]]; then
      runner_add_row "$name" "$runner_seconds" ok
      continue
    fi
    runner_failed=${runner_failed:-$name}
    if runner_timed_out; then
      runner_add_row "$name" "$runner_seconds" "failed: exceeded $limit_s s"
    else
      runner_add_row "$name" "$runner_seconds" "failed: status $runner_status"
    fi
    return 1
  done 3< <(runner_rows_of "$1")
  # A table that cannot be read, or has no row, is nothing that passed.
  if [[ $count -eq 0 ]]; then
    runner_failed="reading $1"
    return 1
  fi
}

runner_optional() {
  local rows row k name cold_s left_s limit_s turn=()
  mapfile -t rows < <(runner_rows_of "$1")
  for ((k = 0; k < ${#rows[@]}; ++k)); do
    row=${rows[($2 + k) % ${#rows[@]}]}
    if [[ ${row%%$'\t'*} == "${3:-}" ]]; then turn=("$row" "${turn[@]}"); else turn+=("$row"); fi
  done
  for row in "${turn[@]}"; do
    IFS=$'\t' read -r name cold_s <<<"$row"
    left_s=$((runner_budget_s - $(runner_elapsed_s)))
    if [[ $cold_s -gt $left_s ]]; then
      runner_add_row "$name" 0 "skipped: needs $cold_s s, $left_s s left"
      continue
    fi
    # On a slow day it may take twice as long, but the run does not exceed its budget for it.
    limit_s=$((cold_s * 2))
    [[ $left_s -ge $limit_s ]] || limit_s=$left_s
    left_s=$((runner_deadline_s - $(runner_elapsed_s)))
    if [[ $cold_s -gt $left_s ]]; then
      runner_add_row "$name" 0 "skipped: needs $cold_s s, $left_s s left of $runner_deadline_s s"
      continue
    fi
    [[ $left_s -ge $limit_s ]] || limit_s=$left_s
    runner_stage "$name" "$limit_s"
    if [[ -n $runner_failed ]]; then return 1; fi
    if [[ $runner_status -eq 0 ]]; then
      runner_add_row "$name" "$runner_seconds" ok
    elif runner_timed_out; then
      runner_add_row "$name" "$runner_seconds" "no result: exceeded $limit_s s"
    else
      runner_found+=("$name")
      runner_add_row "$name" "$runner_seconds" "FOUND SOMETHING: status $runner_status"
    fi
  done
}

runner_table() {
  local row
  printf '%-24s %8s  %s\n' stage seconds result
  for row in "${runner_rows[@]}"; do
    IFS=$'\t' read -r name seconds result <<<"$row"
    printf '%-24s %8s  %s\n' "$name" "$seconds" "$result"
  done
  printf '%-24s %8s  %s%s\n' together "$(runner_elapsed_s)" "${runner_failed:+failed: }${runner_failed:-passed}" \
    "${runner_found[*]:+, but found something: }${runner_found[*]}"
}

runner_summaries() {
  local one
  for one in "$@"; do
    [[ -f ${one#*=} && ${runner_failed:-${one%%=*}} == "${one%%=*}" ]] || continue
    sed -n '/tests passed, .* tests failed out of/,$p' "${one#*=}"
  done
  [[ -z $runner_failed ]] || echo "ci: FAILED in stage \"$runner_failed\"" >&2
}

runner_record() {
  local file=$1 commit=$2 kind=$3 row fields=''
  for row in "${runner_rows[@]}"; do
    IFS=$'\t' read -r name seconds result <<<"$row"
    [[ $result == skipped* ]] || fields+=$'\t'"$name=$seconds"
  done
  shift 3
  [[ ${#runner_found[@]} -eq 0 ]] || fields+=$'\t'"found=$(IFS=,; echo "${runner_found[*]}")"
  for row in "$@"; do fields+=$'\t'$row; done
  mkdir -p "$(dirname "$file")"
  printf '%s\t%s\t%s\t%s\t%s%s\n' "$commit" "$(date --utc +%Y-%m-%dT%H:%M:%SZ)" "$kind" "$(runner_elapsed_s)" "${runner_failed:-passed}" \
    "$fields" >>"$file"
}
