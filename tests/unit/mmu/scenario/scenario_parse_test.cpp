// Script language: accepted scripts, and the messages for errors.
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "mmu/devices/random.hpp"
#include "mmu/scenario/scenario_plan.hpp"
#include "mmu/scenario/simulator.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu {
namespace {

constexpr std::string_view phases[] = {"open", "main negative", "closed"};
constexpr std::string_view causes[] = {"none", "request over", "cell_undervoltage"};
constexpr MasterVocabulary vocabulary{phases, causes};

Scenario parsed(std::string_view text) {
  const auto scenario = parse_scenario(text, vocabulary);
  if (!scenario) FAIL(to_text(scenario.error().front(), "test"));
  return *scenario;
}

ScenarioPlan planned(std::string_view text, std::uint64_t seed = 1) {
  return plan_scenario(parsed(text), seed);
}

ScenarioValue value_of(std::string_view text) {
  return parsed(text).lines.front().event.value;
}

ScenarioProblem problem_of(std::string_view text) {
  const auto scenario = parse_scenario(text, vocabulary);
  REQUIRE_FALSE(scenario);
  REQUIRE(scenario.error().size() == 1);
  return scenario.error().front();
}

std::string file_text(const std::string& name) {
  std::ifstream stream(test::in_source(name), std::ios::binary);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

TEST_CASE("a line is a time, a target, a property and its value", "[unit][scenario]") {
  const Scenario scenario = parsed("12.3 cell 2.7 voltage_mV 2700\n");
  REQUIRE(scenario.lines.size() == 1);
  const ScenarioLine& line = scenario.lines[0];
  CHECK(line.verb == ScenarioVerb::event);
  CHECK(line.time.from == 12'300ms);
  CHECK(line.event.property == Property::cell_voltage);
  CHECK(line.event.place == ScenarioPlace{2, 6});
  CHECK(line.event.value.kind == ScenarioValue::Kind::number);
  CHECK(line.event.value.number == 2700.0);
  CHECK(line.event.text == "cell 2.7 voltage_mV 2700");
  CHECK(line.line == 1);
  CHECK(line.column == 6);
  CHECK_FALSE(scenario.is_test());
}

TEST_CASE("every example of the language is understood", "[unit][scenario]") {
  const ScenarioPlan plan = planned(
      "# a comment\n"
      "\n"
      "  2 vehicle on   # and another\r\n"
      "\t1 charger connected\n"
      "3 load current_A 40\n"
      "3 load profile drive\n"
      "4 load current_A 0..40 over 2\n"
      "5 cell 2.7 voltage_mV ..2500 over 3.5\n"
      "12.3 cell 2.7 voltage_mV auto\n"
      "20 module 3 silent\n25 module 3 talking\n26 module 2 restart\n26 module 2 crc_errors on\n"
      "8 cell 2.7 resistance_mOhm 80\n4 cell 3.1 temperature_dC 610\n"
      "9 sensor current silent\n9 sensor current offset_mA -500\n9 sensor link_voltage value_mV 0\n"
      "9 pdu silent\n9 estop 1 pressed\n9 estop 2 released\n9 interlock open\n"
      "9 insulation resistance_kOhm 40\n9 contactor main_positive welded\n9 thermistor 1.4 state open\n"
      "0 pack soc_permille 800\n0 link capacitance_uF 1000\n0 precharge resistance_Ohm 47");
  CHECK(plan.steps.size() == 26);
  CHECK(plan.steps.front().at == 0s);
  CHECK(plan.steps.back().at == 26s);
}

TEST_CASE("events come by time, those of one time as they stand in the file", "[unit][scenario]") {
  const ScenarioPlan plan = planned("5 vehicle on\n1 vehicle off\n5 vehicle off\n");
  REQUIRE(plan.steps.size() == 3);
  CHECK(plan.steps[0].line_index == 1);
  CHECK(plan.steps[1].line_index == 0);
  CHECK(plan.steps[2].line_index == 2);
}

TEST_CASE("ramps carry their ends and their length", "[unit][scenario]") {
  const ScenarioValue ramp = value_of("1 load current_A -5.5..40 over 2");
  CHECK(ramp.kind == ScenarioValue::Kind::ramp);
  CHECK(ramp.from == -5.5);
  CHECK(ramp.number == 40.0);
  CHECK(ramp.over == 2s);
  CHECK(value_of("1 load current_A ..40 over 0.5").kind == ScenarioValue::Kind::ramp_from_present);
}

TEST_CASE("a problem names line, column, what was found and what is wanted", "[unit][scenario]") {
  struct Case {
    const char* text;
    std::uint32_t line;
    std::uint32_t column;
    const char* found;
    const char* wanted;
  };
  const Case cases[] = {
      {"soon vehicle on", 1, 1, "'soon'", "a time in seconds"},
      {"-1 vehicle on", 1, 1, "'-1'", "a time in seconds"},
      {"nan vehicle on", 1, 1, "'nan'", "a time in seconds"},
      {"1e99 vehicle on", 1, 1, "'1e99'", "a time in seconds"},
      {"\n\n3   cel 2.7 voltage_mV 1", 3, 5, "'cel'", "a target: vehicle, charger"},
      {"3", 1, 2, "the end of the line", "a target"},
      {"3 cell", 1, 7, "the end of the line", "a node 1 to 63"},
      {"3 cell 2 voltage_mV 1", 1, 8, "'2'", "as in cell 2.7"},
      {"3 cell 0.1 voltage_mV 1", 1, 8, "'0.1'", "a node 1 to 63"},
      {"3 cell 64.1 voltage_mV 1", 1, 8, "'64.1'", "a node 1 to 63"},
      {"3 cell 2.13 voltage_mV 1", 1, 8, "'2.13'", "1 to 12"},
      {"3 cell 2.7.1 voltage_mV 1", 1, 8, "'2.7.1'", "1 to 12"},
      {"3 module x silent", 1, 10, "'x'", "a node 1 to 63"},
      {"3 module 2 voltage_mV 1", 1, 12, "'voltage_mV'", "a property of module: silent, talking"},
      {"3 cell 2.7 voltage_mV", 1, 22, "the end of the line", "a number or auto, 0 to 6000"},
      {"3 cell 2.7 voltage_mV 6001", 1, 23, "'6001'", "0 to 6000"},
      {"3 cell 2.7 voltage_mV -1", 1, 23, "'-1'", "0 to 6000"},
      {"3 cell 2.7 voltage_mV inf", 1, 23, "'inf'", "a number or auto"},
      {"3 cell 2.7 voltage_mV 12x", 1, 23, "'12x'", "a number or auto"},
      {"3 module 3 cell_count 3.5", 1, 23, "'3.5'", "a whole number or auto, 0 to 15"},
      {"3 module 3 cell_count 3..5 over 1", 1, 23, "'3..5'", "a whole number or auto, 0 to 15"},
      {"3 module 3 cell_count 16", 1, 23, "'16'", "0 to 15"},
      {"3 module 3 crc_wrong_bits 1.5", 1, 27, "'1.5'", "a whole number, 1 to 64"},
      {"3 module 3 crc_wrong_bits random 1..2.5", 1, 34, "'1..2.5'", "A..B, both whole numbers"},
      {"3 wait module 3 mode = sleepy within 1", 1, 24, "'sleepy'",
       "one of starting, normal, autonomous, going_to_sleep, asleep, unpowered"},
      {"3 wait module 3 mode < asleep within 1", 1, 22, "'<'", "a comparison: = !="},
      {"3 cell 2.7 offset_mV auto", 1, 22, "'auto'", "a number, -1000 to 1000"},
      {"3 load current_A 0..2000 over 1", 1, 21, "'2000'", "-1000 to 1000"},
      {"3 load current_A 0..20", 1, 23, "the end of the line", "over SECONDS"},
      {"3 load current_A 0..20 in 2", 1, 24, "'in'", "over SECONDS"},
      {"3 load current_A 0..20 over 0", 1, 29, "'0'", "seconds, more than 0"},
      {"3 load current_A 0.. over 2", 1, 18, "'0..'", "a ramp"},
      {"3 load profile race", 1, 16, "'race'", "one of none, drive"},
      {"3 contactor main welded", 1, 13, "'main'", "one of main_positive, main_negative"},
      {"3 estop 3 pressed", 1, 9, "'3'", "one of 1, 2"},
      {"3 sensor pack_voltage inverted on", 1, 23, "'inverted'", "value_mV, gain_permille, stuck, error"},
      {"3 sensor current_2 offset_mV 1", 1, 20, "'offset_mV'", "offset_mA, value_mA, gain_permille, stuck, inverted"},
      {"3 sensor current_3 silent", 1, 10, "'current_3'", "link_voltage, current_2"},
      {"3 cell 2.7 wire torn", 1, 17, "'torn'", "one of closed, open, open_silent"},
      {"3 cell 2.7 stuck", 1, 17, "the end of the line", "one of off, on"},
      {"3 module 2 omits voltages", 1, 18, "'voltages'", "one of nothing, status, cells"},
      {"3 module 2 delay_ms 501", 1, 21, "'501'", "0 to 500"},
      {"3 module 2 delay_ms auto", 1, 21, "'auto'", "a number, 0 to 500"},
      {"3 module 2 sends_as_node 0", 1, 26, "'0'", "1 to 63"},
      {"3 module 2 sends_as_node 64", 1, 26, "'64'", "1 to 63"},
      {"3 module 2 cell_count 16", 1, 23, "'16'", "0 to 15"},
      {"3 module 2 protocol_version 256", 1, 29, "'256'", "0 to 255"},
      {"3 module 2 serial_number 4294967296", 1, 26, "'4294967296'", "0 to 4294967295"},
      {"3 stranger 64 connected", 1, 12, "'64'", "a node 1 to 63"},
      {"3 stranger 9 silent", 1, 14, "'silent'", "a property of stranger: connected, disconnected"},
      {"3 module 2 crc_error_permille 1001", 1, 31, "'1001'", "0 to 1000"},
      {"3 module 2 crc_error_permille auto", 1, 31, "'auto'", "a number, 0 to 1000"},
      {"3 module 2 crc_wrong_bits 0", 1, 27, "'0'", "1 to 64"},
      {"3 module 2 external_supply_mV -1", 1, 31, "'-1'", "0 to 60000"},
      {"3 module 2 external_supply_mV", 1, 30, "the end of the line", "a number, 0 to 60000"},
      {"3 module 2 converts linear", 1, 21, "'linear'", "one of table, steinhart_hart"},
      {"3 module 2 thermistor_curve linear", 1, 29, "'linear'", "one of table, steinhart_hart"},
      {"3 board_thermistor 2 state ok", 1, 20, "'2'", "a node 1 to 63"},
      {"3 board_thermistor 2.5 state ok", 1, 20, "'2.5'", "1 to 4"},
      {"3 board_thermistor 2.4 state hot", 1, 30, "'hot'", "one of ok, open, shorted"},
      {"3 charger runaway 1", 1, 19, "'1'", "one of off, on"},
      {"3 insulation wire loose", 1, 19, "'loose'", "one of closed, open, shorted"},
      {"3 insulation pwm_frequency_Hz 101", 1, 31, "'101'", "0 to 100"},
      {"3 insulation pwm_duty_permille 1001", 1, 32, "'1001'", "0 to 1000"},
      {"3 sensor current offset_mV 1", 1, 18, "'offset_mV'", "silent, talking, offset_mA"},
      {"3 vehicle on now", 1, 14, "'now'", "nothing more on this line"},
      // times
      {"vehicle on", 1, 1, "'vehicle'", "a time in seconds, 0 to 1e+06, or one of wait, expect"},
      {"+x vehicle on", 1, 1, "'+x'", "a time in seconds"},
      {"+-1 vehicle on", 1, 1, "'+-1'", "a time in seconds"},
      {"+ vehicle on", 1, 1, "'+'", "a time in seconds"},
      {"random vehicle on", 1, 8, "'vehicle'", "A..B, both 0 to 1e+06"},
      {"+random 5..2 vehicle on", 1, 9, "'5..2'", "the second not below the first"},
      {"+random 5 vehicle on", 1, 9, "'5'", "A..B"},
      {"+random ..5 vehicle on", 1, 9, "'..5'", "A..B"},
      {"+random 1..2e6 vehicle on", 1, 9, "'1..2e6'", "both 0 to 1e+06"},
      {"+1", 1, 3, "the end of the line", "a target"},
      {"3 master phase", 1, 10, "'phase'", "a property of master: clear, "},
      // random values
      {"3 cell 2.7 voltage_mV random", 1, 29, "the end of the line", "A..B, both 0 to 6000"},
      {"3 cell 2.7 voltage_mV random 1..6001", 1, 30, "'1..6001'", "A..B, both 0 to 6000"},
      {"3 cell 2.7 voltage_mV random 3..1", 1, 30, "'3..1'", "the second not below the first"},
      {"3 load profile random", 1, 16, "'random'", "one of none, drive"},
      // conditions
      {"wait", 1, 5, "the end of the line",
       "frame, or a target that can be asked: charger, inverter, load, pack, cell"},
      {"3 wait vehicle on within 1", 1, 8, "'vehicle'", "a target that can be asked"},
      {"wait contactor main_positive", 1, 29, "the end of the line", "a state of contactor: closed, open"},
      {"wait contactor main_positive welded within 1", 1, 30, "'welded'", "a state of contactor: closed, open"},
      {"wait contactor main closed within 1", 1, 16, "'main'", "one of main_positive, main_negative"},
      {"wait contactor main_positive closed", 1, 36, "the end of the line", "within SECONDS"},
      {"wait contactor main_positive closed = 1", 1, 37, "'='", "within SECONDS"},
      {"wait contactor main_positive closed for 1", 1, 37, "'for'", "within SECONDS"},
      {"wait contactor main_positive closed within", 1, 43, "the end of the line", "seconds, more than 0"},
      {"wait contactor main_positive closed within 0", 1, 44, "'0'", "seconds, more than 0"},
      {"wait contactor main_positive closed within 1e-10", 1, 44, "'1e-10'", "seconds, more than 0"},
      {"wait contactor main_positive closed within 1 s", 1, 46, "'s'", "nothing more on this line"},
      {"expect contactor main_positive closed within 1", 1, 39, "'within'", "nothing more on this line"},
      {"expect cell 2.7 soc_permille", 1, 29, "the end of the line", "a comparison: = != < <= > >="},
      {"expect cell 2.7 soc_permille == 3", 1, 30, "'=='", "a comparison: = != < <= > >="},
      {"expect cell 2.7 soc_permille < much", 1, 32, "'much'", "a number"},
      {"expect cell 2.13 soc_permille < 1", 1, 13, "'2.13'", "1 to 12"},
      {"expect frame POLL", 1, 8, "'frame'", "a state; frames are for wait and never"},
      {"always frame POLL for 2", 1, 8, "'frame'", "a state; frames are for wait and never"},
      {"always contactor main_positive closed for ever", 1, 43, "'ever'", "seconds, more than 0"},
      {"expect master mood = good", 1, 15, "'mood'", "a state of master: phase, opened_by"},
      {"expect master phase < closed", 1, 21, "'<'", "a comparison: = !="},
      {"expect master phase = shut", 1, 23, "'shut'", "one of open, main_negative, closed"},
      {"expect master opened_by = boredom", 1, 27, "'boredom'", "one of none, request_over, cell_undervoltage"},
      // frames
      {"wait frame within 1", 1, 12, "'within'", "an identifier, 0x0 to 0x7ff, or a frame's name: CONTACTOR_COMMAND"},
      {"wait frame 0x800 within 1", 1, 12, "'0x800'", "an identifier, 0x0 to 0x7ff"},
      {"wait frame 0xZ within 1", 1, 12, "'0xZ'", "an identifier"},
      {"wait frame STATUS 64 mode = normal within 1", 1, 19, "'64'", "a node 1 to 63"},
      {"wait frame STATUS 0 mode = normal within 1", 1, 19, "'0'", "a node 1 to 63"},
      {"wait frame STATUS mood = normal within 1", 1, 19, "'mood'", "a signal of STATUS: mode, supply"},
      {"wait frame STATUS mode normal within 1", 1, 24, "'normal'", "a comparison"},
      {"wait frame STATUS mode = good within 1", 1, 26, "'good'",
       "a number, starting, normal, autonomous, going_to_sleep"},
      {"wait frame PDU_STATUS throttle_permille = full within 1", 1, 43, "'full'", "a number, not_known"},
      {"wait frame PDU_STATUS throttle_permille < not_known within 1", 1, 43, "'not_known'", "a number"},
      {"wait frame 0x7FE length = 2 within 1", 1, 18, "'length'", "no signal: this identifier is not in the protocol"},
      {"wait frame PACK_NAME name = 2 within 1", 1, 22, "'name'", "a signal of PACK_NAME: "},
      // ends and blocks
      {"pass now", 1, 6, "'now'", "nothing more on this line"},
      {"fail badly", 1, 6, "'badly'", "a text in double quotes"},
      {"fail \"badly", 1, 6, "'\"badly'", "a text in double quotes"},
      {"fail \"badly\" so", 1, 14, "'so'", "nothing more on this line"},
      {"end", 1, 1, "'end'", "a repeat before it"},
      {"repeat 3\nend", 2, 1, "'end'", "a line to repeat"},
      {"repeat 3\n+1 vehicle on", 1, 1, "the end of the script", "end, for this repeat"},
      {"repeat 3\n+1 vehicle on\n2 end", 3, 1, "'2'", "end without a time"},
      {"repeat\n+1 vehicle on\nend", 1, 7, "the end of the line", "how often: 1 to 10000"},
      {"repeat 0\n+1 vehicle on\nend", 1, 8, "'0'", "how often: 1 to 10000"},
      {"repeat 10001\n+1 vehicle on\nend", 1, 8, "'10001'", "how often: 1 to 10000"},
      {"repeat 2.5\n+1 vehicle on\nend", 1, 8, "'2.5'", "how often: 1 to 10000"},
      {"repeat 2 each 3\n+1 vehicle on\nend", 1, 10, "'each'", "every SECONDS, or nothing"},
      {"repeat 2 every 0\n+1 vehicle on\nend", 1, 16, "'0'", "seconds, more than 0"},
      {"repeat 2 every 3\nwait load current_A > 1 within 1\nend", 2, 1, "'wait'", "no wait in a repeat with every"},
      {"repeat 2 every 3\nrepeat 2\nwait load current_A > 1 within 1\nend\nend", 3, 1, "'wait'", "no wait in a repeat"},
      {"repeat 2\nrepeat 2\nrepeat 2\nrepeat 2\nrepeat 2\n+1 vehicle on\nend\nend\nend\nend\nend", 5, 1, "'repeat'",
       "at most 4 of them inside one another"},
      {"repeat 1000\nrepeat 1000\n+0 vehicle on\nend\nend", 3, 4, "'vehicle on'", "at most 100000 lines"},
      {"repeat 10 every 200000\n1 vehicle on\nend", 2, 3, "'vehicle on'", "a time up to 1e+06 s"},
      {"1e6 vehicle on\n+random 0..1 vehicle off", 2, 14, "'vehicle off'", "a time up to 1e+06 s"},
      {"3 vehicle \x01\xFF", 1, 11,
       "'?"
       "?'",
       "a property of vehicle"},
  };
  for (const Case& one : cases) {
    INFO(one.text);
    const ScenarioProblem problem = problem_of(one.text);
    CHECK(problem.line == one.line);
    CHECK(problem.column == one.column);
    CHECK(problem.found == one.found);
    INFO(problem.wanted);
    CHECK(problem.wanted.find(one.wanted) != std::string::npos);
  }
}

TEST_CASE("all wrong lines are reported, and nothing of the file is taken", "[unit][scenario]") {
  const auto scenario = parse_scenario("1 vehicle on\nx\n2 vehicle off\n3 vehicel on\n");
  REQUIRE_FALSE(scenario);
  REQUIRE(scenario.error().size() == 2);
  CHECK(scenario.error()[0].line == 2);
  CHECK(scenario.error()[1].line == 4);
  CHECK(to_text(scenario.error()[1], "a.scn").find("a.scn:4:3: found 'vehicel', expected a target") == 0);
}

TEST_CASE("a mistake in a block does not make its other end look wrong", "[unit][scenario]") {
  const ScenarioReading reading =
      read_scenario("repeat often\n+1 vehicel on\nend\n5 vehicle on\nend\nrepeat 2\n6 vehicle off\n");
  REQUIRE(reading.problems.size() == 4);
  CHECK(reading.problems[0].line == 1);
  CHECK(reading.problems[1].line == 2);
  CHECK(reading.problems[2].line == 5);
  CHECK(reading.problems[3].line == 6);
  CHECK(reading.scenario.lines.size() == 3);
}

TEST_CASE("a master can only be asked where there is one", "[unit][scenario]") {
  const auto scenario = parse_scenario("expect master phase = closed");
  REQUIRE_FALSE(scenario);
  CHECK(scenario.error().front().column == 8);
  CHECK(scenario.error().front().wanted.find("here is no master") != std::string::npos);
}

TEST_CASE("a number sign in quotes begins no comment", "[unit][scenario]") {
  const Scenario scenario = parsed("3 fail \"cell #7 # is gone\" # a comment");
  CHECK(scenario.lines.at(0).text == "cell #7 # is gone");
  CHECK(scenario.lines.at(0).verb == ScenarioVerb::fail);
  CHECK(scenario.is_test());
}

// --- conditions -----------------------------------------------------------------------------------------------------

TEST_CASE("a condition names a state of the world or a frame by its row", "[unit][scenario]") {
  const auto condition = [](std::string_view text) { return parsed(text).lines.front().condition; };
  const ScenarioCondition state = condition("wait cell 2.7 soc_permille <= 300 within 5");
  CHECK(state.state->name == "soc_permille");
  CHECK(state.place == ScenarioPlace{2, 6});
  CHECK(state.comparison == Comparison::less_or_equal);
  CHECK(state.wanted == 300.0);
  CHECK(state.text == "cell 2.7 soc_permille <= 300");
  const ScenarioCondition word = condition("expect master phase != main_negative");
  CHECK(word.comparison == Comparison::not_equal);
  CHECK(word.wanted == 1.0);
  const ScenarioCondition any = condition("never frame STATUS mode = going_to_sleep for 3");
  CHECK(any.is_any_node);
  CHECK(any.frame_id == 0x101);
  CHECK(any.message->signals[*any.signal].name == "mode");
  CHECK(any.wanted == 3.0);
  const ScenarioCondition one = condition("wait frame STATUS 5 within 3");
  CHECK_FALSE(one.is_any_node);
  CHECK(one.frame_id == 0x105);
  CHECK_FALSE(one.signal.has_value());
  CHECK(condition("wait frame COMMAND 0 within 3").frame_id == 0x340);
  const ScenarioCondition number = condition("wait frame 0x041 throttle_permille != not_known within 3");
  CHECK(number.frame_id == 0x041);
  CHECK(number.wants_not_known);
  CHECK(condition("wait frame 0x7ab within 3").message == nullptr);
  CHECK(condition("wait frame PACK_STATUS state = contactors_open within 3").wanted == 4.0);
}

TEST_CASE("a comparison holds as its sign says, at and beside the number", "[unit][scenario]") {
  struct Row {
    Comparison comparison;
    bool below, at, above;
  };
  const Row rows[] = {
      {Comparison::equal, false, true, false},   {Comparison::not_equal, true, false, true},
      {Comparison::less, true, false, false},    {Comparison::less_or_equal, true, true, false},
      {Comparison::greater, false, false, true}, {Comparison::greater_or_equal, false, true, true},
  };
  for (const Row& row : rows) {
    CHECK(holds(row.comparison, 2.0, 3.0) == row.below);
    CHECK(holds(row.comparison, 3.0, 3.0) == row.at);
    CHECK(holds(row.comparison, 4.0, 3.0) == row.above);
  }
  CHECK(holds(Comparison::none, 1.0, 0.0));
  CHECK_FALSE(holds(Comparison::none, 0.0, 0.0));
}

// --- the plan -------------------------------------------------------------------------------------------------------

std::vector<std::int64_t> times_ms(const ScenarioPlan& plan) {
  std::vector<std::int64_t> times;
  for (const ScenarioStep& step : plan.steps) times.push_back(to_ms(step.at));
  return times;
}
using Times = std::vector<std::int64_t>;

TEST_CASE("a time with a plus counts from the line before, one without a time is that line's", "[unit][scenario]") {
  CHECK(times_ms(planned("5 vehicle on\n+0.5 vehicle off\nexpect load current_A = 0\n2 vehicle on\n+1 vehicle off")) ==
        Times{2000, 3000, 5000, 5500, 5500});
}

TEST_CASE("a repeat with every begins its turns on a grid, whatever is in them", "[unit][scenario]") {
  CHECK(times_ms(planned("1 vehicle on\n+1 repeat 3 every 10\n0 vehicle off\n+2 vehicle on\nend\n+1 vehicle off")) ==
        Times{1000, 2000, 4000, 12000, 14000, 22000, 24000, 33000});
}

TEST_CASE("a repeat without every begins a turn with the last line of the one before", "[unit][scenario]") {
  CHECK(times_ms(planned("1 repeat 3\n+1 vehicle on\n+2 vehicle off\nend\n+1 vehicle on\n0.5 vehicle off")) ==
        Times{500, 2000, 4000, 5000, 7000, 8000, 10000, 11000});
}

TEST_CASE("repeats stand inside one another", "[unit][scenario]") {
  CHECK(times_ms(planned("repeat 2 every 100\nrepeat 2 every 10\n1 vehicle on\nend\n50 vehicle off\nend")) ==
        Times{1000, 11000, 50000, 101000, 111000, 150000});
}

TEST_CASE("a wait begins a section whose times count from it", "[unit][scenario]") {
  const ScenarioPlan plan =
      planned("10 vehicle on\n+5 wait load current_A > 1 within 9\n1 vehicle off\n+1 vehicle on\n");
  REQUIRE(plan.section_begins == std::vector<std::size_t>{0, 2, 4});
  CHECK(times_ms(plan) == Times{10000, 15000, 1000, 2000});
  CHECK(plan.steps[2].section == 1);
}

TEST_CASE("every turn with a wait is a section", "[unit][scenario]") {
  const ScenarioPlan plan =
      planned("repeat 2\n+1 vehicle on\nwait load current_A > 1 within 9\n+3 vehicle off\nend\n1 vehicle on");
  REQUIRE(plan.section_begins == std::vector<std::size_t>{0, 2, 5, 7});
  // The line of the second turn follows the last one of the first turn, which is 3 s after the first wait.
  CHECK(times_ms(plan) == Times{1000, 1000, 3000, 4000, 4000, 1000, 3000});
}

TEST_CASE("the same seed draws the same plan, another seed another", "[unit][scenario][property]") {
  const std::string_view script =
      "repeat 20\n+random 1..5 cell 2.7 voltage_mV random 2700..3600\nend\nrandom 10..20 vehicle on";
  const auto drawn = [script](std::uint64_t seed) {
    std::string text;
    for (const ScenarioStep& step : planned(script, seed).steps) {
      text += std::to_string(to_ms(step.at)) + " " + step.event.text + "\n";
    }
    return text;
  };
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    CHECK(drawn(seed) == drawn(seed));
    CHECK(drawn(seed) != drawn(seed + 1));
  }
}

TEST_CASE("draws stay in their range and reach all of it", "[unit][scenario][property]") {
  const ScenarioPlan plan =
      planned("repeat 5000\n+random 0..0.003 cell 2.7 offset_mV random -0.002..0.002\nend", 20'260'102);
  std::array<int, 5> values{};
  std::array<int, 4> waits{};
  std::int64_t before_ms = 0;
  for (const ScenarioStep& step : plan.steps) {
    ++values.at(static_cast<std::size_t>(std::lround(step.event.value.number * 1e3) + 2));
    ++waits.at(static_cast<std::size_t>(to_ms(step.at) - before_ms));
    before_ms = to_ms(step.at);
    CHECK_FALSE(step.event.value.is_random);
  }
  for (const int count : values) CHECK(count > 800);
  for (const int count : waits) CHECK(count > 1'000);
}

TEST_CASE("every row of the table can be said, at both ends of its range", "[unit][scenario]") {
  const std::string word_of[] = {"", " 3", " 3.2", " 3.2", ""};
  for (const PropertySpec& row : property_table()) {
    const TargetSpec& target = target_table()[static_cast<std::size_t>(row.target)];
    CHECK(target.kind == row.target);
    CHECK(spec_of(row.property).name == row.name);
    std::string start = std::string(target.name) + word_of[static_cast<std::size_t>(target.address)];
    if (target.address == Address::word) {
      const std::string only(row.only_for.substr(0, row.only_for.find(' ')));
      start += " " + (only.empty() ? std::string(target.words[0]) : only);
    }
    start += " " + std::string(row.name);
    std::vector<std::string> values;
    if (row.kind == ValueKind::none) values = {""};
    if (may_be_auto(row.kind)) values = {" auto"};
    if (row.kind != ValueKind::none && row.kind != ValueKind::word) {
      for (const double end : {row.min, row.max}) values.push_back(" " + std::to_string(end));
    }
    for (const std::string_view word : row.words) values.push_back(" " + std::string(word));
    for (const std::string& value : values) {
      INFO(start + value);
      const auto event = parse_event(start + value, vocabulary);
      REQUIRE(event);
      CHECK(event->property == row.property);
    }
  }
}

TEST_CASE("a script may begin with a byte order mark", "[unit][scenario]") {
  const auto scenario = parse_scenario(
      "\xEF\xBB\xBF"
      "1 module 3 silent",
      vocabulary);
  REQUIRE(scenario);
  CHECK(scenario->lines[0].column == 3);
  CHECK_FALSE(
      parse_scenario("1 module 3 silent\n\xEF\xBB\xBF"
                     "2 module 3 talking",
                     vocabulary));
}

TEST_CASE("a master can be told what its operator can tell it, where there is one", "[unit][scenario]") {
  const auto scenario = parse_scenario("1 master clear\n2 master balancing off\n+1 master accept_modules", vocabulary);
  REQUIRE(scenario);
  CHECK(scenario->lines[0].event.property == Property::master_clear);
  CHECK(scenario->lines[1].event.property == Property::master_balancing);
  CHECK(scenario->lines[1].event.value.word == 0);
  CHECK(scenario->lines[2].event.property == Property::master_accept_modules);
  struct Case {
    const char* text;
    const char* problem;
  };
  const Case told[] = {
      {"1 vehicle on\n2  master cler",
       "a.scn:2:11: found 'cler', expected a property of master: clear, clear_authorised, wake, balancing, "
       "accept_modules"},
      {"1 master balancing maybe", "a.scn:1:20: found 'maybe', expected one of off, on"},
      {"1 master clear all", "a.scn:1:16: found 'all', expected nothing more on this line"},
      {"1 master", "a.scn:1:9: found the end of the line, expected a property of master"},
  };
  for (const Case& one : told) {
    INFO(one.text);
    const auto wrong = parse_scenario(one.text, vocabulary);
    REQUIRE_FALSE(wrong);
    CHECK(to_text(wrong.error().front(), "a.scn").starts_with(one.problem));
  }
}

TEST_CASE("without a master none can be told anything", "[unit][scenario]") {
  const auto scenario = parse_scenario("1 vehicle on\n2 master clear");
  REQUIRE_FALSE(scenario);
  CHECK(to_text(scenario.error().front(), "a.scn") ==
        "a.scn:2:3: found 'master', expected an event of the emulated pack: here is no master that could be told");
  const auto mistyped = parse_scenario("1 mastre clear");
  REQUIRE_FALSE(mistyped);
  CHECK(mistyped.error().front().wanted.find("master") == std::string::npos);
}

TEST_CASE("random bytes and damaged scripts never crash the parser", "[unit][scenario][fuzz]") {
  const std::string good = file_text("vcan-fixtures/demo.scn") + file_text("vcan-fixtures/slow_precharge.scn");
  constexpr std::uint64_t seed = 20'260'101;
  INFO("seed " << seed);
  RandomSource random(seed);
  for (int round = 0; round < 2'000; ++round) {
    std::string text(random.next() % 200, '\0');
    for (char& one : text) one = static_cast<char>(random.next());
    (void)parse_scenario(text);
    std::string damaged = good;
    for (int change = 0; change < 8; ++change) {
      damaged[random.next() % damaged.size()] = static_cast<char>(random.next() % 128);
    }
    (void)parse_scenario(damaged);
  }
}

TEST_CASE("whatever words a line is made of, a problem stands inside it", "[unit][scenario][fuzz]") {
  constexpr std::string_view words[] = {"1",      "+2",    "random",    "+random", "1..2",     "wait",   "expect",
                                        "never",  "end",   "repeat",    "every",   "within",   "for",    "cell",
                                        "2.7",    "=",     "contactor", "closed",  "frame",    "STATUS", "voltage_mV",
                                        "\"text", "\"a\"", "vehicle",   "on",      "master",   "phase",  "0x041",
                                        "always", "fail",  "pass",      "over",    "precharge"};
  constexpr std::uint64_t seed = 20'260'103;
  INFO("seed " << seed);
  RandomSource random(seed);
  int right = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::string line;
    for (std::uint64_t count = random.next() % 8; count > 0; --count) {
      line += std::string(words[random.next() % std::size(words)]) + " ";
    }
    const auto scenario = parse_scenario(line, vocabulary);
    right += scenario ? 1 : 0;
    if (scenario) continue;
    REQUIRE(scenario.error().size() == 1);
    CHECK(scenario.error().front().line == 1);
    CHECK(scenario.error().front().column >= 1);
    CHECK(scenario.error().front().column <= line.size() + 1);
    CHECK_FALSE(scenario.error().front().wanted.empty());
  }
  CHECK(right > 0);
}

TEST_CASE("docs/scenarios.md has the table as it is", "[unit][scenario][meta]") {
  const std::string page = file_text("docs/scenarios.md");
  INFO("mmusim --properties prints the table");
  CHECK(page.find(property_table_markdown()) != std::string::npos);
  CHECK(page.find(state_table_markdown()) != std::string::npos);
}

TEST_CASE("every example in docs/scenarios.md can be parsed", "[unit][scenario][meta]") {
  const std::string page = file_text("docs/scenarios.md");
  const std::string_view fence = "```scn\n";
  std::size_t examples = 0;
  for (std::size_t at = page.find(fence); at != std::string::npos; at = page.find(fence, at)) {
    at += fence.size();
    const std::string example = page.substr(at, page.find("```", at) - at);
    INFO(example);
    CHECK(parse_scenario(example, core_vocabulary()));
    ++examples;
  }
  CHECK(examples >= 3);
}

}  // namespace
}  // namespace bmu
