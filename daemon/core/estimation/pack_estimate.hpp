// State of charge of every cell and of the pack, from the messages on the bus: all methods side by side for each cell
// (cell_estimate.hpp), the pack's from those of its cells (pack_soc.hpp), and the published one, which never steps
// (published_soc.hpp).
//
// With SYNC all cells are sampled as the POLL arrives, so that a complete poll cycle is a sample set of one instant;
// the current of that instant lies between the sensor's samples on either side of it. Each sample set is one sample for
// every cell: the charge counted since the previous set, and the current, voltage and temperature of the instant. If no
// sample set arrives for a second, the cells receive the charge that flowed without measured values, and their
// uncertainty grows. While the contactors are open and the sensor is silent, `rest_current_mA` may flow; while they are
// closed, 1C. The charge bled by a cell's own resistor is counted with its current. Voltages far beyond the cell's
// absolute limits are not used for its charge: the fault tests handle them.
//
// The estimate starts
//   - from the record of the previous session, cell by cell, if the same modules are present (by their serial numbers),
//     the cell file has the same capacity, and the voltages of the first sample set do not contradict it. The charge
//     that flowed after it was written is unknown: a record is written before a cell has moved by more than
//     `record_step`, and a restored cell is uncertain by that much more, unless the previous session ended in order.
//     The wall clock gives the age of a record; cells lost some charge by self-discharge since then.
//   - else from the voltages of a pack at rest: contactors open, current within soc/rest_current_mA for a second. The
//     current before that is unknown, and the filter starts with that information.
// While there is a record, nothing starts before all modules have reported their identity; without that nothing closes,
// either.
//
// A record contains the cells' health (cell_health.hpp), too. Where a cell's capacity is known, the pack uses it at
// once, its estimators from their start on; while they run they learn it themselves. When a pack has rested, open, for
// ten minutes its voltages anchor the capacities (rest_anchor.hpp), as the ends of a charge do.
//
// The published value of the pack is set directly only at the start, and when the pack has rested for `long_rest`;
// otherwise it follows the estimate at the bounded rate of PublishedSoc.
//
// Cost: only a comparison on most ticks; with each sample set about a microsecond a cell (docs/performance.md).
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
/// Minimum time with nothing but a rest current before the start: the filter weighs the uncertainty of the voltage.
inline constexpr Duration begin_after = 1s;
inline constexpr Duration long_rest = 2h;
/// Minimum time with nothing but a rest current until voltages anchor capacities, and the period of further anchors.
inline constexpr Duration anchor_rest = 10min;
inline constexpr Duration anchor_every = 1min;
/// Time constant of the mean current that the times until empty and full are computed with.
inline constexpr double outlook_time_s = 60.0;
/// Share of the capacity; a record that is this far off is replaced.
inline constexpr double record_step = 0.01;

struct PackEstimateInputs {
  TimePoint now{};
  std::int64_t unix_time_ms = 0;  // 0: the wall clock is unknown
  bool is_open = false;           // no contactor is commanded closed
  const ModuleTable* modules = nullptr;
  const SensorTable* sensors = nullptr;
  const PackState* pack = nullptr;
  const ChargeState* charge = nullptr;
  const std::int64_t* bled_uAs = nullptr;  // of each cell, by number through the pack, since the start
};

/// Source of the states of charge.
enum class SocOrigin : std::uint8_t {
  none,    // nothing is known yet
  former,  // record of the previous session
  voltage  // of the pack at rest: of at least one cell
};
[[nodiscard]] std::string_view to_text(SocOrigin origin);

class PackEstimate {
 public:
  void init(const CoreConfig& config);
  /// After init, before the first update.
  void restore(const SocRecords& records) { former_ = records; }
  /// Once a tick. True if the pack's state of charge became known with this call.
  [[nodiscard]] bool update(const PackEstimateInputs& in);
  /// Discards the estimates of a module that may have other cells now.
  void forget_module(std::size_t index);

  /// By the selected method (soc/method).
  [[nodiscard]] const PackSoc& pack() const { return pack_; }
  /// Published SOC, 0 to 1. Not valid unless pack().is_known.
  [[nodiscard]] double told_soc() const { return told_.soc(); }
  [[nodiscard]] std::int32_t told_permille() const { return static_cast<std::int32_t>(std::lround(told_.soc() * 1e3)); }
  /// Charge until the pack is full, by the published SOC.
  [[nodiscard]] std::int64_t depth_of_discharge_uAs() const {
    return std::llround((1.0 - told_.soc()) * pack_.capacity_As() * 1e6);
  }
  [[nodiscard]] SocMethod method() const { return method_; }
  /// By number through the pack, from 0.
  [[nodiscard]] const CellEstimate& cell(std::size_t number) const { return estimates_[number]; }
  [[nodiscard]] SocEstimate cell_soc(std::size_t number) const { return estimates_[number].estimate(method_); }
  [[nodiscard]] const CellHealth& cell_health(std::size_t number) const { return health_[number]; }
  /// At its present temperature; pack_health.hpp has the resistance of the pack.
  [[nodiscard]] ResistanceEstimate cell_resistance(std::size_t number) const {
    return health_[number].resistance(modules_[cells_[number].module].temperature_C);
  }
  /// True if that of each cell is known. Cost: one check per cell, until the first unknown one.
  [[nodiscard]] bool knows_resistances() const {
    for (std::size_t number = 0; number < cell_count_; ++number) {
      if (!cell_resistance(number).is_known) return false;
    }
    return cell_count_ > 0;
  }
  /// Time to empty, and to full, by the estimate, if the current of the last minute continues; nothing while the
  /// estimate is unknown, or with hardly any current in that direction. A charge takes longer: at its end the current
  /// tapers.
  [[nodiscard]] std::optional<Duration> empty_in() const { return outlook(pack_.out_As, outlook_current_A_); }
  [[nodiscard]] std::optional<Duration> full_in() const { return outlook(pack_.in_As, -outlook_current_A_); }
  /// The mean current of about the last minute, A, positive out of the pack; 0 while it rests or is not counted.
  [[nodiscard]] double load_A() const { return outlook_current_A_; }
  [[nodiscard]] const Element& element(std::size_t number) const { return cells_[number].element; }
  [[nodiscard]] std::size_t size() const { return cell_count_; }
  /// The tables by which all cells are estimated.
  [[nodiscard]] const CellDynamics& model() const { return estimates_.model(); }
  /// Instant of the last sample set; zero: there was none.
  [[nodiscard]] TimePoint pictured_at() const { return pictured_at_; }
  /// State of a cell as of the last sample set, for a prediction of its voltage.
  [[nodiscard]] CellForecastInput forecast_input(std::size_t number) const;
  [[nodiscard]] SocOrigin origin() const { return origin_; }
  /// Age of the record from which the estimate started, if it did and the wall clock was known.
  [[nodiscard]] std::optional<Duration> record_age() const { return record_age_; }
  /// Time at which a cell last reached an end of its charge; zero: not in this session.
  [[nodiscard]] TimePoint anchored_at() const { return anchored_at_; }

  /// Largest contradiction between the methods of one cell, permille of the uncertainty that they report.
  [[nodiscard]] Reading disagreement_permille() const { return disagreement_permille_; }
  /// The cell that fits its model worst, permille: from 1000 on it is of another kind, or measured wrongly.
  [[nodiscard]] Reading misfit_permille() const { return misfit_permille_; }

  /// Complete state as of the last update; false, and nothing written, unless every cell is known and every module has
  /// reported its identity.
  [[nodiscard]] bool record(SocRecords& to) const;

 private:
  struct Cell {
    Element element;
    std::uint8_t module = 0;   // index
    bool is_on_trial = false;  // from a record, and not yet checked by a voltage
    std::int64_t bled_uAs = 0;
    bool is_bleeding = false;
    double voltage_V = not_measured;  // in the last sample set
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
  /// Common context of the next samples.
  struct Moment {
    TimePoint instant{};  // of the sample set; zero: there is none
    CurrentSpans spans;
    double current_A = not_measured;
    double unseen_current_A = 0.0;
    bool anchors = false;  // the pack has rested long enough for its voltages to be anchors
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
  double voltage_least_V_ = 0.0;  // a voltage outside this range is a fault, and not used for the charge
  double voltage_most_V_ = 0.0;
  std::size_t cell_count_ = 0;
  std::size_t module_count_ = 0;
  std::array<Module, modules_max> modules_{};
  std::array<Cell, cells_max> cells_{};
  SocRecords former_;
  // Modules of another maker report no identity: the module on a node is taken for the one that was there before.
  bool has_nameless_modules_ = false;
  Duration sample_age_{};  // maximum age of their voltages
  double swing_max_mA_ = 0.0;
  std::array<std::uint32_t, modules_max> serial_numbers_{};  // 0: not reported
  TimePoint resting_since_{};
  bool is_rest_used_ = false;  // the published SOC has been set from this rest
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

/// True if the newer record contains information that the older one lacks.
[[nodiscard]] bool is_worth_recording(const SocRecords& older, const SocRecords& newer);

}  // namespace bmu
