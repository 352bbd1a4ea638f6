// From levels of GPIO lines to contacts and inputs in the core.
#include "daemon/shell/gpio/line_feeder.hpp"

#include <cerrno>
#include <vector>

#include "daemon/core/measurement/sensor_table.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fake_chip.hpp"

namespace bmu {
namespace {

GpioLevel input(GpioInputKind kind, bool is_active, bool was_inactive) {
  return {.kind = kind, .is_active = is_active, .was_inactive = was_inactive};
}
GpioLevel contact(GpioOutput output, bool is_closed) {
  return {.feedback_of = output, .is_active = is_closed, .was_inactive = !is_closed};
}

constexpr std::uint32_t stop_line = 7;

GpioConfig stop_and_key() {
  GpioConfig config{.chip = "/dev/gpiochip0", .outputs = {}, .feedback = {}, .inputs = {}};
  config.outputs.at(static_cast<std::size_t>(GpioOutput::fan)) = {.line = 6};
  config.inputs = {{.name = "cockpit", .kind = GpioInputKind::estop, .at = {.line = stop_line}},
                   {.name = "key", .kind = GpioInputKind::vehicle_on, .at = {.line = 9}},
                   {.name = "rear", .kind = GpioInputKind::estop, .at = {.line = 8}}};
  return config;
}

/// Merged state of a PDU with these contacts and GPIO lines with those.
PduState merged(const PduState& unit, const LineImage& lines, const CoreConfig& config) {
  const TimePoint at{1s};
  const auto both = merge_inputs({unit, at, Validity::valid}, {lines, at, Validity::valid}, config);
  REQUIRE(both.is_valid());
  return both.value;
}

}  // namespace

TEST_CASE("stops and interlocks are counted by their order, each kind by itself", "[unit][gpio][FS_7]") {
  const std::vector<GpioLevel> levels{contact(GpioOutput::main_positive, true),
                                      contact(GpioOutput::precharge, false),
                                      contact(GpioOutput::charge, true),
                                      input(GpioInputKind::estop, true, false),
                                      input(GpioInputKind::interlock, false, true),
                                      input(GpioInputKind::estop, false, true),
                                      input(GpioInputKind::interlock, true, false),
                                      input(GpioInputKind::vehicle_on, true, true),
                                      input(GpioInputKind::supply_ok, true, false)};
  const LineImage image = line_image(levels);
  CHECK(image == LineImage{.closed_contacts = 0b1001,
                           .vehicle_on = true,
                           .supply_ok = true,
                           .estops_pressed = 0b10,
                           .interlocks_open = 0b01});
}

TEST_CASE("a level that was bad for a moment counts as bad", "[unit][gpio][FS_7]") {
  CHECK(line_image(std::vector{input(GpioInputKind::estop, true, true)}).estops_pressed == 1);
  CHECK(line_image(std::vector{input(GpioInputKind::interlock, true, true)}).interlocks_open == 1);
  CHECK_FALSE(line_image(std::vector{input(GpioInputKind::insulation_ok, true, true)}).insulation_ok);
  CHECK_FALSE(line_image(std::vector{input(GpioInputKind::supply_ok, true, true)}).supply_ok);
}

TEST_CASE("every no between two decisions reaches the next one, and none after it", "[unit][gpio][FS_7]") {
  FakeChip chip;
  for (const std::uint32_t line : {stop_line, 8U, 9U}) chip.set_wire(line, true);
  GpioLines lines(stop_and_key(), chip);
  REQUIRE(lines.open());
  LineFeeder feeder(lines);
  CHECK(feeder.look().estops_pressed == 0);
  feeder.decided();
  chip.set_wire(stop_line, false);
  CHECK(feeder.look().estops_pressed == 1);
  chip.set_wire(stop_line, true);
  static_cast<void>(feeder.look());
  CHECK(feeder.look().estops_pressed == 1);  // no decision yet
  CHECK(feeder.last().vehicle_on);
  feeder.decided();
  CHECK(feeder.look().estops_pressed == 0);
}

TEST_CASE("lines that cannot be read or driven are one image that says so", "[unit][gpio][FS_7]") {
  FakeChip chip;
  GpioLines lines(stop_and_key(), chip);
  LineFeeder feeder(lines);
  CHECK(feeder.look().is_failed);  // not opened yet
  CHECK_FALSE(feeder.drive({}));   // look() has already reported it
  REQUIRE(lines.open());
  feeder.decided();
  CHECK_FALSE(feeder.look().is_failed);
  REQUIRE_FALSE(feeder.drive({}));
  chip.fail_call(0, EIO);
  const auto failed = feeder.drive({.fan = true});
  REQUIRE(failed);
  CHECK(failed->is_failed);
  REQUIRE(lines.open());
  CHECK(feeder.look().is_failed);  // until the next decision
  feeder.decided();
  CHECK_FALSE(feeder.look().is_failed);
}

TEST_CASE("a contact is closed if the unit or its line says so", "[unit][gpio][FS_7]") {
  CoreConfig config;
  config.lines = {.are_used = true, .feedback = 0b0001};  // main positive alone
  for (const bool unit_says : {false, true}) {
    for (const bool line_says : {false, true}) {
      CAPTURE(unit_says, line_says);
      const LineImage image{.closed_contacts = static_cast<std::uint8_t>(line_says ? 0b1111 : 0)};
      const PduState state =
          merged({.main_positive_closed = unit_says, .main_negative_closed = unit_says}, image, config);
      CHECK(state.main_positive_closed == (unit_says || line_says));
      CHECK(state.main_negative_closed == unit_says);  // no line for it
    }
  }
  config.contactors.has_pdu = false;
  CHECK_FALSE(merged({.main_positive_closed = true}, {}, config).main_positive_closed);
  CHECK(merged({}, {.closed_contacts = 0b0001}, config).main_positive_closed);
}

}  // namespace bmu
