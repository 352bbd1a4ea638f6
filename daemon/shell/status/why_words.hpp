// The words that answers to "why" are made of: spans of time, places, what was seen, one step of a chain.
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
/// All with a comma between.
[[nodiscard]] std::string joined(const Texts& texts);

/// {"kind":..., "text":...}: one link of a chain, to which its numbers are added.
[[nodiscard]] Json step(std::string_view kind, std::string sentence);

/// Where a fault was seen: "cell 2.7 (no. 19)", "emergency stop 1 of the unit", "emergency stop \"cockpit\" of this
/// machine"; "" for the pack.
[[nodiscard]] std::string place_text(const FaultRow& row, const Element& element, const CoreView& view);
/// As element_json(), with the place in these words.
[[nodiscard]] Json place_json(const FaultRow& row, const Element& element, const CoreView& view);
/// "cell 2.7 (no. 19): 2.8512 V", "module 3", or what the row says when there is nothing to point at.
[[nodiscard]] std::string reading_text(const FaultRow& row, const Reading& reading, const CoreView& view);

/// "insulation_pulses, insulation_ok: /dev/gpiochip0: found no way to open it, wanted ...": which lines of this machine
/// cannot be read or driven, and why; "" where nobody knows.
[[nodiscard]] std::string lines_text(const CoreView& view);

/// Faults that are somebody's silence: seen is the last word, and the limit is how long one may be waited for.
struct Silence {
  bool is_one = false;
  Duration limit{};  // the least that there is
};
[[nodiscard]] Silence silence_of(FaultId fault, const CoreView& view);

/// "25.000 A given, 10.000 A asked for"; "" if it has not been seen since the start.
[[nodiscard]] std::string excess_text(const ChargerExcess& excess);

/// What was seen when the fault was believed, as reading_text(); of a former life it says so, and what is not known. Of
/// one whose cause is gone it says that this was seen last, and what is seen now.
[[nodiscard]] std::string confirmed_text(const FaultRow& row, const FaultState& state, const CoreView& view);

/// The key of the pack file that explains the fault, by what is seen now; "" where none does.
[[nodiscard]] std::string likely_text(const FaultRow& row, const CoreView& view);

/// What the lines of this machine are called whose bits are set, `what` before each: "emergency stop \"cockpit\"".
[[nodiscard]] Texts line_texts(std::string_view what, GpioInputKind kind, unsigned bits, const CoreView& view);

}  // namespace bmu
