// The capacity of one cell, from pairs of anchors: between two instants at which the state of charge is known, what
// flowed divided by how far the state moved is the capacity. Neither is known exactly, and an error of the state of
// charge stands below the line of that fraction: an ordinary mean of such quotients, or ordinary least squares, is
// biased, and always the same way. Total least squares weights both errors (G. L. Plett, Recursive approximate weighted
// total least squares estimation of battery cell total capacity, J. Power Sources 196 (2011) 2319):
//
//   J(Q) = sum over the pairs of  (charge - Q * change)^2 / (sigma_charge^2 + Q^2 * sigma_change^2)
//
// has its least at the capacity that explains all pairs best. It cannot be kept in a few sums, unless all pairs have
// the same ratio of the two errors; pairs of rests and of whole charges do not. But the capacity is one number between
// bounds, so J itself is kept, at `points` capacities, and every pair adds what it says to each: nothing is
// approximated but what lies between two points, a parabola there.
//
//   - What is older counts less, the more the cell has been used since: it loses up to `loss_share_per_cycle` with each
//     full cycle and `loss_share_per_year`, so what was known is known by that much less when the next pair comes. A
//     cell that is cycled in a laboratory until it dies forgets within days, one in a vehicle within years.
//   - A pair that contradicts what was known counts as one that is just hard to believe (P. Huber, Robust Statistics,
//     Wiley 1981, chapter 7); and what was known is doubted, too, less than the pair, so that a few that agree with it
//     win.
//   - What is off in all pairs alike, the gain of the current sensor first of all, does not average out:
//     `common_share` is added at the end.
//
// Cost: a pair 51 divisions and 102 exponentials, an answer 51. Less than 500 bytes a cell.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/core/estimation/soc/soc_estimate.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// What flowed out of the cell between two instants, and by how much its state of charge fell meanwhile; both negative
/// for a charge. A capacity that was measured otherwise is a pair with a change of 1 that is exact.
struct CapacityPair {
  double charge_As = not_measured;
  double charge_sigma_As = not_measured;  // above 0; without what common_share says
  double soc_change = not_measured;
  double soc_change_sigma = not_measured;  // 0 or more
};

/// What is believed before the first pair, and how a cell may be.
struct CapacityPrior {
  double capacity_As = 0.0;              // the cell file's, or what was learned in a former life; above 0
  double sigma_share = 0.05;             // one standard deviation of it, above 0
  double rated_As = 0.0;                 // the cell file's, above 0: capacities are looked for from 0.3 to 1.3 of it
  double common_share = 0.01;            // one standard deviation of what all pairs have in common, 0 or more
  double loss_share_per_cycle = 0.0005;  // of rated_As, at most, 0 or more: what the maker promises
  double loss_share_per_year = 0.03;     // the same for a cell that is only kept
};

/// A pair whose state of charge moved less says nothing.
inline constexpr double pair_apart_min = 0.1;

class CapacityEstimate {
 public:
  static constexpr std::size_t points = 51;
  static constexpr double least_share = 0.3;
  static constexpr double most_share = 1.3;

  /// A prior that is none (not a number, not above 0, outside the bounds): nothing is known, and pairs are passed over.
  void begin(const CapacityPrior& prior);
  /// False, and nothing is learned, if a pair is absurd: not a number, without an error, too close, of two signs, or of
  /// a capacity that no cell of this kind has.
  bool take(const CapacityPair& pair);
  /// The cell ages: time passes, and so much flows, either way. What is not above 0 or beyond all bounds does nothing.
  void pass(double passed_s, double moved_As);

  [[nodiscard]] bool is_known() const { return rated_As_ > 0.0; }
  /// 0 while nothing is known.
  [[nodiscard]] double capacity_As() const;
  /// The truth lies within two of these in some 95 of 100 cases.
  [[nodiscard]] double sigma_As() const;
  /// The same without what all pairs have in common: what begin() of a next life is to be told.
  [[nodiscard]] double learned_sigma_As() const;
  /// How many pairs it rests on, and how many were absurd.
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
  double aged_share_ = 0.0;  // what may have been lost since the last pair
  std::uint32_t pairs_ = 0;
  std::uint32_t refused_ = 0;
  Costs costs_{};
  [[nodiscard]] bool are_fields_possible() const { return is_within(rated_As_, 0.0, charge_most_As); }
  BMU_FIELDS(rated_As_, common_share_, loss_share_per_cycle_, loss_share_per_year_, aged_share_, pairs_, refused_,
             costs_)
};

/// An instant at which the state of charge was known apart from counting: a rest, the end of a charge.
struct CapacityAnchor {
  double soc = not_measured;
  double sigma = not_measured;       // above 0
  double counted_As = not_measured;  // what has left the cell by then, since any instant
  double at_s = not_measured;        // since any instant
};

/// Makes pairs of the anchors of one cell. An anchor waits for the next that is at least `anchors_apart_min` away; of
/// two that are closer the better one waits on, with what counting may have lost since.
class CapacityAnchors {
 public:
  /// `sensor`: its offset is counted, over the time between; its gain is the same in all pairs and belongs into
  /// CapacityPrior::common_share. `capacity_As`: about, above 0. An absurd anchor is passed over; one that is not later
  /// than the one that waits takes its place: the clock or the counter began anew.
  [[nodiscard]] std::optional<CapacityPair> take(const CapacityAnchor& anchor, const CurrentSensorError& sensor,
                                                 double capacity_As);
  /// What flows is not counted for a while, or the cell was replaced.
  void forget() { waiting_ = {}; }

 private:
  CapacityAnchor waiting_;  // its soc is not a number while there is none
  BMU_FIELDS(waiting_)
};

/// Closer anchors are worth waiting on.
inline constexpr double anchors_apart_min = 0.25;

}  // namespace bmu
