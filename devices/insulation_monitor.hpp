// What an insulation monitor tells over a bus, whatever language it speaks.
//
//   const InsulationDriver& driver = *find_device("iso165c")->insulation;
//   if (driver.take(frame, report) == MonitorWord::report) ...
//
// A report is taken as a whole. What follows from it is the core's (daemon/core/measurement/insulation_table.hpp).
// `report` looks from the other side, for emulated monitors; a test holds both against each other. Pure.
#pragma once

#include <cstdint>
#include <string_view>

#include "protocol/frame.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct MonitorReport {
  SignalValue resistance_Ohm;    // not known while it is none of now: tested, calibrated, outdated, switched off
  bool is_low = false;           // below its own threshold of an error
  bool is_warning = false;       // below that of its warning
  bool is_earth_lost = false;    // its own connection to the chassis
  bool is_faulty = false;        // itself, or two parts of it that do not hear each other
  bool is_off = false;           // it was told not to measure
  bool is_testing = false;       // itself, or is being calibrated
  bool is_test_pending = false;  // it has not tested itself yet since it was switched on

  friend constexpr bool operator==(const MonitorReport&, const MonitorReport&) = default;
};

enum class MonitorWord : std::uint8_t {
  none,     // not this monitor's
  refused,  // under its identifier, and of a wrong length or form: nothing was taken from it
  report,
};

struct InsulationDriver {
  std::string_view name;  // of the device
  Duration report_period{};
  MonitorWord (*take)(const CanFrame& frame, MonitorReport& report) = nullptr;
  CanFrame (*report)(const MonitorReport& report) = nullptr;
};

}  // namespace bmu
