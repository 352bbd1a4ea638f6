// The dialects of the traction-pack messages 620h to 628h, and the detection of the dialect of a bus.
//
// All dialects have the same identifiers; they differ in 622h, a byte each of 626h and 627h and the counting in 625h.
// The sender identifies itself in 620h; if that is not the name of a known dialect, a 622h of seven bytes can only be
// `elithion`, if it is from a pack at all: cars use these identifiers too, and neither bytes that are no text nor a
// length prove that there is a pack.
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
  std::string_view pack_name;                  // content of 620h; empty: no sender of it is known
  std::uint8_t status_length = 6;              // of 622h
  std::span<const MessageSpec* const> rows{};  // empty: detected, but not decoded
};

inline constexpr Dialect dialect_table[] = {
    {.name = "iha", .pack_name = "IHA BMS1", .rows = vehicle_bus::rows},
    {.name = "original", .rows = vehicle_bus_original::rows},
    {.name = "elithion", .pack_name = "Elithion", .status_length = 7, .rows = vehicle_bus_elithion::rows},
};

/// The row of that name; null if there is none.
[[nodiscard]] const Dialect* find_dialect(std::span<const Dialect> rows, std::string_view name);

/// True if these eight bytes can be the name of a pack: printable, which the daemon also requires of a second pack.
[[nodiscard]] bool is_pack_name(const CanFrame& frame);

/// Detects the dialect of one bus.
class DialectWatch {
 public:
  /// An identifier that no frame has: disables the detection.
  static constexpr std::uint32_t nowhere = 0xFFFF'0000;

  DialectWatch(std::span<const Dialect> rows, std::uint32_t base_id) : rows_(rows), base_id_(base_id) {}

  /// True if this frame has given new information. Cheap: most frames have other identifiers.
  bool note(const CanFrame& frame) { return frame.id - base_id_ <= status_offset && note_own(frame); }

  /// Null until a dialect is detected.
  [[nodiscard]] const Dialect* spoken() const { return spoken_; }
  /// The evidence: the pack name in 620h, or the length of 622h. Empty until there is any.
  [[nodiscard]] const std::string& sign() const { return sign_; }
  /// True if only the length of frames with this frame's identifier has shown the dialect.
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
