// The frames that the inverters of "351h to 35Fh" share, made of a battery's report and read again.
#pragma once

#include <optional>

#include "devices/inverter.hpp"
#include "devices/inverter_fields.hpp"
#include "protocol/message.hpp"

namespace bmu::inverter {

/// An empty frame, of the length that the options want.
[[nodiscard]] CanFrame empty_frame(const MessageSpec& message, const InverterOptions& options);

/// 351h: as `message` has it, with or without the lowest voltage.
[[nodiscard]] CanFrame limits_frame(const MessageSpec& message, const BatteryReport& report,
                                    const InverterOptions& options);
/// 355h. `has_codes`: this form can say that something is not known; else the frame is left out then.
[[nodiscard]] std::optional<CanFrame> charge_frame(const MessageSpec& message, const BatteryReport& report,
                                                   const InverterOptions& options, bool has_codes);
/// 356h; likewise.
[[nodiscard]] std::optional<CanFrame> measurements_frame(const MessageSpec& message, const BatteryReport& report,
                                                         const InverterOptions& options, bool has_codes);
/// 35Ah: each item is raised or cleared with every telling, as whoever comes later knows nothing yet.
[[nodiscard]] CanFrame items_frame(const MessageSpec& message, const BatteryReport& report);
/// Eight letters: those of the report, or of the driver.
[[nodiscard]] CanFrame name_frame(const MessageSpec& message, const BatteryReport& report,
                                  std::string_view default_name);

/// SMA's five, which Victron has taken over: limits, charge, measurements, items, name, in this order.
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
/// Frame `index` of these.
[[nodiscard]] std::optional<CanFrame> common_frame(std::size_t index, const CommonRows& rows,
                                                   const BatteryReport& report, const InverterOptions& options);

/// The row of a frame in the catalogue, if it is one of `sender`, whole and of 11 bits. Not whole: `is_refused`.
struct Heard {
  const MessageSpec* message = nullptr;
  bool is_refused = false;
};
[[nodiscard]] Heard heard_as(const Catalogue& catalogue, Sender sender, const CanFrame& frame);

/// How many numbers of a frame its fields must not hold.
[[nodiscard]] std::uint64_t out_of_range_in(const MessageSpec& message, const CanFrame& frame);

/// What 351h says into the report. A field that is not used says nothing, and that is no current at all.
void hear_limits(const MessageSpec& message, const CanFrame& frame, BatteryReport& report);

/// What 35Ah says into the report: items that came and went; the others stay as they were.
void hear_items(const MessageSpec& message, const CanFrame& frame, BatteryReport& report);

/// A battery's frame in a form whose 351h is all there is of limits: 0 allows nothing. `items`: its 35Ah, if it has
/// one.
[[nodiscard]] BatteryWord hear_limits_only(const Catalogue& catalogue, const MessageSpec& limits,
                                           const MessageSpec* items, const CanFrame& frame, BatteryReport& report);
/// The keep-alive of a form in which it is all that an inverter says.
[[nodiscard]] InverterWord take_keep_alive(const Catalogue& catalogue, const CanFrame& frame);
[[nodiscard]] InverterFrames keep_alive_only(const MessageSpec& message);

}  // namespace bmu::inverter
