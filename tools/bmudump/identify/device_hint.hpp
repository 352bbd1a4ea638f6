// Frames of a bus that nothing read there explains, and the devices whose they could be.
//
// Not explained is an identifier that is unknown, or whose frames all have a wrong length or checksum. A device is
// named only if it has most of those identifiers, each with a frame that fits: three of 11 bits, as few of these are
// anybody's alone, or one of 29; and if one of them has more to fit than a length. That is no proof, and is said so.
#pragma once

#include <bitset>
#include <span>
#include <vector>

#include "devices/device.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::dump {

class DeviceHint {
 public:
  /// A classic frame, as the check of its bus has judged it. Cheap for all but the first of what is not explained.
  void note(const CanFrame& frame, const CheckedFrame& verdict) {
    if (!verdict.is_accepted) return note_rejected(frame, verdict);
    if (!frame.is_extended) is_explained_[frame.id] = true;
  }
  /// Those that have the most of it, of all devices but `read`; none is the rule.
  [[nodiscard]] std::vector<const Device*> candidates(std::span<const Device* const> read) const;
  [[nodiscard]] std::size_t unexplained() const { return left().size(); }
  /// So many of them are this device's.
  [[nodiscard]] std::size_t explained_by(const Device& device) const;

  /// A frame of this identifier has passed its check.
  [[nodiscard]] bool has_passed(const CanFrame& frame) const {
    return !frame.is_extended && frame.id < Catalogue::id_count && is_explained_[frame.id];
  }

 private:
  /// What a bus has of others is not our concern beyond this.
  static constexpr std::size_t seen_max = 256;

  void note_rejected(const CanFrame& frame, const CheckedFrame& verdict);
  /// Of what was seen, that of which nothing has passed.
  [[nodiscard]] std::vector<CanFrame> left() const;

  std::vector<CanFrame> seen_;  // the first of each identifier
  std::bitset<Catalogue::id_count> has_short_;
  std::bitset<Catalogue::id_count> is_explained_;  // by a frame that passed
};

}  // namespace bmu::dump
