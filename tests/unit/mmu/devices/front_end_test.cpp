// Register groups of the front end: round trip, and rejection of damaged groups.
#include "mmu/devices/front_end.hpp"

#include <bit>
#include <limits>

#include "mmu/devices/pec15.hpp"
#include "tests/support/catch.hpp"

namespace bmu {
namespace {

constexpr std::uint64_t seed = 7;

FrontEndInputs some_inputs() {
  FrontEndInputs inputs;
  for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
    inputs.cell_voltage_uV[cell] = 3'600'000 + static_cast<std::int32_t>(cell) * 1'100;
  }
  inputs.module_mV = 43'272;
  inputs.external_supply_mV = 11'987;
  inputs.open_wires = cell_bit(11);
  inputs.cell_sensor_Ohm = {10e3, 5e3, std::numeric_limits<double>::infinity(), 0.0};
  inputs.board_sensor_Ohm.fill(20e3);
  return inputs;
}

/// PEC bit by bit, as the data sheet describes it: an independent way to the same code.
std::uint16_t pec_by_bits(std::span<const std::uint8_t> bytes) {
  unsigned remainder = 16;
  for (const std::uint8_t byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) {
      const unsigned top = (remainder >> 14U) & 1U;
      remainder = (remainder << 1U) & 0x7FFFU;
      if ((((byte >> bit) & 1) != 0) != (top != 0)) remainder ^= 0x4599U;
    }
  }
  return static_cast<std::uint16_t>(remainder << 1U);
}

TEST_CASE("the error code is that of the data sheet, by table and bit by bit", "[unit][mmu][MMU_PEC]") {
  RandomSource random(seed);
  for (int trial = 0; trial < 1'000; ++trial) {
    std::array<std::uint8_t, 6> bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.next());
    CHECK(pec15(bytes) == pec_by_bits(bytes));
    CHECK((pec15(bytes) & 1U) == 0);
  }
}

TEST_CASE("a transfer carries what lies at the inputs", "[unit][mmu][MMU_1][MMU_4][MMU_16]") {
  const FrontEndInputs inputs = some_inputs();
  const FrontEndReading reading = read(convert(inputs, TransferWanted::everything));
  CHECK(reading.damaged_groups == 0);
  CHECK(reading.arrived_cells == first_cells(12));
  CHECK(reading.converted_cells == first_cells(12));
  CHECK(reading.cell_voltage_uV == inputs.cell_voltage_uV);
  REQUIRE(reading.supplies.has_value());
  CHECK(reading.supplies->module_mV == 43'272);
  CHECK(reading.supplies->external_mV == 11'987);
  REQUIRE(reading.diagnosis.has_value());
  CHECK(reading.diagnosis->open_wires == cell_bit(11));
  CHECK(reading.diagnosis->self_test_ok);
  REQUIRE(reading.cell_sensors.has_value());
  CHECK(reading.cell_sensors->input == std::array<std::uint16_t, 4>{15'000, 10'000, 30'000, 0});
  CHECK(reading.cell_sensors->reference == 30'000);
  REQUIRE(reading.board_sensors.has_value());
  CHECK(reading.board_sensors->input[3] == 20'000);
}

TEST_CASE("a transfer carries what the chip reports of itself, or that it reports nothing", "[unit][mmu][RR_7]") {
  for (const bool supply_low : {false, true}) {
    for (const bool thermal_shutdown : {false, true}) {
      FrontEndInputs inputs = some_inputs();
      inputs.supply_low = supply_low;
      inputs.thermal_shutdown = thermal_shutdown;
      const FrontEndReading reading = read(convert(inputs, TransferWanted::voltages));
      REQUIRE(reading.diagnosis.has_value());
      REQUIRE(reading.diagnosis->faults.has_value());
      CHECK(reading.diagnosis->faults->supply_low == supply_low);
      CHECK(reading.diagnosis->faults->thermal_shutdown == thermal_shutdown);
      inputs.reports_faults = false;
      CHECK_FALSE(read(convert(inputs, TransferWanted::voltages)).diagnosis->faults.has_value());
    }
  }
}

TEST_CASE("voltages have steps of 0.1 mV and end where the register ends", "[unit][mmu]") {
  FrontEndInputs inputs;
  inputs.cell_voltage_uV = {3'600'049, 3'600'050, -20'000, 6'553'400, 9'000'000, 0};
  const FrontEndReading reading = read(convert(inputs, TransferWanted::voltages));
  CHECK(reading.cell_voltage_uV[0] == 3'600'000);
  CHECK(reading.cell_voltage_uV[1] == 3'600'100);
  CHECK(reading.cell_voltage_uV[2] == 0);
  CHECK(reading.cell_voltage_uV[3] == 6'553'400);
  CHECK(reading.cell_voltage_uV[4] == 6'553'400);
  CHECK(reading.converted_cells == first_cells(12));
}

TEST_CASE("what was not converted has no voltage, and what was not asked for is not there", "[unit][mmu]") {
  FrontEndInputs inputs = some_inputs();
  inputs.converted_cells = static_cast<CellMask>(first_cells(12) & ~cell_bit(4));
  inputs.self_test_ok = false;
  const FrontEndReading reading = read(convert(inputs, TransferWanted::voltages));
  CHECK(reading.arrived_cells == first_cells(12));
  CHECK(reading.converted_cells == inputs.converted_cells);
  CHECK_FALSE(reading.diagnosis->self_test_ok);
  CHECK_FALSE(reading.cell_sensors.has_value());
  CHECK_FALSE(reading.board_sensors.has_value());
  CHECK(reading.damaged_groups == 0);
  CHECK(read(FrontEndTransfer{}).arrived_cells == 0);
}

TEST_CASE("every single wrong bit in every group costs that group and nothing else", "[unit][mmu][MMU_PEC]") {
  const FrontEndTransfer whole = convert(some_inputs(), TransferWanted::everything);
  for (std::size_t group = 0; group < register_group_count; ++group) {
    for (unsigned bit = 0; bit < 64; ++bit) {
      FrontEndTransfer transfer = whole;
      transfer.groups[group][bit / 8] = static_cast<std::uint8_t>(transfer.groups[group][bit / 8] ^ (1U << (bit % 8)));
      const FrontEndReading reading = read(transfer);
      INFO("group " << group << " bit " << bit);
      CHECK(reading.damaged_groups == 1);
      const CellMask lost_cells = group < 4 ? static_cast<CellMask>(0b111U << (3 * group)) : CellMask{0};
      CHECK(reading.arrived_cells == (first_cells(12) & ~lost_cells));
      CHECK(reading.converted_cells == reading.arrived_cells);
      CHECK(reading.supplies.has_value() == (group != 4));
      CHECK(reading.diagnosis.has_value() == (group != 5));
      CHECK(reading.cell_sensors.has_value() == (group != 6 && group != 7));
      CHECK(reading.board_sensors.has_value() == (group != 8 && group != 9));
    }
  }
}

TEST_CASE("up to five wrong bits are always found", "[unit][mmu][MMU_PEC]") {
  const FrontEndTransfer whole = convert(some_inputs(), TransferWanted::voltages);
  RandomSource random(seed);
  for (unsigned bits = 1; bits <= 5; ++bits) {
    for (int trial = 0; trial < 20'000; ++trial) {
      FrontEndTransfer transfer = whole;
      damage(transfer.groups[0], bits, random);
      if (read(transfer).damaged_groups != 1) FAIL("bits " << bits << " trial " << trial);
    }
  }
  SUCCEED("none of 100000 passed");
}

TEST_CASE("damage makes just so many bits wrong, each once", "[unit][mmu]") {
  RandomSource random(seed);
  for (unsigned bits = 0; bits <= 64; ++bits) {
    GroupBytes group{};
    damage(group, bits, random);
    int wrong = 0;
    for (const std::uint8_t byte : group) wrong += std::popcount(byte);
    CHECK(wrong == static_cast<int>(bits));
  }
  SECTION("in every place") {
    std::array<int, 64> hits{};
    for (int trial = 0; trial < 20'000; ++trial) {
      GroupBytes group{};
      damage(group, 1, random);
      for (unsigned bit = 0; bit < 64; ++bit) hits[bit] += (group[bit / 8] >> (bit % 8)) & 1;
    }
    for (const int count : hits) CHECK(count > 200);
  }
}

}  // namespace
}  // namespace bmu
