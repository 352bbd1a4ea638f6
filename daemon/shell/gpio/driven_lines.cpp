#include "daemon/shell/gpio/driven_lines.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/fields/pack_fields.hpp"
#include "daemon/shell/system/whole_file.hpp"

namespace bmu {

namespace {

using nlohmann::json;

json json_of(const GpioConfig& gpio) {
  json outputs = json::object();
  for (std::size_t i = 0; i < gpio_output_count; ++i) {
    const std::optional<GpioLine>& line = gpio.outputs.at(i);
    if (line) outputs[std::string(gpio_output_names.at(i))] = {{"line", line->line}, {"active_low", line->active_low}};
  }
  return {{"chip", gpio.chip}, {"outputs", outputs}};
}

bool is_line(const json& line) {
  return line.is_object() && line.contains("line") && line["line"].is_number_unsigned() &&
         line["line"] <= std::numeric_limits<std::uint32_t>::max() && line.contains("active_low") &&
         line["active_low"].is_boolean();
}

bool is_record(const json& record) {
  return record.is_object() && record.contains("chip") && record["chip"].is_string() && record.contains("outputs") &&
         record["outputs"].is_object();
}

/// A name with a NUL would open another chip than it shows.
bool is_chip(std::string_view chip) {
  return chip.starts_with("/dev/") && is_printable_ascii(chip);
}

/// Two outputs on one line: it is unknown which of them is open.
bool has_line_twice(const GpioConfig& gpio) {
  std::vector<std::uint32_t> lines;
  for (const std::optional<GpioLine>& line : gpio.outputs) {
    if (line) lines.push_back(line->line);
  }
  std::sort(lines.begin(), lines.end());
  return std::adjacent_find(lines.begin(), lines.end()) != lines.end();
}

/// An unknown output makes the record invalid, because it could not be opened.
std::optional<GpioConfig> gpio_of(const json& record) {
  if (!is_record(record)) return std::nullopt;
  GpioConfig gpio;
  gpio.chip = record["chip"].get<std::string>();
  std::size_t known = 0;
  for (std::size_t i = 0; i < gpio_output_count; ++i) {
    const auto found = record["outputs"].find(gpio_output_names.at(i));
    if (found == record["outputs"].end()) continue;
    if (!is_line(*found)) return std::nullopt;
    gpio.outputs.at(i) = {.line = (*found)["line"].get<std::uint32_t>(), .active_low = (*found)["active_low"]};
    ++known;
  }
  if (known != record["outputs"].size() || has_line_twice(gpio)) return std::nullopt;
  return known == 0 || is_chip(gpio.chip) ? std::optional(gpio) : std::nullopt;
}

}  // namespace

std::string driven_lines_text(const std::optional<GpioConfig>& gpio) {
  return json_of(gpio.value_or(GpioConfig{})).dump() + "\n";
}

std::optional<GpioConfig> parse_driven_lines(std::string_view text) {
  return gpio_of(json::parse(text, nullptr, false));
}

Result<void, OsError> write_driven_lines(const std::string& path, const std::optional<GpioConfig>& gpio) {
  if (path.empty()) return {};
  std::error_code error;
  std::filesystem::remove(path, error);
  if (error) return failure(OsError{error.value(), "removing the old " + path});
  const auto written = write_whole_file(path, driven_lines_text(gpio));
  if (!written) return failure(OsError{0, "writing " + path + ": " + written.error()});
  return {};
}

Result<std::optional<GpioConfig>, OsError> read_driven_lines(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_type type = std::filesystem::status(path, error).type();
  if (type == std::filesystem::file_type::not_found) return std::optional<GpioConfig>{};
  // Opening a pipe would wait for a writer while contactors are closed.
  if (type != std::filesystem::file_type::regular) {
    return failure(OsError{error.value(), path + ": not a regular file"});
  }
  errno = 0;
  std::ifstream file(path);
  if (!file.is_open()) return failure(OsError{errno, "reading " + path});
  std::ostringstream text;
  text << file.rdbuf();  // empty if it cannot be read
  const std::optional<GpioConfig> gpio = parse_driven_lines(text.str());
  if (!gpio) {
    return failure(
        OsError{0, path + ": found no list of lines, expected {\"chip\": TEXT, \"outputs\": {NAME: {\"line\": " +
                       "NUMBER, \"active_low\": true or false}}}"});
  }
  return gpio;
}

}  // namespace bmu
