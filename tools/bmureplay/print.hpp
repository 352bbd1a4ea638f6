// The result of a run, as text and as JSON.
#pragma once

#include <string>

#include "tools/bmureplay/run.hpp"

namespace bmu::replay {

/// `other_name`: the pack file used instead of the recorded one; "" for none.
[[nodiscard]] std::string outcome_text(const Outcome& outcome, const std::string& other_name);
[[nodiscard]] std::string outcome_json(const Outcome& outcome, const std::string& other_name);

/// The exit code, as --help lists it.
[[nodiscard]] int exit_code_of(const Outcome& outcome);

}  // namespace bmu::replay
