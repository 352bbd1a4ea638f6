#!/usr/bin/env bash
# Runs a guest script where there is CAN: on this machine's own vcan if it has one, in namespaces of its own so that it neither meets nor
# disturbs anything; else in the emulated machine of boot.sh. The script sees the same either way (guest-env.sh).
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out='' limit_s=300 force_qemu=no
# Processes the script leaves behind end with the namespace.
unshare_command=(unshare --net --mount --pid --fork --kill-child --mount-proc)
# Without root, a user namespace makes us root of the new network only, and that is enough.
[[ $(id -u) -eq 0 ]] || unshare_command+=(--map-root-user)

usage() {
  cat <<'TEXT'
usage: tests/rig/run-on-can.sh [--out DIR] [--limit SECONDS] [--force-qemu] SCRIPT [ARGUMENTS...]

Runs SCRIPT as root with vcan0 up and exits with its status; 124 when the limit (default 300 s) was reached. Files that SCRIPT leaves
in $RIG_OUT are in DIR (default: rig-out in the current folder).
  --force-qemu  the emulated machine, even if this kernel has vcan

  tests/rig/run-on-can.sh --out /tmp/out tests/rig/smoke.sh
TEXT
}

# Not the module list but the deed tells: make an interface, send a frame.
# shellcheck disable=SC2016  # expanded inside
host_has_vcan() {
  "${unshare_command[@]}" bash -c '"$1/guest-env.sh" --make-vcan rigprobe && cansend rigprobe 123#' probe "$here" >/dev/null 2>&1
}

# In the background, so that a Ctrl-C is dealt with at once: with unshare, its whole process namespace ends.
run_on_host() {
  local pid status=0
  # /run is the script's own, as it is in the emulated machine.
  # shellcheck disable=SC2016  # expanded inside
  RIG=host RIG_OUT=$out "${unshare_command[@]}" bash -c '
    set -e
    mount -t tmpfs tmpfs /run
    ip link set lo up
    "$1/guest-env.sh" --make-vcan vcan0
    limit=$2
    shift 2
    timeout -k 5 "$limit" "$@"
  ' run "$here" "$limit_s" "$@" </dev/null &
  pid=$!
  # shellcheck disable=SC2064  # the process of now
  trap "kill -KILL $pid; exit 143" INT TERM HUP
  wait "$pid" || status=$?
  [[ $status -ne 124 ]] || echo "rig: $1 was still running at the limit of $limit_s s" >&2
  return "$status"
}

while [[ $# -gt 0 ]]; do
  case $1 in
    --out) out=${2:?--out needs a folder}; shift 2 ;;
    --limit) limit_s=${2:?--limit needs seconds}; shift 2 ;;
    --force-qemu) force_qemu=yes; shift ;;
    -h | --help) usage; exit 0 ;;
    --) shift; break ;;
    -*) echo "rig: unknown option '$1'" >&2; usage >&2; exit 64 ;;
    *) break ;;
  esac
done
[[ $# -gt 0 ]] || { usage >&2; exit 64; }
script=$(realpath -- "$1")
shift
out=$(realpath -m -- "${out:-rig-out}")
mkdir -p "$out"

if [[ $force_qemu == no ]] && host_has_vcan; then
  echo "rig: on this kernel's own vcan ($(uname -r))"
  run_on_host "$script" "$@"
else
  echo "rig: in an emulated machine (QEMU)"
  exec "$here/boot.sh" --out "$out" --limit "$limit_s" -- "$script" "$@"
fi
