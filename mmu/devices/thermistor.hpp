// An NTC thermistor of 10 kOhm at 25 C, against a resistor of 10 kOhm:
//
//   reference ---[10 k]---+---[NTC]--- ground        share = NTC / (NTC + 10 k), of the reference
//                         |
//                       input
//
// The converter reads the input and its own reference, so the reference cancels. Colder is higher; a broken wire reads
// the whole reference, a short nothing.
//
// Two curves for the same part, and a module uses one of them:
//   table            26 resistances, 0 to 125 C in steps of 5 C, with straight lines between (MMU_NTC)
//   steinhart_hart   1/T = a + b L + c L^2 + d L^3 with L = ln(R / 10 kOhm), T in kelvin (RR_5)
// They differ by 0.85 K at 0 C, by at most 0.46 K from 20 to 90 C, by 0.42 K at 100 C, 0.92 K at 125 C.
//
// Batteries are also used outside the table. There the curve continues as Steinhart-Hart, shifted so that both meet at
// the table's end: no step and no corner that could hide a limit, and at -20 C within 1 K of the formula. A reading
// clamped at 0 C would permit charging a frozen cell.
//
// Floating point, a logarithm or an exponential outside the table and for Steinhart-Hart; about 50 ns on a desktop
// core.
#pragma once

#include <cstdint>

#include "protocol/signal.hpp"

namespace bmu {

enum class ThermistorCurve : std::uint8_t { table, steinhart_hart };

inline constexpr double divider_resistance_Ohm = 10e3;

// Beyond these there is no thermistor: -76 C and 297 C by the formula.
inline constexpr double thermistor_open_above_Ohm = 2e6;
inline constexpr double thermistor_short_below_Ohm = 30.0;

/// Resistance at a temperature of -60 to 250 C.
[[nodiscard]] double thermistor_Ohm(ThermistorCurve curve, double temperature_C);

/// Inverse function. Precondition: `resistance_Ohm` is above 0.
[[nodiscard]] double thermistor_C(ThermistorCurve curve, double resistance_Ohm);

/// Reading of the converter at the divider, as a share of its reference, 0 to 1.
[[nodiscard]] constexpr double divider_share(double resistance_Ohm) {
  return resistance_Ohm / (resistance_Ohm + divider_resistance_Ohm);
}

/// Temperature from the raw readings of input and reference, to tenths of a degree; open_circuit or short_circuit if no
/// thermistor can be read. A reference of 0 is unknown.
[[nodiscard]] SignalValue temperature_dC(ThermistorCurve curve, std::uint16_t input_raw, std::uint16_t reference_raw);

}  // namespace bmu
