// Worst-case bus load of a pack: the longest poll cycle and the load, calculated by hand.
#include "config/checks/bus_budget.hpp"

#include "config/checks/bus_guests.hpp"
#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu::test {

TEST_CASE("an answer has the frames that were asked for", "[unit][config][bus_budget]") {
  struct Row {
    std::uint8_t cells;
    PollWants wants;
    std::int64_t frames;
  };
  const PollWants nothing{.status = false, .cells = false, .temperatures = false, .module = false, .identity = false};
  for (const Row& row : {Row{12, all_wants, 9}, Row{12, {}, 8}, Row{1, {}, 5}, Row{3, {}, 5}, Row{4, {}, 6},
                         Row{6, {}, 6}, Row{7, {}, 7}, Row{9, {}, 7}, Row{10, {}, 8}, Row{12, nothing, 0}}) {
    INFO(int{row.cells} << " cells");
    CHECK(answer_frames({.node = 1, .cell_count = row.cells}, row.wants) == row.frames);
  }
  PollWants seldom = nothing;
  seldom.temperatures = true;
  CHECK(answer_frames({}, seldom) == 2);
}

TEST_CASE("the longest cycle is turnaround, POLL, answers, and what cannot be avoided", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  // 2 ms, and 11 frames of 135 bits.
  CHECK(cycle_time_max(config, all_wants, 1'000) == 2ms + 1'485us);
  CHECK(cycle_time_max(config, all_wants, 500) == 2ms + 2'970us);
  CHECK(cycle_time_max(config, {}, 500) == 2ms + 2'700us);
  // With a PDU: its status twice and the command twice.
  config.contactors.has_pdu = true;
  CHECK(cycle_time_max(config, all_wants, 500) == 2ms + 2'970us + 4 * 270us);
  // The cycle of 19 modules ends within 50 ms; that of 20 extends into another period of both.
  CHECK(cycle_time_max(pack_of(19), all_wants, 500) == 2ms + (2 + 171 + 4) * 270us);
  CHECK(cycle_time_max(pack_of(20), all_wants, 500) == 2ms + (2 + 180 + 6) * 270us);
}

TEST_CASE("between two polls there is room for two modules asked alone besides", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  // 11 frames of the cycle; a POLL and 9 frames of the only module.
  CHECK(period_min(config, 500) == 2ms + (11 + 10) * 270us);
  config = pack_of(2);
  config.contactors.has_pdu = false;
  CHECK(period_min(config, 500) == 2ms + (20 + 2 * 10) * 270us);
  CHECK(period_min(config, 1'000) == 2ms + (20 + 2 * 10) * 135us);
  // At most two single polls, and the largest module counts for both.
  config = pack_of(3);
  config.contactors.has_pdu = false;
  config.modules[0].cell_count = config.modules[1].cell_count = 9;
  CHECK(period_min(config, 500) == 2ms + (2 + 8 + 8 + 9 + 2 * 10) * 270us);
  // Frames of higher priority count for the whole time: three periods of both in more than 50 ms.
  CHECK(cycle_time_max(pack_of(18), all_wants, 500) == 2ms + (2 + 162 + 4) * 270us);
  CHECK(period_min(pack_of(18), 500) == 2ms + (2 + 162 + 20 + 6) * 270us);
}

TEST_CASE("temperatures and identities are asked for in their own time at every pace", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  config.poll = {.period = 100ms, .temperature_every = 1};
  constexpr std::int64_t sensed = 5'750 + 2 * 1'916;
  const auto load_at = [&](Duration period) { return bus_load_permille(config, period, 1); };
  // POLL, STATUS, four of CELLS and MODULE with every POLL; TEMP ten times a second, IDENT every 10 s.
  CHECK(load_at(100ms) == 7 * 135 * 10 + 2 * 135 * 10 + 13 + sensed);
  CHECK(load_at(50ms) == 7 * 135 * 20 + 2 * 135 * 10 + 13 + sensed);
  CHECK(load_at(500ms) == 7 * 135 * 2 + 2 * 135 * 2 + 13 + sensed);
  config.poll.temperature_every = 4;
  CHECK(load_at(50ms) == 7 * 135 * 20 + 2 * 135 * 10 / 4 + 13 + sensed);
}

TEST_CASE("the load is what all messages take in their periods", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);
  config.contactors.has_pdu = false;
  // A POLL and 8 answers ten times a second, IDENT every ten seconds; 50 currents and 2 x 16.7 voltages of 115 bits.
  constexpr std::int64_t polled = 9 * 135 * 10 + 13;
  constexpr std::int64_t sensed = 5'750 + 2 * 1'916;
  CHECK(bus_load_permille(config, 100ms, 500) == (polled + sensed + 499) / 500);
  CHECK(bus_load_permille(config, 100ms, 125) == (polled + sensed + 124) / 125);
  const std::int64_t alone = bus_load_permille(config, 100ms, 1'000);
  config.contactors.has_pdu = true;
  CHECK(bus_load_permille(config, 100ms, 1'000) >= alone + 5);  // 40 x 135 bits
  CoreConfig shared = config;
  shared.served_by[static_cast<std::size_t>(Port::vehicle)] = Port::internal;
  CHECK(bus_load_permille(shared, 100ms, 1'000) > bus_load_permille(config, 100ms, 1'000));
  config.poll.period = 50ms;
  const std::int64_t at_50ms = bus_load_permille(config, 50ms, 1'000);
  CHECK(at_50ms >= bus_load_permille(config, 100ms, 1'000) + 12);
  config.poll.temperature_every = 2;
  CHECK(bus_load_permille(config, 50ms, 1'000) < at_50ms);
  config.sensor.has_second_current = true;
  CHECK(bus_load_permille(config, 50ms, 1'000) > bus_load_permille(pack_of(1), 100ms, 1'000) + 5);
}

namespace {

/// The nine messages of a pack to its vehicle: three of eight bytes, one of seven, five of six, each once a second.
constexpr std::int64_t reports_bits = 3 * 135 + 125 + 5 * 115;

/// All devices are on the bus of the modules.
CoreConfig on_one_bus() {
  CoreConfig config = pack_of(1);
  config.served_by = {};
  return config;
}

/// Bus load added by a change of the configuration, in bit/s.
template <class Change>
std::int64_t added(Change change) {
  CoreConfig config = on_one_bus();
  const std::int64_t before = bus_load_permille(config, 100ms, 1);
  change(config);
  return bus_load_permille(config, 100ms, 1) - before;
}

}  // namespace

TEST_CASE("the messages to the vehicle are nine a second, as long as they are", "[unit][config][bus_budget]") {
  CoreConfig apart = on_one_bus();
  apart.served_by[static_cast<std::size_t>(Port::vehicle)] = Port::vehicle;
  CHECK(bus_load_permille(on_one_bus(), 100ms, 1) - bus_load_permille(apart, 100ms, 1) == reports_bits);
  CHECK(guest_load_permille(apart, Port::vehicle, 1) == reports_bits);
  CHECK(guest_load_permille(on_one_bus(), Port::vehicle, 1) == 0);  // served by the port of the internal bus
}

TEST_CASE("chargers take what their own frames take, unit by unit", "[unit][config][bus_budget][BMU_11]") {
  const ChargerDriver* const elcon = find_device("elcon_tc")->charger;
  // 29-bit identifiers and eight bytes: a command twice per second, a report once.
  for (std::uint8_t units = 1; units <= 4; ++units) {
    CHECK(added([&](CoreConfig& config) { config.charger = {.driver = elcon, .unit_count = units}; }) ==
          units * 3 * 160);
  }
  // Seven bytes, four bytes and twice eight bytes ten times per second; eight and five bytes once.
  const ChargerDriver* const brusa = find_device("brusa_nlg5")->charger;
  CHECK(added([&](CoreConfig& config) { config.charger.driver = brusa; }) == 10 * (125 + 95 + 2 * 135) + 135 + 105);
}

TEST_CASE("sensors of others, an insulation monitor and a second pack take theirs", "[unit][config][bus_budget]") {
  CHECK(added([](CoreConfig& config) { config.sensor.first = find_device("lem_cab")->current; }) == 100 * 135);
  CHECK(added([](CoreConfig& config) { config.insulation.driver = find_device("iso165c")->insulation; }) == 115);
  CHECK(added([](CoreConfig& config) { config.second_pack.base_id = 0x640; }) == reports_bits);
  // On another bus they add no load to this one.
  CHECK(added([](CoreConfig& config) {
          config.served_by[static_cast<std::size_t>(Port::charger)] = Port::charger;
          config.insulation = {.driver = find_device("iso165c")->insulation, .bus = Port::charger};
          config.charger.driver = find_device("elcon_tc")->charger;
        }) == 0);
}

TEST_CASE("an inverter takes a round in each of its periods, and its own word", "[unit][config][bus_budget]") {
  CoreConfig config = pack_of(1);  // with the vehicle, apart from the modules
  config.inverter = {.driver = find_device("pylontech")->inverter, .period = 500ms};
  CHECK(guest_load_permille(config, Port::vehicle, 1) == reports_bits + 2 * 6 * 135 + 135);
  config.served_by[static_cast<std::size_t>(Port::inverter)] = Port::inverter;
  CHECK(guest_load_permille(config, Port::vehicle, 1) == reports_bits);
  CHECK(guest_load_permille(config, Port::inverter, 1) == 2 * 6 * 135 + 135);
  CHECK(guest_load_permille(config, Port::charger, 1) == 0);
}

TEST_CASE("others with a lower identifier than an answer go ahead of it", "[unit][config][bus_budget]") {
  CoreConfig config = on_one_bus();
  config.contactors.has_pdu = false;
  const Duration alone = *cycle_time_max(config, all_wants, 500);
  CHECK(alone == 2ms + 11 * 270us);  // the vehicle messages have a lower priority
  config.charger = {.driver = find_device("elcon_tc")->charger, .unit_count = 4};
  config.sensor.first = find_device("lem_cab")->current;
  CHECK(cycle_time_max(config, all_wants, 500) == alone);  // a lower priority, too
  config.insulation.driver = find_device("iso165c")->insulation;
  CHECK(cycle_time_max(config, all_wants, 500) == alone + 2 * 230us);  // 037h has a higher one: 115 bits, twice
  config.second_pack.base_id = 0x010;
  CHECK(cycle_time_max(config, all_wants, 500) == alone + 2 * 230us + 2 * reports_bits * 2us);
  CHECK(goes_ahead({.id = 0x0C00'0000, .is_extended = true}, 0x301));
  CHECK_FALSE(goes_ahead({.id = 0x0C04'0000, .is_extended = true}, 0x301));
}

}  // namespace bmu::test
