#include "tools/bmucell/fit/voltage_terms.hpp"

#include <algorithm>
#include <cmath>

#include "tools/bmucell/fit/fit_unknowns.hpp"

namespace bmu::cell {

namespace {

/// Smaller voltages of an RC filter (V, at a resistance of 1) are omitted from the terms: a thousandth of a millivolt.
constexpr double held_min = 1e-6;

struct Weight {
  std::size_t at = 0;
  double share = 0.0;
};
using Weights = std::array<Weight, 2>;

Weights weights_of(const TablePlace& place) {
  return {{{place.from, 1.0 - place.share}, {place.from + 1, place.share}}};
}

bool is_whole(const SeriesRow& row, double soc) {
  return std::isfinite(row.current_A) && std::isfinite(row.voltage_V) && std::isfinite(row.temperature_C) &&
         std::isfinite(soc);
}

}  // namespace

std::vector<std::size_t> halves_of(const Series& series, double capacity_Ah) {
  constexpr double charging_C = 0.01;
  std::vector<std::size_t> halves;
  halves.reserve(series.rows.size());
  bool is_charging = false;
  for (const SeriesRow& row : series.rows) {
    is_charging = is_charging || row.current_A < -charging_C * capacity_Ah;
    halves.push_back(is_charging ? 1 : 0);
  }
  return halves;
}

struct VoltageTerms::Place {
  Weights rows{};
  Weights curve{};
  Weights table{};
  std::array<double, 2> unit_Ohm{};  // of a resistance of 1, at this position
  double exchange_current_A = 1.0;
};

struct VoltageTerms::State {
  double hysteresis = 1.0;
  std::array<std::vector<double>, CellDynamics::pairs> held_V{};  // by row and entry, for a resistance of 1
};

VoltageTerms::VoltageTerms(const CellDynamics& frame, double typical_Ohm) : frame_(frame) {
  for (const CellDynamics::Row& row : frame.rows) {
    units_Ohm_.push_back(typical_Ohm * resistance_factor(frame.activation_K, row.temperature_C));
  }
}

VoltageTerms::Place VoltageTerms::place_of(double soc, double temperature_C) const {
  const RowPlace between = row_place(frame_, temperature_C);
  const std::size_t warm = std::min(between.from + 1, frame_.rows.size() - 1);
  Place place{.rows = {{{between.from, 1.0 - between.share}, {warm, between.share}}},
              .curve = weights_of(table_place(Unknowns::curve_points, soc)),
              .table = weights_of(table_place(Unknowns::table_points, soc))};
  for (std::size_t k = 0; k < place.rows.size(); ++k) {
    place.unit_Ohm[k] = units_Ohm_[place.rows[k].at] * between.resistance;
  }
  const double exchange_A =
      std::lerp(frame_.rows[between.from].exchange_current_A, frame_.rows[warm].exchange_current_A, between.share);
  place.exchange_current_A = exchange_A / between.resistance;
  return place;
}

void VoltageTerms::follow(State& state, const Place& place, double current_A, double passed_s) const {
  const double flowed = std::abs(current_A) * passed_s / (frame_.hysteresis_charge * frame_.capacity_As);
  const double towards = current_A > 0.0 ? -1.0 : 1.0;
  state.hysteresis = towards + (state.hysteresis - towards) * std::exp(-flowed);
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    const double keep = std::exp(-passed_s / frame_.pair_time_constant_s[pair]);
    std::vector<double>& held = state.held_V[pair];
    for (double& one : held) one *= keep;
    for (std::size_t k = 0; k < place.rows.size(); ++k) {
      for (const Weight& entry : place.table) {
        held[place.rows[k].at * Unknowns::table_points + entry.at] +=
            (1.0 - keep) * current_A * place.rows[k].share * entry.share * place.unit_Ohm[k];
      }
    }
  }
}

void VoltageTerms::tell(const State& state, const Place& place, double current_A, std::vector<Term>& terms) const {
  const double exchange_A = place.exchange_current_A;
  const double kinetic_A = exchange_A * std::asinh(current_A / exchange_A);
  terms.clear();
  for (std::size_t k = 0; k < place.rows.size(); ++k) {
    const Weight& row = place.rows[k];
    if (row.share == 0.0) continue;
    for (const Weight& point : place.curve)
      terms.push_back({Unknowns::curve(row.at, point.at), row.share * point.share});
    for (const Weight& entry : place.table) {
      const double share = row.share * entry.share;
      terms.push_back({Unknowns::table(row.at, Table::hysteresis, entry.at), share * state.hysteresis});
      terms.push_back({Unknowns::table(row.at, Table::series, entry.at), -share * place.unit_Ohm[k] * current_A});
      terms.push_back({Unknowns::table(row.at, Table::kinetic, entry.at), -share * place.unit_Ohm[k] * kinetic_A});
    }
  }
  for (std::size_t pair = 0; pair < CellDynamics::pairs; ++pair) {
    const std::vector<double>& held = state.held_V[pair];
    for (std::size_t k = 0; k < held.size(); ++k) {
      if (std::abs(held[k]) < held_min) continue;
      terms.push_back({Unknowns::pair(k / Unknowns::table_points, pair, k % Unknowns::table_points), -held[k]});
    }
  }
}

void VoltageTerms::walk(const Series& series, const std::vector<double>& charge, const Use& use) const {
  State state;
  for (std::vector<double>& held : state.held_V) held.assign(frame_.rows.size() * Unknowns::table_points, 0.0);
  std::vector<Term> terms;
  double before_s = series.rows.empty() ? 0.0 : series.rows.front().time_s;
  for (std::size_t k = 0; k < series.rows.size(); ++k) {
    const SeriesRow& row = series.rows[k];
    if (!is_whole(row, charge[k])) continue;
    const double passed_s = std::max(row.time_s - before_s, 0.0);
    before_s = std::max(row.time_s, before_s);
    const Place place = place_of(charge[k], row.temperature_C);
    follow(state, place, row.current_A, passed_s);
    tell(state, place, row.current_A, terms);
    use(row, passed_s, terms);
  }
}

}  // namespace bmu::cell
