#include "daemon/shell/status/peer.hpp"

#include <cerrno>

#include <sys/socket.h>

namespace bmu {

namespace {

static_assert(sizeof(gid_t) == sizeof(std::uint32_t));

/// Empty where the kernel does not report them (before Linux 4.13): then the primary group alone counts.
std::vector<std::uint32_t> more_groups_of(int socket) {
  std::vector<std::uint32_t> groups(32);
  auto bytes = static_cast<socklen_t>(groups.size() * sizeof(std::uint32_t));
  int result = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &bytes);
  if (result != 0 && errno == ERANGE) {  // `bytes` is now the size that is needed
    groups.resize(bytes / sizeof(std::uint32_t));
    result = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &bytes);
  }
  groups.resize(result == 0 ? bytes / sizeof(std::uint32_t) : 0);
  return groups;
}

}  // namespace

Peer peer_of(int socket) {
  ucred credentials{};
  socklen_t size = sizeof(credentials);
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &size) != 0) return {};
  return {.user_id = credentials.uid,
          .group_id = credentials.gid,
          .more_groups = more_groups_of(socket),
          .process_id = credentials.pid};
}

}  // namespace bmu
