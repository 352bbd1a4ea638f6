#include "daemon/shell/serial/serial_commands.hpp"

#include <array>
#include <optional>
#include <string_view>

#include "protocol/number_text.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

constexpr std::string_view line_end = "\r\n";
constexpr std::size_t cell_count_max = std::size_t{internal_bus::node_count_max} * internal_bus::cells_per_module_max;

std::string line_of(std::string_view text) {
  return std::string(text).append(line_end);
}

/// A whole text that is a number of cells, with at most as many digits as the largest.
std::optional<std::size_t> cell_count_from(std::string_view text) {
  const auto count = text.size() <= 3 ? number_of_text<std::size_t>(text) : std::nullopt;
  return count && *count >= 1 && *count <= cell_count_max ? count : std::nullopt;
}

SerialReply set_cell_count(std::string_view argument, const SetCellCount& set) {
  const auto count = cell_count_from(argument);
  if (!count) {
    return {.text = line_of("Refused: found \"" + std::string(argument) + "\", expected a cell count from 1 to " +
                            std::to_string(cell_count_max) + ", e.g. CellC:06"),
            .is_order = true};
  }
  const auto done = set(*count);
  if (!done) return {.text = line_of("Refused: " + done.error()), .is_order = true};
  const std::string digits = std::to_string(*count);
  std::string text = line_of("New Cell Count:" + std::string(digits.size() < 2 ? "0" : "") + digits);
  if (!done->is_in_force) text += line_of("Effective after a restart of bmud.");
  return {.text = text, .is_order = true};
}

SerialReply dump_log(std::string_view /*argument*/, const SetCellCount& /*set*/) {
  return {.dumps_log = true, .is_order = true};
}

SerialReply set_service(std::string_view argument, const SetCellCount& /*set*/) {
  if (argument == "on") {
    return {.text = line_of("Service on: measured values once per second"), .service = true, .is_order = true};
  }
  if (argument == "off") return {.text = line_of("Service off"), .service = false, .is_order = true};
  return {.text = line_of("Refused: found \"" + std::string(argument) + "\", expected on or off, e.g. Service:on"),
          .is_order = true};
}

SerialReply help(std::string_view argument, const SetCellCount& set);

struct CommandRow {
  std::string_view name;  // with its colon, if it has an argument
  std::string_view help;
  SerialReply (*answer)(std::string_view argument, const SetCellCount& set);

  [[nodiscard]] bool matches(std::string_view line) const {
    return name.back() == ':' ? line.substr(0, name.size()) == name : line == name;
  }
};

constexpr std::array<CommandRow, 4> command_table{{
    {"CellC:", "CellC:xx  set the cell count, if the pack file allows it and the contactors are open", set_cell_count},
    {"LogReq", "LogReq    dump the log, oldest line first; send any line to stop", dump_log},
    {"Service:", "Service:on  measured values once per second, until Service:off", set_service},
    {"Help", "Help      list of commands", help},
}};

SerialReply help(std::string_view /*argument*/, const SetCellCount& /*set*/) {
  std::string text;
  for (const CommandRow& row : command_table) text += line_of(row.help);
  return {.text = text};
}

}  // namespace

SerialReply answer_serial(const SerialLine& line, const SetCellCount& set) {
  if (line.kind == SerialLine::Kind::too_long) {
    return {.text = line_of("Too long: a line has at most " + std::to_string(SerialLines::line_max) +
                            " characters (Help lists the commands)")};
  }
  if (line.kind == SerialLine::Kind::unprintable) {
    return {.text = line_of("Unreadable characters: check the baud rate (Help lists the commands)")};
  }
  for (const CommandRow& row : command_table) {
    if (row.matches(line.text)) return row.answer(std::string_view(line.text).substr(row.name.size()), set);
  }
  return {.text = line_of("Unknown command \"" + line.text + "\" (Help lists the commands)")};
}

}  // namespace bmu
