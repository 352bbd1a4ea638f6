// Faults on the wire and the reaction of the core: two modules with one number, a babbling station, a master with a
// controller that goes bus-off and comes back.
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {
namespace {

constexpr BusConfig exact_bus{};

WiredPack closed_pack() {
  WiredPack pack(small_pack(), {}, exact_bus);
  pack.run(2500ms);
  REQUIRE(pack.close());
  pack.run(500ms);
  return pack;
}

bool is_present(const WiredPack& pack, FaultId id) {
  return pack.core().faults().state(id).is_present();
}
bool is_closed(const WiredPack& pack) {
  return pack.phase() == Phase::closed;
}

/// Every frame of the master is disturbed until its controller is off the bus.
void drive_master_off(WiredPack& pack) {
  pack.bus().disturb = [](Station sender, const CanFrame&, TimePoint) -> std::optional<WireFault> {
    if (sender != Station::master) return {};
    return WireFault{.hurt = Hurt::sender};
  };
  REQUIRE(pack.run_until([](const WiredPack& one) { return one.bus().state(Station::master) == ErrorState::bus_off; },
                         500ms));
  pack.bus().disturb = {};
}

}  // namespace

TEST_CASE("two modules with one number disturb each other on the wire, open the pack and are named",
          "[simulation][can][F30]") {
  WiredPack pack = closed_pack();
  const std::uint8_t node = pack.last_node();
  pack.connect_twin({.node = node, .cell_count = 4, .temperature_sensor_count = 2, .serial_number = 77});
  CHECK(pack.run_until([](const WiredPack& one) { return is_present(one, FaultId::duplicate_node); }, 3s));
  CHECK(pack.core().faults().state(FaultId::duplicate_node).confirmed.element.module_node == node);
  CHECK(pack.run_until([](const WiredPack& one) { return !one.coils_are_driven(); }, 1s));
  // Errors have led there: each frame of one collides with the other's.
  CHECK(pack.bus().counters(static_cast<Station>(node)).transmit > 96);
  CHECK(pack.bus().counters(Station::twin).transmit > 96);
  CHECK(pack.bus().state(Station::master) != ErrorState::bus_off);
}

TEST_CASE("a station that babbles with the strongest identifier opens the pack, when it ends all are heard again",
          "[simulation][can]") {
  WiredPack pack = closed_pack();
  pack.flood = CanFrame{.id = 0, .length = 8};
  const Duration before = pack.bus().busy(pack.now());
  const TimePoint began_at = pack.now();
  CHECK(pack.run_until([](const WiredPack& one) { return !one.coils_are_driven(); }, 300ms));
  CHECK(pack.bus().busy(pack.now()) - before >= (pack.now() - began_at) * 99 / 100);
  CHECK(is_present(pack, FaultId::module_lost));
  pack.flood = {};
  pack.run(2s);
  pack.give(Command::clear_faults);
  pack.run(100ms);
  CHECK_FALSE(is_present(pack, FaultId::module_lost));
  CHECK_FALSE(is_present(pack, FaultId::pdu_lost));
}

TEST_CASE("errors of everybody's frames for 20 ms are ridden through, for 500 ms they open", "[simulation][can]") {
  for (const auto& [duration, stays_closed] : {std::pair{20ms, true}, {500ms, false}}) {
    WiredPack pack = closed_pack();
    const TimePoint ends_at = pack.now() + duration;
    pack.bus().disturb = [ends_at](Station, const CanFrame&, TimePoint now) -> std::optional<WireFault> {
      if (now >= ends_at) return {};
      return WireFault{.hurt = Hurt::all_receivers, .bit = 30};
    };
    pack.run(duration + 300ms);
    INFO(to_ms(duration) << " ms");
    CHECK(is_closed(pack) == stays_closed);
  }
}

TEST_CASE("a master that goes passive says so, and is healthy again after good frames", "[simulation][can]") {
  WiredPack pack = closed_pack();
  pack.bus().disturb = [left = 16](Station sender, const CanFrame&, TimePoint) mutable -> std::optional<WireFault> {
    if (sender != Station::master || left == 0) return {};
    --left;
    return WireFault{.hurt = Hurt::sender};
  };
  CHECK(pack.run_until([](const WiredPack& one) { return is_present(one, FaultId::bus_error_passive); }, 2s));
  CHECK(is_closed(pack));
  CHECK(pack.run_until([](const WiredPack& one) { return !is_present(one, FaultId::bus_error_passive); }, 10s));
  CHECK(pack.bus().state(Station::master) == ErrorState::active);
  CHECK(is_closed(pack));
}

TEST_CASE("a master off the bus: the core knows, the unit opens within 300 ms, and nothing is heard until a restart",
          "[simulation][can]") {
  WiredPack pack = closed_pack();
  drive_master_off(pack);
  const TimePoint off_at = pack.now();
  pack.run(1ms);
  CHECK(is_present(pack, FaultId::internal_bus_down));
  CHECK_FALSE(pack.core().outputs().any_contactor());
  CHECK(pack.run_until([](const WiredPack& one) { return !one.coils_are_driven(); }, 300ms));
  CHECK(pack.now() - off_at <= 300ms);
  pack.run(10s);
  CHECK(is_present(pack, FaultId::internal_bus_down));
  pack.bus().restart(Station::master, pack.now());
  CHECK(pack.run_until([](const WiredPack& one) { return !is_present(one, FaultId::internal_bus_down); }, 3s));
}

TEST_CASE("a controller that restarts by itself brings the bus back, the third time within a minute is a fault",
          "[simulation][can]") {
  WiredPack pack = closed_pack();
  pack.bus().set_restart(Station::master, 200ms);
  for (int time = 1; time <= 3; ++time) {
    drive_master_off(pack);
    CHECK(pack.run_until([](const WiredPack& one) { return !one.coils_are_driven(); }, 300ms));
    CHECK(is_present(pack, FaultId::bus_off_storm) == (time == 3));
    CHECK(pack.run_until([](const WiredPack& one) { return !is_present(one, FaultId::internal_bus_down); }, 3s));
    pack.run(3s);
  }
  CHECK(is_present(pack, FaultId::bus_off_storm));
  CHECK_FALSE(pack.coils_are_driven());
}

}  // namespace bmu::test
