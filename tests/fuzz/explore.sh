#!/usr/bin/env bash
# Lets libFuzzer look for inputs that break a promise of a parser, and says how far it came.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$repository/build-fuzz
seconds=60
seed=$((RANDOM + 1))
part=1/1
keeps=no
counts_lines=no
jobs=2
kept_max=40  # more of a target, and the smallest: corpora are there to be looked through
printed_max=4096  # bytes of an input, packed, that a log has a line for
targets=()

usage() {
  cat <<'TEXT'
usage: tests/fuzz/explore.sh [--seconds S] [--build DIR] [--seed N] [--part K/N] [--keep] [--lines] [TARGET...]

Builds the fuzz targets with clang, lets each explore for S seconds, two at a time, and prints a line for each. Ends with
1 if one has found an input that breaks a promise, crashes, or takes too long or too much memory: the input stays in
DIR/fuzz/TARGET/, and the one command that repeats it is printed. For whoever has the log alone, so is the one that makes
the input again, where it takes 4 KiB at most when packed.

  --seconds S  for each target (default: 60)
  --build DIR  where to build, and where what was found stays for the next time (default: build-fuzz)
  --seed N     of libFuzzer's random numbers; else another one each time, which is printed
  --part K/N   of all targets every Nth, beginning with the Kth
  --keep       adds what covers more than the committed corpora to them, 40 inputs of a target at most
  --lines      says of the parser's own files which share of their lines all inputs together run: needs another build, in
               DIR-lines

  tests/fuzz/explore.sh                          all targets, a minute each
  tests/fuzz/explore.sh --seconds 15 --part 2/3  the short look that CI takes at a third of them
  tests/fuzz/explore.sh --seconds 600 pack cell  ten minutes for what reads configurations
  build-fuzz/bin/fuzz_pack FILE                  one input once more

Targets are the files of tests/fuzz with a folder in tests/fuzz/corpora; docs/testing.md says what each is for. Columns:
inputs tried, and in a second; inputs that each cover something the others do not; edges of the program's control flow
covered of all that are linked into it; and the same of the parser's own files. Nearly half of all edges lead to the
sanitizers' complaints, so that a parser of which everything is reached has some 55 %.
TEXT
}

wrong_usage() {
  echo "explore.sh: $* (see tests/fuzz/explore.sh --help)" >&2
  exit 2
}

# The parser's own files, for the last column: a pattern over their paths.
declare -A parser_files=(
  [candump]='protocol/candump(_screen)?\.'
  [cell]='config/(cell_file/|fields/(fields|list_fields)|json/json_reader)'
  [cell_count]='daemon/shell/serial/cell_count_setting\.|config/cell_count\.'
  [core_image]='daemon/core/core_image\.|protocol/(image|fields|enumerators)\.'
  [driven_lines]='daemon/shell/gpio/driven_lines\.'
  [drivers]='devices/[a-z0-9_]*/'
  [dump]='tools/bmudump/|protocol/candump(_screen)?\.'
  [frames]='protocol/(receive_check|signal|message|bits)\.'
  [guests]='daemon/core/[a-z]*/(cell_requests|cell_question|charger_|inverter_|second_pack)'
  [history_pages]='daemon/history/(stray_rows|row_blob|history_reader|history_lives|history_row|history_columns)\.'
  [insulation]='protocol/ir155\.'
  [pack]='config/'
  [packed]='tools/common/(packed_text|frame_decoder|line_reader)\.'
  [record_line]='daemon/recording/record_line\.|protocol/candump\.'
  [recording]='daemon/recording/'
  [reply]='tools/bmuctl/|tools/common/(page|canvas)\.'
  [requests]='daemon/shell/(status|json)/(status_|why_|faults_|health_|modules_|balance_|freeze_).*'
  [script]='mmu/scenario/scenario'
  [serial]='daemon/shell/serial/serial_'
  [state]='daemon/shell/state/state_'
  [table]='tools/bmucell/data/csv_(file|table|text)\.'
)

parse_arguments() {
  while [[ $# -gt 0 ]]; do
    case $1 in
      --seconds | --build | --seed | --part)
        [[ $# -ge 2 ]] || wrong_usage "$1 needs a value"
        case $1 in
          --seconds) seconds=$2 ;;
          --build) build=$(realpath -m "$2") ;;
          --seed) seed=$2 ;;
          --part) part=$2 ;;
        esac
        shift 2 ;;
      --keep) keeps=yes; shift ;;
      --lines) counts_lines=yes; shift ;;
      -h | --help) usage; exit 0 ;;
      -*) wrong_usage "unknown option '$1'" ;;
      *)
        [[ -v parser_files[$1] ]] || wrong_usage "no target '$1': there are ${!parser_files[*]}"
        targets+=("$1")
        shift ;;
    esac
  done
  [[ $seconds =~ ^[1-9][0-9]*$ && $seed =~ ^[1-9][0-9]*$ ]] || wrong_usage "seconds and seed are whole numbers above 0"
  [[ $part =~ ^[1-9][0-9]?/[1-9][0-9]?$ && ${part%/*} -le ${part#*/} ]] || wrong_usage "--part: found '$part', expected K/N with K from 1 to N"
  [[ ${#targets[@]} -eq 0 || $part == 1/1 ]] || wrong_usage "--part is of all targets: found ${targets[*]} beside it"
  if [[ ${#targets[@]} -eq 0 ]]; then
    mapfile -t targets < <(printf '%s\n' "${!parser_files[@]}" | sort | awk -v k="${part%/*}" -v n="${part#*/}" '(NR - 1) % n == k - 1')
  fi
}

# In a folder, with options of cmake. What is written is of interest only if it fails.
build_targets() {
  local folder=$1 log=$1/explore-build.log
  shift
  mkdir -p "$folder"
  if ! { CC=clang CXX=clang++ cmake -S "$repository" -B "$folder" -G Ninja "$@" &&
    cmake --build "$folder" --parallel "$jobs" --target "${targets[@]/#/fuzz_}"; } >"$log" 2>&1; then
    tail -n 40 "$log" >&2
    return 1
  fi
}

# The sanitizer runtime of older clang fails now and then where the kernel spreads addresses widely.
run_target() {
  local target=$1
  shift
  # By the clock on the wall: a machine that is busy with other things takes long for anything.
  local run=("$build/bin/fuzz_$target" -timeout=120 -rss_limit_mb=2048 -artifact_prefix="$build/fuzz/$target/" "$@")
  local dictionary=$repository/tests/fuzz/dictionaries/$target.dict
  [[ ! -f $dictionary ]] || run+=(-dict="$dictionary")
  if setarch --addr-no-randomize true 2>/dev/null; then run=(setarch --addr-no-randomize "${run[@]}"); fi
  # A core is 2 MB: as many of them as usual need not be kept to catch who still uses them.
  ASAN_OPTIONS=quarantine_size_mb=64 "${run[@]}"
}

explore() {
  local target=$1 work=$build/fuzz/$1
  mkdir -p "$work/found"
  rm -f "$work/failed" "$work"/{crash,timeout,oom,leak,slow-unit}-*
  run_target "$target" -max_total_time="$seconds" -seed="$seed" -print_final_stats=1 \
    "$work/found" "$repository/tests/fuzz/corpora/$target" >"$work/log" 2>&1 || touch "$work/failed"
  # Which functions were reached, once more over all inputs: it needs a process that ends by itself.
  run_target "$target" -runs=0 -print_coverage=1 "$work/found" "$repository/tests/fuzz/corpora/$target" \
    >"$work/coverage" 2>&1 || true
}

explore_all() {
  local running=0 target
  for target in "${targets[@]}"; do
    if [[ $running -ge $jobs ]]; then
      wait -n
      running=$((running - 1))
    fi
    explore "$target" &
    running=$((running + 1))
  done
  wait
}

# The last number behind a word in libFuzzer's log.
number_behind() {
  grep -oE "$1 *[0-9]+" "$2" | tail -n 1 | grep -oE '[0-9]+$' || echo 0
}

# "87 % of 1234": edges of the functions in the parser's own files.
parser_coverage() {
  awk -v files="/(${parser_files[$1]})" '
    /COVERED_FUNC: / && $NF ~ files {
      for (i = 1; i < NF; ++i) if ($i == "edges:") { split($(i + 1), edges, "/"); taken += edges[1]; all += edges[2] }
    }
    END { if (all > 0) printf "%d %% of %d", 100 * taken / all, all; else printf "-" }' "$build/fuzz/$1/coverage"
}

# The same inputs once more in a program that counts its lines. "93.1 % of 210 lines".
line_coverage() {
  local target=$1 program=$build-lines/bin/fuzz_$1 profile=$build/fuzz/$1/lines
  LLVM_PROFILE_FILE=$profile.profraw "$program" "$repository/tests/fuzz/corpora/$target" "$build/fuzz/$target/found" >/dev/null
  llvm-profdata merge -sparse "$profile.profraw" -o "$profile.profdata"
  llvm-cov export -summary-only -instr-profile="$profile.profdata" "$program" |
    jq -r --arg files "/(${parser_files[$target]})" '[.data[0].files[] | select(.filename | test($files)) | .summary.lines] |
      (map(.count) | add) as $all | (map(.covered) | add) as $run | "\(1000 * $run / $all | round / 10) % of \($all) lines"'
}

print_lines() {
  local target
  for target in "${targets[@]}"; do printf '%-14s %s\n' "$target" "$(line_coverage "$target")"; done
}

print_table() {
  local target work
  printf '%-14s %11s %8s %7s %16s  %s\n' target executions per_s inputs edges 'of the parser'
  for target in "${targets[@]}"; do
    work=$build/fuzz/$target
    printf '%-14s %11s %8s %7s %7s of %5s  %s%s\n' "$target" \
      "$(number_behind 'stat::number_of_executed_units:' "$work/log")" \
      "$(number_behind 'stat::average_exec_per_sec:' "$work/log")" \
      "$(number_behind ' corp:' "$work/coverage")" \
      "$(number_behind ' cov:' "$work/coverage")" \
      "$(number_behind 'Loaded 1 modules +[(]' "$work/log")" \
      "$(parser_coverage "$target")" \
      "$([[ ! -f $work/failed ]] || echo '  FAILED')"
  done
}

# Build folders of CI are gone with its machine, and the next run looks elsewhere.
print_input() {
  local size
  size=$(gzip -9n <"$1" | wc -c)
  if [[ $size -le $printed_max ]]; then
    echo "  its input: base64 -d <<<$(gzip -9n <"$1" | base64 -w 0) | gunzip >$(basename "$1")"
  else
    echo "  its input: $size bytes when packed are too many to print"
  fi
}

tell_failures() {
  local target work input status=0
  for target in "${targets[@]}"; do
    work=$build/fuzz/$target
    [[ -f $work/failed ]] || continue
    status=1
    echo "fuzz_$target: $(grep -m 1 -E 'does not hold|runtime error|assertion|ERROR: ' "$work/log" || tail -n 1 "$work/log")"
    input=$(find "$work" -maxdepth 1 -type f -regex '.*/\(crash\|timeout\|oom\|leak\)-[0-9a-f]+' | head -n 1)
    echo "  to repeat: $build/bin/fuzz_$target ${input:-"(no input was kept: see $work/log)"}"
    [[ -z $input ]] || print_input "$input"
  done
  return "$status"
}

# Those that take an edge the committed ones do not: how often one was taken counts for exploring, not for keeping.
keep_inputs() {
  local target work input
  for target in "${targets[@]}"; do
    work=$build/fuzz/$target
    rm -rf "$work/more"
    mkdir "$work/more"
    cp "$repository/tests/fuzz/corpora/$target"/* "$work/more/"
    run_target "$target" -merge=1 -use_counters=0 -max_len=2048 "$work/more" "$work/found" >"$work/merge" 2>&1 || true
    find "$work/more" -type f -regex '.*/[0-9a-f]+' -printf '%s %p\n' | sort -n | head -n "$kept_max" | cut -d ' ' -f 2- |
      while read -r input; do cp "$input" "$repository/tests/fuzz/corpora/$target/found-$(basename "$input" | cut -c 1-12)"; done
  done
}

main() {
  parse_arguments "$@"
  build_targets "$build" -DBMUD_FUZZ=ON
  [[ $counts_lines == no ]] || build_targets "$build-lines" -DCMAKE_BUILD_TYPE=None -DBMUD_COVERAGE=ON
  echo "seed $seed, $seconds s for each target"
  explore_all
  print_table
  [[ $counts_lines == no ]] || print_lines
  if [[ $keeps == yes ]]; then keep_inputs; fi
  tell_failures
}

if [[ ${BASH_SOURCE[0]} == "$0" ]]; then main "$@"; fi
