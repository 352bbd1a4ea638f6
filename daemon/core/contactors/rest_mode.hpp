// Sleep after an undervoltage: the pack has no charge left, not even for the modules that monitor it (BMS_F.9). Once it
// has been open and was not woken for `after`, its modules are put to sleep and only checked every `look_every`.
//
//   awake --undervoltage, open, no wake-up, for `after`--> resting --`look_every`--> looking --seen, or 2 s--> resting
//     ^                                                       |                        |
//     +------ resume button, charger, vehicle, command -------+------------------------+
//
// While resting nothing is polled or reported and the pack may not close; missing answers of the modules are no fault
// then. Looking is as awake, with the modules up, but for 2 s at most.
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
  bool is_undervoltage = false;  // an undervoltage fault is confirmed
  bool is_open = false;          // all contactors are commanded open
  bool has_complete_view = false;
  // Levels of the inputs. Button and vehicle wake by their rising edge, a charger by being connected.
  bool resume_button = false;
  bool charger_connected = false;
  bool vehicle_on = false;
};

class RestMode {
 public:
  void init(const RestConfig& config) { config_ = config; }
  /// Called once per tick. True if the phase changed.
  bool step(const RestInputs& in);
  /// Wakes by command of an operator, in the next step().
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
  TimePoint alone_since_{};  // zero: woken, not open, or no undervoltage
  bool is_wake_wanted_ = false;
  bool was_button_ = false;
  bool was_vehicle_ = false;
  BMU_FIELDS(skipped(config_), phase_, since_, alone_since_, is_wake_wanted_, was_button_, was_vehicle_)
};

}  // namespace bmu
