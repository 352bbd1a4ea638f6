// The service mode of the serial console: once a second what was measured and estimated in that second, as the accept
// tests of a pack read it (BMS_NF.5b).
//
//   2026-03-01 17:01:07 I:21.350A U:189.55V SOC:80.0% SOH:98.2% C:3.9848,3.9851 T:25.1,25.0 E:- R:1.82,1.79
//
// As a line of LogReq (history_log.hpp) with the averages of the second, and behind it the resistance of each cell in
// milli-ohm as it is estimated at the end of the second. What is not known is "-".
//
// The control loop makes a second of it after its decisions (MinuteAverager) only while it is wanted, and copies it
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

/// Of fixed size: filling and copying it takes no memory.
struct ServiceSecond {
  Minute values;
  std::array<std::optional<std::int32_t>, cells_max> resistance_uOhm{};  // by number through the pack
};

[[nodiscard]] std::string service_line(const ServiceSecond& second, const HistoryLayout& layout);

class ServiceValues final : public CoreTap {
 public:
  static constexpr Duration period = 1s;

  /// Looks at the core for as long as decisions are forwarded to it.
  explicit ServiceValues(const Core& core);

  /// Of any thread. What was not taken before it is switched off is dropped.
  void set_wanted(bool is_wanted);
  /// The line of the latest second that has not been taken; nothing if there is none. Of one thread.
  [[nodiscard]] std::optional<std::string> take_line();

  void observed(const Observation& /*observation*/) override {}
  void decided(TimePoint at, const Decisions& decisions) override;

 private:
  void fill();

  const Core& core_;
  const HistoryLayout layout_;
  MinuteAverager averager_;
  bool has_begun_ = false;  // the second under way began while it was wanted
  std::atomic<bool> is_wanted_ = false;
  std::mutex mutex_;
  bool is_new_ = false;
  ServiceSecond latest_;
};

}  // namespace bmu
