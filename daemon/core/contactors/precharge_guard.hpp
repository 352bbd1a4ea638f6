// Limits for the number of precharge attempts and for the heat in the precharge resistor.
//
// A precharge that was too slow is attempted again after a cool-down, a few times (`precharge_tries`), before it is a
// fault; one that was too fast or drew too much current is a fault immediately. Beside the count the heat in the
// resistor is kept, from the voltage across it: E = integral of (pack - link)^2 / R, compared with its rated energy; it
// dissipates that much in one cool-down. No precharge may start that would exceed the rated energy if it takes as much
// as the last one.
#pragma once

#include <cstdint>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// State kept over a restart. The downtime is unknown, so none of the heat counts as dissipated.
struct PrechargeMemory {
  std::int64_t heat_uJ = 0;
  std::int64_t last_try_uJ = 0;
  std::uint8_t tries_failed = 0;

  friend bool operator==(const PrechargeMemory&, const PrechargeMemory&) = default;
};

class PrechargeGuard {
 public:
  void init(const ContactorConfig& config);
  /// Call after init(). Attempts of the previous session count; its close request does not wait for the next one.
  void restore(const PrechargeMemory& memory);
  /// State to be saved now; during a precharge, as if it were a failed attempt that used all the rated energy.
  [[nodiscard]] PrechargeMemory memory(bool is_precharging) const;
  /// Called once per tick, with the voltages if they are known: heats while the precharge contactor is commanded,
  /// always cools.
  void update(TimePoint now, bool is_precharging, bool is_measured, std::int32_t pack_mV, std::int32_t link_mV);
  /// Handles the end of a precharge. Returns the failure that is a fault now; none while another attempt follows.
  PrechargeFailure note_end(PrechargeFailure failure);
  /// Resets the attempts after the fault was cleared. The heat is kept.
  void forget_tries();

  /// The resistor can absorb another attempt like the last one.
  [[nodiscard]] bool is_cool() const;
  /// The heat exceeds the rated energy at present.
  [[nodiscard]] bool is_overheated() const { return heat_uJ_ > budget_uJ_; }
  /// Waiting for the next of several attempts; the close request waits as well.
  [[nodiscard]] bool is_retrying() const { return is_retrying_; }
  [[nodiscard]] std::uint8_t tries_failed() const { return tries_failed_; }
  /// No heat is left to dissipate.
  [[nodiscard]] bool is_cold() const { return heat_uJ_ == 0; }
  [[nodiscard]] std::int64_t heat_mJ() const { return heat_uJ_ / 1'000; }

 private:
  ContactorConfig config_;
  std::int64_t budget_uJ_ = 0;  // rated energy; 0: not monitored, and no heat is counted
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
