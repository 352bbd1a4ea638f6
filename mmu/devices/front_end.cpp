#include "mmu/devices/front_end.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "mmu/devices/pec15.hpp"

namespace bmu {

namespace {

constexpr std::uint16_t no_conversion = 0xFFFF;
constexpr std::uint16_t self_test_passed = 0x9555;
constexpr std::uint16_t no_status = 0xFFFF;  // of a chip that does not report its own faults
constexpr std::uint16_t supply_low_bit = 0x0001;
constexpr std::uint16_t thermal_shutdown_bit = 0x0002;
constexpr std::int32_t cell_step_uV = 100;
constexpr std::int32_t stack_step_mV = 2;
constexpr std::uint16_t reference_raw = 30'000;  // 3 V in steps of 100 uV
constexpr std::size_t words_per_group = 3;
constexpr std::size_t data_bytes = 2 * words_per_group;

using Words = std::array<std::uint16_t, words_per_group>;

constexpr std::size_t index_of(RegisterGroup group) {
  return static_cast<std::size_t>(group);
}

constexpr std::uint16_t pec_of(const GroupBytes& bytes) {
  return pec15(std::span(bytes).first(data_bytes));
}

constexpr GroupBytes packed(const Words& words) {
  GroupBytes bytes{};
  for (std::size_t word = 0; word < words_per_group; ++word) {
    bytes[2 * word] = static_cast<std::uint8_t>(words[word] & 0xFFU);
    bytes[2 * word + 1] = static_cast<std::uint8_t>(words[word] >> 8U);
  }
  const std::uint16_t code = pec_of(bytes);
  bytes[data_bytes] = static_cast<std::uint8_t>(code >> 8U);
  bytes[data_bytes + 1] = static_cast<std::uint8_t>(code & 0xFFU);
  return bytes;
}

constexpr std::optional<Words> unpacked(const GroupBytes& bytes) {
  const auto code = static_cast<std::uint16_t>((bytes[data_bytes] << 8U) | bytes[data_bytes + 1]);
  if (code != pec_of(bytes)) return std::nullopt;
  Words words{};
  for (std::size_t word = 0; word < words_per_group; ++word) {
    words[word] = static_cast<std::uint16_t>(bytes[2 * word] | (bytes[2 * word + 1] << 8U));
  }
  return words;
}
static_assert(unpacked(packed({1, 0x1234, 0xFFFF})) == Words{1, 0x1234, 0xFFFF});

/// FFFF is reserved for "no conversion".
constexpr std::uint16_t word_of(std::int64_t value, std::int32_t step) {
  const std::int64_t steps = divide_to_nearest(value, step);
  return static_cast<std::uint16_t>(std::clamp<std::int64_t>(steps, 0, no_conversion - 1));
}

// --- the chip -------------------------------------------------------------------------------------------------------

GroupBytes cells_group(const FrontEndInputs& inputs, std::size_t first) {
  Words words{};
  for (std::size_t word = 0; word < words_per_group; ++word) {
    const std::size_t cell = first + word;
    const bool is_converted = has_cell(inputs.converted_cells, cell);
    words[word] = is_converted ? word_of(inputs.cell_voltage_uV[cell], cell_step_uV) : no_conversion;
  }
  return packed(words);
}

std::uint16_t status_word(const FrontEndInputs& inputs) {
  if (!inputs.reports_faults) return no_status;
  return static_cast<std::uint16_t>((inputs.supply_low ? supply_low_bit : 0U) |
                                    (inputs.thermal_shutdown ? thermal_shutdown_bit : 0U));
}

std::uint16_t sensor_word(double resistance_Ohm) {
  const double share = std::isinf(resistance_Ohm) ? 1.0 : divider_share(resistance_Ohm);
  return static_cast<std::uint16_t>(std::lround(share * reference_raw));
}

void put_sensors(FrontEndTransfer& transfer, RegisterGroup first, const std::array<double, 4>& sensor_Ohm) {
  GroupBytes* const groups = &transfer.groups[index_of(first)];
  groups[0] = packed({sensor_word(sensor_Ohm[0]), sensor_word(sensor_Ohm[1]), sensor_word(sensor_Ohm[2])});
  groups[1] = packed({sensor_word(sensor_Ohm[3]), reference_raw, no_conversion});
}

// --- the module ------------------------------------------------------------------------------------------------------

void take_cells(const Words& words, std::size_t first, FrontEndReading& reading) {
  for (std::size_t word = 0; word < words_per_group; ++word) {
    const CellMask cell = cell_bit(first + word);
    reading.arrived_cells = static_cast<CellMask>(reading.arrived_cells | cell);
    if (words[word] == no_conversion) continue;
    reading.converted_cells = static_cast<CellMask>(reading.converted_cells | cell);
    reading.cell_voltage_uV[first + word] = words[word] * cell_step_uV;
  }
}

DiagnosisReading diagnosis_of(const Words& words) {
  DiagnosisReading diagnosis{.open_wires = words[0], .self_test_ok = words[1] == self_test_passed};
  if (words[2] == no_status) return diagnosis;
  diagnosis.faults = ChipFaults{.supply_low = (words[2] & supply_low_bit) != 0,
                                .thermal_shutdown = (words[2] & thermal_shutdown_bit) != 0};
  return diagnosis;
}

std::optional<ThermistorReadings> sensors_of(const std::optional<Words>& one, const std::optional<Words>& other) {
  if (!one || !other) return std::nullopt;
  return ThermistorReadings{.input = {(*one)[0], (*one)[1], (*one)[2], (*other)[0]}, .reference = (*other)[1]};
}

}  // namespace

FrontEndTransfer convert(const FrontEndInputs& inputs, TransferWanted wanted) {
  FrontEndTransfer transfer{.contents = wanted};
  if (wanted == TransferWanted::nothing) return transfer;
  for (std::size_t group = index_of(RegisterGroup::cells_1); group <= index_of(RegisterGroup::cells_4); ++group) {
    transfer.groups[group] = cells_group(inputs, group * words_per_group);
  }
  transfer.groups[index_of(RegisterGroup::supplies)] =
      packed({word_of(inputs.module_mV, stack_step_mV), word_of(inputs.external_supply_mV, 1), no_conversion});
  const auto self_test = static_cast<std::uint16_t>(inputs.self_test_ok ? self_test_passed : ~self_test_passed);
  transfer.groups[index_of(RegisterGroup::diagnosis)] = packed({inputs.open_wires, self_test, status_word(inputs)});
  if (wanted == TransferWanted::everything) {
    put_sensors(transfer, RegisterGroup::cell_sensors_1, inputs.cell_sensor_Ohm);
    put_sensors(transfer, RegisterGroup::board_sensors_1, inputs.board_sensor_Ohm);
  }
  return transfer;
}

/// The wrong bits are drawn without replacement: the n-th of those that are still right.
void damage(GroupBytes& group, unsigned bits, RandomSource& random) {
  constexpr unsigned bits_in_group = 64;
  std::uint64_t wrong = 0;
  for (unsigned done = 0; done < std::min(bits, bits_in_group); ++done) {
    std::uint64_t skip = random.next() % (bits_in_group - done);
    unsigned bit = 0;
    while (((wrong >> bit) & 1U) != 0 || skip-- > 0) ++bit;
    wrong |= std::uint64_t{1} << bit;
  }
  for (std::size_t byte = 0; byte < group.size(); ++byte) {
    group[byte] = static_cast<std::uint8_t>(group[byte] ^ ((wrong >> (8 * byte)) & 0xFFU));
  }
}

FrontEndReading read(const FrontEndTransfer& transfer) {
  FrontEndReading reading;
  const std::size_t groups = groups_in(transfer.contents);
  std::array<std::optional<Words>, register_group_count> words;
  for (std::size_t group = 0; group < groups; ++group) {
    words[group] = unpacked(transfer.groups[group]);
    if (!words[group]) ++reading.damaged_groups;
  }
  for (std::size_t group = index_of(RegisterGroup::cells_1); group <= index_of(RegisterGroup::cells_4); ++group) {
    if (words[group]) take_cells(*words[group], group * words_per_group, reading);
  }
  if (const auto& supplies = words[index_of(RegisterGroup::supplies)]) {
    reading.supplies = {.module_mV = (*supplies)[0] * stack_step_mV, .external_mV = (*supplies)[1]};
  }
  if (const auto& diagnosis = words[index_of(RegisterGroup::diagnosis)]) {
    reading.diagnosis = diagnosis_of(*diagnosis);
  }
  reading.cell_sensors =
      sensors_of(words[index_of(RegisterGroup::cell_sensors_1)], words[index_of(RegisterGroup::cell_sensors_2)]);
  reading.board_sensors =
      sensors_of(words[index_of(RegisterGroup::board_sensors_1)], words[index_of(RegisterGroup::board_sensors_2)]);
  return reading;
}

}  // namespace bmu
