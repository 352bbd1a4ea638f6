// GPIO lines of this host in a pack file: accepted and rejected settings, and the resulting configuration of the core.
#include <algorithm>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"

namespace bmu {
namespace {

Json with_gpio_without(const std::string& parent, const std::vector<std::string>& keys) {
  Json pack = with_gpio({});
  for (const std::string& key : keys) pack[Json::json_pointer("/gpio" + parent)].erase(key);
  return pack;
}

std::size_t number_of(GpioOutput output) {
  return static_cast<std::size_t>(output);
}

TEST_CASE("a pack without lines has none", "[unit][config][gpio]") {
  const auto pack = parse(valid_pack().dump());
  REQUIRE(pack);
  CHECK_FALSE(pack->gpio);
}

TEST_CASE("lines of outputs, feedback and inputs arrive as they are written", "[unit][config][gpio]") {
  const auto pack = parse(with_gpio({}).dump());
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  REQUIRE(pack->gpio);
  const GpioConfig& gpio = *pack->gpio;
  CHECK(gpio.chip == "/dev/gpiochip0");
  REQUIRE(gpio.outputs.at(number_of(GpioOutput::main_positive)));
  CHECK(gpio.outputs.at(number_of(GpioOutput::main_positive))->line == 3);
  CHECK(gpio.outputs.at(number_of(GpioOutput::main_positive))->active_low);
  CHECK_FALSE(gpio.outputs.at(number_of(GpioOutput::main_negative))->active_low);
  CHECK_FALSE(gpio.outputs.at(number_of(GpioOutput::charge)));
  CHECK(gpio.outputs.at(number_of(GpioOutput::watchdog))->line == 2);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_positive))->at.line == 13);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_positive))->at.active_low);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_positive))->debounce == 5ms);
  CHECK(gpio.feedback.at(number_of(GpioOutput::main_negative))->debounce == 0ms);
  REQUIRE(gpio.inputs.size() == 3);
  CHECK(gpio.inputs[0].name == "cockpit");
  CHECK(gpio.inputs[0].kind == GpioInputKind::estop);
  CHECK(gpio.inputs[0].at.line == 7);
  CHECK(gpio.inputs[0].at.active_low);
  CHECK(gpio.inputs[0].debounce == 20ms);
  CHECK(gpio.inputs[2].kind == GpioInputKind::vehicle_on);
  CHECK_FALSE(gpio.inputs[2].at.active_low);
  CHECK(gpio.inputs[2].debounce == 5ms);
}

TEST_CASE("inputs alone, and outputs alone, are enough", "[unit][config][gpio]") {
  for (const auto& keys : std::vector<std::vector<std::string>>{{"outputs", "feedback"}, {"feedback", "inputs"}}) {
    const ConfigProblems problems = problems_of(with_gpio_without("", keys).dump());
    INFO(all_text(problems));
    CHECK(problems.empty());
  }
  refuses({{"/gpio", {{"chip", "/dev/gpiochip0"}}}}, "/gpio", "outputs or inputs");
}

TEST_CASE("each key of a line has its form and range", "[unit][config][gpio]") {
  const auto refuses_gpio = [](const std::vector<Change>& changes, const std::string& path, const std::string& words) {
    refuses_text(with_gpio(changes).dump(), "/gpio" + path, words);
  };
  refuses_gpio({{"/chip", "gpiochip0"}}, "/chip", "/dev/gpiochip0");
  refuses_gpio({{"/outputs/fan/line", 65'535}}, "/outputs/fan/line", "0 to 65534");
  refuses_gpio({{"/outputs/fan/line", -1}}, "/outputs/fan/line", "0 to 65534");
  refuses_gpio({{"/outputs/fan/active_low", 1}}, "/outputs/fan/active_low", "true or false");
  refuses_gpio({{"/outputs/fan/debounce_ms", 5}}, "/outputs/fan/debounce_ms", "unknown key");
  refuses_gpio({{"/outputs/fan", 6}}, "/outputs/fan", "an object");
  refuses_gpio({{"/outputs/horn", {{"line", 9}}}}, "/outputs/horn", "unknown key");
  refuses_gpio({{"/feedback/watchdog", {{"line", 19}}}}, "/feedback/watchdog", "unknown key");
  refuses_gpio({{"/feedback/main_positive/debounce_ms", 51}}, "/feedback/main_positive/debounce_ms", "0 to 50");
  refuses_gpio({{"/inputs/1/kind", "stop"}}, "/inputs/1/kind", "vehicle_on, charger_connected, estop");
  refuses_gpio({{"/inputs/1/name", ""}}, "/inputs/1/name", "1 to 32");
  refuses_gpio({{"/inputs", {{"line", 3}}}}, "/inputs", "a list");
  refuses_text(with_gpio_without("", {"chip"}).dump(), "/gpio/chip", "required");
  refuses_text(with_gpio_without("/outputs/fan", {"line"}).dump(), "/gpio/outputs/fan/line", "required");
  refuses_text(with_gpio_without("/inputs/0", {"kind"}).dump(), "/gpio/inputs/0/kind", "required");
}

TEST_CASE("a line and a name belong to one only, and the problem says to whom", "[unit][config][gpio]") {
  refuses_text(with_gpio({{"/outputs/precharge/line", 3}}).dump(), "/gpio/outputs/precharge/line",
               "taken by /gpio/outputs/main_positive");
  refuses_text(with_gpio({{"/feedback/main_negative/line", 4}}).dump(), "/gpio/feedback/main_negative/line",
               "taken by /gpio/outputs/main_negative");
  refuses_text(with_gpio({{"/inputs/1/line", 14}}).dump(), "/gpio/inputs/1/line",
               "taken by /gpio/feedback/main_negative");
  refuses_text(with_gpio({{"/inputs/2/name", "rear"}}).dump(), "/gpio/inputs/2/name", "taken by /gpio/inputs/1");
}

TEST_CASE("contactors on lines are complete, and have a watchdog", "[unit][config][gpio]") {
  refuses_text(with_gpio_without("/outputs", {"precharge"}).dump(), "/gpio/outputs/precharge",
               "all there, or none of them");
  refuses_text(with_gpio_without("/outputs", {"watchdog"}).dump(), "/gpio/outputs/watchdog", "as main_positive has");
  Json fan_only = with_gpio_without("", {"feedback"});
  fan_only["gpio"]["outputs"] = {{"fan", {{"line", 6}}}};
  CHECK(problems_of(fan_only.dump()).empty());
  fan_only["gpio"]["outputs"]["charge"] = {{"line", 5}};
  refuses_text(fan_only.dump(), "/gpio/outputs/watchdog", "as charge has");
}

TEST_CASE("there is no feedback of an output that has no line", "[unit][config][gpio]") {
  refuses_text(with_gpio({{"/feedback/heater", {{"line", 20}}}}).dump(), "/gpio/feedback/heater",
               "/gpio/outputs/heater");
}

TEST_CASE("sixteen inputs with nine debounce times are accepted, and no more of either", "[unit][config][gpio]") {
  Json pack = with_gpio_without("", {"outputs", "feedback"});
  Json& inputs = pack["gpio"]["inputs"] = Json::array();
  for (int i = 0; i < 16; ++i) {
    inputs.push_back(
        {{"name", "input " + std::to_string(i)}, {"kind", "interlock"}, {"line", i}, {"debounce_ms", i % 10}});
  }
  CHECK(problems_of(pack.dump()).empty());  // 0: none
  inputs[0]["debounce_ms"] = 10;
  refuses_text(pack.dump(), "/gpio", "found 10 different debounce_ms, expected at most 9");
  inputs.push_back({{"name", "one more"}, {"kind", "interlock"}, {"line", 16}});
  refuses_text(pack.dump(), "/gpio/inputs", "at most 16");
}

TEST_CASE("everything wrong with the lines is said in one go", "[unit][config][gpio]") {
  Json pack = with_gpio({{"/outputs/fan/line", "six"}, {"/inputs/0/kind", "button"}, {"/inputs/1/line", 9}});
  pack["gpio"]["outputs"].erase("watchdog");
  pack["gpio"]["outputs"].erase("main_negative");
  const ConfigProblems problems = problems_of(pack.dump());
  INFO(all_text(problems));
  std::vector<std::string> paths;
  for (const ConfigProblem& problem : problems) paths.push_back(problem.path);
  std::sort(paths.begin(), paths.end());
  CHECK(paths == std::vector<std::string>{"/gpio/feedback/main_negative", "/gpio/inputs/0/kind", "/gpio/inputs/2/line",
                                          "/gpio/outputs/fan/line", "/gpio/outputs/main_negative",
                                          "/gpio/outputs/watchdog"});
}

/// Pack with GPIO lines for its three contactors and their auxiliary contacts, with these changes (paths from the
/// root).
Json without_unit(const std::vector<Change>& changes) {
  Json pack = with_gpio({{"/feedback/precharge", {{"line", 15}}}});
  pack["contactors"]["pdu"] = false;
  pack["insulation"]["monitoring"] = "ok_line";
  for (const auto& [pointer, value] : changes) pack[Json::json_pointer(pointer)] = value;
  return pack;
}

TEST_CASE("what the core is told of lines is what the pack file has", "[unit][config][gpio]") {
  const auto none = parse(valid_pack().dump());
  REQUIRE(none);
  CHECK_FALSE(none->core.lines.are_used);
  const auto pack = parse(with_gpio({}).dump());
  REQUIRE(pack);
  const LinesConfig& lines = pack->core.lines;
  CHECK(lines.are_used);
  CHECK(lines.drive_contactors);
  CHECK(lines.feedback == 0b0011);  // main positive and main negative
  CHECK(lines.has_vehicle_on);
  CHECK_FALSE(lines.has_charger_connected);
  CHECK_FALSE(lines.has_resume_button);
  CHECK_FALSE(lines.has_insulation_ok);
  CHECK_FALSE(lines.has_supply_ok);
  const auto inputs = parse(with_gpio({{"/inputs/0/kind", "charger_connected"},
                                       {"/inputs/1/kind", "resume_button"},
                                       {"/inputs/2/kind", "insulation_ok"},
                                       {"/inputs/3", {{"name", "24 V"}, {"kind", "supply_ok"}, {"line", 10}}}})
                                .dump());
  REQUIRE(inputs);
  CHECK_FALSE(inputs->core.lines.has_vehicle_on);
  CHECK(inputs->core.lines.has_charger_connected);
  CHECK(inputs->core.lines.has_resume_button);
  CHECK(inputs->core.lines.has_insulation_ok);
  CHECK(inputs->core.lines.has_supply_ok);
}

TEST_CASE("without a power distribution unit everything it does is a line", "[unit][config][gpio]") {
  const auto pack = parse(without_unit({}).dump());
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  CHECK_FALSE(pack->core.contactors.has_pdu);
  CHECK(parse(valid_pack().dump())->core.contactors.has_pdu);

  // Without any GPIO lines, contactors, auxiliary contacts and a close request are missing; each is named.
  const std::string all = all_text(problems_of(changed({{"/contactors/pdu", false}}).dump()));
  for (const std::string path :
       {"/gpio/outputs/main_positive", "/gpio/outputs/main_negative", "/gpio/outputs/precharge",
        "/gpio/feedback/main_positive", "/gpio/feedback/main_negative", "/gpio/feedback/precharge", "/gpio/inputs"}) {
    CAPTURE(path, all);
    CHECK(all.find(path) != std::string::npos);
  }
  Json no_contact = without_unit({});
  no_contact["gpio"]["feedback"].erase("main_negative");
  refuses_text(no_contact.dump(), "/gpio/feedback/main_negative", "its auxiliary contact, as contactors/pdu is false");
  refuses_text(without_unit({{"/gpio/inputs/2/kind", "resume_button"}}).dump(), "/gpio/inputs",
               "there is no other close request");
  CHECK(problems_of(without_unit({{"/gpio/inputs/2/kind", "charger_connected"}}).dump()).empty());
  refuses_text(without_unit({{"/insulation/monitoring", "measured"}}).dump(), "/insulation/monitoring",
               "no PDU reports a resistance");
}

TEST_CASE("an insulation monitor's pulses are a line, and one source of its word", "[unit][config][gpio][FS_3]") {
  const Json line{{"line", 22}, {"active_low", true}};
  const auto pack = parse(with_gpio({{"/insulation_pulses", line}}).dump());
  if (!pack) FAIL(all_text(pack.error()));
  REQUIRE(pack->gpio->insulation_pulses);
  CHECK(pack->gpio->insulation_pulses->line == 22);
  CHECK(pack->gpio->insulation_pulses->active_low);
  CHECK(pack->core.insulation.has_pulse_line);
  CHECK(pack->core.insulation.is_heard_itself());
  CHECK_FALSE(parse(with_gpio({}).dump())->core.insulation.has_pulse_line);

  // With this line a host without a PDU measures the insulation.
  CHECK(problems_of(without_unit({{"/insulation/monitoring", "measured"}, {"/gpio/insulation_pulses", line}}).dump())
            .empty());
  Json alone = changed({{"/gpio", Json{{"chip", "/dev/gpiochip0"}, {"insulation_pulses", line}}}});
  CHECK(problems_of(alone.dump()).empty());

  Json both = with_gpio({{"/insulation_pulses", line}});
  both["insulation"] = {{"monitoring", "measured"}, {"protocol", "iso165c"}};
  refuses_text(both.dump(), "/gpio/insulation_pulses", "insulation/protocol names a monitor already");
  Json ok_line = with_gpio({{"/insulation_pulses", line}});
  ok_line["insulation"]["monitoring"] = "ok_line";
  refuses_text(ok_line.dump(), "/insulation/monitoring", "gpio/insulation_pulses report a resistance");
  refuses_text(with_gpio({{"/insulation_pulses", Json{{"line", 7}}}}).dump(), "/gpio/insulation_pulses/line",
               "taken by /gpio/inputs/0");
  refuses_text(with_gpio({{"/insulation_pulses", Json{{"active_low", true}}}}).dump(), "/gpio/insulation_pulses/line",
               "required");
  refuses_text(with_gpio({{"/insulation_pulses", Json{{"line", 22}, {"debounce_ms", 5}}}}).dump(),
               "/gpio/insulation_pulses/debounce_ms", "unknown key");
  refuses_text(with_gpio({{"/insulation_pulses", 22}}).dump(), "/gpio/insulation_pulses", "an object");
}

TEST_CASE("a charge contactor without a unit is a line with a contact, too", "[unit][config][gpio]") {
  Json pack = without_unit({{"/contactors/has_charge_contactor", true}});
  const std::string all = all_text(problems_of(pack.dump()));
  INFO(all);
  CHECK(all.find("/gpio/outputs/charge") != std::string::npos);
  CHECK(all.find("/gpio/feedback/charge") != std::string::npos);
  pack["gpio"]["outputs"]["charge"] = {{"line", 20}};
  pack["gpio"]["feedback"]["charge"] = {{"line", 21}};
  CHECK(problems_of(pack.dump()).empty());
}

}  // namespace
}  // namespace bmu
