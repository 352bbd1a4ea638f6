// The measuring chip of a module, as its unit sees it over a serial line: groups of six bytes with a 15-bit packet
// error code behind them, in the manner of the LTC6811. What lies at the chip's inputs goes in, bytes come out; the
// bytes can be damaged on their way; the unit reads what arrived whole.
//
//   group              word 0          word 1           word 2
//   cells_1 .. 4       cell 3k-2       3k-1             3k           100 uV, FFFF = not converted
//   supplies           sum of cells    external supply  FFFF         2 mV, 1 mV
//   diagnosis          open wires      self-test        status       a bit a cell; 9555 = passed; see below
//   cell_sensors_1/2   sensors 1-3 / sensor 4, reference, FFFF       100 uV, the reference being 3 V
//   board_sensors_1/2  the same for the thermistors on the board
//
// Status is .0 undervoltage of the chip's own supply, .1 thermal shutdown; FFFF of a chip that does not report them.
//
// Words are low byte first, the code high byte first, as that chip has them. A group whose code does not fit is dropped
// whole and says nothing. Pure, no heap; a transfer of all groups is 80 bytes and costs about a third of a
// microsecond to make and to read on a desktop core.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "mmu/devices/random.hpp"
#include "mmu/devices/sampling.hpp"
#include "mmu/devices/thermistor.hpp"

namespace bmu {

inline constexpr std::size_t mmu_cell_temperatures = internal_bus::cell_temperatures_per_module_max;
inline constexpr std::size_t mmu_board_temperatures = internal_bus::board_temperatures_per_module;

enum class RegisterGroup : std::uint8_t {
  cells_1,
  cells_2,
  cells_3,
  cells_4,
  supplies,
  diagnosis,
  cell_sensors_1,
  cell_sensors_2,
  board_sensors_1,
  board_sensors_2,
};
inline constexpr std::size_t register_group_count = 10;

/// What a unit wants to read now: temperatures change slowly and cost four groups.
enum class TransferWanted : std::uint8_t { nothing, voltages, everything };

/// How many groups, from the first, such a transfer has.
[[nodiscard]] constexpr std::size_t groups_in(TransferWanted wanted) {
  constexpr std::size_t groups[] = {0, static_cast<std::size_t>(RegisterGroup::cell_sensors_1), register_group_count};
  return groups[static_cast<std::size_t>(wanted)];
}

/// What lies at the chip's inputs. What does not fit a word is read as the nearest that does.
struct FrontEndInputs {
  CellVoltages cell_voltage_uV{};
  CellMask converted_cells = first_cells(mmu_cells_max);  // of the others there is no conversion
  CellMask open_wires = 0;                                // found by the chip's own check; bit k: above cell k+1
  std::int32_t module_mV = 0;                             // over the whole stack, measured on its own
  std::int32_t external_supply_mV = 12'000;
  bool self_test_ok = true;
  bool reports_faults = true;  // without, the next two are not in the transfer
  bool supply_low = false;
  bool thermal_shutdown = false;
  // Thermistors; infinite where the wire is off, 0 where it is shorted. Looked at when everything is wanted.
  std::array<double, mmu_cell_temperatures> cell_sensor_Ohm{};
  std::array<double, mmu_board_temperatures> board_sensor_Ohm{};
};

using GroupBytes = std::array<std::uint8_t, 8>;

struct FrontEndTransfer {
  TransferWanted contents = TransferWanted::nothing;
  std::array<GroupBytes, register_group_count> groups{};
};

/// The chip's side: converts its inputs and puts them on the line.
[[nodiscard]] FrontEndTransfer convert(const FrontEndInputs& inputs, TransferWanted wanted);

/// The line's side: `bits` wrong bits in one group, at places from `random`, 1 to 64; each bit once.
void damage(GroupBytes& group, unsigned bits, RandomSource& random);

/// Raw readings of four thermistors and of the reference they hang on.
struct ThermistorReadings {
  std::array<std::uint16_t, 4> input{};
  std::uint16_t reference = 0;
};
struct SupplyReading {
  std::int32_t module_mV = 0;
  std::int32_t external_mV = 0;
};
/// What the chip reports of itself.
struct ChipFaults {
  bool supply_low = false;
  bool thermal_shutdown = false;
};
struct DiagnosisReading {
  CellMask open_wires = 0;
  bool self_test_ok = true;
  std::optional<ChipFaults> faults;  // none: the chip does not report them
};

/// What arrived whole. Sensors need both of their groups.
struct FrontEndReading {
  CellVoltages cell_voltage_uV{};
  CellMask arrived_cells = 0;    // the group was whole
  CellMask converted_cells = 0;  // and holds a voltage
  std::optional<SupplyReading> supplies;
  std::optional<DiagnosisReading> diagnosis;
  std::optional<ThermistorReadings> cell_sensors;
  std::optional<ThermistorReadings> board_sensors;
  std::uint8_t damaged_groups = 0;
};

/// The unit's side.
[[nodiscard]] FrontEndReading read(const FrontEndTransfer& transfer);

}  // namespace bmu
