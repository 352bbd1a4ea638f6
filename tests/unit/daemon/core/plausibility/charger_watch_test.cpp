// Charger reports compared with the request and with the pack's sensor; and the request itself, tick by tick.
#include "daemon/core/plausibility/charger_watch.hpp"

#include <span>
#include <string>
#include <vector>

#include "daemon/core/charging/charge_control.hpp"
#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/measurement/charger_table.hpp"
#include "devices/device_list.hpp"
#include "protocol/image.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

const ChargerDriver& elcon() {
  return *find_device("elcon_tc")->charger;
}

/// Two chargers that report the values set by the test once a second, and their monitor.
struct Bench {
  ChargerConfig config{.driver = &elcon(), .unit_count = 2};
  ChargerTable table;
  ChargerWatch watch;
  PackState pack;
  TimePoint now{100s};
  std::int32_t sensed_mA = 0;               // out of the pack
  std::vector<std::int32_t> told_mA{0, 0};  // by each unit
  std::int32_t told_mV = 300'000;
  bool reports_current = true;  // otherwise more than any charger can supply
  std::vector<bool> talks{true, true};
  ChargerWatchInputs in{.is_plugged_in = true, .is_alone = true, .asked_mV = 400'000};

  Bench() { table.init(config); }
  void run(Duration span) {
    for (const TimePoint end = now + span; now < end; now += 10ms) {
      const bool is_second = to_ms(now.time_since_epoch()) % 1'000 == 0;
      for (std::uint8_t unit = 0; is_second && unit < 2; ++unit) {
        if (!talks[unit]) continue;
        const ChargerReport report{.voltage_mV = known(told_mV), .current_mA = known(told_mA[unit])};
        for (CanFrame frame : elcon().reports(unit, report)) {
          if (!reports_current) frame.data[2] = 0xFF;
          REQUIRE(table.observe(frame, now));
        }
      }
      pack.current_mA = {sensed_mA, now, Validity::valid};
      in.now = now;
      in.pack = &pack;
      in.table = &table;
      watch.update(in);
    }
  }
  void charge(std::int32_t current_mA) {
    in.is_enabled = true;
    in.asked_mA = current_mA;
    sensed_mA = -current_mA;
    told_mA = {current_mA / 2, current_mA / 2};
  }
};

}  // namespace

TEST_CASE("chargers are known together: the sum of their currents, the highest voltage", "[unit][charger][BMU_11]") {
  Bench bench;
  CHECK_FALSE(bench.table.current_mA(bench.now).is_valid());
  bench.told_mA = {3'000, 5'000};
  bench.run(2s);
  CHECK(bench.table.current_mA(bench.now).value == 8'000);
  CHECK(bench.table.voltage_mV(bench.now).value == 300'000);
  CHECK(bench.table.talking_count(bench.now) == 2);
  bench.talks[1] = false;
  bench.run(3s);
  CHECK(bench.table.talking_count(bench.now) == 1);
  CHECK(bench.table.current_mA(bench.now).value == 3'000);
  bench.talks[0] = false;
  bench.run(3s);
  CHECK(bench.table.talking_count(bench.now) == 0);
  CHECK_FALSE(bench.table.current_mA(bench.now).is_valid());
  CHECK_FALSE(bench.table.voltage_mV(bench.now).is_valid());
}

TEST_CASE("a unit that the pack file does not have is not counted, a broken frame is", "[unit][charger]") {
  Bench bench;
  const ChargerReport report{.voltage_mV = known(300'000), .current_mA = known(9'000)};
  for (const CanFrame& frame : elcon().reports(3, report)) CHECK(bench.table.observe(frame, bench.now));
  CHECK(bench.table.talking_count(bench.now) == 0);
  CanFrame broken = elcon().reports(1, report)[0];
  broken.length = 7;
  CHECK(bench.table.observe(broken, bench.now));
  CHECK(bench.table.unit(1).frames_refused == 1);
  CHECK(bench.table.talking_count(bench.now) == 0);
  CHECK_FALSE(bench.table.observe(data_frame(0x123, 8), bench.now));
  CHECK(bench.table.foreign_command_at() == TimePoint{});
  CHECK(bench.table.observe(elcon().command(2, {}), bench.now));  // not a unit of this pack
  CHECK(bench.table.foreign_command_at() == TimePoint{});
  CHECK(bench.table.observe(elcon().command(0, {}), bench.now));
  CHECK(bench.table.foreign_command_at() == bench.now);
  bench.table.forget_values();
  CHECK_FALSE(bench.table.unit(1).report.current_mA.is_valid());
  ChargerTable none;
  none.init({});
  CHECK_FALSE(none.observe(elcon().command(0, {}), bench.now));
  CHECK(none.unit_count() == 0);
}

TEST_CASE("a second master is noticed whichever address it has, for each unit", "[unit][charger][F98]") {
  for (const MasterAddress ours : {MasterAddress::f4, MasterAddress::f5}) {
    for (const MasterAddress its : {MasterAddress::f4, MasterAddress::f5}) {
      for (std::uint8_t unit = 0; unit < charger_units_max; ++unit) {
        ChargerTable table;
        table.init({.driver = &elcon(), .unit_count = charger_units_max, .master_address = ours});
        CHECK(table.observe(elcon().command(unit, {.master_address = its}), TimePoint{1s}));
        CHECK(table.foreign_command_at() == TimePoint{1s});
      }
    }
  }
}

TEST_CASE("a second master is noticed whatever the length of its commands", "[unit][charger][F98]") {
  for (const char* const name : {"elcon_tc", "brusa_nlg5"}) {
    const ChargerDriver& driver = *find_device(name)->charger;
    for (std::uint8_t length = 0; length <= 8; ++length) {
      INFO(name << ", " << int{length} << " bytes");
      ChargerTable table;
      table.init({.driver = &driver});
      CanFrame command = driver.command(0, {.is_enabled = true, .voltage_mV = 400'000, .current_mA = 8'000});
      command.length = length;
      CHECK(table.observe(command, TimePoint{1s}));
      CHECK(table.foreign_command_at() == TimePoint{1s});
      CHECK(table.unit(0).frames_refused == 0);  // not a report of the charger
    }
  }
}

TEST_CASE("values of a charger that are out of range are counted and are no measurement", "[unit][charger]") {
  Bench bench;
  const CanFrame beyond{.id = 0x18FF50E7, .is_extended = true, .length = 8, .data = {0xFF, 0xFF, 0xFF, 0xFF}};
  CHECK(bench.table.observe(beyond, bench.now));
  CHECK(bench.table.unit(1).values_out_of_range == 2);
  CHECK(bench.table.unit(1).frames_refused == 0);
  CHECK_FALSE(bench.table.current_mA(bench.now).is_valid());
  CHECK_FALSE(bench.table.voltage_mV(bench.now).is_valid());
}

TEST_CASE("a unit that falls silent while it charges is noticed, one that was not charging is not",
          "[unit][charger][F98]") {
  Bench bench;
  bench.run(2s);
  bench.talks[1] = false;
  bench.run(10s);
  CHECK(bench.watch.silent_unit() == 0);
  bench.talks[1] = true;
  bench.charge(10'000);
  bench.run(10s);
  CHECK(bench.watch.silent_unit() == 0);
  bench.talks[1] = false;
  bench.run(bench.table.silence_max() + 1s);
  CHECK(bench.watch.silent_unit() == 2);
  bench.in.is_enabled = false;
  bench.run(1s);
  CHECK(bench.watch.silent_unit() == 2);  // until it is received
  SECTION("heard") {
    bench.talks[1] = true;
    bench.run(2s);
    CHECK(bench.watch.silent_unit() == 0);
  }
  SECTION("unplugged") {
    bench.in.is_plugged_in = false;
    bench.run(1s);
    CHECK(bench.watch.silent_unit() == 0);
  }
}

TEST_CASE("more than was asked for is a runaway, by the sensor, by its own word, and by voltage",
          "[unit][charger][F97]") {
  Bench bench;
  bench.charge(10'000);
  bench.run(20s);
  REQUIRE_FALSE(bench.watch.runs_away());
  SECTION("the most that a sensor can tell") {
    bench.sensed_mA = INT32_MIN;
    bench.run(1s);
    CHECK(bench.watch.runs_away());
    CHECK(bench.watch.excess().given == INT32_MAX);
  }
  SECTION("within the tolerance") {
    bench.sensed_mA = -11'000;
    bench.run(1s);
    CHECK_FALSE(bench.watch.runs_away());
  }
  SECTION("by the sensor") {
    bench.sensed_mA = -11'001;
    bench.run(1s);
    CHECK(bench.watch.runs_away());
    CHECK(bench.watch.excess().given == 11'001);
    CHECK(bench.watch.excess().allowed == 11'000);
  }
  SECTION("a braking vehicle is none") {
    bench.sensed_mA = -30'000;
    bench.in.is_alone = false;
    bench.run(1s);
    CHECK_FALSE(bench.watch.runs_away());
  }
  SECTION("by its own word, where a vehicle may brake") {
    bench.told_mA = {8'000, 8'000};
    bench.in.is_alone = false;
    bench.run(2s);
    CHECK(bench.watch.runs_away());
    CHECK(bench.watch.runs_away_at() == bench.table.current_mA(bench.now).taken_at);
  }
  SECTION("by its own word, three times in a row, against a sensor that sees what was asked for") {
    bench.told_mA = {6'000, 6'000};  // maximum tolerance, one ampere for each
    bench.run(5s);
    CHECK_FALSE(bench.watch.runs_away());
    bench.told_mA = {6'100, 6'000};
    bench.run(2s);
    CHECK_FALSE(bench.watch.runs_away());
    bench.run(1s);
    CHECK(bench.watch.runs_away());
    CHECK(bench.watch.excess().given == 12'100);  // in steps of 100 mA
    CHECK(bench.watch.excess().allowed == 12'000);
    CHECK(bench.watch.runs_away_at() == bench.table.current_mA(bench.now).taken_at);
  }
  SECTION("twice is nothing, and not twice and once again") {
    for (int count = 0; count < 3; ++count) {
      bench.told_mA = {8'000, 8'000};
      bench.run(2s);
      CHECK_FALSE(bench.watch.runs_away());
      bench.told_mA = {5'000, 5'000};
      bench.run(1s);
      CHECK_FALSE(bench.watch.runs_away());
    }
  }
  SECTION("a reversed sensor hides nothing") {
    bench.sensed_mA = 20'000;
    bench.told_mA = {10'000, 10'000};
    bench.run(3s);
    CHECK(bench.watch.runs_away());
    CHECK(bench.watch.excess().given == 20'000);
  }
  SECTION("nothing that is not plugged in runs away") {
    bench.in.is_plugged_in = false;
    bench.sensed_mA = -30'000;
    bench.told_mV = 500'000;
    bench.run(2s);
    CHECK_FALSE(bench.watch.runs_away());
  }
  SECTION("by voltage") {
    bench.told_mV = 408'000;
    bench.run(2s);
    CHECK_FALSE(bench.watch.runs_away());
    bench.told_mV = 408'100;
    bench.run(2s);
    CHECK(bench.watch.runs_away());
    CHECK(bench.watch.excess().given == 408'100);
  }
}

TEST_CASE("a charger that is slow to come down is none that runs away", "[unit][charger][F97]") {
  Bench bench;
  bench.charge(20'000);
  bench.run(20s);
  bench.in.asked_mA = 5'000;
  bench.run(elcon().settle - 100ms);
  CHECK_FALSE(bench.watch.runs_away());
  bench.run(elcon().settle / 8 + 300ms);
  CHECK(bench.watch.runs_away());
}

TEST_CASE("a step down has the whole time to settle, wherever it comes in a slow decline", "[unit][charger][F97]") {
  for (Duration wait = 10ms; wait < elcon().settle; wait += 487ms) {
    INFO(to_ms(wait));
    Bench bench;
    bench.charge(20'000);
    bench.run(20s);
    bench.in.asked_mA = 19'900;
    bench.run(wait);
    bench.in.asked_mA = 2'000;
    bench.run(elcon().settle - 100ms);
    CHECK_FALSE(bench.watch.runs_away());
    bench.run(elcon().settle / 8 + 300ms);
    CHECK(bench.watch.runs_away());
  }
}

TEST_CASE("current after the stop is noticed once it has had its time", "[unit][charger][F99]") {
  Bench bench;
  bench.charge(10'000);
  bench.run(20s);
  bench.in.is_enabled = false;
  bench.sensed_mA = -9'000;  // it falls
  bench.run(elcon().settle - 100ms);
  CHECK_FALSE(bench.watch.keeps_on());
  CHECK_FALSE(bench.watch.runs_away());
  bench.run(300ms);
  CHECK(bench.watch.keeps_on());
  CHECK_FALSE(bench.watch.runs_away());
  bench.sensed_mA = -1'000;
  bench.run(100ms);
  CHECK_FALSE(bench.watch.keeps_on());
  // Regenerative braking is permitted, but not if the charger reports the same current.
  bench.sensed_mA = -5'000;
  bench.in.is_alone = false;
  bench.run(2s);
  CHECK(bench.watch.keeps_on());
  bench.told_mA = {0, 0};
  bench.run(2s);
  CHECK_FALSE(bench.watch.keeps_on());
  bench.told_mA = {5'000, 5'000};
  bench.sensed_mA = 0;
  bench.run(4s);
  CHECK_FALSE(bench.watch.keeps_on());
  CHECK(bench.watch.contradicts());
}

TEST_CASE("a charger that does not begin to come down after the stop is noticed after two fifths of its time",
          "[unit][charger][F99]") {
  REQUIRE(ChargerWatch::begins_within(elcon().settle) == 2s);
  Bench bench;
  bench.charge(10'000);
  bench.run(20s);
  bench.in.is_enabled = false;
  SECTION("alone, by the sensor") {
    bench.sensed_mA = -9'010;
    bench.run(2s);
    CHECK_FALSE(bench.watch.keeps_on());
    bench.run(20ms);
    CHECK(bench.watch.keeps_on());
  }
  SECTION("alone, and asked for more than it could give: of that nobody knows when it begins") {
    bench.in.is_enabled = true;
    bench.charge(12'000);
    bench.run(20s);
    bench.in.is_enabled = false;
    bench.sensed_mA = -10'000;
    bench.run(elcon().settle - 100ms);
    CHECK_FALSE(bench.watch.keeps_on());
    bench.run(300ms);
    CHECK(bench.watch.keeps_on());
  }
  SECTION("in a driven pack, by three reports of its own and the sensor") {
    bench.in.is_alone = false;
    bench.run(4s);
    CHECK_FALSE(bench.watch.keeps_on());
    bench.run(1s);
    CHECK(bench.watch.keeps_on());
  }
  SECTION("in a driven pack, where its reports say that it comes down") {
    bench.in.is_alone = false;
    bench.told_mA = {4'000, 4'000};
    bench.run(elcon().settle + 2s);
    CHECK_FALSE(bench.watch.keeps_on());
    bench.run(1s);
    CHECK(bench.watch.keeps_on());
  }
}

TEST_CASE("a sensor that sees leave the pack what the charger gives is a mirror of it, and no other is",
          "[unit][charger]") {
  struct Row {
    const char* what;
    std::int32_t told_mA;
    std::int32_t sensed_mA;
    bool is_plugged_in;
    bool is_alone;
    bool is_mirror;
  };
  for (const Row& row :
       {Row{"as much", 4'000, 4'000, true, true, true}, Row{"a little less", 4'000, 3'000, true, true, true},
        Row{"too little", 4'000, 2'990, true, true, false}, Row{"a tenth more", 20'000, 22'000, true, true, true},
        Row{"too much", 20'000, 22'010, true, true, false},
        Row{"the right way round", 4'000, -4'000, true, true, false},
        Row{"next to nothing", 1'000, 1'500, true, true, false}, Row{"unplugged", 4'000, 4'000, false, true, false},
        Row{"beside a vehicle", 4'000, 4'000, true, false, false}}) {
    CAPTURE(row.what);
    Bench bench;
    bench.in.is_plugged_in = row.is_plugged_in;
    bench.in.is_alone = row.is_alone;
    bench.told_mA = {row.told_mA / 2, row.told_mA / 2};
    bench.sensed_mA = row.sensed_mA;
    bench.run(3s);
    CHECK((bench.watch.mirrored_at() == bench.now - 10ms) == row.is_mirror);
    CHECK((bench.watch.mirrored_at() == TimePoint{}) == !row.is_mirror);
  }
}

TEST_CASE("chargers that tell another current than the sensor are noticed, loads beside them are not",
          "[unit][charger]") {
  Bench bench;
  bench.charge(20'000);
  bench.run(30s);
  CHECK_FALSE(bench.watch.contradicts());
  bench.sensed_mA = -12'000;  // a load draws 8 A
  bench.run(1s);
  CHECK_FALSE(bench.watch.contradicts());
  bench.sensed_mA = -5'900;
  bench.run(1s);
  CHECK(bench.watch.contradicts());
  bench.sensed_mA = -20'000;
  bench.told_mA = {5'000, 5'000};
  bench.run(2s);
  CHECK(bench.watch.contradicts());
  bench.in.asked_mA = 12'000;  // the charger is still changing its current
  bench.run(1s);
  CHECK_FALSE(bench.watch.contradicts());
}

TEST_CASE("a charger that tells another voltage than the pack's sensor is noticed", "[unit][charger]") {
  Bench bench;
  bench.pack.pack_voltage_mV = {300'000, bench.now, Validity::valid};
  bench.charge(20'000);
  bench.in.is_alone = GENERATE(true, false);
  bench.run(30s);
  CHECK_FALSE(bench.watch.contradicts());
  for (const auto& [told_mV, differs] : {std::pair{312'000, false}, std::pair{312'100, true}, std::pair{288'000, false},
                                         std::pair{287'900, true}, std::pair{0, true}, std::pair{300'000, false}}) {
    bench.told_mV = told_mV;
    bench.run(2s);
    CAPTURE(told_mV);
    CHECK(bench.watch.contradicts() == differs);
  }
  bench.told_mV = 0;
  bench.pack.pack_voltage_mV = {};
  bench.run(2s);
  CHECK_FALSE(bench.watch.contradicts());
  // For a small pack two volts for each of the two sensors.
  bench.pack.pack_voltage_mV = {24'000, bench.now, Validity::valid};
  bench.told_mV = 28'000;
  bench.run(2s);
  CHECK_FALSE(bench.watch.contradicts());
  bench.told_mV = 28'100;
  bench.run(2s);
  CHECK(bench.watch.contradicts());
  bench.in.is_enabled = false;
  bench.run(1s);
  CHECK_FALSE(bench.watch.contradicts());
}

TEST_CASE("a charger's voltage is compared with the pack's sensor though its current is no number", "[unit][charger]") {
  Bench bench;
  bench.pack.pack_voltage_mV = {300'000, bench.now, Validity::valid};
  bench.charge(20'000);
  bench.reports_current = false;
  bench.run(30s);
  REQUIRE_FALSE(bench.table.current_mA(bench.now).is_valid());
  REQUIRE(bench.table.voltage_mV(bench.now).is_valid());
  CHECK_FALSE(bench.watch.contradicts());
  bench.told_mV = 320'000;
  bench.run(2s);
  CHECK(bench.watch.contradicts());
  CHECK(bench.table.talking_count(bench.now) == 0);  // not used for charging
}

TEST_CASE("a temperature that none can have is counted, whichever frame brings it, each time", "[unit][charger]") {
  ChargerTable table;
  table.init({.driver = find_device("brusa_nlg5")->charger, .unit_count = 1});
  CanFrame heat{.id = 0x613, .length = 8, .data = {0x7F, 0xFF}};
  for (std::uint64_t frames = 1; frames <= 2; ++frames) {
    REQUIRE(table.observe(heat, TimePoint{100s}));
    CHECK(table.unit(0).report.temperature_dC.validity == Validity::out_of_range);
    CHECK(table.unit(0).values_out_of_range == frames);
  }
  heat.data = {0x01, 0x2C};
  REQUIRE(table.observe(heat, TimePoint{101s}));
  CHECK(table.unit(0).report.temperature_dC == known(300));
  // A frame of voltage and current keeps the temperature, and counts its own values.
  CanFrame actual{.id = 0x611, .length = 8, .data = {0, 0, 0, 0, 0x3A, 0x99, 0x03, 0x20}};
  REQUIRE(table.observe(actual, TimePoint{102s}));
  CHECK(table.unit(0).report.temperature_dC == known(300));
  CHECK(table.unit(0).values_out_of_range == 3);
}

TEST_CASE("one wrong report of one of several units is one, whenever the others report", "[unit][charger][F97]") {
  Bench bench;
  bench.charge(10'000);
  bench.run(20s);
  const auto reports = [&](std::uint8_t unit, std::int32_t current_mA) {
    const ChargerReport report{.voltage_mV = known(300'000), .current_mA = known(current_mA)};
    for (const CanFrame& frame : elcon().reports(unit, report)) REQUIRE(bench.table.observe(frame, bench.now));
  };
  bench.talks = {false, false};
  bool runs_away = false;
  const auto wait = [&](Duration span) {
    for (const TimePoint end = bench.now + span; bench.now < end;) {
      bench.run(10ms);
      runs_away = runs_away || bench.watch.runs_away();
    }
  };
  const int wrong_reports = GENERATE(1, 2, 4);
  for (int second = 0; second < 6; ++second) {
    reports(0, second < wrong_reports ? 20'000 : 5'000);
    wait(330ms);
    reports(1, 5'000);
    wait(330ms);
    reports(1, 5'000);  // one that reports more often
    wait(330ms);
  }
  CHECK(runs_away == (wrong_reports == 4));
}

TEST_CASE("a charger has its time to follow from the moment it is asked, however little it is asked for",
          "[unit][charger]") {
  Bench bench;
  bench.pack.pack_voltage_mV = {300'000, bench.now, Validity::valid};
  if (GENERATE(true, false)) bench.run(60s);  // without a request
  bench.told_mV = 0;                          // its output is off
  bench.charge(500);
  const Duration patience = elcon().settle + bench.table.silence_max();
  bench.run(patience);
  CHECK_FALSE(bench.watch.contradicts());
  bench.run(1s);
  CHECK(bench.watch.contradicts());
}

TEST_CASE("a charging post is asked for mains by decision only, whether or not something is to flow",
          "[unit][charger][gate]") {
  const ChargerDriver& brusa = *find_device("brusa_nlg5")->charger;
  const std::vector<std::int32_t> ordered_mA{0};
  for (const bool is_enabled : {false, true}) {
    for (const bool may_request : {false, true}) {
      const GateRules rules{.charger = &brusa,
                            .may_charge = true,
                            .may_request_mains = may_request,
                            .charge_current_mA = 10'000,
                            .ordered_mA = ordered_mA,
                            .charge_voltage_mV = 400'000};
      const auto judge = [&](bool requests) {
        return judge_output(
            Port::charger,
            brusa.command(
                0, {.is_enabled = is_enabled, .voltage_mV = 400'000, .current_mA = 10'000, .requests_mains = requests}),
            rules);
      };
      CAPTURE(is_enabled, may_request);
      CHECK(judge(false) == GateVerdict::pass);
      CHECK(judge(true) == (may_request ? GateVerdict::pass : GateVerdict::not_permitted));
    }
  }
}

TEST_CASE("nothing is asked of a charger beyond what was decided, whoever made the frame", "[unit][charger][gate]") {
  std::vector<std::int32_t> ordered_mA{0, 0};
  GateRules rules{.charger = &elcon(),
                  .may_charge = true,
                  .charge_current_mA = 10'000,
                  .ordered_mA = ordered_mA,
                  .charge_voltage_mV = 400'000};
  const auto judge = [&rules](const ChargerOrder& order) {
    return judge_output(Port::charger, elcon().command(1, order), rules);
  };
  ChargerOrder order{.is_enabled = true, .voltage_mV = 400'000, .current_mA = 10'000};
  CHECK(judge(order) == GateVerdict::pass);
  order.current_mA = 10'100;
  CHECK(judge(order) == GateVerdict::not_permitted);
  order.current_mA = 10'000;
  ordered_mA[0] = 100;  // commanded to the other unit
  CHECK(judge(order) == GateVerdict::not_permitted);
  ordered_mA[1] = 12'000;  // less than commanded before
  CHECK(judge(order) == GateVerdict::pass);
  ordered_mA[1] = 10'000;  // nor is the same value as before an increase
  CHECK(judge(order) == GateVerdict::pass);
  ordered_mA = {0, 0};
  rules.ordered_mA = std::span(ordered_mA).first(1);
  CHECK(judge(order) == GateVerdict::not_ours);
  rules.ordered_mA = ordered_mA;
  order.voltage_mV = 400'100;
  CHECK(judge(order) == GateVerdict::not_permitted);
  order.voltage_mV = 400'000;
  rules.may_charge = false;
  CHECK(judge(order) == GateVerdict::not_permitted);
  order.is_enabled = false;
  CHECK(judge(order) == GateVerdict::pass);
  CHECK(judge_output(Port::charger, elcon().reports(0, {})[0], rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::charger, data_frame(0x620, 8), rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::vehicle, elcon().command(0, {}), rules) == GateVerdict::not_ours);
  rules.master_address = MasterAddress::f5;
  CHECK(judge(order) == GateVerdict::not_ours);
  order.master_address = MasterAddress::f5;
  CHECK(judge(order) == GateVerdict::pass);
  rules.charger = nullptr;
  CHECK(judge(order) == GateVerdict::not_ours);
}

TEST_CASE("how a charger ran away is kept when it does no more: what it gave, and what it was asked for",
          "[unit][charger][F97]") {
  Bench bench;
  bench.charge(10'000);
  bench.run(20s);
  CHECK_FALSE(bench.watch.excess().is_known());
  bench.sensed_mA = -25'000;
  bench.run(1s);
  bench.charge(0);
  bench.in.is_enabled = false;
  bench.run(20s);
  REQUIRE_FALSE(bench.watch.runs_away());
  const ChargerExcess current = bench.watch.excess();
  CHECK_FALSE(current.is_voltage);
  CHECK(current.given == 25'000);
  CHECK(current.asked == 10'000);
  CHECK(current.allowed == 11'000);
  bench.told_mV = 410'000;
  bench.run(2s);
  const ChargerExcess voltage = bench.watch.excess();
  CHECK(voltage.is_voltage);
  CHECK(voltage.given == 410'000);
  CHECK(voltage.asked == 400'000);
}

TEST_CASE("an image in which a charger is silent that there cannot be is refused", "[unit][charger][image]") {
  const ChargerWatch written;
  std::vector<std::uint8_t> bytes(image_size(written));
  REQUIRE(write_image(written, bytes) == bytes.size());
  constexpr std::size_t silent_unit_at = 3;  // after the plug state and the bits of the charging units
  const auto problem_of = [&bytes](std::uint8_t unit) {
    std::vector<std::uint8_t> changed = bytes;
    changed[silent_unit_at] = unit;
    ChargerWatch watch;
    return read_image(std::span<const std::uint8_t>(changed), watch);
  };
  CHECK_FALSE(problem_of(charger_units_max));
  CHECK(problem_of(charger_units_max + 1) == ImageProblem::no_state);
}
