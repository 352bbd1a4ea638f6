// Balancing: measures the cells, has a plan made, commands the modules, waits until it is over, and measures again.
//
//   idle        a condition inhibits it (balancing_conditions.hpp); whatever bleeds is stopped at once
//   measuring   every switch is off by its module's report, the current is steady (not required by the method charge),
//               and that for balancing/settle_ms; then the mean of ten complete poll cycles makes a plan. With nothing
//               to remove the state starts again
//   bleeding    each module with something to do was commanded its minutes, all its cells in one COMMAND; over when
//               every switch is off again, its time elapsed
//
// Minutes are sent in two COMMANDs: 0 for every cell, and after the response to that, the minutes. A module that starts
// only when a number changes may have kept the previous one, which is mostly the same, and is unknown after a start of
// the daemon. Each COMMAND is sent again after `balancing_retry` until its module responds, `balancing_tries` times:
// the same minutes sent again prolong nothing. A module that refuses or does not respond is omitted until the next
// plan. A switch that is on without a command is stopped repeatedly, in every state; one that does not follow the
// command is a fault (balancing_switches.hpp).
//
// Modules of another maker do not accept minutes: they are commanded a voltage, that of the lowest cell and a little
// more, and bleed cells above it by themselves (devices/module_driver.hpp). The target is commanded for
// `target_bleeding_max` at most, less if they have nothing more to bleed, since cells read low while they are bled;
// then the cells are measured again.
//
// Its counterpart in this system's modules is the protocol's operations 03 and 04. No allocation; about 45 kB.
// Cost: a check of each module a tick; a pass over the cells for each of the ten poll cycles.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/balancing/balancing_conditions.hpp"
#include "daemon/core/balancing/balancing_plan.hpp"
#include "daemon/core/balancing/polarisation.hpp"
#include "daemon/core/estimation/health/step_response.hpp"
#include "daemon/core/plausibility/balancing_switches.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

inline constexpr std::size_t balancing_orders_per_tick = 4;
inline constexpr Duration balancing_retry = 200ms;
inline constexpr std::uint8_t balancing_tries = 5;
/// Interval after which a stop without visible effect is sent again.
inline constexpr Duration stop_retry = 500ms;
/// Time for which modules with a target bleed before the next measurement; other systems give them a quarter of an
/// hour.
inline constexpr Duration target_bleeding_max = std::chrono::minutes{10};
/// Modules that have not started by then have nothing to bleed.
inline constexpr Duration target_patience = 30s;
/// Minimum distance of their target above the lowest cell: they report whole millivolts, and read the cells that they
/// bleed low.
inline constexpr std::int32_t target_band_min_uV = 10'000;
/// Number of poll cycles in the mean for a plan.
inline constexpr std::uint16_t balancing_samples = 10;

enum class BalancingState : std::uint8_t { idle, measuring, bleeding };
[[nodiscard]] std::string_view to_text(BalancingState state);

/// State of a module's command to bleed for its minutes.
enum class OrderStage : std::uint8_t { none, needed, asked, done, refused, unanswered };
[[nodiscard]] std::string_view to_text(OrderStage stage);

/// A COMMAND to be sent.
struct BalancingOrder {
  static constexpr std::size_t to_all = modules_max;
  std::size_t module_index = to_all;
  bool is_stop = true;
  BalancingMinutes minutes{};
};

/// The frame of an order; `node` 0 for all.
[[nodiscard]] CanFrame balancing_frame(const BalancingOrder& order, std::uint8_t node, std::uint8_t counter);

struct BalancingInputs {
  TimePoint now{};
  const ModuleTable* modules = nullptr;
  const PackState* pack = nullptr;
  const StepResponse* steps = nullptr;
  const CellChargeBook* charges = nullptr;
  BalancingBlockers blockers = 0;
};

struct BalancingStep {
  FixedVector<BalancingOrder, balancing_orders_per_tick> orders;
  bool has_begun = false;            // to bleed
  bool was_stopped = false;          // by a blocker, while bleeding
  std::uint8_t unanswered_node = 0;  // no response in all attempts, after a successful one or at first; one a tick
};

class BalancingControl {
 public:
  void init(const CoreConfig& config);
  /// After a stall of this process: no module counts as commanded, and measuring starts again.
  void forget(TimePoint now);
  /// Once a tick in which frames can be sent. Precondition: `switches` have been updated.
  [[nodiscard]] BalancingStep step(const BalancingInputs& in, BalancingSwitches& switches);
  /// Handles a RESPONSE to COMMAND 03; others are ignored. Returns the stage it led to.
  OrderStage observe_response(std::size_t module_index, const CanFrame& frame, TimePoint at,
                              BalancingSwitches& switches);

  [[nodiscard]] BalancingState state() const { return state_; }
  [[nodiscard]] TimePoint since() const { return since_; }
  [[nodiscard]] BalancingBlockers blockers() const { return blockers_; }
  /// Of the last measurement.
  [[nodiscard]] PlanVerdict verdict() const { return verdict_; }
  [[nodiscard]] TimePoint planned_at() const { return planned_at_; }
  [[nodiscard]] OrderStage stage(std::size_t module_index) const { return slots_[module_index].stage; }
  /// It has refused its minutes or not responded, and not followed a command since.
  [[nodiscard]] bool has_failed(std::size_t module_index) const { return slots_[module_index].has_failed; }
  /// Target for modules of another maker: cells above it are bled; nothing: no cell.
  [[nodiscard]] std::optional<std::int32_t> bleed_above_uV(const PackState& pack) const;
  /// Number of cells with minutes in the last plan.
  [[nodiscard]] std::uint16_t cells_told() const { return cells_told_; }
  /// Charge that the last plan removes from a cell and that it has not lost yet, by number through the pack, from 0.
  [[nodiscard]] std::int64_t to_go_uAs(std::size_t cell, const BalancingSwitches& switches) const;
  /// Minutes of a module in the last plan.
  [[nodiscard]] const BalancingMinutes& minutes(std::size_t module_index) const { return slots_[module_index].minutes; }

 private:
  struct Slot {
    OrderStage stage = OrderStage::none;
    BalancingMinutes minutes{};
    bool has_heard_zero = false;
    std::uint8_t tries = 0;
    bool has_failed = false;
    TimePoint asked_at{};
    TimePoint stopped_at{};
  };

  void enter(BalancingState state, TimePoint now);
  void begin_window(TimePoint now);
  void hold(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out);
  void measure(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out);
  [[nodiscard]] bool is_steady(std::int32_t current_mA);
  void add_sample(const BalancingInputs& in);
  void plan(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out);
  [[nodiscard]] std::uint16_t share_out(const ModuleTable& modules);
  void bleed(const BalancingInputs& in, const BalancingSwitches& switches, BalancingStep& out);
  void bleed_by_target(TimePoint now, BalancingSwitches& switches);
  void stop_unwanted(const BalancingInputs& in, BalancingSwitches& switches, BalancingStep& out);

  CoreConfig config_;
  std::size_t cell_count_ = 0;
  PolarisationBound polarisation_;
  BalancingState state_ = BalancingState::idle;
  TimePoint since_{};
  BalancingBlockers blockers_ = 0;
  PlanVerdict verdict_ = PlanVerdict::none;
  TimePoint planned_at_{};
  std::uint16_t cells_told_ = 0;
  std::array<Slot, modules_max> slots_{};

  // The present measuring window.
  TimePoint window_began_at_{};
  TimePoint sampled_at_{};
  std::uint16_t samples_ = 0;
  bool has_current_ = false;
  std::int32_t current_min_mA_ = 0;
  std::int32_t current_max_mA_ = 0;
  std::int64_t current_sum_mA_ = 0;
  std::array<std::int64_t, cells_max> voltage_sum_uV_{};

  std::array<BalancingCell, cells_max> cells_{};
  std::array<std::int64_t, cells_max> remove_uAs_{};
  std::array<std::int64_t, cells_max> bled_at_plan_uAs_{};
  BMU_FIELDS(skipped(config_), skipped(cell_count_), polarisation_, state_, since_, blockers_, verdict_, planned_at_,
             cells_told_, slots_, window_began_at_, sampled_at_, samples_, has_current_, current_min_mA_,
             current_max_mA_, current_sum_mA_, voltage_sum_uV_, cells_, remove_uAs_, bled_at_plan_uAs_)
};

}  // namespace bmu
