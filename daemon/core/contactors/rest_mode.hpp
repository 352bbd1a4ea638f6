// After an undervoltage the pack has nothing left to give away, not even to those who watch it (BMS_F.9): once it has
// been open and alone for a while its modules are sent to sleep, and only looked at now and then.
//
//   awake --undervoltage, open, nobody there, for `after`--> resting --`look_every`--> looking --seen, or 2 s-->
//   resting
//     ^                                                         |                        |
//     +------- resume button, charger, vehicle, command --------+------------------------+
//
// While resting nothing is polled or reported and nothing may close; silence of the modules is no fault then. Looking
// is as awake, with the modules up, but for a moment.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class RestPhase : std::uint8_t { awake, resting, looking };

[[nodiscard]] std::string_view to_text(RestPhase phase);

struct RestInputs {
  TimePoint now{};
  bool is_undervoltage = false;  // the fault is present
  bool is_open = false;          // everything commanded open
  bool has_complete_view = false;
  // Lines as they stand. Button and vehicle wake by their rising edge, a charger by being there.
  bool resume_button = false;
  bool charger_connected = false;
  bool vehicle_on = false;
};

class RestMode {
 public:
  void init(const RestConfig& config) { config_ = config; }
  /// One tick. True if the phase changed.
  bool step(const RestInputs& in);
  /// Somebody asks by command.
  void wake() { is_wake_wanted_ = true; }

  [[nodiscard]] RestPhase phase() const { return phase_; }
  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] bool is_resting() const { return phase_ == RestPhase::resting; }

 private:
  [[nodiscard]] RestPhase next(const RestInputs& in, bool is_woken) const;

  static constexpr Duration look_max = 2s;

  RestConfig config_;
  RestPhase phase_ = RestPhase::awake;
  TimePoint since_{};
  TimePoint alone_since_{};  // zero: not alone, or nothing to rest for
  bool is_wake_wanted_ = false;
  bool was_button_ = false;
  bool was_vehicle_ = false;
  BMU_FIELDS(skipped(config_), phase_, since_, alone_since_, is_wake_wanted_, was_button_, was_vehicle_)
};

}  // namespace bmu
