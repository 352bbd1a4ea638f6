#include "daemon/history/row_blob.hpp"

#include <algorithm>
#include <array>

#include <zlib.h>

#include "daemon/history/history_columns.hpp"
#include "daemon/history/history_schema.hpp"
#include "protocol/units.hpp"

namespace bmu {

namespace {

constexpr std::int64_t none = 0xFFFF;
constexpr std::int64_t most = 0xFFFE;

void put(std::string& to, std::int64_t value) {
  const std::int64_t kept = value < 0 || value > most ? none : value;
  to.push_back(static_cast<char>(kept >> 8));
  to.push_back(static_cast<char>(kept & 0xFF));
}
void put(std::string& to, const HistoryNumber& number) {
  put(to, number.value_or(none));
}
void put_voltage(std::string& to, const HistoryNumber& number_uV) {
  put(to, number_uV ? divide_to_nearest(*number_uV, cell_voltage_step_uV) : none);
}
void put_temperature(std::string& to, const HistoryNumber& number_dC) {
  put(to, number_dC ? *number_dC + temperature_offset_dC : none);
}
void put_count(std::string& to, std::int64_t count) {
  put(to, std::min(count, most));
}

/// Reads numbers from the front of bytes. Precondition: enough bytes remain.
class Numbers {
 public:
  explicit Numbers(std::string_view bytes) : bytes_(bytes) {}

  std::int64_t count() {
    const auto high = static_cast<unsigned char>(bytes_[0]);
    const auto low = static_cast<unsigned char>(bytes_[1]);
    bytes_.remove_prefix(2);
    return high << 8 | low;
  }
  HistoryNumber number() {
    const std::int64_t value = count();
    return value == none ? std::nullopt : HistoryNumber(value);
  }
  HistoryNumber voltage_uV() {
    const HistoryNumber value = number();
    return value ? HistoryNumber(*value * cell_voltage_step_uV) : std::nullopt;
  }
  HistoryNumber temperature_dC() {
    const HistoryNumber value = number();
    return value ? HistoryNumber(*value - temperature_offset_dC) : std::nullopt;
  }

 private:
  std::string_view bytes_;
};

template <class Row>
void add_columns(RowChecksum& checksum, std::span<const HistoryColumn<Row>> columns, const Row& row) {
  for (const HistoryColumn<Row>& column : columns) {
    if (column.number != nullptr) {
      checksum.add(row.*column.number);
    } else {
      checksum.add(row.*column.text);
    }
  }
}

/// All columns of a version are empty: the row was written by an earlier version.
bool lacks(const HistoryRow& row, std::span<const HistoryColumn<HistoryRow>> columns) {
  return std::all_of(columns.begin(), columns.end(), [&](const HistoryColumn<HistoryRow>& column) {
    return column.number != nullptr ? !(row.*column.number).has_value() : (row.*column.text).empty();
  });
}

}  // namespace

std::string blob_of(std::span<const HistoryCell> cells) {
  std::string blob;
  blob.reserve(cells.size() * cell_bytes);
  for (const HistoryCell& cell : cells) {
    put_voltage(blob, cell.voltage_average_uV);
    put_voltage(blob, cell.voltage_min_uV);
    put_voltage(blob, cell.voltage_max_uV);
    put_count(blob, cell.voltage_samples);
    put(blob, cell.soc_permille);
    put(blob, cell.health_by_capacity_permille);
    put(blob, cell.health_by_resistance_permille);
    put_count(blob, cell.bled_permille);
  }
  return blob;
}

std::string blob_of(std::span<const HistorySensor> sensors) {
  std::string blob;
  blob.reserve(sensors.size() * sensor_bytes);
  for (const HistorySensor& sensor : sensors) {
    put_temperature(blob, sensor.temperature_average_dC);
    put_temperature(blob, sensor.temperature_min_dC);
    put_temperature(blob, sensor.temperature_max_dC);
    put_count(blob, sensor.temperature_samples);
  }
  return blob;
}

std::optional<std::vector<HistoryCell>> cells_from(std::string_view blob) {
  if (blob.size() % cell_bytes != 0) return std::nullopt;
  std::vector<HistoryCell> cells;
  cells.reserve(blob.size() / cell_bytes);
  for (; !blob.empty(); blob.remove_prefix(cell_bytes)) {
    Numbers numbers(blob);
    HistoryCell& cell = cells.emplace_back();
    cell.voltage_average_uV = numbers.voltage_uV();
    cell.voltage_min_uV = numbers.voltage_uV();
    cell.voltage_max_uV = numbers.voltage_uV();
    cell.voltage_samples = numbers.count();
    cell.soc_permille = numbers.number();
    cell.health_by_capacity_permille = numbers.number();
    cell.health_by_resistance_permille = numbers.number();
    cell.bled_permille = numbers.count();
  }
  return cells;
}

std::optional<std::vector<HistorySensor>> sensors_from(std::string_view blob) {
  if (blob.size() % sensor_bytes != 0) return std::nullopt;
  std::vector<HistorySensor> sensors;
  sensors.reserve(blob.size() / sensor_bytes);
  for (; !blob.empty(); blob.remove_prefix(sensor_bytes)) {
    Numbers numbers(blob);
    HistorySensor& sensor = sensors.emplace_back();
    sensor.temperature_average_dC = numbers.temperature_dC();
    sensor.temperature_min_dC = numbers.temperature_dC();
    sensor.temperature_max_dC = numbers.temperature_dC();
    sensor.temperature_samples = numbers.count();
  }
  return sensors;
}

void RowChecksum::add(const HistoryNumber& number) {
  if (!number) return add_bytes('-', "");
  std::array<char, 8> bytes{};
  auto rest = static_cast<std::uint64_t>(*number);
  for (char& byte : bytes) {
    byte = static_cast<char>(rest & 0xFF);
    rest >>= 8;
  }
  add_bytes('n', {bytes.data(), bytes.size()});
}

void RowChecksum::add(std::string_view bytes) {
  add(HistoryNumber(static_cast<std::int64_t>(bytes.size())));
  add_bytes('t', bytes);
}

void RowChecksum::add_bytes(char kind, std::string_view bytes) {
  crc_ = ::crc32_z(crc_, reinterpret_cast<const Bytef*>(&kind), 1);
  crc_ = ::crc32_z(crc_, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

std::int64_t checksum_of(const HistoryRow& row, std::string_view cells, std::string_view sensors) {
  RowChecksum checksum;
  checksum.add(HistoryNumber(row.sequence));
  add_columns(checksum, row_columns_of(1), row);
  checksum.add(cells);
  checksum.add(sensors);
  for (std::int64_t version = 2; version <= history_version; ++version) {
    if (!lacks(row, row_columns_of(version))) add_columns(checksum, row_columns_of(version), row);
  }
  return checksum.value();
}

std::int64_t checksum_of(const HistoryEvent& event) {
  RowChecksum checksum;
  checksum.add(HistoryNumber(event.sequence));
  add_columns(checksum, event_columns(), event);
  return checksum.value();
}

}  // namespace bmu
