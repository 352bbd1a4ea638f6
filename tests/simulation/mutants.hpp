// Cores that do wrong, each in one way, and the rule by which the oracle has to notice: a judge who has never found
// anybody guilty is none.
#pragma once

#include <vector>

#include "tests/simulation/life.hpp"

namespace bmu::test {

/// Each with a memory of its own: good for one life.
[[nodiscard]] std::vector<Mutant> make_mutants();

}  // namespace bmu::test
