// Contactors and inputs on lines of a GPIO chip of the gateway: the assignment of the lines.
//
// Levels are logical: true is "closed" or "driven" of an output and its feedback, "healthy or present" of an input, as
// in PDU_STATUS. `active_low`: the wire is at 0 V in this state.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/time.hpp"

namespace bmu {

enum class GpioOutput : std::uint8_t {
  main_positive,
  main_negative,
  precharge,
  charge,
  auxiliary,
  fan,
  heater,
  watchdog,  // not commanded: it toggles as long as decisions are made
};
/// By number; also their keys in the pack file.
inline constexpr std::array<std::string_view, 8> gpio_output_names{
    "main_positive", "main_negative", "precharge", "charge", "auxiliary", "fan", "heater", "watchdog"};
inline constexpr std::size_t gpio_output_count = gpio_output_names.size();
inline constexpr std::size_t gpio_feedback_count = gpio_output_count - 1;  // the watchdog has no feedback

enum class GpioInputKind : std::uint8_t {
  vehicle_on,         // the vehicle's ignition
  charger_connected,  // its plug
  estop,              // active: released
  interlock,          // active: loop closed
  insulation_ok,      // active: the monitor reports ok
  supply_ok,          // active: the supply of contactors and gateway is in its range
  resume_button,      // active: pressed
};
inline constexpr std::array<std::string_view, 7> gpio_input_kind_names{
    "vehicle_on", "charger_connected", "estop", "interlock", "insulation_ok", "supply_ok", "resume_button"};

[[nodiscard]] constexpr std::string_view to_text(GpioOutput output) {
  return gpio_output_names.at(static_cast<std::size_t>(output));
}
[[nodiscard]] constexpr std::string_view to_text(GpioInputKind kind) {
  return gpio_input_kind_names.at(static_cast<std::size_t>(kind));
}

struct GpioLine {
  std::uint32_t line = 0;  // offset on the chip
  bool active_low = false;
};

/// A line that is read. A level is accepted once it has been stable for `debounce`.
struct GpioFeedback {
  GpioLine at;
  Duration debounce = 5ms;
};

struct GpioInput {
  std::string name;  // display name, unique
  GpioInputKind kind = GpioInputKind::vehicle_on;
  GpioLine at;
  Duration debounce = 5ms;
};

inline constexpr std::size_t gpio_inputs_max = 16;
/// A request carries ten attributes (GPIO_V2_LINE_NUM_ATTRS_MAX): one for the polarity, the others for debouncing.
inline constexpr std::size_t gpio_debounce_times_max = 9;

struct GpioConfig {
  std::string chip;                                                       // "/dev/gpiochip0"
  std::array<std::optional<GpioLine>, gpio_output_count> outputs;         // by GpioOutput
  std::array<std::optional<GpioFeedback>, gpio_feedback_count> feedback;  // of the output of the same number
  std::vector<GpioInput> inputs;
  std::optional<GpioLine> insulation_pulses;  // an IR155's pulse output, captured; its OK line is an input

  [[nodiscard]] bool has_no_outputs() const {
    return std::none_of(outputs.begin(), outputs.end(), [](const auto& line) { return line.has_value(); });
  }
};

}  // namespace bmu
