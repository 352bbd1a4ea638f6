// The two supplies of a module and its behaviour on each of them: normal, autonomous, asleep, without power.
#include <algorithm>

#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;
using namespace internal_bus;

constexpr std::int64_t done = static_cast<std::int64_t>(CommandResult::done);
constexpr std::int64_t refused = static_cast<std::int64_t>(CommandResult::refused_in_this_mode);

// --- the monitor alone ----------------------------------------------------------------------------------------------

TEST_CASE("four low readings in a row are a failure, four good ones its end", "[unit][mmu][MMU_7][MMU_11]") {
  constexpr std::int32_t good_mV = 5'000;
  constexpr std::int32_t low_mV = 4'999;
  SupplyMonitor monitor;
  const auto note = [&monitor](std::int32_t external_mV, int times) {
    for (int time = 0; time < times; ++time) monitor.note(external_mV, 40'000);
  };
  CHECK(monitor.in_use() == SupplyInUse::external);
  note(low_mV, 3);
  CHECK_FALSE(monitor.is_external_low());
  note(good_mV, 1);
  note(low_mV, 3);
  CHECK(monitor.in_use() == SupplyInUse::external);
  note(low_mV, 1);
  CHECK(monitor.is_external_low());
  CHECK(monitor.in_use() == SupplyInUse::module);
  note(good_mV, 3);
  note(low_mV, 1);
  note(good_mV, 3);
  CHECK(monitor.in_use() == SupplyInUse::module);
  note(good_mV, 1);
  CHECK(monitor.in_use() == SupplyInUse::external);
  CHECK_FALSE(monitor.is_external_low());
}

TEST_CASE("the module's own supply is watched as well", "[unit][mmu][MMU_8][MMU_9]") {
  SupplyMonitor monitor;
  for (int reading = 0; reading < 4; ++reading) monitor.note(36'000, 4'999);
  CHECK(monitor.in_use() == SupplyInUse::external);  // without effect while the external supply is present
  for (int reading = 0; reading < 4; ++reading) monitor.note(0, 4'999);
  CHECK(monitor.in_use() == SupplyInUse::none);
  for (int reading = 0; reading < 4; ++reading) monitor.note(0, 5'000);
  CHECK(monitor.in_use() == SupplyInUse::module);
}

// --- the module -----------------------------------------------------------------------------------------------------

bool is_on_module(MmuBench& bench) {
  const CanFrame frame = bench.status();
  CHECK(read_raw<status, "supply">(frame) == read_raw<status, "external_supply_low">(frame));
  return read_raw<status, "supply">(frame) == 1;
}

/// Runs to just after a sample, so that each step has one transfer.
void align_to_sample(MmuBench& bench) {
  bench.run(10ms - (bench.now - power_up) % 10ms + 1ms);
}

TEST_CASE("a module whose external supply fails changes over after four readings, and says so",
          "[unit][mmu][MMU_7][MMU_10][MMU_11]") {
  MmuBench bench;
  bench.settle();
  CHECK_FALSE(is_on_module(bench));
  align_to_sample(bench);
  bench.measured.external_supply_mV = 4'000;
  bench.run(38ms);
  CHECK(bench.mmu.supply() == SupplyInUse::external);
  bench.run(1ms);
  CHECK(bench.mmu.supply() == SupplyInUse::module);
  CHECK(is_on_module(bench));
  align_to_sample(bench);
  bench.measured.external_supply_mV = 12'000;
  bench.run(38ms);
  CHECK(bench.mmu.supply() == SupplyInUse::module);
  bench.run(1ms);
  CHECK_FALSE(is_on_module(bench));
}

TEST_CASE("readings that arrive damaged are neither low nor good", "[unit][mmu][MMU_PEC][MMU_11]") {
  MmuBench bench;
  bench.settle();
  align_to_sample(bench);
  bench.measured.external_supply_mV = 0;
  bench.run(30ms);
  bench.on_transfer = [](FrontEndTransfer& transfer) {
    transfer.groups[static_cast<std::size_t>(RegisterGroup::supplies)][0] ^= 0x10;
  };
  bench.run(200ms);
  CHECK(bench.mmu.supply() == SupplyInUse::external);
  bench.on_transfer = nullptr;
  bench.run(10ms);
  CHECK(bench.mmu.supply() == SupplyInUse::module);
}

TEST_CASE("on either supply a module answers its master and obeys it", "[unit][mmu][MMU_N]") {
  MmuBench bench;
  bench.settle();
  bench.measured.external_supply_mV = 0;
  bench.run_polled(5s);
  CHECK(bench.mmu.mode() == UnitMode::normal);
  CHECK(is_on_module(bench));
  CHECK(bench.command(balance_frame(3, bench.next_command(), {1})) == done);
  bench.run_polled(2s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(0));
}

TEST_CASE("without supply and master a module finishes what was commanded and sleeps", "[unit][mmu][MMU_A][MMU_S]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {1, 7, 2})) == done);
  bench.run_polled(1s);
  bench.measured.external_supply_mV = 0;
  bench.run(2s);
  CHECK(bench.mmu.mode() == UnitMode::autonomous);
  CHECK(bench.mmu.balancing_cells() == (cell_bit(0) | cell_bit(2)));
  bench.run(58s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(2));
  bench.run(57s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(2));
  bench.run(4s);
  CHECK(bench.mmu.balancing_cells() == 0);
  CHECK(bench.mmu.is_asleep());
}

TEST_CASE("with its external supply a module without a master stops instead", "[unit][mmu][MMU_N]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {5})) == done);
  bench.run_polled(1s);
  bench.measured.external_supply_mV = 0;
  bench.run(5s);
  REQUIRE(bench.mmu.balancing_cells() == cell_bit(0));
  bench.measured.external_supply_mV = 12'000;
  bench.run(60ms);
  CHECK(bench.mmu.balancing_cells() == 0);
  CHECK(bench.mmu.mode() == UnitMode::normal);
  bench.run(60s);
  CHECK_FALSE(bench.mmu.is_asleep());
}

TEST_CASE("a module on its own is told to be autonomous in its STATUS, and refuses nothing it is asked",
          "[unit][mmu][MMU_A]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {5})) == done);
  bench.run_polled(1s);
  bench.measured.external_supply_mV = 0;
  bench.run(2s);
  REQUIRE(bench.mmu.mode() == UnitMode::autonomous);
  CHECK(bench.command(balance_frame(3, bench.next_command(), {0})) == refused);  // before a POLL it has no master
  CHECK(bench.command(command_frame(3, bench.next_command(), {1, 1, 1})) == done);
  CHECK(bench.mmu.mode() == UnitMode::autonomous);
  CHECK(read_raw<status, "mode">(bench.status()) == static_cast<std::int64_t>(Mode::normal));
  CHECK(bench.mmu.mode() == UnitMode::normal);
  CHECK(bench.command(balance_frame(3, bench.next_command(), {0})) == done);
  CHECK(bench.mmu.balancing_cells() == 0);
}

TEST_CASE("a module with neither supply is off: traffic does not wake it, a supply restarts it",
          "[unit][mmu][MMU_8][MMU_S]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(command_frame(3, bench.next_command(), {2, 0x6D, 0x60, 0xA2, 0x1C})) == done);
  bench.status();
  bench.measured.external_supply_mV = 0;
  bench.measured.module_mV = 4'000;
  bench.run(50ms);
  REQUIRE(bench.mmu.mode() == UnitMode::unpowered);
  CHECK(bench.ask(want_all).empty());
  CHECK(bench.ask(want_all).empty());
  CHECK(bench.run(10s).empty());
  bench.measured.external_supply_mV = 12'000;
  const auto sent = bench.run(200ms);
  REQUIRE(sent.size() == 1);
  CHECK(sent[0].frame.id == 0x303);
  const CanFrame said = bench.status();
  CHECK(read_raw<status, "restarted">(said) == 1);
  CHECK(read_raw<status, "limits_not_set">(said) == 1);
}

TEST_CASE("an ordered sleep is obeyed on module supply, polled or not", "[unit][mmu][MMU_S]") {
  MmuBench bench;
  bench.settle();
  bench.measured.external_supply_mV = 0;
  bench.run_polled(1s);
  REQUIRE(bench.command(command_frame(3, bench.next_command(), {1, 3})) == done);
  bench.run(20ms);
  CHECK(bench.mmu.is_asleep());
}

TEST_CASE("woken on module supply without a master it sleeps again", "[unit][mmu][MMU_S][MMU_A]") {
  MmuBench bench;
  bench.settle();
  bench.measured.external_supply_mV = 0;
  bench.run(3s);
  REQUIRE(bench.mmu.is_asleep());
  bench.mmu.observe(data_frame(0x041, 8), bench.now);
  CHECK_FALSE(bench.mmu.is_asleep());
  CHECK(bench.run(2s).size() == 1);  // IDENT
  CHECK(bench.mmu.is_asleep());
}

TEST_CASE("kept awake by traffic on module supply it does nothing on its own", "[unit][mmu][MMU_S][MMU_AB]") {
  MmuBench bench;
  bench.measured.cell_voltage_uV[4] += 20'000;
  bench.settle();
  REQUIRE(bench.command(command_frame(3, bench.next_command(), {1, 3, 1})) == done);
  bench.run(20ms);
  bench.measured.external_supply_mV = 0;
  REQUIRE(bench.mmu.is_asleep());
  for (int frame = 0; frame < 300; ++frame) {
    bench.mmu.observe(data_frame(0x041, 8), bench.now);
    bench.run(50ms);
    CHECK(bench.mmu.balancing_cells() == 0);
  }
  CHECK(bench.mmu.mode() == UnitMode::normal);
  bench.run(1s);
  CHECK(bench.mmu.is_asleep());
}

// --- autonomous balancing -------------------------------------------------------------------------------------------

/// Module on its own supply, allowed to balance autonomously, just after the last POLL.
MmuBench left_alone(const BenchInputs* inputs = nullptr, bool is_allowed = true) {
  MmuBench bench;
  if (inputs != nullptr) bench.measured = *inputs;
  bench.measured.external_supply_mV = 0;
  bench.run(800ms);
  REQUIRE(bench.command(command_frame(3, bench.next_command(), {1, 1, std::uint8_t{is_allowed}})) == done);
  bench.poll(0);
  return bench;
}

BenchInputs cells_above_the_rest(CellMask cells, std::int32_t by_uV) {
  BenchInputs inputs = MmuBench().measured;
  for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
    if (has_cell(cells, cell)) inputs.cell_voltage_uV[cell] += by_uV;
  }
  return inputs;
}

/// Runs until the first switch is on or the module is asleep, at most a minute; returns the time.
Duration run_until_balancing_or_asleep(MmuBench& bench) {
  const TimePoint begun = bench.now;
  while (bench.mmu.balancing_cells() == 0 && !bench.mmu.is_asleep() && bench.now - begun < 60s) bench.run(1ms);
  return bench.now - begun;
}

TEST_CASE("a module left alone balances cells more than 5 mV above the lowest, a minute at a time, then looks again",
          "[unit][mmu][MMU_A][MMU_IMB][MMU_AB]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(1) | cell_bit(7), 5'100);
  MmuBench bench = left_alone(&inputs);
  const Duration looked_for = run_until_balancing_or_asleep(bench);
  CHECK(looked_for > 4s);
  CHECK(looked_for < 7s);
  CHECK(bench.mmu.mode() == UnitMode::autonomous);
  CHECK(bench.mmu.balancing_cells() == (cell_bit(1) | cell_bit(7)));

  // Readings with a switch on do not count: both cells read lower by their wires, and the neighbour of cell 8 higher.
  bench.measured.cell_voltage_uV[1] -= 20'000;
  bench.measured.cell_voltage_uV[7] -= 20'000;
  bench.measured.cell_voltage_uV[8] += 10'000;
  bench.run(59s);
  CHECK(bench.mmu.balancing_cells() == (cell_bit(1) | cell_bit(7)));
  bench.measured.cell_voltage_uV[1] += 20'000;
  bench.measured.cell_voltage_uV[7] += 20'000 - 5'100;  // now equal; cell 2 is not yet
  bench.measured.cell_voltage_uV[8] -= 10'000;
  bench.run(1100ms);
  CHECK(bench.mmu.balancing_cells() == 0);
  CHECK_FALSE(bench.mmu.is_asleep());
  const Duration rested_for = run_until_balancing_or_asleep(bench);
  CHECK(rested_for >= 5s);
  CHECK(rested_for < 7s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(1));

  bench.measured.cell_voltage_uV[1] -= 5'100;
  bench.run(61s);
  CHECK_FALSE(bench.mmu.is_asleep());
  bench.run(6s);
  CHECK(bench.mmu.is_asleep());
  CHECK(bench.mmu.balancing_cells() == 0);
}

TEST_CASE("a small cell that comes down to the lowest within its minute is bled no further", "[unit][mmu][MMU_AB]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(1) | cell_bit(7), 6'000);
  MmuBench bench = left_alone(&inputs);
  run_until_balancing_or_asleep(bench);
  REQUIRE(bench.mmu.balancing_cells() == (cell_bit(1) | cell_bit(7)));
  // Falls by a volt a minute, starting from the reading reduced by the wires; the other cell has the usual size. The
  // lowest cell falls with all of them: only the difference counts.
  bench.measured.cell_voltage_uV[1] -= 20'000;
  const std::int32_t loaded_uV = bench.measured.cell_voltage_uV[1];
  const TimePoint begun = bench.now;
  while (has_cell(bench.mmu.balancing_cells(), 1) && bench.now - begun < 60s) {
    bench.run(6ms);
    bench.measured.cell_voltage_uV[1] -= 100;
    if ((bench.now - begun) % 60ms == 0ms) {
      for (std::int32_t& cell_uV : bench.measured.cell_voltage_uV) cell_uV -= 100;
    }
  }
  const std::int32_t fallen_uV = loaded_uV - bench.measured.cell_voltage_uV[1];
  CAPTURE(fallen_uV, to_ms(bench.now - begun));
  CHECK(bench.now - begun < 1s);
  CHECK(fallen_uV >= 6'000);
  CHECK(fallen_uV <= 6'000 + 600 + 300 * 100 / 6);  // three more averages, and the fall of all cells
  CHECK(bench.mmu.balancing_cells() == cell_bit(7));
  bench.run(50s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(7));
}

TEST_CASE("a cell that bleeding does not bring down is given up after ten rounds", "[unit][mmu][MMU_AB]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(4), 20'000);  // constant: its channel is stuck
  MmuBench bench = left_alone(&inputs);
  Duration on_for{};
  for (const TimePoint begun = bench.now; bench.now - begun < 3h && !bench.mmu.is_asleep();) {
    bench.run(10ms);
    if (bench.mmu.balancing_cells() != 0) on_for += 10ms;
  }
  CHECK(bench.mmu.is_asleep());
  CHECK(on_for > 9min);
  CHECK(on_for <= 10min + 1s);
}

TEST_CASE("on its own it trusts no look from before", "[unit][mmu][MMU_A][MMU_IMB]") {
  MmuBench bench = left_alone();
  bench.run_polled(60s);  // equal, and decided long ago
  bench.measured.cell_voltage_uV[4] += 20'000;
  bench.run_polled(GENERATE(0s, 1s, 3s));
  bench.run(6s);
  CHECK_FALSE(bench.mmu.is_asleep());
  bench.run(1s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(4));
}

TEST_CASE("minutes ordered right after what ends a round of its own are kept", "[unit][mmu][MMU_A][MMU_CB]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(1), 20'000);
  MmuBench bench = left_alone(&inputs);
  run_until_balancing_or_asleep(bench);
  REQUIRE(bench.mmu.balancing_cells() == cell_bit(1));
  SECTION("a POLL, in the same millisecond or a little later") {
    bench.poll(0);
    bench.run(GENERATE(0ms, 1ms, 2ms, 3ms));
  }
  SECTION("the external supply, and a POLL") {
    bench.measured.external_supply_mV = 12'000;
    while (bench.mmu.mode() == UnitMode::autonomous) bench.run(1ms);
    bench.poll(0);
  }
  CHECK(bench.mmu.balancing_cells() == 0);
  CHECK(bench.command(balance_frame(3, bench.next_command(), {2})) == done);
  bench.run_polled(3s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(0));
}

TEST_CASE("5 mV above the lowest are no imbalance", "[unit][mmu][MMU_IMB]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(1), 5'000);
  MmuBench bench = left_alone(&inputs);
  run_until_balancing_or_asleep(bench);
  CHECK(bench.mmu.is_asleep());
}

TEST_CASE("a module that may not balance on its own sleeps at once", "[unit][mmu][MMU_A]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(1), 50'000);
  MmuBench bench = left_alone(&inputs, false);
  CHECK(run_until_balancing_or_asleep(bench) < 1100ms);
  CHECK(bench.mmu.is_asleep());
}

TEST_CASE("failed cells are not balanced, and with an empty one none is", "[unit][mmu][MMU_UV][MMU_AB]") {
  BenchInputs inputs = cells_above_the_rest(cell_bit(1) | cell_bit(2), 20'000);
  SECTION("overvoltage: the others are") {
    inputs.cell_voltage_uV[1] = 4'250'000;
    MmuBench bench = left_alone(&inputs);
    run_until_balancing_or_asleep(bench);
    CHECK(bench.mmu.balancing_cells() == cell_bit(2));
  }
  SECTION("undervoltage: balancing would empty the rest into it") {
    inputs.cell_voltage_uV[5] = 2'900'000;
    MmuBench bench = left_alone(&inputs);
    run_until_balancing_or_asleep(bench);
    CHECK(bench.mmu.is_asleep());
  }
}

TEST_CASE("a master that comes back ends balancing that nobody ordered, and finds all cells at zero minutes",
          "[unit][mmu][MMU_A][MMU_AB][MMU_CB]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(1), 20'000);
  MmuBench bench = left_alone(&inputs);
  run_until_balancing_or_asleep(bench);
  REQUIRE(bench.mmu.balancing_cells() == cell_bit(1));
  bench.poll(0);
  bench.run(2ms);
  CHECK(bench.mmu.mode() == UnitMode::normal);
  CHECK(bench.mmu.balancing_cells() == 0);
  bench.run_polled(10s);
  CHECK(bench.mmu.balancing_cells() == 0);
  CHECK(bench.command(balance_frame(3, bench.next_command(), {7, 1})) == done);
  bench.run_polled(1s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(1));
}

TEST_CASE("permission withdrawn ends the round", "[unit][mmu][MMU_AB]") {
  const BenchInputs inputs = cells_above_the_rest(cell_bit(1), 20'000);
  MmuBench bench = left_alone(&inputs);
  run_until_balancing_or_asleep(bench);
  REQUIRE(bench.mmu.balancing_cells() == cell_bit(1));
  CHECK(bench.command(command_frame(3, bench.next_command(), {1, 1, 0})) == done);
  CHECK(bench.mmu.balancing_cells() == 0);
  bench.run(1s);
  CHECK(bench.mmu.is_asleep());
}

TEST_CASE("a hot board is waited for, but not for ever", "[unit][mmu][MMU_17][MMU_AB]") {
  BenchInputs inputs = cells_above_the_rest(cell_bit(1), 20'000);
  MmuBench bench = left_alone(&inputs);
  run_until_balancing_or_asleep(bench);
  bench.measured.board_temperature_dC[0] = known(851);
  bench.run(1s);
  CHECK(bench.mmu.balancing_cells() == 0);
  bench.run(9min);
  CHECK_FALSE(bench.mmu.is_asleep());
  SECTION("cooled") {
    bench.measured.board_temperature_dC[0] = known(799);
    bench.run(2s);
    CHECK(bench.mmu.balancing_cells() == cell_bit(1));
  }
  SECTION("still hot") {
    bench.run(1min);
    CHECK(bench.mmu.is_asleep());
  }
}

TEST_CASE("a board that cannot be seen is not heated", "[unit][mmu][MMU_16][MMU_17]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(bench.command(balance_frame(3, bench.next_command(), {5})) == done);
  bench.run_polled(2s);
  REQUIRE(bench.mmu.balancing_cells() == cell_bit(0));
  bench.measured.board_temperature_dC[3] = not_known(GENERATE(Validity::open_circuit, Validity::short_circuit));
  bench.run_polled(1s);
  CHECK(bench.mmu.balancing_cells() == 0);
  const CanFrame said = bench.status();
  CHECK(read_raw<status, "board_too_hot">(said) == 0);
  CHECK(read_raw<status, "temperature_sensor_fault">(said) == 1);
  bench.measured.board_temperature_dC[3] = known(300);
  bench.run_polled(2s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(0));
}

TEST_CASE("on its own, a module that cannot see its board sleeps", "[unit][mmu][MMU_16][MMU_A]") {
  BenchInputs inputs = cells_above_the_rest(cell_bit(1), 20'000);
  inputs.board_temperature_dC[0] = not_known(Validity::open_circuit);
  MmuBench bench = left_alone(&inputs);
  CHECK(run_until_balancing_or_asleep(bench) < 1100ms);
  CHECK(bench.mmu.is_asleep());
}

// --- scenario of the thesis -----------------------------------------------------------------------------------------

TEST_CASE("cells 2, 5, 8 and 11 for two minutes: on for exactly that, whatever is repeated meanwhile",
          "[unit][mmu][MMU_CB][MMU_3]") {
  constexpr CellMask four = cell_bit(1) | cell_bit(4) | cell_bit(7) | cell_bit(10);
  MmuBench bench;
  bench.settle();
  const auto command_four = [&bench] {
    return bench.command(balance_frame(3, bench.next_command(), {0, 2, 0, 0, 2, 0, 0, 2, 0, 0, 2, 0}));
  };
  REQUIRE(command_four() == done);
  std::array<Duration, mmu_cells_max> on_for{};
  TimePoint off_at{};
  for (int ms = 0; ms < 150'000; ++ms) {
    if (ms % 100 == 0) bench.poll(0);
    if (ms == 30'000 || ms == 90'000)
      bench.mmu.observe(balance_frame(3, bench.next_command(), {0, 2, 0, 0, 2}), bench.now);
    bench.run(1ms);
    const CellMask on = bench.mmu.balancing_cells();
    CHECK((on == four || on == 0));
    if (on == 0 && on_for[1] > 0s && off_at == TimePoint{}) off_at = bench.now;
    for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) on_for[cell] += has_cell(on, cell) ? 1ms : 0ms;
  }
  for (std::size_t cell = 0; cell < mmu_cells_max; ++cell) {
    INFO("cell " << cell + 1);
    CHECK(on_for[cell] == (has_cell(four, cell) ? Duration{120s} : Duration{}));
  }
  CHECK(bench.now - off_at > 25s);  // no switch came on again
  REQUIRE(command_four() == done);  // from 0 minutes, the same number is a change
  bench.run_polled(1s);
  CHECK(bench.mmu.balancing_cells() == four);
}

}  // namespace
}  // namespace bmu
