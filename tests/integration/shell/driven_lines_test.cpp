// The list of lines that a daemon drives, for programs that open the lines after it, even if the pack file has changed
// by then.
#include "daemon/shell/gpio/driven_lines.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu {

using test::Bench;

namespace {

using nlohmann::json;

const std::string packs = test::in_source("config/packs/");

GpioConfig two_lines() {
  GpioConfig gpio;
  gpio.chip = "/dev/gpiochip7";
  gpio.outputs.at(static_cast<std::size_t>(GpioOutput::main_positive)) = {.line = 17, .active_low = true};
  gpio.outputs.at(static_cast<std::size_t>(GpioOutput::watchdog)) = {.line = 4'294'967'295, .active_low = false};
  gpio.inputs.push_back({.name = "stop", .kind = GpioInputKind::estop, .at = {.line = 3}});
  return gpio;
}

/// The demonstration's pack with a section "gpio".
std::string pack_with_fan(const std::string& chip, int line) {
  json pack = json::parse(std::ifstream(packs + "demo-48s.json"), nullptr, true, true);
  pack["cell"] = std::filesystem::path(packs) / pack["cell"].get<std::string>();
  pack["gpio"] = {{"chip", chip}, {"outputs", {{"fan", {{"line", line}}}}}};
  return pack.dump();
}

/// A daemon with its own pack file, with the fan on a line.
struct FanBench : Bench {
  std::string driven = folder / "driven-lines.json";

  FanBench() {
    pack = folder / "pack.json";
    std::ofstream(pack) << pack_with_fan("/dev/no-such-chip", 6);
    more_options = {"--driven-lines", driven};
    start_daemon();
    REQUIRE(listener.next(test::hang_max));
  }
};

Finished open_lines(const std::string& pack, const std::string& driven) {
  return run_program({program("bmud"), "--open-gpio", "--config", pack, "--driven-lines", driven});
}

}  // namespace

TEST_CASE("driven lines are read as they were written, outputs only", "[integration][gpio]") {
  const TemporaryFolder folder;
  const std::string path = folder / "driven-lines.json";
  REQUIRE(write_driven_lines(path, two_lines()));
  const auto read = read_driven_lines(path);
  REQUIRE(read);
  REQUIRE(*read);
  CHECK((*read)->chip == "/dev/gpiochip7");
  CHECK((*read)->inputs.empty());
  for (std::size_t i = 0; i < gpio_output_count; ++i) {
    const auto& found = (*read)->outputs.at(i);
    const auto wanted = two_lines().outputs.at(i);
    REQUIRE(found.has_value() == wanted.has_value());
    if (!found) continue;
    CHECK(found->line == wanted->line);
    CHECK(found->active_low == wanted->active_low);
  }
  // Another pack without lines leaves an empty list.
  REQUIRE(write_driven_lines(path, std::nullopt));
  REQUIRE(*read_driven_lines(path));
  CHECK((*read_driven_lines(path))->has_no_outputs());
}

TEST_CASE("no file of driven lines is no error, and what is none is", "[integration][gpio]") {
  const TemporaryFolder folder;
  const std::string path = folder / "driven-lines.json";
  REQUIRE(read_driven_lines(path));
  CHECK_FALSE(*read_driven_lines(path));
  CHECK(write_driven_lines("", two_lines()));
  CHECK_FALSE(write_driven_lines(folder / "nowhere/lines", two_lines()));
  CHECK(read_driven_lines(folder / "").error().what.ends_with("not a regular file"));
  for (const char* text : {
           "",
           "{",
           "[]",
           "7",
           R"({"chip": "c"})",
           R"({"outputs": {}})",
           R"({"chip": 7, "outputs": {}})",
           R"({"chip": "c", "outputs": []})",
           R"({"chip": "/dev/c", "outputs": {"fan": 7}})",
           R"({"chip": "/dev/c", "outputs": {"fan": {"line": 7}}})",
           R"({"chip": "/dev/c", "outputs": {"fan": {"active_low": true}}})",
           R"({"chip": "/dev/c", "outputs": {"fan": {"line": -1, "active_low": true}}})",
           R"({"chip": "/dev/c", "outputs": {"fan": {"line": 4294967296, "active_low": true}}})",
           R"({"chip": "/dev/c", "outputs": {"fan": {"line": 1.5, "active_low": true}}})",
           R"({"chip": "/dev/c", "outputs": {"fan": {"line": 1, "active_low": 1}}})",
           R"({"chip": "/dev/c", "outputs": {"horn": {"line": 1, "active_low": true}}})",
           R"({"chip": "", "outputs": {"fan": {"line": 1, "active_low": true}}})",
           R"({"chip": "c", "outputs": {"fan": {"line": 1, "active_low": true}}})",
           R"({"chip": "/dev/c\u0000d", "outputs": {"fan": {"line": 1, "active_low": true}}})",
           R"({"chip": "/dev/c", "outputs": {"fan": {"line": 1, "active_low": true},
                                            "heater": {"line": 1, "active_low": false}}})",
       }) {
    std::ofstream(path, std::ios::trunc) << text;
    INFO(text);
    const auto read = read_driven_lines(path);
    REQUIRE_FALSE(read);
    CHECK(read.error().what.starts_with(path + ": found no list of lines, expected {\"chip\""));
  }
}

TEST_CASE("lines that cannot be written down leave no others behind", "[integration][gpio]") {
  const TemporaryFolder folder;
  const std::string path = folder / "driven-lines.json";
  REQUIRE(write_driven_lines(path, two_lines()));
  // The file that is written first, and then renamed, cannot be created.
  std::filesystem::create_directory(path + ".part");
  CHECK_FALSE(write_driven_lines(path, GpioConfig{.chip = "/dev/gpiochip1"}));
  const auto read = read_driven_lines(path);
  REQUIRE(read);
  CHECK_FALSE(*read);
}

TEST_CASE("the lines a daemon drove are opened after it, whatever the pack file says by then",
          "[integration][daemon][gpio][bus]") {
  FanBench bench;
  const std::string& driven = bench.driven;
  CHECK(read_file(driven) ==
        "{\"chip\":\"/dev/no-such-chip\",\"outputs\":{\"fan\":{\"active_low\":false,\"line\":6}}}\n");
  bench.daemon->signal(SIGKILL);
  REQUIRE(bench.daemon->wait(test::hang_max) == 128 + SIGKILL);

  const auto expect_tried = [&] {
    const Finished opened = open_lines(bench.pack, driven);
    CHECK(opened.status == 71);
    CHECK(opened.err.starts_with("bmud: not opened: /dev/no-such-chip: cannot be opened"));
  };
  std::ofstream(bench.pack, std::ios::trunc) << pack_with_fan("/dev/another-chip", 8);
  expect_tried();
  std::ofstream(bench.pack, std::ios::trunc) << "{ half a pack";
  expect_tried();
  std::filesystem::remove(bench.pack);
  expect_tried();

  // Without a valid list of driven lines the pack file is used.
  std::ofstream(bench.pack) << pack_with_fan("/dev/another-chip", 8);
  std::ofstream(driven, std::ios::trunc) << "torn";
  const Finished torn = open_lines(bench.pack, driven);
  CHECK(torn.status == 71);
  CHECK(torn.err.find("found no list of lines") != std::string::npos);
  CHECK(torn.err.find("not opened: /dev/another-chip") != std::string::npos);
  std::filesystem::remove(driven);
  CHECK(open_lines(bench.pack, driven).err.starts_with("bmud: not opened: /dev/another-chip"));
}

TEST_CASE("a reload tells the lines of the new pack, and a pack without lines that there are none",
          "[integration][daemon][gpio][reload][bus]") {
  FanBench bench;
  const std::string& driven = bench.driven;
  const auto becomes = [&](const std::string& text) {
    bench.daemon->signal(SIGHUP);
    CHECK(bench.becomes([&] { return read_file(driven) == text; }));
  };
  std::ofstream(bench.pack, std::ios::trunc) << pack_with_fan("/dev/no-such-chip", 8);
  becomes("{\"chip\":\"/dev/no-such-chip\",\"outputs\":{\"fan\":{\"active_low\":false,\"line\":8}}}\n");
  json without = json::parse(pack_with_fan("", 0));
  without.erase("gpio");
  std::ofstream(bench.pack, std::ios::trunc) << without.dump();
  becomes("{\"chip\":\"\",\"outputs\":{}}\n");
  const Finished opened = open_lines(bench.pack, driven);
  CHECK(opened.status == 0);
  CHECK(opened.out == "no outputs on GPIO lines\n");
}

TEST_CASE("a daemon whose folder for driven lines is gone says so, and runs", "[integration][daemon][gpio][bus]") {
  Bench bench;
  bench.more_options = {"--driven-lines", bench.folder / "nowhere/driven-lines.json"};
  bench.start_daemon();
  REQUIRE(bench.listener.next(test::hang_max));
  // The log is written by its own thread.
  const auto is_said = [&] {
    return read_file(bench.log).find("bmud --open-gpio will use the pack file") != std::string::npos;
  };
  CHECK(bench.becomes(is_said));
}

}  // namespace bmu
