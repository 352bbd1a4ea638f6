// Modules that were written from version 1 of the protocol alone (tests/support/naive_module.hpp): a pack of them works
// with the core, and mmu/ answers a master just as they do. A difference between the two is a gap in the protocol.
#include "tests/support/naive_module.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <variant>
#include <vector>

#include "mmu/devices/random.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tests/support/worked_frames.hpp"

namespace bmu {
namespace {

using namespace bmu::test;

naive::Frame plain(const CanFrame& frame) {
  naive::Frame plain{.id = frame.id, .length = frame.length};
  std::copy(frame.data.begin(), frame.data.end(), std::begin(plain.b));
  return plain;
}

CanFrame can(const naive::Frame& plain) {
  CanFrame frame = data_frame(plain.id, static_cast<std::uint8_t>(plain.length));
  std::copy(std::begin(plain.b), std::end(plain.b), frame.data.begin());
  return frame;
}

unsigned long naive_ms(TimePoint now) {
  return static_cast<unsigned long>(to_ms(now.time_since_epoch()));
}

// --- a pack of them, with the real core -----------------------------------------------------------------------------

/// The bench with its own modules silent and naive ones in their places, on the same cells.
class NaivePack {
 public:
  explicit NaivePack(std::size_t modules) : NaivePack(pack_of(modules)) {}
  explicit NaivePack(const CoreConfig& config) : bench(config), naive(config.modules.size()) {
    for (std::size_t index = 0; index < naive.size(); ++index) {
      bench.modules[index].talks = false;
      power_up(index);
    }
    listen();
  }
  /// State after a brief loss of power: only its identity is left.
  void power_up(std::size_t index) {
    const BenchModule& module = bench.modules[index];
    naive::naive_init(naive[index], module.node, module.cell_count, module.sensor_count, module.serial_number,
                      now_ms());
    for (int& dC : naive[index].cell_dC) dC = 250;
    for (int& degrees : naive[index].board_C) degrees = 30;
  }
  /// Another session of the daemon, with counters from `first_counter` on and the modules of the session before.
  NaivePack(const NaivePack& before, const CoreConfig& config, std::uint8_t first_counter)
      : bench(config, {}, first_counter), naive(before.naive), lived_ms_(before.now_ms() - naive_ms(bench.now())) {
    for (std::size_t index = 0; index < naive.size(); ++index) {
      bench.modules[index] = before.bench.modules[index];
    }
    listen();
  }
  NaivePack(const NaivePack&) = delete;
  NaivePack& operator=(const NaivePack&) = delete;

  CoreBench bench;
  std::vector<naive::Module> naive;
  std::size_t mute = SIZE_MAX;  // frames of the module with this index get lost
  bool cells_lose = false;      // 6 mV in a minute of bleeding

  [[nodiscard]] unsigned long now_ms() const { return lived_ms_ + naive_ms(bench.now()); }
  [[nodiscard]] std::size_t cells_on() const {
    std::size_t cells = 0;
    for (const naive::Module& module : naive) cells += static_cast<std::size_t>(std::popcount(naive_switches(module)));
    return cells;
  }

 private:
  void listen() {
    bench.each_ms = [this] { step(); };
    bench.on_observe = [this](const Observation& observation) {
      if (const auto* const heard = std::get_if<FrameReceived>(&observation.what)) hear_others(heard->frame);
    };
  }
  /// Frames of PDU, sensor and other modules matter to sleeping modules only.
  void hear_others(const CanFrame& frame) {
    for (naive::Module& module : naive) {
      if (module.asleep) naive_receive(module, plain(frame), now_ms());
    }
  }
  void step() {
    for (; heard_ < bench.sent().size(); ++heard_) {
      const OutgoingFrame& out = bench.sent()[heard_];
      if (out.port != Port::internal) continue;
      for (naive::Module& module : naive) naive_receive(module, plain(out.frame), now_ms());
    }
    for (std::size_t index = 0; index < naive.size(); ++index) {
      bleed(bench.modules[index], naive[index]);
      measure(bench.modules[index], naive[index]);
      naive_tick(naive[index], now_ms());
      for (naive::Frame frame; naive_send(naive[index], frame);) {
        if (index != mute) bench.deliver(can(frame));
      }
    }
  }
  void bleed(BenchModule& cells, const naive::Module& module) const {
    for (std::size_t cell = 0; cell < cells.cell_count; ++cell) {
      const bool is_on = ((naive_switches(module) >> cell) & 1U) != 0;
      if (cells_lose && is_on && now_ms() % 10 == 0) cells.cell_voltage_uV[cell].value -= 1;
    }
  }
  static void measure(const BenchModule& cells, naive::Module& module) {
    std::int64_t sum_uV = 0;
    for (std::size_t cell = 0; cell < cells.cell_count; ++cell) {
      module.cell_raw[cell] = static_cast<unsigned>(cells.cell_voltage_uV[cell].value / 100);
      sum_uV += cells.cell_voltage_uV[cell].value;
    }
    module.module_raw = static_cast<unsigned>(sum_uV / 2'000);
  }

  std::size_t heard_ = 0;
  unsigned long lived_ms_ = 0;
};

/// Balances by the voltages of cells at rest, with open contactors, too.
CoreConfig balanced_pack(std::size_t modules) {
  CoreConfig config = pack_of(modules);
  config.balancing.is_enabled = true;
  config.balancing.requires_closed = false;
  config.balancing.method = BalancingMethod::terminal_voltage;
  config.balancing.top_uV = 3'500'000;
  config.balancing.voltage_min_uV = 3'200'000;
  config.balancing.settle = 1s;
  return config;
}

bool has_module_fault(const CoreBench& bench) {
  constexpr FaultId of_modules[] = {FaultId::module_lost,
                                    FaultId::cell_not_measured,
                                    FaultId::temperature_not_measured,
                                    FaultId::open_wire,
                                    FaultId::module_disturbed,
                                    FaultId::module_reports_fault,
                                    FaultId::module_reports_undervoltage,
                                    FaultId::module_warning,
                                    FaultId::module_mismatch,
                                    FaultId::wrong_cell_count,
                                    FaultId::duplicate_node,
                                    FaultId::unknown_module};
  return std::any_of(std::begin(of_modules), std::end(of_modules),
                     [&bench](FaultId id) { return bench.is_active(id); });
}

TEST_CASE("a pack of foreign modules closes and stays closed", "[scenario][naive][BMS_F.2]") {
  NaivePack pack(16);
  pack.bench.link_rise_mV_per_ms = 2'000;  // 710 V
  REQUIRE(pack.bench.close());
  pack.bench.current_mA = 20'000;
  pack.bench.run(10s);
  CHECK(pack.bench.core().sequence().phase == Phase::closed);
  CHECK_FALSE(has_module_fault(pack.bench));
  for (const naive::Module& module : pack.naive) CHECK(module.polls_answered > 50);
}

TEST_CASE("foreign modules get the pack's limits, and again after a restart at any moment of the poll cycle",
          "[scenario][naive][MMU_2]") {
  NaivePack pack(4);
  REQUIRE(pack.bench.close());
  const CoreConfig& config = pack.bench.core().config();
  const auto has_limits = [&](const naive::Module& module) {
    return module.limits_set && module.uv_raw * 100 == static_cast<unsigned>(config.limits.cell_undervoltage.open) &&
           module.ov_raw * 100 == static_cast<unsigned>(config.limits.cell_overvoltage.open);
  };
  for (const naive::Module& module : pack.naive) CHECK(has_limits(module));
  for (int phase_ms = 0; phase_ms < 100; phase_ms += 9) {
    pack.bench.run(std::chrono::milliseconds(3'000 + phase_ms));
    pack.power_up(2);
    CHECK_FALSE(has_limits(pack.naive[2]));
    pack.bench.run(2s);
    INFO("restarted " << phase_ms << " ms later");
    CHECK(has_limits(pack.naive[2]));
    CHECK(pack.naive[2].polls_answered > 10);
    CHECK_FALSE(pack.naive[2].restarted);  // reported
    CHECK(pack.bench.core().sequence().phase == Phase::closed);
    CHECK_FALSE(has_module_fault(pack.bench));
  }
}

TEST_CASE(
    "foreign modules that say who they are whenever they wake, and never sleep by themselves, do not disturb a "
    "pack that rests",
    "[scenario][naive][MMU_S][BMS_F.9]") {
  CoreConfig config = pack_of(4);
  config.rest = {.after = 10s, .look_every = 60s};
  NaivePack pack(config);
  pack.bench.link_fall_mV_per_ms = 100;
  REQUIRE(pack.bench.close());
  pack.bench.modules[1].cell_voltage_uV[3] = known(2'800'000);
  REQUIRE(pack.bench.run_until([&] { return !pack.bench.commanded().any_contactor(); }, 6s));
  pack.bench.inputs.vehicle_on = false;
  REQUIRE(pack.bench.run_until([&] { return pack.bench.core().rest().is_resting(); }, 20s));
  pack.bench.run(3s);
  // PDU and sensor have woken them after every sleep command; each has sent its IDENT.
  const auto is_awake = [](const naive::Module& one) { return !one.asleep && !one.ident_due; };
  CHECK(std::all_of(pack.naive.begin(), pack.naive.end(), is_awake));
  const std::size_t sent = pack.bench.sent().size();
  pack.bench.run(30s);
  CHECK(pack.bench.core().rest().is_resting());
  CHECK(pack.bench.sent().size() == sent);  // and the master does not answer them
  REQUIRE(pack.bench.run_until([&] { return pack.bench.core().rest().phase() == RestPhase::looking; }, 60s));
  REQUIRE(pack.bench.run_until([&] { return pack.bench.core().rest().is_resting(); }, 5s));
  for (const FaultId id : {FaultId::module_lost, FaultId::duplicate_node, FaultId::unknown_module,
                           FaultId::module_mismatch, FaultId::wrong_cell_count}) {
    CHECK_FALSE(pack.bench.is_active(id));
  }
  pack.bench.inputs.charger_connected = true;
  CHECK(pack.bench.run_until([&] { return pack.bench.core().sequence().phase == Phase::closed; }, 20s));
}

/// A step of the current to `to_mA`, in mA, with cells of 1 mOhm that respond `cells_ahead` before it reaches the
/// sensor, or after it if negative: within the uncertainty of the times of modules and sensor. Then all values are
/// constant for 9.5 s.
void step_and_stand_still(NaivePack& pack, std::int32_t to_mA, Duration cells_ahead) {
  constexpr std::int32_t open_uV = 3'700'000;
  constexpr Duration stands_still = 9'500ms;
  const auto move_cells = [&] {
    for (BenchModule& module : pack.bench.modules) module.cell_voltage_uV.fill(known(open_uV - to_mA));
  };
  if (cells_ahead > 0ms) {
    move_cells();
    pack.bench.run(cells_ahead);
  }
  pack.bench.current_mA = to_mA;
  if (cells_ahead < 0ms) pack.bench.run(-cells_ahead);
  move_cells();
  pack.bench.run(stands_still);
}

CoreConfig pack_of_1_mOhm() {
  CoreConfig config = pack_of(2);
  config.cell.series_resistance_Ohm = 0.001;  // 20 mV at 20 A, and 5 mV show
  return config;
}

TEST_CASE("cells of foreign modules that stand still behind a step of 20 A are not stuck, at any phase of the poll",
          "[scenario][naive][F12]") {
  const auto is_called_stuck = [](const NaivePack& pack) {
    const FaultState& state = pack.bench.core().faults().state(FaultId::stuck_values);
    return state.count > 0 || state.is_warning;
  };
  for (const Duration cells_ahead : {-120ms, 0ms, 50ms, 120ms}) {
    NaivePack pack(pack_of_1_mOhm());
    REQUIRE(pack.bench.close());
    for (int phase_ms = 0; phase_ms < 100; phase_ms += 5) {
      CAPTURE(to_ms(cells_ahead), phase_ms);
      const Duration until_phase = 100ms - pack.bench.now().time_since_epoch() % 100ms;
      pack.bench.run(until_phase + std::chrono::milliseconds(phase_ms));
      step_and_stand_still(pack, 20'000, cells_ahead);
      REQUIRE_FALSE(is_called_stuck(pack));
      REQUIRE(pack.bench.core().sequence().phase == Phase::closed);
      step_and_stand_still(pack, 0, cells_ahead);
      REQUIRE_FALSE(is_called_stuck(pack));
    }
  }
}

TEST_CASE("cells of a foreign module that do not answer a step of 20 A are stuck", "[scenario][naive][F12]") {
  NaivePack pack(pack_of_1_mOhm());
  REQUIRE(pack.bench.close());
  pack.bench.run(1s);
  pack.bench.current_mA = 20'000;
  CHECK(pack.bench.run_until([&] { return pack.bench.is_active(FaultId::stuck_values); }, 9s));
}

TEST_CASE("a foreign module that is no longer heard opens the pack", "[scenario][naive][BMS_F.3]") {
  NaivePack pack(4);
  REQUIRE(pack.bench.close());
  pack.mute = 3;
  CHECK(pack.bench.run_until([&pack] { return !pack.bench.commanded().any_contactor(); }, 2s));
  CHECK(pack.bench.is_active(FaultId::module_lost));
}

TEST_CASE("what a foreign module flags opens the pack as what is measured does", "[scenario][naive][BMU_12]") {
  NaivePack pack(4);
  REQUIRE(pack.bench.close());
  SECTION("a flag alone") {
    pack.naive[1].uv_raw = 38'000;  // its limit differs from that of the core
    CHECK(pack.bench.run_until([&pack] { return !pack.bench.commanded().any_contactor(); }, 6s));
    CHECK(pack.bench.is_active(FaultId::module_reports_undervoltage));
  }
  SECTION("an open wire") {
    pack.naive[1].open_wires = 1U << 4;
    CHECK(pack.bench.run_until([&pack] { return !pack.bench.commanded().any_contactor(); }, 6s));
    CHECK(pack.bench.is_active(FaultId::open_wire));
  }
  SECTION("a cell below its limit") {
    pack.bench.modules[2].cell_voltage_uV[6] = known(2'500'000);
    CHECK(pack.bench.run_until([&pack] { return !pack.bench.commanded().any_contactor(); }, 2s));
    CHECK(pack.bench.is_active(FaultId::cell_undervoltage));
  }
}

TEST_CASE("the core balances foreign modules: the high cells and no others, until none is",
          "[scenario][naive][BMS_F.4][MMU_CB]") {
  CoreConfig config = balanced_pack(3);
  config.cell.capacity_uAs = 925'000'000;  // 93 mA for a minute: 6 permille, which are 6 mV of its curve here
  NaivePack pack(config);
  pack.cells_lose = true;
  auto& cells = pack.bench.modules[1].cell_voltage_uV;
  cells[4] = known(3'720'000);
  cells[7] = known(3'714'000);
  pack.bench.modules[2].cell_voltage_uV[0] = known(3'726'000);
  const std::int32_t level_uV = config.balancing.dead_band_uV + 6'000;  // a minute more may be one too many
  unsigned ever[3] = {};
  const auto is_level = [&] {
    for (std::size_t index = 0; index < 3; ++index) ever[index] |= naive_switches(pack.naive[index]);
    const bool is_over = pack.bench.core().balancing().state() == BalancingState::measuring && pack.cells_on() == 0;
    return is_over && pack.bench.core().pack().cell_voltage_uV.max <= 3'700'000 + level_uV;
  };
  CHECK(pack.bench.run_until(is_level, 900s));
  CHECK(ever[0] == 0);
  CHECK(ever[1] == ((1U << 4) | (1U << 7)));
  CHECK(ever[2] == 1U);
  CHECK(pack.cells_on() == 0);
  CHECK(pack.bench.core().pack().cell_voltage_uV.min > 3'690'000);
  CHECK_FALSE(has_module_fault(pack.bench));
  for (const FaultId id : {FaultId::balancing_stays_on, FaultId::balancing_stays_off, FaultId::balancing_refused}) {
    CHECK_FALSE(pack.bench.is_active(id));
  }
}

TEST_CASE("a second life of the daemon is heard by foreign modules from its first word on, wherever it counts from",
          "[scenario][naive][MMU_2][MMU_CB]") {
  const CoreConfig config = balanced_pack(2);
  const auto has_begun = [](const NaivePack& pack) { return [&pack] { return pack.cells_on() == 2; }; };
  for (const unsigned ahead : {0U, 1U, 128U}) {
    NaivePack first(config);
    for (BenchModule& module : first.bench.modules) module.cell_voltage_uV[3] = known(3'900'000);
    REQUIRE(first.bench.run_until(has_begun(first), 20s));
    first.bench.give(Command::balancing_off);
    first.bench.run(100ms);
    CHECK(first.cells_on() == 0);
    const unsigned heard = first.naive[0].command_counter[1];  // of the broadcast commands
    NaivePack second(first, config, static_cast<std::uint8_t>(heard + ahead));
    second.naive[1].uv_raw = 30'000;  // it has lost its limits
    second.naive[1].limits_set = false;
    second.bench.run(800ms);
    CHECK(second.naive[1].limits_set);
    CHECK(second.naive[1].uv_raw * 100 == static_cast<unsigned>(config.limits.cell_undervoltage.open));
    REQUIRE(second.bench.run_until(has_begun(second), 20s));
    second.bench.give(Command::balancing_off);
    second.bench.run(50ms);
    CHECK(second.cells_on() == 0);
  }
}

// --- the two modules side by side -----------------------------------------------------------------------------------

/// One of each on the same cells and bus, and a master that builds its frames the naive way.
class SideBySide {
 public:
  SideBySide() {
    naive::naive_init(naive, 3, 12, 4, 1'234'567, naive_ms(bench.now));
    for (std::size_t cell = 0; cell < 12; ++cell) {
      set_voltage(cell, 3'650'000 + 100 * static_cast<std::int32_t>(cell * cell));
    }
    bench.measured.module_mV = 43'812;
    bench.measured.reports_faults = false;  // as the naive one, which is older than them
    naive.module_raw = 43'812 / 2;
    for (int sensor = 0; sensor < 4; ++sensor) {
      naive.cell_dC[sensor] = 251 - 100 * sensor;
      bench.measured.cell_temperature_dC[static_cast<std::size_t>(sensor)] = known(251 - 100 * sensor);
      naive.board_C[sensor] = 31 + sensor;
      bench.measured.board_temperature_dC[static_cast<std::size_t>(sensor)] = known(310 + 10 * sensor);
    }
    run(800ms);
  }
  void set_voltage(std::size_t cell, std::int32_t voltage_uV) {
    bench.measured.cell_voltage_uV[cell] = voltage_uV;
    naive.cell_raw[cell] = static_cast<unsigned>(voltage_uV / 100);
  }

  MmuBench bench;
  naive::Module naive{};
  std::vector<CanFrame> from_mmu;
  std::vector<CanFrame> from_naive;
  unsigned poll_counter = 0;
  unsigned command_counter = 0;

  void send(naive::Frame frame, unsigned counter) {
    naive_seal(frame, counter);
    bench.mmu.observe(can(frame), bench.now);
    naive_receive(naive, frame, naive_ms(bench.now));
  }
  void poll(unsigned flags) { send({.id = 0x080, .b = {0, static_cast<unsigned char>(flags)}}, ++poll_counter); }
  void run(Duration duration) {
    from_mmu.clear();
    from_naive.clear();
    for (const TimePoint end = bench.now + duration; bench.now < end;) {
      for (const TimedFrame& sent : bench.run(1ms)) from_mmu.push_back(sent.frame);
      naive_tick(naive, naive_ms(bench.now));
      for (naive::Frame frame; naive_send(naive, frame);) from_naive.push_back(can(frame));
    }
  }
  void run_polled(Duration duration) {
    for (const TimePoint end = bench.now + duration; bench.now < end;) {
      poll(0);
      run(500ms);
    }
  }
};

/// Identifiers and bytes, without the age of the voltages: the time of sampling is up to the module.
bool are_alike(const std::vector<CanFrame>& one, const std::vector<CanFrame>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(), [](CanFrame a, CanFrame b) {
    const bool is_status = a.id >= 0x100 && a.id < 0x140;
    if (is_status) a.data[5] = b.data[5] = a.data[7] = b.data[7] = 0;
    return a == b;
  });
}

TEST_CASE("a foreign module and this one answer a POLL with the same frames", "[scenario][naive][mmu][MMU_1][MMU_4]") {
  SideBySide both;
  for (unsigned flags = 0; flags < 0x20; ++flags) {
    for (const unsigned sync : {0x00U, 0x80U}) {
      both.poll(flags | sync);
      both.run(10ms);
      INFO("flags " << (flags | sync));
      CHECK(are_alike(both.from_mmu, both.from_naive));
      CHECK(both.from_mmu.empty() == (flags == 0));
    }
  }
}

TEST_CASE("a foreign module and this one tell failed cells, switches, open wires and sensors alike",
          "[scenario][naive][mmu][MMU_1][MMU_UV]") {
  SideBySide both;
  both.set_voltage(4, 4'250'000);
  both.set_voltage(8, 2'900'000);
  both.run_polled(4s);
  both.set_voltage(8, 3'600'000);  // it stays failed
  both.bench.measured.open_wires = cell_bit(10);
  both.naive.open_wires = 1U << 10U;
  both.bench.measured.cell_temperature_dC[1] = not_known(Validity::open_circuit);
  both.naive.cell_dC[1] = -32'767;
  both.bench.measured.board_temperature_dC[2] = known(800);
  both.naive.board_C[2] = 80;
  both.run_polled(1s);
  both.send({.id = 0x343, .b = {3, 0x5D, 0x7F, 0xFF, 0xFF, 0xF0}}, ++both.command_counter);  // cells 1 and 3: 2 minutes
  both.run_polled(3s);
  both.poll(0x1F);
  both.run(10ms);
  CHECK(are_alike(both.from_mmu, both.from_naive));
  REQUIRE(both.from_mmu.size() == 9);
  const auto content = [](const CanFrame& frame) {
    return std::vector<unsigned>{frame.data.begin(), frame.data.begin() + 5};
  };
  CHECK(content(both.from_mmu[0]) == std::vector<unsigned>{0x5C, 0xE4, 0x10, 0x00, 0x10});
  CHECK(content(both.from_mmu[7]) == std::vector<unsigned>{0x55, 0x92, 0x00, 0x54, 0x00});
}

TEST_CASE("a foreign module and this one do and answer the same COMMANDs", "[scenario][naive][mmu][MMU_CB]") {
  SideBySide both;
  RandomSource random(11);
  std::map<unsigned, int> results;
  for (int trial = 0; trial < 2'000; ++trial) {
    naive::Frame frame{.id = 0x343};
    for (int byte = 1; byte <= 5; ++byte) frame.b[byte] = static_cast<unsigned char>(random.next());
    frame.b[0] = static_cast<unsigned char>(random.next() % 10);
    if (frame.b[0] == 1) frame.b[1] = static_cast<unsigned char>(trial % 3);          // sleep has its own test
    if (frame.b[0] == 2) frame.b[3] = static_cast<unsigned char>(frame.b[3] % 0xC3);  // up to the measurable maximum
    if (frame.b[0] == 2 && trial % 2 == 0) frame.b[1] = 0x10;
    if (frame.b[0] == 3) {  // 6 in few places, else nearly all would be refused
      for (int byte = 1; byte <= 5 && trial % 4 != 0; ++byte) frame.b[byte] = 0xFF;
      if (trial % 4 == 1) frame.b[2] = 0xF5;
    }
    if (frame.b[0] == 7) frame.b[1] = static_cast<unsigned char>(60 + frame.b[1] % 60);
    both.send(frame, ++both.command_counter);
    both.run(5ms);
    INFO("operation " << int{frame.b[0]} << " " << int{frame.b[1]} << " " << int{frame.b[2]});
    REQUIRE(are_alike(both.from_mmu, both.from_naive));
    REQUIRE(both.from_mmu.size() == 1);
    ++results[both.from_mmu.front().data[1]];
    if (trial % 100 == 0) both.poll(0x1F);
    // With limits that these cells exceed, one would latch a fault while the other starts to count again.
    naive::Frame limits{.id = 0x343, .b = {2, 0x75, 0x30, 0xA4, 0x10}};
    both.send(limits, ++both.command_counter);
    both.run(5ms);
  }
  CHECK(results[0] > 200);
  CHECK(results[1] > 200);
  CHECK(results[2] > 200);
}

TEST_CASE("a foreign module and this one balance alike: minutes, changes, the end, silence",
          "[scenario][naive][mmu][MMU_CB][MMU_N]") {
  SideBySide both;
  constexpr unsigned four = cell_bit(1) | cell_bit(4) | cell_bit(7) | cell_bit(10);
  struct Seen {
    Duration first_on = Duration::max();
    Duration on_for{};
    bool was_another = false;

    void note(unsigned switches, Duration at) {
      was_another = was_another || (switches != 0 && switches != four);
      if (switches != four) return;
      first_on = std::min(first_on, at);
      on_for += 1ms;
    }
  };
  const auto watch = [&both] {
    std::array<Seen, 2> seen;
    for (int ms = 0; ms < 150'000; ++ms) {
      if (ms % 500 == 0) both.poll(0);
      // Repeated while it runs, the command changes nothing.
      if (ms == 40'000) both.send({.id = 0x343, .b = {3, 0x08, 0x04, 0x02, 0x01, 0x00}}, ++both.command_counter);
      both.run(1ms);
      seen[0].note(both.bench.mmu.balancing_cells(), std::chrono::milliseconds(ms));
      seen[1].note(naive_switches(both.naive), std::chrono::milliseconds(ms));
    }
    return seen;
  };
  // Cells 2, 5, 8, 11 for two minutes, the others 0; cell 5 alone is the worked frame 03 FF F5 FF FF F0.
  both.send({.id = 0x343, .b = {3, 0x08, 0x04, 0x02, 0x01, 0x00}}, ++both.command_counter);
  for (const Seen& seen : watch()) {
    CHECK(seen.first_on <= 1s);  // mmu/ switches on full seconds
    CHECK(seen.on_for >= 119'990ms);
    CHECK(seen.on_for <= 120s);
    CHECK_FALSE(seen.was_another);
  }
  both.send({.id = 0x343, .b = {3}}, ++both.command_counter);  // 0 minutes, since the naive module keeps its number
  both.send({.id = 0x343, .b = {3, 0xFF, 0xF5, 0xFF, 0xFF, 0xF0}}, ++both.command_counter);
  both.run_polled(2s);
  CHECK(both.bench.mmu.balancing_cells() == cell_bit(4));
  CHECK(naive_switches(both.naive) == cell_bit(4));
  both.run(1001ms);
  CHECK(both.bench.mmu.balancing_cells() == 0);
  CHECK(naive_switches(both.naive) == 0);
}

TEST_CASE("a foreign module and this one fall asleep, wake and speak alike", "[scenario][naive][mmu][MMU_S]") {
  SideBySide both;
  both.send({.id = 0x340, .b = {1, 3}}, ++both.command_counter);
  both.run(100ms);
  CHECK(both.bench.mmu.is_asleep());
  CHECK(both.naive.asleep);
  const auto both_said_who_they_are = [&both] {
    CHECK(are_alike(both.from_mmu, both.from_naive));
    REQUIRE(both.from_mmu.size() == 1);
    CHECK(both.from_mmu.front().id == 0x303);
    CHECK(both.from_mmu.front().data[6] == 0);
  };
  SECTION("a master") {
    both.poll(0x1F);
    both.run(49ms);
    both_said_who_they_are();
    both.poll(0x1F);
    both.run(10ms);
    CHECK(both.from_mmu.empty());  // less than 50 ms after waking
    CHECK(both.from_naive.empty());
    both.poll(0x1F);
    both.run(10ms);
    CHECK(both.from_mmu.size() == 9);
    CHECK(both.from_naive.size() == 9);
  }
  SECTION("mere traffic") {
    both.send({.id = 0x041}, 1);
    both.run(2s);
    both_said_who_they_are();
    CHECK(both.bench.mmu.is_asleep());
    CHECK_FALSE(both.naive.asleep);  // the protocol has no rule for that
  }
}

TEST_CASE("this module understands the worked frames of the document, and says them",
          "[scenario][mmu][MMU_1][MMU_CB]") {
  MmuBench bench;
  bench.settle();
  for (const WorkedFrame& worked : internal_worked_frames()) {
    const CanFrame frame = worked.frame();
    naive::Frame resealed = plain(frame);
    naive_seal(resealed, frame.data[6]);
    if (has_crc(*worked.message)) CHECK(can(resealed) == frame);
    const bool is_command = frame.id == 0x343;
    if (!is_command) continue;
    INFO("COMMAND " << int{frame.data[0]});
    CHECK(bench.command(frame) == 0);
  }
  CHECK(bench.mmu.limits().undervoltage_uV == 3'000'000);
  CHECK(bench.mmu.limits().overvoltage_uV == 4'200'000);
  bench.run_polled(1s);
  CHECK(bench.mmu.balancing_cells() == cell_bit(4));
}

}  // namespace
}  // namespace bmu
