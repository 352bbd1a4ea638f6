// Catch2's main; skips the cases that this machine cannot run (needs.hpp) and prints their number.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
#else
#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>
#endif
#include <iostream>

#include "tests/support/needs.hpp"

namespace {

bool only_lists(const Catch::ConfigData& chosen) {
#if __has_include(<catch2/catch_all.hpp>)
  return chosen.listTests || chosen.listTags || chosen.listReporters || chosen.listListeners;
#else
  return chosen.listTests || chosen.listTags || chosen.listReporters || chosen.listTestNamesOnly;
#endif
}

/// Number of cases that the session's patterns select.
std::size_t count_chosen(Catch::Session& session) {
  auto& config = session.config();
  return Catch::filterTests(Catch::getAllTestCasesSorted(config), config.testSpec(), config).size();
}

}  // namespace

int main(int argc, char** argv) {
  Catch::Session session;
  if (const int status = session.applyCommandLine(argc, argv); status != 0) return status;
  Catch::ConfigData chosen = session.configData();
  if (chosen.showHelp || only_lists(chosen)) return session.run();
  const std::vector<bmu::test::MissingNeed> missing = bmu::test::missing_needs();
  if (missing.empty()) return session.run();

  if (chosen.testsOrTags.empty()) chosen.testsOrTags.emplace_back("~[.]");
  session.useConfigData(chosen);
  const std::size_t wanted = count_chosen(session);
  for (std::string& pattern : chosen.testsOrTags) pattern = bmu::test::without(pattern, missing);
  session.useConfigData(chosen);
  const std::size_t possible = count_chosen(session);
  if (possible < wanted) {
    std::cout << "skipped: " << wanted - possible << " of " << wanted << " cases:";
    for (const auto& need : missing) std::cout << " tagged " << need.tag << ", " << need.text << ';';
    std::cout << std::endl;
    if (possible == 0) return bmu::test::skipped_status;
  }
  return session.run();
}
