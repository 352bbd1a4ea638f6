// Defective cores, each with one defect, and the rule by which the oracle must detect it: an oracle that has never
// failed a core proves nothing.
#pragma once

#include <vector>

#include "tests/simulation/life.hpp"

namespace bmu::test {

/// Each has a state of its own: for one run.
[[nodiscard]] std::vector<Mutant> make_mutants();

}  // namespace bmu::test
