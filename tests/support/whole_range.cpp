#include "tests/support/whole_range.hpp"

#include <iostream>

#include "tests/support/catch.hpp"
#include "tests/support/repeat_command.hpp"

namespace bmu::test {

WholeRange::WholeRange() : only_(setting("BMUD_CASE")) {}

void WholeRange::attempt(const std::string& text, std::size_t steps, const std::function<std::string()>& problem_of) {
  if (!has(text)) return;
  ++cases_.tried;
  std::string problem = problem_of();
  if (problem.empty()) return;
  const bool is_plainer = cases_.failed == 0 || steps < steps_;
  ++cases_.failed;
  if (!is_plainer) return;
  steps_ = steps;
  cases_.plainest = text;
  cases_.problem = std::move(problem);
}

std::string report_of(const TriedCases& cases, const std::string& name) {
  return std::to_string(cases.failed) + " of " + std::to_string(cases.tried) +
         " cases fail, the plainest: " + cases.plainest + ": " + cases.problem + "\nthis case again: BMUD_CASE='" +
         cases.plainest + "' build/bin/test_property " + as_argument(name);
}

void WholeRange::check() const {
  // Not by INFO: Catch2 breaks lines, and the command would have to be put together again.
  if (cases_.failed > 0) {
    const auto name = static_cast<std::string>(Catch::getResultCapture().getCurrentTestName());
    std::cerr << '\n' << report_of(cases_, name) << '\n';
  }
  INFO("tried of BMUD_CASE: '" << only_ << "'");
  CHECK(cases_.tried > 0);
  CHECK(cases_.failed == 0);
}

}  // namespace bmu::test
