// A pack as its file describes it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/types/gpio_config.hpp"
#include "config/types/history_config.hpp"
#include "config/types/intake_air_config.hpp"
#include "config/types/interface_config.hpp"
#include "config/types/serial_config.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

struct BusNames {
  std::string internal;     // "can0", "unix:demo"
  std::string vehicle;      // may be the same
  std::string charger;      // may be one of these; the vehicle's unless the file names another
  std::string second_pack;  // likewise
  std::string inverter;     // likewise
  std::int32_t internal_kbit_per_s = 500;

  [[nodiscard]] const std::string& name(Port port) const;
  /// Names of a command line in place of the file's; an empty one is not given. A bus that is the file's internal or
  /// vehicle bus remains that one, under its new name.
  [[nodiscard]] BusNames with(const BusNames& given) const;
};

/// The texts that a pack was read from: with them it can be read again elsewhere, e.g. from a recording.
struct PackSources {
  std::string pack_name;  // of the file, for problems
  std::string pack_text;
  std::string cell_name;  // of the cell's file; empty: the pack's text has the cell itself
  std::string cell_text;

  friend bool operator==(const PackSources&, const PackSources&) = default;
};

struct PackConfig {
  std::string name;  // for display: status, log, live view
  std::string cell_name;
  BusNames buses;
  std::optional<GpioConfig> gpio;  // GPIO lines of this machine; without it all signals are on the bus
  InterfaceConfig interfaces;
  SerialConfig serial;
  IntakeAirKeys intake_air;
  HistoryConfig history;
  CoreConfig core;
  PollConfig poll_in_file;  // as `core.poll`, but 0 for a missing poll period
  PackSources sources;
};

}  // namespace bmu
