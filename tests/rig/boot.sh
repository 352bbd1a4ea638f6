#!/usr/bin/env bash
# Boots Debian's own kernel in QEMU, in software emulation, and runs a script in it as root with vcan0 up. For machines and containers
# whose kernel has no CAN. The guest sees this machine's files, read-only; what it writes is gone afterwards, but for the output folder.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

# In this order; modprobe finds what each depends on.
modules=(virtio_pci 9pnet_virtio 9p overlay can can_raw can_bcm can_gw can_dev vcan vxcan slcan)
out='' limit_s='' memory_mb=1024 verbose=no can_bus=no first=guest-init
qemu_pid='' limit_pid='' monitor_pid='' work=''

usage() {
  cat <<'TEXT'
usage: tests/rig/boot.sh --out DIR --limit SECONDS [options] -- SCRIPT [ARGUMENTS...]

Runs SCRIPT inside an emulated machine whose kernel has CAN, and exits with its status; 124 when the limit was reached, 125 when
the machine did not get as far as ending SCRIPT. Files that SCRIPT leaves in $RIG_OUT are in DIR, with the console in DIR/console.log.

  --limit SECONDS      boot included; booting takes 5 to 10 s on an idle machine
  --module "NAME ARG"  loads one more kernel module, with arguments if wanted; may be repeated
  --can-bus            can0 and can1: emulated controllers under a real driver, wired to each other; what SCRIPT writes into
                       $RIG_OUT/monitor is told to the emulator, as "device_del controller0" to pull the first one out
  --systemd            systemd is the guest's first program, and runs SCRIPT beside the journal
  --memory MB          the guest's memory (default 1024)
  --verbose            shows the whole console, the kernel's part too

  tests/rig/boot.sh --out /tmp/out --limit 60 -- tests/rig/smoke.sh
TEXT
}

fail() {
  echo "rig: $*" >&2
  exit 125
}

wrong_usage() {
  echo "rig: $*" >&2
  usage >&2
  exit 64
}

parse_arguments() {
  while [[ $# -gt 0 ]]; do
    case $1 in
      --out) out=${2:?--out needs a folder}; shift 2 ;;
      --limit) limit_s=${2:?--limit needs seconds}; shift 2 ;;
      --memory) memory_mb=${2:?--memory needs megabytes}; shift 2 ;;
      --module) modules+=("${2:?--module needs a name}"); shift 2 ;;
      --can-bus) can_bus=yes; modules+=(kvaser_pci); shift ;;
      --systemd) first=guest-systemd; shift ;;
      --verbose) verbose=yes; shift ;;
      -h | --help) usage; exit 0 ;;
      --) shift; break ;;
      *) wrong_usage "unknown option '$1'" ;;
    esac
  done
  [[ -n $out && -n $limit_s && $# -gt 0 ]] || wrong_usage "--out, --limit and a script are needed"
  [[ $limit_s =~ ^[0-9]+$ ]] || wrong_usage "--limit '$limit_s' is no number of seconds"
  script=$1 script_arguments=("${@:2}")
  [[ -x $script ]] || fail "$script is not there, or not executable"
}

# Modules are stored unpacked: busybox cannot load packed ones on every release.
add_module_file() {
  local file=$1 arguments=$2 name
  name=$(basename "$file")
  name=${name%%.ko*}.ko
  if [[ ! -e $work/tree/modules/$name ]]; then
    case $file in
      *.xz) xz -dc "$file" >"$work/tree/modules/$name" ;;
      *.zst) zstd -qdc "$file" >"$work/tree/modules/$name" ;;
      *.gz) gzip -dc "$file" >"$work/tree/modules/$name" ;;
      *) cp "$file" "$work/tree/modules/$name" ;;
    esac
    echo "$name $arguments" >>"$work/tree/modules/order"
  fi
}

add_module() {
  local name=$1 arguments=$2 kind file list
  list=$(modprobe -C /dev/null -d "$kernel" -S "$kernel_version" --show-depends "$name") || fail "the kernel $kernel_version has no module $name"
  while read -r kind file _; do
    # The others are "builtin NAME".
    [[ $kind == insmod ]] || continue
    if [[ $(basename "$file" | tr - _) == "$name".ko* ]]; then add_module_file "$file" "$arguments"; else add_module_file "$file" ''; fi
  done <<<"$list"
}

write_job() {
  {
    echo "# guest-init: $here/$first"
    printf 'RIG_DIR=%q RIG_FOLDER=%q RIG_TOKEN=%q\n' "$here" "$PWD" "$token"
    printf 'RIG_COMMAND=('
    printf '%q ' "$(realpath "$script")" "${script_arguments[@]}"
    printf ')\n'
  } >"$work/tree/job"
}

build_initramfs() {
  local module name arguments
  mkdir -p "$work"/tree/{bin,modules,proc,sys,dev,lower,upper,root}
  cp "$(command -v busybox)" "$work/tree/bin/busybox"
  cp "$here/initramfs-init" "$work/tree/init"
  chmod 755 "$work/tree/init"
  for module in "${modules[@]}"; do
    read -r name arguments <<<"$module"
    add_module "$name" "$arguments"
  done
  write_job
  (cd "$work/tree" && find . | cpio -o -H newc --quiet) >"$work/initramfs"
}

# Prints what the script printed: what stands between the two marks on the console.
show_script_output() {
  sed -u -n "/rig-begin $token/,/rig-end $token/{/rig-begin $token/d; /rig-end $token/{s/rig-end.*//; /./p; d}; p}"
}

relay_console() {
  if [[ $verbose == yes ]]; then
    sed -u 's/\r$//' <"$work/console" | tee "$out/console.log"
  else
    sed -u 's/\r$//' <"$work/console" | tee "$out/console.log" | show_script_output
  fi
}

# What the guest wants of the emulator, a file at a time; its words are the emulator's own.
open_monitor() {
  mkfifo "$work/monitor.in" "$work/monitor.out"
  rm -f "$out/monitor"
  # shellcheck disable=SC2016  # expanded inside
  setpriv --pdeathsig KILL bash -c '
    exec 8<>"$1/monitor.in" 9<>"$1/monitor.out"
    while sleep 0.2; do
      if [[ -s $2/monitor ]]; then mv "$2/monitor" "$1/wanted"; cat "$1/wanted" >&8; fi
    done' monitor "$work" "$out" &
  monitor_pid=$!
}

# The guest's clock counts what its one processor has carried out (4 ns for an instruction) and skips what it would wait: a host that is
# busy makes the guest take longer, but nothing in it late. QEMU has this for one processor only.
#
# The kernel ends QEMU when this script dies, even if it was killed: no emulator stays behind.
# shellcheck disable=SC2054  # the commas are QEMU's
run_qemu() {
  local options=(-accel "tcg,thread=single" -icount "shift=2,align=off,sleep=off" -rtc clock=vm -cpu max -smp 1 -m "$memory_mb"
    -nodefaults -no-user-config -no-reboot -display none -serial stdio -nic none
    -kernel "$kernel/image" -initrd "$work/initramfs" -append "console=ttyS0 quiet panic=-1 oops=panic"
    -fsdev "local,id=root,path=/,security_model=none,readonly=on,multidevs=remap" -device virtio-9p-pci,fsdev=root,mount_tag=host-root
    -fsdev "local,id=out,path=$out,security_model=none" -device virtio-9p-pci,fsdev=out,mount_tag=host-out)
  if [[ $can_bus == yes ]]; then open_monitor; else options+=(-monitor none); fi
  [[ $can_bus == no ]] || options+=(-object can-bus,id=bus -device kvaser_pci,canbus=bus,id=controller0
    -device kvaser_pci,canbus=bus,id=controller1 -chardev "pipe,id=monitor,path=$work/monitor" -mon chardev=monitor)
  setpriv --pdeathsig TERM timeout -k 2 "$limit_s" setpriv --pdeathsig KILL \
    qemu-system-x86_64 "${options[@]}" </dev/null >"$work/console" 2>"$work/qemu.err" &
  qemu_pid=$!
}

# The guest's clock is not ours: it is told that its time is nearly over, while it can still say what hangs.
tell_limit() {
  rm -f "$out/limit-near"
  # shellcheck disable=SC2016  # expanded inside
  setpriv --pdeathsig KILL bash -c 'setpriv --pdeathsig KILL sleep "$1" && : >"$2"' \
    tell "$((limit_s > 10 ? limit_s - 5 : limit_s))" "$out/limit-near" &
  limit_pid=$!
}

# shellcheck disable=SC2317  # the trap calls it
clean_up() {
  [[ -z $qemu_pid ]] || kill "$qemu_pid" 2>/dev/null || true
  [[ -z $monitor_pid ]] || kill "$monitor_pid" 2>/dev/null || true
  [[ -z $limit_pid ]] || kill "$limit_pid" 2>/dev/null || true
  [[ -z $work ]] || rm -rf "$work"
}

last_step() {
  local line
  line=$(grep -a '^step: ' "$out/console.log" | tail -n 1) || true
  echo "${line:-step: none was named}"
}

show_tail() {
  echo "rig: last $(last_step)"
  echo "rig: end of the console (all of it is in $out/console.log):"
  tail -n 25 "$out/console.log" | sed 's/^/  | /'
  if [[ -s $work/qemu.err ]]; then sed 's/^/  qemu: /' "$work/qemu.err"; fi
}

# The guest says how the script ended in its last line; the token makes sure that it is this guest's line and not some output.
report() {
  local qemu_status=$1 status
  status=$(sed -n "s/.*rig-end $token \([0-9]*\)\$/\1/p" "$out/console.log")
  if [[ $status == 124 ]]; then
    echo "rig: $script was still running near the limit of $limit_s s; last $(last_step)" >&2
  elif [[ -n $status ]]; then
    :
  elif [[ $qemu_status -eq 124 || $qemu_status -eq 137 ]]; then
    echo "rig: the guest was ended at the limit of $limit_s s" >&2
    show_tail >&2
    status=124
  else
    echo "rig: the guest ended without saying how $script went (qemu's status $qemu_status)" >&2
    show_tail >&2
    status=125
  fi
  exit "$status"
}

main() {
  local qemu_status=0 relay_pid
  parse_arguments "$@"
  mkdir -p "$out"
  out=$(realpath "$out")
  # A comma means something to QEMU's options.
  [[ $out != *,* ]] || fail "the output folder's name must not contain a comma: $out"
  work=$(mktemp -d)
  trap clean_up EXIT
  trap 'exit 130' INT
  trap 'exit 143' TERM HUP
  kernel=$("$here/kernel.sh") || fail "no kernel, see above"
  kernel_version=$(ls "$kernel/lib/modules")
  token=$(od -An -N8 -tx8 /dev/urandom | tr -d ' ')
  build_initramfs
  mkfifo "$work/console"
  relay_console &
  relay_pid=$!
  tell_limit
  run_qemu
  wait "$qemu_pid" || qemu_status=$?
  qemu_pid=''
  wait "$relay_pid" || true
  report "$qemu_status"
}

main "$@"
