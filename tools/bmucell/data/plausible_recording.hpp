// Checks for recordings that cannot be a test of a cell: other units, a current of the opposite sign or without sign, a
// time that restarts. A fit to such a recording yields a cell file, but a wrong one.
//
// Each check returns the error with its likely cause, as the end of a message after the name of the recording
// (": temp_C: found 296.1 to 299.2, expected ..."); "" for none. The bounds are wide: of the 38 measured drives and
// slow curves that the shipped cell files are fitted to, none comes near one (docs/bmucell.md). Cost: a few passes over
// the rows.
#pragma once

#include <string>
#include <vector>

#include "daemon/core/cell/cell_model.hpp"
#include "tools/bmucell/data/series.hpp"

namespace bmu::cell {

/// Checks that time does not decrease from row to row; a row may repeat the time of the row before.
[[nodiscard]] std::string implausible_time(const Series& series);

/// The same within each cycle of a series with cycles.
[[nodiscard]] std::string implausible_time_in_cycles(const Series& series);

/// Checks that voltages are of one cell, in volts, and temperatures in degrees Celsius, within the range of cell tests.
[[nodiscard]] std::string implausible_values(const Series& series);

/// The same with temperatures that `cell` permits: most of them, with a tolerance of 5 C.
[[nodiscard]] std::string implausible_values(const Series& series, const CellModel& cell);

/// Checks that the voltage follows the current as that of a cell does: it falls when the discharge current increases,
/// and as charge leaves. Precondition: time does not decrease. `capacity_Ah`: above 0.
[[nodiscard]] std::string implausible_current(const Series& series, double capacity_Ah);

/// True if the current has one direction only except for noise, 0.005 C: this indicates a current without its sign.
[[nodiscard]] bool has_one_sign(const Series& series, double capacity_Ah);

/// Checks that a recording of charges has currents into the cell.
[[nodiscard]] std::string implausible_charging(const Series& series);

/// Checks that the counted charge stays within 0 to 100 %, with a tolerance of 15 %, and matches ref_soc_pct if the
/// series has it; without it the count starts at `begin_soc` (0 to 1). Gaps in the recording are bridged with the
/// reference. Precondition: time does not decrease.
[[nodiscard]] std::string implausible_charge(const Series& series, double capacity_Ah, double begin_soc);

/// The charge that left since the first row, in shares of the capacity, after each row: the current of a row flowed
/// since the row before; a current that was not measured counts as none.
[[nodiscard]] std::vector<double> charge_out(const Series& series, double capacity_Ah);

}  // namespace bmu::cell
