// All programs report a wrong command line in the same form: a single line that starts with their name and contains the
// error and the correction; exit code 2.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"

namespace bmu {

namespace {

struct Mistake {
  std::vector<std::string> words;  // the program first
  std::string told;
};

const std::vector<Mistake> mistakes{
    {{"bmudump", "-r", "-", "--count", "0"}, "--count: 0 is not a whole number from 1 up"},
    {{"bmudump", "-r", "-", "--count", "some"}, "--count: 'some' is not a whole number from 1 up"},
    {{"bmudump", "-r", "-", "--count"}, "--count: wants one value"},
    {{"bmudump", "can0", "--seconds", "x"}, "--seconds: 'x' is not a number from 0.001 to 1000000000"},
    {{"bmudump", "-r", "-", "--bitrate", "0"}, "--bitrate: 0 is not a whole number from 1 to 1000000"},
    {{"bmudump", "-r", "-", "--color", "sometimes"}, "--color: 'sometimes' is none of auto, always, never"},
    {{"bmudump", "-r", "-", "--nodes", "1-4,70"}, "--nodes: '70' is no node"},
    {{"bmudump", "--dbc", "i3_csc", "--nodes", "9"}, "--nodes: '9' is no node or range of nodes: i3_csc has 1 to 8"},
    {{"bmudump", "--dbc", "i3_csc", "--nodes", "0-7"},
     "--nodes: '0-7' is no node or range of nodes: i3_csc has 1 to 8"},
    {{"bmudump", "--dbc", "outlander_cmu", "--nodes", "5,13"},
     "--nodes: '13' is no node or range of nodes: outlander_cmu has 1 to 11"},
    {{"bmudump", "--dbc", "sma", "--nodes", "1"}, "--nodes: the messages of sma have no nodes"},
    {{"bmudump", "--completion", "fish"}, "--completion: 'fish' is none of bash, zsh (see"},
    {{"bmuctl", "--completion", "fish"}, "--completion: 'fish' is none of bash, zsh (see"},
    {{"bmuctl", "--completion"}, "--completion: wants one value (see"},
    {{"bmudump", "-r", "-", "--vehicle-base", "800"}, "--vehicle-base: '800' is no hexadecimal number from 0 to 7F7"},
    {{"bmudump", "-r", "-", "--dbc", "toaster"},
     "--dbc: 'toaster' is none of internal, vehicle, charger, and no device; bmudump --devices lists them"},
    {{"bmudump", "-r", "-", "--dbc", "elcon"},
     "--dbc: 'elcon' is none of internal, vehicle, charger, and no device; did you mean elcon_tc? "},
    {{"bmudump", "-r", "-", "--device", "can1=ou"},
     "--device: found 'can1=ou', expected NAME, BUS=NAME, BUS=internal or BUS=vehicle; did you mean outlander_cmu or "
     "outlander_current? bmudump --devices"},
    {{"bmudump", "--no\nsuch", "can0"}, "--no?such: there is no such option"},
    {{"bmudump"}, "no input, expected a bus or -r FILE"},
    {{"mmusim", "--seconds", "x"}, "--seconds: 'x' is not a number from 0.001 to 1000000"},
    {{"mmusim", "--seed", "-1"}, "--seed: -1 is not a whole number from 0 up"},
    {{"mmusim", "pack.json"}, "'pack.json' is one word too many"},
    {{"mmusim"}, "--pack: required"},
    {{"mmusim", "--pack", "x.json", "--with-master", "--charger-bus", "unix:x"},
     "--charger-bus: not allowed with --virtual-time or --with-master"},
    {{"bmuctl", "watch", "--seconds", "x"}, "--seconds: 'x' is not a number from 0.1 to 1000000"},
    {{"bmuctl", "watch", "--period", "nan"}, "--period: nan is not a number from 0.05 to 60"},
    {{"bmuctl", "nope"},
     "'nope' is no command; there are status, cells, faults, why, drive, clear, modules, balance, health, charger, "
     "inverter, wake, reload, watch"},
    {{"bmuctl", "--json", "nope"}, "'nope' is no command"},
    {{"bmuctl"}, "a command is missing; there are status, "},
    {{"bmuctl", "--nope"}, "--nope: there is no such option"},
    {{"bmuctl", "status", "--nope"}, "--nope: there is no such option"},
    {{"bmuctl", "status", "nope"}, "'nope' is one word too many"},
    {{"bmucell"}, "a command is missing"},
    {{"bmucell", "eval", "--cell", "c.json", "--from-soc", "101", "f.csv"},
     "--from-soc: 101 is not a number from 0 to 100"},
    {{"bmucell", "eval", "--cell", "c.json", "--estimator", "guess", "f.csv"},
     "--estimator: 'guess' is none of ekf, mixed, coulomb"},
    {{"bmucell", "eval", "--cell", "c.json", "--csv", "t.csv", "f.csv", "g.csv"},
     "--csv: is the trace of one recording, and there are several"},
    {{"bmucell", "fit", "--base", "c.json"}, "files: are missing: fit to what?"},
    {{"bmucell", "fit", "--base", "c.json", "--temperatures", "0,25,0", "f.csv"}, "--temperatures: has one twice"},
    {{"bmucell", "fit", "--base", "c.json", "--pair-times-s", "6,60,60", "f.csv"}, "--pair-times-s: do not rise"},
    {{"bmucell", "fit", "--base", "c.json", "--pair-times-s", "6,60", "f.csv"},
     "--pair-times-s: expected three numbers"},
    {{"bmucell", "eval", "f.csv"}, "--cell is required"},
    {{"bmucell", "eval", "--cell", "c.json"}, "files is required"},
    {{"bmucell", "guess"}, "'guess' is no command; there are fit, eval"},
    {{"bmucell", "fit", "--base", "c.json", "--json", "f.csv"}, "--json: and the cell file would both go to"},
    {{"bmud", "--no-such-option"}, ""},
    {{"bmud", "p.json", "--record-file-MB", "20", "--record-total-MB", "10"},
     "--record-total-MB: found 10, expected at least 40: twice --record-file-MB 20"},
    {{"bmud", "p.json", "--record-total-MB", "31"}, "--record-total-MB: found 31, expected at least 32"},
};

}  // namespace

TEST_CASE("a mistake in a command line is told in one line, with what was found and wanted",
          "[integration][command_line]") {
  for (const Mistake& mistake : mistakes) {
    const std::string& name = mistake.words.front();
    std::vector<std::string> command = mistake.words;
    command.front() = program(name);
    const Finished finished = run_program(command);
    CAPTURE(mistake.words, finished.err);
    CHECK(finished.status == 2);
    CHECK(finished.out.empty());
    CHECK(finished.err.starts_with(name + ": " + mistake.told));
    CHECK(std::count(finished.err.begin(), finished.err.end(), '\n') == 1);
    CHECK(finished.err.size() < 200);
  }
}

TEST_CASE("every program tells its version and its options on standard output", "[integration][command_line]") {
  for (const std::string name : {"bmud", "bmucell", "bmuctl", "bmudump", "mmusim"}) {
    CAPTURE(name);
    CHECK(run_program({program(name), "--version"}).out == name + " " BMUD_VERSION "\n");
    const Finished help = run_program({program(name), "--help"});
    CHECK(help.status == 0);
    CHECK(help.out.find("--version") != std::string::npos);
    CHECK(help.err.empty());
  }
}

TEST_CASE("a recording in the place of a bus is told how to be read", "[integration][command_line]") {
  const TemporaryFolder folder;
  std::ofstream(folder / "drive") << "(1.000000) vcan0 7FF#\n";
  for (const std::string& file : {folder / "drive", std::string("no-such.log")}) {
    const Finished finished = run_program({program("bmudump"), file});
    CHECK(finished.status == 2);
    CHECK(finished.err.starts_with("bmudump: " + file + ": not a bus"));
    CHECK(finished.err.find("to read a recording: bmudump -r " + file) != std::string::npos);
  }
}

TEST_CASE("what is no socket of a daemon is told with the reason", "[integration][command_line]") {
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "x";
  CHECK(run_program({program("bmuctl"), "--socket", folder / "file", "status"}).err ==
        "bmuctl: no daemon at '" + (folder / "file") + "': not a socket\n");
  CHECK(run_program({program("bmuctl"), "--socket", "", "status"})
            .err.starts_with("bmuctl: no daemon at '': socket does not exist"));
}

TEST_CASE("lines are not written over a pack, a state or what is no file", "[integration][command_line][gpio]") {
  const TemporaryFolder folder;
  const std::string pack = folder / "pack.json";
  std::filesystem::copy_file(test::in_source("config/packs/demo-48s.json"), pack);
  const auto said = [&](const std::string& lines, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{program("bmud"), "--config", pack, "--driven-lines", lines};
    command.insert(command.end(), more.begin(), more.end());
    const Finished finished = run_program(command);
    CHECK(finished.status == 2);
    return finished.err;
  };
  const std::string link = folder / "link";
  std::filesystem::create_symlink(pack, link);
  CHECK(said(pack).find("--driven-lines: found '" + pack + "', which is the file of --config") != std::string::npos);
  CHECK(said(link).find("which is the file of --config") != std::string::npos);
  const std::string state = folder / "state.json";
  CHECK(said(state, {"--state", state}).find("which is the file of --state") != std::string::npos);
  CHECK(said(folder / "").find("a directory, expected a file") != std::string::npos);
  CHECK(said("/dev/null").find("not a regular file, expected a file") != std::string::npos);
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK(said(folder / "pipe").find("not a regular file, expected a file") != std::string::npos);
  CHECK(said("").find("found nothing, expected a path") != std::string::npos);
  std::filesystem::create_symlink("/nowhere/lines", folder / "dangling");
  CHECK(said(folder / "dangling").find("a dangling symbolic link, expected a file") != std::string::npos);
  CHECK(read_file(pack) == read_file(test::in_source("config/packs/demo-48s.json")));
}

TEST_CASE("whatever stands where driven lines should be, those of the pack file are opened",
          "[integration][command_line][gpio]") {
  const TemporaryFolder folder;
  const std::string pack = test::in_source("config/packs/demo-48s.json");
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  std::filesystem::create_symlink("/nowhere/lines", folder / "dangling");
  for (const std::string& lines : {pack, folder / "pipe", folder / "dangling", folder / "", std::string("/dev/null"),
                                   folder / "none", std::string()}) {
    CAPTURE(lines);
    const Finished opened = run_program({program("bmud"), "--open-gpio", "--config", pack, "--driven-lines", lines});
    CHECK(opened.status == 0);
    CHECK(opened.out == "no outputs on GPIO lines\n");
    const bool is_missing = lines.empty() || lines.ends_with("none") || lines.ends_with("dangling");
    CHECK(opened.err.empty() == is_missing);
    CHECK((is_missing || opened.err.ends_with("; opening those of the pack file\n")));
  }
}

TEST_CASE("opening GPIO outputs ends with a status that tells how it went", "[integration][command_line][gpio]") {
  const std::string packs = test::in_source("config/packs/");
  const Finished without = run_program({program("bmud"), "--open-gpio", "--config", packs + "demo-48s.json"});
  CHECK(without.status == 0);
  CHECK(without.out == "no outputs on GPIO lines\n");

  const TemporaryFolder folder;
  nlohmann::json pack = nlohmann::json::parse(std::ifstream(packs + "demo-48s.json"), nullptr, true, true);
  pack["cell"] = std::filesystem::path(packs) / pack["cell"].get<std::string>();
  const auto open_on = [&](const std::string& chip) {
    pack["gpio"] = {{"chip", chip}, {"outputs", {{"fan", {{"line", 6}}}}}};
    std::ofstream(folder / "pack.json") << pack;
    return run_program({program("bmud"), "--open-gpio", "--config", folder / "pack.json"});
  };
  const Finished absent = open_on("/dev/no-such-chip");
  CHECK(absent.status == 71);
  CHECK(absent.out.empty());
  CHECK(absent.err.starts_with("bmud: not opened: /dev/no-such-chip: cannot be opened, expected a GPIO chip"));
  CHECK(open_on("/dev/null").status == 71);
  CHECK(open_on("/dev/null").err.find("not a GPIO chip") != std::string::npos);

  CHECK(open_on("gpiochip0").status == 78);
  CHECK(run_program({program("bmud"), "--open-gpio", "--check-config", "--config", packs + "demo-48s.json"}).status ==
        2);
}

}  // namespace bmu
