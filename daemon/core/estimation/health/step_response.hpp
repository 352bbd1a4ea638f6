// Response of the cells to a step of the current: their resistance, and whether the sign of the current is right.
//
// With SYNC all cells are sampled as the POLL arrives, so that a complete poll cycle is a sample set of one instant.
// Where the current was constant around two such instants and differs between them, dV/dI of a cell is its resistance
// (the 2013 method, BMS_F.6), averaged over steps. The current is that of the same instant, between the sensor's
// samples on either side of it: one that rises or falls slowly does not shift the resistance. And voltages that rise
// with the reported current out of the pack prove that the sensor counts the wrong way round, or is another one.
// Modules of another maker measure by themselves, some time before they are polled: the current must have been constant
// all that time. The sample that shows the current of an instant arrives after it, and the answers to the next POLL may
// arrive sooner: a poll cycle is kept until its sample has arrived, and cycles that are completed meanwhile are
// skipped.
//
// A current that rises or falls over seconds has no such step: CurrentRampMonitor handles it.
//
// Conversely, a frozen sensor is proved by cells and pack voltage that step and stay, within 600 ms, by an amount that
// only a step of the current can cause, while the reported current has been constant for three seconds. By then the
// polarisation of an earlier load moves a cell by a millivolt or two in that time; required are 10 mV, and the effect
// of a fifth of the continuous current on the model's resistance. Bleeding moves the cells of a module by the drop of
// its wires, which is no step of the pack, so the pack voltage must move, too. For the same reason a cell with a
// reported change of its balancing switch is not compared before its next sample set but one, and a poll cycle with
// such a change is neither used for the direction nor a reference for it.
//
// A step that is too small for a verdict, which would open a pack, may still indicate a likely cause: `latest_answer`
// is for the texts of faults.
//
// Cost: a comparison of two times a tick; two passes over the cells a poll cycle.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/core/estimation/health/current_ramp_monitor.hpp"
#include "daemon/core/estimation/health/step_average.hpp"
#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Kind of a current that the cells contradict.
enum class Contradiction : std::uint8_t {
  none,
  against,  // the voltages moved against it: a sensor with the wrong direction
  without,  // they moved, and it was constant: a sensor that repeats its value
};

/// Response of the cells to a step of the current.
enum class StepAnswer : std::uint8_t {
  none,
  with,     // their voltages moved in the expected direction
  against,  // they moved in the opposite direction
};

class StepResponse {
 public:
  void init(const CoreConfig& config);
  /// Once a tick: keeps the last complete poll cycle, if it is a new one and none is kept, and evaluates the kept one
  /// once the current after it is known.
  void update(const ModuleTable& modules, const SensorTable& sensors, const PackState& pack);
  /// Discards the sample sets: those before a gap are not compared with those after it. Resistances stay, as cells do
  /// not change that fast.
  void forget();
  /// Discards the measurements of a module that has other cells now.
  void forget_module(std::uint8_t node);

  /// Highest resistance of a cell in permille of the average; unknown until every cell has had enough steps.
  [[nodiscard]] const Reading& worst_cell_permille() const { return worst_cell_permille_; }
  /// Average resistance in permille of the cell model's at the cells' average temperature.
  [[nodiscard]] const Reading& average_permille() const { return average_permille_; }
  /// 1 while voltages move against the current, or without it; known only just after a step and while a change of the
  /// current is visible.
  [[nodiscard]] const Reading& contradiction() const { return contradiction_; }
  /// Kind of the latest contradiction, however long ago.
  [[nodiscard]] Contradiction latest_contradiction() const { return latest_contradiction_; }
  /// Response to the latest step of the current with an expected movement of 3 mV a cell or more, however long ago. It
  /// has no effect on decisions: one sample set is enough for it, also of a current that has just stepped.
  [[nodiscard]] StepAnswer latest_answer() const { return latest_answer_; }

  /// By number through the pack, from 0; 0 while unknown.
  [[nodiscard]] std::int32_t cell_resistance_uOhm(std::size_t cell) const;
  [[nodiscard]] std::int32_t average_uOhm() const { return average_uOhm_; }

 private:
  struct Picture {
    TimePoint taken_at{};
    bool is_steady = false;
    std::int32_t current_mA = 0;
    std::int64_t sum_uV = 0;
    Measured<std::int32_t> pack_mV{};
  };
  /// A complete poll cycle of which the current is not known yet.
  struct Cycle {
    TimePoint instant{};  // zero: none
    bool is_of_one_instant = false;
    std::int64_t sum_uV = 0;
    std::int32_t lowest_uV = 0;
    std::int32_t highest_uV = 0;
    Measured<std::int32_t> pack_mV{};
    std::array<std::int32_t, cells_max> cell_voltage_uV{};     // by number through the pack
    std::array<std::uint16_t, modules_max> balancing_cells{};  // bit by cell
  };
  struct Cell {
    std::int32_t voltage_uV = 0;  // in the last steady sample set
    StepAverage average;
    bool is_bleeding = false;        // as reported by its module with the last sample set
    bool has_just_switched = false;  // then: its sample may be from before or after
  };

  void keep_cycle(const ModuleTable& modules, const PackState& pack);
  void judge_cycle(const ModuleTable& modules, const SensorTable& sensors);
  bool take_switches();
  [[nodiscard]] std::int64_t model_at(const Spread& temperature_dC) const;
  [[nodiscard]] Picture picture_of(const SensorTable& sensors) const;
  void compare_cells(const ModuleTable& modules, const Picture& now);
  void judge_direction(const Picture& now);
  void note_answer(const Picture& now, const CurrentWindow& window);
  void judge_stillness(const Picture& now);
  void judge_ramp(const SensorTable& sensors, TimePoint before);
  void take_verdict(const Reading& verdict, Contradiction contradiction);
  void note_contradiction(Contradiction contradiction);
  [[nodiscard]] std::int64_t unseen_uV() const;
  void refresh(TimePoint at);

  std::size_t cell_count_ = 0;
  std::int64_t capacity_As_ = 0;
  double series_resistance_Ohm_ = 0.0;
  Duration sample_age_{};  // of modules of another maker: maximum age of a voltage
  double resistance_activation_K_ = 0.0;
  std::int64_t model_uOhm_ = 0;  // of a cell, immediate, at the pack's temperature; 0: unknown
  std::int64_t step_min_mA_ = 0;
  Cycle kept_;
  Picture last_steady_;
  std::array<Picture, 4> pictures_{};  // a ring, for the direction
  std::array<std::uint16_t, modules_max> bleeding_{};
  std::size_t head_ = 0;
  TimePoint taken_at_{};
  TimePoint still_since_{};  // of the current, as reported
  CurrentRampMonitor ramp_;
  Reading contradiction_;
  Contradiction latest_contradiction_ = Contradiction::none;
  StepAnswer latest_answer_ = StepAnswer::none;
  Reading worst_cell_permille_;
  Reading average_permille_;
  std::int32_t average_uOhm_ = 0;
  std::array<Cell, cells_max> cells_{};
  std::array<Element, cells_max> elements_{};
  [[nodiscard]] bool are_fields_possible() const { return head_ < pictures_.size(); }
  BMU_FIELDS(skipped(cell_count_), skipped(capacity_As_), skipped(series_resistance_Ohm_), skipped(sample_age_),
             skipped(resistance_activation_K_), model_uOhm_, skipped(step_min_mA_), kept_, last_steady_, pictures_,
             bleeding_, head_, taken_at_, still_since_, ramp_, contradiction_, latest_contradiction_, latest_answer_,
             worst_cell_permille_, average_permille_, average_uOhm_, cells_, skipped(elements_))
};

}  // namespace bmu
