// Excess charge of each cell: three planners behind one interface, one row each.
//
//   terminal_voltage   only while the highest cell is at or above balancing/top_mV: there the curve is steep. The
//                      voltage of a cell above the lowest, by the steepest slope of the curve from top_mV, or from the
//                      lowest cell, on.
//   ocv                V + R * I of each cell (I positive out of it), converted by the curve: the charge in between.
//                      Above its end the last slope continues: an upper bound, as real curves get steeper there.
//                      Requires each cell's resistance, measured (step_response.hpp), unless the current is, and has
//                      been, so small that the drop by the model's whole resistance is within the dead band. The
//                      polarisation (polarisation.hpp) is not measured: where a cell's resistance differs from the
//                      lowest cell's, `late_share` times as much of it is subtracted, and the possible difference
//                      between the coldest and the warmest cell
//   charge             the charge that each cell lacks until it is full (cell_charge.hpp): all are to be full at once.
//                      The voltage does not matter, so it works on a flat curve and at any time.
//
// Nothing is guessed. A planner that lacks an input of one cell plans nothing for any, and its verdict names the input.
// The plan is a lower bound: the dead band and the possible errors are subtracted first. For voltages that is half the
// dead band and the hysteresis at either end, for charges the uncertainty of both cells. (Except by terminal voltage
// while a current flows: a cell with more resistance than others then counts as fuller than it is.) On a flat stretch
// the voltage methods therefore find nothing, and no cell is bled below the lowest.
//
// Sources: the open-circuit voltage method is that of the 2013 generation of these systems while charging; aligning
// missing charge is G. L. Plett, Battery Management Systems, Vol. II, Artech House 2016, chapter 5.
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
  std::int32_t resistance_uOhm = 0;  // immediate, measured; 0: unknown
  CellCharge charge;
};

struct BalancingView {
  std::span<const BalancingCell> cells;  // all of the pack; at least one
  std::int32_t current_mA = 0;           // out of the pack, while the voltages were taken
  double late_uV = 0.0;                  // maximum polarisation of a cell of the file at 25 C
  std::int32_t coldest_dC = 250;         // of the cells
  std::int32_t warmest_dC = 250;
};

/// Factor for the difference of two cells in their polarisation, which may exceed that of their immediate resistance,
/// and for a resistance that was measured at another temperature.
inline constexpr double late_share = 2.0;

enum class PlanVerdict : std::uint8_t {
  none,                // no plan yet
  planned,             // some cell has an excess
  balanced,            // no cell has a certain excess
  below_top,           // terminal_voltage: not near the top of a charge
  resistance_unknown,  // ocv: the current is too large to do without it
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

/// Difference in voltage of two cells, at rest, up to which no method by voltages bleeds either: the dead band, and the
/// whole gap between the curves of charging and discharging.
[[nodiscard]] std::int32_t left_by_voltage_uV(const CoreConfig& config);

/// Maximum time for which a module bleeds without another command.
inline constexpr std::uint8_t balancing_minutes_max = 5;

/// Whole minutes that take no more than this charge from a cell at this voltage: rounded down, 0 to 5.
[[nodiscard]] std::uint8_t balancing_minutes(std::int64_t remove_uAs, std::int32_t voltage_uV,
                                             const BalancingConfig& config);

}  // namespace bmu
