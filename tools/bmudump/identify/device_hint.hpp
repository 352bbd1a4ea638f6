// Collects frames of a bus that no catalogue explains, and finds the devices that may have sent them.
//
// An identifier is unexplained if it is unknown, or if all its frames have a wrong length or checksum. A device is
// named only if it has most of those identifiers, each with a frame that fits: three of 11 bits, because few of these
// belong to one device only, or one of 29; and if one of them has more to fit than a length. That is no proof, and the
// text states this.
#pragma once

#include <bitset>
#include <span>
#include <vector>

#include "devices/device.hpp"
#include "protocol/receive_check.hpp"

namespace bmu::dump {

class DeviceHint {
 public:
  /// Notes a classic frame with the result of its bus's check. Cheap for all but the first frame of an unexplained
  /// identifier.
  void note(const CanFrame& frame, const CheckedFrame& verdict) {
    if (!verdict.is_accepted) return note_rejected(frame, verdict);
    if (!frame.is_extended) is_explained_[frame.id] = true;
  }
  /// The devices, except those in `read`, with the most unexplained identifiers; usually none.
  [[nodiscard]] std::vector<const Device*> candidates(std::span<const Device* const> read) const;
  [[nodiscard]] std::size_t unexplained() const { return left().size(); }
  /// Number of unexplained identifiers of this device.
  [[nodiscard]] std::size_t explained_by(const Device& device) const;

  /// True if a frame of this identifier has passed its check.
  [[nodiscard]] bool has_passed(const CanFrame& frame) const {
    return !frame.is_extended && frame.id < Catalogue::id_count && is_explained_[frame.id];
  }

 private:
  /// Further identifiers of other senders are not considered.
  static constexpr std::size_t seen_max = 256;

  void note_rejected(const CanFrame& frame, const CheckedFrame& verdict);
  /// The noted frames without any that passed under the same identifier.
  [[nodiscard]] std::vector<CanFrame> left() const;

  std::vector<CanFrame> seen_;  // the first frame of each identifier
  std::bitset<Catalogue::id_count> has_short_;
  std::bitset<Catalogue::id_count> is_explained_;  // by a frame that passed
};

}  // namespace bmu::dump
