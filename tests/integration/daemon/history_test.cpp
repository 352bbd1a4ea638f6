// The history of the real daemon: a row per second here, read by bmuctl while it is written and afterwards.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sqlite3.h>
#include <sys/stat.h>

#include "daemon/history/history_reader.hpp"
#include "tests/support/daemon_bench.hpp"
#include "tests/support/history_rows.hpp"

namespace bmu {

using test::Bench;
using test::milliseconds;

namespace {

struct HistoryBench : Bench {
  std::string state = folder / "state.json";
  std::string path = folder / "history.sqlite";

  explicit HistoryBench(int period_s = 1) {
    auto json = nlohmann::json::parse(read_file(pack), nullptr, true, true);
    json["cell"] = std::filesystem::path(pack).parent_path() / json.at("cell").get<std::string>();
    json["history"] = {{"period_s", period_s}};
    pack = folder.file("pack.json", json.dump());
    start_emulator("1 vehicle on\n");
  }
  [[nodiscard]] std::vector<std::string> history_command() const {
    std::vector<std::string> command = daemon_command();
    command.insert(command.end(), {"--state", state});
    return command;
  }
  void start(const std::vector<std::string>& more) {
    std::vector<std::string> command = daemon_command();
    command.insert(command.end(), more.begin(), more.end());
    daemon = std::make_unique<Process>(command, ProcessOptions{.err_file = log});
    prefer(*daemon);
    REQUIRE(listener.next(test::hang_max));
  }
  void start() { start({"--state", state}); }
  [[nodiscard]] nlohmann::json told() const {
    const nlohmann::json status = ask_json("status");
    return status.is_object() ? status.at("history") : nlohmann::json();
  }
  [[nodiscard]] bool has_rows(int rows) {
    return becomes([&] { return told().is_object() && told().at("rows_written") >= rows; });
  }
  [[nodiscard]] bool has_logged(const std::string& text) {
    return becomes([&] { return read_file(log).find(text) != std::string::npos; });
  }
  [[nodiscard]] std::vector<nlohmann::json> rows(std::vector<std::string> words = {}) const {
    words.insert(words.begin(), {program("bmuctl"), "--json", "--socket", socket, "history"});
    const Finished finished = run_program(words);
    INFO(finished.err);
    CHECK(finished.status == 0);
    std::vector<nlohmann::json> all;
    std::istringstream lines(finished.out);
    for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::json::parse(line));
    return all;
  }
};

/// True if it has half of the samples of a span without delays: cells are polled every 100 ms, the sensor sends every
/// 20 ms.
bool is_well_filled(const nlohmann::json& row) {
  const std::int64_t span_ms = row.at("span_ms");
  const std::int64_t voltages = row.at("cells").at(0).at("voltage_samples");
  const std::int64_t currents = row.at("current_samples");
  return voltages * 200 > span_ms && currents * 40 > span_ms;
}

}  // namespace

TEST_CASE("the daemon keeps a history beside its state, and bmuctl shows it while it is written and after",
          "[integration][daemon][history][BMS_F.5][bus]") {
  HistoryBench bench;
  bench.start();
  REQUIRE(bench.has_rows(4));
  // The measured part of a second depends on the machine: the test waits for a row with enough samples.
  std::vector<nlohmann::json> running;
  REQUIRE(bench.becomes([&] {
    running = bench.rows({"--cells", "1.1,2.*"});
    return !running.empty() && is_well_filled(running.back());
  }));
  REQUIRE(running.size() >= 4);
  const nlohmann::json& row = running.back();
  CHECK(row.at("cells").size() == 13);
  CHECK(row.at("cells")[0].at("voltage_average_uV") > 3'500'000);
  CHECK(row.at("sensors")[0].at("temperature_average_dC").is_number());
  const Finished nobody = bench.ask({"history", "--cells", "1.1,9.9"});
  CHECK(nobody.status == 2);
  CHECK(nobody.err.find("--cells: found '9.9', which no pack in ") != std::string::npos);
  CHECK(row.at("soc_permille") == Approx(800).margin(20));
  CHECK(row.at("span_ms") >= 500);
  CHECK(bench.ask({"history"}).out.find("Session 1: demo 48s, 48 cells") != std::string::npos);
  CHECK(bench.ask({"status"}).out.find(bench.path) != std::string::npos);
  for (const std::string page : {"status", "--json status", "faults", "watch --seconds 10"}) {
    INFO(page);
    const Finished full =
        run_program({"/bin/sh", "-c", program("bmuctl") + " --socket " + bench.socket + " " + page + " >/dev/full"});
    CHECK(full.status == 1);
    CHECK(full.err == "bmuctl: cannot write: No space left on device\n");
  }
  const std::string events = bench.ask({"history", "--events"}).out;
  CHECK(events.find("module 1: serial number 1001") != std::string::npos);

  REQUIRE(bench.ends_whole([&] { bench.start(); }));
  CHECK_FALSE(std::filesystem::exists(bench.path + "-wal"));
  const auto after = bench.rows({"--file", bench.path});
  CHECK(after.size() > running.size());  // the current one was added at the end
  CHECK(bench.ask({"history", "--file", bench.path, "--events"}).out.find("shutting down") != std::string::npos);
  // In any output form a failed write is no success.
  for (const std::string form :
       {"history", "history --csv", "--json history", "history --events", "history --to -1d"}) {
    INFO(form);
    const Finished full = run_program(
        {"/bin/sh", "-c",
         program("bmuctl") + " --socket " + bench.socket + " " + form + " --file " + bench.path + " >/dev/full"});
    CHECK(full.status == 1);
    CHECK(full.err == "bmuctl: cannot write: No space left on device\n");
  }

  bench.start();
  REQUIRE(bench.has_rows(2));
  const auto second_life = bench.rows();
  CHECK(second_life.front().at("life") == 1);
  CHECK(second_life.back().at("life") >= 2);  // more if an end was not complete
}

TEST_CASE("who asks for the history while the daemon creates it is told that nothing is recorded yet",
          "[integration][daemon][history][bus][slow]") {
  HistoryBench bench;
  const auto ask = [&] { return bench.ask({"history", "--file", bench.path}); };
  // Until the first event is written, the file does not contain the length of a minute.
  const std::string begin = " recorded yet in " + bench.path + "; the first minute comes after ";
  const auto is_nothing = [&](const std::string& text, const std::string& nothing, const std::string& end) {
    return text == nothing + begin + "30 to 90 s" + end || text == nothing + begin + "0.5 to 1.5 s" + end;
  };
  for (int start = 0; start < 3; ++start) {
    bench.daemon = std::make_unique<Process>(bench.history_command(), ProcessOptions{.err_file = bench.log});
    Finished answer = ask();
    // From before the file exists until it contains a minute, as fast as answers come.
    while (answer.out.find("Session 1: ") == std::string::npos) {
      INFO(answer.err);
      INFO(answer.out);
      if (answer.status == 0) {
        REQUIRE(is_nothing(answer.out, "Nothing", ".\n"));
      } else {
        REQUIRE(answer.err.find("history.sqlite: no such file") != std::string::npos);
      }
      const Finished page = bench.ask({"report", bench.path, "--out", "-"});
      INFO(page.err);
      const bool is_missing = page.err.find("history.sqlite: no such file") != std::string::npos;
      REQUIRE((page.status == 0 || is_missing || is_nothing(page.err, "bmuctl: nothing", "\n")));
      REQUIRE(bench.daemon->wait(milliseconds(0)) == -1);
      answer = ask();
    }
    bench.daemon->signal(SIGTERM);
    REQUIRE(bench.daemon->wait(test::hang_max) == 0);
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(bench.path + end);
  }
}

TEST_CASE("in the first minute of a daemon its history has events, and no minute is no matter of the clock",
          "[integration][daemon][history][bus]") {
  HistoryBench bench(600);
  bench.start();
  const auto history = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"history", "--file", bench.path});
    return bench.ask(words);
  };
  REQUIRE(
      bench.becomes([&] { return history({"--events"}).out.find("module 1: serial number") != std::string::npos; }));
  const std::string sentence = " recorded yet in " + bench.path + "; the first minute comes after 300 to 900 s";
  for (const std::vector<std::string>& words : {std::vector<std::string>{}, {"--from", "begin"}}) {
    const Finished table = history(words);
    CHECK(table.status == 0);
    CHECK(table.out == "Nothing" + sentence + ".\n");
  }
  const Finished running = bench.ask({"history"});
  CHECK(running.status == 0);
  CHECK(running.out == "Nothing" + sentence + ".\n");
  const auto rows = bench.rows({"--file", bench.path});
  REQUIRE(rows.size() == 1);
  CHECK(rows.front() == nlohmann::json{{"nothing_recorded_yet", true}, {"path", bench.path}, {"period_s", 600}});
  CHECK(history({"--events", "--to", "-1d"}).out ==
        "No events in this span, and no minute yet in all of " + bench.path + ".\n");
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"report", bench.path}, {"report", bench.path, "--from", "begin"}}) {
    const Finished page = bench.ask(words);
    CHECK(page.status == 1);
    CHECK(page.err == "bmuctl: nothing" + sentence + "\n");
  }
}

TEST_CASE("killed in the middle, the history has all but the minute in hand", "[integration][daemon][history][bus]") {
  HistoryBench bench;
  bench.start();
  REQUIRE(bench.has_rows(3));
  const std::int64_t written = bench.told().at("rows_written");
  bench.daemon->signal(SIGKILL);
  REQUIRE(bench.daemon->wait(test::hang_max) == 128 + SIGKILL);
  const auto rows = bench.rows({"--file", bench.path});
  CHECK(static_cast<std::int64_t>(rows.size()) >= written);
  static_cast<void>(bench.listener.last());
  bench.start();
  REQUIRE(bench.has_rows(1));
  CHECK(static_cast<std::int64_t>(bench.rows().size()) > written);
}

TEST_CASE("a history that somebody else has locked is warned of, written again, and the loop keeps its time",
          "[integration][daemon][history][bus]") {
  HistoryBench bench;
  bench.start();
  REQUIRE(bench.has_rows(1));
  sqlite3* other = nullptr;
  REQUIRE(sqlite3_open(bench.path.c_str(), &other) == SQLITE_OK);
  const auto locked_at = std::chrono::steady_clock::now();
  REQUIRE(sqlite3_exec(other, "PRAGMA busy_timeout = 60000; BEGIN IMMEDIATE", nullptr, nullptr, nullptr) == SQLITE_OK);
  REQUIRE(bench.becomes([&] { return bench.told().at("state") == "failing"; }));
  CHECK(bench.has_logged("history: write failed: " + bench.path));
  CHECK(bench.becomes([&] {
    return bench.ask_json("status").at("faults_present").dump().find("history_write_failed") != std::string::npos;
  }));
  CHECK(bench.told().at("last_error").get<std::string>().find("locked") != std::string::npos);
  REQUIRE(sqlite3_exec(other, "ROLLBACK", nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(other);
  CHECK(bench.has_logged("history.sqlite: writing resumed"));
  CHECK(bench.becomes([&] { return bench.told().at("rows_waiting") == 0; }));
  // A row comes each second, and sixteen may be queued.
  const bool had_room = std::chrono::steady_clock::now() - locked_at < std::chrono::seconds(15);
  CHECK((bench.told().at("rows_lost") == 0 || !had_room));
  // The delay of the loop's decisions also depends on the machine. The tests of HistoryStore with a hanging disk verify
  // that it never waits for a disk.
}

TEST_CASE("a damaged history is put aside at the start and a new one begun", "[integration][daemon][history][bus]") {
  HistoryBench bench;
  const std::string spoiled(50'000, 'x');
  std::ofstream(bench.path) << spoiled;
  bench.start();
  REQUIRE(bench.has_rows(1));
  const std::string aside = bench.told().at("put_aside");
  CHECK(read_file(aside) == spoiled);
  CHECK(bench.has_logged("history: database damaged, moved to " + aside));
  CHECK_FALSE(bench.rows().empty());
}

TEST_CASE("without a state file, or with --history none, there not a history database",
          "[integration][daemon][history][bus]") {
  HistoryBench bench;
  SECTION("none by the option") {
    bench.start({"--state", bench.state, "--history", "none"});
  }
  SECTION("no state") {
    bench.start({});
  }
  CHECK(bench.told().is_null());
  CHECK_FALSE(std::filesystem::exists(bench.path));
  CHECK(bench.ask({"history", "--file", bench.path}).status == 1);
}

TEST_CASE("a history may lie elsewhere, but never under a name that says something else",
          "[integration][daemon][history][cli][bus]") {
  HistoryBench bench;
  const std::string other = bench.folder / "other.sqlite";
  bench.start({"--history", other});
  REQUIRE(bench.has_rows(1));
  CHECK(std::filesystem::exists(other));
  const Finished refused = run_program({program("bmud"), "--config", bench.pack, "--history", "/etc/passwd"});
  CHECK(refused.status == 2);
  CHECK(refused.err.find("--history: found '/etc/passwd', expected a name that ends in .sqlite") != std::string::npos);
  CHECK(refused.err.find("--history: --history") == std::string::npos);
}

TEST_CASE("bmuctl history says what is wrong with its words, and what is not there",
          "[integration][bmuctl][history][cli]") {
  const TemporaryFolder folder;
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {program("bmuctl"), "--socket", folder / "none.sock", "history"});
    return run_program(words);
  };
  const Finished bad_time = run({"--from", "tomorrow"});
  CHECK(bad_time.status == 2);
  CHECK(bad_time.err.find("found 'tomorrow', expected 2026-03-01 17:05") != std::string::npos);
  const Finished bad_cells = run({"--cells", "1.x"});
  CHECK(bad_cells.status == 2);
  CHECK(bad_cells.err.find("found '1.x', expected all, or numbers") != std::string::npos);
  const Finished backwards = run({"--from", "now", "--to", "-1h"});
  CHECK(backwards.status == 2);
  CHECK(backwards.err.find("--from is later than --to") != std::string::npos);
  const Finished missing = run({"--file", folder / "no.sqlite"});
  CHECK(missing.status == 1);
  CHECK(missing.err.find("no.sqlite: no such file") != std::string::npos);
  const Finished empty = run({"--file", folder.file("empty.sqlite", "")});
  CHECK(empty.status == 0);
  const std::string empty_file = folder / "empty.sqlite";
  CHECK(empty.out == "Nothing recorded yet in " + empty_file + "; the first minute comes after 30 to 90 s.\n");
  CHECK(run({"--csv", "--file", folder / "empty.sqlite"}).out.starts_with("time,sequence,"));
  const Finished none = run({"--file", folder.file("text.sqlite", std::string(5'000, 'x'))});
  CHECK(none.status == 1);
  CHECK(none.err.find("not a history database") != std::string::npos);
  CHECK(run({"--help"}).out.find("bmuctl history --from today") != std::string::npos);
}

TEST_CASE(
    "bmuctl history shows the minutes from before the clock was set where they were, and says how many have no time",
    "[integration][bmuctl][history][cli][clock]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  const HistoryLife life = test::life_of(1);
  const HistoryLife unset = test::life_of(1, "two");
  const auto write = [&path](const HistoryLife& of, std::int64_t set_from_minute) {
    HistoryFile file({.path = path}, of);
    std::vector<HistoryRow> rows;
    for (std::int64_t minute = 1; minute <= 10; ++minute) {
      rows.push_back(test::history_row(minute, of));
      if (minute < set_from_minute) rows.back().unix_time_ms = 20'000 + minute * test::minute_ms;
    }
    REQUIRE(file.write(rows, {}));
  };
  write(life, 6);
  write(unset, 11);
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {program("bmuctl"), "--socket", folder / "none.sock", "history", "--file", path});
    return run_program(words);
  };
  // One row per minute from 12:01 on.
  const Finished shown = run({"--csv", "--from", "2026-03-01T12:03:00Z"});
  CHECK(shown.status == 0);
  CHECK(std::count(shown.out.begin(), shown.out.end(), '\n') == 1 + 8);
  CHECK(shown.out.find("\n2026-03-01T12:03:00Z,3,") != std::string::npos);
  CHECK(shown.err.find("10 minutes may belong to this time range and are not shown") != std::string::npos);
  const Finished all = run({"--csv", "--from", "begin"});
  CHECK(std::count(all.out.begin(), all.out.end(), '\n') == 1 + 20);
  CHECK(all.out.find("1970-01-01T00:01:20Z,1,") != std::string::npos);
  CHECK(all.err.empty());
}

}  // namespace bmu
