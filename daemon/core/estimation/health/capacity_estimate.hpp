// Capacity of one cell from capacity samples, i.e. pairs of anchors: between two instants with known state of charge,
// the charge that flowed divided by the change of the state of charge is the capacity. Both have errors, and that of
// the state of charge is in the denominator of the fraction: an ordinary mean of such quotients, or ordinary least
// squares, is biased, and always the same way. Total least squares weights both errors (G. L. Plett, Recursive
// approximate weighted total least squares estimation of battery cell total capacity, J. Power Sources 196 (2011)
// 2319):
//
//   J(Q) = sum over the samples of  (charge - Q * change)^2 / (sigma_charge^2 + Q^2 * sigma_change^2)
//
// has its minimum at the capacity that explains all samples best. It cannot be reduced to a few sums, unless all
// samples have the same ratio of the two errors, which those of rests and of whole charges do not. But the capacity is
// one number between bounds, so J itself is stored, at `points` capacities, and every sample adds its term to each: the
// only approximation is a parabola between two points.
//
//   - Older samples count less, the more the cell has been used since: it loses up to `loss_share_per_cycle` with each
//     full cycle and `loss_share_per_year`, so the estimate is uncertain by that much more when the next sample comes.
//     The history of a cell that is cycled in a laboratory until it is worn out fades within days, that of one in a
//     vehicle within years.
//   - A sample that contradicts the estimate counts as one that is just probable (P. Huber, Robust Statistics, Wiley
//     1981, chapter 7); the estimate loses weight, too, less than the sample, so that a few that agree with the new one
//     win.
//   - An error that all samples share, above all the gain of the current sensor, does not average out: `common_share`
//     is added at the end.
//
// Cost: a sample 51 divisions and 102 exponentials, a result 51. Less than 500 bytes a cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// Charge that flowed out of the cell between two instants, and decrease of its state of charge meanwhile; both
/// negative for a charge. A capacity that was measured by other means is a sample with an exact change of 1.
struct CapacityPair {
  double charge_As = not_measured;
  double charge_sigma_As = not_measured;  // above 0; without the part of common_share
  double soc_change = not_measured;
  double soc_change_sigma = not_measured;  // 0 or more
};

/// Estimate before the first sample, and properties of the cell.
struct CapacityPrior {
  double capacity_As = 0.0;              // of the cell file, or learned in a previous session; above 0
  double sigma_share = 0.05;             // one standard deviation of it, above 0
  double rated_As = 0.0;                 // of the cell file, above 0: the capacity is searched from 0.3 to 1.3 of it
  double common_share = 0.01;            // one standard deviation of the error that all samples share, 0 or more
  double loss_share_per_cycle = 0.0005;  // of rated_As, at most, 0 or more: as the maker promises
  double loss_share_per_year = 0.03;     // the same for a cell in storage
};

/// A sample with a smaller change of the state of charge is rejected.
inline constexpr double pair_apart_min = 0.1;

class CapacityEstimate {
 public:
  static constexpr std::size_t points = 51;
  static constexpr double least_share = 0.3;
  static constexpr double most_share = 1.3;

  /// With an invalid prior (not a number, not above 0, outside the bounds) the capacity is unknown, and samples are
  /// ignored.
  void begin(const CapacityPrior& prior);
  /// Adds a sample. Returns false, and learns nothing, if it is implausible: not a number, without an error, too small
  /// a change, opposite signs, or a capacity that no cell of this kind has.
  bool take(const CapacityPair& pair);
  /// Ages the cell by a time and a charge that flowed, either way. Values not above 0 or beyond all bounds have no
  /// effect.
  void pass(double passed_s, double moved_As);

  [[nodiscard]] bool is_known() const { return rated_As_ > 0.0; }
  /// 0 while nothing is known.
  [[nodiscard]] double capacity_As() const;
  /// The truth lies within two of these in some 95 of 100 cases.
  [[nodiscard]] double sigma_As() const;
  /// The same without the error that all samples share: for the prior of the next session (begin()).
  [[nodiscard]] double learned_sigma_As() const;
  /// Number of samples used, and of those rejected as implausible.
  [[nodiscard]] std::uint32_t pairs() const { return pairs_; }
  [[nodiscard]] std::uint32_t refused() const { return refused_; }

 private:
  using Costs = std::array<double, points>;

  [[nodiscard]] bool is_sane(const CapacityPair& pair) const;
  [[nodiscard]] double at_As(std::size_t point) const;
  [[nodiscard]] std::size_t least() const;
  void add(const CapacityPair& pair);
  void forget();
  void relax(double variance_factor);
  [[nodiscard]] double doubt_of(const CapacityPair& pair) const;
  [[nodiscard]] double seen_variance() const;  // (As)^2

  double rated_As_ = 0.0;
  double common_share_ = 0.0;
  double loss_share_per_cycle_ = 0.0;
  double loss_share_per_year_ = 0.0;
  double aged_share_ = 0.0;  // possible loss since the last sample
  std::uint32_t pairs_ = 0;
  std::uint32_t refused_ = 0;
  Costs costs_{};
  [[nodiscard]] bool are_fields_possible() const { return is_within(rated_As_, 0.0, charge_most_As); }
  BMU_FIELDS(rated_As_, common_share_, loss_share_per_cycle_, loss_share_per_year_, aged_share_, pairs_, refused_,
             costs_)
};

/// Instant with a state of charge known independently of counting: a rest, the end of a charge.
struct CapacityAnchor {
  double soc = not_measured;
  double sigma = not_measured;       // above 0
  double counted_As = not_measured;  // charge that has left the cell by then, since any instant
  double at_s = not_measured;        // since any instant
};

/// Combines the anchors of one cell into capacity samples. An anchor is kept until the next that is at least
/// `anchors_apart_min` away; of two that are closer the more accurate one is kept, with the error of the counting since
/// then.
class CapacityAnchors {
 public:
  /// `sensor`: its offset counts, over the time between the anchors; its gain is the same in all samples and belongs to
  /// CapacityPrior::common_share. `capacity_As`: approximate, above 0. An invalid anchor is ignored; one that is not
  /// later than the kept one replaces it: the clock or the counter has restarted.
  [[nodiscard]] std::optional<CapacityPair> take(const CapacityAnchor& anchor, const CurrentSensorError& sensor,
                                                 double capacity_As);
  /// Discards the kept anchor: the charge is not counted for some time, or the cell was replaced.
  void forget() { waiting_ = {}; }

 private:
  CapacityAnchor waiting_;  // its soc is not a number while there is none
  BMU_FIELDS(waiting_)
};

/// Minimum distance of two anchors for a sample.
inline constexpr double anchors_apart_min = 0.25;

}  // namespace bmu
