// Reports of the pack to an inverter, and their times.
#include "daemon/core/vehicle/inverter_reporter.hpp"

#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "devices/device_list.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

/// Healthy pack, and an inverter.
struct Bench {
  InverterConfig config{.driver = find_device("pylontech")->inverter,
                        .charge_voltage_max_mV = 56'000,
                        .discharge_voltage_min_mV = 44'800,
                        .soh_assumed_permille = 1'000};
  PackState pack;
  CurrentLimits limits;
  FaultMemory faults;
  InverterReporter reporter;
  InverterView view{.now = start, .may_charge = true, .may_discharge = true, .soc_permille = 720};

  explicit Bench(const InverterConfig& changed = {}) {
    if (changed.driver != nullptr) config = changed;
    pack.cell_voltage_uV = {.min = 3'300'000, .max = 3'420'000, .count = 16, .expected = 16};
    pack.cell_temperature_dC = {.min = 170, .max = 250, .average = 210, .count = 4, .expected = 4};
    pack.current_mA = {10'000, start, Validity::valid};
    pack.pack_voltage_mV = {52'760, start, Validity::valid};
    limits.charge.limit_mA = limits.charge_continuous.limit_mA = 50'000;
    limits.discharge.limit_mA = limits.discharge_continuous.limit_mA = 100'000;
    view.pack = &pack;
    view.limits = &limits;
    view.faults = &faults;
    reporter.init(config, start);
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;

  std::function<bool(const CanFrame&)> is_lost;  // lost while sent

  /// Identifiers of the frames sent within `span`, with a tick every 10 ms.
  std::vector<std::uint32_t> told_in(Duration span) {
    std::vector<std::uint32_t> ids;
    for (const TimePoint end = view.now + span; view.now < end; view.now += 10ms) {
      reporter.follow(view);
      const auto frame = reporter.step(view);
      if (!frame) continue;
      ids.push_back(frame->id);
      if (is_lost && is_lost(*frame)) reporter.note_failed(*frame);
    }
    return ids;
  }
  [[nodiscard]] InverterLimits allowed() const { return inverter_limits(view, config); }
};

using Ids = std::vector<std::uint32_t>;
const Ids whole_round{0x351, 0x35C, 0x355, 0x356, 0x359, 0x35E};

}  // namespace

TEST_CASE("the current in 356h has the sign that the form is known with, or the pack file's", "[unit][inverter]") {
  constexpr int out = 0x64;  // 10.0 A out of the pack
  constexpr int into = 0x9C;
  struct Case {
    const char* form;
    std::optional<bool> is_discharge_positive;
    int low_byte;
  };
  for (const Case& one :
       {Case{"pylontech", {}, into}, Case{"sma", {}, into}, Case{"victron", {}, into}, Case{"discover", {}, into},
        Case{"orion", {}, out}, Case{"orion", false, into}, Case{"pylontech", true, out}, Case{"orion", true, out}}) {
    CAPTURE(one.form, one.low_byte);
    Bench bench({.driver = find_device(one.form)->inverter,
                 .charge_voltage_max_mV = 56'000,
                 .discharge_voltage_min_mV = 44'800,
                 .soh_assumed_permille = 1'000,
                 .is_discharge_positive = one.is_discharge_positive});
    std::optional<CanFrame> measured;
    for (int tick = 0; tick < 20 && !measured; ++tick, bench.view.now += 10ms) {
      bench.reporter.follow(bench.view);
      const std::optional<CanFrame> frame = bench.reporter.step(bench.view);
      if (frame && frame->id == 0x356) measured = frame;
    }
    REQUIRE(measured);
    CHECK(int{measured->data[2]} == one.low_byte);
  }
}

TEST_CASE("without an inverter nothing is told", "[unit][inverter]") {
  Bench bench;
  bench.reporter.init({}, start);
  CHECK_FALSE(bench.reporter.is_there());
  CHECK(bench.told_in(3s).empty());
  CHECK(bench.reporter.limits() == InverterLimits{});
}

TEST_CASE("a round is told each period, a frame every 10 ms, the limits first", "[unit][inverter]") {
  Bench bench;
  CHECK(bench.told_in(60ms) == whole_round);
  CHECK(bench.told_in(940ms).empty());
  CHECK(bench.told_in(1s) == whole_round);
  bench.view.now += 10s;  // no tick in between
  CHECK(bench.told_in(1s) == whole_round);
}

TEST_CASE("a frame that is left out takes no time, also at the end of a round", "[unit][inverter]") {
  Bench bench;
  bench.config.soh_assumed_permille = 0;
  bench.reporter.init(bench.config, start);
  CHECK(bench.told_in(50ms) == Ids{0x351, 0x35C, 0x356, 0x359, 0x35E});
  bench.pack.pack_voltage_mV = {};
  CHECK(bench.told_in(1s) == Ids{0x351, 0x35C, 0x359, 0x35E});
}

TEST_CASE("what may flow is the least of now, for long, and what the pack file allows", "[unit][inverter]") {
  Bench bench;
  CHECK(bench.allowed() == InverterLimits{50'000, 100'000});
  bench.limits.charge_continuous.limit_mA = 40'000;
  bench.limits.discharge.limit_mA = 90'000;
  CHECK(bench.allowed() == InverterLimits{40'000, 90'000});
  bench.config.charge_max_mA = 39'999;
  bench.config.discharge_max_mA = 90'001;
  CHECK(bench.allowed() == InverterLimits{39'999, 90'000});
  bench.limits.charge.limit_mA = -1;
  CHECK(bench.allowed().charge_mA == 0);
}

TEST_CASE("nothing may flow without permission, with a hole in the picture, or while it is held back",
          "[unit][inverter]") {
  Bench bench;
  bench.view.may_charge = false;
  CHECK(bench.allowed() == InverterLimits{0, 100'000});
  bench.view.may_charge = true;
  bench.view.may_discharge = false;
  CHECK(bench.allowed() == InverterLimits{50'000, 0});
  bench.view.may_discharge = true;
  bench.view.is_held_back = true;
  CHECK(bench.allowed() == InverterLimits{});
  bench.view.is_held_back = false;
  bench.pack.current_mA.validity = Validity::unknown;
  CHECK(bench.allowed() == InverterLimits{});
  bench.pack.current_mA.validity = Validity::valid;
  --bench.pack.cell_voltage_uV.count;
  CHECK(bench.allowed() == InverterLimits{});
  bench.reporter.follow(bench.view);
  const BatteryReport told = bench.reporter.report(bench.view);
  CHECK_FALSE(told.may_charge);
  CHECK_FALSE(told.may_discharge);
  CHECK_FALSE(told.cell_voltage_min_uV.is_valid());
  CHECK(told.temperature_dC == known(210));
}

TEST_CASE("a limit that falls is told at once, and not more often than it may be", "[unit][inverter]") {
  Bench bench;
  CHECK(bench.told_in(300ms) == whole_round);
  bench.limits.charge.limit_mA = 49'501;
  CHECK(bench.told_in(100ms).empty());
  bench.limits.charge.limit_mA = 49'500;
  CHECK(bench.told_in(60ms) == whole_round);
  bench.limits.discharge.limit_mA = 0;
  CHECK(bench.told_in(140ms).empty());  // 200 ms from round to round
  CHECK(bench.told_in(60ms) == whole_round);
  CHECK(bench.told_in(940ms).empty());  // the next regular round
  CHECK(bench.told_in(60ms) == whole_round);
  bench.limits.discharge.limit_mA = 100'000;  // a rise waits
  CHECK(bench.told_in(900ms).empty());
}

TEST_CASE("the last little current that goes is told at once, too", "[unit][inverter]") {
  Bench bench;
  bench.limits.charge.limit_mA = 300;
  bench.limits.discharge.limit_mA = 300;
  CHECK(bench.told_in(300ms) == whole_round);
  bench.limits.charge.limit_mA = 1;
  CHECK(bench.told_in(50ms).empty());
  bench.limits.charge.limit_mA = 0;
  CHECK(bench.told_in(60ms) == whole_round);
}

TEST_CASE("what did not get out has not been told, and is told again as soon as it may be", "[unit][inverter]") {
  const std::uint32_t lost_id = GENERATE(0x351U, 0x35CU);
  Bench bench;
  CHECK(bench.told_in(300ms) == whole_round);
  bench.limits.charge.limit_mA = 0;
  bench.is_lost = [lost_id](const CanFrame& frame) { return frame.id == lost_id; };
  CHECK(bench.told_in(60ms) == whole_round);
  CHECK(bench.told_in(140ms).empty());
  CHECK(bench.told_in(60ms) == whole_round);  // until it is sent
  bench.is_lost = {};
  CHECK(bench.told_in(140ms).empty());
  CHECK(bench.told_in(60ms) == whole_round);
  CHECK(bench.told_in(940ms).empty());  // the next regular round
  CHECK(bench.told_in(60ms) == whole_round);
}

TEST_CASE("what rises and falls while a round is told is taken back at once", "[unit][inverter]") {
  Bench bench;
  bench.limits.charge.limit_mA = 0;
  CHECK(bench.told_in(10ms) == Ids{0x351});
  bench.limits.charge.limit_mA = 50'000;
  CHECK(bench.told_in(10ms) == Ids{0x35C});  // reports that charging is permitted
  bench.limits.charge.limit_mA = 0;
  CHECK(bench.told_in(180ms) == Ids{0x355, 0x356, 0x359, 0x35E});
  CHECK(bench.told_in(60ms) == whole_round);
}

TEST_CASE("what rises behind the frames of a round that say what may flow is not told by it", "[unit][inverter]") {
  Bench bench;
  bench.limits.charge.limit_mA = 0;
  CHECK(bench.told_in(20ms) == Ids{0x351, 0x35C});
  bench.limits.charge.limit_mA = 50'000;
  CHECK(bench.told_in(10ms) == Ids{0x355});
  bench.limits.charge.limit_mA = 0;
  CHECK(bench.told_in(970ms) == Ids{0x356, 0x359, 0x35E});
  CHECK(bench.told_in(60ms) == whole_round);
}

TEST_CASE("a measurement that did not get out waits for the next round", "[unit][inverter]") {
  Bench bench;
  bench.is_lost = [](const CanFrame& frame) { return frame.id != 0x351 && frame.id != 0x35C; };
  CHECK(bench.told_in(60ms) == whole_round);
  CHECK(bench.told_in(940ms).empty());
  bench.reporter.init({}, start);
  bench.reporter.note_failed(data_frame(0x351, 8));  // no inverter is configured
}

TEST_CASE("a charge is asked for while the pack is nearly empty and may take it", "[unit][inverter]") {
  Bench bench;
  const auto asks_at = [&bench](std::optional<std::int32_t> soc_permille) {
    bench.view.soc_permille = soc_permille;
    bench.reporter.follow(bench.view);
    return bench.reporter.asks_for_charge();
  };
  CHECK_FALSE(asks_at(50));
  CHECK(asks_at(49));
  CHECK(asks_at(99));
  CHECK(bench.reporter.report(bench.view).asks_for_charge);
  CHECK_FALSE(asks_at(100));
  CHECK_FALSE(asks_at(99));
  CHECK(asks_at(49));
  CHECK_FALSE(asks_at(std::nullopt));
  bench.view.may_charge = false;
  CHECK_FALSE(asks_at(49));
  bench.view.may_charge = true;
  bench.config.force_charge_permille = 0;
  bench.reporter.init(bench.config, start);
  CHECK_FALSE(asks_at(0));
}

TEST_CASE("a full charge is asked for when there has been none for as many days", "[unit][inverter]") {
  Bench bench;
  const auto asks_after = [&bench](Duration after, std::int32_t soc_permille) {
    bench.view.now = start + after;
    bench.view.soc_permille = soc_permille;
    bench.reporter.follow(bench.view);
    return bench.reporter.asks_for_full_charge();
  };
  constexpr Duration days_30 = std::chrono::hours{24 * 30};
  CHECK_FALSE(asks_after(days_30 - 1s, 969));
  CHECK(asks_after(days_30, 969));
  CHECK(bench.reporter.report(bench.view).asks_for_full_charge);
  CHECK_FALSE(asks_after(days_30, 970));
  CHECK_FALSE(asks_after(2 * days_30 - 1s, 500));
  CHECK(asks_after(2 * days_30, 500));
  // Nor if charging is not permitted, or the SOC is unknown.
  bench.view.may_charge = false;
  CHECK_FALSE(asks_after(2 * days_30, 500));
  bench.view.may_charge = true;
  CHECK(asks_after(2 * days_30, 500));
  bench.view.soc_permille = std::nullopt;
  bench.reporter.follow(bench.view);
  CHECK_FALSE(bench.reporter.asks_for_full_charge());
  bench.config.full_charge_after_days = 0;
  bench.reporter.init(bench.config, start);
  CHECK_FALSE(asks_after(100 * days_30, 500));
}

TEST_CASE("the days without a full charge go on with the next daemon", "[unit][inverter]") {
  Bench bench;
  const auto hours_at = [&bench](Duration after, std::int32_t soc_permille) {
    bench.view.now = start + after;
    bench.view.soc_permille = soc_permille;
    bench.reporter.follow(bench.view);
    return bench.reporter.hours_since_full(bench.view.now);
  };
  CHECK(hours_at(2h - 1ns, 500) == 1);
  CHECK(hours_at(2h, 500) == 2);
  bench.reporter.init(bench.config, start);
  bench.reporter.restore(30 * 24 - 1);
  CHECK(hours_at(1h - 1ns, 500) == 30 * 24 - 1);
  CHECK_FALSE(bench.reporter.asks_for_full_charge());
  CHECK(hours_at(1h, 500) == 30 * 24);
  CHECK(bench.reporter.asks_for_full_charge());
  CHECK(hours_at(2h, 970) == 0);
  CHECK_FALSE(bench.reporter.asks_for_full_charge());
  bench.reporter.restore(std::numeric_limits<std::uint32_t>::max());
  CHECK(hours_at(3h, 500) == InverterReporter::hours_max);
}

TEST_CASE("a daemon counts on the hours that it is given, and keeps that the pack was full", "[unit][core][inverter]") {
  CoreConfig config = test::small_pack();
  config.inverter.driver = find_device("pylontech")->inverter;
  const auto kept_at = [&config](std::int32_t voltage_uV) {
    test::CoreBench bench(config, {.hours_since_full = 100});
    for (test::BenchModule& module : bench.modules) module.cell_voltage_uV.fill(known(voltage_uV));
    bench.run(4s);
    REQUIRE(bench.core().inverter_report().soc_permille.is_valid());
    return bench.core().persistent().hours_since_full;
  };
  CHECK(kept_at(3'700'000) == 100);
  CHECK(kept_at(4'199'000) == 0);
}

TEST_CASE("health is told as it is known, or as the pack file assumes it, or not", "[unit][inverter]") {
  Bench bench;
  CHECK(bench.reporter.report(bench.view).soh_permille == known(1'000));
  bench.config.soh_assumed_permille = 0;
  bench.reporter.init(bench.config, start);
  CHECK_FALSE(bench.reporter.report(bench.view).soh_permille.is_valid());
  PackEstimate estimate;
  bench.view.estimate = &estimate;
  CHECK_FALSE(bench.reporter.report(bench.view).soh_permille.is_valid());
  bench.view.soc_permille = std::nullopt;
  CHECK_FALSE(bench.reporter.report(bench.view).soc_permille.is_valid());
  bench.pack.current_mA.validity = Validity::out_of_range;
  CHECK_FALSE(bench.reporter.report(bench.view).current_mA.is_valid());
}

TEST_CASE("faults are alarms where they open or keep open for who asks, and warnings where not", "[unit][inverter]") {
  const bool is_closed = GENERATE(false, true);
  const Wish wish = GENERATE(Wish{}, Wish{.by_vehicle = true}, Wish{.by_charger = true});
  for (const FaultRow& row : fault_table()) {
    INFO(row.name << ", closed " << is_closed << ", by vehicle " << wish.by_vehicle << ", by charger "
                  << wish.by_charger);
    Bench bench;
    bench.view.is_closed = is_closed;
    bench.view.wish = wish;
    CHECK(battery_alarms(bench.view).alarms == 0);
    CHECK(battery_alarms(bench.view).warnings == 0);
    bench.faults.restore_lock(row.id, {}, 0, start);
    const BatteryAlarms told = battery_alarms(bench.view);
    const bool is_asked_for =
        row.concerns == Concerns::all || (row.concerns == Concerns::charge ? wish.by_charger : !wish.by_charger);
    const bool opens = row.reaction == Reaction::open_now || row.reaction == Reaction::open_after_grace;
    const bool keeps_open = opens || row.reaction == Reaction::refuse_close;
    CHECK((told.alarms != 0) == (is_asked_for && (is_closed ? opens : keeps_open)));
    CHECK((told.warnings != 0) == (told.alarms == 0));
  }
}

TEST_CASE("each fault has its alarm, and a value beyond its warning is a warning", "[unit][inverter]") {
  const CoreConfig config = test::small_pack();
  const auto alarms_of = [](FaultId id) {
    Bench bench;
    bench.faults.restore_lock(id, {}, 0, start);
    return battery_alarms(bench.view).alarms;
  };
  CHECK(alarms_of(FaultId::cell_overvoltage) == bit_of(BatteryAlarm::high_voltage));
  CHECK(alarms_of(FaultId::emergency_stop) == bit_of(BatteryAlarm::general));
  Bench warned;
  FaultChanges changes;
  const LimitConfig& high = config.limits.cell_overvoltage;
  for (TimePoint at = start; at < start + 2s; at += 100ms) {
    warned.faults.judge(row_of(FaultId::cell_overvoltage), {true, high.warn, {}, at}, config.limits, at, changes);
    changes = {};
  }
  CHECK(battery_alarms(warned.view).alarms == 0);
  CHECK(battery_alarms(warned.view).warnings == bit_of(BatteryAlarm::high_voltage));
}

TEST_CASE("a charger that is plugged in and may not be connected keeps an open pack open: an alarm",
          "[unit][inverter]") {
  Bench bench;
  bench.view.wish.by_vehicle = true;
  bench.view.is_plugged_in = GENERATE(false, true);
  bench.faults.restore_lock(FaultId::charger_runaway, {}, 0, start);
  REQUIRE(row_of(FaultId::charger_runaway).bars_while_plugged_in);
  CHECK((battery_alarms(bench.view).alarms != 0) == bench.view.is_plugged_in);
}
