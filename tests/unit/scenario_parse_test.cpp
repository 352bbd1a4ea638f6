// The script language: what it takes, and how it says what is wrong.
#include <fstream>
#include <sstream>

#include "mmu/random.hpp"
#include "mmu/scenario.hpp"
#include "mmu/simulator.hpp"
#include "tests/support/catch.hpp"

namespace bmu {
namespace {

Scenario parsed(std::string_view text) {
  const auto scenario = parse_scenario(text);
  if (!scenario) FAIL(to_text(scenario.error().front(), "test"));
  return *scenario;
}

ScenarioProblem problem_of(std::string_view text) {
  const auto scenario = parse_scenario(text);
  REQUIRE_FALSE(scenario);
  REQUIRE(scenario.error().size() == 1);
  return scenario.error().front();
}

std::string file_text(const std::string& name) {
  std::ifstream stream(std::string(BMUD_SOURCE_DIR) + "/" + name, std::ios::binary);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

TEST_CASE("a line is a time, a target, a property and its value", "[unit][scenario]") {
  const Scenario scenario = parsed("12.3 cell 2.7 voltage_mV 2700\n");
  REQUIRE(scenario.events.size() == 1);
  const ScenarioEvent& event = scenario.events[0];
  CHECK(event.at == 12'300ms);
  CHECK(event.property == Property::cell_voltage);
  CHECK(event.place == ScenarioPlace{2, 6});
  CHECK(event.value.kind == ScenarioValue::Kind::number);
  CHECK(event.value.number == 2700.0);
  CHECK(event.text == "cell 2.7 voltage_mV 2700");
  CHECK(event.line == 1);
}

TEST_CASE("every example of the language is understood", "[unit][scenario]") {
  const Scenario scenario = parsed(
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
  CHECK(scenario.events.size() == 26);
  CHECK(scenario.events.front().at == 0s);
  CHECK(scenario.events.back().at == 26s);
}

TEST_CASE("events come by time, those of one time as they stand in the file", "[unit][scenario]") {
  const Scenario scenario = parsed("5 vehicle on\n1 vehicle off\n5 vehicle off\n");
  REQUIRE(scenario.events.size() == 3);
  CHECK(scenario.events[0].line == 2);
  CHECK(scenario.events[1].line == 1);
  CHECK(scenario.events[2].line == 3);
}

TEST_CASE("ramps carry their ends and their length", "[unit][scenario]") {
  const ScenarioValue ramp = parsed("1 load current_A -5.5..40 over 2").events[0].value;
  CHECK(ramp.kind == ScenarioValue::Kind::ramp);
  CHECK(ramp.from == -5.5);
  CHECK(ramp.number == 40.0);
  CHECK(ramp.over == 2s);
  CHECK(parsed("1 load current_A ..40 over 0.5").events[0].value.kind == ScenarioValue::Kind::ramp_from_present);
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
      {"3 cell 2.7 offset_mV auto", 1, 22, "'auto'", "a number, -1000 to 1000"},
      {"3 load current_A 0..2000 over 1", 1, 21, "'2000'", "-1000 to 1000"},
      {"3 load current_A 0..20", 1, 23, "the end of the line", "over SECONDS"},
      {"3 load current_A 0..20 in 2", 1, 24, "'in'", "over SECONDS"},
      {"3 load current_A 0..20 over 0", 1, 29, "'0'", "seconds, more than 0"},
      {"3 load current_A 0.. over 2", 1, 18, "'0..'", "a ramp"},
      {"3 load profile race", 1, 16, "'race'", "one of none, drive"},
      {"3 contactor main welded", 1, 13, "'main'", "one of main_positive, main_negative"},
      {"3 estop 3 pressed", 1, 9, "'3'", "one of 1, 2"},
      {"3 sensor pack_voltage inverted on", 1, 23, "'inverted'", "value_mV, stuck, error"},
      {"3 sensor current_2 offset_mV 1", 1, 20, "'offset_mV'", "offset_mA, value_mA, stuck, inverted"},
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
      {"3 charger runaway 1", 1, 19, "'1'", "one of off, on"},
      {"3 insulation wire loose", 1, 19, "'loose'", "one of closed, open, shorted"},
      {"3 insulation pwm_frequency_Hz 101", 1, 31, "'101'", "0 to 100"},
      {"3 insulation pwm_duty_permille 1001", 1, 32, "'1001'", "0 to 1000"},
      {"3 sensor current offset_mV 1", 1, 18, "'offset_mV'", "silent, talking, offset_mA"},
      {"3 vehicle on now", 1, 14, "'now'", "nothing more on this line"},
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
  CHECK(to_text(scenario.error()[1], "a.scn").find("a.scn:4:3: found 'vehicel', wanted a target") == 0);
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
    if (row.kind == ValueKind::number_or_auto) values = {" auto"};
    if (row.kind == ValueKind::number || row.kind == ValueKind::number_or_auto) {
      for (const double end : {row.min, row.max}) values.push_back(" " + std::to_string(end));
    }
    for (const std::string_view word : row.words) values.push_back(" " + std::string(word));
    for (const std::string& value : values) {
      INFO(start + value);
      const auto event = parse_event(start + value);
      REQUIRE(event);
      CHECK(event->property == row.property);
    }
  }
}

TEST_CASE("random bytes and damaged scripts never crash the parser", "[unit][scenario][fuzz]") {
  const std::string good = file_text("vcan-fixtures/demo.scn");
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

TEST_CASE("docs/scenarios.md has the table as it is", "[unit][scenario][meta]") {
  const std::string page = file_text("docs/scenarios.md");
  INFO("mmusim --properties prints the table");
  CHECK(page.find(property_table_markdown()) != std::string::npos);
}

TEST_CASE("every example in docs/scenarios.md can be parsed", "[unit][scenario][meta]") {
  const std::string page = file_text("docs/scenarios.md");
  const std::string_view fence = "```scn\n";
  std::size_t examples = 0;
  for (std::size_t at = page.find(fence); at != std::string::npos; at = page.find(fence, at)) {
    at += fence.size();
    const std::string example = page.substr(at, page.find("```", at) - at);
    INFO(example);
    CHECK(parse_scenario(example));
    ++examples;
  }
  CHECK(examples >= 3);
}

}  // namespace
}  // namespace bmu
