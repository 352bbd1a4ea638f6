#include "daemon/shell/serial/history_log.hpp"

#include <array>
#include <cstdio>
#include <ctime>
#include <deque>
#include <filesystem>
#include <memory>
#include <utility>

#include "daemon/history/history_reader.hpp"

namespace bmu {

namespace {

/// Number of rows that are read at once: some 60 kB of text for 96 cells, and a few milliseconds.
constexpr std::size_t rows_at_once = 64;

template <class... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::string scaled(const HistoryNumber& value, double step, int digits, const char* unit = "") {
  return value ? formatted("%.*f%s", digits, static_cast<double>(*value) * step, unit) : "-";
}

std::string time_text(const HistoryNumber& unix_time_ms) {
  if (!unix_time_ms) return "- -";
  const auto seconds = static_cast<std::time_t>(*unix_time_ms / 1000);
  std::tm utc{};
  if (gmtime_r(&seconds, &utc) == nullptr) return "- -";
  std::array<char, 40> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &utc)};
}

/// Separated by commas; "-" if there are none.
template <class Values, class Text>
std::string list(const Values& values, const Text& text_of) {
  std::string text;
  for (const auto& value : values) text += (text.empty() ? "" : ",") + text_of(value);
  return text.empty() ? "-" : text;
}

/// Reads a history in pieces.
class Rows {
 public:
  explicit Rows(HistoryReader reader) : reader_(std::move(reader)) {}

  std::optional<std::string> next() {
    if (lines_.empty()) read();
    if (lines_.empty()) return std::nullopt;
    std::string line = std::move(lines_.front());
    lines_.pop_front();
    return line;
  }

 private:
  void read() {
    reader_.for_each_row_after(last_, [this](const HistoryRow& row) {
      last_ = row.sequence;
      lines_.push_back(log_line(row));
      return lines_.size() < rows_at_once;
    });
  }

  HistoryReader reader_;
  std::int64_t last_ = -1;
  std::deque<std::string> lines_;
};

}  // namespace

std::string log_line(const HistoryRow& row) {
  return time_text(row.unix_time_ms) + " I:" + scaled(row.current_average_mA, 1e-3, 3, "A") +
         " U:" + scaled(row.pack_voltage_average_mV, 1e-3, 2, "V") + " SOC:" + scaled(row.soc_permille, 0.1, 1, "%") +
         " SOH:" + scaled(row.health_by_capacity_permille, 0.1, 1, "%") +
         " C:" + list(row.cells, [](const HistoryCell& cell) { return scaled(cell.voltage_average_uV, 1e-6, 4); }) +
         " T:" +
         list(row.sensors, [](const HistorySensor& sensor) { return scaled(sensor.temperature_average_dC, 0.1, 1); }) +
         " E:" + (row.faults.empty() ? "-" : row.faults);
}

LogSource history_log(std::string path) {
  return [path = std::move(path)]() -> NextLogLine {
    std::error_code is_not_there;
    // A history that has not been created yet has no file, which is not an error.
    static_cast<void>(std::filesystem::file_size(path, is_not_there));
    if (is_not_there) return empty_log()();
    auto reader = HistoryReader::open(path, HistoryAccess::beside_writer);
    if (!reader) {
      return [error = reader.error()] { return Result<std::optional<std::string>, std::string>(failure(error)); };
    }
    auto rows = std::make_shared<Rows>(std::move(*reader));
    return [rows] { return Result<std::optional<std::string>, std::string>(rows->next()); };
  };
}

}  // namespace bmu
