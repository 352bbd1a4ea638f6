// The service mode of the serial console: once a second the measured and estimated values of that second, as the
// acceptance tests of a pack read them (BMS_NF.5b).
//
//   2026-03-01 17:01:07 I:21.350A U:189.55V SOC:80.0% SOH:98.2% C:3.9848,3.9851 T:25.1,25.0 E:- R:1.82,1.79
//
// Like a line of LogReq (history_log.hpp) with the averages of the second, followed by the resistance of each cell in
// milli-ohm as estimated at the end of the second. An unknown value is "-".
//
// The control loop computes a second after its decisions (MinuteAverager) only while the mode is on, and copies it
// without waiting; the console's thread takes the latest.
#pragma once

#include <array>
#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/core/core_tap.hpp"
#include "daemon/history/history_row.hpp"
#include "daemon/history/minute_averager.hpp"

namespace bmu {

/// Of fixed size: filling and copying it allocates no memory.
struct ServiceSecond {
  Minute values;
  std::array<std::optional<std::int32_t>, cells_max> resistance_uOhm{};  // by number through the pack
};

[[nodiscard]] std::string service_line(const ServiceSecond& second, const HistoryLayout& layout);

class ServiceValues final : public CoreTap {
 public:
  static constexpr Duration period = 1s;

  /// Reads the core for as long as decisions are forwarded to this object.
  explicit ServiceValues(const Core& core);

  /// Callable from any thread. A line that was not taken before the mode is switched is dropped.
  void set_wanted(bool is_wanted);
  /// The line of the latest second that has not been taken; no value if there is none. For one thread only.
  [[nodiscard]] std::optional<std::string> take_line();

  void observed(const Observation& /*observation*/) override {}
  void decided(TimePoint at, const Decisions& decisions) override;

 private:
  void fill();

  const Core& core_;
  const HistoryLayout layout_;
  MinuteAverager averager_;
  bool has_begun_ = false;  // the present second started while the mode was on
  std::atomic<bool> is_wanted_ = false;
  std::mutex mutex_;
  bool is_new_ = false;
  ServiceSecond latest_;
};

}  // namespace bmu
