// The dialects of the traction-pack messages 620h to 628h, and how to tell from a bus which one is spoken there.
//
// All dialects have the same identifiers; what differs is 622h, a byte each of 626h and 627h and what 625h counts. Who
// sends says who he is in 620h; where that is no name a dialect is known by, a 622h of seven bytes can only be
// `elithion`, if it is a pack's at all: cars have these identifiers, too, and neither bytes that are no text nor a
// length show that there is a pack.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "protocol/tables/vehicle_bus_elithion.hpp"
#include "protocol/tables/vehicle_bus_original.hpp"

namespace bmu::dump {

struct Dialect {
  std::string_view name;
  std::string_view pack_name;                  // what 620h says; empty: nobody is known to speak it
  std::uint8_t status_length = 6;              // of 622h
  std::span<const MessageSpec* const> rows{};  // empty: it is recognised, and not read
};

inline constexpr Dialect dialect_table[] = {
    {.name = "iha", .pack_name = "IHA BMS1", .rows = vehicle_bus::rows},
    {.name = "original", .rows = vehicle_bus_original::rows},
    {.name = "elithion", .pack_name = "Elithion", .status_length = 7, .rows = vehicle_bus_elithion::rows},
};

/// The row of that name; null if there is none.
[[nodiscard]] const Dialect* find_dialect(std::span<const Dialect> rows, std::string_view name);

/// Whether these eight bytes can be the name of a pack: printable, as a second pack's is where the daemon takes it.
[[nodiscard]] bool is_pack_name(const CanFrame& frame);

/// Listens to one bus.
class DialectWatch {
 public:
  /// An identifier that no frame has: nothing tells there.
  static constexpr std::uint32_t nowhere = 0xFFFF'0000;

  DialectWatch(std::span<const Dialect> rows, std::uint32_t base_id) : rows_(rows), base_id_(base_id) {}

  /// True if this frame has told something new. Cheap: most frames are none of these.
  bool note(const CanFrame& frame) { return frame.id - base_id_ <= status_offset && note_own(frame); }

  /// Null while nothing has told.
  [[nodiscard]] const Dialect* spoken() const { return spoken_; }
  /// How one knows: '620h says "Elithion"'. Empty while nothing has told.
  [[nodiscard]] const std::string& sign() const { return sign_; }
  /// Whether nothing but the length of this frame's identifier has told.
  [[nodiscard]] bool is_told_by_length_of(const CanFrame& frame) const {
    return is_told_by_length_ && frame.id == base_id_ + status_offset;
  }

 private:
  static constexpr std::uint32_t status_offset = 2;

  bool note_own(const CanFrame& frame);
  bool note_name(const CanFrame& frame);
  bool note_status(const CanFrame& frame);

  std::span<const Dialect> rows_;
  std::uint32_t base_id_;
  const Dialect* spoken_ = nullptr;
  std::string sign_;
  bool is_told_by_length_ = false;
};

}  // namespace bmu::dump
