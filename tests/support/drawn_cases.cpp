#include "tests/support/drawn_cases.hpp"

#include <cstdlib>
#include <iostream>
#include <sstream>

#include <rapidcheck.h>
#include <rapidcheck/detail/Configuration.h>
#include <rapidcheck/detail/TestListenerAdapter.h>

#include "tests/support/catch.hpp"
#include "tests/support/repeat_command.hpp"

namespace bmu::test {
namespace {

/// Repeats a failed case, as value of RC_PARAMS.
std::string repeat_of(const std::string& name, const rc::detail::TestResult& result) {
  if (!result.is<rc::detail::FailureResult>()) return "";
  rc::detail::Configuration repeat;
  repeat.reproduce[name] = result.get<rc::detail::FailureResult>().reproduce;
  const std::string text = rc::detail::configToMinimalString(repeat);
  return text.substr(0, text.find(' '));  // without the seed, which a repeated case does not use
}

}  // namespace

DrawnCases draw_cases(const std::string& name, int cases, std::uint64_t seed, const std::string& repeat,
                      const std::function<void()>& property) {
  const rc::detail::Configuration configuration = rc::detail::configFromString(repeat);
  const rc::detail::TestMetadata metadata{.id = name, .description = name};
  rc::detail::TestParams params;
  params.seed = seed;
  params.maxSuccess = cases;
  rc::detail::TestListenerAdapter silent;
  const rc::detail::TestResult result =
      rc::detail::checkTestable(property, metadata, params, silent, configuration.reproduce);
  DrawnCases drawn{.is_held = result.is<rc::detail::SuccessResult>(), .is_repeat = !configuration.reproduce.empty()};
  if (drawn.is_held) return drawn;
  std::ostringstream report;
  rc::detail::printResultMessage(result, report);
  const std::string run = "build/bin/test_property " + as_argument(name);
  report << "\nseed " << seed << "; all cases again: BMUD_SEED=" << seed << ' ' << run;
  if (const std::string one = repeat_of(name, result); !one.empty()) {
    report << "\nthis case again: RC_PARAMS='" << one << "' " << run;
  }
  drawn.report = report.str();
  return drawn;
}

bool holds_for_all(int cases, const std::function<void()>& property) {
  const std::string seed = setting("BMUD_SEED");
  const auto name = static_cast<std::string>(Catch::getResultCapture().getCurrentTestName());
  const DrawnCases drawn = draw_cases(name, cases, seed.empty() ? 1 : std::strtoull(seed.c_str(), nullptr, 10),
                                      setting("RC_PARAMS"), property);
  // Not by INFO: Catch2 breaks lines, and the command would have to be put together again.
  if (!drawn.is_held) std::cerr << '\n' << drawn.report << '\n';
  REQUIRE(drawn.is_held);
  return !drawn.is_repeat;
}

}  // namespace bmu::test
