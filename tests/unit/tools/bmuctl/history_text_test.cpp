// Times and cells on the bmuctl command line, and the text of rows.
#include "tools/bmuctl/history_text.hpp"

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "tests/support/history_rows.hpp"
#include "tools/bmuctl/cell_choice.hpp"
#include "tools/bmuctl/time_words.hpp"

namespace bmu {

using test::history_begin_ms;
using test::history_event;
using test::history_row;
using test::life_of;

namespace {

/// Sets the time zone two hours east of Greenwich, whatever the zone of this host.
struct EastOfGreenwich {
  EastOfGreenwich() {
    const char* zone = std::getenv("TZ");  // NOLINT(concurrency-mt-unsafe): one thread
    if (zone != nullptr) before = zone;
    ::setenv("TZ", "TEST-2", 1);  // NOLINT(concurrency-mt-unsafe)
    ::tzset();
  }
  EastOfGreenwich(const EastOfGreenwich&) = delete;
  EastOfGreenwich& operator=(const EastOfGreenwich&) = delete;
  ~EastOfGreenwich() {
    if (before.empty()) {
      ::unsetenv("TZ");  // NOLINT(concurrency-mt-unsafe)
    } else {
      ::setenv("TZ", before.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    }
    ::tzset();
  }
  std::string before;
};

std::size_t fields_in(const std::string& line) {
  return static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
}

HistoryRow placed(std::int64_t minute, const HistoryLife& life) {
  HistoryRow row = history_row(minute, life);
  row.sequence = minute;
  row.life = life.id;
  return row;
}

}  // namespace

TEST_CASE("times are taken as people write them", "[unit][history][ctl]") {
  const EastOfGreenwich zone;
  constexpr std::int64_t now = history_begin_ms + 1'234;  // 2026-03-01 12:00:01 UTC, 14:00:01 here
  constexpr std::int64_t hour_ms = 3'600'000;
  CHECK(time_from_words("now", now) == now);
  CHECK(time_from_words("-90s", now) == now - 90'000);
  CHECK(time_from_words("-30min", now) == now - hour_ms / 2);
  CHECK(time_from_words("-2h", now) == now - 2 * hour_ms);
  CHECK(time_from_words("-7d", now) == now - 7 * 24 * hour_ms);
  CHECK(time_from_words("today", now) == history_begin_ms - 14 * hour_ms);
  CHECK(time_from_words("yesterday", now) == history_begin_ms - 38 * hour_ms);
  CHECK(time_from_words("2026-03-01", now) == history_begin_ms - 14 * hour_ms);
  CHECK(time_from_words("2026-03-01 14:00", now) == history_begin_ms);
  CHECK(time_from_words("2026-03-01T14:00:05", now) == history_begin_ms + 5'000);
  CHECK(time_from_words("2026-03-01T12:00:00Z", now) == history_begin_ms);
  CHECK(time_from_words("2024-02-29", now).has_value());
  CHECK(time_from_words("2026-03-01 12:00Z", now) == history_begin_ms);
  CHECK(time_from_words("2026-03-01 17:30+05:30", now) == history_begin_ms);
  CHECK(time_from_words("2026-03-01T09:00:00-03:00", now) == history_begin_ms);
  CHECK(local_time_text(history_begin_ms) == "2026-03-01 14:00:00+02:00");
  CHECK(utc_time_text(history_begin_ms) == "2026-03-01T12:00:00Z");
}

TEST_CASE("what is shown as a time is taken as one", "[unit][history][report][ctl]") {
  const EastOfGreenwich zone;
  CHECK(time_from_words(local_time_text(history_begin_ms), 0) == history_begin_ms);
  CHECK(time_from_words(utc_time_text(history_begin_ms), 0) == history_begin_ms);
}

TEST_CASE("a span of time may have no begin, and does not run backwards", "[unit][history][report][ctl]") {
  const EastOfGreenwich zone;
  constexpr std::int64_t now = history_begin_ms;
  const auto all = time_span_from_words("begin", "", now);
  REQUIRE(all);
  CHECK_FALSE(all->from_unix_ms);
  CHECK_FALSE(all->to_unix_ms);
  const auto hour = time_span_from_words("-1h", "now", now);
  REQUIRE(hour);
  CHECK(hour->from_unix_ms == now - 3'600'000);
  CHECK(hour->to_unix_ms == now);
  CHECK(time_span_from_words("now", "now", now));
  const auto error_of = [](const auto& span) { return span ? std::string() : span.error(); };
  CHECK(error_of(time_span_from_words("now", "-1h", now)) == "--from is later than --to");
  CHECK(error_of(time_span_from_words("tomorrow", "", now)).find("--from: found 'tomorrow', expected 2026-") == 0);
  CHECK(error_of(time_span_from_words("", "begin", now)).find("--to: found 'begin', expected ") == 0);
}

TEST_CASE("what is no time is none", "[unit][history][ctl]") {
  for (const char* text : {"",
                           "begin",
                           "2026-03-01 12:00z",
                           "2026-03-01 12:00+5:30",
                           "2026-03-01 12:00+05",
                           "2026-03-01 12:00+15:00",
                           "2026-03-01 12:00+05:60",
                           "2026-03-01 12:00+05:30Z",
                           "-",
                           "-2",
                           "-h",
                           "-2x",
                           "--2h",
                           "2h",
                           "-99999999999999999999h",
                           "-9999999999h",
                           "2026",
                           "2026-3-1",
                           "2026-13-01",
                           "2026-02-29",
                           "2026-02-31",
                           "2026-03-01 25:00",
                           "2026-03-01 12:60",
                           "2026-03-01 12",
                           "2026-03-01T12:00:00X",
                           "2026-03-01 12:00 ",
                           "tomorrow",
                           "1969-12-31",
                           "2026-03-01 -1:00"}) {
    INFO("'" << text << "'");
    CHECK_FALSE(time_from_words(text, history_begin_ms).has_value());
  }
}

TEST_CASE("cells are chosen by their number, by their place, or all of a module", "[unit][history][ctl]") {
  const std::vector<HistoryPlace> cells = life_of(3).layout.cells();
  const auto numbers = [&](const char* text) {
    std::vector<std::int64_t> all;
    for (const HistoryPlace& cell : chosen(cell_choice_from(text).value(), cells)) all.push_back(cell.number);
    return all;
  };
  CHECK(numbers("19") == std::vector<std::int64_t>{19});
  CHECK(numbers("2.7") == std::vector<std::int64_t>{19});
  CHECK(numbers("2.*") == test::count(13, 24));
  CHECK(numbers("all") == test::count(1, 36));
  CHECK(numbers("30,1.3,2.7,19") == std::vector<std::int64_t>{3, 19, 30});
  CHECK(numbers("77").empty());
  for (const char* text : {"", ",", "1,", "0", "x", "1.x", "*.1", "1.2.3", "1 ,2", "-1", "1.", ".1", "*"}) {
    INFO("'" << text << "'");
    CHECK_FALSE(cell_choice_from(text).has_value());
  }
}

TEST_CASE("CSV has a field for each name, and none where nothing was known", "[unit][history][ctl]") {
  HistoryLife life = life_of(2);
  const std::vector<HistoryPlace> cells = chosen(*cell_choice_from("1.3,2.1"), life.layout.cells());
  const std::vector<HistoryPlace> sensors = life.layout.sensors();
  const std::string head = csv_head(cells, sensors);
  const std::string line = csv_line(placed(5, life), life.layout, cells, sensors);
  CHECK(fields_in(head) == fields_in(line));
  CHECK(head.starts_with("time,sequence,life,unix_time_ms,span_ms,"));
  CHECK(head.find(",cell_1.3_voltage_average_uV,") != std::string::npos);
  CHECK(head.find(",board_2.4_temperature_max_dC,") != std::string::npos);
  CHECK(line.starts_with("2026-03-01T12:05:00Z,5,0,"));
  CHECK(line.find(",3302500,3300500,3304500,600,5,987,,2,") != std::string::npos);  // cell 1.3
  CHECK(head.ends_with("\n"));

  // A pack with one module less at that time: the positions are empty.
  const HistoryLife smaller = life_of(1);
  const std::string short_line = csv_line(placed(5, smaller), smaller.layout, cells, sensors);
  CHECK(fields_in(short_line) == fields_in(head));
  HistoryRow empty;
  CHECK(csv_line(empty, {}, {}, {}).find("0,,,,,") != std::string::npos);
}

TEST_CASE("texts with commas, quotes or control characters cannot break a line of CSV or a terminal",
          "[unit][history][ctl]") {
  const HistoryLife life = life_of(1);
  HistoryRow row = placed(10, life);
  CHECK(csv_line(row, life.layout, {}, {}).find("\"cell_undervoltage,disk_low\"") != std::string::npos);
  HistoryEvent event = history_event(1);
  event.text = "say \"no\"\n\x1b[2J\xC2\x9B";
  const std::string line = csv_line(event);
  CHECK(std::count(line.begin(), line.end(), '\n') == 1);
  CHECK(line.find("\"say \"\"no\"\"??[2J") != std::string::npos);
  row.faults = "\x1b]0;title\x07";
  HistoryTable table({});
  table.add(row, life);
  table.add(event);
  const std::string page = table.page().text(false);
  CHECK(page.find('\x1b') == std::string::npos);
  CHECK(page.find('\x9B') == std::string::npos);
  CHECK_FALSE(nlohmann::json::parse(json_line(event)).is_discarded());
  event.text = "\xFF\xFE";
  CHECK_FALSE(nlohmann::json::parse(json_line(event)).is_discarded());
}

TEST_CASE("a line of JSON has the numbers, null for what was not known, and the cells that were asked for",
          "[unit][history][ctl]") {
  const HistoryLife life = life_of(2);
  const auto json = nlohmann::json::parse(json_line(
      placed(10, life), chosen(*cell_choice_from("2.1"), life.layout.cells()), {life.layout.sensors().back()}));
  CHECK(json.at("time") == "2026-03-01T12:10:00Z");
  CHECK(json.at("current_average_mA") == 1'010);
  CHECK(json.at("link_voltage_average_mV").is_null());
  CHECK(json.at("warnings") == nlohmann::json::array({"cell_undervoltage", "disk_low"}));
  CHECK(json.at("faults") == nlohmann::json::array());
  REQUIRE(json.at("cells").size() == 1);
  CHECK(json.at("cells")[0].at("module") == 2);
  CHECK(json.at("cells")[0].at("number") == 13);
  CHECK(json.at("cells")[0].at("voltage_average_uV") == 3'313'000);
  CHECK(json.at("cells")[0].at("health_by_resistance_permille").is_null());
  CHECK(json.at("sensors")[0].at("is_board") == true);
  CHECK_FALSE(nlohmann::json::parse(json_line(placed(1, life), {}, {})).contains("cells"));
}

TEST_CASE("a history without minutes names its file and when the first minute comes", "[unit][history][ctl]") {
  CHECK(recorded_yet_text("a.sqlite", 60) == "recorded yet in a.sqlite; the first minute comes after 30 to 90 s");
  CHECK(recorded_yet_text("a.sqlite", 1) == "recorded yet in a.sqlite; the first minute comes after 0.5 to 1.5 s");
  CHECK(nothing_json_line("a.sqlite", 60) == "{\"nothing_recorded_yet\":true,\"path\":\"a.sqlite\",\"period_s\":60}\n");
}

TEST_CASE("the table has a line a minute under a heading for each life, and shows what was wrong",
          "[unit][history][ctl]") {
  HistoryLife one = life_of(2);
  one.id = 1;
  HistoryLife two = life_of(2);
  two.id = 2;
  HistoryTable table({});
  table.add(placed(9, one), one);
  table.add(placed(10, one), one);
  table.add(placed(1, two), two);
  const std::string page = table.page().text(false);
  CHECK(page.find("Session 1: test pack, 24 cells, bmud 0.1.0") != std::string::npos);
  CHECK(page.find("Session 2:") != std::string::npos);
  two.pack_name = "";
  two.version = "?";
  HistoryTable damaged({});
  damaged.add(placed(1, two), two);
  CHECK(damaged.page().text(false).find("Session 2: pack unknown, 24 cells") != std::string::npos);
  CHECK(page.find("cell_undervoltage,disk_low") != std::string::npos);
  CHECK(page.find("driving") != std::string::npos);
  CHECK(page.find("20.0") != std::string::npos);    // the highest current
  CHECK(page.find("3.3129") == std::string::npos);  // cell 2.1 in minute 9
  HistoryTable with_cells(chosen(*cell_choice_from("2.1,77"), one.layout.cells()));
  with_cells.add(placed(9, one), one);
  const std::string cells_page = with_cells.page().text(false);
  CHECK(cells_page.find("2.1 V") != std::string::npos);
  CHECK(cells_page.find("3.3129") != std::string::npos);
}

}  // namespace bmu
