// Cells that a module unit cannot measure: it neither bleeds them nor reports anything about them.
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"

namespace bmu {
namespace {

using namespace bmu::test;
using namespace internal_bus;

constexpr std::int64_t done = static_cast<std::int64_t>(CommandResult::done);
constexpr std::int64_t hardware_fault = static_cast<std::int64_t>(CommandResult::hardware_fault);

/// Damages these groups in every transfer from now on.
void lose(MmuBench& bench, std::initializer_list<RegisterGroup> groups) {
  bench.on_transfer = [lost = std::vector<RegisterGroup>(groups)](FrontEndTransfer& transfer) {
    for (const RegisterGroup group : lost) transfer.groups[static_cast<std::size_t>(group)][7] ^= 0x02;
  };
}
void lose_everything(MmuBench& bench) {
  bench.measured.front_end_crc_ok = false;
}
constexpr std::initializer_list<RegisterGroup> cell_groups{RegisterGroup::cells_1, RegisterGroup::cells_2,
                                                           RegisterGroup::cells_3, RegisterGroup::cells_4};

std::int64_t balance(MmuBench& bench, std::initializer_list<std::uint8_t> minutes) {
  return bench.command(balance_frame(3, bench.next_command(), minutes));
}

// --- balancing ------------------------------------------------------------------------------------------------------

TEST_CASE("minutes for a cell that is not measured are a hardware fault", "[unit][mmu][MMU_CB]") {
  MmuBench bench;
  bench.settle();
  SECTION("an open wire: both its cells, and no other") {
    bench.measured.open_wires = cell_bit(4);
    bench.run_polled(1s);
    CHECK(balance(bench, {7, 7, 7, 7, 2}) == hardware_fault);
    CHECK(balance(bench, {7, 7, 7, 7, 7, 2}) == hardware_fault);
    CHECK(balance(bench, {7, 7, 7, 2, 0, 0, 2}) == done);
    bench.run_polled(1s);
    CHECK(bench.mmu.balancing_cells() == (cell_bit(3) | cell_bit(6)));
    return;
  }
  SECTION("a failed self-test") {
    bench.measured.self_test_ok = false;
  }
  SECTION("a self-test of which nothing is heard") {
    lose(bench, {RegisterGroup::diagnosis});
  }
  SECTION("voltages that do not come") {
    lose(bench, cell_groups);
  }
  SECTION("nothing that comes") {
    lose_everything(bench);
  }
  bench.run_polled(1s);
  CHECK(balance(bench, {5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5}) == hardware_fault);
  CHECK(balance(bench, {0, 0, 7, 0}) == done);  // stopping is always possible
  bench.run_polled(2s);
  CHECK(bench.mmu.balancing_cells() == 0);
}

TEST_CASE("a switch goes off when its cell is measured no more, and does not come back by itself",
          "[unit][mmu][MMU_CB]") {
  MmuBench bench;
  bench.settle();
  REQUIRE(balance(bench, {5, 5, 5, 5, 5}) == done);
  bench.run_polled(2s);
  REQUIRE(bench.mmu.balancing_cells() == first_cells(5));
  CellMask left = 0;
  SECTION("an open wire") {
    bench.measured.open_wires = cell_bit(1);
    bench.run_polled(100ms);
    left = cell_bit(0) | cell_bit(3) | cell_bit(4);
    CHECK(bench.mmu.balancing_cells() == left);
    bench.measured.open_wires = 0;
  }
  SECTION("one group of voltages") {
    lose(bench, {RegisterGroup::cells_2});
    bench.run_polled(200ms);  // their age is still in range
    CHECK(bench.mmu.balancing_cells() == first_cells(5));
    bench.run_polled(100ms);
    left = first_cells(3);
    CHECK(bench.mmu.balancing_cells() == left);
  }
  SECTION("the self-test fails") {
    bench.measured.self_test_ok = false;
    bench.run_polled(20ms);
    CHECK(bench.mmu.balancing_cells() == 0);
    bench.measured.self_test_ok = true;
  }
  SECTION("the self-test is not heard") {
    lose(bench, {RegisterGroup::diagnosis});
    bench.run_polled(300ms);
    CHECK(bench.mmu.balancing_cells() == 0);
  }
  bench.on_transfer = nullptr;
  bench.run_polled(5s);
  CHECK(bench.mmu.balancing_cells() == left);
}

TEST_CASE("minutes are a hardware fault while a board sensor cannot be read", "[unit][mmu][MMU_16][MMU_17]") {
  MmuBench bench;
  bench.settle();
  SECTION("open or shorted") {
    bench.measured.board_temperature_dC[1] = not_known(GENERATE(Validity::open_circuit, Validity::short_circuit));
    bench.run_polled(1s);
  }
  SECTION("not heard") {
    lose(bench, {RegisterGroup::board_sensors_1});
    bench.run_polled(3s);
  }
  CHECK(balance(bench, {2}) == hardware_fault);
  bench.on_transfer = nullptr;
  bench.measured.board_temperature_dC[1] = known(300);
  bench.run_polled(5s);
  CHECK(bench.mmu.balancing_cells() == 0);  // the command was refused: nothing starts later
  CHECK(balance(bench, {2}) == done);
}

TEST_CASE("on its own, a module whose self-test fails stops and sleeps", "[unit][mmu][MMU_A][MMU_AB]") {
  MmuBench bench;
  bench.measured.cell_voltage_uV[4] += 20'000;
  bench.measured.external_supply_mV = 0;
  bench.settle();
  REQUIRE(bench.command(command_frame(3, bench.next_command(), {1, 1, 1})) == done);
  bench.poll(0);
  while (bench.mmu.balancing_cells() == 0 && bench.now - power_up < 20s) bench.run(10ms);
  REQUIRE(bench.mmu.balancing_cells() == cell_bit(4));
  bench.measured.self_test_ok = false;
  bench.run(30ms);
  CHECK(bench.mmu.balancing_cells() == 0);
  CHECK(bench.mmu.is_asleep());
}

// --- reported flags -------------------------------------------------------------------------------------------------

TEST_CASE("a board that was hot stays so until its sensors are seen", "[unit][mmu][MMU_16][MMU_PEC]") {
  MmuBench bench;
  bench.settle();
  bench.measured.board_temperature_dC.fill(known(1'100));
  bench.run_polled(1s);
  REQUIRE(read_raw<status, "board_too_hot">(bench.status()) == 1);
  bench.measured.board_temperature_dC.fill(known(300));
  SECTION("not heard") {
    lose(bench, {RegisterGroup::board_sensors_2});
  }
  SECTION("nothing heard") {
    lose_everything(bench);
  }
  SECTION("open") {
    bench.measured.board_temperature_dC[0] = not_known(Validity::open_circuit);
  }
  bench.run_polled(10s);
  CHECK(read_raw<status, "board_too_hot">(bench.status()) == 1);
  bench.on_transfer = nullptr;
  bench.measured.front_end_crc_ok = true;
  bench.measured.board_temperature_dC.fill(known(300));
  bench.run_polled(1s);
  CHECK(read_raw<status, "board_too_hot">(bench.status()) == 0);
}

TEST_CASE("a self-test that is not heard has failed, when its last word is too old to be told",
          "[unit][mmu][MMU_PEC]") {
  MmuBench bench;
  bench.settle();
  lose(bench, {GENERATE(RegisterGroup::diagnosis, RegisterGroup::supplies)});
  bench.run_polled(200ms);
  CHECK(read_raw<status, "self_test_failed">(bench.status()) == 0);
  bench.run_polled(100ms);
  CHECK(read_raw<status, "self_test_failed">(bench.status()) == 1);
  bench.on_transfer = nullptr;
  bench.run_polled(20ms);
  CHECK(read_raw<status, "self_test_failed">(bench.status()) == 0);
}

TEST_CASE("supplies that are not heard: no voltage of the stack, no external supply", "[unit][mmu][MMU_7][MMU_PEC]") {
  MmuBench bench;
  bench.settle();
  lose(bench, {RegisterGroup::supplies});
  bench.run_polled(1s);
  const auto answer = bench.ask(want_status | want_module | want_ident);
  REQUIRE(answer.size() == 3);
  CHECK_FALSE(read<module, "module_voltage_mV">(answer[1].frame).is_valid());
  CHECK(read_raw<status, "external_supply_low">(answer[0].frame) == 1);
  CHECK(read_raw<status, "supply">(answer[0].frame) == 1);
  CHECK(bench.mmu.mode() == UnitMode::normal);
  bench.on_transfer = nullptr;
  bench.run_polled(20ms);
  const auto again = bench.ask(want_status | want_module);
  REQUIRE(again.size() == 2);
  CHECK(read<module, "module_voltage_mV">(again[1].frame) == known(44'400));
  CHECK(read_raw<status, "external_supply_low">(again[0].frame) == 0);
}

TEST_CASE("a module that starts with a front end it cannot read claims nothing", "[unit][mmu][MMU_PEC]") {
  MmuBench bench;
  bench.settle();
  lose_everything(bench);
  bench.mmu.restart(bench.now);
  bench.run(500ms);
  const auto answer = bench.ask(want_status | want_cells | want_temp | want_module);
  REQUIRE(answer.size() == 8);
  CHECK_FALSE(read<module, "module_voltage_mV">(answer[7].frame).is_valid());
  const CanFrame& said = answer[0].frame;
  CHECK(read_raw<status, "mode">(said) == static_cast<std::int64_t>(Mode::starting));
  CHECK(read_raw<status, "self_test_failed">(said) == 1);
  CHECK(read_raw<status, "external_supply_low">(said) == 1);
  CHECK(read_raw<status, "supply">(said) == 1);
  CHECK(read_raw<status, "temperature_sensor_fault">(said) == 1);
  CHECK_FALSE(read<status, "cell_voltage_age_ms">(said).is_valid());
  for (std::size_t frame = 1; frame <= 4; ++frame) {
    for (std::size_t byte = 0; byte < 6; ++byte) CHECK(answer[frame].frame.data[byte] == 0xFF);
  }
}

TEST_CASE("a sensor that is fitted and cannot be read is told as a broken one, not as none", "[unit][mmu][MMU_4]") {
  MmuBench bench({.node = 3, .temperature_sensor_count = 3, .board_sensor_count = 2});
  bench.settle();
  CHECK(read_raw<status, "temperature_sensor_fault">(bench.status()) == 0);
  lose_everything(bench);
  bench.run_polled(3s);
  const auto answer = bench.ask(want_status | want_temp);
  REQUIRE(answer.size() == 3);
  CHECK(read_raw<status, "temperature_sensor_fault">(answer[0].frame) == 1);
  CHECK(std::equal(answer[1].frame.data.begin(), answer[1].frame.data.begin() + 6,
                   FrameBytes{0x80, 0x01, 0x80, 0x01, 0x80, 0x01}.begin()));
  CHECK(std::equal(answer[2].frame.data.begin(), answer[2].frame.data.begin() + 6,
                   FrameBytes{0x80, 0x00, 0x7F, 0x7F, 0x80, 0x80}.begin()));
}

}  // namespace
}  // namespace bmu
