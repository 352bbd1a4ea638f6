// A page of the history: what the minutes say, and nothing else.
#include <cmath>
#include <string>

#include "tests/support/history_rows.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/report/report_from_history.hpp"

using namespace bmu;
using namespace bmu::report;
using test::history_begin_ms;
using test::history_row;
using test::life_of;
using test::minute_ms;

namespace {

constexpr std::int64_t us_per_ms = 1000;

ReportData report_of(const std::string& path, const HistoryOptions& options = {}) {
  auto history = HistoryReader::open(path);
  REQUIRE(history);
  return report_from_history(*history, options);
}

}  // namespace

TEST_CASE("a report of the history has a sample a minute with its extremes", "[unit][report][history][BMS_F.5]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  {
    const HistoryLife life = life_of(2);
    HistoryFile file({.path = path}, life);
    test::write_minutes(file, life, 1, 30);
  }
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
  CHECK(data.events.size() == 30);
}

TEST_CASE("warnings of a minute and phases are spans of the report", "[unit][report][history]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  {
    const HistoryLife life = life_of(1);
    HistoryFile file({.path = path}, life);
    test::write_minutes(file, life, 1, 25);
  }
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
      CHECK(span.to_us - span.from_us == minute_ms * us_per_ms);
      CHECK_FALSE(span.goes_on);
      if (span.name == "cell_undervoltage") CHECK(span.text == "a cell's voltage is too low");
    }
  }
  CHECK(warnings == 4);  // two of them in the tenth and in the twentieth minute
}

TEST_CASE("what does not belong into the span, or to the pack, is left out", "[unit][report][history]") {
  const TemporaryFolder folder;
  const std::string path = folder / "history.sqlite";
  {
    const HistoryLife other = life_of(3, "other");
    HistoryFile file({.path = path}, other);
    test::write_minutes(file, other, 1, 5);
  }
  {
    const HistoryLife life = life_of(1);
    HistoryFile file({.path = path}, life);
    test::write_minutes(file, life, 10, 20);
  }
  const ReportData all = report_of(path);
  CHECK(all.times_us.size() == 11);
  CHECK(all.cells.size() == 12);
  REQUIRE(all.notes.size() == 1);
  CHECK(all.notes[0] == "5 minutes of a pack with other modules are left out.");
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
  std::size_t phases = 0;
  for (const SpanReport& span : data.spans) phases += span.kind == SpanKind::phase ? 1 : 0;
  CHECK(phases == 2);
}
