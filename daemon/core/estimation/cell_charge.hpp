// What is missing in each cell until it is full, as far as anybody can know it: a book of charge, a line a cell.
//
//   missing(t) = missing(learned) + charge that has left the pack since + charge its own resistor has taken since
//                + half of what it may have lost by itself
//
// A line is learned at rest (contactors open, no resistor on, current within soc/rest_current_mA, for soc/rest_ms and
// two of the cell's slower time constants), from the open-circuit voltage, and only where the curve is steep enough
// there: the voltage is known to `voltage_error_uV` and to what hysteresis may be by then (hysteresis_range.hpp), and
// where that leaves more than `learn_max_permille` of the capacity either way, nothing is learned; nor beyond the ends
// of the curve. On a flat stretch a line therefore stays what it was, or unknown. A later rest replaces it if it says
// it better, or contradicts it: then something is not as was thought, and what was seen last counts. Afterwards the
// pack's counter and the modules' own words about their switches keep it; what it is unsure of grows by a twentieth of
// what was bled, and by the other half of what the cell may have lost by itself: a cell loses between nothing and
// self_discharge_permille_per_month.
//
// A voltage says which share of its capacity is missing in a cell, and capacities differ: by as much as
// balancing/capacity_tolerance_permille from that of the cell file. So a line learned near empty is unsure of nearly
// all of that, one learned near full of nearly nothing. What has flowed between two rests of a cell far from each other
// is its own capacity (capacity_apart_min), surer than the file's; that the sensor counts too much or too little then
// is the same for all cells, once all have been seen so.
//
// Differences between lines learned at one time need no exact current sensor: all cells carry the same current. Between
// lines of different times lies what the sensor may have miscounted meanwhile, `current_gain_permille` of all that
// flowed in and out, and `current_offset_mA` all the time; lines older than the youngest are unsure of that, too.
//
// A book that is whole outlives the process (records, restore). What has flowed between its last record and the next
// start nobody knows, but it is the same for all cells; so a former life's book knows differences only, until a rest
// shows how much that was, or all cells are learned anew. Nobody sees it
//   - before the clock shows how old it is, and while that is before it was written,
//   - before each module has said that it is the one of then,
//   - before the voltages of a complete poll cycle could all be as it says, at some state of charge; the current may be
//     anything then, so only what is far off shows. Each rest looks anew, and closely.
// A book that the voltages contradict, or of another pack, is thrown away. Lines of a module that was replaced, too.
// What was learned of capacities ends with the process.
//
// Who estimates the charge and capacity of each cell better may fill the same struct; planners see nothing else.
// Cost: two exponentials and a copy of what was bled on each tick with a current; while resting, a search in the curve
// for each cell a poll cycle.
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

/// A cell's charge, for whoever plans with it. Unless `is_known` the numbers mean nothing.
struct CellCharge {
  bool is_known = false;
  std::int64_t missing_uAs = 0;      // until it is full; may be negative
  std::int64_t uncertainty_uAs = 0;  // either way, 0 or more
  std::int64_t capacity_uAs = 0;
};

/// How well a module measures a cell, apart from what the cell itself hides.
inline constexpr std::int32_t voltage_error_uV = 1'000;
/// A voltage that leaves more of the capacity open, either way, says nothing.
inline constexpr double learn_max_permille = 20.0;
/// How well the current sensor counts: of all charge that flows, either way; and what it shows without a current.
inline constexpr double current_gain_permille = 20.0;
inline constexpr double current_offset_mA = 50.0;
/// Of the charge between empty and full: two rests at least so far apart show a capacity.
inline constexpr double capacity_apart_min = 0.3;
/// What a former life's book is off by, all cells together, is taken over from a rest that says it this well.
inline constexpr double align_max_permille = 2.0;
/// A record is worth replacing when a line has changed by this much of the capacity, or knows so much better.
inline constexpr double record_step_permille = 0.1;
/// And at most this often: what is bled meanwhile is forgotten, and counts as not known after a restart.
inline constexpr Duration record_every = 10min;

/// Charge of a rested cell at this open-circuit voltage; beyond the ends of the curve those of the ends, 0 or the
/// capacity. The curve must have two points.
[[nodiscard]] double charge_at_uAs(const CellModel& cell, double ocv_uV);

struct CellChargeInputs {
  TimePoint now{};
  std::int64_t unix_time_ms = 0;  // 0: nobody has told the time
  bool is_open = false;           // no contactor is commanded closed
  bool is_bleeding = false;       // some switch of the pack is on, or may be
  const ModuleTable* modules = nullptr;
  const PackState* pack = nullptr;
  const ChargeState* charge = nullptr;
  const std::int64_t* bled_uAs = nullptr;  // of each cell, by number through the pack, since the start
};

/// What has become of the book of a former life.
enum class FormerBook : std::uint8_t {
  none,       // there was none
  foreign,    // of another pack, or of other modules: not used
  waiting,    // for the clock, the modules' identities or their voltages
  in_use,     // for the differences between cells
  refused,    // the voltages contradict it
  taken_over  // by what a rest of this life has shown
};
[[nodiscard]] std::string_view to_text(FormerBook former);

class CellChargeBook {
 public:
  void init(const CoreConfig& config);
  /// After init, before the first update. A book that does not belong to this pack is foreign, and nothing is known.
  void restore(const CellChargeRecords& records);
  /// Once a tick.
  void update(const CellChargeInputs& in);
  /// Other cells may sit there now: nothing that was learned of them counts. A former life's book is no longer whole.
  void forget_module(std::size_t index);
  /// By number through the pack, from 0, with what has flowed until the last update.
  [[nodiscard]] CellCharge cell(std::size_t number) const;
  [[nodiscard]] std::size_t known_cells() const { return is_hidden() ? 0 : known_cells_; }
  [[nodiscard]] FormerBook former() const { return former_; }

  /// The whole book as of the last update; false, and nothing written, unless every cell is known, every module has
  /// said who it is, and so has the clock.
  [[nodiscard]] bool record(CellChargeRecords& to) const;

 private:
  struct Line {
    bool is_known = false;
    std::int64_t missing_uAs = 0;  // when it was learned
    std::int64_t uncertainty_uAs = 0;
    std::int64_t flowed_uAs = 0;  // the pack's charge that had left it then
    std::int64_t bled_uAs = 0;    // then
    TimePoint learned_at{};       // from here on it loses charge by itself
    TimePoint counted_at{};       // from here on the sensor's errors count
    double moved_uAs = 0.0;       // all that had flowed in and out then

    [[nodiscard]] bool are_fields_possible() const { return !std::isnan(moved_uAs); }
  };
  /// A rest, as the first or the second from which a capacity is learned.
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
    double error_uAs = 0.0;  // either way; without what the sensor's gain makes of all alike
    bool is_learned = false;
    Rest low;   // below half
    Rest high;  // above

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
    bool is_identified = false;  // in this life
    std::uint32_t serial_number = 0;
    std::uint32_t former_serial_number = 0;  // while the book is a former life's
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
  /// As of the youngest line, or of now.
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
  TimePoint learned_from_{};  // the poll cycle
  std::int64_t flowed_uAs_ = 0;
  HysteresisRange hysteresis_;
  FormerBook former_ = FormerBook::none;
  std::int64_t former_unix_time_ms_ = 0;
  std::optional<TimePoint> former_since_{};  // when its record was written, by the clock
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

/// Whether the newer record says something that the older one does not, or not so well.
[[nodiscard]] bool is_worth_recording(const CellChargeRecords& older, const CellChargeRecords& newer);

}  // namespace bmu
