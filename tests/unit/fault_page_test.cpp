// The page of faults is what the table says.
#include "daemon/shell/fault_page.hpp"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "daemon/core/fault_table.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

TEST_CASE("docs/faults.md is made from the fault table", "[unit][faults][docs]") {
  const std::string file = std::string(BMUD_SOURCE_DIR) + "/docs/faults.md";
  const std::string wanted = fault_page_markdown();
  if (std::getenv("BMUD_REWRITE") != nullptr) std::ofstream(file, std::ios::binary) << wanted;
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream found;
  found << stream.rdbuf();
  INFO("to write it anew: BMUD_REWRITE=1 test_unit \"[docs]\"");
  CHECK(found.str() == wanted);
  for (const FaultRow& row : fault_table()) CHECK(wanted.find("### " + std::string(row.name)) != std::string::npos);
}
