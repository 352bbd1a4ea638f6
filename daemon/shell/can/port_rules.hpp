// Rules of both kinds of port: which received frames pass, and which frames may be sent at all.
#pragma once

#include <algorithm>
#include <bitset>
#include <cstdint>
#include <vector>

#include "daemon/shell/can/bus_port.hpp"
#include "protocol/assert.hpp"
#include "protocol/frame.hpp"

namespace bmu {

inline constexpr std::uint32_t standard_id_max = 0x7FF;
inline constexpr std::uint32_t extended_id_max = 0x1FFFFFFF;

/// The receiving side of PortOptions. A filter on exact identifiers passes data frames only: a remote frame, or one of
/// the other length with the same number, is a different message.
class ReceiveFilter {
 public:
  explicit ReceiveFilter(const PortOptions& options)
      : extended_ids_(options.receive_extended_ids),
        passes_everything_(options.receive_ids.empty() && options.receive_extended_ids.empty()),
        passes_errors_(options.receive_errors) {
    for (const std::uint32_t id : options.receive_ids) {
      BMU_ASSERT(id <= standard_id_max);
      ids_.set(id);
    }
  }

  [[nodiscard]] bool passes(const CanFrame& frame) const {
    if (frame.is_error) return passes_errors_;
    if (passes_everything_) return true;
    if (frame.is_remote) return false;
    if (frame.is_extended)
      return std::find(extended_ids_.begin(), extended_ids_.end(), frame.id) != extended_ids_.end();
    return frame.id <= standard_id_max && ids_.test(frame.id);
  }
  [[nodiscard]] bool passes_everything() const { return passes_everything_; }
  [[nodiscard]] bool has_id(std::uint32_t id) const { return ids_.test(id); }
  [[nodiscard]] std::size_t id_count() const { return ids_.count(); }
  [[nodiscard]] const std::vector<std::uint32_t>& extended_ids() const { return extended_ids_; }

 private:
  std::bitset<standard_id_max + 1> ids_;
  std::vector<std::uint32_t> extended_ids_;  // a few: chargers have some
  bool passes_everything_;
  bool passes_errors_;
};

/// False if no classic CAN frame can be so; the raw socket itself would let some of these through to the driver.
[[nodiscard]] inline bool is_sendable(const CanFrame& frame) {
  // The identifier of an error frame is a set of class bits, which need the size of an extended one.
  const std::uint32_t id_max = frame.is_extended || frame.is_error ? extended_id_max : standard_id_max;
  return frame.length <= frame.data.size() && frame.id <= id_max;
}

}  // namespace bmu
