// Kernel receive filter of the daemon: it passes every frame that the modules may send.
#include <algorithm>

#include "daemon/core/vehicle/swapped_buses.hpp"
#include "daemon/shell/can/buses.hpp"
#include "devices/device_list.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/changed_pack.hpp"

using namespace bmu;

namespace {

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config((packs_directory / name).string());
  REQUIRE(pack);
  return pack->core;
}

bool lets_in(const CoreConfig& config, std::uint32_t id, Port port = Port::internal) {
  const std::vector<std::uint32_t> ids = receive_ids(port, config).standard;
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
    CHECK_FALSE(lets_in(config, internal_bus::module.id_of(9)));  // message of this protocol, but of no module here
  }
}

TEST_CASE("modules of ours are heard with every node number, the pack's or not", "[unit][ports]") {
  const CoreConfig config = shipped("demo-48s.json");
  for (const std::uint32_t node : {1U, 4U, 5U, 63U}) CHECK(lets_in(config, internal_bus::status.id_of(node)));
  CHECK_FALSE(lets_in(config, 0x611));
}

TEST_CASE("of the internal bus the vehicle bus lets in what shows that the two are swapped, and no more",
          "[unit][ports][F38]") {
  using namespace internal_bus;
  CoreConfig config = shipped("demo-48s.json");
  const auto is_let_in = [&config](std::uint32_t id) { return lets_in(config, id, Port::vehicle); };
  SECTION("a pack with a unit") {
    CHECK(is_let_in(pdu_status.base_id));
    for (const std::uint32_t node : {1U, 4U}) CHECK(is_let_in(ident.id_of(node)));
    CHECK_FALSE(is_let_in(ident.id_of(5)));  // not of this pack
    for (const MessageSpec* const row : {&status, &cells_1, &response}) CHECK_FALSE(is_let_in(row->id_of(1)));
    for (const MessageSpec* const row : {&sensor_current, &sensor_u1, &sensor_u2, &contactor_command, &poll}) {
      CHECK_FALSE(is_let_in(row->base_id));
    }
  }
  SECTION("a pack without a unit has its sensor") {
    config.contactors.has_pdu = false;
    CHECK_FALSE(is_let_in(pdu_status.base_id));
    for (const MessageSpec* const row : {&sensor_current, &sensor_u1, &sensor_u2}) CHECK(is_let_in(row->base_id));
    config.sensor.bus = Port::vehicle;
    for (const MessageSpec* const row : {&sensor_current, &sensor_u1, &sensor_u2}) {
      CHECK(misplaced_row(config, row->base_id) == nullptr);
    }
  }
  SECTION("an identifier that the pack has another use for is no sign") {
    config.vehicle.base_id = ident.id_of(1) - 8;
    CHECK(is_let_in(ident.id_of(1)));
    CHECK(misplaced_row(config, ident.id_of(1)) == nullptr);
    CHECK(misplaced_row(config, ident.id_of(2)) == &ident);
    config.vehicle.request_id = pdu_status.base_id;
    CHECK(misplaced_row(config, pdu_status.base_id) == nullptr);
  }
}

TEST_CASE("no device that a vehicle bus may have uses an identifier that shows swapped buses", "[unit][ports][F38]") {
  CoreConfig config = shipped("demo-48s.json");
  config.served_by = CoreConfig{}.served_by;  // an inverter on the vehicle bus
  config.modules.clear();
  for (std::uint8_t node = 1; node <= internal_bus::node_count_max; ++node) config.modules.push_back({.node = node});
  for (const bool has_pdu : {true, false}) {
    config.contactors.has_pdu = has_pdu;
    for (const Device* const device : all_devices()) {
      const bool is_of_internal_bus = device->kind == DeviceKind::modules || device->set_up != nullptr;
      if (is_of_internal_bus) continue;
      config.inverter.driver = device->inverter;
      for (const MessageSpec* const message : device->catalogue->messages()) {
        INFO(device->name << " " << message->name);
        CHECK((message->is_extended || misplaced_row(config, message->base_id) == nullptr));
      }
    }
  }
}
