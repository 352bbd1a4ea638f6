// Regularisation of the tables of a fit, as equations: smooth over charge, similar from temperature to temperature, not
// larger than those of typical cells.
#pragma once

#include "tools/bmucell/fit/fit_plan.hpp"
#include "tools/bmucell/fit/normal_equations.hpp"

namespace bmu::cell {

/// For `rows` rows of temperature. Curves are less constrained at both ends of the charge and tables at the empty end:
/// there electrodes run out, curves bend and resistances rise.
void add_wishes(NormalEquations& equations, const FitWishes& wishes, std::size_t rows);

}  // namespace bmu::cell
