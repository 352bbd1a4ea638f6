#include "tools/bmucell/fit/model_error.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bmu::cell {

namespace {

constexpr std::size_t block_rows = 300;
constexpr std::size_t lag_rows = 10;
constexpr double blocks_min = 5.0;
/// Bound of the error of a single row: larger ones, e.g. near empty, are not representative of the model.
constexpr double most_V = 0.050;
constexpr double slow_time_s = 1500.0;
/// Minimum of a cell file: no model is better than the measurement of the modules.
constexpr double slow_error_least_V = 1e-4;
/// Share of the fit's error in its own data. The filter performs best with this share, over cells and temperatures, on
/// data that were not part of the fit: docs/accuracy.md.
constexpr double slow_share = 0.7;

double bounded_square(double value) {
  return std::min(value * value, most_V * most_V);
}

}  // namespace

void ModelError::add_block(const double* off_V, double temperature_C) {
  const RowPlace place = row_place(cell_, temperature_C);
  Sums& sums = sums_[place.share > 0.5 ? place.from + 1 : place.from];
  const double mean_V = std::accumulate(off_V, off_V + block_rows, 0.0) / static_cast<double>(block_rows);
  sums.slow_V2 += bounded_square(mean_V);
  sums.blocks += 1.0;
  for (std::size_t k = 0; k < block_rows; ++k) {
    sums.fast_V2 += bounded_square(off_V[k] - mean_V);
    if (k >= lag_rows) sums.lagged_V2 += (off_V[k] - mean_V) * (off_V[k - lag_rows] - mean_V);
  }
  sums.rows += static_cast<double>(block_rows);
}

void ModelError::add(const std::vector<double>& off_V, const std::vector<double>& temperatures_C) {
  for (std::size_t from = 0; from + block_rows <= off_V.size(); from += block_rows) {
    add_block(off_V.data() + from, temperatures_C[from + block_rows / 2]);
  }
}

void ModelError::write_to(CellDynamics& cell) const {
  std::vector<std::size_t> known;
  for (std::size_t k = 0; k < sums_.size(); ++k) {
    const Sums& sums = sums_[k];
    if (sums.blocks < blocks_min) continue;
    known.push_back(k);
    CellDynamics::Row& row = cell.rows[k];
    const double correlation = std::clamp(sums.lagged_V2 / sums.fast_V2, 0.05, 0.9);
    row.slow_error_V = std::max(slow_share * std::sqrt(sums.slow_V2 / sums.blocks), slow_error_least_V);
    row.slow_error_time_s = slow_time_s;
    row.fast_error_V = std::sqrt(sums.fast_V2 / sums.rows);
    row.fast_error_time_s = -static_cast<double>(lag_rows) / std::log(correlation);
  }
  for (std::size_t k = 0; k < sums_.size() && !known.empty(); ++k) {
    if (sums_[k].blocks >= blocks_min) continue;
    const auto warmer = std::upper_bound(known.begin(), known.end(), k);
    const CellDynamics::Row& from = cell.rows[warmer == known.end() ? known.back() : *warmer];
    cell.rows[k].slow_error_V = from.slow_error_V;
    cell.rows[k].slow_error_time_s = from.slow_error_time_s;
    cell.rows[k].fast_error_V = from.fast_error_V;
    cell.rows[k].fast_error_time_s = from.fast_error_time_s;
  }
}

}  // namespace bmu::cell
