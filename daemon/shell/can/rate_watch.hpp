// Monitors the bit rate of the internal bus: checked whenever the port has found another one, logged once each time.
#pragma once

#include <string>
#include <string_view>

#include "config/checks/bus_rate.hpp"
#include "daemon/core/records/event.hpp"
#include "daemon/shell/can/bus_port.hpp"

namespace bmu {

class RateWatch {
 public:
  /// `pack` must outlive it; its `buses` are those in use. `file_name` is the pack file's, for the log.
  RateWatch(const PackConfig& pack, std::string_view file_name)
      : pack_(pack), file_name_(file_name), finding_(judge_rate(pack, file_name, 0)) {}

  /// True: finding() has changed and has to be logged. Cheap while nothing changes: call it after maintain().
  [[nodiscard]] bool update(const BusPort& internal);
  [[nodiscard]] const RateFinding& finding() const { return finding_; }
  /// Severity of the finding. At the start a rate that fits is a warning, because the file may be wrong; one with which
  /// an interface returns was not intended. A rate that is too slow refuses the start.
  [[nodiscard]] Severity severity(bool is_start) const;

 private:
  const PackConfig& pack_;
  std::string file_name_;
  RateFinding finding_;
};

}  // namespace bmu
