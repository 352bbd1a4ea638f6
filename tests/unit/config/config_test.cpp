// Pack file: accepted files; all errors of a rejected file are reported at once, each with its location.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "config/checks/bus_checks.hpp"
#include "config/fields/pack_fields.hpp"
#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/changed_pack.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {
namespace {

// --- accepted files -------------------------------------------------------------------------------------------------

TEST_CASE("every pack that is shipped loads", "[unit][config][BMS_NF.1]") {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(packs_directory)) {
    const auto pack = load_pack_config(entry.path());
    INFO((pack ? entry.path().string() : all_text(pack.error())));
    REQUIRE(pack);
    CHECK(cell_count(pack->core) >= 6);
    ++count;
  }
  CHECK(count == 10);
}

TEST_CASE("the pack that speeds are measured with loads", "[unit][config]") {
  const auto pack = load_pack_config(test::in_source("tests/bench/largest.json"));
  INFO((pack ? "" : all_text(pack.error())));
  REQUIRE(pack);
  CHECK(cell_count(pack->core) == 756);
}

TEST_CASE("every cell that is shipped is complete and says where its numbers come from", "[unit][config][BMS_NF.1]") {
  for (const auto& entry : std::filesystem::directory_iterator(cells_directory)) {
    const Json cell = Json::parse(bytes_of(entry.path()), nullptr, true, true);
    CHECK(cell.at("origin").get<std::string>().find("measurement") != std::string::npos);
    // Only the keys of the cell matter: the limits of the demonstration pack need not suit this cell.
    for (const ConfigProblem& problem : problems_of(changed({{"/cell", cell}}).dump())) {
      INFO(to_text(problem));
      CHECK(problem.path.rfind("/cell", 0) != 0);
    }
  }
}

TEST_CASE("values arrive in the units of the core", "[unit][config]") {
  const auto loaded = load_pack_config(packs_directory / "demo-48s.json");
  REQUIRE(loaded);
  const PackConfig& pack = *loaded;
  CHECK(pack.name == "demo 48s");
  CHECK(pack.cell_name == "NMC 3.0 Ah, 10 parallel");
  CHECK(pack.buses.internal == "unix:demo");
  CHECK(pack.buses.vehicle == "unix:demo");
  REQUIRE(pack.core.modules.size() == 4);
  CHECK(pack.core.modules[2].node == 3);
  CHECK(pack.core.modules[2].cell_count == 12);
  CHECK(pack.core.modules[2].temperature_sensor_count == 4);
  CHECK(pack.core.limits.cell_overvoltage.open == 4'230'000);
  CHECK(pack.core.limits.cell_overvoltage.hysteresis == 20'000);
  CHECK(pack.core.limits.cell_overvoltage.confirm == 140ms);
  CHECK(pack.core.limits.cell_undertemperature.open == -100);
  CHECK(pack.core.limits.discharge_overcurrent.open == 90'000);
  CHECK(pack.core.limits.pack_voltage_mismatch.open == 4'000);
  CHECK(pack.core.current.discharge_continuous_mA == 60'000);
  CHECK(pack.core.cell.capacity_uAs == 30 * uAs_per_Ah);
  CHECK(std::abs(pack.core.cell.series_resistance_Ohm - 0.0019) < 1e-12);
  CHECK(pack.core.cell.voltage_max_uV == 4'250'000);
  REQUIRE(pack.core.cell.ocv.size() == 13);
  CHECK(pack.core.cell.ocv.back().soc_permille == 1'000);
  CHECK(pack.core.cell.ocv.back().ocv_uV == 4'180'000);
  CHECK(pack.core.vehicle.base_id == 0x620);
  CHECK(std::string(pack.core.vehicle.name.begin(), pack.core.vehicle.name.end()) == "BMUD    ");
}

TEST_CASE("optional sections fall back to the defaults of the core", "[unit][config]") {
  Json pack = valid_pack();
  for (const char* key : {"$schema", "ages", "poll", "sensor", "soc", "vehicle"}) pack.erase(key);
  pack["contactors"] = {{"precharge_min_ms", 100}};
  const auto parsed = parse(pack.dump());
  REQUIRE(parsed);
  CHECK(parsed->core.ages.temperature == AgeConfig{}.temperature);
  CHECK(parsed->core.poll.period == PollConfig{}.period);
  CHECK(parsed->core.contactors.precharge_timeout == ContactorConfig{}.precharge_timeout);
  CHECK(parsed->core.vehicle.version == VehicleConfig{}.version);
  CHECK_FALSE(parsed->core.sensor.invert_current);
}

TEST_CASE("a section may give some of its keys", "[unit][config]") {
  const auto parsed =
      parse(changed({{"/contactors", Json::parse(R"({"settle_ms": 80, "precharge_min_ms": 80})")}}).dump());
  REQUIRE(parsed);
  CHECK(parsed->core.contactors.settle == 80ms);
  CHECK(parsed->core.contactors.feedback_timeout == ContactorConfig{}.feedback_timeout);
}

TEST_CASE("modules may be listed one by one or several at once, in the order of their cells",
          "[unit][config][BMS_F.2]") {
  const auto parsed = parse(changed({{"/modules", Json::parse(R"([
      {"node": 7, "cells": 5, "temperature_sensors": 0},
      {"nodes": [2, 63], "cells": 12, "temperature_sensors": 4, "front_end_faults": true}])")}})
                                .dump());
  REQUIRE(parsed);
  REQUIRE(parsed->core.modules.size() == 3);
  CHECK(parsed->core.modules[0].node == 7);
  CHECK(parsed->core.modules[1].node == 2);
  CHECK(parsed->core.modules[2].node == 63);
  CHECK(cell_count(parsed->core) == 29);
  CHECK_FALSE(parsed->core.modules[0].must_report_front_end);
  CHECK(parsed->core.modules[1].must_report_front_end);
  CHECK(parsed->core.modules[2].must_report_front_end);
}

TEST_CASE("a whole number may be written with a point or an exponent", "[unit][config]") {
  std::string text = changed({{"/poll/period_ms", 77}}).dump();
  text.replace(text.find("77"), 2, "1.0e2");
  const auto parsed = parse(text);
  REQUIRE(parsed);
  CHECK(parsed->core.poll.period == 100ms);
}

// --- one class of error each ----------------------------------------------------------------------------------------

TEST_CASE("text that is no JSON is refused as file:line:column", "[unit][config][F78]") {
  refuses_text("{\n  \"name\": \"x\",\n  oops\n}", "", "pack.json:3:3: found a syntax error");
  refuses_text("", "", "pack.json:1:1: ");
  refuses_text("{\"name\": 1e999}", "", "number overflow");
  refuses_text("{\"name\": NaN}", "", "pack.json:1:10: ");
  refuses_text("{\"name\": \"\xFF\"}", "", "pack.json:1:11: ");
  refuses_text("{} {}", "", "pack.json:1:4: ");
  refuses_text("[]", "", "pack.json: found [], expected an object");
}

TEST_CASE("the column is where the wrong word begins", "[unit][config]") {
  refuses_text("{\"name\": 28O0}", "", "pack.json:1:10: ");
  refuses_text("{\n  \"name\": \"x\"\n  \"buses\": 1}", "", "pack.json:3:3: ");
  refuses_text("{\n  \"name\": \"x\"\n", "", "pack.json:3:1: ");
}

TEST_CASE("nesting without end is refused, not followed", "[unit][config]") {
  refuses_text(std::string(100'000, '['), "/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0/0", "16 levels");
}

TEST_CASE("a key given twice is refused with its path", "[unit][config][F78]") {
  std::string text = valid_pack().dump();
  const std::string key = R"("settle_ms":)";
  text.insert(text.find(key), R"("settle_ms":50,)");
  refuses_text(text, "/contactors/settle_ms", "second time");
}

TEST_CASE("an unknown key is refused with a hint to the one that was meant", "[unit][config][F78]") {
  refuses({{"/limits/cell_overvoltage/open_V", 4}}, "/limits/cell_overvoltage/open_V", "did you mean \"open_mV\"?");
  refuses({{"/modules/0/temperature_sensor", 4}}, "/modules/0/temperature_sensor", "\"temperature_sensors\"");
  refuses({{"/moduls", 1}}, "/moduls", "\"modules\"");
  refuses({{"/cell/capacity_mAh", 1}}, "/cell/capacity_mAh", "\"capacity_Ah\"");
  refuses({{"/sensor/zzzzzzzzzzzzzzzz", 1}}, "/sensor/zzzzzzzzzzzzzzzz", "one of little_endian, invert_current");
  refuses({{"/a~1b~0c", 1}}, "/a~1b~0c", "unknown key");
}

TEST_CASE("a missing required key is refused", "[unit][config][F78]") {
  refuses_text(without("", "name").dump(), "/name", "missing");
  refuses_text(without("", "buses").dump(), "/buses", "required");
  refuses_text(without("", "cell").dump(), "/cell", "required");
  refuses_text(without("", "modules").dump(), "/modules", "required");
  refuses_text(without("", "limits").dump(), "/limits", "required");
  refuses_text(without("", "current").dump(), "/current", "required");
  refuses_text(without("/limits", "charge_overcurrent").dump(), "/limits/charge_overcurrent", "required");
  refuses_text(without("/limits/cell_overvoltage", "confirm_ms").dump(), "/limits/cell_overvoltage/confirm_ms",
               "required");
  refuses_text(without("/cell", "ocv").dump(), "/cell/ocv", "required");
}

TEST_CASE("a value of the wrong type is refused", "[unit][config][F78]") {
  refuses({{"/name", 5}}, "/name", "found 5, expected a text");
  refuses({{"/buses", "can0"}}, "/buses", "found \"can0\", expected an object");
  refuses({{"/limits/cell_overvoltage", 4'200}}, "/limits/cell_overvoltage", "an object");
  refuses({{"/poll/period_ms", "100"}}, "/poll/period_ms", "found \"100\", expected a whole number from 20 to 120");
  refuses({{"/poll/period_ms", nullptr}}, "/poll/period_ms", "found null");
  refuses({{"/sensor/invert_current", 1}}, "/sensor/invert_current", "true or false");
  refuses({{"/cell", 3}}, "/cell", "cell file");
  refuses({{"/modules", Json::object()}}, "/modules", "a list of modules");
  refuses({{"/modules/0", 4}}, "/modules/0", "an object");
  refuses({{"/modules/0/nodes", 4}}, "/modules/0/nodes", "a list of node numbers");
  refuses({{"/cell/ocv/3", 4}}, "/cell/ocv/3", "a pair");
}

TEST_CASE("a number that is not whole is refused where a whole one is wanted", "[unit][config]") {
  refuses({{"/poll/period_ms", 100.5}}, "/poll/period_ms", "found 100.5, expected a whole number");
  refuses({{"/modules/0/cells", 11.5}}, "/modules/0/cells", "a whole number from 1 to 12");
}

TEST_CASE("a number out of its range is refused, the ends of the range are not", "[unit][config][F79]") {
  accepts({{"/modules/0/cells", 1},
           {"/limits/pack_voltage_mismatch/warn_mV", 500},
           {"/limits/pack_voltage_mismatch/open_mV", 1'000},
           {"/limits/pack_voltage_mismatch/hysteresis_mV", 100}});
  refuses({{"/modules/0/cells", 0}}, "/modules/0/cells", "from 1 to 12");
  refuses({{"/modules/0/cells", 13}}, "/modules/0/cells", "from 1 to 12");
  refuses({{"/modules/0/temperature_sensors", 6}}, "/modules/0/temperature_sensors", "from 0 to 5");
  accepts({{"/contactors/precharge_done_permille", 900}});
  accepts({{"/contactors/precharge_done_permille", 1'000}});
  refuses({{"/contactors/precharge_done_permille", 899}}, "/contactors/precharge_done_permille", "from 900 to 1000");
  refuses({{"/contactors/precharge_done_permille", 1'001}}, "/contactors/precharge_done_permille", "from 900 to 1000");
  refuses({{"/contactors/settle_ms", 1e30}}, "/contactors/settle_ms", "from 20 to 1000");
  refuses({{"/contactors/settle_ms", -5}}, "/contactors/settle_ms", "found -5");
  refuses({{"/cell/capacity_Ah", 0}}, "/cell/capacity_Ah", "from 0.01");
}

TEST_CASE("names of buses follow the rules of their kind", "[unit][config]") {
  for (const char* name : {"can0", "vcan0", "slcan-left", "a", "fifteen-letters", "unix:a", "unix:A.b_c-9",
                           "unix:12345678901234567890123456789012"}) {
    CAPTURE(name);
    accepts({{"/buses/internal", name}});
  }
  for (const char* name : {"", "sixteen--letters", "can 0", "can/0", ".", "..", "tcp:host", "can\t0",
                           "unix:", "unix:a/b", "unix:a b", "unix:123456789012345678901234567890123"}) {
    CAPTURE(name);
    refuses({{"/buses/internal", name}}, "/buses/internal", "an interface name");
  }
  // A file contains no such texts, a command line can.
  for (const char* name : {"can\x01", "can\x7F"}) CHECK_FALSE(is_bus_name(name));
}

TEST_CASE("texts for the vehicle are at most eight ASCII characters", "[unit][config]") {
  accepts({{"/vehicle/name", "EXACTLY8"}});
  refuses({{"/vehicle/name", "MORETHAN8"}}, "/vehicle/name", "1 to 8 ASCII");
  refuses({{"/vehicle/name", "N\xC3\x84ME"}}, "/vehicle/name", "1 to 8 ASCII");
  refuses({{"/vehicle/version", ""}}, "/vehicle/version", "1 to 8 ASCII");
  refuses({{"/name", "two\nlines"}}, "/name", "a text");
}

// --- all errors at once, no partial result --------------------------------------------------------------------------

TEST_CASE("all problems are reported at once", "[unit][config][F78]") {
  const Json pack = changed({{"/nmae", "x"},
                             {"/buses/vehicle", "can/1"},
                             {"/limits/cell_overvoltage/open_mV", 4'300},
                             {"/limits/cell_undervoltage/confirm_ms", 900},
                             {"/cell/ocv/5/1", 100},
                             {"/modules/0/nodes", {1, 1}},
                             {"/vehicle/base_id", "100"}});
  std::vector<std::string> paths;
  for (const ConfigProblem& problem : problems_of(pack.dump())) paths.push_back(problem.path);
  std::sort(paths.begin(), paths.end());
  CHECK(paths == std::vector<std::string>{"/buses/vehicle", "/cell/ocv/5/1", "/limits/cell_overvoltage/open_mV",
                                          "/limits/cell_undervoltage/confirm_ms", "/modules/0/nodes/1", "/nmae",
                                          "/vehicle/base_id"});
}

TEST_CASE("a problem reads as file, path, found and wanted", "[unit][config][F78]") {
  CHECK(to_text({"pack.json", "/modules/2/node", "1", "a node number no other module has"}) ==
        "pack.json: /modules/2/node: found 1, expected a node number no other module has");
  CHECK(to_text({"pack.json", "", "a directory", "a readable file"}) ==
        "pack.json: found a directory, expected a readable file");
  CHECK(to_text({"pack.json", "", "a syntax error", "JSON", TextPosition{14, 24}}) ==
        "pack.json:14:24: found a syntax error, expected JSON");
}

TEST_CASE("what a file holds cannot disturb the terminal that shows its problems", "[unit][config]") {
  const std::string text =
      R"({"\u001b[2J": "\u0007", "name": "\u001b[2J", "buses": ")" + std::string(100'000, 'x') + "\"}";
  const ConfigProblems problems = problems_of(text);
  REQUIRE_FALSE(problems.empty());
  for (const ConfigProblem& problem : problems) {
    const std::string line = to_text(problem);
    CHECK(line.size() < 1'000);
    CHECK(std::all_of(line.begin(), line.end(), [](char c) { return c >= ' ' && c <= '~'; }));
  }
}

// --- files ----------------------------------------------------------------------------------------------------------

TEST_CASE("a file that cannot be read is a problem that names it", "[unit][config][F78]") {
  const TemporaryFolder directory;
  const auto refuses_file = [](const std::filesystem::path& file, const std::string& words) {
    const auto result = load_pack_config(file);
    REQUIRE_FALSE(result);
    REQUIRE(result.error().size() == 1);
    const std::string text = to_text(result.error().front());
    INFO(text);
    CHECK(text.find(file.string()) == 0);
    CHECK(text.find(words) != std::string::npos);
  };
  refuses_file(directory.path() / "missing.json", "no such file");
  refuses_file(directory.path(), "a directory");
  refuses_file("/dev/null", "other than a regular file");
  refuses_file(directory.file("huge.json", std::string((1U << 20U) + 1, ' ')), "more than 1 MiB");
  refuses_file(directory.file("empty.json", ""), "empty.json:1:1: ");
}

TEST_CASE("problems of a cell file name that file", "[unit][config][F78]") {
  const TemporaryFolder directory;
  Json pack = valid_pack();
  Json cell = pack.at("cell");
  cell["capacity_Ah"] = -1;
  pack["cell"] = "cell.json";
  directory.file("cell.json", cell.dump());
  const auto result = load_pack_config(directory.file("pack.json", pack.dump()));
  REQUIRE_FALSE(result);
  REQUIRE(result.error().size() == 1);
  CHECK(result.error().front().file == (directory.path() / "cell.json").string());
  CHECK(result.error().front().path == "/capacity_Ah");
}

TEST_CASE("a missing or broken cell file is one problem", "[unit][config][F78]") {
  const TemporaryFolder directory;
  directory.file("broken.json", "{\n\"name\": \n}");
  const std::string folder = directory.path().string();
  const auto refuses_cell = [&directory](const std::string& name, const std::string& wanted) {
    Json pack = valid_pack();
    pack["cell"] = name;
    const auto result = parse_pack_config(pack.dump(), "pack.json", directory.path());
    REQUIRE_FALSE(result);
    INFO(all_text(result.error()));
    REQUIRE(result.error().size() == 1);
    CHECK(to_text(result.error().front()).find(wanted) == 0);
  };
  refuses_cell("cells/../missing.json", "pack.json: /cell: found \"cells/../missing.json\" (\"" + folder +
                                            "/missing.json\": no such file), expected a readable file");
  refuses_cell(".", "pack.json: /cell: found \".\" (\"" + folder + "/\": a directory), expected a readable file");
  refuses_cell("broken.json", folder + "/broken.json:3:1: found a syntax error");
  refuses({{"/cell", ""}}, "/cell", "a text");
  refuses({{"/cell", std::string("a\0b", 3)}}, "/cell", "a text");
}

TEST_CASE("the hash changes with any byte of the pack file and of the cell file", "[unit][config]") {
  const TemporaryFolder directory;
  const std::string cell = bytes_of(cells_directory / "nmc-30ah-10p.json");
  Json tree = valid_pack();
  tree["cell"] = "cell.json";
  const std::string pack = tree.dump();
  const auto hash_of = [&directory](const std::string& pack_text, const std::string& cell_text) {
    directory.file("cell.json", cell_text);
    const auto result = load_pack_config(directory.file("pack.json", pack_text));
    REQUIRE(result);
    return result->core.hash;
  };
  const std::uint64_t hash = hash_of(pack, cell);
  CHECK(hash == hash_of(pack, cell));
  // A space at each position at which JSON allows one: after each comma outside a string, and at both ends.
  CHECK(hash != hash_of(pack + " ", cell));
  CHECK(hash != hash_of(" " + pack, cell));
  CHECK(hash != hash_of(pack, cell + "\n"));
  CHECK(hash != hash_of(pack, "\n" + cell));
  std::string other_cell = cell;
  const std::size_t comment = other_cell.find("// ");
  for (std::size_t at = comment + 3; at < comment + 20; ++at) {
    other_cell = cell;
    other_cell[at] = other_cell[at] == '#' ? '+' : '#';
    CHECK(hash != hash_of(pack, other_cell));
  }
}

// --- damaged files --------------------------------------------------------------------------------------------------

/// SplitMix64: yields the same numbers with every library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t below(std::uint64_t end) { return next() % end; }

 private:
  std::uint64_t next() {
    state_ += 0x9E37'79B9'7F4A'7C15;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30U)) * 0xBF58'476D'1CE4'E5B9;
    mixed = (mixed ^ (mixed >> 27U)) * 0x94D0'49BB'1331'11EB;
    return mixed ^ (mixed >> 31U);
  }
  std::uint64_t state_;
};

void damage(std::string& text, Random& random) {
  const std::size_t at = random.below(text.size());
  switch (random.below(4)) {
    case 0: text[at] = static_cast<char>(random.below(256)); break;
    case 1: text.erase(at, 1 + random.below(20)); break;
    case 2: text.insert(at, 1, "0123456789-.eE{}[],:\"/*\\ "[random.below(25)]); break;
    default: {
      const std::size_t start = random.below(text.size());
      const std::size_t length = random.below(40);
      text.insert(at, text.substr(start, length));
      break;
    }
  }
}

// BMUD_SEED=n repeats a run that failed with seed n.
TEST_CASE("a damaged file is refused or harmless, and never a crash", "[unit][config]") {
  const char* wanted_seed = std::getenv("BMUD_SEED");  // NOLINT(concurrency-mt-unsafe)
  const std::uint64_t first = wanted_seed != nullptr ? std::strtoull(wanted_seed, nullptr, 10) : 1;
  const std::uint64_t last = wanted_seed != nullptr ? first : 2'000;
  const std::string good = with_gpio({}).dump(1);
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    INFO("repeat with BMUD_SEED=" << seed << " test_unit \"a damaged file*\"");
    Random random(seed);
    std::string text = good;
    for (std::uint64_t times = 1 + random.below(4); times > 0; --times) damage(text, random);
    const auto result = parse(text);
    if (result) {
      const CoreConfig& core = result->core;
      REQUIRE(core.limits.cell_overvoltage.open <= core.cell.voltage_max_uV);
      REQUIRE(core.limits.cell_undervoltage.open >= core.cell.voltage_min_uV);
      REQUIRE(core.cell.ocv.size() >= 2);
    } else {
      REQUIRE_FALSE(result.error().empty());
    }
  }
}

}  // namespace
}  // namespace bmu
