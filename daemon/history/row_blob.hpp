// Encoding of the cells and sensors of a row as bytes, and the checksum of a row.
//
// Numbers are 16 bit, the high byte first, FFFFh if empty:
//
//   a cell, 16 bytes     voltage: average, lowest, highest, in 0.1 mV; samples; SOC; health by capacity and by
//                        resistance; bleeding time; each of the last four in permille
//   a sensor, 8 bytes    temperature: average, lowest, highest, in 0.1 degrees Celsius above -1000; samples
//
// A number that does not fit is empty, and FFFEh samples stand for that many or more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/history/history_row.hpp"

namespace bmu {

inline constexpr std::size_t cell_bytes = 16;
inline constexpr std::size_t sensor_bytes = 8;
inline constexpr std::int64_t cell_voltage_step_uV = 100;
inline constexpr std::int64_t temperature_offset_dC = 10'000;

[[nodiscard]] std::string blob_of(std::span<const HistoryCell> cells);
[[nodiscard]] std::string blob_of(std::span<const HistorySensor> sensors);
/// None if the size is not a whole number of records.
[[nodiscard]] std::optional<std::vector<HistoryCell>> cells_from(std::string_view blob);
[[nodiscard]] std::optional<std::vector<HistorySensor>> sensors_from(std::string_view blob);

/// CRC-32 over values in their order, each with its kind, so that no value can be taken for another.
class RowChecksum {
 public:
  void add(const HistoryNumber& number);
  void add(std::string_view bytes);
  [[nodiscard]] std::int64_t value() const { return static_cast<std::int64_t>(crc_); }

 private:
  void add_bytes(char kind, std::string_view bytes);

  unsigned long crc_ = 0;
};

/// Checksum over all that a database stores of the row except the checksum itself. Columns of a version are not
/// included if the row has none of them: a row of an older version keeps its checksum when the database is migrated to
/// a newer one.
[[nodiscard]] std::int64_t checksum_of(const HistoryRow& row, std::string_view cells, std::string_view sensors);
[[nodiscard]] std::int64_t checksum_of(const HistoryEvent& event);

}  // namespace bmu
