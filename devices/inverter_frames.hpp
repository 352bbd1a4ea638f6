// Encoding and decoding of the frames that the inverters with "351h to 35Fh" share.
#pragma once

#include <optional>

#include "devices/inverter.hpp"
#include "devices/inverter_fields.hpp"
#include "protocol/message.hpp"

namespace bmu::inverter {

/// An empty frame with the length that the options select.
[[nodiscard]] CanFrame empty_frame(const MessageSpec& message, const InverterOptions& options);

/// 351h, with or without the discharge voltage limit, as `message` has it.
[[nodiscard]] CanFrame limits_frame(const MessageSpec& message, const BatteryReport& report,
                                    const InverterOptions& options);
/// 355h. `has_codes`: the protocol has codes for unknown values; otherwise a frame with an unknown value is omitted.
[[nodiscard]] std::optional<CanFrame> charge_frame(const MessageSpec& message, const BatteryReport& report,
                                                   const InverterOptions& options, bool has_codes);
/// 356h; likewise.
[[nodiscard]] std::optional<CanFrame> measurements_frame(const MessageSpec& message, const BatteryReport& report,
                                                         const InverterOptions& options, bool has_codes);
/// 35Ah: every frame sets each item to raised or cleared, because a receiver that starts later has no earlier state.
[[nodiscard]] CanFrame items_frame(const MessageSpec& message, const BatteryReport& report);
/// Eight characters: those of the report, or of the driver.
[[nodiscard]] CanFrame name_frame(const MessageSpec& message, const BatteryReport& report,
                                  std::string_view default_name);

/// SMA's five frames, which Victron has adopted: limits, charge, measurements, items, name, in this order.
struct CommonRows {
  const MessageSpec* limits = nullptr;
  const MessageSpec* charge = nullptr;
  const MessageSpec* measurements = nullptr;
  const MessageSpec* items = nullptr;
  const MessageSpec* name = nullptr;
  bool has_codes = false;
  std::string_view default_name;
};
inline constexpr std::uint8_t common_count = 5;
/// Frame `index` of the five.
[[nodiscard]] std::optional<CanFrame> common_frame(std::size_t index, const CommonRows& rows,
                                                   const BatteryReport& report, const InverterOptions& options);

/// Row of a frame in the catalogue, if it is from `sender` and has 11 bits. `is_refused`: remote, or of a wrong length.
struct Heard {
  const MessageSpec* message = nullptr;
  bool is_refused = false;
};
[[nodiscard]] Heard heard_as(const Catalogue& catalogue, Sender sender, const CanFrame& frame);

/// Number of signals of a frame with a number that is not allowed in their field.
[[nodiscard]] std::uint64_t out_of_range_in(const MessageSpec& message, const CanFrame& frame);

/// Reads 351h into the report. An unused field is read as 0, which allows no current at all.
void hear_limits(const MessageSpec& message, const CanFrame& frame, BatteryReport& report);

/// Reads 35Ah into the report: items that were raised or cleared; the others stay as they were.
void hear_items(const MessageSpec& message, const CanFrame& frame, BatteryReport& report);

/// Reads a battery's frame in a protocol with no other limits than 351h: 0 allows no current. `items`: its 35Ah, if it
/// has one.
[[nodiscard]] BatteryWord hear_limits_only(const Catalogue& catalogue, const MessageSpec& limits,
                                           const MessageSpec* items, const CanFrame& frame, BatteryReport& report);
/// Keep-alive of a protocol in which an inverter sends nothing else.
[[nodiscard]] InverterWord take_keep_alive(const Catalogue& catalogue, const CanFrame& frame);
[[nodiscard]] InverterFrames keep_alive_only(const MessageSpec& message);

}  // namespace bmu::inverter
