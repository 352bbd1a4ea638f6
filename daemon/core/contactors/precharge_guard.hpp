// How often a precharge may be tried, and how warm the resistor may get.
//
// A precharge that was too slow is tried again after a cool-down, a few times, before it is a fault; one that was too
// fast or drew too much is a fault at once. Beside the count the heat in the resistor is kept, from the voltage across
// it: E = integral of (pack - link)^2 / R, against what it bears; it gives that much off in one cool-down. Nobody may
// begin a precharge that would, if it goes like the last one, be too much.
#pragma once

#include <cstdint>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// What outlives a process. Nobody knows how long it was away, so none of the heat counts as given off.
struct PrechargeMemory {
  std::int64_t heat_uJ = 0;
  std::int64_t last_try_uJ = 0;
  std::uint8_t tries_failed = 0;

  friend bool operator==(const PrechargeMemory&, const PrechargeMemory&) = default;
};

class PrechargeGuard {
 public:
  void init(const ContactorConfig& config);
  /// Behind init(). Tries of a former life count; its wish does not wait for the next one.
  void restore(const PrechargeMemory& memory);
  /// To be remembered now; while it precharges, as if that were a try that failed and took all the resistor bears.
  [[nodiscard]] PrechargeMemory memory(bool is_precharging) const;
  /// Once a tick, with the voltages if they are known: heats while the precharge contactor is commanded, cools always.
  void update(TimePoint now, bool is_precharging, bool is_measured, std::int32_t pack_mV, std::int32_t link_mV);
  /// A precharge ended. Returns the failure that is a fault now; none while there is another try.
  PrechargeFailure note_end(PrechargeFailure failure);
  /// Somebody has cleared the fault: the tries begin anew. The heat does not.
  void forget_tries();

  /// The resistor bears another try like the last one.
  [[nodiscard]] bool is_cool() const;
  /// More heat than the resistor bears, right now.
  [[nodiscard]] bool is_overheated() const { return heat_uJ_ > budget_uJ_; }
  /// Waiting for the next of several tries; the wish to close waits with it.
  [[nodiscard]] bool is_retrying() const { return is_retrying_; }
  [[nodiscard]] std::uint8_t tries_failed() const { return tries_failed_; }
  /// Nothing is left to give off.
  [[nodiscard]] bool is_cold() const { return heat_uJ_ == 0; }
  [[nodiscard]] std::int64_t heat_mJ() const { return heat_uJ_ / 1'000; }

 private:
  ContactorConfig config_;
  std::int64_t budget_uJ_ = 0;  // 0: not watched, and no heat is counted
  std::int64_t heat_uJ_ = 0;
  std::int64_t this_try_uJ_ = 0;
  std::int64_t last_try_uJ_ = 0;
  std::uint8_t tries_failed_ = 0;
  bool is_retrying_ = false;
  bool was_precharging_ = false;
  TimePoint updated_at_{};
  BMU_FIELDS(skipped(config_), skipped(budget_uJ_), heat_uJ_, this_try_uJ_, last_try_uJ_, tries_failed_, is_retrying_,
             was_precharging_, updated_at_)
};

}  // namespace bmu
