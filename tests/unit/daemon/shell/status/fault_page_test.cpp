// Troubleshooting pages match the tables.
#include "daemon/shell/status/fault_page.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "daemon/shell/status/advice.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

using namespace bmu;

namespace {

std::string bytes_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

}  // namespace

TEST_CASE("docs/faults.md is made from the fault table", "[unit][faults][docs]") {
  const std::string file = test::in_source("docs/faults.md");
  const std::string wanted = fault_page_markdown();
  if (std::getenv("BMUD_REWRITE") != nullptr) std::ofstream(file, std::ios::binary) << wanted;
  INFO("to write it anew: BMUD_REWRITE=1 test_unit \"[docs]\"");
  CHECK(bytes_of(file) == wanted);
  for (const FaultRow& row : fault_table()) {
    CAPTURE(row.name);
    CHECK(wanted.find("### " + std::string(row.name)) != std::string::npos);
    CHECK(wanted.find("- Typical cause: " + std::string(usual_cause_of(row.id)) + "\n") != std::string::npos);
    CHECK(wanted.find("- Action: " + std::string(row.remedy) + "\n") != std::string::npos);
  }
}

TEST_CASE("docs/why-does-it-not-close.md has every reason against closing, as the daemon words it",
          "[unit][permission][docs]") {
  const std::string file = test::in_source("docs/why-does-it-not-close.md");
  const std::string begin = "<!-- begin of the reasons: written by BMUD_REWRITE=1 test_unit \"[docs]\" -->\n\n";
  const std::string end = "<!-- end of the reasons -->\n";
  const std::string page = bytes_of(file);
  const std::size_t from = page.find(begin);
  const std::size_t to = page.find(end);
  REQUIRE(from != std::string::npos);
  REQUIRE(to != std::string::npos);
  const std::string wanted = page.substr(0, from + begin.size()) + blocker_sections_markdown() + page.substr(to);
  if (std::getenv("BMUD_REWRITE") != nullptr) std::ofstream(file, std::ios::binary) << wanted;
  INFO("to write it anew: BMUD_REWRITE=1 test_unit \"[docs]\"");
  CHECK(bytes_of(file) == wanted);
  for (std::size_t index = 0; index < blocker_count; ++index) {
    const std::string words(to_text(static_cast<Blocker>(index)));
    CAPTURE(words);
    CHECK(blocker_sections_markdown().find(words.substr(1)) != std::string::npos);
  }
}
