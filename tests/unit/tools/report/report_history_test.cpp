// Report of a history: the content of its minutes, and nothing else.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "daemon/history/row_blob.hpp"
#include "tests/support/history_rows.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/report/from_history.hpp"

using namespace bmu;
using namespace bmu::report;
using test::history_begin_ms;
using test::history_row;
using test::life_of;
using test::minute_ms;

namespace {

constexpr std::int64_t us_per_ms = 1000;

/// Writes these minutes of a session into the history.
void fill(const std::string& path, const HistoryLife& life, std::int64_t first, std::int64_t last) {
  HistoryFile file({.path = path}, life);
  test::write_minutes(file, life, first, last);
}

ReportData report_of(const std::string& path, const HistoryOptions& options = {}) {
  auto history = HistoryReader::open(path);
  REQUIRE(history);
  return report_from_history(*history, options);
}

std::vector<SpanReport> spans_of(const ReportData& data, SpanKind kind) {
  std::vector<SpanReport> spans;
  std::copy_if(data.spans.begin(), data.spans.end(), std::back_inserter(spans),
               [&](const SpanReport& span) { return span.kind == kind; });
  return spans;
}

}  // namespace

TEST_CASE("a report of the history has a sample a minute with its extremes", "[unit][report][history][BMS_F.5]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  fill(path, life_of(2), 1, 30);
  const ReportData data = report_of(path);
  REQUIRE(data.times_us.size() == 30);
  CHECK(data.times_us.front() == (history_begin_ms + minute_ms) * us_per_ms);
  CHECK(data.sample_us == 60'000'000);
  CHECK(data.pack_name == "test pack");
  REQUIRE(data.cells.size() == 24);
  CHECK(data.cells[13].name == "2.2");
  CHECK(data.cells[13].pack_number == 14);
  // history_row(): 3.3 V, 0.1 mV a minute, 1 mV a cell, 2 mV around.
  CHECK(data.cells[13].voltage_V.mean[9] == Approx(3.3 + 0.001 + 0.013));
  CHECK(data.cells[13].voltage_V.low[9] == Approx(3.3 + 0.001 + 0.013 - 0.002));
  CHECK(data.cells[13].voltage_V.high[9] == Approx(3.3 + 0.001 + 0.013 + 0.002));
  CHECK(data.cells[13].health_percent.value == Approx(98.7));
  CHECK(std::isnan(data.cells[13].resistance_mOhm.value));
  CHECK(data.sensors.size() == 8);  // those of the cells, not of the boards
  CHECK(data.current_A.high[4] == Approx(20.005));
  CHECK(data.discharge_limit_A.mean[0] == Approx(80.0));
  CHECK(data.discharge_cause.texts.at(data.discharge_cause.of_sample[0]) == "continuous");
  REQUIRE(data.energy_out_Wh);
  CHECK(*data.energy_out_Wh == Approx(30 * 5.833));
  CHECK_FALSE(data.energy_in_Wh);
  CHECK(data.energy_left_Wh.value == Approx(4'199.97));  // of the last minute
  CHECK(data.energy_left_Wh.doubt == Approx(180.0));
  CHECK(data.events.size() == 30);
}

TEST_CASE("warnings of a minute and phases are spans of the report", "[unit][report][history]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  fill(path, life_of(1), 1, 25);
  const ReportData data = report_of(path);
  std::size_t warnings = 0;
  for (const SpanReport& span : data.spans) {
    if (span.kind == SpanKind::phase) {
      CHECK(span.text == "closed");
      CHECK(span.has_begun_before);
      CHECK(span.goes_on);
      CHECK(span.from_us == (history_begin_ms + minute_ms) * us_per_ms);
      CHECK(span.to_us == (history_begin_ms + 26 * minute_ms) * us_per_ms);
    } else if (span.kind == SpanKind::warning) {
      ++warnings;
      const bool is_cell = span.name == "cell_undervoltage";
      // history_event(): the warning of the disk is reported at the end of the minute.
      CHECK(span.to_us - span.from_us == (is_cell ? minute_ms * us_per_ms : 0));
      CHECK_FALSE(span.goes_on);
      if (is_cell) CHECK(span.text == "cell voltage too low");
    }
  }
  CHECK(warnings == 4);  // two of them in the tenth and in the twentieth minute
}

TEST_CASE("what does not belong into the span, or to the pack, is left out", "[unit][report][history]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  fill(path, life_of(3, "other"), 1, 5);
  fill(path, life_of(1), 10, 20);
  const ReportData all = report_of(path);
  CHECK(all.times_us.size() == 11);
  CHECK(all.cells.size() == 12);
  REQUIRE(all.notes.size() == 1);
  CHECK(all.notes[0] == "5 rows of a pack with other modules are left out.");
  const ReportData part = report_of(path, {.from_us = (history_begin_ms + 12 * minute_ms) * us_per_ms,
                                           .to_us = (history_begin_ms + 15 * minute_ms) * us_per_ms});
  CHECK(part.times_us.size() == 3);
  CHECK(report_of(path, {.from_us = (history_begin_ms + 500 * minute_ms) * us_per_ms}).is_empty());
}

TEST_CASE("minutes that are missing are a gap, in which nothing goes on", "[unit][report][history]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  {
    const HistoryLife life = life_of(1);
    HistoryFile file({.path = path}, life);
    test::write_minutes(file, life, 1, 5);
    test::write_minutes(file, life, 50, 55);
  }
  const ReportData data = report_of(path);
  REQUIRE(data.times_us.size() == 11);
  CHECK(data.has_gap_before(5));
  const auto phases = spans_of(data, SpanKind::phase);
  REQUIRE(phases.size() == 2);
  CHECK(phases[0].goes_on);
  CHECK(phases[1].has_begun_before);
  REQUIRE(data.holes.size() == 1);
  CHECK(data.holes[0].from_us == (history_begin_ms + 6 * minute_ms) * us_per_ms);
  CHECK(data.holes[0].to_us == (history_begin_ms + 50 * minute_ms) * us_per_ms);
  CHECK(data.holes[0].text == "the clock was set forward");  // by its number the row is the next
}

// --- events within the minutes --------------------------------------------------------------------------------------

namespace {

/// Daemon that started 12.5 s before a full minute: rows of 12.5 s, 60 s, 60 s and 20 s.
struct ShortLife {
  HistoryLife life = life_of(1);
  std::vector<HistoryRow> rows;
  std::vector<HistoryEvent> events;

  void add_row(std::int64_t span_ms, const std::string& phase, std::int64_t closed_ms) {
    HistoryRow row = history_row(1, life);
    const std::int64_t begin_ms = rows.empty() ? 0 : *rows.back().uptime_ms;
    row.unix_time_ms = history_begin_ms + begin_ms;
    row.span_ms = span_ms;
    row.uptime_ms = begin_ms + span_ms;
    row.phase = phase;
    row.closed_ms = closed_ms;
    row.faults = row.warnings = "";
    rows.push_back(row);
  }
  void add_event(std::int64_t at_ms, const std::string& name, const std::string& text, const std::string& fault = "") {
    events.push_back({.number = static_cast<std::int64_t>(events.size()) + 1,
                      .unix_time_ms = history_begin_ms + at_ms,
                      .uptime_ms = at_ms,
                      .severity = "info",
                      .name = name,
                      .fault = fault,
                      .text = text});
  }
  void move(std::int64_t at_ms, const std::string& from, const std::string& to) {
    add_event(at_ms, "phase_changed", "contactors: " + from + " -> " + to);
  }
  [[nodiscard]] ReportData report() const {
    const TemporaryFolder folder;
    const std::string path = folder / "history.sqlite";
    {
      HistoryFile file({.path = path}, life);
      REQUIRE(file.write(rows, events));
    }
    return report_of(path);
  }
};

/// "open 0-12000 closed 12000-60000" in ms since the start; "~" with the duration if the time is unknown.
std::string told(const ReportData& data, SpanKind kind) {
  std::string text;
  for (const SpanReport& span : spans_of(data, kind)) {
    const auto ms = [&](std::int64_t at_us) { return std::to_string((at_us - data.from_us()) / us_per_ms); };
    text += (text.empty() ? "" : ", ") + span.name + " " + ms(span.from_us) + "-" + ms(span.to_us);
    if (span.lasted_us) text += " ~" + std::to_string(*span.lasted_us / us_per_ms);
  }
  return text;
}

}  // namespace

TEST_CASE("within a minute the contactors move when the events say, and the rest agrees with the rows",
          "[unit][report][history]") {
  ShortLife pack;
  pack.add_row(12'500, "open", 4'380);
  pack.add_row(60'000, "closed", 30'010);
  pack.add_row(60'000, "closed", 60'000);
  pack.add_row(20'000, "open", 5'020);
  pack.move(2'000, "open", "main negative");
  pack.move(2'100, "main negative", "precharge");
  pack.move(2'600, "precharge", "main positive");
  pack.move(2'700, "main positive", "closed");
  pack.move(7'000, "closed", "open");
  pack.move(42'400, "open", "main positive");
  pack.move(42'500, "main positive", "closed");
  pack.move(137'500, "closed", "open");
  const ReportData data = pack.report();
  CHECK(told(data, SpanKind::phase) ==
        "open 0-2000, main negative 2000-2100, precharge 2100-2600, main positive 2600-2700, closed 2700-7000, "
        "open 7000-42400, main positive 42400-42500, closed 42500-137500, open 137500-152500");
  CHECK(told(data, SpanKind::contactor) == "main contactors 2600-7000, main contactors 42400-137500");
  CHECK(data.to_us() - data.from_us() == 152'500 * us_per_ms);
  CHECK(data.covered_us == 152'500 * us_per_ms);
  CHECK(data.holes.empty());
  const auto phases = spans_of(data, SpanKind::phase);
  CHECK(phases.front().has_begun_before);
  CHECK_FALSE(phases[4].goes_on);
  CHECK(phases.back().goes_on);
  CHECK_FALSE(spans_of(data, SpanKind::contactor).back().goes_on);
}

TEST_CASE("rows whose times were cut to milliseconds each for itself join all the same", "[unit][report][history]") {
  ShortLife pack;
  pack.add_row(12'500, "closed", 12'500);
  pack.add_row(60'000, "closed", 60'000);
  pack.add_row(60'000, "closed", 60'000);
  std::int64_t later_ms = 1;
  SECTION("a millisecond is too much") {
    later_ms = 1;
  }
  SECTION("a millisecond is missing") {
    later_ms = -1;
  }
  for (HistoryRow& row : pack.rows) row.faults = "cell_undervoltage";
  *pack.rows[1].span_ms -= later_ms;
  const ReportData data = pack.report();
  CHECK(spans_of(data, SpanKind::phase).size() == 1);
  CHECK(told(data, SpanKind::contactor) == "main contactors 0-132500");
  CHECK(spans_of(data, SpanKind::fault).size() == 1);
}

TEST_CASE("rows that are further apart than times are cut do not join", "[unit][report][history]") {
  ShortLife pack;
  pack.add_row(60'000, "closed", 60'000);
  pack.add_row(60'000, "closed", 60'000);
  *pack.rows[1].span_ms -= 2;
  CHECK(spans_of(pack.report(), SpanKind::phase).size() == 2);
}

TEST_CASE("without events one move in a minute is placed by its figures, and more are not guessed",
          "[unit][report][history]") {
  ShortLife pack;
  pack.add_row(47'440, "open", 32'030);  // closed and opened again
  pack.add_row(60'000, "closed", 20'000);
  pack.add_row(60'000, "closed", 50'000);  // opened and closed again
  pack.add_row(60'000, "open", 15'000);
  SECTION("there are none") {}
  SECTION("one of them is lost") {
    pack.move(10'000, "precharge", "closed");
    pack.move(40'000, "closed", "open");
  }
  SECTION("they are of something else") {
    pack.move(10'000, "open", "closed");
    pack.move(11'000, "closed", "open");
  }
  const ReportData data = pack.report();
  CHECK(told(data, SpanKind::phase) ==
        "not known 0-47440, open 47440-87440, closed 87440-107440, not known 107440-167440, closed 167440-182440, "
        "open 182440-227440");
  CHECK(told(data, SpanKind::contactor) ==
        "main contactors 0-47440 ~32030, main contactors 87440-107440, main contactors 107440-167440 ~50000, "
        "main contactors 167440-182440");
}

TEST_CASE("a fault of a minute is there from its event to its event, and then no warning", "[unit][report][history]") {
  ShortLife pack;
  pack.add_row(60'000, "open", 0);
  pack.add_row(60'000, "open", 0);
  pack.add_row(60'000, "open", 0);
  pack.rows[0].faults = "cell_undervoltage,disk_low";
  pack.rows[0].warnings = "cell_undervoltage";
  pack.rows[1].faults = pack.rows[1].warnings = "cell_undervoltage";
  pack.rows[2].faults = "cell_undervoltage";
  pack.add_event(5'000, "fault_warned", "warning: a cell", "cell_undervoltage");
  pack.add_event(7'000, "fault_confirmed", "fault: a cell", "cell_undervoltage");
  pack.add_event(8'000, "fault_confirmed", "fault: disk", "disk_low");
  pack.add_event(9'000, "fault_cleared", "fault cleared: disk", "disk_low");
  pack.add_event(150'000, "fault_cleared", "fault cleared: a cell", "cell_undervoltage");
  const ReportData data = pack.report();
  // A fault is the same in the log and in the row, whether it opens or, like that of the disk, only warns: here, too.
  CHECK(told(data, SpanKind::fault) == "cell_undervoltage 7000-150000, disk_low 8000-9000");
  CHECK(told(data, SpanKind::warning) == "cell_undervoltage 5000-7000");
  for (const SpanReport& span : data.spans) CHECK(span.has_begun_before == (span.kind == SpanKind::phase));
}

TEST_CASE("rows that cannot be read are named by their numbers", "[unit][report][history]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  fill(path, life_of(1), 1, 20);
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  for (const std::int64_t minute : {8, 9, 10, 15}) {
    const std::size_t at = bytes.find(blob_of(history_row(minute, life_of(1)).cells));
    REQUIRE(at != std::string::npos);
    bytes[at + 5] = static_cast<char>(bytes[at + 5] ^ 1);
  }
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
  const ReportData data = report_of(path);
  CHECK(data.times_us.size() == 16);
  REQUIRE(data.holes.size() == 2);
  CHECK(data.holes[0].text == "rows 8 to 10 are missing or cannot be read");
  CHECK(data.holes[1].text == "row 15 is missing or cannot be read");
  CHECK(data.notes == std::vector<std::string>{"minute 8 to 10: checksum mismatch", "minute 15: checksum mismatch"});
}

TEST_CASE("between two lives of the daemon nothing is known", "[unit][report][history]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  for (const std::string token : {"one", "two"}) {
    HistoryLife life = life_of(1, token);
    HistoryFile file({.path = path}, life);
    HistoryRow row = history_row(1, life);
    if (token == "two") *row.unix_time_ms += 5 * minute_ms;
    row.warnings = "disk_low";
    REQUIRE(file.write({&row, 1}, {}));
  }
  const ReportData data = report_of(path);
  REQUIRE(data.holes.size() == 1);
  CHECK(data.holes[0].text == "the daemon did not run, or its last row was not kept");
  CHECK(data.holes[0].to_us.value_or(0) - data.holes[0].from_us.value_or(0) == 4 * minute_ms * us_per_ms);
  const auto warnings = spans_of(data, SpanKind::warning);
  REQUIRE(warnings.size() == 2);
  CHECK(warnings[0].goes_on);
  CHECK(warnings[1].has_begun_before);
}

// --- a clock that is set --------------------------------------------------------------------------------------------

namespace {

/// Ten minutes of a session and their events, with a clock that is ahead of the daemon's time by this until the sixth,
/// and then as in other tests.
ReportData report_of_clock(std::int64_t ahead_before_ms, const HistoryOptions& options = {}) {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  const HistoryLife life = life_of(1);
  {
    HistoryFile file({.path = path}, life);
    std::vector<HistoryRow> rows;
    std::vector<HistoryEvent> events;
    for (std::int64_t minute = 1; minute <= 10; ++minute) {
      const std::int64_t ahead_ms = minute < 6 ? ahead_before_ms : history_begin_ms;
      rows.push_back(history_row(minute, life));
      rows.back().unix_time_ms = ahead_ms + (minute - 1) * minute_ms;
      events.push_back(test::history_event(minute));
      events.back().unix_time_ms = ahead_ms + minute * minute_ms;
    }
    REQUIRE(file.write(rows, events));
  }
  return report_of(path, options);
}

}  // namespace

TEST_CASE("the setting of a history's clock is no hole, and is noted once with its size",
          "[unit][report][history][clock]") {
  const auto check = [](const ReportData& data, const std::string& note) {
    CHECK(data.holes.empty());
    REQUIRE(data.notes.size() == 1);
    CHECK(data.notes[0].find(note) == 0);
    REQUIRE(data.times_us.size() == 10);
    REQUIRE(data.events.size() == 10);
    for (std::size_t i = 0; i < 10; ++i) {
      const auto minute = static_cast<std::int64_t>(i);
      CHECK(data.times_us[i] == (history_begin_ms + minute * minute_ms) * us_per_ms);
      CHECK(data.events[i].at_us == (history_begin_ms + (minute + 1) * minute_ms) * us_per_ms);
    }
    CHECK(spans_of(data, SpanKind::phase).size() == 1);
  };
  // A host without a battery-backed clock, 12 s after its start; an hour ahead, and behind.
  check(report_of_clock(12'000), "The clock was set forward by ");
  CHECK(report_of_clock(12'000).notes[0].find(", for the first time since the computer started; ") !=
        std::string::npos);
  check(report_of_clock(history_begin_ms + 3'600'000), "The clock was set back by 1 h before ");
  check(report_of_clock(history_begin_ms - 3'600'000), "The clock was set forward by 1 h before ");
  // Half a second is a normal clock correction.
  CHECK(report_of_clock(history_begin_ms - 500).notes.empty());
}
