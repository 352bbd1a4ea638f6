// What no test of a cell can be: a recording in other units, with a current of the other sign or without one, with a
// time that starts again. A fit to it gives a cell file, and a wrong one.
//
// Each check returns what is wrong with the likely cause, as the end of a message behind the name of the recording
// (": temp_C: found 296.1 to 299.2, expected ..."); "" if nothing is. The bounds are wide: of the 38 measured drives
// and slow curves that the shipped cell files are fitted to, none comes near one (docs/bmucell.md). Cost: a few passes
// over the rows.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "daemon/core/cell_model.hpp"
#include "tools/bmucell/series.hpp"

namespace bmu::cell {

/// Time goes forward from row to row; a row may repeat the time of the one before.
[[nodiscard]] std::string implausible_time(const Series& series);

/// The same within each cycle of a series that has them.
[[nodiscard]] std::string implausible_time_in_cycles(const Series& series);

/// Voltages are of one cell, in volts; temperatures are in degrees Celsius, as no cell is tested beyond.
[[nodiscard]] std::string implausible_values(const Series& series);

/// The same with temperatures that `cell` permits: most of them, give or take 5 C.
[[nodiscard]] std::string implausible_values(const Series& series, const CellModel& cell);

/// The voltage answers the current as a cell's does: it falls when more flows out, and as charge leaves. Needs time
/// that goes forward. `capacity_Ah`: above 0.
[[nodiscard]] std::string implausible_current(const Series& series, double capacity_Ah);

/// By how much the voltage changes from row to row while the same current flows, but for 0.01 C; 0 without such rows.
struct VoltageNoise {
  double usual_V = 0.0;  // the mean size; of normal noise 1.13 of its standard deviations
  double least_V = 0.0;  // of those that are not 0: the resolution, if that is coarse
};
[[nodiscard]] VoltageNoise voltage_noise(std::span<const SeriesRow> rows, double capacity_Ah);

/// No current flows both ways but for noise, 0.005 C: a current without its sign looks like that.
[[nodiscard]] bool has_one_sign(const Series& series, double capacity_Ah);

/// A recording of charges has currents into the cell.
[[nodiscard]] std::string implausible_charging(const Series& series);

/// The counted charge stays within 0 to 100 %, give or take 15 %, and fits ref_soc_pct where the series has it; without
/// it the count begins at `begin_soc` (0 to 1). Over gaps in the recording the reference is followed. Needs time that
/// goes forward.
[[nodiscard]] std::string implausible_charge(const Series& series, double capacity_Ah, double begin_soc);

/// The charge that left since the first row, in shares of the capacity, after each row: a row's current flowed since
/// the row before; a current that was not measured counts as none.
[[nodiscard]] std::vector<double> charge_out(const Series& series, double capacity_Ah);

}  // namespace bmu::cell
