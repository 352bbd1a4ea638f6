// How much charge each cell has too much: three planners behind one interface, one row each.
//
//   terminal_voltage   only while the highest cell stands at or above balancing/top_mV: there the curve is steep. What
//                      a cell stands above the lowest, by the steepest slope of the curve from top_mV, or from the
//                      lowest cell, on.
//   ocv                V + R * I of each cell (I positive out of it), put into the curve: the charge that lies between.
//                      Above its end the last slope goes on: an upper bound, as real curves get steeper there.
//                      Wants each cell's resistance, measured (step_response.hpp), unless the current is, and has
//                      been, so small that the model's whole resistance does not make a dead band of it. What follows
//                      the current late (polarisation.hpp) nobody measures: where a cell's resistance differs from the
//                      lowest cell's, `late_share` times as much of it is taken off, and as much as the coldest and
//                      the warmest cell may differ by
//   charge             what is missing in each cell until it is full (cell_charge.hpp): all are to be full at once. The
//                      voltage does not matter, so it works on a flat curve and at any time.
//
// Nothing is guessed. A planner that lacks what it needs of one cell plans nothing for any, and its verdict says what.
// What is planned is a lower bound: the dead band and what may be error are taken off first. For voltages that is half
// the dead band and the hysteresis at either end, for charges the uncertainty of both cells. (Except by terminal
// voltage while a current flows: a cell with more resistance than others then counts as fuller than it is.) On a flat
// stretch the voltage methods so find nothing, and no cell is bled below the lowest.
//
// Where the formulas come from: the open-circuit voltage method is what the 2013 generation of these systems did while
// charging; aligning missing charge is G. L. Plett, Battery Management Systems, Vol. II, Artech House 2016, chapter 5.
// Cost: a search in the curve for each cell.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "daemon/core/estimation/cell_charge.hpp"
#include "daemon/core/types/bleed_current.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// A cell that does not bleed and has settled.
struct BalancingCell {
  std::int32_t voltage_uV = 0;
  std::int32_t resistance_uOhm = 0;  // at once, measured; 0: not known
  CellCharge charge;
};

struct BalancingView {
  std::span<const BalancingCell> cells;  // all of the pack; at least one
  std::int32_t current_mA = 0;           // out of the pack, while the voltages were taken
  double late_uV = 0.0;                  // what follows the current late, at the most, of a cell of the file at 25 C
  std::int32_t coldest_dC = 250;         // of the cells
  std::int32_t warmest_dC = 250;
};

/// By how much more than what shows at once what follows late may differ between two cells, and for a resistance that
/// was measured at another temperature.
inline constexpr double late_share = 2.0;

enum class PlanVerdict : std::uint8_t {
  none,                // nothing was planned yet
  planned,             // some cell has too much
  balanced,            // none has, for sure
  below_top,           // terminal_voltage: not near the top of a charge
  resistance_unknown,  // ocv: too much current to do without it
  charge_unknown,      // charge: of at least one cell
};

[[nodiscard]] std::string_view to_text(PlanVerdict verdict);

/// In the order of BalancingMethod.
inline constexpr std::array<std::string_view, 3> balancing_method_names{"terminal_voltage", "ocv", "charge"};
[[nodiscard]] constexpr std::string_view to_text(BalancingMethod method) {
  return balancing_method_names[static_cast<std::size_t>(method)];
}

/// Fills `remove_uAs`, as many as there are cells: 0 or more each, all 0 unless the verdict is `planned`.
PlanVerdict plan_balancing(const BalancingView& view, const CoreConfig& config, std::span<std::int64_t> remove_uAs);

/// How far the voltages of two cells may be apart, at rest, without either being bled by a method that goes by
/// voltages: the dead band, and the whole gap between the curves of charging and discharging.
[[nodiscard]] std::int32_t left_by_voltage_uV(const CoreConfig& config);

/// The longest a module bleeds without being told again.
inline constexpr std::uint8_t balancing_minutes_max = 5;

/// Whole minutes that take no more than this charge from a cell at this voltage: rounded down, 0 to 5.
[[nodiscard]] std::uint8_t balancing_minutes(std::int64_t remove_uAs, std::int32_t voltage_uV,
                                             const BalancingConfig& config);

}  // namespace bmu
