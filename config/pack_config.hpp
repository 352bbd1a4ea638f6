// A pack is one JSON file. Text goes in; a whole, valid configuration comes out, or every problem at once.
//
// Comments (// and /* */) may stand anywhere, a key nobody knows is a problem, and a key that is a quantity ends with
// its unit. A cell type is a file of its own (config/cells/), named relative to the pack file, or an object in place.
// docs/configuration.md lists every key with unit, range and default.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/types/gpio_config.hpp"
#include "config/types/history_config.hpp"
#include "config/types/intake_air_config.hpp"
#include "config/types/interface_config.hpp"
#include "config/types/serial_config.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/result.hpp"

namespace bmu {

struct BusNames {
  std::string internal;     // "can0", "unix:demo"
  std::string vehicle;      // may be the same
  std::string charger;      // may be one of these; the vehicle's unless the file says another
  std::string second_pack;  // likewise
  std::string inverter;     // likewise
  std::int32_t internal_kbit_per_s = 500;

  [[nodiscard]] const std::string& name(Port port) const;
  /// With names of a command line in place of the file's; an empty one was left out. A bus that is the file's internal
  /// or vehicle bus is that one still, whatever it is called now.
  [[nodiscard]] BusNames with(const BusNames& given) const;
};

/// The texts that a pack was read from: with them it can be read again elsewhere, as from a recording.
struct PackSources {
  std::string pack_name;  // of the file, for problems
  std::string pack_text;
  std::string cell_name;  // of the cell's file; empty: the pack's text has the cell itself
  std::string cell_text;

  friend bool operator==(const PackSources&, const PackSources&) = default;
};

struct PackConfig {
  std::string name;  // for people: status, log, picture
  std::string cell_name;
  BusNames buses;
  std::optional<GpioConfig> gpio;  // lines of this machine; without it all goes over the bus
  InterfaceConfig interfaces;
  SerialConfig serial;
  IntakeAirKeys intake_air;
  HistoryConfig history;
  CoreConfig core;
  PollConfig poll_in_file;  // as `core.poll`, but 0 where a pace was left out
  PackSources sources;
};

/// Where in a text, counted from 1; a column is a byte.
struct TextPosition {
  std::size_t line = 0;
  std::size_t column = 0;
};

/// One thing wrong with the file.
struct ConfigProblem {
  std::string file;
  std::string path;                  // JSON pointer, "/limits/cell_overvoltage/open_mV"; empty for the file itself
  std::string found;                 // "4300"
  std::string wanted;                // "at most 4250, the absolute maximum of the cell"
  std::optional<TextPosition> at{};  // only where the text is not JSON at all
};

/// "pack.json: /modules/2/node: found 1, wanted a node number no other module has"
/// "pack.json:14:24: found a syntax error ..., wanted JSON, comments allowed"
[[nodiscard]] std::string to_text(const ConfigProblem& problem);

using ConfigProblems = std::vector<ConfigProblem>;

/// Gives the buses other names than the file has, as the command line may: what is one bus follows from them.
void set_buses(PackConfig& pack, const BusNames& names);

/// Reads and checks a pack file and the cell file it names. Never throws; reports all problems, not the first.
[[nodiscard]] Result<PackConfig, ConfigProblems> load_pack_config(const std::filesystem::path& file);

/// The same from text; `directory` is where a cell file's name is relative to.
[[nodiscard]] Result<PackConfig, ConfigProblems> parse_pack_config(std::string_view text, std::string_view file_name,
                                                                   const std::filesystem::path& directory);

/// The same from texts alone: no file is looked at.
[[nodiscard]] Result<PackConfig, ConfigProblems> parse_pack_config(const PackSources& sources);

}  // namespace bmu
