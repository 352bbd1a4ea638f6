// Evidence from the frames of one bus for its senders, if no option declares them: the internal bus, devices, and the
// traction pack.
//
// Evidence for the internal bus are its seals, the checksum and counter of most of its messages. A right one is proof
// if at most one wrong one came before; with more wrong ones, more right ones are required. If other senders use these
// identifiers, one checksum of 256 is right by chance, which in time is many frames. After the proof all messages of
// the internal bus are accepted as its own, including damaged ones. The results of its current sensor have no seal and
// are evaluated as those of a device before the proof.
//
// A part is a device, the vehicle messages or the internal bus: the rows of a catalogue that one sender has
// (DumpCatalogue::part_of). It is seen once a frame has fitted one of its rows that other contents would hardly fit.
// After that all fitting frames belong to it; before, frames of rows without such content stay unknown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/bmudump/identify/device_fit.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"

namespace bmu::dump {

class Evidence {
 public:
  /// True if a frame with this fit counts as the message of this row.
  [[nodiscard]] bool believes(const DumpCatalogue& catalogue, std::size_t row, Fit fit) const {
    return fit == Fit::proven || (fit == Fit::unproven && has(catalogue.part_of(row)));
  }
  /// Notes a frame under the identifier of this row. Cheap for rows of a single part that was seen.
  void note(const DumpCatalogue& catalogue, std::size_t row, Fit fit);

  /// True if the part was seen.
  [[nodiscard]] bool has(std::size_t part) const { return part < parts_.size() && parts_[part].is_seen; }
  /// Number of frames that fit the part without proof, before it was seen.
  [[nodiscard]] std::uint64_t left_unknown(std::size_t part) const {
    return part < parts_.size() ? parts_[part].left_unknown : 0;
  }

  /// Notes a frame under a sealed identifier of the internal bus, until that bus is proven.
  void note_seal(bool is_right);
  /// True if the internal bus is proven.
  [[nodiscard]] bool has_internal() const { return has_internal_; }

  /// The pack has sent its name: all vehicle messages are from it, including those that do not fit.
  void note_pack_name() { has_pack_name_ = true; }
  [[nodiscard]] bool has_pack_name() const { return has_pack_name_; }
  /// A vehicle message has passed its check.
  void note_vehicle() { has_vehicle_ = true; }
  [[nodiscard]] bool has_vehicle() const { return has_vehicle_; }

 private:
  struct PartSeen {
    bool is_seen = false;
    std::uint64_t left_unknown = 0;
  };

  PartSeen& at(std::size_t part);

  std::vector<PartSeen> parts_;
  std::uint64_t right_seals_ = 0;
  std::uint64_t wrong_seals_ = 0;
  bool has_internal_ = false;
  bool has_pack_name_ = false;
  bool has_vehicle_ = false;
};

}  // namespace bmu::dump
