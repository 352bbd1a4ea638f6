// Tap of a core for its history: averages its values over minutes, passes on its events, and logs each change of the
// history's state once. Never waits.
#pragma once

#include <functional>
#include <string_view>

#include "daemon/core/core_tap.hpp"
#include "daemon/history/history_store.hpp"
#include "daemon/history/minute_averager.hpp"

namespace bmu {

class HistoryTap final : public CoreTap {
 public:
  using Log = std::function<void(Severity severity, std::string_view line)>;

  /// Precondition: core and store outlive it.
  HistoryTap(const Core& core, HistoryStore& store, Duration period, Log log);

  void observed(const Observation& /*observation*/) override {}
  void decided(TimePoint at, const Decisions& decisions) override;
  /// At the end: passes on the incomplete minute in progress.
  void finish();

 private:
  void tell_changes();

  const Core& core_;
  HistoryStore& store_;
  MinuteAverager averager_;
  Log log_;
  std::uint64_t events_ = 0;
  TimePoint decided_at_{};
  TimePoint told_at_{};
  HistoryState told_state_ = HistoryState::starting;
  std::string told_error_;
  std::string told_aside_;
};

}  // namespace bmu
