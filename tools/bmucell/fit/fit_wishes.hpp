// What a fit wishes of the tables, as equations: smooth over charge, alike from temperature to temperature, not larger
// than cells are.
#pragma once

#include "tools/bmucell/fit/fit_plan.hpp"
#include "tools/bmucell/fit/normal_equations.hpp"

namespace bmu::cell {

/// For `rows` rows of temperature. The ends of the charge are left freer: there electrodes run out, curves bend and
/// resistances rise.
void add_wishes(NormalEquations& equations, const FitWishes& wishes, std::size_t rows);

}  // namespace bmu::cell
