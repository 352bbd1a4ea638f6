// Control of a charge: the current requested from the chargers, and its end.
//
//   off        no charge is requested
//   waiting    one is requested; the pack is not closed for it, may not be charged, or no charger sends
//   charging   as much as the limits permit, up by a ramp and down at once; near the top the highest cell is held at
//              its full voltage (constant current, then constant voltage, by the highest cell and not by the pack's
//              sum)
//   balancing  the highest cell is full, others are not: no current is requested while the excess is bled; then the
//              charge continues, or ends if the highest cell is still at the top
//   full       done: no current until the charger is unplugged, or the SOC has fallen to `resume_below_permille`
//
// The top is reached when the highest cell is within `top_band` of its full voltage and no more than the end current
// has been requested, or has flowed, during `end_for`; or when it has been held for `hold_max`. The limits by cells,
// temperatures, predicted voltages, faults and the user are in the limits of the input: this requests less, never more.
// With incomplete voltages of the cells it requests nothing.
//
// A pause for balancing lasts until nothing has been bled for `idle_max` and the time balancing takes to compare cells,
// or until bleeding has brought the highest cell down by `resume_mV`. That is measured from its voltage when the pause
// is `rest_for` old: before that it also falls by its resistance, and a charge that continued for that reason would
// pause again at once. A pause in which nothing was bled shows that nothing can be, and is the last one.
//
// Near the top the current follows the highest cell in steps: its distance from full, divided by the resistance of a
// cell, a small part a second upwards and a larger one downwards. A charger that takes seconds to follow then does not
// make it oscillate.
//
// Cost: some comparisons a tick.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/limits/limits.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

enum class ChargeStage : std::uint8_t { off, waiting, charging, balancing, full };
inline constexpr std::size_t charge_stage_count = 5;

[[nodiscard]] std::string_view to_text(ChargeStage stage);

struct ChargeInputs {
  TimePoint now{};
  bool is_wanted = false;       // a charger is plugged in and requests a charge
  bool is_connected = false;    // the path from it to the cells is closed
  bool may_charge = false;      // permission of this tick
  bool is_talking = false;      // at least one charger is received
  bool has_to_balance = false;  // some cell has or may have an excess, and may be bled
  bool is_bleeding = false;     // balancing bleeds a cell, by the report of its module
  const PackState* pack = nullptr;
  const CurrentLimits* limits = nullptr;
  std::optional<std::int32_t> soc_permille{};
};

class ChargeControl {
 public:
  /// Distance below its full voltage within which the highest cell counts as at the top.
  static constexpr std::int32_t top_band_uV = 10'000;
  /// Distance below it within which the current follows the highest cell.
  static constexpr std::int32_t near_band_uV = 50'000;
  /// Time without bleeding until balancing is given up; settle_ms of balancing is added.
  static constexpr Duration idle_max = 5min;
  /// Age of a pause at which the effect of the current on the highest cell's voltage has decayed.
  static constexpr Duration rest_for = 5min;
  /// Maximum time of balancing at the top in all: cells that differ by more need an inspection, not a charger.
  static constexpr Duration balancing_max = 24h;
  /// Maximum time of constant voltage: a cell that still takes its current then heats, and does not fill.
  static constexpr Duration hold_max = 4h;

  void init(const CoreConfig& config);
  /// Once a tick.
  void step(const ChargeInputs& in);
  void forget() { is_held_ = false; }

  [[nodiscard]] ChargeStage stage() const { return stage_; }
  [[nodiscard]] TimePoint since() const { return since_; }
  /// True while a current is requested.
  [[nodiscard]] bool is_enabled() const { return stage_ == ChargeStage::charging; }
  /// True while it charges, or pauses to bleed the excess: a charging post that switched off for every pause would wear
  /// out.
  [[nodiscard]] bool is_in_progress() const { return is_enabled() || stage_ == ChargeStage::balancing; }
  /// Requested current of all chargers together; 0 unless enabled.
  [[nodiscard]] std::int32_t current_mA() const { return current_mA_; }
  /// Maximum voltage requested from a charger.
  [[nodiscard]] std::int32_t voltage_mV() const { return voltage_mV_; }
  /// The highest cell's full voltage.
  [[nodiscard]] std::int32_t cell_full_uV() const { return config_.cell_full_uV; }
  /// True while the current follows the highest cell: constant voltage.
  [[nodiscard]] bool is_held() const { return is_held_ && is_enabled(); }
  /// True if the charge is over, and the contactors may open.
  [[nodiscard]] bool is_done() const { return stage_ == ChargeStage::full && config_.opens_when_full; }

 private:
  [[nodiscard]] ChargeStage next_stage(const ChargeInputs& in);
  [[nodiscard]] ChargeStage after_balancing(const ChargeInputs& in);
  [[nodiscard]] bool has_reached_top(const ChargeInputs& in);
  void enter(ChargeStage stage, TimePoint now);
  void hold(const PackState& pack);
  [[nodiscard]] std::int32_t ramped(std::int32_t wanted_mA, TimePoint now) const;

  ChargerConfig config_;
  Duration idle_max_ = idle_max;
  std::int64_t cell_resistance_uOhm_ = 0;
  std::int32_t voltage_mV_ = 0;
  ChargeStage stage_ = ChargeStage::off;
  TimePoint since_{};
  bool is_full_ = false;
  std::int32_t current_mA_ = 0;
  TimePoint stepped_at_{};
  bool is_held_ = false;
  std::int32_t held_mA_ = 0;
  TimePoint sampled_at_{};      // of the highest cell, at the last update of the held current
  TimePoint held_since_{};      // zero: it is not held
  TimePoint little_since_{};    // no more than the end current requested, or flowing, at the top; zero: more
  TimePoint idle_since_{};      // nothing is bled; zero: a cell is
  std::int32_t rested_uV_ = 0;  // the highest cell in a pause, once relaxed; 0: not yet
  bool has_bled_ = false;       // in this pause
  bool is_in_vain_ = false;     // nothing was bled, in a whole pause since the charger was plugged in
  Duration balanced_{};         // in all, since the charger was plugged in
  BMU_FIELDS(skipped(config_), skipped(idle_max_), skipped(cell_resistance_uOhm_), skipped(voltage_mV_), stage_, since_,
             is_full_, current_mA_, stepped_at_, is_held_, held_mA_, sampled_at_, held_since_, little_since_,
             idle_since_, rested_uV_, has_bled_, is_in_vain_, balanced_)
};

}  // namespace bmu
