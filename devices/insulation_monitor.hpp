// Reports of an insulation monitor on a bus, independent of its protocol.
//
//   const InsulationDriver& driver = *find_device("iso165c")->insulation;
//   if (driver.take(frame, report) == MonitorWord::report) ...
//
// A report is read completely or not at all. The core evaluates it (daemon/core/measurement/insulation_table.hpp).
// `report` is the inverse function, for emulated monitors; a test checks both against each other. Pure.
#pragma once

#include <cstdint>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct MonitorReport {
  SignalValue resistance_Ohm;    // unknown while not current: during a test or calibration, outdated, switched off
  bool is_low = false;           // below the error threshold of the monitor
  bool is_warning = false;       // below its warning threshold
  bool is_earth_lost = false;    // the monitor's own connection to the chassis
  bool is_faulty = false;        // the monitor itself, or two parts of it that do not receive each other
  bool is_off = false;           // commanded not to measure
  bool is_testing = false;       // self-test or calibration in progress
  bool is_test_pending = false;  // no self-test yet since it was switched on

  friend constexpr bool operator==(const MonitorReport&, const MonitorReport&) = default;
};

enum class MonitorWord : std::uint8_t {
  none,     // not from this monitor
  refused,  // its identifier with a wrong length or frame type: nothing was read from it
  report,
};

struct InsulationDriver {
  std::string_view name;  // of the device
  Duration report_period{};
  MonitorWord (*take)(const CanFrame& frame, MonitorReport& report) = nullptr;
  CanFrame (*report)(const MonitorReport& report) = nullptr;
};

}  // namespace bmu
