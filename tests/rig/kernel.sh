#!/usr/bin/env bash
# Puts Debian's own kernel, the one with CAN, into a cache folder. Nothing is installed: the package is only unpacked.
# The folder then holds vmlinuz, lib/modules and image, which is what to start, and is used as it is from then on; delete it to get a newer
# kernel.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source-path=SCRIPTDIR source=../../tools/packages.sh
source "$here/../../tools/packages.sh"

cache=$(realpath -m "${BMUD_RIG_CACHE:-${BMUD_BUILD_DIR:-$here/../../build}/rig-kernel}")

# What is taken out of the package: a guest without sound, video and the like needs a tenth of it.
wanted_parts=('*/boot/vmlinuz-*' '*/modules.order' '*/modules.builtin*' '*/kernel/net/*' '*/kernel/fs/*' '*/kernel/lib/*'
  '*/kernel/crypto/*' '*/kernel/drivers/net/can/*' '*/kernel/drivers/virtio/*' '*/kernel/drivers/char/*' '*/kernel/drivers/block/loop.ko*')

fail() {
  echo "rig kernel: $*" >&2
  exit 1
}

usage() {
  cat <<'TEXT'
usage: tests/rig/kernel.sh

Unpacks Debian's amd64 kernel for the QEMU rig and prints the folder it is in.
  BMUD_RIG_CACHE           the folder (default: rig-kernel in the build folder)
  BMUD_RIG_KERNEL_PACKAGE  the package with vmlinuz and modules (default: the one linux-image-amd64 stands for)
TEXT
}

# linux-image-amd64 is an empty package which depends on the kernel of the day.
find_kernel_package() {
  apt-cache depends --important linux-image-amd64 2>/dev/null | awk '$1 == "Depends:" && $2 ~ /^linux-image-/ { print $2; exit }'
}

kernel_package() {
  local package=${BMUD_RIG_KERNEL_PACKAGE:-}
  [[ -n $package ]] || package=$(find_kernel_package)
  if [[ -z $package ]]; then
    echo "rig kernel: no package lists yet, running apt-get update" >&2
    as_root apt-get -qq update >&2 || true
    package=$(find_kernel_package)
  fi
  [[ -n $package ]] || fail "apt knows no package linux-image-amd64. On another distribution name one with CAN modules in BMUD_RIG_KERNEL_PACKAGE."
  echo "$package"
}

download() {
  local package=$1 folder=$2
  echo "rig kernel: downloading $package" >&2
  if (cd "$folder" && apt-get -qq download "$package" 2>download.log); then return; fi
  # Old lists name a kernel that the mirror has already replaced.
  as_root apt-get -qq update >&2 || true
  [[ -n ${BMUD_RIG_KERNEL_PACKAGE:-} ]] || package=$(find_kernel_package)
  (cd "$folder" && apt-get -qq download "$package" 2>download.log) ||
    fail "could not download $package: $(cat "$folder/download.log")"
}

# A little-endian number of VMLINUZ: number_at OFFSET BYTES VMLINUZ
number_at() { od -An -v -tu"$2" -j "$1" -N "$2" "$3" | tr -d ' '; }

# QEMU starts a kernel that is not packed by its PVH entry, where it has one.
has_pvh_entry() { readelf -n "$1" 2>/dev/null | grep -q 'Xen .*0x00000012'; }

# make_image VMLINUZ IMAGE: unpacked, which the emulated processor takes 8 s for; as it is where we cannot. Where the payload is says
# the header of Linux's boot protocol (Documentation/arch/x86/boot.rst); behind a payload of xz or zstd stand four bytes, its length unpacked.
make_image() {
  local vmlinuz=$1 image=$2 begin length tool
  begin=$((($(number_at 0x1f1 1 "$vmlinuz") + 1) * 512 + $(number_at 0x248 4 "$vmlinuz")))
  length=$(($(number_at 0x24c 4 "$vmlinuz") - 4))
  case $(od -An -v -tx1 -j "$begin" -N 4 "$vmlinuz" | tr -d ' ') in
    fd377a58) tool=xz ;;
    28b52ffd) tool=zstd ;;
    *) tool='' ;;
  esac
  if [[ -n $tool ]] && head -c "$((begin + length))" "$vmlinuz" | tail -c "$length" | "$tool" -qdc >"$image" && has_pvh_entry "$image"; then return; fi
  cp "$vmlinuz" "$image"
}

unpack() {
  local folder=$1 version
  mkdir "$folder/tree" "$folder/kernel"
  dpkg-deb --fsys-tarfile "$folder"/*.deb | tar -x -C "$folder/tree" --wildcards "${wanted_parts[@]}" ||
    fail "$(basename "$folder"/*.deb) does not unpack, or is no kernel package"
  mv "$folder"/tree/boot/vmlinuz-* "$folder/kernel/vmlinuz"
  make_image "$folder/kernel/vmlinuz" "$folder/kernel/image"
  # Newer releases keep modules in /usr/lib; kmod looks for them in lib.
  if [[ -d $folder/tree/usr/lib/modules ]]; then mv "$folder/tree/usr/lib" "$folder/kernel/lib"; else mv "$folder/tree/lib" "$folder/kernel/lib"; fi
  version=$(ls "$folder/kernel/lib/modules")
  depmod -b "$folder/kernel" "$version"
  echo "${wanted_parts[*]}" >"$folder/kernel/parts"
  [[ -n $(find "$folder/kernel/lib/modules" -name 'vcan.ko*') ]] || fail "kernel $version has no CAN modules (the -cloud- kernels have none)"
}

# One that was unpacked when fewer parts were wanted is not.
is_complete() {
  [[ -f $cache/image && -n $(compgen -G "$cache/lib/modules/*/modules.dep") ]] &&
    [[ $(cat "$cache/parts" 2>/dev/null) == "${wanted_parts[*]}" ]]
}

obtain() {
  local work package
  packages_install rig
  work=$(mktemp -d "$(dirname "$cache")/rig-kernel.XXXXXX")
  # shellcheck disable=SC2064  # the folder's name of now is meant
  trap "rm -rf '$work'" EXIT
  package=$(kernel_package)
  download "$package" "$work"
  unpack "$work"
  rm -rf "$cache"
  # One rename at the end: a download that was interrupted leaves no half kernel behind.
  mv "$work/kernel" "$cache"
  echo "rig kernel: $(ls "$cache/lib/modules") is in $cache" >&2
}

case ${1:-} in
  '') ;;
  -h | --help) usage; exit 0 ;;
  *) usage >&2; exit 64 ;;
esac
mkdir -p "$(dirname "$cache")"
# Two callers at once: the second waits and then finds the work done.
exec 9>"$cache.lock"
flock 9
is_complete || obtain
echo "$cache"
