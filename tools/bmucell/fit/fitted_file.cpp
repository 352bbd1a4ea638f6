#include "tools/bmucell/fit/fitted_file.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bmu::cell {

namespace {

constexpr double room_C = 25.0;
constexpr double half_full = 0.5;
constexpr double uV_per_V = 1e6;
/// Denser where the curve bends.
constexpr std::array soc_permille{0,   20,  40,  60,  80,  100, 150, 200, 250, 300, 350, 400, 450, 500,
                                  550, 600, 650, 700, 750, 800, 850, 900, 920, 940, 960, 980, 1000};

void set_curve(CellModel& model, const CellDynamics& cell) {
  model.ocv.clear();
  std::int32_t before_uV = 0;
  for (const int permille : soc_permille) {
    const double ocv_V = at(cell, permille / 1000.0, room_C).ocv_V;
    // Strictly rising, as the cell file requires, also where the tables rise by less than a microvolt.
    const auto ocv_uV = std::max(static_cast<std::int32_t>(std::lround(ocv_V * uV_per_V)), before_uV + 1);
    model.ocv.push_back({permille, ocv_uV});
    before_uV = ocv_uV;
  }
}

}  // namespace

CellFile with_fit(CellFile file, const Fit& fit) {
  const CellDynamics& cell = fit.cell;
  const CellPoint room = at(cell, half_full, room_C);
  CellModel& model = file.model;
  model.capacity_uAs = std::llround(cell.capacity_As * uV_per_V);
  set_curve(model, cell);
  // RC elements 1 and 2 are merged into one, with their mean time constant weighted by resistance.
  model.series_resistance_Ohm = room.series_Ohm + room.kinetic_Ohm;
  model.rc_resistance_Ohm = room.pair_Ohm[0] + room.pair_Ohm[1];
  model.rc_time_constant_s =
      model.rc_resistance_Ohm > 0.0
          ? (room.pair_Ohm[0] * cell.pair_time_constant_s[0] + room.pair_Ohm[1] * cell.pair_time_constant_s[1]) /
                model.rc_resistance_Ohm
          : cell.pair_time_constant_s[0];
  model.slow_rc_resistance_Ohm = room.pair_Ohm[2];
  model.slow_rc_time_constant_s = cell.pair_time_constant_s[2];
  model.resistance_activation_K = cell.activation_K;
  model.hysteresis_V = room.hysteresis_V;
  model.hysteresis_charge_permille = cell.hysteresis_charge * 1000.0;
  file.dynamics = cell;
  return file;
}

}  // namespace bmu::cell
