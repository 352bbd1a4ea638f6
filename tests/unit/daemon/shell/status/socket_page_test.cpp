// docs/socket-protocol.md gives the right required by each command. tests/docs checks the rest of that table.
#include <fstream>
#include <sstream>

#include "daemon/shell/status/status_requests.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

using namespace bmu;

TEST_CASE("the page of the status socket tells the right that each command takes", "[unit][status][docs]") {
  std::ifstream stream(test::in_source("docs/socket-protocol.md"), std::ios::binary);
  std::ostringstream page;
  page << stream.rdbuf();
  for (const CommandRight& row : command_rights()) {
    const std::string more = row.control_key.empty() ? "" : "; control with `" + std::string(row.control_key) + "`";
    const std::string right = row.right == Right::read ? "read" + more : "control";
    const std::string wanted = "| `" + std::string(row.name) + "` | " + right + " |";
    CAPTURE(wanted);
    CHECK(page.str().find(wanted) != std::string::npos);
  }
}
