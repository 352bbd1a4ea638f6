// What the frames of one bus have shown of who sends there, where no option gives it: the internal bus, which devices,
// and the traction pack.
//
// The internal bus is shown by its seals, the checksum and counter that most of its messages have. One that is right is
// proof where no more than one was wrong before; with more of those, some must be right. Where other senders have these
// identifiers one checksum of 256 is right by chance, which in time is many frames. From the proof on all messages of
// the internal bus are its own, damaged ones, too. The results of its current sensor have no seal and are judged as
// those of a device before.
//
// A part is a device, the vehicle messages or the internal bus: those rows of a catalogue that one sender has
// (DumpCatalogue::part_of). It is seen once a frame has fitted one of its rows in which something else would hardly
// fit. From then on all that fits is its; before, what has nothing to fit stays unknown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/bmudump/identify/device_fit.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"

namespace bmu::dump {

class Evidence {
 public:
  /// Whether a frame that fits so is taken for the message of this row.
  [[nodiscard]] bool believes(const DumpCatalogue& catalogue, std::size_t row, Fit fit) const {
    return fit == Fit::proven || (fit == Fit::unproven && has(catalogue.part_of(row)));
  }
  /// Notes a frame under the identifier of this row. Cheap for rows that are of one part alone which was seen.
  void note(const DumpCatalogue& catalogue, std::size_t row, Fit fit);

  /// Whether the part was seen.
  [[nodiscard]] bool has(std::size_t part) const { return part < parts_.size() && parts_[part].is_seen; }
  /// So many frames fit it and prove nothing, and came before it was seen.
  [[nodiscard]] std::uint64_t left_unknown(std::size_t part) const {
    return part < parts_.size() ? parts_[part].left_unknown : 0;
  }

  /// A frame under a sealed identifier of the internal bus, as long as nothing has shown that bus.
  void note_seal(bool is_right);
  /// The internal bus was shown.
  [[nodiscard]] bool has_internal() const { return has_internal_; }

  /// The pack has said its name: the vehicle messages are its, also those that do not fit.
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
