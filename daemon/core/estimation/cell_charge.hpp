// Charge that each cell of the pack lacks until it is full: one entry per cell, tracked from rest to rest.
//
//   missing(t) = missing(learned) + charge that has left the pack since + charge its own resistor has taken since
//                + half of the charge that it may have lost by self-discharge
//
// An entry is learned at rest (contactors open, no resistor on, current within soc/rest_current_mA, for the longer of
// soc/rest_ms and two of the cell's slower time constants), from the open-circuit voltage, and only where the curve is
// steep enough: the voltage has the uncertainty `voltage_error_uV` and that of the hysteresis at that time
// (hysteresis_range.hpp). If that leaves more than `learn_max_permille` of the capacity uncertain, either way, or if
// the voltage is beyond the ends of the curve, nothing is learned. On a flat stretch an entry therefore keeps its
// value, or stays unknown. A later rest replaces an entry if its result is more accurate, or if it contradicts the
// entry: then an assumption was wrong, and the latest measurement counts. Between rests the pack's counter and the
// switch states reported by the modules update the entry; its uncertainty grows by a twentieth of the charge that was
// bled, and by the other half of the possible self-discharge: a cell loses between nothing and
// self_discharge_permille_per_month.
//
// A voltage gives the share of its capacity that a cell lacks, and capacities differ: by as much as
// balancing/capacity_tolerance_permille from that of the cell file. So the uncertainty of an entry learned near empty
// contains nearly all of that tolerance, that of one learned near full hardly any. The charge that has flowed between
// two rests of a cell far from each other gives its own capacity (capacity_apart_min), more accurate than the file's;
// the gain error of the sensor in it is then the same for all cells, once all capacities have been learned like this.
//
// Differences between entries learned at one time need no exact current sensor: all cells carry the same current.
// Between entries of different times the sensor may have miscounted, by `current_gain_permille` of all charge that
// flowed in and out, and by `current_offset_mA` all the time; entries older than the youngest have that uncertainty,
// too.
//
// A complete set of entries outlives the process (record, restore). The charge that has flowed between its last record
// and the next start is unknown, but the same for all cells; so restored charges only give differences between cells,
// until a rest shows how much that charge was, or all cells are learned again. They are not used
//   - before the wall clock shows their age, and while it is before the time at which they were written,
//   - before each module has reported the serial number of the record,
//   - before the voltages of a complete poll cycle are consistent with them at some state of charge; the current may be
//     anything then, so only a large deviation is detected. Each rest repeats the check, with a narrow bound.
// Restored charges that the voltages contradict, or of another pack, are discarded, as are the entries of a module that
// was replaced. Learned capacities end with the process.
//
// A better estimator of the charge and capacity of each cell may fill the same struct; planners use nothing else.
// Cost: two exponentials and a copy of the bled charges on each tick with a current; at rest, a search in the curve for
// each cell and poll cycle.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/estimation/cell_charge_record.hpp"
#include "daemon/core/estimation/hysteresis_range.hpp"
#include "daemon/core/estimation/soc/coulomb_counter.hpp"
#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/measurement/pack_state.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Charge of one cell, for planners. Unless `is_known` the other members are not valid.
struct CellCharge {
  bool is_known = false;
  std::int64_t missing_uAs = 0;      // until it is full; may be negative
  std::int64_t uncertainty_uAs = 0;  // either way, 0 or more
  std::int64_t capacity_uAs = 0;
};

/// Accuracy with which a module measures a cell, without the effects within the cell itself.
inline constexpr std::int32_t voltage_error_uV = 1'000;
/// A voltage that leaves more of the capacity uncertain, either way, is not used.
inline constexpr double learn_max_permille = 20.0;
/// Errors of the current sensor: of all charge that flows, either way; and its reading without a current.
inline constexpr double current_gain_permille = 20.0;
inline constexpr double current_offset_mA = 50.0;
/// Minimum distance of two rests that give a capacity, as a share of the charge between empty and full.
inline constexpr double capacity_apart_min = 0.3;
/// Maximum uncertainty of the common offset of restored charges at which a rest corrects it.
inline constexpr double align_max_permille = 2.0;
/// A record is replaced when an entry has changed by this much of the capacity, or is more accurate by as much.
inline constexpr double record_step_permille = 0.1;
/// Minimum time between two records: the charge bled since the last one is lost at a restart, and counts as
/// uncertainty.
inline constexpr Duration record_every = 10min;

/// Charge of a rested cell at this open-circuit voltage; beyond the ends of the curve that of the end, 0 or the
/// capacity. Precondition: the curve has at least two points.
[[nodiscard]] double charge_at_uAs(const CellModel& cell, double ocv_uV);

struct CellChargeInputs {
  TimePoint now{};
  std::int64_t unix_time_ms = 0;  // 0: the wall clock is unknown
  bool is_open = false;           // no contactor is commanded closed
  bool is_bleeding = false;       // some balancing switch of the pack is on, or may be
  const ModuleTable* modules = nullptr;
  const PackState* pack = nullptr;
  const ChargeState* charge = nullptr;
  const std::int64_t* bled_uAs = nullptr;  // of each cell, by number through the pack, since the start
};

/// State of the restored charges.
enum class FormerBook : std::uint8_t {
  none,       // no record was restored
  foreign,    // of another pack, or of other modules: not used
  waiting,    // wall clock, identities of the modules or their voltages are missing
  in_use,     // used for the differences between cells
  refused,    // contradicted by the voltages
  taken_over  // replaced by the result of a rest in this session
};
[[nodiscard]] std::string_view to_text(FormerBook former);

class CellChargeBook {
 public:
  void init(const CoreConfig& config);
  /// After init, before the first update. Charges of another pack are `foreign`, and all entries stay unknown.
  void restore(const CellChargeRecords& records);
  /// Once a tick.
  void update(const CellChargeInputs& in);
  /// Discards the entries and capacities of a module: its cells may have been replaced. Restored charges are discarded,
  /// too.
  void forget_module(std::size_t index);
  /// By number through the pack, from 0, including the charge that has flowed until the last update.
  [[nodiscard]] CellCharge cell(std::size_t number) const;
  [[nodiscard]] std::size_t known_cells() const { return is_hidden() ? 0 : known_cells_; }
  [[nodiscard]] FormerBook former() const { return former_; }

  /// All entries as of the last update; false, and nothing written, unless every cell is known, every module has
  /// reported its identity and the wall clock is known.
  [[nodiscard]] bool record(CellChargeRecords& to) const;

 private:
  struct Line {
    bool is_known = false;
    std::int64_t missing_uAs = 0;  // at `learned_at`
    std::int64_t uncertainty_uAs = 0;
    std::int64_t flowed_uAs = 0;  // charge that had left the pack at that time
    std::int64_t bled_uAs = 0;    // at that time
    TimePoint learned_at{};       // start of its self-discharge
    TimePoint counted_at{};       // from here on the sensor's errors count
    double moved_uAs = 0.0;       // all charge that had flowed in and out at that time

    [[nodiscard]] bool are_fields_possible() const { return !std::isnan(moved_uAs); }
  };
  /// A rest: the first or the second of those that give a capacity.
  struct Rest {
    bool is_known = false;
    double share = 0.0;  // of the capacity
    double error = 0.0;  // either way
    std::int64_t left_uAs = 0;
    std::int64_t bled_uAs = 0;
    double moved_uAs = 0.0;
    TimePoint at{};

    [[nodiscard]] bool are_fields_possible() const {
      return is_within(share, 0.0, 1.0) && is_within(error, 0.0, 1.0) && !std::isnan(moved_uAs);
    }
  };
  struct Capacity {
    double uAs = 0.0;
    double error_uAs = 0.0;  // either way; without the sensor's gain error, which is common to all
    bool is_learned = false;
    Rest low;   // below half charge
    Rest high;  // at half charge or above

    [[nodiscard]] bool are_fields_possible() const { return uAs >= 0.0 && error_uAs >= 0.0; }
  };
  struct Missing {
    double uAs = 0.0;
    double uncertainty_uAs = 0.0;
  };
  struct Range {
    double least_uAs = 0.0;
    double most_uAs = 0.0;
  };
  struct Module {
    std::uint8_t node = 0;
    std::uint8_t cell_count = 0;
    std::uint16_t first_cell = 0;
    bool is_identified = false;  // in this session
    std::uint32_t serial_number = 0;
    std::uint32_t former_serial_number = 0;  // of the record, while the charges are restored ones
    BMU_FIELDS(skipped(node), skipped(cell_count), skipped(first_cell), is_identified, serial_number,
               former_serial_number)
  };

  void count(const CellChargeInputs& in);
  void follow_clock(std::int64_t unix_time_ms);
  void follow_identities(const ModuleTable& modules);
  void follow_rest(const CellChargeInputs& in);
  void judge_former(const CellChargeInputs& in);
  void take_over_former(const ModuleTable& modules);
  [[nodiscard]] bool is_of_this_pack(const CellChargeRecords& records) const;
  [[nodiscard]] bool are_all_identified() const;
  void learn_all(const ModuleTable& modules);
  void drop(FormerBook reason);
  [[nodiscard]] bool is_hidden() const { return former_ == FormerBook::waiting; }
  [[nodiscard]] bool is_former() const { return former_ == FormerBook::waiting || former_ == FormerBook::in_use; }
  [[nodiscard]] Range held(std::int32_t voltage_uV, double error_uV) const;
  [[nodiscard]] bool is_learnable(const Range& held) const;
  [[nodiscard]] Range offset(const ModuleTable& modules, double error_uV) const;
  [[nodiscard]] bool is_better_anew(const ModuleTable& modules) const;
  [[nodiscard]] double unrested_error_uV(const Measured<std::int32_t>& current_mA) const;
  void learn(std::size_t number, std::int32_t voltage_uV);
  void learn_capacity(std::size_t number, const Range& held);
  [[nodiscard]] Missing missing(std::size_t number, const Range& held) const;
  [[nodiscard]] double capacity_error_uAs(const Capacity& capacity) const;
  [[nodiscard]] double miscounted_uAs(const Line& line, double moved_uAs, TimePoint at) const;
  [[nodiscard]] double lost_uAs(TimePoint since) const;
  [[nodiscard]] std::int64_t half_lost_uAs(const Line& line) const;
  /// Uncertainty as of the youngest entry, and as of now.
  [[nodiscard]] std::int64_t uncertainty_uAs(std::size_t number) const;
  [[nodiscard]] std::int64_t uncertainty_now_uAs(std::size_t number) const;
  [[nodiscard]] std::int64_t kept_uncertainty_uAs(std::size_t number) const;

  CellModel cell_;
  double capacity_tolerance_uAs_ = 0.0;
  bool knows_all_capacities_ = false;
  double moved_uAs_ = 0.0;
  TimePoint youngest_at_{};
  double youngest_moved_uAs_ = 0.0;
  std::int32_t rest_current_mA_ = 0;
  std::int32_t current_max_mA_ = 0;
  std::int64_t unrecorded_uAs_ = 0;
  Duration rest_{};
  std::size_t cell_count_ = 0;
  std::size_t known_cells_ = 0;
  std::size_t module_count_ = 0;
  TimePoint now_{};
  std::int64_t unix_time_ms_ = 0;
  TimePoint resting_since_{};
  TimePoint learned_from_{};  // completion of the poll cycle evaluated last
  std::int64_t flowed_uAs_ = 0;
  HysteresisRange hysteresis_;
  FormerBook former_ = FormerBook::none;
  std::int64_t former_unix_time_ms_ = 0;
  std::optional<TimePoint> former_since_{};  // time of the restored record, by the wall clock
  std::array<Module, modules_max> modules_{};
  std::array<std::int64_t, cells_max> bled_uAs_{};
  std::array<Line, cells_max> lines_{};
  std::array<Capacity, cells_max> capacities_{};
  [[nodiscard]] bool are_fields_possible() const { return !std::isnan(moved_uAs_) && !std::isnan(youngest_moved_uAs_); }
  BMU_FIELDS(skipped(cell_), skipped(capacity_tolerance_uAs_), knows_all_capacities_, moved_uAs_, youngest_at_,
             youngest_moved_uAs_, skipped(rest_current_mA_), skipped(current_max_mA_), skipped(unrecorded_uAs_),
             skipped(rest_), skipped(cell_count_), known_cells_, skipped(module_count_), now_, unix_time_ms_,
             resting_since_, learned_from_, flowed_uAs_, hysteresis_, former_, former_unix_time_ms_, former_since_,
             modules_, bled_uAs_, lines_, capacities_)
};

/// True if the newer record contains an entry that the older one lacks, or has less accurately.
[[nodiscard]] bool is_worth_recording(const CellChargeRecords& older, const CellChargeRecords& newer);

}  // namespace bmu
