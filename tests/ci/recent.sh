# shellcheck shell=bash
# What has changed lately, for stages of CI that look at that only. Sourced, from the repository's folder.

# recent_base: the commit that stood half a day before the newest one, or the first. Changes since then are recent.
recent_base() {
  local head_time_s base
  head_time_s=$(git show -s --format=%ct HEAD)
  base=$(git rev-list -1 --before="$((head_time_s - 43200))" HEAD)
  [[ -n $base ]] || base=$(git rev-list --max-parents=0 HEAD | tail -n 1)
  echo "$base"
}

# recent_safety_files: those of tests/mutation/files.txt that have changed since then
recent_safety_files() {
  local patterns
  mapfile -t patterns < <(sed -e '/^#/d' -e '/^$/d' tests/mutation/files.txt)
  git diff --name-only "$(recent_base)" -- "${patterns[@]}"
}

# part_by_commit N: "K/N", another part with another commit
part_by_commit() { echo "$((0x$(git rev-parse --short=7 HEAD) % $1 + 1))/$1"; }
