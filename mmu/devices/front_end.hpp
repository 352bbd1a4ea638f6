// Measuring chip of a module, as the MMU reads it over a serial link: groups of six bytes followed by a 15-bit packet
// error code, in the manner of the LTC6811. The values at the chip's inputs are converted to bytes; the bytes can be
// damaged on their way; the MMU reads the groups that arrive undamaged.
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
// Words are low byte first, the code high byte first, as in that chip. A group with a wrong code is dropped completely.
// Pure, no heap; a transfer of all groups is 80 bytes and takes about a third of a microsecond to make and to read on a
// desktop core.
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

/// Scope of a transfer: temperatures change slowly and cost four groups.
enum class TransferWanted : std::uint8_t { nothing, voltages, everything };

/// Number of groups, from the first, in such a transfer.
[[nodiscard]] constexpr std::size_t groups_in(TransferWanted wanted) {
  constexpr std::size_t groups[] = {0, static_cast<std::size_t>(RegisterGroup::cell_sensors_1), register_group_count};
  return groups[static_cast<std::size_t>(wanted)];
}

/// Values at the chip's inputs. A value that does not fit a word is read as the nearest that does.
struct FrontEndInputs {
  CellVoltages cell_voltage_uV{};
  CellMask converted_cells = first_cells(mmu_cells_max);  // the others are not converted
  CellMask open_wires = 0;                                // found by the chip's own check; bit k: above cell k+1
  std::int32_t module_mV = 0;                             // over the whole stack, measured separately
  std::int32_t external_supply_mV = 12'000;
  bool self_test_ok = true;
  bool reports_faults = true;  // false: the next two are not in the transfer
  bool supply_low = false;
  bool thermal_shutdown = false;
  // Thermistors; infinite if the wire is off, 0 if it is shorted. Read only if everything is requested.
  std::array<double, mmu_cell_temperatures> cell_sensor_Ohm{};
  std::array<double, mmu_board_temperatures> board_sensor_Ohm{};
};

using GroupBytes = std::array<std::uint8_t, 8>;

struct FrontEndTransfer {
  TransferWanted contents = TransferWanted::nothing;
  std::array<GroupBytes, register_group_count> groups{};
};

/// Chip: converts its inputs to a transfer.
[[nodiscard]] FrontEndTransfer convert(const FrontEndInputs& inputs, TransferWanted wanted);

/// Link: inverts `bits` bits in one group, 1 to 64, at positions from `random`; each bit once.
void damage(GroupBytes& group, unsigned bits, RandomSource& random);

/// Raw readings of four thermistors and of their reference.
struct ThermistorReadings {
  std::array<std::uint16_t, 4> input{};
  std::uint16_t reference = 0;
};
struct SupplyReading {
  std::int32_t module_mV = 0;
  std::int32_t external_mV = 0;
};
/// Faults that the chip reports of itself.
struct ChipFaults {
  bool supply_low = false;
  bool thermal_shutdown = false;
};
struct DiagnosisReading {
  CellMask open_wires = 0;
  bool self_test_ok = true;
  std::optional<ChipFaults> faults;  // none: the chip does not report them
};

/// Content of the groups that arrived undamaged. Sensors need both of their groups.
struct FrontEndReading {
  CellVoltages cell_voltage_uV{};
  CellMask arrived_cells = 0;    // the group was undamaged
  CellMask converted_cells = 0;  // and holds a voltage
  std::optional<SupplyReading> supplies;
  std::optional<DiagnosisReading> diagnosis;
  std::optional<ThermistorReadings> cell_sensors;
  std::optional<ThermistorReadings> board_sensors;
  std::uint8_t damaged_groups = 0;
};

/// MMU: reads a transfer.
[[nodiscard]] FrontEndReading read(const FrontEndTransfer& transfer);

}  // namespace bmu
