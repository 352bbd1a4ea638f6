// A recording of a drive as the data of a report.
#include <algorithm>
#include <cmath>

#include "tests/support/catch.hpp"
#include "tests/support/recorded_run.hpp"
#include "tools/report/report_from_recording.hpp"

namespace bmu::report {

namespace {

using test::recorded_from_us;

constexpr std::int64_t s = 1'000'000;

/// Closes after a second, drives with 20 A, and opens because a cell falls; 12 s.
const std::string& drive() {
  static const std::string text = test::recorded_run(
      "0 pack soc_permille 800\n"
      "1 vehicle on\n"
      "+3 load current_A 20\n"
      "+3 cell 2.7 voltage_mV 2700\n",
      12s);
  return text;
}

struct Read {
  ReportData data;
  std::optional<RecordProblem> problem;
};

Read read(std::string_view text, RecordingOptions options = {.name = "drive.log"}) {
  RecordingReport reading(std::move(options));
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    if (!reading.take(text.substr(at, end - at))) break;
    at = end + 1;
  }
  const auto problem = reading.problem();
  return {std::move(reading).finish(), problem};
}

const SpanReport* find_span(const ReportData& data, SpanKind kind, std::string_view name) {
  const auto found = std::find_if(data.spans.begin(), data.spans.end(),
                                  [&](const SpanReport& span) { return span.kind == kind && span.name == name; });
  return found == data.spans.end() ? nullptr : &*found;
}

double seconds_at(std::int64_t at_us) {
  return static_cast<double>(at_us - recorded_from_us) / static_cast<double>(s);
}

}  // namespace

TEST_CASE("a recorded drive is told with its cells, currents and flows", "[unit][report][recording]") {
  const auto [data, problem] = read(drive());
  CHECK_FALSE(problem);
  CHECK(data.notes.empty());
  CHECK(data.pack_name == "demo 48s");
  CHECK(data.source == "the recording drive.log by bmud 0.1.0");
  REQUIRE(data.cells.size() == 48);
  CHECK(data.cells[18].name == "2.7");
  CHECK(data.cells[18].pack_number == 19);
  CHECK(data.sensors.size() == 16);
  CHECK(data.sample_us == 100'000);
  CHECK(data.times_us.size() == Approx(120).margin(1));
  CHECK(data.cells[18].voltage_V.size() == data.times_us.size());
  CHECK(data.discharge_cause.of_sample.size() == data.times_us.size());

  // At 6 s it drives.
  const std::size_t at = 60;
  CHECK(seconds_at(data.times_us[at]) == Approx(6.0));
  CHECK(data.current_A.mean[at] == Approx(20.0).margin(0.3));
  CHECK(data.cells[18].voltage_V.mean[at] > 3.7F);
  CHECK(data.pack_voltage_V.mean[at] / 48 == Approx(data.cells[0].voltage_V.mean[at]).margin(0.02));
  CHECK(data.sensors[0].temperature_C.mean[at] == Approx(25.0).margin(0.5));
  CHECK(data.soc_percent.mean[at] == Approx(80.0).margin(3.0));
  CHECK(data.soc_doubt_percent.mean[at] > 0.0F);
  CHECK(data.discharge_cause.texts[data.discharge_cause.of_sample[at]] == "peak");
  CHECK(data.discharge_cause.texts[data.discharge_cause.of_sample[2]] == "not connected");
  // 20 A for some 3 s of 190 V; the sum is exact, our idea of it is not.
  CHECK(data.energy_out_Wh.value_or(0) == Approx(20.0 * 190 * 3.3 / 3600).epsilon(0.2));
  CHECK(data.charge_out_Ah.value_or(0) == Approx(20.0 * 3.3 / 3600).epsilon(0.2));
  CHECK(data.cells[0].soc_percent.value == Approx(80.0).margin(3.0));
  CHECK(std::isnan(data.cells[0].resistance_mOhm.value));  // one step of the current is not enough
  CHECK(data.cells[0].bled_Ah == 0.0F);
}

TEST_CASE("a recorded fault, the phases and contactors are told from when to when", "[unit][report][recording]") {
  const ReportData data = read(drive()).data;
  const SpanReport* const fault = find_span(data, SpanKind::fault, "cell_undervoltage");
  REQUIRE(fault != nullptr);
  CHECK(fault->text == "a cell's voltage is too low");
  CHECK(fault->place == "cell 2.7 (no. 19)");
  CHECK(seconds_at(fault->from_us) == Approx(7.3).margin(0.3));
  CHECK(fault->goes_on);
  CHECK_FALSE(fault->has_begun_before);

  const SpanReport* const open = find_span(data, SpanKind::phase, "open");
  REQUIRE(open != nullptr);
  CHECK(open->has_begun_before);
  CHECK(seconds_at(open->from_us) == Approx(0.0).margin(0.02));
  CHECK(seconds_at(open->to_us) == Approx(2.0).margin(0.1));  // it is asked for after one, and watched for one
  const SpanReport* const closed = find_span(data, SpanKind::phase, "closed");
  REQUIRE(closed != nullptr);
  CHECK(closed->to_us == fault->from_us);
  const SpanReport* const contactor = find_span(data, SpanKind::contactor, "main positive");
  REQUIRE(contactor != nullptr);
  CHECK(contactor->from_us < closed->from_us);
  CHECK(contactor->to_us >= closed->to_us);
  CHECK_FALSE(contactor->goes_on);

  const auto told = std::find_if(data.events.begin(), data.events.end(), [](const EventReport& event) {
    return event.text.find("fault: a cell's voltage is too low") == 0;
  });
  REQUIRE(told != data.events.end());
  CHECK(told->at_us == fault->from_us);
}

TEST_CASE("between two times only what was then is told", "[unit][report][recording]") {
  const ReportData all = read(drive()).data;
  const ReportData data =
      read(drive(), {.name = "", .from_us = recorded_from_us + 5 * s, .to_us = recorded_from_us + 6 * s}).data;
  REQUIRE(data.times_us.size() == 10);
  CHECK(data.from_us() == recorded_from_us + 5 * s);
  CHECK(data.current_A.mean[3] == all.current_A.mean[53]);
  CHECK(data.charge_out_Ah.value_or(0) == Approx(20.0 / 3600).epsilon(0.05));
  CHECK(find_span(data, SpanKind::fault, "cell_undervoltage") == nullptr);
  const SpanReport* const closed = find_span(data, SpanKind::phase, "closed");
  REQUIRE(closed != nullptr);
  CHECK(closed->has_begun_before);
  CHECK(closed->goes_on);
  CHECK(data.events.empty());
  CHECK(read(drive(), {.name = "", .from_us = recorded_from_us + 3'600 * s}).data.is_empty());
}

TEST_CASE("a long recording has longer samples and no smaller peaks", "[unit][report][recording]") {
  const ReportData fine = read(drive()).data;
  const ReportData coarse = read(drive(), {.name = "", .samples_max = 20}).data;
  CHECK(coarse.times_us.size() < 20);
  CHECK(coarse.sample_us == 800'000);
  const auto lowest = [](const ReportData& data) {
    float value = 5.0F;
    for (const float low : data.cells[18].voltage_V.low) value = low < value ? low : value;
    return value;
  };
  CHECK(lowest(coarse) == lowest(fine));
  CHECK(std::is_sorted(coarse.times_us.begin(), coarse.times_us.end()));
  CHECK(std::adjacent_find(coarse.times_us.begin(), coarse.times_us.end()) == coarse.times_us.end());
  for (std::size_t i = 1; i < coarse.times_us.size(); ++i) CHECK_FALSE(coarse.has_gap_before(i));
}

TEST_CASE("a damaged recording is told as far as it is good", "[unit][report][recording]") {
  const std::string& whole = drive();
  std::string torn = whole;
  const std::size_t tick = torn.find(" tick ", torn.find("# (1700000006."));
  torn[tick + 1] = 'x';
  const auto [data, problem] = read(torn);
  REQUIRE(problem);
  CHECK(data.times_us.size() > 30);
  CHECK(data.times_us.size() < 110);
  REQUIRE(data.notes.size() == 1);
  CHECK(data.notes[0].find("The recording ends at line " + std::to_string(problem->line)) == 0);

  const auto [none, no_head] = read("(1700000000.000000) vcan0 143#11 R\n");
  CHECK(none.is_empty());
  CHECK(no_head);
  CHECK(read("").data.is_empty());
}

TEST_CASE("of a recording in parts, each is told, and what is between is a gap", "[unit][report][recording]") {
  // The same two seconds, once more an hour later.
  const std::string again = test::recorded_run("0 pack soc_permille 500\n", 2s);
  const std::string later = test::recorded_run("0 pack soc_permille 500\n", 2s, test::recorded_from_us + 3'600 * s);
  const auto [data, problem] = read(again + later);
  if (problem) FAIL(problem->line << ": " << problem->text);
  CHECK(data.times_us.size() == Approx(40).margin(2));
  int gaps = 0;
  for (std::size_t i = 1; i < data.times_us.size(); ++i) gaps += data.has_gap_before(i) ? 1 : 0;
  CHECK(gaps == 1);
  int open = 0;
  for (const SpanReport& span : data.spans) open += span.kind == SpanKind::phase && span.name == "open" ? 1 : 0;
  CHECK(open == 2);
  CHECK(data.notes.empty());
}

}  // namespace bmu::report
