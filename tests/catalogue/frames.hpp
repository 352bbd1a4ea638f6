// Acts on what the devices send and on what the master's interface does, for the rows of the catalogue.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"

namespace bmu::test {

/// The script's events for each cell of the pack: "voltage_mV 4300".
[[nodiscard]] Act on_every_cell(std::string_view property);
/// `events` now, `back` after a while.
[[nodiscard]] Act for_a_while(std::string_view events, Duration duration, std::string_view back);

using FrameTest = std::function<bool(const CanFrame&, const WiredPack&)>;
using FrameChange = std::function<void(CanFrame&, const WiredPack&)>;

[[nodiscard]] bool is_of_last_module(const CanFrame& frame, const WiredPack& pack);
[[nodiscard]] bool is_of_a_module(const CanFrame& frame, const WiredPack& pack);
[[nodiscard]] bool is_of_anybody(const CanFrame& frame, const WiredPack& pack);
/// Frames of one message, of the last module where modules send it.
[[nodiscard]] FrameTest is_message(const MessageSpec& row);

/// Frames that pass the test do not get onto the bus, come late, or come changed; the others do not care.
[[nodiscard]] Act losing(const FrameTest& test);
[[nodiscard]] Act delaying(const FrameTest& test, Duration delay);
[[nodiscard]] Act changing(const FrameTest& test, const FrameChange& change);
/// The same with a checksum that fits again.
[[nodiscard]] Act forging(const FrameTest& test, const FrameChange& change);
/// A frame of a stranger, once.
[[nodiscard]] Act strange(CanFrame frame);
/// Everything between devices and core as it should be.
void heal(WiredPack& pack);

/// Computes counter and checksum anew; the message is known by its identifier.
void reseal(CanFrame& frame, std::uint8_t counter);
/// All values of a CELLS frame as this raw number.
[[nodiscard]] FrameChange cells_as(std::uint16_t raw);

[[nodiscard]] Act all(const std::vector<Act>& acts);

}  // namespace bmu::test
