// Data of a report: samples that become longer, columns, quantiles, times.
#include <cmath>

#include "tests/support/catch.hpp"
#include "tools/report/columns.hpp"
#include "tools/report/data.hpp"
#include "tools/report/time.hpp"

namespace bmu::report {

namespace {

constexpr std::int64_t s = 1'000'000;

/// One value per second, from a time on, in the given order; gaps by their index.
ReportData with_current(const std::vector<float>& values, std::int64_t from_s = 100) {
  ReportData data;
  data.sample_us = s;
  for (std::size_t i = 0; i < values.size(); ++i) {
    data.times_us.push_back((from_s + static_cast<std::int64_t>(i)) * s);
    data.current_A.add(values[i]);
    data.discharge_cause.add(values[i] > 2 ? "high" : "low");
  }
  return data;
}

}  // namespace

TEST_CASE("two samples become one with their mean and both extremes", "[unit][report]") {
  ReportData data = with_current({1, 3, not_known, 4, not_known, not_known, 7});
  halve(data);
  CHECK(data.sample_us == 2 * s);
  CHECK(data.times_us == std::vector<std::int64_t>{100 * s, 102 * s, 104 * s, 106 * s});
  CHECK(data.current_A.mean[0] == 2);
  CHECK(data.current_A.low[0] == 1);
  CHECK(data.current_A.high[0] == 3);
  CHECK(data.current_A.mean[1] == 4);
  CHECK(data.current_A.low[1] == 4);
  CHECK(std::isnan(data.current_A.mean[2]));
  CHECK(std::isnan(data.current_A.low[2]));
  CHECK(data.current_A.high[3] == 7);
  CHECK(data.discharge_cause.of_sample == std::vector<std::uint16_t>{0, 0, 0, 1});
  halve(data);
  CHECK(data.times_us == std::vector<std::int64_t>{100 * s, 104 * s});
  CHECK(data.current_A.low[0] == 1);
  CHECK(data.current_A.high[0] == 4);
}

TEST_CASE("samples of an odd second are joined with those of the even one before", "[unit][report]") {
  ReportData data = with_current({1, 2, 3}, 101);
  halve(data);
  CHECK(data.times_us == std::vector<std::int64_t>{100 * s, 102 * s});
  CHECK(data.current_A.mean == std::vector<float>{1, 2.5});
}

TEST_CASE("a sample that comes later than the next should is behind a gap", "[unit][report]") {
  ReportData data = with_current({1, 2, 3});
  CHECK_FALSE(data.has_gap_before(0));
  data.times_us[2] = 102 * s + s / 2;
  CHECK_FALSE(data.has_gap_before(2));
  data.times_us[2] += 1;
  CHECK(data.has_gap_before(2));
}

TEST_CASE("a last sample that is cut short ends where it was cut", "[unit][report]") {
  ReportData data = with_current({1, 2, 3});
  data.end_us = 102 * s + s / 5;
  CHECK(data.to_us() == 102 * s + s / 5);
  const Columns columns = columns_of(data);
  CHECK(columns.columns[1].at_us == 101 * s + s / 2);
  CHECK(columns.columns[2].at_us == 102 * s + s / 10);
}

TEST_CASE("few samples are a column each, many share them and lose no peak", "[unit][report]") {
  const Columns few = columns_of(with_current({1, 2, 3}));
  REQUIRE(few.columns.size() == 3);
  CHECK(few.columns[1].at_us == 101 * s + s / 2);

  std::vector<float> values(100'000, 1.0F);
  values[54'321] = 50;
  values[54'322] = not_known;
  values[77'777] = -9;
  ReportData data = with_current(values);
  const Columns many = columns_of(data);
  CHECK(many.columns.size() == columns_max);
  const Series series = reduced(data.current_A, many);
  REQUIRE(series.size() == many.columns.size());
  CHECK(*std::max_element(series.high.begin(), series.high.end()) == 50);
  CHECK(*std::min_element(series.low.begin(), series.low.end()) == -9);
  for (const Column& column : many.columns) CHECK_FALSE(column.has_gap_before);
  for (std::size_t i = 60'000; i < values.size(); ++i) data.times_us[i] += 3'600 * s;
  int gaps = 0;
  for (const Column& column : columns_of(data).columns) gaps += column.has_gap_before ? 1 : 0;
  CHECK(gaps == 1);
}

TEST_CASE("quantiles are of what is known, and extremes of the extremes", "[unit][report]") {
  std::vector<Series> cells(11);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto value = static_cast<float>(i);
    cells[i].add(value - 100, value, value + 100);
    cells[i].add(i < 3 ? value : not_known);
    cells[i].add(not_known);
  }
  CHECK(quantile(cells, 0.1)[0] == 1);
  CHECK(quantile(cells, 0.5)[0] == 5);
  CHECK(quantile(cells, 0.9)[0] == 9);
  CHECK(quantile(cells, 0)[0] == -100);
  CHECK(quantile(cells, 1)[0] == 110);
  CHECK(quantile(cells, 0.5)[1] == 1);
  CHECK(quantile(cells, 1)[1] == 2);
  CHECK(std::isnan(quantile(cells, 0.5)[2]));
  CHECK(std::isnan(quantile(cells, 0)[2]));
}

TEST_CASE("times of a page are UTC", "[unit][report]") {
  constexpr std::int64_t at_us = 1'772'384'709'250'000;
  CHECK(time_text(at_us) == "2026-03-01 17:05:09");
  CHECK(clock_text_ms(at_us) == "17:05:09.250");
  CHECK(stretch_text(at_us, at_us + 3 * s) == "2026-03-01 17:05:09 to 17:05:12 UTC");
  CHECK(stretch_text(at_us, at_us + 86'400 * s) == "2026-03-01 17:05:09 to 2026-03-02 17:05:09 UTC");
}

TEST_CASE("spans are told as exactly as a reader needs", "[unit][report]") {
  CHECK(span_text(100'000) == "0.1 s");
  CHECK(span_text(2'400'000) == "2.4 s");
  CHECK(span_text(303 * s) == "5 min 3 s");
  CHECK(span_text(3'600 * s) == "1 h");
  CHECK(span_text(103 * 3'600 * s) == "4 d 7 h");
}

TEST_CASE("ticks of time are round, and say the day where it changes", "[unit][report]") {
  const auto texts = [](std::int64_t from_s, std::int64_t to_s) {
    std::string all;
    for (const TimeTick& tick : time_ticks(from_s * s, to_s * s, 8)) all += tick.text + " ";
    return all;
  };
  constexpr std::int64_t noon_s = 1'772'366'400;  // 2026-03-01 12:00
  CHECK(texts(noon_s, noon_s + 1) == "12:00:00.0 12:00:00.2 12:00:00.4 12:00:00.6 12:00:00.8 12:00:01.0 ");
  CHECK(texts(noon_s + 1, noon_s + 60) == "12:00:10 12:00:20 12:00:30 12:00:40 12:00:50 12:01:00 ");
  CHECK(texts(noon_s - 3'600, noon_s + 3'600) == "11:00 11:20 11:40 12:00 12:20 12:40 13:00 ");
  CHECK(texts(noon_s, noon_s + 86'400) == "12:00 15:00 18:00 21:00 2 Mar 03:00 06:00 09:00 12:00 ");
  CHECK(texts(noon_s, noon_s + 8 * 86'400) == "2 Mar 3 Mar 4 Mar 5 Mar 6 Mar 7 Mar 8 Mar 9 Mar ");
  // For a span of any length there are a few.
  for (std::int64_t span_s = 1; span_s < 400'000'000; span_s = span_s * 5 / 2 + 1) {
    const std::size_t count = time_ticks(noon_s * s, (noon_s + span_s) * s, 8).size();
    INFO(span_s << " s: " << count);
    CHECK(count >= 3);
    CHECK(count <= 10);
  }
}

}  // namespace bmu::report
