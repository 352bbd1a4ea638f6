// The real daemon and the real emulated modules of another maker: their messages reach it.
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
  std::ifstream file(test::in_source("config/packs/" + name + ".json"));
  nlohmann::json pack = nlohmann::json::parse(file, nullptr, true, true);
  pack["cell"] = test::in_source("config/packs/") + pack["cell"].get<std::string>();
  std::string fault;
  std::string modules;
  const auto bench = test::driven([&](test::Bench& made) {
    pack["buses"] = {{"internal", made.bus}, {"vehicle", made.bus}};
    made.pack = made.folder.file("pack.json", pack.dump());
    made.start_emulator("");
    made.start_daemon();
    REQUIRE(made.listener.next(test::hang_max));
    REQUIRE(made.closes());
    modules = made.ask({"modules"}).out;
    made.send_event("module 3 silent");
    REQUIRE(made.listener.hears(test::is_open, test::hang_max));
    fault = made.ask_json("status")["last_opening"]["fault"];
    return fault == "module_lost";
  });
  CHECK(fault == "module_lost");
  // Their missing functions, a line each.
  CHECK(modules.find("They watch no cell by themselves and keep no limits") != std::string::npos);
  CHECK(modules.find("its limits lie within what the cell file allows, by at least 10 mV") != std::string::npos);
  CHECK(modules.find("They report no serial number") != std::string::npos);
  const bool has_checksum = name == "i3-96s";
  CHECK((modules.find("Their frames have no checksum") == std::string::npos) == has_checksum);
}

}  // namespace bmu
