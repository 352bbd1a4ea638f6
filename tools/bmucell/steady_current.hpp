// A steady current moves the voltage one way: down while it flows out of the cell, up while it flows in. A recording in
// which it goes the other way for long has no sign of its current, or another one.
//
// What a cell does by itself is no such way. After a larger current the voltage comes back while a smaller one flows:
// that slows down, and is over after three times the slowest time constant of a cell, 600 s. So the voltage goes
// against the current where it does so by 10 mV, and by five standard deviations of its noise, from one span of time to
// the next, and no less than half as far as in the span before unless a span is 30 min. Spans are 10 min, and longer by
// factors of two. Of 58 measured recordings of LFP, NMC and NCA cells from -25 to 45 C none is refused, also with 5 mV
// of noise and a resolution of 10 mV, and each of the twelve slow charges among them is without its sign. The shipped
// cell files' polarisation after 3 C comes back by up to 45 mV in a span, and slows down.
#pragma once

#include <string>

#include "tools/bmucell/series.hpp"

namespace bmu::cell {

/// What is wrong with the likely cause, as the end of a message behind the name of the recording
/// (":182: current_A: from 10800 to 12300 s ..."); "": nothing. Only currents of 0.02 C and more that stay within 5 %
/// for 25 min are judged, and no cell below 10 C that warms by more than 2 C: its resistance falls meanwhile. Needs
/// time that goes forward. `capacity_Ah`: above 0.
[[nodiscard]] std::string implausible_steady_current(const Series& series, double capacity_Ah);

}  // namespace bmu::cell
