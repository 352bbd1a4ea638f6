// What the kernel lets through to the daemon: whatever its modules may say.
#include <algorithm>

#include "daemon/shell/buses.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/changed_pack.hpp"

using namespace bmu;

namespace {

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config((packs_directory / name).string());
  REQUIRE(pack);
  return pack->core;
}

bool lets_in(const CoreConfig& config, std::uint32_t id) {
  const std::vector<std::uint32_t> ids = receive_ids(Port::internal, config).standard;
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

}  // namespace

TEST_CASE("all that modules of another maker answer, and what another master would ask them, is heard",
          "[unit][ports][foreign_modules]") {
  for (const char* const name : {"outlander-80s.json", "i3-96s.json"}) {
    INFO(name);
    const CoreConfig config = shipped(name);
    const ModuleDriver& driver = *config.foreign.driver;
    for (const ModuleConfig& module : config.modules) {
      const ModuleFrames answers = driver.answers(module.node, {}, {}, 1, {});
      CHECK(answers.size() > 0);
      for (const CanFrame& frame : answers) CHECK(lets_in(config, frame.id));
      CHECK(lets_in(config, driver.ask({.node = module.node}, driver.start_rounds, {}).id));
    }
    CHECK(lets_in(config, internal_bus::pdu_status.base_id));
    CHECK(lets_in(config, internal_bus::sensor_current.base_id));
    CHECK_FALSE(lets_in(config, internal_bus::module.id_of(9)));  // of ours, and nobody's here
  }
}

TEST_CASE("modules of ours are heard with every node number, the pack's or not", "[unit][ports]") {
  const CoreConfig config = shipped("demo-48s.json");
  for (const std::uint32_t node : {1U, 4U, 5U, 63U}) CHECK(lets_in(config, internal_bus::status.id_of(node)));
  CHECK_FALSE(lets_in(config, 0x611));
}
