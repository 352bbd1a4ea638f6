// Configuration of a sensor over the bus, step by step.
#include "daemon/core/measurement/sensor_setup.hpp"

#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/records/event.hpp"
#include "devices/device_list.hpp"
#include "protocol/image.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

const SensorSetUpDriver& ivt() {
  return *find_device("ivt_s")->set_up;
}

/// Sensor that follows its commands, and the setup that sends them.
struct Bench {
  SensorConfig config;
  SensorSetup setup;
  TimePoint now{100s};
  std::array<SensorSetting, sensor_channels_max> settings{};
  bool answers = true;
  bool runs = true;
  bool obeys = true;
  bool is_commanded = false;
  int stored = 0;
  std::vector<SetUpOrder> orders;

  explicit Bench(const SensorConfig& with = {}) : config(with) {
    config.set_up = &ivt();
    setup.init(config);
    for (std::uint8_t channel = 0; channel < sensor_channels_used; ++channel) {
      settings.at(channel) = wanted_setting(channel, config);
    }
  }

  void hear(const SetUpAnswer& answer) { REQUIRE(setup.observe(ivt().answer(answer), now, is_commanded)); }
  SetUpAnswer obey(const SetUpOrder& order) {
    switch (order.kind) {
      case SetUpOrderKind::read: return {SetUpWord::setting, order.channel, settings.at(order.channel)};
      case SetUpOrderKind::set:
        if (obeys && !runs) settings.at(order.channel) = order.setting;
        return {SetUpWord::setting, order.channel, order.setting};
      case SetUpOrderKind::stop: runs = false; return {.word = SetUpWord::stopped};
      case SetUpOrderKind::run: runs = true; return {.word = SetUpWord::running};
      case SetUpOrderKind::store: break;
    }
    ++stored;
    return {.word = SetUpWord::stored};
  }
  /// Executes a tick of 10 ms, including the answer.
  void tick() {
    now += 10ms;
    const std::optional<CanFrame> command = setup.step(now, is_commanded);
    if (!command) return;
    const std::optional<SetUpOrder> order = ivt().order_of(*command);
    REQUIRE(order);
    orders.push_back(*order);
    if (answers) hear(obey(*order));
  }
  void run(Duration time) {
    for (const TimePoint end = now + time; now < end;) tick();
  }
  [[nodiscard]] std::vector<SetUpOrderKind> kinds() const {
    std::vector<SetUpOrderKind> all;
    for (const SetUpOrder& order : orders) all.push_back(order.kind);
    return all;
  }
  [[nodiscard]] bool is_good() const { return setup.are_results_good(now); }
};

constexpr auto ask = SetUpOrderKind::read;
constexpr auto give = SetUpOrderKind::set;
constexpr auto stop = SetUpOrderKind::stop;
constexpr auto start = SetUpOrderKind::run;
constexpr auto keep = SetUpOrderKind::store;
using Kinds = std::vector<SetUpOrderKind>;

}  // namespace

TEST_CASE("nobody is asked where no sensor can be", "[unit][sensors]") {
  SensorSetup setup;
  setup.init({});
  CHECK_FALSE(setup.is_there());
  CHECK(setup.are_results_good(TimePoint{1s}));
  CHECK_FALSE(setup.step(TimePoint{1s}, false));
  CHECK_FALSE(setup.observe(ivt().answer({.word = SetUpWord::alive}), TimePoint{1s}, false));
  CHECK_FALSE(setup.observe(data_frame(0, 8), TimePoint{1s}, false));
  CHECK(setup.problem().found == 0);
  CHECK(setup.problem().wanted == 0);
}

TEST_CASE("a sensor that is as wanted is asked for each of its results, and then used", "[unit][sensors]") {
  Bench bench;
  CHECK_FALSE(bench.is_good());
  bench.run(30ms);
  CHECK_FALSE(bench.is_good());
  bench.run(10ms);
  CHECK(bench.is_good());
  CHECK(bench.setup.stage() == SensorSetupStage::done);
  CHECK(bench.kinds() == Kinds{ask, ask, ask});
  CHECK_FALSE(bench.setup.has_failed());
  bench.run(60s);
  CHECK(bench.orders.size() == 3);
}

TEST_CASE("a sensor is asked at the first step, also just after the clock began", "[unit][sensors]") {
  Bench bench;
  bench.now = TimePoint{};
  bench.tick();
  CHECK(bench.orders.size() == 1);
}

TEST_CASE("each setting that differs keeps the results out, and is named", "[unit][sensors]") {
  struct Case {
    std::uint8_t channel;
    SensorSetting setting;
    std::string_view text;
  };
  const Case cases[] = {
      {0, {SensorTrigger::cyclic, false, false, 10}, "I: found every 10 ms, expected every 20 ms"},
      {1, {SensorTrigger::cyclic, false, false, 100}, "U1: found every 100 ms, expected every 60 ms"},
      {2, {SensorTrigger::off, false, false, 60}, "U2: found off, expected cyclic"},
      {2, {SensorTrigger::on_trigger, false, false, 60}, "U2: found on a trigger, expected cyclic"},
      {0, {SensorTrigger::cyclic, true, false, 20}, "I: found little-endian, expected big-endian"},
      {0, {SensorTrigger::cyclic, false, true, 20}, "I: found sign inverted, expected sign not inverted"},
  };
  for (const Case& one : cases) {
    INFO(one.text);
    Bench bench;
    bench.settings.at(one.channel) = one.setting;
    bench.run(100ms);
    CHECK_FALSE(bench.is_good());
    CHECK(bench.setup.stage() == SensorSetupStage::failed);
    CHECK(bench.setup.has_failed());
    CHECK(to_text(bench.setup.problem()) == one.text);
    CHECK(bench.kinds() == Kinds{ask, ask, ask});  // and nothing was changed
    bench.settings.at(one.channel) = wanted_setting(one.channel, bench.config);
    bench.run(5s);
    CHECK(bench.is_good());
    CHECK_FALSE(bench.setup.has_failed());
    CHECK(to_text(bench.setup.problem()).empty());
  }
}

TEST_CASE("what a sensor tells of a result that nobody uses is not kept", "[unit][sensors]") {
  Bench bench;
  bench.run(100ms);
  REQUIRE(bench.is_good());
  bench.hear({.word = SetUpWord::setting, .channel = sensor_channels_used, .setting = {.period_ms = 7}});
  CHECK(bench.is_good());
  CHECK_FALSE(bench.setup.has_failed());
}

TEST_CASE("the byte order wanted is the pack file's", "[unit][sensors]") {
  Bench bench({.little_endian = true});
  CHECK(bench.settings[0].is_little_endian);
  bench.run(100ms);
  CHECK(bench.is_good());
  Bench big({.little_endian = true});
  big.settings[1].is_little_endian = false;
  big.run(100ms);
  CHECK(to_text(big.setup.problem()) == "U1: found big-endian, expected little-endian");
}

TEST_CASE("a sensor that does not answer is asked three times, and again after five seconds", "[unit][sensors]") {
  Bench bench;
  bench.answers = false;
  bench.run(1'500ms);
  CHECK(bench.orders.size() == 3);
  CHECK_FALSE(bench.setup.has_failed());
  bench.run(20ms);
  CHECK(bench.setup.has_failed());
  CHECK(to_text(bench.setup.problem()) == "I: no answer");
  CHECK(bench.setup.problem().found == 0);
  CHECK(bench.setup.problem().wanted == 0);
  bench.run(4'900ms);
  CHECK(bench.orders.size() == 3);
  bench.answers = true;
  bench.run(200ms);
  CHECK(bench.is_good());
}

TEST_CASE("a sensor is asked anew five seconds after it has failed, and has three tries again", "[unit][sensors]") {
  Bench bench;
  bench.answers = false;
  while (!bench.setup.has_failed()) bench.tick();
  bench.orders.clear();
  bench.run(4'990ms);
  CHECK(bench.orders.empty());
  bench.tick();
  CHECK(bench.orders.size() == 1);
  bench.run(1'520ms);
  CHECK(bench.orders.size() == 3);
  CHECK(bench.setup.has_failed());
}

TEST_CASE("one lost answer is asked for again after half a second", "[unit][sensors]") {
  Bench bench;
  bench.answers = false;
  bench.tick();
  bench.answers = true;
  bench.run(490ms);
  CHECK(bench.orders.size() == 1);
  bench.run(50ms);
  CHECK(bench.is_good());
  CHECK(bench.orders.size() == 4);
}

TEST_CASE("each question has three tries, half a second apart", "[unit][sensors]") {
  Bench bench;
  bench.answers = false;
  bench.tick();
  bench.run(490ms);
  CHECK(bench.orders.size() == 1);
  bench.tick();  // half a second after the first
  CHECK(bench.orders.size() == 2);
  bench.run(490ms);
  bench.answers = true;
  bench.tick();
  CHECK(bench.orders.size() == 3);
  bench.answers = false;
  bench.tick();
  CHECK(bench.orders.back().channel == 1);
  bench.run(1'490ms);
  CHECK(bench.orders.size() == 6);
  CHECK_FALSE(bench.setup.has_failed());
  bench.tick();
  CHECK(to_text(bench.setup.problem()) == "U1: no answer");
}

TEST_CASE("a sensor that does not know the command is not used", "[unit][sensors]") {
  Bench bench;
  bench.answers = false;
  bench.hear({.word = SetUpWord::not_understood});  // no request sent yet
  CHECK_FALSE(bench.setup.has_failed());
  bench.tick();
  bench.hear({.word = SetUpWord::not_understood});
  CHECK(to_text(bench.setup.problem()) == "I: command not supported");
  CHECK(bench.setup.problem().found == 0);
  CHECK(bench.setup.problem().wanted == 0);
}

TEST_CASE("answers that nobody waits for lead nowhere", "[unit][sensors]") {
  Bench bench;
  bench.hear({SetUpWord::setting, 0, bench.settings[0]});
  bench.hear({SetUpWord::setting, 7, {}});
  bench.answers = false;
  bench.tick();
  CHECK(bench.orders.back().channel == 0);
  bench.hear({SetUpWord::setting, 1, bench.settings[1]});  // of another channel
  bench.tick();
  CHECK(bench.orders.size() == 1);
  bench.hear({.word = SetUpWord::running});
  CHECK(bench.setup.stage() == SensorSetupStage::reading);
  CHECK(bench.setup.observe(data_frame(0x511, 3), bench.now, false));
  CHECK(bench.setup.answers_refused() == 1);
  CHECK_FALSE(bench.setup.observe(data_frame(0x521, 6), bench.now, false));
  for (std::uint8_t channel = 0; channel < sensor_channels_used; ++channel) {
    bench.hear({SetUpWord::setting, channel, bench.settings.at(channel)});
    bench.tick();
  }
  CHECK(bench.is_good());
}

TEST_CASE("an answer to an order that has not been given leads nowhere", "[unit][sensors]") {
  Bench bench({.is_configured = true, .is_stored = true});
  bench.settings[0].period_ms = 100;
  while (bench.stored == 0) bench.tick();
  REQUIRE(bench.setup.stage() == SensorSetupStage::starting);  // and its command follows with the next tick
  bench.hear({.word = SetUpWord::running});
  CHECK_FALSE(bench.is_good());
  bench.tick();
  CHECK(bench.orders.back().kind == start);
  CHECK(bench.is_good());
}

TEST_CASE("a setting that comes late does not stop a sensor", "[unit][sensors]") {
  Bench bench({.is_configured = true});
  bench.settings[0].period_ms = 100;
  while (bench.setup.stage() == SensorSetupStage::reading) bench.tick();
  REQUIRE(bench.setup.stage() == SensorSetupStage::setting);  // stopped within the tick
  bench.setup.start_over();
  bench.orders.clear();
  bench.runs = true;
  while (bench.orders.size() < 3) bench.tick();
  bench.answers = false;
  bench.tick();
  REQUIRE(bench.orders.back().kind == stop);
  bench.hear({SetUpWord::setting, 0, bench.settings[0]});
  CHECK(bench.setup.stage() == SensorSetupStage::stopping);
}

TEST_CASE("what is read counts once it is read to its end, whatever comes in between", "[unit][sensors]") {
  Bench bench;
  bench.answers = false;
  bench.tick();
  for (int times = 0; times < 3; ++times) bench.hear({SetUpWord::setting, 0, bench.settings[0]});
  for (int ticks = 0; ticks < 3; ++ticks) bench.tick();
  CHECK_FALSE(bench.is_good());
  CHECK(bench.orders.back().channel == 1);
}

TEST_CASE("an answer that comes twice, or late, changes nothing", "[unit][sensors]") {
  Bench bench({.is_configured = true});
  bench.run(30ms);  // the third answer is received, but not checked yet
  bench.hear({SetUpWord::setting, 2, bench.settings[2]});
  bench.hear({.word = SetUpWord::not_understood});
  CHECK_FALSE(bench.setup.has_failed());
  bench.answers = false;
  bench.tick();
  CHECK(bench.setup.stage() == SensorSetupStage::starting);
  bench.hear({SetUpWord::setting, 0, bench.settings[0]});
  CHECK(bench.setup.stage() == SensorSetupStage::starting);
  bench.hear({.word = SetUpWord::running});
  CHECK(bench.is_good());
}

TEST_CASE("a sensor is configured in its order: stop, set, read back, run", "[unit][sensors]") {
  Bench bench({.is_configured = true});
  bench.settings[0].period_ms = 100;
  bench.settings[2].is_little_endian = true;
  bench.run(300ms);
  CHECK(bench.kinds() == Kinds{ask, ask, ask, stop, give, give, give, ask, ask, ask, start});
  CHECK(bench.is_good());
  CHECK(bench.settings[0] == wanted_setting(0, bench.config));
  CHECK(bench.settings[2] == wanted_setting(2, bench.config));
  CHECK(bench.stored == 0);
}

TEST_CASE("what was set is stored only where the pack file says so, and only then", "[unit][sensors]") {
  Bench bench({.is_configured = true, .is_stored = true});
  bench.run(300ms);
  CHECK(bench.kinds() == Kinds{ask, ask, ask, start});  // the settings were correct
  CHECK(bench.stored == 0);
  bench.settings[1].period_ms = 30;
  bench.setup.start_over();
  bench.run(300ms);
  CHECK(bench.stored == 1);
  CHECK(bench.is_good());
}

TEST_CASE("a sensor that says yes and does not obey is found out, and is started again", "[unit][sensors]") {
  Bench bench({.is_configured = true});
  bench.settings[0].period_ms = 100;
  bench.obeys = false;
  bench.run(300ms);
  CHECK(to_text(bench.setup.problem()) == "I: found every 100 ms, expected every 20 ms");
  CHECK_FALSE(bench.runs);
  bench.settings[0].period_ms = 20;
  bench.run(5'300ms);
  CHECK(bench.runs);
  CHECK(bench.is_good());
  CHECK_FALSE(bench.setup.has_failed());
}

TEST_CASE("what is wrong with a sensor stands until it is found good, also while it is configured anew",
          "[unit][sensors]") {
  Bench bench({.is_configured = true});
  bench.settings[0].period_ms = 100;
  bench.obeys = false;
  bench.run(300ms);
  REQUIRE(bench.setup.has_failed());
  bench.obeys = true;
  bench.orders.clear();
  while (bench.orders.empty() || bench.orders.back().kind != start) {
    CHECK(to_text(bench.setup.problem()) == "I: found every 100 ms, expected every 20 ms");
    bench.tick();
    REQUIRE(bench.orders.size() < 20);
  }
  CHECK_FALSE(bench.setup.has_failed());
}

TEST_CASE("what was configured anew is told of each result until the sensor is read again", "[unit][sensors]") {
  const auto troubles = [](const Bench& bench) {
    std::array<SensorSetupTrouble, sensor_channels_used> all{};
    for (std::size_t channel = 0; channel < all.size(); ++channel)
      all.at(channel) = bench.setup.changed().at(channel).trouble;
    return all;
  };
  using Troubles = std::array<SensorSetupTrouble, sensor_channels_used>;
  using enum SensorSetupTrouble;
  Bench bench({.is_configured = true});
  bench.settings[0].period_ms = 100;
  bench.settings[2].is_little_endian = true;
  bench.run(300ms);
  CHECK(troubles(bench) == Troubles{period, none, byte_order});
  CHECK(bench.setup.changed()[2] == SensorSetupProblem{byte_order, 2, 1, 0});
  bench.hear({.word = SetUpWord::alive});
  CHECK(troubles(bench) == Troubles{});
  // It restarts during the configuration: the troubles found before still count.
  bench.settings[1].is_little_endian = true;
  while (bench.orders.back().kind != stop) bench.tick();
  CHECK(troubles(bench) == Troubles{none, byte_order, none});
  bench.hear({.word = SetUpWord::alive});
  CHECK(troubles(bench) == Troubles{none, byte_order, none});
}

TEST_CASE("the byte order that is told is the one found and the one wanted", "[unit][sensors]") {
  Bench bench;
  bench.settings[1].is_little_endian = true;
  bench.run(100ms);
  CHECK(bench.setup.problem() == SensorSetupProblem{SensorSetupTrouble::byte_order, 1, 1, 0});
  Bench little({.little_endian = true});
  little.settings[1].is_little_endian = false;
  little.run(100ms);
  CHECK(little.setup.problem() == SensorSetupProblem{SensorSetupTrouble::byte_order, 1, 0, 1});
}

TEST_CASE("a sensor is not trusted unasked in the first second of the clock either", "[unit][sensors]") {
  Bench bench;
  CHECK_FALSE(bench.setup.are_results_good(TimePoint{500ms}));
}

TEST_CASE("nothing is configured while a contactor is commanded", "[unit][sensors]") {
  Bench bench({.is_configured = true});
  bench.settings[0].period_ms = 100;
  bench.is_commanded = true;
  bench.run(300ms);
  CHECK(bench.kinds() == Kinds{ask, ask, ask});
  CHECK(bench.setup.has_failed());
  bench.is_commanded = false;
  bench.run(5'300ms);
  CHECK(bench.is_good());
}

TEST_CASE("a sensor that starts anew in a closed pack is trusted for a second while it is asked", "[unit][sensors]") {
  Bench bench;
  bench.run(100ms);
  bench.is_commanded = true;
  bench.hear({.word = SetUpWord::alive});
  CHECK(bench.setup.restarts() == 1);
  CHECK(bench.is_good());
  bench.run(100ms);
  CHECK(bench.setup.stage() == SensorSetupStage::done);
  CHECK(bench.is_good());

  bench.answers = false;
  bench.hear({.word = SetUpWord::alive});
  bench.run(1s);
  CHECK(bench.is_good());
  bench.run(10ms);
  CHECK_FALSE(bench.is_good());
}

TEST_CASE("trust ends with the first answer that differs", "[unit][sensors]") {
  Bench bench({.is_configured = true});
  bench.run(100ms);
  bench.is_commanded = true;
  bench.settings[0].is_little_endian = true;
  bench.hear({.word = SetUpWord::alive});
  CHECK(bench.is_good());
  bench.tick();  // the first of three answers
  CHECK_FALSE(bench.is_good());
  CHECK_FALSE(bench.setup.has_failed());
  bench.run(50ms);
  CHECK_FALSE(bench.is_good());
  CHECK(bench.setup.has_failed());
}

TEST_CASE("trust does not outlive the contactors it was for", "[unit][sensors]") {
  Bench bench;
  bench.run(100ms);
  bench.is_commanded = true;
  bench.answers = false;
  bench.hear({.word = SetUpWord::alive});
  bench.run(100ms);
  CHECK(bench.is_good());
  bench.is_commanded = false;
  bench.hear({.word = SetUpWord::alive});
  CHECK_FALSE(bench.is_good());
}

TEST_CASE("a sensor that starts anew in an open pack, or before it was known, is not trusted", "[unit][sensors]") {
  Bench bench;
  bench.is_commanded = true;
  bench.hear({.word = SetUpWord::alive});
  CHECK_FALSE(bench.is_good());
  bench.run(100ms);
  CHECK(bench.is_good());
  bench.is_commanded = false;
  bench.hear({.word = SetUpWord::alive});
  CHECK_FALSE(bench.is_good());
  bench.run(100ms);
  CHECK(bench.is_good());
  bench.setup.start_over();
  CHECK_FALSE(bench.is_good());
}

TEST_CASE("a setting that somebody else changes is noticed by its answer", "[unit][sensors]") {
  Bench bench;
  bench.run(100ms);
  bench.hear({SetUpWord::setting, 1, bench.settings[1]});
  bench.hear({SetUpWord::setting, 5, {}});  // of a result that is not used
  CHECK(bench.is_good());
  bench.hear({SetUpWord::setting, 1, {.trigger = SensorTrigger::off}});
  CHECK_FALSE(bench.is_good());
  CHECK(to_text(bench.setup.problem()) == "U1: found off, expected cyclic");
}

TEST_CASE("each stage says where it is", "[unit][sensors]") {
  CHECK(to_text(SensorSetupStage::reading) == "asked");
  CHECK(to_text(SensorSetupStage::done) == "as wanted");
  CHECK(to_text(SensorSetupStage::failed) == "not as wanted");
}

TEST_CASE("an event about a sensor that cannot be is none", "[unit][sensors][events]") {
  const auto event = [](SensorSetupTrouble trouble, std::uint8_t channel, std::int64_t found, std::int64_t wanted) {
    return Event{.id = EventId::sensor_set_up_failed,
                 .reading = {.is_known = true, .value = found, .element = {.number = channel}},
                 .threshold = wanted,
                 .number = static_cast<std::int64_t>(trouble)};
  };
  const Event good = event(SensorSetupTrouble::trigger, 2, 0, 2);
  CHECK(good.are_fields_possible());
  CHECK(to_text(good) == "current sensor: not used: U2: found off, expected cyclic");
  CHECK(event(SensorSetupTrouble::period, 0, 70'000, 20).are_fields_possible());
  CHECK(event(SensorSetupTrouble::trigger, 3, 0, 2).are_fields_possible());  // a second sensor's current
  CHECK_FALSE(event(SensorSetupTrouble::trigger, 4, 0, 2).are_fields_possible());
  CHECK_FALSE(event(SensorSetupTrouble::trigger, 0, 3, 2).are_fields_possible());
  CHECK_FALSE(event(SensorSetupTrouble::trigger, 0, -1, 2).are_fields_possible());
  CHECK_FALSE(event(SensorSetupTrouble::trigger, 0, 0, 3).are_fields_possible());
  Event unknown = good;
  unknown.number = 99;
  CHECK_FALSE(unknown.are_fields_possible());
  CHECK(to_text(Event{.id = EventId::sensor_set_up}) == "current sensor: configuration as expected");
  const Event anew{.id = EventId::sensor_set_up,
                   .reading = {.is_known = true, .value = 100, .element = {.number = 1}},
                   .threshold = 60,
                   .number = static_cast<std::int64_t>(SensorSetupTrouble::period)};
  CHECK(to_text(anew) == "current sensor: reconfigured: U1: every 100 ms -> every 60 ms");
  CHECK(to_text(Event{.id = EventId::sensor_restarted}) == "current sensor: restarted");
  for (const auto& [id, text] : {std::pair{EventId::sensor_set_up, "second current sensor: configuration as expected"},
                                 std::pair{EventId::sensor_restarted, "second current sensor: restarted"}}) {
    CHECK(to_text(Event{.id = id, .reading = {.element = {.number = 3}}}) == text);
  }
}

namespace {

/// Second sensor at 531h, with other identifiers for its command and answer.
struct SecondBench {
  SensorSetup setup;
  TimePoint now{100s};
  SensorSetting setting;
  std::vector<SetUpOrder> orders;

  explicit SecondBench(SensorConfig config) {
    config.set_up = &ivt();
    config.has_second_current = true;
    config.second_command_id = 0x413;
    config.second_response_id = 0x513;
    setup.init_second(config);
    setting = wanted_setting(0, config);
  }
  void tick() {
    now += 10ms;
    const std::optional<CanFrame> command = setup.step(now, false);
    if (!command) return;
    CHECK(command->id == 0x413);
    CanFrame as_delivered = *command;
    as_delivered.id = ivt().command_id;
    const std::optional<SetUpOrder> order = ivt().order_of(as_delivered);
    REQUIRE(order);
    orders.push_back(*order);
    CanFrame answer = ivt().answer({SetUpWord::setting, order->channel, setting});
    CHECK_FALSE(setup.observe(answer, now, false));  // the first sensor's
    answer.id = 0x513;
    CanFrame extended = answer;
    extended.is_extended = true;
    CHECK_FALSE(setup.observe(extended, now, false));
    CHECK(setup.observe(answer, now, false));
  }
  void run(Duration time) {
    for (const TimePoint end = now + time; now < end;) tick();
  }
};

}  // namespace

TEST_CASE("a second sensor is asked for its current under its own identifiers, and used then", "[unit][sensors]") {
  SecondBench bench({});
  CHECK(bench.setup.is_there());
  CHECK_FALSE(bench.setup.are_results_good(bench.now));
  bench.run(50ms);
  CHECK(bench.orders == std::vector{SetUpOrder{.kind = ask, .channel = 0}});
  CHECK(bench.setup.stage() == SensorSetupStage::done);
  CHECK(bench.setup.are_results_good(bench.now));
  CHECK(bench.setup.is_command({.id = 0x413, .length = 8}));
  CHECK(bench.setup.is_command({.id = 0x413, .length = 1}));
  CHECK_FALSE(bench.setup.is_command({.id = 0x411, .length = 8}));
  CHECK_FALSE(bench.setup.is_command({.id = 0x413, .is_extended = true, .length = 8}));
  CHECK_FALSE(bench.setup.is_command({.id = 0x413, .is_remote = true, .length = 8}));
  CHECK_FALSE(bench.setup.is_command({.id = 0x413, .is_error = true, .length = 8}));
}

TEST_CASE("a second sensor that is set up otherwise is not used and never changed, whatever the first may be told",
          "[unit][sensors]") {
  SecondBench bench({.is_configured = true, .is_stored = true});
  bench.setting.is_little_endian = true;
  bench.run(20s);
  CHECK_FALSE(bench.setup.are_results_good(bench.now));
  CHECK(bench.setup.problem() == SensorSetupProblem{SensorSetupTrouble::byte_order, 3, 1, 0});
  for (const SetUpOrder& order : bench.orders) CHECK(order.kind == ask);
  CHECK(bench.orders.size() == 4);  // once, and again every 5 s
  const Event failed{.id = EventId::sensor_set_up_failed,
                     .reading = {.is_known = true, .value = 1, .element = {.number = 3}},
                     .number = static_cast<std::int64_t>(SensorSetupTrouble::byte_order)};
  CHECK(to_text(failed) == "second current sensor: not used: I: found little-endian, expected big-endian");
  bench.setting.is_little_endian = false;
  bench.run(6s);
  CHECK(bench.setup.are_results_good(bench.now));
}

TEST_CASE("a second sensor without identifiers of its own, or of another kind, is not asked", "[unit][sensors]") {
  const CurrentSensorDriver& lem = *find_device("lem_cab")->current;
  const SensorConfig there{
      .has_second_current = true, .set_up = &ivt(), .second_command_id = 0x413, .second_response_id = 0x513};
  SensorConfig no_id = there;
  no_id.second_command_id = no_id.second_response_id = 0;
  SensorConfig other = there;
  other.second = &lem;
  SensorConfig none = there;
  none.has_second_current = false;
  for (const SensorConfig& config : {no_id, other, none}) {
    SensorSetup setup;
    setup.init_second(config);
    CHECK_FALSE(setup.is_there());
    CHECK(setup.are_results_good(TimePoint{1s}));
    CHECK_FALSE(setup.step(TimePoint{1s}, false));
    CHECK_FALSE(setup.is_command({.id = 0x413, .length = 8}));
  }
}

TEST_CASE("of a second sensor the gate lets out questions, and nothing else", "[unit][sensors][gate]") {
  const GateRules rules{
      .sensor = &ivt(), .may_configure_sensor = true, .may_store_in_sensor = true, .second_sensor_command_id = 0x413};
  const auto verdict = [&rules](SetUpOrderKind kind) {
    CanFrame frame = ivt().command({.kind = kind, .setting = {.trigger = SensorTrigger::cyclic, .period_ms = 20}});
    frame.id = 0x413;
    return judge_output(Port::internal, frame, rules);
  };
  CHECK(verdict(ask) == GateVerdict::pass);
  for (const SetUpOrderKind kind : {give, stop, start, keep}) CHECK(verdict(kind) == GateVerdict::not_permitted);
  CHECK(judge_output(Port::internal, {.id = 0x413, .length = 3}, rules) == GateVerdict::malformed);
  CHECK(judge_output(Port::internal, {.id = 0x414, .length = 8}, rules) == GateVerdict::not_ours);
  CHECK(judge_output(Port::vehicle, {.id = 0x413, .length = 8}, rules) == GateVerdict::not_ours);
  const GateRules without{.sensor = &ivt(), .may_configure_sensor = true};
  for (const std::uint32_t id : {0U, 1U, 0x413U}) {
    CHECK(judge_output(Port::internal, {.id = id, .length = 8}, without) == GateVerdict::not_ours);
  }
}

TEST_CASE("an image of a set-up that cannot be is refused", "[unit][sensors][image]") {
  Bench bench;
  std::vector<std::uint8_t> bytes(image_size(bench.setup));
  write_image(bench.setup, bytes);
  SensorSetup other;
  other.init(bench.config);
  REQUIRE_FALSE(read_image(bytes, other));
  // The members in their order, as BMU_FIELDS names them.
  const std::size_t channel_at = image_size(SensorSetupStage{});
  const std::size_t problem_at = channel_at + 2 * image_size(std::uint8_t{}) + image_size(TimePoint{}) +
                                 image_size(bool{}) + image_size(std::array<SensorSetting, sensor_channels_used>{});
  const std::size_t problem_size = image_size(SensorSetupProblem{});
  const std::size_t trouble_size = image_size(SensorSetupTrouble{});
  for (const std::size_t at : {channel_at, problem_at + trouble_size, problem_at + problem_size + trouble_size,
                               problem_at + sensor_channels_used * problem_size + trouble_size}) {
    INFO(at);
    std::vector<std::uint8_t> changed = bytes;
    REQUIRE(changed.at(at) == 0);
    const std::uint8_t channels = at == channel_at ? sensor_channels_used : sensor_channels_told;
    changed.at(at) = static_cast<std::uint8_t>(channels - 1);
    CHECK_FALSE(read_image(changed, other));
    changed.at(at) = channels;
    CHECK(read_image(changed, other) == ImageProblem::no_state);
  }
}

TEST_CASE("the gate lets a sensor be asked, and changed only while nothing needs it", "[unit][sensors][gate]") {
  const auto judge = [](SetUpOrderKind kind, const GateRules& rules) {
    return judge_output(Port::internal, ivt().command({.kind = kind}), rules);
  };
  const GateRules asking{.sensor = &ivt()};
  const GateRules configuring{.sensor = &ivt(), .may_configure_sensor = true};
  const GateRules storing{.sensor = &ivt(), .may_store_in_sensor = true};
  for (const SetUpOrderKind kind : {ask, start}) CHECK(judge(kind, asking) == GateVerdict::pass);
  for (const SetUpOrderKind kind : {stop, give}) {
    CHECK(judge(kind, asking) == GateVerdict::not_permitted);
    CHECK(judge(kind, configuring) == GateVerdict::pass);
  }
  CHECK(judge(keep, configuring) == GateVerdict::not_permitted);
  CHECK(judge(keep, storing) == GateVerdict::pass);
  for (const SetUpOrderKind kind : {ask, give, stop, start, keep}) {
    CHECK(judge(kind, {}) == GateVerdict::not_ours);
    CHECK(judge_output(Port::vehicle, ivt().command({.kind = kind}), configuring) == GateVerdict::not_ours);
  }
  CHECK(judge_output(Port::internal, data_frame(0x411, 8), configuring) == GateVerdict::not_ours);
}
