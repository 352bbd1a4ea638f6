// Where the current steps from one level to another, the voltage steps the other way: down as more flows out of the
// cell, up as less does or more flows in. A recording in which it does not at one step in twenty has no sign of its
// current: its charges look like discharges. Small pulses count, too, which implausible_current leaves out.
//
// What a voltage does by itself is no answer. So a step is judged by means of the voltage before and after it, over up
// to five rows of a steady current each; what the voltage moved over as many rows before is taken off where it goes the
// same way; and the rest counts from 1 mV, from ten times the usual difference between two rows by the root of so many
// rows, and from one and a half steps of the voltage's resolution on. In 58 measured recordings of LFP, NMC and NCA
// cells from -25 to 45 C, also with 5 mV of noise and a resolution of 10 mV, one step in 174 at most goes the wrong
// way; of the drives among them without their sign one in nine at least.
#pragma once

#include <string>

#include "tools/bmucell/series.hpp"

namespace bmu::cell {

/// What is wrong with the likely cause, as the end of a message behind the name of the recording
/// (":182: current_A: at 30 of 89 steps ..."); "": nothing. Judged are steps of 0.03 C and of a fifth of the larger
/// current, and more, between levels of two rows and of one row at least that stay within 0.01 C; refused are two
/// steps and more, as one pulse has. Needs time that goes forward. `capacity_Ah`: above 0.
[[nodiscard]] std::string implausible_current_steps(const Series& series, double capacity_Ah);

/// The first problem of all checks of what the voltage answers to the current: implausible_current, the steps above,
/// implausible_steady_current. The same precondition.
[[nodiscard]] std::string implausible_answers(const Series& series, double capacity_Ah);

}  // namespace bmu::cell
