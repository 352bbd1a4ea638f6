#include "daemon/core/estimation/soc/soc_mixed.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bmu {

namespace {

constexpr double high_soc = 0.85;      // from here on the voltage corrects the count
constexpr double pull_time_s = 120.0;  // of that correction, without a current
constexpr double resistance_doubt = 0.2;
constexpr double voltage_doubt_V = 0.010;
constexpr double empty_held_sigma = 0.03;
constexpr double empty_held_s = 5.0;  // one damaged sample does not make a cell empty
constexpr double slope_min_V = 0.2;

}  // namespace

void SocMixed::begin(const CellDynamics& cell, const CurrentSensorError& sensor, const SocBegin& from,
                     double temperature_C) {
  *this = {};
  cell_.set(cell);
  if (is_measured(temperature_C)) temperature_C_ = temperature_C;
  counting_.begin(cell, sensor, from, temperature_C);
}

void SocMixed::update(const CellSample& sample, ModelMemo& memo) {
  if (!cell_.is_set() || !sample.has_passed()) return;
  if (is_measured(sample.temperature_C)) temperature_C_ = sample.temperature_C;
  counting_.update(sample);
  if (is_measured(sample.voltage_V) && is_measured(sample.current_A)) {
    listen(sample, memo.row(*cell_, temperature_C_));
  }
}

void SocMixed::listen(const CellSample& sample, const CellDynamics::Row& row) {
  const SocEstimate now = counting_.estimate();
  const CellPoint here = at(row, now.soc);
  const double resistance_Ohm = std::accumulate(here.pair_Ohm.begin(), here.pair_Ohm.end(), here.series_Ohm);
  const double taken_V = resistance_Ohm * sample.current_A + kinetic_V(here, sample.current_A);
  const double open_V = sample.voltage_V + taken_V;
  const bool is_empty = sample.current_A > 0.0 && open_V <= ocv_V(row, 0.0);
  empty_s_ = is_empty ? empty_s_ + sample.passed_s : 0.0;
  if (empty_s_ >= empty_held_s) counting_.set(0.0, empty_held_sigma);
  if (is_empty) return;
  if (open_V < ocv_V(row, high_soc)) return;
  const double told = soc_from_ocv(row, open_V, 0.0);
  const double slope_V = std::max(ocv_slope_V(row, told), slope_min_V);
  const double told_sigma = root_sum_square(voltage_doubt_V, resistance_doubt * taken_V) / slope_V;
  if (told_sigma >= now.sigma) return;
  const double pull = std::min(sample.passed_s / pull_time_s, 1.0) * (1.0 - told_sigma / now.sigma);
  counting_.set(now.soc + (told - now.soc) * pull, now.sigma + (told_sigma - now.sigma) * pull);
}

}  // namespace bmu
