// Who asks on the status socket, by the kernel's word at the time it connected: nothing of it is the client's to say.
#pragma once

#include <cstdint>
#include <vector>

namespace bmu {

struct Peer {
  /// What nobody has, for a peer the kernel says nothing of.
  static constexpr std::uint32_t nobody = 0xFFFF'FFFF;

  std::uint32_t user_id = nobody;
  std::uint32_t group_id = nobody;
  std::vector<std::uint32_t> more_groups{};  // supplementary ones
  std::int64_t process_id = 0;               // 0: of another namespace, which has no number here
  std::uint64_t connection = 0;              // the socket's own number for it, never used twice; 0: none
};

/// Of a connected Unix socket (SO_PEERCRED, SO_PEERGROUPS).
[[nodiscard]] Peer peer_of(int socket);

}  // namespace bmu
