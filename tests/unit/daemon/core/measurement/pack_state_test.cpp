// Pack state from modules and sensors: which values count, which are omitted, and which are then missing.
#include "daemon/core/measurement/pack_state.hpp"

#include "protocol/image.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fault_world.hpp"
#include "tests/support/module_feed.hpp"

using namespace bmu;
using test::ModuleFeed;

namespace {

const std::vector<SignalValue> four_cells{known(3'700'000), known(3'700'000), known(3'700'000), known(3'700'000)};

/// Two modules of four cells and two sensors that have all just answered.
class Summed {
 public:
  Summed() : feed(test::small_pack()) {
    feed.poll();
    for (std::uint8_t node = 1; node <= 2; ++node) {
      feed.cells(node, four_cells, known(14'800));
      feed.temperatures(node, {known(250), known(250)});
    }
    sensors.current_mA = {10'000, feed.now(), Validity::valid};
    sensors.pack_voltage_mV = {29'600, feed.now(), Validity::valid};
    sensors.link_voltage_mV = {29'500, feed.now(), Validity::valid};
  }
  [[nodiscard]] PackState pack() const { return summarise(feed.modules(), sensors, config, feed.now()); }

  CoreConfig config = test::small_pack();
  ModuleFeed feed;
  SensorTable sensors;
};

}  // namespace

TEST_CASE("a spread knows its lowest, its highest, its average and where they are", "[unit][pack_state][BMU_1]") {
  Summed world;
  world.feed.cells(1, {known(3'700'000), known(3'500'000), known(3'700'000), known(3'700'000)}, known(14'600));
  world.feed.cells(2, {known(3'700'000), known(3'700'000), known(3'900'000), known(3'700'001)}, known(15'000));
  const Spread cells = world.pack().cell_voltage_uV;
  CHECK(cells.min == 3'500'000);
  CHECK(cells.max == 3'900'000);
  CHECK(cells.average == 3'700'000);
  CHECK(cells.min_at == Element{.module_node = 1, .number = 2, .pack_number = 2});
  CHECK(cells.max_at == Element{.module_node = 2, .number = 3, .pack_number = 7});
  CHECK(cells.count == 8);
  CHECK(cells.expected == 8);
  CHECK(cells.is_complete());
}

TEST_CASE("of equal values the first is named", "[unit][pack_state]") {
  const Summed world;
  const Element first{.module_node = 1, .number = 1, .pack_number = 1};
  CHECK(world.pack().cell_voltage_uV.min_at == first);
  CHECK(world.pack().cell_voltage_uV.max_at == first);
}

TEST_CASE("values of minus 10 and 20 degrees: signs and places of temperatures", "[unit][pack_state][BMU_2]") {
  Summed world;
  world.feed.pass(1100ms);  // long enough for a change not to be a jump
  world.feed.poll();
  world.feed.temperatures(1, {known(-100), known(200)});
  world.feed.temperatures(2, {known(199), known(-99)});
  const Spread cells = world.pack().cell_temperature_dC;
  CHECK(cells.min == -100);
  CHECK(cells.max == 200);
  CHECK(cells.average == 50);
  CHECK(cells.min_at == Element{.module_node = 1, .number = 1, .pack_number = 1, .is_temperature_sensor = true});
  CHECK(cells.max_at == Element{.module_node = 1, .number = 2, .pack_number = 2, .is_temperature_sensor = true});
  CHECK(cells.min_taken_at == world.feed.now());
  CHECK(cells.max_taken_at == world.feed.now());
  world.feed.temperatures(2, {known(199), known(-101)});
  CHECK(world.pack().cell_temperature_dC.min_at ==
        Element{.module_node = 2, .number = 2, .pack_number = 4, .is_temperature_sensor = true});
}

TEST_CASE("a set of one value, and one of none above zero", "[unit][pack_state]") {
  Summed world;
  world.feed.pass(1100ms);
  world.feed.poll();
  world.feed.temperatures(1, {known(-50), not_known()});
  const Spread one = world.pack().cell_temperature_dC;
  CHECK(one.count == 1);
  CHECK(one.average == -50);
  CHECK(one.max == -50);
  world.feed.temperatures(2, {known(-60), known(-70)});
  CHECK(world.pack().cell_temperature_dC.max == -50);
  CHECK(Spread{.count = 1, .expected = 1}.is_complete());
}

TEST_CASE("what is not measured, in doubt or too old is missing, and makes the set incomplete", "[unit][pack_state]") {
  Summed world;
  CHECK(world.pack().is_complete());
  world.feed.temperatures(1, {known(250), known(900)});
  CHECK(world.pack().cell_temperature_dC.count == 3);
  CHECK(world.pack().cell_temperature_dC.max == 250);
  CHECK_FALSE(world.pack().is_complete());
  world.feed.temperatures(1, {known(250), known(250)});
  CHECK(world.pack().is_complete());
  world.feed.cells(2, {known(3'700'000), not_known(), known(3'700'000), known(3'700'000)}, known(14'800));
  CHECK(world.pack().cell_voltage_uV.count == 7);
  CHECK_FALSE(world.pack().is_complete());
  CHECK_FALSE(world.pack().cell_voltage_sum_mV.is_valid());
  CHECK(world.pack().modules_answering == 2);  // it answered without a known value
  Summed old;
  old.feed.pass(250ms);
  CHECK(old.pack().is_complete());
  old.feed.pass(1ns);
  CHECK(old.pack().cell_voltage_uV.count == 0);
  CHECK(old.pack().cell_temperature_dC.count == 0);
  CHECK(old.pack().cell_voltage_uV.average == 0);
  CHECK_FALSE(old.pack().cell_voltage_uV.is_known());
  CHECK(old.pack().modules_answering == 0);
  CHECK(old.pack().modules_expected == 2);
}

TEST_CASE("each set that is incomplete makes the pack incomplete", "[unit][pack_state]") {
  PackState whole;
  whole.cell_voltage_uV.count = whole.cell_voltage_uV.expected = 8;
  whole.cell_temperature_dC.count = whole.cell_temperature_dC.expected = 4;
  whole.board_temperature_dC.count = whole.board_temperature_dC.expected = 2;
  whole.modules_answering = whole.modules_expected = 2;
  CHECK(whole.is_complete());
  for (Spread PackState::*const set :
       {&PackState::cell_voltage_uV, &PackState::cell_temperature_dC, &PackState::board_temperature_dC}) {
    PackState pack = whole;
    --(pack.*set).count;
    CHECK_FALSE(pack.is_complete());
  }
  PackState silent = whole;
  silent.modules_answering = 1;
  CHECK_FALSE(silent.is_complete());
  PackState bare = whole;
  bare.board_temperature_dC = {};
  CHECK(bare.is_complete());
  bare.cell_temperature_dC = {};
  CHECK_FALSE(bare.is_complete());  // a pack without a temperature is not complete
}

TEST_CASE("boards have the sensors that they have shown", "[unit][pack_state][F9]") {
  Summed world;
  CHECK(world.pack().board_temperature_dC.expected == 8);
  CHECK(world.pack().board_temperature_dC.count == 8);
  CHECK(world.pack().board_temperature_dC.max == 300);
  CHECK(world.pack().board_temperature_dC.max_at ==
        Element{.module_node = 1, .number = 6, .is_temperature_sensor = true});
  world.feed.board_dC = not_known(Validity::not_fitted);
  world.feed.temperatures(2, {known(250), known(250)});
  CHECK(world.pack().board_temperature_dC.expected == 8);
  CHECK(world.pack().board_temperature_dC.count == 4);
  CHECK_FALSE(world.pack().is_complete());
  ModuleFeed bare(test::small_pack());
  bare.board_dC = not_known(Validity::not_fitted);
  bare.poll();
  bare.temperatures(1, {known(250), known(250)});
  const PackState pack = summarise(bare.modules(), {}, bare.config(), bare.now());
  CHECK(pack.board_temperature_dC.expected == 0);
}

TEST_CASE("the places of a board's sensors are told apart", "[unit][pack_state][F9]") {
  test::FaultWorld world;
  const SignalValue none = not_known(Validity::not_fitted);
  world.say_boards(1, {none, known(300), none, known(320)});
  const Spread boards = summarise(world.modules(), world.sensors, world.config, world.now).board_temperature_dC;
  CHECK(boards.expected == 2);
  CHECK(boards.min_at == Element{.module_node = 1, .number = 7, .is_temperature_sensor = true});
  CHECK(boards.max_at == Element{.module_node = 1, .number = 9, .is_temperature_sensor = true});
}

TEST_CASE("an element names the last of four contactors, and none behind it", "[unit][pack_state][image]") {
  std::vector<std::uint8_t> bytes(image_size(Element{}));
  Element read;
  for (std::uint8_t contactor = 0; contactor <= 5; ++contactor) {
    CAPTURE(contactor);
    write_image(Element{.contactor = contactor}, bytes);
    CHECK(read_image(bytes, read) == (contactor <= 4 ? std::nullopt : std::optional(ImageProblem::no_state)));
  }
}

TEST_CASE("sums are as old as their oldest part, and none with a hole", "[unit][pack_state]") {
  Summed world;
  const TimePoint first = world.feed.now();
  world.feed.pass(100ms);
  world.feed.poll();
  world.feed.cells(1, {known(3'600'000), known(3'600'000), known(3'600'000), known(3'600'500)}, known(14'400));
  const PackState pack = world.pack();
  CHECK(pack.cell_voltage_sum_mV.value == 29'201);
  CHECK(pack.cell_voltage_sum_mV.taken_at == first);
  CHECK(pack.module_voltage_sum_mV.value == 29'200);
  CHECK(pack.module_voltage_sum_mV.taken_at == first);
  world.feed.cells(2, four_cells, known(14'800));
  CHECK(world.pack().cell_voltage_sum_mV.taken_at == world.feed.now());
  CHECK(world.pack().module_voltage_sum_mV.taken_at == world.feed.now());
  world.feed.pass(250ms + 1ns);
  CHECK_FALSE(world.pack().module_voltage_sum_mV.is_valid());
}

TEST_CASE("a module answers only with its status, its own voltage and every cell", "[unit][pack_state][BMU_1]") {
  const AgeConfig ages = test::small_pack().ages;
  const auto answers = [&ages](auto forget) {
    const Summed world;
    ModuleRecord module = world.feed.modules().modules()[0];
    forget(module);
    return is_answering(module, ages, world.feed.now());
  };
  CHECK(answers([](ModuleRecord&) {}));
  CHECK_FALSE(answers([](ModuleRecord& module) { module.status = {}; }));
  CHECK_FALSE(answers([](ModuleRecord& module) { module.module_voltage_mV = {}; }));
  for (std::size_t cell = 0; cell < 4; ++cell) {
    CHECK_FALSE(answers([cell](ModuleRecord& module) { module.cell_voltage_uV[cell] = {}; }));
  }
  CHECK(answers([](ModuleRecord& module) { module.cell_voltage_uV[4] = {}; }));
}

TEST_CASE("of two current sensors the one that shows more counts, and one alone counts", "[unit][pack_state][F20]") {
  Summed world;
  const TimePoint now = world.feed.now();
  world.sensors.current_2_mA = {-10'001, now, Validity::valid};
  CHECK(world.pack().current_mA.value == 10'000);  // the pack has one sensor
  world.config.sensor.has_second_current = true;
  CHECK(world.pack().current_mA.value == -10'001);
  world.sensors.current_2_mA.value = -10'000;
  CHECK(world.pack().current_mA.value == 10'000);
  world.sensors.current_2_mA.value = 9'999;
  CHECK(world.pack().current_mA.value == 10'000);
  world.sensors.current_2_mA.validity = Validity::unknown;
  CHECK(world.pack().current_mA.value == 10'000);
  for (const Measured<std::int32_t>& useless :
       {Measured<std::int32_t>{90'000, now, Validity::unknown}, {90'000, now - 200ms - 1ns, Validity::valid}}) {
    world.sensors.current_2_mA = useless;  // larger, but not a valid measurement
    CHECK(world.pack().current_mA.value == 10'000);
    CHECK(world.pack().current_mA.is_valid());
  }
  world.sensors.current_2_mA = {9'999, now, Validity::valid};
  world.sensors.current_mA.taken_at = now - 200ms - 1ns;
  CHECK(world.pack().current_mA.value == 9'999);
  world.sensors.current_2_mA.value = 0;
  CHECK(world.pack().current_mA.is_valid());
  world.sensors.current_2_mA.taken_at = now - 200ms - 1ns;
  CHECK_FALSE(world.pack().current_mA.is_valid());
}

TEST_CASE("what the sensor measures is known while it is fresh", "[unit][pack_state][BMU_3][BMU_4]") {
  Summed world;
  CHECK(world.pack().at == world.feed.now());
  CHECK(world.pack().is_sensed());
  CHECK(world.pack().pack_voltage_mV.value == 29'600);
  CHECK(world.pack().link_voltage_mV.value == 29'500);
  world.sensors.pack_voltage_before_mV = {29'400, world.feed.now() - 60ms, Validity::valid};
  CHECK(world.pack().pack_voltage_before_mV.value == 29'400);
  world.sensors.pack_voltage_before_mV.taken_at = world.feed.now() - 250ms - 1ns;
  CHECK_FALSE(world.pack().pack_voltage_before_mV.is_valid());
  CHECK(world.pack().pack_voltage_before_mV.value == 0);
  CHECK(world.pack().is_sensed());
  for (Measured<std::int32_t> SensorTable::*const result :
       {&SensorTable::current_mA, &SensorTable::pack_voltage_mV, &SensorTable::link_voltage_mV}) {
    Summed deaf;
    (deaf.sensors.*result).taken_at -= 250ms + 1ns;
    CHECK_FALSE(deaf.pack().is_sensed());
  }
}
