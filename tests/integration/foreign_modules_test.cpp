// The real daemon and the real emulated modules of another maker: what they say gets through to it.
#include <fstream>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

TEST_CASE("a pack of another maker's modules closes with the real daemon, and opens for one that is not heard",
          "[integration][daemon][foreign][bus]") {
  const std::string name = GENERATE("outlander-80s", "i3-96s");
  CAPTURE(name);
  test::Bench bench;
  std::ifstream file(test::in_source("config/packs/" + name + ".json"));
  nlohmann::json pack = nlohmann::json::parse(file, nullptr, true, true);
  pack["cell"] = test::in_source("config/packs/") + pack["cell"].get<std::string>();
  pack["buses"] = {{"internal", bench.bus}, {"vehicle", bench.bus}};
  bench.pack = bench.folder.file("pack.json", pack.dump());
  bench.start_emulator("");
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  REQUIRE(bench.closes());
  bench.send_event("module 3 silent");
  REQUIRE(bench.listener.hears(test::is_open, test::hang_max));
  CHECK(bench.ask_json("status")["last_opening"]["fault"] == "module_lost");
}

}  // namespace bmu
