// A steady current moves the voltage in one direction: down while it flows out of the cell, up while it flows in. A
// recording in which the voltage moves the other way for long has a current without its sign, or with the opposite one.
//
// The relaxation of a cell is no such change. After a larger current the voltage recovers while a smaller one flows:
// this slows down, and ends after three times the slowest time constant of a cell, 600 s. So the voltage counts as
// moving against the current if it does so by 10 mV from one span of time to the next, and by no less than half the
// distance of the span before unless a span is 30 min. Spans are 10 min, and longer by factors of two. Of 58 measured
// recordings of LFP, NMC and NCA cells from -25 to 45 C none is refused, and each of the twelve slow charges among them
// is refused without its sign. With the shipped cell files the polarisation after 3 C recovers by up to 45 mV in a
// span, and slows down.
#pragma once

#include <string>

#include "tools/bmucell/data/series.hpp"

namespace bmu::cell {

/// The error with its likely cause, as the end of a message after the name of the recording (":182: current_A: from
/// 10800 to 12300 s ..."); "": none. Only currents of 0.02 C and more that stay within 5 % for 25 min are checked, and
/// no cell below 10 C that warms by more than 2 C, because its resistance falls meanwhile. Precondition: time does not
/// decrease. `capacity_Ah`: above 0.
[[nodiscard]] std::string implausible_steady_current(const Series& series, double capacity_Ah);

}  // namespace bmu::cell
