// What the frames of one bus have shown of who sends there, where no option gives it: which devices, and the traction
// pack.
//
// A part is a device, or the vehicle messages: those rows of a catalogue that one sender has (DumpCatalogue::part_of).
// It is seen once a frame has fitted one of its rows in which something else would hardly fit. From then on all that
// fits is its; before, what has nothing to fit stays unknown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tools/bmudump/device_fit.hpp"
#include "tools/bmudump/dump_catalogue.hpp"

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
  bool has_pack_name_ = false;
  bool has_vehicle_ = false;
};

}  // namespace bmu::dump
