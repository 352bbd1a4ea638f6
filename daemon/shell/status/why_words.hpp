// Texts of which replies to "why" are composed: spans of time, places, readings, one step of a chain.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/types/gpio_config.hpp"
#include "daemon/core/faults/fault_memory.hpp"
#include "daemon/shell/json/core_view.hpp"

namespace bmu {

using Texts = std::vector<std::string>;

[[nodiscard]] inline std::string text(std::string_view view) {
  return std::string(view);
}

/// "350 ms", "3.2 s", "2 min 5 s", "1 h 20 min": as exact as a reader needs.
[[nodiscard]] std::string span_text(Duration span);
/// "3.2 s ago", "never".
[[nodiscard]] std::string ago_text(const CoreView& view, TimePoint at);
[[nodiscard]] std::string capitalised(std::string sentence);
/// All, separated by commas.
[[nodiscard]] std::string joined(const Texts& texts);

/// {"kind":..., "text":...}: one step of a chain, to which its numbers are added.
[[nodiscard]] Json step(std::string_view kind, std::string sentence);

/// Place of a fault: "cell 2.7 (no. 19)", "emergency stop 1 of the unit", "emergency stop \"cockpit\" of this machine";
/// "" for the pack.
[[nodiscard]] std::string place_text(const FaultRow& row, const Element& element, const CoreView& view);
/// As element_json(), with the place in this form.
[[nodiscard]] Json place_json(const FaultRow& row, const Element& element, const CoreView& view);
/// "cell 2.7 (no. 19): 2.8512 V", "module 3", or the fault's own text if it has no place to point at.
[[nodiscard]] std::string reading_text(const FaultRow& row, const Reading& reading, const CoreView& view);

/// "insulation_pulses, insulation_ok: /dev/gpiochip0: found no way to open it, wanted ...": lines of this machine that
/// cannot be read or driven, and why; "" if that is unknown.
[[nodiscard]] std::string lines_text(const CoreView& view);

/// Receive timeouts: the reading of such a fault is the last reception, and the limit the longest permitted wait.
struct Silence {
  bool is_one = false;
  Duration limit{};  // the shortest that applies
};
[[nodiscard]] Silence silence_of(FaultId fault, const CoreView& view);

/// "25.000 A given, 10.000 A asked for"; "" if there was none since the start.
[[nodiscard]] std::string excess_text(const ChargerExcess& excess);

/// The reading at which the fault was confirmed, as reading_text(); with a note if it is restored from a previous
/// session, or unknown. If the cause is gone it is marked as the last reading, and the present one is added.
[[nodiscard]] std::string confirmed_text(const FaultRow& row, const FaultState& state, const CoreView& view);

/// The key of the pack file that explains the fault, by the present readings; "" if none does.
[[nodiscard]] std::string likely_text(const FaultRow& row, const CoreView& view);

/// Names of the lines of this machine with set bits, `what` before each: "emergency stop \"cockpit\"".
[[nodiscard]] Texts line_texts(std::string_view what, GpioInputKind kind, unsigned bits, const CoreView& view);

}  // namespace bmu
