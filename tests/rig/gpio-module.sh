#!/usr/bin/env bash
# Builds the GPIO chip of the emulated machine (gpio/rig_gpio.c) for the very kernel that kernel.sh gives, and prints the module's path.
# Beside it is rig_bus_off.ko (gpio/rig_bus_off.c), which takes a CAN interface off its bus.
# The headers are packages like the kernel, and like it only unpacked, into a folder beside it; delete that to get them anew.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
# shellcheck source-path=SCRIPTDIR source=../../tools/packages.sh
source "$here/../../tools/packages.sh"

fail() {
  echo "rig gpio module: $*" >&2
  exit 1
}

usage() {
  cat <<'TEXT'
usage: tests/rig/gpio-module.sh

Builds the kernel modules rig_gpio and rig_bus_off for the rig's kernel and prints the path of the first, which the second is beside, in the
folder rig_gpio beside the kernel's, see kernel.sh.
TEXT
}

# The headers of one kernel, those common to its flavours, and the kernel's own build tools, which Debian numbers apart.
header_packages() {
  local package=linux-headers-$1
  echo "$package"
  apt-cache depends --important "$package" | awk '$1 == "Depends:" && $2 ~ /^linux-(headers|kbuild)-/ { print $2 }'
}

obtain_headers() {
  local work packages
  mapfile -t packages < <(header_packages "$version")
  [[ ${#packages[@]} -ge 3 ]] || fail "apt knows no linux-headers-$version: the kernel in $kernel is no longer the mirror's; delete it to get the newer one"
  echo "rig gpio module: downloading ${packages[*]}" >&2
  work=$(mktemp -d "$folder.XXXXXX")
  # shellcheck disable=SC2064  # the folder's name of now is meant
  trap "rm -rf '$work'" EXIT
  (cd "$work" && apt-get -qq download "${packages[@]}" 2>download.log) || fail "could not download ${packages[*]}: $(cat "$work/download.log")"
  for package in "$work"/*.deb; do dpkg-deb --extract "$package" "$work/tree"; done
  # The package names the common part by where it would be installed.
  sed -i "s#/usr/src/#$folder/tree/usr/src/#" "$work/tree/usr/src/linux-headers-$version/Makefile"
  mkdir -p "$folder"
  rm -rf "$folder/tree"
  mv "$work/tree" "$folder/tree"
  echo "$version" >"$folder/version"
}

has_headers() { [[ -f $folder/version && $(<"$folder/version") == "$version" ]]; }

build() {
  # Beside no sources but these: the kernel's make writes where they are.
  mkdir -p "$folder/module"
  cp -p "$here/gpio/Kbuild" "$here"/gpio/*.c "$folder/module"
  make --silent -C "$folder/tree/usr/src/linux-headers-$version" "M=$folder/module" modules >"$folder/make.log" 2>&1 ||
    { cat "$folder/make.log" >&2; fail "the modules in tests/rig/gpio do not build for $version, see above"; }
}

case ${1:-} in
  '') ;;
  -h | --help) usage; exit 0 ;;
  *) usage >&2; exit 64 ;;
esac
kernel=$("$here/kernel.sh") || fail "no kernel, see above"
version=$(ls "$kernel/lib/modules")
folder=$(dirname "$kernel")/rig_gpio
# Two callers at once: the second waits and then finds the work done.
exec 9>"$folder.lock"
flock 9
packages_install rig
has_headers || obtain_headers
build
echo "$folder/module/rig_gpio.ko"
