#!/usr/bin/env bash
# Installs the Debian packages that building, testing and checking this project needs, and only those that are missing.
# Sourced, it offers packages_install GROUP... and as_root COMMAND...; run, it does the same from the command line.
set -euo pipefail

# Names without a version wherever Debian has them, so that a newer release brings its own compiler.
packages_of_group() {
  case $1 in
    build) echo g++ cmake ninja-build ccache pkg-config libsystemd-dev libsocketcan-dev libmnl-dev libspdlog-dev nlohmann-json3-dev libexpected-dev libcli11-dev libeigen3-dev libsqlite3-dev libzstd-dev zlib1g-dev ;;
    # python3-canmatrix reads our DBC files, tmux is a terminal to look at, socat speaks to the status socket in docs/.
    test) echo catch2 librapidcheck-dev libbenchmark-dev can-utils jq python3-canmatrix socat tmux zsh zstd ;;
    # xz-utils and zstd: newer kernels pack their modules. iproute2 and jq are for the scripts inside the guest.
    # make, gcc and libelf-dev (for objtool) build the module of the GPIO chip.
    # systemd is the guest's where a test wants it, with e2fsprogs for a small disk, strace for a thread that is held and calls that fail, and
    # socat and man-db for what is looked at in it.
    rig) echo qemu-system-x86 busybox-static cpio gzip kmod iproute2 can-utils jq xz-utils zstd make gcc libelf-dev systemd e2fsprogs strace socat man-db ;;
    # libclang-rt-dev holds the sanitizers' runtime, python3 runs run-clang-tidy, similarity-tester has sim_c++.
    lint) echo git shellcheck clang clang-format clang-tidy lld cppcheck libclang-rt-dev python3 similarity-tester ;;
    # lowdown makes manual pages of docs/, which lintian and a test look at with man-db.
    package) echo cmake dpkg-dev fakeroot lintian lowdown man-db ;;
    # llvm holds llvm-cov and llvm-profdata; python3-clang is for Debian's own /usr/bin/python3.
    mutation) echo git clang llvm libclang-rt-dev python3 python3-clang ;;
    *) return 1 ;;
  esac
}

packages_usage() {
  cat <<'TEXT'
usage: tools/packages.sh [--list] GROUP...

Installs what is missing of the groups build, test, rig, package, lint and mutation; "all" means every group.
--list prints the missing packages, one a line, and installs nothing.

  tools/packages.sh build test     to build and to run the fast tests
  tools/packages.sh --list all     what would be installed
TEXT
}

packages_fail() {
  echo "packages: $*" >&2
  return 1
}

can_be_root() { [[ $(id -u) -eq 0 ]] || command -v sudo >/dev/null; }

as_root() {
  if [[ $(id -u) -eq 0 ]]; then
    "$@"
  elif can_be_root; then
    sudo "$@"
  else
    packages_fail "'$*' needs root: run it as root, or install sudo"
  fi
}

package_is_installed() {
  [[ $(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]
}

# Prints the missing packages of the groups, one a line, each once.
packages_missing() {
  local group package packages
  for group in "$@"; do
    packages=$(packages_of_group "$group") || packages_fail "unknown group '$group' (build, test, rig, package, lint, mutation)" || return
    for package in $packages; do
      package_is_installed "$package" || echo "$package"
    done
  done | sort -u
}

packages_install() {
  local missing
  command -v apt-get >/dev/null && command -v dpkg-query >/dev/null ||
    packages_fail "this is no Debian or Ubuntu (no apt-get); install the like of these by hand: $(packages_names "$@")" || return
  missing=$(packages_missing "$@") || return
  [[ -n $missing ]] || return 0
  can_be_root || packages_fail "installing needs root or sudo, and neither is there. As root: apt-get install ${missing//$'\n'/ }" || return
  echo "packages: installing ${missing//$'\n'/ }" >&2
  # A failed update need not matter: the lists at hand may do. The install has the last word.
  as_root apt-get -qq update >&2 || echo "packages: apt-get update failed, going on with the package lists at hand" >&2
  # shellcheck disable=SC2086  # one word a package
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 install --yes --no-install-recommends $missing >&2 ||
    packages_fail "apt-get could not install: ${missing//$'\n'/ }. Its own message is above; is the network there, and does this release have them?"
}

packages_names() {
  local group
  for group in "$@"; do packages_of_group "$group"; done | tr '\n' ' '
}

packages_main() {
  local list=no
  [[ ${1:-} != --list ]] || { list=yes; shift; }
  case ${1:-} in
    '') packages_usage >&2; return 2 ;;
    -h | --help) packages_usage; return 0 ;;
    all) set -- build test rig package lint mutation ;;
  esac
  if [[ $list == yes ]]; then packages_missing "$@"; else packages_install "$@"; fi
}

if [[ ${BASH_SOURCE[0]} == "$0" ]]; then packages_main "$@"; fi
