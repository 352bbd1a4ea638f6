// The state of charge of every cell and of the pack, from what the bus tells: all methods beside each other for each
// cell (cell_estimate.hpp), the pack's made of its cells' (pack_soc.hpp), and what is told of it, which never steps
// (published_soc.hpp).
//
// With SYNC all cells are sampled as the POLL arrives, so that a complete poll cycle is a picture of one instant; the
// current of that instant lies between the sensor's samples on either side of it. Each picture is one sample for every
// cell: what was counted since the one before, the current, voltage and temperature of the instant. Where no picture
// comes for a second, the cells are told of what flowed and that nothing was measured, and their doubt grows. While
// the contactors are open and the sensor is silent, `rest_current_mA` may flow; while they are closed, one hour's rate.
// What a cell's own resistor bleeds is counted with its current. Voltages far beyond the cell's absolute limits say
// nothing of its charge: they are for the faults.
//
// It begins
//   - from the record of a former life, cell by cell, if the same modules are there (by their serial numbers), the cell
//     file says the same capacity, and the voltages of the first picture do not contradict it. What flowed after it was
//     written nobody has seen: a record is written before a cell has moved by more than `record_step`, and a cell that
//     is restored is unsure of that much more, unless the life before ended in order. How old a record is, the clock
//     says; meanwhile cells lost some by themselves.
//   - else from the voltages of a pack at rest: contactors open, current within soc/rest_current_mA for a
//     second. What flowed before that is not known, and the filter is told so.
// While there is a record, nothing begins before all modules have said who they are; without that nothing closes,
// either.
//
// A record has the cells' health (cell_health.hpp), too. Where a cell's capacity is known it counts with it, the pack
// at once, its estimators from their beginning on; while they run they find out for themselves. Of a pack that rests,
// open, for ten minutes the voltages anchor the capacities (rest_anchor.hpp), as the ends of a charge do.
//
// What is told of the pack is set directly only when it begins, and when the pack has rested for `long_rest`; otherwise
// it follows the estimate at the bounded rate of PublishedSoc.
//
// Cost: nothing but a comparison on most ticks; with each picture about a microsecond a cell (docs/performance.md).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/estimation/cell_forecast_input.hpp"
#include "daemon/core/estimation/health/cell_health.hpp"
#include "daemon/core/estimation/soc/cell_estimate.hpp"
#include "daemon/core/estimation/soc/cells_of_model.hpp"
#include "daemon/core/estimation/soc/coulomb_counter.hpp"
#include "daemon/core/estimation/soc/current_spans.hpp"
#include "daemon/core/estimation/soc/pack_soc.hpp"
#include "daemon/core/estimation/soc/published_soc.hpp"
#include "daemon/core/estimation/soc_record.hpp"
#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "daemon/core/types/fault_reading.hpp"
#include "protocol/fields.hpp"

namespace bmu {

inline constexpr Duration estimate_gap_max = 1s;
/// So long nothing but a rest current has flowed when it begins: what a voltage then says is for the filter to doubt.
inline constexpr Duration begin_after = 1s;
inline constexpr Duration long_rest = 2h;
/// So long nothing but a rest current has flowed when voltages anchor capacities, and then so often.
inline constexpr Duration anchor_rest = 10min;
inline constexpr Duration anchor_every = 1min;
/// The current that the times until empty and full are told by is its mean over about this time.
inline constexpr double outlook_time_s = 60.0;
/// Of the capacity; a record that is this far off is worth replacing.
inline constexpr double record_step = 0.01;

struct PackEstimateInputs {
  TimePoint now{};
  std::int64_t unix_time_ms = 0;  // 0: nobody has told the time
  bool is_open = false;           // no contactor is commanded closed
  const ModuleTable* modules = nullptr;
  const SensorTable* sensors = nullptr;
  const PackState* pack = nullptr;
  const ChargeState* charge = nullptr;
  const std::int64_t* bled_uAs = nullptr;  // of each cell, by number through the pack, since the start
};

/// Where the states of charge come from.
enum class SocOrigin : std::uint8_t {
  none,    // nothing is known yet
  former,  // a former life's record
  voltage  // of the pack at rest: of some cell at least
};
[[nodiscard]] std::string_view to_text(SocOrigin origin);

class PackEstimate {
 public:
  void init(const CoreConfig& config);
  /// After init, before the first update.
  void restore(const SocRecords& records) { former_ = records; }
  /// Once a tick. True if the pack's state of charge became known with this call.
  [[nodiscard]] bool update(const PackEstimateInputs& in);
  /// Other cells may sit there now.
  void forget_module(std::size_t index);

  /// As the chosen method (soc/method) has it.
  [[nodiscard]] const PackSoc& pack() const { return pack_; }
  /// 0 to 1: what is told. Means nothing unless pack().is_known.
  [[nodiscard]] double told_soc() const { return told_.soc(); }
  [[nodiscard]] std::int32_t told_permille() const { return static_cast<std::int32_t>(std::lround(told_.soc() * 1e3)); }
  /// What is missing until the pack is full, by what is told.
  [[nodiscard]] std::int64_t depth_of_discharge_uAs() const {
    return std::llround((1.0 - told_.soc()) * pack_.capacity_As() * 1e6);
  }
  [[nodiscard]] SocMethod method() const { return method_; }
  /// By number through the pack, from 0.
  [[nodiscard]] const CellEstimate& cell(std::size_t number) const { return estimates_[number]; }
  [[nodiscard]] SocEstimate cell_soc(std::size_t number) const { return estimates_[number].estimate(method_); }
  [[nodiscard]] const CellHealth& cell_health(std::size_t number) const { return health_[number]; }
  /// At the temperature that it has; pack_health.hpp has the pack's.
  [[nodiscard]] ResistanceEstimate cell_resistance(std::size_t number) const {
    return health_[number].resistance(modules_[cells_[number].module].temperature_C);
  }
  /// Of each cell. Cost: a look at each cell, until the first that is not known.
  [[nodiscard]] bool knows_resistances() const {
    for (std::size_t number = 0; number < cell_count_; ++number) {
      if (!cell_resistance(number).is_known) return false;
    }
    return cell_count_ > 0;
  }
  /// If it goes on like in the last minute, by the estimate; nothing while that is unknown, or hardly any current flows
  /// that way. A charge takes longer: in its end the current fades.
  [[nodiscard]] std::optional<Duration> empty_in() const { return outlook(pack_.out_As, outlook_current_A_); }
  [[nodiscard]] std::optional<Duration> full_in() const { return outlook(pack_.in_As, -outlook_current_A_); }
  /// The mean current of about the last minute, A, positive out of the pack; 0 while it rests or is not counted.
  [[nodiscard]] double load_A() const { return outlook_current_A_; }
  [[nodiscard]] const Element& element(std::size_t number) const { return cells_[number].element; }
  [[nodiscard]] std::size_t size() const { return cell_count_; }
  /// The tables that all cells are estimated by.
  [[nodiscard]] const CellDynamics& model() const { return estimates_.model(); }
  /// The instant of the last picture; zero: there was none.
  [[nodiscard]] TimePoint pictured_at() const { return pictured_at_; }
  /// What is known of a cell as of the last picture, for who predicts its voltage.
  [[nodiscard]] CellForecastInput forecast_input(std::size_t number) const;
  [[nodiscard]] SocOrigin origin() const { return origin_; }
  /// How old the record was that it began from, if it did and the clock could say.
  [[nodiscard]] std::optional<Duration> record_age() const { return record_age_; }
  /// When a cell was last found at an end of its charge; zero: not in this life.
  [[nodiscard]] TimePoint anchored_at() const { return anchored_at_; }

  /// The cell whose methods contradict each other most, permille of what they say they may be wrong by.
  [[nodiscard]] Reading disagreement_permille() const { return disagreement_permille_; }
  /// The cell that fits its model worst, permille: from 1000 on it is another kind of cell, or measured wrongly.
  [[nodiscard]] Reading misfit_permille() const { return misfit_permille_; }

  /// All of it as of the last update; false, and nothing written, unless every cell is known and every module has said
  /// who it is.
  [[nodiscard]] bool record(SocRecords& to) const;

 private:
  struct Cell {
    Element element;
    std::uint8_t module = 0;   // index
    bool is_on_trial = false;  // from a record, and no voltage has been seen yet
    std::int64_t bled_uAs = 0;
    bool is_bleeding = false;
    double voltage_V = not_measured;  // in the last picture
    [[nodiscard]] bool are_fields_possible() const {
      return !is_measured(voltage_V) || is_within(voltage_V, -1e3, 1e3);
    }
    BMU_FIELDS(skipped(element), skipped(module), is_on_trial, bled_uAs, is_bleeding, voltage_V)
  };
  struct Module {
    std::uint8_t node = 0;
    std::uint8_t cell_count = 0;
    std::uint16_t first_cell = 0;
    double temperature_C = not_measured;
    [[nodiscard]] bool are_fields_possible() const {
      return !is_measured(temperature_C) || is_within(temperature_C, -1e3, 1e3);
    }
    BMU_FIELDS(skipped(node), skipped(cell_count), skipped(first_cell), temperature_C)
  };
  /// What the next samples have in common.
  struct Moment {
    TimePoint instant{};  // of the picture; zero: there is none
    CurrentSpans spans;
    double current_A = not_measured;
    double unseen_current_A = 0.0;
    bool anchors = false;  // the pack has rested so long that its voltages are anchors
  };

  void follow_rest(const PackEstimateInputs& in);
  [[nodiscard]] bool is_dated(const PackEstimateInputs& in, TimePoint instant) const;
  [[nodiscard]] bool may_begin(const PackEstimateInputs& in) const;
  void begin(const PackEstimateInputs& in, const Moment& moment);
  void begin_cell(std::size_t number, double voltage_V, std::int64_t unix_time_ms);
  void begin_health(std::size_t number, const CellHealthRecord& former);
  [[nodiscard]] const CellSocRecord* former_of(const Cell& cell) const;
  [[nodiscard]] std::optional<Duration> age_of_former(std::int64_t unix_time_ms) const;
  [[nodiscard]] Moment moment_of(const PackEstimateInputs& in, TimePoint instant);
  void read_temperatures(const PackEstimateInputs& in);
  void sample_cells(const PackEstimateInputs& in, const Moment& moment);
  void sample_cell(std::size_t number, const PackEstimateInputs& in, const Moment& moment);
  void follow_health(std::size_t number, const CellSample& sample, std::optional<ChargeAnchor> end,
                     const Moment& moment);
  void judge_record(std::size_t number, double voltage_V);
  [[nodiscard]] double voltage_V(const Cell& cell, const ModuleTable& modules, TimePoint instant) const;
  [[nodiscard]] std::optional<Duration> outlook(double charge_As, double current_A) const;
  void follow_outlook(const CurrentSpans& spans);
  void sum_up(const Moment& moment, TimePoint now);
  void judge(TimePoint at);

  CellsOfModel<CellDynamics, CellEstimate> estimates_;
  ModelMemo memo_;  // of the model in estimates_
  CellsOfModel<HealthModel, CellHealth> health_;
  CurrentSensorError sensor_;
  ChargeEndConfig ends_;
  SocMethod method_ = SocMethod::ekf;
  AgeConfig ages_;
  double rest_current_A_ = 0.0;
  std::int32_t rest_current_mA_ = 0;
  std::int64_t capacity_uAs_ = 0;
  double voltage_least_V_ = 0.0;  // beyond these a voltage is a fault, and says nothing of the charge
  double voltage_most_V_ = 0.0;
  std::size_t cell_count_ = 0;
  std::size_t module_count_ = 0;
  std::array<Module, modules_max> modules_{};
  std::array<Cell, cells_max> cells_{};
  SocRecords former_;
  // Modules of another maker tell none: who is on a node is taken for who was there before.
  bool has_nameless_modules_ = false;
  Duration sample_age_{};  // that old their voltages may be
  double swing_max_mA_ = 0.0;
  std::array<std::uint32_t, modules_max> serial_numbers_{};  // 0: has not said it
  TimePoint resting_since_{};
  bool is_rest_used_ = false;  // what is told has been set from this rest
  TimePoint anchored_by_rest_at_{};
  double outlook_current_A_ = 0.0;
  TimePoint pictured_at_{};
  double pictured_current_A_ = not_measured;
  TimePoint sampled_at_{};
  CurrentSpanMeter spans_;
  PackSoc pack_;
  PublishedSoc told_;
  SocOrigin origin_ = SocOrigin::none;
  std::optional<Duration> record_age_{};
  TimePoint anchored_at_{};
  Reading disagreement_permille_;
  Reading misfit_permille_;
  BMU_FIELDS(estimates_, skipped(memo_), health_, skipped(sensor_), skipped(ends_), skipped(method_), skipped(ages_),
             skipped(rest_current_A_), skipped(rest_current_mA_), skipped(capacity_uAs_), skipped(voltage_least_V_),
             skipped(voltage_most_V_), skipped(cell_count_), skipped(module_count_), modules_, cells_, former_,
             skipped(has_nameless_modules_), skipped(sample_age_), skipped(swing_max_mA_), serial_numbers_,
             resting_since_, is_rest_used_, anchored_by_rest_at_, outlook_current_A_, pictured_at_, pictured_current_A_,
             sampled_at_, spans_, pack_, told_, origin_, record_age_, anchored_at_, disagreement_permille_,
             misfit_permille_)
};

/// Whether the newer record says something that the older one does not.
[[nodiscard]] bool is_worth_recording(const SocRecords& older, const SocRecords& newer);

}  // namespace bmu
