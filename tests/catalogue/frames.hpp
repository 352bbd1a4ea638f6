// Acts on the frames of the devices and on the master's interface, for the rows of the catalogue.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"

namespace bmu::test {

/// Applies a script event to each cell of the pack: "voltage_mV 4300".
[[nodiscard]] Act on_every_cell(std::string_view property);
/// `events` now, `back` after `duration`.
[[nodiscard]] Act for_a_while(std::string_view events, Duration duration, std::string_view back);

using FrameTest = std::function<bool(const CanFrame&, const WiredPack&)>;
using FrameChange = std::function<void(CanFrame&, const WiredPack&)>;

[[nodiscard]] bool is_of_last_module(const CanFrame& frame, const WiredPack& pack);
[[nodiscard]] bool is_of_a_module(const CanFrame& frame, const WiredPack& pack);
[[nodiscard]] bool is_of_anybody(const CanFrame& frame, const WiredPack& pack);
/// Frames of one message; of the last module only, if modules send it.
[[nodiscard]] FrameTest is_message(const MessageSpec& row);

/// Frames that pass the test are lost, late or changed; the others are not affected.
[[nodiscard]] Act losing(const FrameTest& test);
[[nodiscard]] Act delaying(const FrameTest& test, Duration delay);
[[nodiscard]] Act changing(const FrameTest& test, const FrameChange& change);
/// The same with a correct checksum.
[[nodiscard]] Act forging(const FrameTest& test, const FrameChange& change);
/// One frame of an unknown node.
[[nodiscard]] Act strange(CanFrame frame);
/// Removes all disturbances between devices and core.
void heal(WiredPack& pack);

/// Sets the counter and recomputes the checksum; the identifier determines the message.
void reseal(CanFrame& frame, std::uint8_t counter);
/// Sets all values of a CELLS frame to this raw number.
[[nodiscard]] FrameChange cells_as(std::uint16_t raw);

[[nodiscard]] Act all(const std::vector<Act>& acts);

}  // namespace bmu::test
