// Capacity of one cell from the upper part of a charge at constant current, independent of its resistance.
//
// A cell with a graphite anode charges over a plateau: a stretch on which the voltage rises slowly, because the
// graphite passes from one of its phases to the next. The charge of the plateau, and the charge from its end until the
// cell is full, shrink as the cell loses lithium; the charge below the plateau shrinks with the plateau. So
//
//   capacity = above_weight * charge(end of the plateau to full) + plateau_weight * charge(flattest 50 mV)
//
// Both positions are found in the curve itself, by how much charge flows while the voltage rises by 50 mV, not by a
// voltage. A constant current through a constant resistance shifts the whole curve; so neither the resistance, which
// rises as a cell ages, nor an error of the voltage sensor matters, and the open-circuit voltage need not be known. (I.
// Bloom et al., Differential voltage analyses of high-power lithium-ion cells, J. Power Sources 139 (2005) 295; M.
// Dubarry et al., Identifying battery aging mechanisms in large format Li ion cells, J. Power Sources 196 (2011) 3420:
// the plateau and its ends as marks of ageing.)
//
//   flattest  the 50 mV with the largest charge; below them a smaller charge must have been seen
//   end       above them, where 50 mV take `plateau_end_share` of that, counted from their middle
//   full      the current, tapering at the charge voltage, has fallen to end_current_A
//
// above_weight is near 1: the charge counted there counts in full. Differences between two cells of one kind are in the
// other term. Both weights belong to a kind of cell and to a charging current, and are fitted to recorded charges with
// a known capacity (`bmucell health`). A kind of cell without such a plateau has no such model, and no result.
//
// There is no result for a charge that starts on the plateau or above it, is interrupted, changes its current before
// the taper, is counted with gaps, or reaches the charge voltage before the end of the plateau: see
// ChargePlateau::take.
//
// Cost: some comparisons a sample; 300 bytes a cell.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "daemon/core/cell/charge_plateau_model.hpp"
#include "daemon/core/estimation/health/capacity_estimate.hpp"
#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

inline constexpr double plateau_end_share = 0.95;
/// Relative tolerance of a charging current to that of the model, and of a constant current to its first value.
inline constexpr double plateau_current_share = 0.2;
inline constexpr double steady_current_share = 0.05;
/// Time of constant current until the voltage follows the charge.
inline constexpr double plateau_settle_s = 180.0;
/// Maximum distance from the charge voltage at constant voltage.
inline constexpr double held_within_V = 0.05;
/// Maximum time between two samples: over a longer one the charge is unknown.
inline constexpr double plateau_gap_max_s = 120.0;

/// Result of one charge.
struct PlateauCharge {
  double plateau_As = 0.0;  // through the flattest 50 mV
  double above_As = 0.0;    // from the end of the plateau until full
  double lasted_s = 0.0;    // from the first constant current until full
};

/// Capacity and its error, as a sample for CapacityEstimate: the error is that of the model and that of the sensor's
/// offset.
[[nodiscard]] CapacityPair capacity_pair(const ChargePlateauModel& model, const PlateauCharge& charge,
                                         const CurrentSensorError& sensor);

class ChargePlateau {
 public:
  /// Starts to wait for a charge.
  void begin(const ChargePlateauModel& model);
  /// Processes the next sample. Returns the result once, at the end of a charge that showed all that is needed. A
  /// sample without a time (CellSample::has_passed) is ignored. Without a measured current into the cell, after a gap,
  /// or without a temperature within the model's, the charge is aborted; one that follows is another charge. The charge
  /// of a sample without a voltage is counted.
  [[nodiscard]] std::optional<PlateauCharge> take(const CellSample& sample);

 private:
  /// Consecutive samples, at least `block_s` long: the noise of a voltage must not look like a step of the curve.
  struct Block {
    double lasted_s = 0.0;
    double charge_As = 0.0;
    double weighted_V = 0.0;
    double voltage_s = 0.0;
  };
  /// Middle of a block.
  struct Point {
    double counted_As = 0.0;
    double voltage_V = 0.0;
    double current_A = 0.0;
  };
  enum class Phase : unsigned char { waiting, steady, held };
  static constexpr std::size_t rungs_in_width = 10;

  void give_up();
  [[nodiscard]] bool may_charge(const CellSample& sample) const;
  [[nodiscard]] std::optional<PlateauCharge> take(const Point& point, double lasted_s);
  [[nodiscard]] bool goes_on(const Point& point) const;
  void begin_steady(const Point& point, double lasted_s);
  void climb(const Point& to);
  void reach(double counted_As);
  void compare(double width_As, double middle_As);
  [[nodiscard]] std::optional<PlateauCharge> taper(const Point& point);

  ChargePlateauModel model_;
  Phase phase_ = Phase::waiting;
  Block block_;
  double counted_As_ = 0.0;  // of this charge
  double lasted_s_ = 0.0;
  double first_current_A_ = 0.0;
  double steady_s_ = 0.0;
  Point before_;
  bool has_begun_climbing_ = false;
  double next_rung_ = 0.0;                               // number of the next bin
  std::size_t rungs_ = 0;                                // number of bins reached
  std::array<double, rungs_in_width + 1> reached_As_{};  // charge counted then; of the last bins, a ring
  double flattest_As_ = 0.0;
  std::size_t flattest_at_ = 0;  // value of rungs_ then
  double width_before_As_ = 0.0;
  double middle_before_As_ = 0.0;
  std::optional<double> end_As_{};  // counted at the end of the plateau
  /// Beyond any voltage: a search up to there would not end.
  static constexpr double rungs_most = 1e6;
  [[nodiscard]] bool are_fields_possible() const { return next_rung_ >= -rungs_most && next_rung_ <= rungs_most; }
  BMU_FIELDS(model_, phase_, block_, counted_As_, lasted_s_, first_current_A_, steady_s_, before_, has_begun_climbing_,
             next_rung_, rungs_, reached_As_, flattest_As_, flattest_at_, width_before_As_, middle_before_As_, end_As_)
};

}  // namespace bmu
