// The charge itself: how much the chargers are asked for, and when it is over.
//
//   off        nobody asks to be charged
//   waiting    somebody does; the pack is not closed for it, may not be charged, or no charger talks
//   charging   as much as the limits allow, up by a ramp and down at once; near the top the highest cell is held at its
//              full voltage (constant current, then constant voltage, by the highest cell and not by the pack's sum)
//   balancing  the highest cell is full, others are not: nothing is asked for while what is too high is bled; then on,
//              or to the end if the highest cell still stands at the top
//   full       done: nothing more until the charger is unplugged, or the charge has fallen to `resume_below_permille`
//
// The top is reached when the highest cell stands within `top_band` of its full voltage and no more than the end
// current has been asked for, or has flowed, during `end_for`; or when it has been held there for `hold_max`. Whatever
// the cells' limits, temperatures, predicted voltages, faults or the user allow is in the limits that come in: this
// asks for less, never for more. An incomplete picture of the cells asks for nothing.
//
// A pause for balancing lasts until nothing has been bled for `idle_max` and the time balancing takes to compare cells,
// or until bleeding has brought the highest cell down by `resume_mV`. That is counted from where the cell stands when
// the pause is `rest_for` old: before that it sinks by its resistance, too, and a charge that goes on for that comes
// back at once. A pause in which nothing was bled shows that nothing can be, and is the last one.
//
// Near the top the current follows the highest cell in steps: by how far it is from full, over the resistance of a
// cell, a small part a second upwards and a larger one downwards. A charger that takes seconds to follow then does not
// make it swing.
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
  bool is_wanted = false;       // a charger is plugged in and asks
  bool is_connected = false;    // the way from it to the cells is closed
  bool may_charge = false;      // this tick's permission
  bool is_talking = false;      // a charger
  bool has_to_balance = false;  // some cell has or may have more than the others, and may be bled
  bool is_bleeding = false;     // balancing bleeds a cell, by the word of its module
  const PackState* pack = nullptr;
  const CurrentLimits* limits = nullptr;
  std::optional<std::int32_t> soc_permille{};
};

class ChargeControl {
 public:
  /// Below its full voltage the highest cell counts as at the top.
  static constexpr std::int32_t top_band_uV = 10'000;
  /// From here on the current follows the highest cell.
  static constexpr std::int32_t near_band_uV = 50'000;
  /// So long nothing is bled before balancing is given up, and settle_ms of balancing.
  static constexpr Duration idle_max = 5min;
  /// So old a pause is when what the current has done to the highest cell's voltage has gone.
  static constexpr Duration rest_for = 5min;
  /// What balancing at the top may take in all: cells that differ by more want another look than a charger's.
  static constexpr Duration balancing_max = 24h;
  /// So long the highest cell is held at the most: a cell that still takes its current then heats, and does not fill.
  static constexpr Duration hold_max = 4h;

  void init(const CoreConfig& config);
  /// Once a tick.
  void step(const ChargeInputs& in);
  void forget() { is_held_ = false; }

  [[nodiscard]] ChargeStage stage() const { return stage_; }
  [[nodiscard]] TimePoint since() const { return since_; }
  /// Something is asked for.
  [[nodiscard]] bool is_enabled() const { return stage_ == ChargeStage::charging; }
  /// It goes on, or pauses while what is too high is bled: a charging post that would switch off for every pause wears
  /// out.
  [[nodiscard]] bool is_in_progress() const { return is_enabled() || stage_ == ChargeStage::balancing; }
  /// Of all chargers together; 0 unless enabled.
  [[nodiscard]] std::int32_t current_mA() const { return current_mA_; }
  /// The most that is ever asked of a charger.
  [[nodiscard]] std::int32_t voltage_mV() const { return voltage_mV_; }
  /// The highest cell's full voltage.
  [[nodiscard]] std::int32_t cell_full_uV() const { return config_.cell_full_uV; }
  /// The current follows the highest cell: constant voltage.
  [[nodiscard]] bool is_held() const { return is_held_ && is_enabled(); }
  /// Nothing more is to come, and the contactors may open.
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
  TimePoint sampled_at_{};      // of the highest cell, when the hold last followed it
  TimePoint held_since_{};      // zero: it is not
  TimePoint little_since_{};    // no more than the end current has been asked for, at the top; zero: more
  TimePoint idle_since_{};      // nothing is bled; zero: something is
  std::int32_t rested_uV_ = 0;  // the highest cell in a pause, once it has rested; 0: it has not
  bool has_bled_ = false;       // in this pause
  bool is_in_vain_ = false;     // nothing was, in a whole pause since the charger was plugged in
  Duration balanced_{};         // in all, since the charger was plugged in
  BMU_FIELDS(skipped(config_), skipped(idle_max_), skipped(cell_resistance_uOhm_), skipped(voltage_mV_), stage_, since_,
             is_full_, current_mA_, stepped_at_, is_held_, held_mA_, sampled_at_, held_since_, little_since_,
             idle_since_, rested_uV_, has_bled_, is_in_vain_, balanced_)
};

}  // namespace bmu
