// Credentials of a client of the status socket, as the kernel reports them for the time of connecting: the client has
// no influence on them.
#pragma once

#include <cstdint>
#include <vector>

namespace bmu {

struct Peer {
  /// Id that no account has, for a peer without credentials.
  static constexpr std::uint32_t nobody = 0xFFFF'FFFF;

  std::uint32_t user_id = nobody;
  std::uint32_t group_id = nobody;
  std::vector<std::uint32_t> more_groups{};  // supplementary ones
  std::int64_t process_id = 0;               // 0: of another namespace, which has no number here
  std::uint64_t connection = 0;              // number of the connection, never used twice; 0: none
};

/// The peer of a connected Unix socket (SO_PEERCRED, SO_PEERGROUPS).
[[nodiscard]] Peer peer_of(int socket);

}  // namespace bmu
