// Recording of a drive as the data of a report.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/catch.hpp"
#include "tests/support/recorded_run.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tools/report/from_recording.hpp"
#include "tools/report/holes.hpp"
#include "tools/report/recording_files.hpp"

namespace bmu::report {

namespace {

using test::recorded_from_us;

constexpr std::int64_t s = 1'000'000;

/// Closes after a second, drives with 20 A, and opens because the voltage of a cell falls; 12 s.
constexpr std::string_view drive_script =
    "0 pack soc_permille 800\n"
    "1 vehicle on\n"
    "+3 load current_A 20\n"
    "+3 cell 2.7 voltage_mV 2700\n";

const std::string& drive() {
  static const std::string text = test::recorded_run(drive_script, 12s);
  return text;
}

/// The same, with a new part every 2.5 s.
const std::string& drive_in_parts() {
  static const std::string text = test::recorded_run(drive_script, {.length = 12s, .part_length = 2500ms});
  return text;
}

/// Recording an hour later.
const std::string& later_drive() {
  static const std::string text =
      test::recorded_run("0 pack soc_permille 500\n", {.length = 3s, .from_us = recorded_from_us + 3'600 * s});
  return text;
}

/// Report data of files, read in this order.
ReportData read_files(const std::vector<std::pair<std::string, std::string>>& names_and_texts,
                      const RecordingOptions& options = {}) {
  const TemporaryFolder folder;
  RecordingReport reading(options);
  for (const auto& [name, text] : names_and_texts) {
    REQUIRE(read_recording({.path = folder.file(name, text)}, reading, [](std::size_t) {}));
  }
  return std::move(reading).finish();
}

ReportData read(const std::string& text, const RecordingOptions& options = {}) {
  return read_files({{"drive.log", text}}, options);
}

std::size_t count_spans(const ReportData& data, SpanKind kind, std::string_view name) {
  return static_cast<std::size_t>(std::count_if(data.spans.begin(), data.spans.end(), [&](const SpanReport& span) {
    return span.kind == kind && span.name == name;
  }));
}

std::size_t line_number(const std::string& text, std::size_t at) {
  return static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n')) + 1;
}

/// Text with a damaged tick, the first one of this second or later.
std::string damaged_at(std::string text, const std::string& second, std::size_t& line) {
  const std::size_t tick = text.find(" tick ", text.find("# (" + second + "."));
  text[tick + 1] = 'x';
  line = line_number(text, tick);
  return text;
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
  const ReportData data = read(drive());
  CHECK(data.notes.empty());
  CHECK(data.holes.empty());
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

  // At 6 s the pack is driving.
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
  // 20 A for about 3 s at 190 V; the sum is exact, the expected value is not.
  CHECK(data.energy_out_Wh.value_or(0) == Approx(20.0 * 190 * 3.3 / 3600).epsilon(0.2));
  CHECK(data.charge_out_Ah.value_or(0) == Approx(20.0 * 3.3 / 3600).epsilon(0.2));
  CHECK(data.cells[0].soc_percent.value == Approx(80.0).margin(3.0));
  CHECK(std::isnan(data.cells[0].resistance_mOhm.value));  // one step of the current is not enough
  CHECK(data.cells[0].bled_Ah == 0.0F);
}

TEST_CASE("a recorded fault, the phases and contactors are told from when to when", "[unit][report][recording]") {
  const ReportData data = read(drive());
  const SpanReport* const fault = find_span(data, SpanKind::fault, "cell_undervoltage");
  REQUIRE(fault != nullptr);
  CHECK(fault->text == "cell voltage too low");
  CHECK(fault->place == "cell 2.7 (no. 19)");
  CHECK(seconds_at(fault->from_us) == Approx(7.3).margin(0.3));
  CHECK(fault->goes_on);
  CHECK_FALSE(fault->has_begun_before);

  const SpanReport* const open = find_span(data, SpanKind::phase, "open");
  REQUIRE(open != nullptr);
  CHECK(open->has_begun_before);
  CHECK(seconds_at(open->from_us) == Approx(0.0).margin(0.02));
  CHECK(seconds_at(open->to_us) == Approx(2.0).margin(0.1));  // requested after one second, and checked for one
  const SpanReport* const closed = find_span(data, SpanKind::phase, "closed");
  REQUIRE(closed != nullptr);
  CHECK(closed->to_us == fault->from_us);
  const SpanReport* const contactor = find_span(data, SpanKind::contactor, "main positive");
  REQUIRE(contactor != nullptr);
  CHECK(contactor->from_us < closed->from_us);
  CHECK(contactor->to_us >= closed->to_us);
  CHECK_FALSE(contactor->goes_on);
  CHECK(closed->length_us() == closed->to_us - closed->from_us);

  const auto told = std::find_if(data.events.begin(), data.events.end(), [](const EventReport& event) {
    return event.text.find("fault: cell voltage too low") == 0;
  });
  REQUIRE(told != data.events.end());
  CHECK(told->at_us == fault->from_us);
}

TEST_CASE("between two times only what was then is told", "[unit][report][recording]") {
  const ReportData all = read(drive());
  const ReportData data = read(drive(), {.from_us = recorded_from_us + 5 * s, .to_us = recorded_from_us + 6 * s});
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
  CHECK(read(drive(), {.from_us = recorded_from_us + 3'600 * s}).is_empty());
}

TEST_CASE("a long recording has longer samples and no smaller peaks", "[unit][report][recording]") {
  const ReportData fine = read(drive());
  const ReportData coarse = read(drive(), {.samples_max = 20});
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

TEST_CASE("what goes on behind the last time that is shown ends there", "[unit][report][recording]") {
  const std::int64_t from_us = recorded_from_us + 1 * s;
  const std::int64_t to_us = recorded_from_us + 8 * s;
  for (const std::string& text : {drive(), drive_in_parts(), drive() + later_drive()}) {
    const ReportData data = read(text, {.from_us = from_us, .to_us = to_us});
    CHECK(data.to_us() == to_us);
    CHECK(data.holes.empty());
    for (const SpanReport& span : data.spans) {
      INFO(span.name);
      CHECK(span.from_us >= from_us);
      CHECK(span.to_us <= to_us);
      CHECK(span.goes_on == (span.to_us == to_us));
    }
    std::int64_t phases_us = 0;
    for (const SpanReport& span : data.spans) phases_us += span.kind == SpanKind::phase ? span.length_us() : 0;
    CHECK(phases_us == Approx(to_us - from_us).margin(60'000));
    const SpanReport* const fault = find_span(data, SpanKind::fault, "cell_undervoltage");
    REQUIRE(fault != nullptr);
    CHECK(fault->goes_on);
    CHECK(fault->length_us() < s);
    CHECK(count_spans(data, SpanKind::fault, "cell_undervoltage") == 1);
  }
  // Values of cells are those of its end, too: the cell of the fault had not fallen by then.
  const ReportData before = read(drive(), {.to_us = recorded_from_us + 6 * s});
  const ReportData after = read(drive());
  CHECK(before.cells[0].soc_percent.value != after.cells[0].soc_percent.value);
  // Data after a gap does not affect them.
  const RecordingOptions between{.from_us = std::nullopt, .to_us = recorded_from_us + 1'800 * s};
  const float at_end = after.cells[0].soc_percent.value;
  CHECK(read(drive() + later_drive(), between).cells[0].soc_percent.value == at_end);
  CHECK(read_files({{"a.log", drive()}, {"b.log", later_drive()}}, between).cells[0].soc_percent.value == at_end);
}

TEST_CASE("a hole is told as far as it lies in what is shown", "[unit][report][recording]") {
  std::size_t line = 0;
  const std::string torn = damaged_at(drive_in_parts(), "1700000006", line);
  const ReportData end = read(torn, {.to_us = recorded_from_us + 7 * s});
  REQUIRE(end.holes.size() == 1);
  CHECK(end.holes[0].to_us == recorded_from_us + 7 * s);
  const ReportData begin = read(torn, {.from_us = recorded_from_us + 7 * s});
  REQUIRE(begin.holes.size() == 1);
  CHECK(begin.holes[0].from_us == recorded_from_us + 7 * s);
  CHECK(seconds_at(*begin.holes[0].to_us) == Approx(7.5).margin(0.06));
}

TEST_CASE("lines of a recording that are not as they were written are damage", "[unit][report][recording][F106]") {
  // With one frame removed, only the checksum of the lines before them in the next ticks is wrong.
  const auto cut = [](std::string text, std::size_t& line) {
    const std::size_t at = text.find("\n(1700000006.") + 1;
    line = line_number(text, at);
    text.erase(at, text.find('\n', at) + 1 - at);
    return text;
  };
  std::size_t line = 0;
  const ReportData single = read(cut(drive(), line));
  REQUIRE(single.holes.size() == 1);
  CHECK(single.holes[0].is_damage);
  CHECK(seconds_at(single.holes[0].from_us.value_or(0)) == Approx(6.0).margin(0.06));
  CHECK_FALSE(single.holes[0].to_us);
  CHECK(single.times_us.size() == Approx(60).margin(2));
  CHECK(single.notes.empty());  // the different decisions of the core afterwards are not reported
  CHECK(count_spans(single, SpanKind::fault, "cell_undervoltage") == 0);

  const std::string parts = cut(drive_in_parts(), line);
  // After another damaged position its lines are still counted from the start of the file.
  std::size_t other = 0;
  for (const std::string& text : {parts, damaged_at(parts, "1700000001", other)}) {
    const ReportData data = read(text);
    REQUIRE(data.holes.size() == (other > 0 && text != parts ? 2 : 1));
    const HoleReport& hole = data.holes.back();
    CHECK(hole.is_damage);
    CHECK(hole.text.find(": a line is missing, changed or added; reading goes on at line ") != std::string::npos);
    std::size_t first = 0;
    std::size_t last = 0;
    REQUIRE(std::sscanf(hole.text.c_str(), "drive.log, line %zu: from here to line %zu", &first, &last) == 2);
    CHECK(first < line);
    CHECK(last >= line);
    CHECK(last - first < 60);
    CHECK(seconds_at(*hole.from_us) == Approx(6.0).margin(0.06));
    CHECK(seconds_at(hole.to_us.value_or(0)) == Approx(7.5).margin(0.06));
    CHECK(seconds_at(data.to_us()) == Approx(12.0).margin(0.2));
    CHECK(data.notes.empty());
  }
}

TEST_CASE("a tick whose time was changed makes no report longer", "[unit][report][recording][F106]") {
  std::string text = drive_in_parts();
  const std::size_t at = text.find("\n# (1700000006.") + 1;
  text.replace(at, 13, "# (1700009006");
  const ReportData data = read(text);
  REQUIRE(data.holes.size() == 1);
  CHECK(data.holes[0].is_damage);
  CHECK(seconds_at(*data.holes[0].from_us) == Approx(6.0).margin(0.06));
  CHECK(seconds_at(data.holes[0].to_us.value_or(0)) == Approx(7.5).margin(0.06));
  CHECK(seconds_at(data.to_us()) == Approx(12.0).margin(0.2));
  CHECK(data.notes.empty());
}

TEST_CASE("an event that somebody wrote into a recording is not told", "[unit][report][recording][F106]") {
  std::string text = drive();
  const std::size_t tick = text.find("\n# (1700000006.");
  text.insert(text.find('\n', tick + 1) + 1, "# ! fault: made up\n");
  const ReportData data = read(text);
  REQUIRE(data.holes.size() == 1);
  for (const EventReport& event : data.events) CHECK(event.text.find("made up") == std::string::npos);
  CHECK_FALSE(data.events.empty());
}

TEST_CASE("a recording that begins anew is the same drive going on", "[unit][report][recording]") {
  const ReportData whole = read(drive());
  const ReportData parts = read(drive_in_parts());
  CHECK(parts.holes.empty());
  CHECK(parts.notes.empty());
  CHECK(parts.times_us == whole.times_us);
  CHECK(parts.current_A.mean == whole.current_A.mean);
  CHECK(parts.charge_out_Ah.value_or(0) == Approx(whole.charge_out_Ah.value_or(1)));
  CHECK(parts.events.size() == whole.events.size());
  REQUIRE(parts.spans.size() == whole.spans.size());
  for (std::size_t i = 0; i < parts.spans.size(); ++i) {
    INFO(whole.spans[i].name);
    CHECK(parts.spans[i].name == whole.spans[i].name);
    CHECK(parts.spans[i].from_us == whole.spans[i].from_us);
    CHECK(parts.spans[i].to_us == whole.spans[i].to_us);
    CHECK(parts.spans[i].has_begun_before == whole.spans[i].has_begun_before);
    CHECK(parts.spans[i].goes_on == whole.spans[i].goes_on);
  }
  CHECK(count_spans(parts, SpanKind::fault, "cell_undervoltage") == 1);
  CHECK(count_spans(parts, SpanKind::contactor, "main positive") == 1);
}

TEST_CASE("behind a damaged place a recording is read from its next part on", "[unit][report][recording]") {
  std::size_t line = 0;
  const std::string torn = damaged_at(drive_in_parts(), "1700000006", line);
  const std::size_t next = line_number(torn, torn.find("# bmud-recording", torn.find("xick")));
  const ReportData data = read(torn);
  REQUIRE(data.holes.size() == 1);
  const HoleReport& hole = data.holes[0];
  CHECK(hole.is_damage);
  REQUIRE(hole.from_us);
  REQUIRE(hole.to_us);
  CHECK(seconds_at(*hole.from_us) == Approx(6.0).margin(0.06));
  CHECK(seconds_at(*hole.to_us) == Approx(7.5).margin(0.06));
  CHECK(hole.text.find("drive.log, line " + std::to_string(line) + ": column ") == 0);
  CHECK(hole.text.find("; reading goes on at line " + std::to_string(next)) != std::string::npos);
  CHECK(seconds_at(data.to_us()) == Approx(12.0).margin(0.2));
  CHECK(data.times_us.size() == Approx(105).margin(2));
  // The contactors were closed on both of its sides; the fault that occurred meanwhile began in it.
  REQUIRE(count_spans(data, SpanKind::contactor, "main positive") == 1);
  CHECK(find_span(data, SpanKind::contactor, "main positive")->goes_on);
  REQUIRE(count_spans(data, SpanKind::fault, "cell_undervoltage") == 1);
  CHECK(find_span(data, SpanKind::fault, "cell_undervoltage")->has_begun_before);

  // It is not reported for another time span.
  CHECK(read(torn, {.from_us = recorded_from_us + 8 * s}).holes.empty());
  CHECK(read(torn, {.to_us = recorded_from_us + 5 * s}).holes.empty());
}

TEST_CASE("what is damaged up to the end, from the begin on, or altogether is told as that",
          "[unit][report][recording]") {
  std::size_t line = 0;
  const ReportData to_the_end = read(damaged_at(drive(), "1700000006", line));
  REQUIRE(to_the_end.holes.size() == 1);
  CHECK_FALSE(to_the_end.holes[0].to_us);
  CHECK(to_the_end.times_us.size() == Approx(60).margin(2));

  const ReportData cut = read(drive().substr(0, drive().size() - 20));
  REQUIRE(cut.holes.size() == 1);
  CHECK(cut.holes[0].text.find("drive.log, its last line, ") == 0);

  const ReportData without_begin = read(drive_in_parts().substr(20'000));
  REQUIRE(without_begin.holes.size() == 1);
  CHECK_FALSE(without_begin.holes[0].from_us);
  REQUIRE(without_begin.holes[0].to_us);
  CHECK(seconds_at(*without_begin.holes[0].to_us) == Approx(2.5).margin(0.06));

  const ReportData none = read("(1700000000.000000) vcan0 143#11 R\n");
  CHECK(none.is_empty());
  REQUIRE(none.holes.size() == 1);
  CHECK(none.holes[0].text.find("drive.log, line 1: header incomplete") == 0);
  CHECK(read("").is_empty());
}

TEST_CASE("lines that were lost when it was recorded are a hole without damage", "[unit][report][recording]") {
  // The second of five parts is missing.
  std::string text = drive_in_parts();
  const std::size_t second = text.find("# bmud-recording", 1);
  text.erase(second, text.find("# bmud-recording", second + 1) - second);
  const ReportData data = read(text);
  REQUIRE(data.holes.size() == 1);
  CHECK_FALSE(data.holes[0].is_damage);
  CHECK(data.holes[0].text == "drive.log: lines were lost when it was recorded");
  CHECK(seconds_at(*data.holes[0].from_us) == Approx(2.5).margin(0.06));
  CHECK(seconds_at(*data.holes[0].to_us) == Approx(5.0).margin(0.06));
}

TEST_CASE("several recordings are one report, with a hole for the time between them", "[unit][report][recording]") {
  const ReportData data = read_files({{"a.log", drive()}, {"b.log", later_drive()}});
  CHECK(data.source == "2 recordings, a.log to b.log by bmud 0.1.0");
  CHECK(data.times_us.size() == Approx(150).margin(2));
  REQUIRE(data.holes.size() == 1);
  CHECK_FALSE(data.holes[0].is_damage);
  CHECK(data.holes[0].text == "nothing between a.log and b.log");
  CHECK(seconds_at(*data.holes[0].from_us) == Approx(12.0).margin(0.06));
  CHECK(seconds_at(*data.holes[0].to_us) == Approx(3600.0).margin(0.06));
  CHECK(count_spans(data, SpanKind::phase, "open") == 3);
  CHECK(data.notes.empty());
  int gaps = 0;
  for (std::size_t i = 1; i < data.times_us.size(); ++i) gaps += data.has_gap_before(i) ? 1 : 0;
  CHECK(gaps == 1);
  // As one file they are the same, except for the unknown cause of the gap.
  const ReportData joined = read(drive() + later_drive());
  CHECK(joined.times_us == data.times_us);
  REQUIRE(joined.holes.size() == 1);
  CHECK(joined.holes[0].text == "nothing was recorded");
}

TEST_CASE("a recording that was cut into files is one without holes", "[unit][report][recording]") {
  const std::string& text = drive_in_parts();
  const std::size_t cut = text.find("# bmud-recording", text.size() / 2);
  const ReportData data = read_files({{"a.log", text.substr(0, cut)}, {"b.log", text.substr(cut)}});
  const ReportData whole = read(text);
  CHECK(data.holes.empty());
  CHECK(data.notes.empty());
  CHECK(data.times_us == whole.times_us);
  CHECK(data.spans.size() == whole.spans.size());
}

TEST_CASE("what two recordings have of the same time is shown once", "[unit][report][recording]") {
  const ReportData whole = read(drive());
  const ReportData twice = read_files({{"a.log", drive()}, {"b.log", drive()}});
  CHECK(twice.times_us == whole.times_us);
  CHECK(twice.events.size() == whole.events.size());
  CHECK(twice.spans.size() == whole.spans.size());
  CHECK(twice.charge_out_Ah.value_or(0) == Approx(whole.charge_out_Ah.value_or(1)));
  CHECK(twice.holes.empty());
  REQUIRE(twice.notes.size() == 1);
  CHECK(twice.notes[0] == "All that is in b.log is in the files before it, too, and is shown once.");

  // Where the second one is damaged nothing is missing.
  std::size_t line = 0;
  const ReportData mended = read_files({{"a.log", drive_in_parts()},
                                        {"b.log", damaged_at(drive_in_parts(), "1700000006", line)},
                                        {"c.log", later_drive()}});
  CHECK(mended.holes.size() == 1);  // before the third
  REQUIRE(mended.notes.size() == 2);
  CHECK(mended.notes[0].find("b.log, line " + std::to_string(line)) == 0);
  CHECK(mended.notes[0].find("; another file has what is missing there.") != std::string::npos);

  // The first six seconds, and a black box that begins before their end.
  const std::string& parts = drive_in_parts();
  const std::size_t third = parts.find("# bmud-recording", parts.find("# bmud-recording", 1) + 1);
  const std::size_t end = parts.find('\n', parts.find("# (1700000006.")) + 1;
  const ReportData both = read_files({{"a.log", parts.substr(0, end)}, {"b.log", parts.substr(third)}});
  CHECK(both.times_us == whole.times_us);
  CHECK(both.charge_out_Ah.value_or(0) == Approx(whole.charge_out_Ah.value_or(1)).epsilon(0.02));
  CHECK(both.spans.size() == whole.spans.size());
  CHECK(both.holes.empty());
  REQUIRE(both.notes.size() == 1);
  CHECK(both.notes[0].find("What b.log has of 2023-11-14 22:13:2") == 0);
}

TEST_CASE("a recording that is torn at its end goes on with the next file, if that goes on",
          "[unit][report][recording]") {
  const std::string& parts = drive_in_parts();
  const std::size_t second = parts.find("# bmud-recording", 1);
  const std::size_t third = parts.find("# bmud-recording", second + 1);
  const std::string torn = parts.substr(0, third - 1'000);
  const ReportData data = read_files({{"a.log", torn}, {"b.log", parts.substr(third)}});
  REQUIRE(data.holes.size() == 1);
  CHECK(data.holes[0].is_damage);
  CHECK(data.holes[0].text.find("a.log, its last line, ") == 0);
  CHECK(data.holes[0].text.find("; reading goes on at the begin of b.log") != std::string::npos);
  CHECK(seconds_at(data.holes[0].to_us.value_or(0)) == Approx(5.0).margin(0.06));
  // The second file contains nothing of the missing range.
  const ReportData none = read_files({{"a.log", torn}, {"b.log", parts.substr(0, second)}});
  REQUIRE(none.holes.size() == 1);
  CHECK_FALSE(none.holes[0].to_us);
  CHECK(none.holes[0].text.find("goes on") == std::string::npos);
}

TEST_CASE("what several recordings lack is told of each of them", "[unit][report][recording]") {
  // The second one has no data of its own, as far as it can be read; both lack their end.
  std::size_t line = 0;
  const std::string& parts = drive_in_parts();
  const std::string first = damaged_at(parts, "1700000011", line);
  const std::string second = parts.substr(0, parts.size() / 2);
  const auto check = [&](const ReportData& data) {
    REQUIRE(data.holes.size() == 2);
    CHECK(data.holes[0].text.find("a.log, line " + std::to_string(line) + ": ") == 0);
    CHECK(data.holes[0].text.find("last line") == std::string::npos);
    CHECK(data.holes[1].text.find("b.log, its last line, ") == 0);
    CHECK(data.holes[0].is_damage);
    CHECK(data.holes[1].is_damage);
  };
  check(read_files({{"a.log", first}, {"b.log", second}}));
  const ReportData goes_on = read_files({{"a.log", first}, {"b.log", second}, {"c.log", later_drive()}});
  check(goes_on);
  // The missing time is counted once.
  CHECK(goes_on.holes[0].from_us == goes_on.holes[1].from_us);
  CHECK(goes_on.holes[0].to_us == goes_on.holes[1].to_us);
  CHECK(missing_us(goes_on) == *goes_on.holes[0].to_us - *goes_on.holes[0].from_us);
}

TEST_CASE("recordings are put in the order of their times, and what is none is left out", "[unit][report][recording]") {
  const TemporaryFolder folder;
  const std::string late = folder.file("a.log", later_drive());
  const std::string early = folder.file("b.log", drive());
  const std::string page = folder.file("drive.html", "<!DOCTYPE html>\n");
  const auto files = in_order_of_time({late, page, early});
  REQUIRE(files);
  REQUIRE(files->recordings.size() == 2);
  CHECK(files->recordings[0].path == early);
  CHECK(files->recordings[0].first_us - recorded_from_us < s);
  CHECK(files->recordings[1].path == late);
  CHECK(files->left_out == std::vector<std::string>{"drive.html is left out: no recording is in it."});
  CHECK_FALSE(in_order_of_time({page, folder.file("empty.log", "")}));
  const auto missing = in_order_of_time({early, folder / "none.log"});
  REQUIRE_FALSE(missing);
  CHECK(missing.error().find("none.log': No such file") != std::string::npos);
}

TEST_CASE("a byte-order mark before a recording costs a report nothing", "[unit][report][recording]") {
  const std::string mark = "\xEF\xBB\xBF";
  const ReportData data = read(mark + drive());
  CHECK(data.notes.empty());
  CHECK(data.holes.empty());
  CHECK(data.times_us == read(drive()).times_us);
  const TemporaryFolder folder;
  const auto files = in_order_of_time({folder.file("a.log", later_drive()), folder.file("b.log", mark + drive())});
  REQUIRE(files);
  CHECK(files->left_out.empty());
  CHECK(files->recordings.size() == 2);
}

TEST_CASE("a clock that is put right by milliseconds costs nothing", "[unit][report][recording]") {
  const ReportData data =
      read(test::recorded_run(drive_script, {.length = 12s, .part_length = 2500ms, .clock_behind_us = 20'000}));
  CHECK(data.notes.empty());
  CHECK(data.holes.empty());
  CHECK(std::is_sorted(data.times_us.begin(), data.times_us.end()));
}

// --- a clock that is set --------------------------------------------------------------------------------------------

namespace {

/// A host without a battery-backed clock, 12 s after its start.
constexpr std::int64_t unset_from_us = 12 * s;

/// The drive of other tests, with a clock that is set 6 s after its start: times are those of the clock as set.
void check_is_drive(const ReportData& data, const std::string& note) {
  const ReportData whole = read(drive());
  REQUIRE(data.notes.size() == 1);
  CHECK(data.notes[0] == note);
  CHECK(data.holes.empty());
  CHECK(data.times_us == whole.times_us);
  for (std::size_t i = 1; i < data.times_us.size(); ++i) CHECK_FALSE(data.has_gap_before(i));
  CHECK(data.events.size() == whole.events.size());
  REQUIRE(data.spans.size() == whole.spans.size());
  for (std::size_t i = 0; i < data.spans.size(); ++i) {
    CHECK(data.spans[i].name == whole.spans[i].name);
    CHECK(data.spans[i].from_us == whole.spans[i].from_us);
    CHECK(data.spans[i].to_us == whole.spans[i].to_us);
  }
  CHECK(data.charge_out_Ah.value_or(0) == Approx(whole.charge_out_Ah.value_or(1)));
}

std::string drive_with(const test::RecordedRun& wanted) {
  return test::recorded_run(drive_script, wanted);
}

}  // namespace

TEST_CASE("the first setting of a clock that began in 1970 is no hole, and the drive before it is shown where it was",
          "[unit][report][recording][clock]") {
  const std::string note =
      "The clock was set forward by 19675 d 22 h at 2023-11-14 22:13:26, for the first time since the computer "
      "started; what came before is shown on the clock as it was set.";
  test::RecordedRun wanted{.length = 12s, .from_us = unset_from_us, .clock_set_at = 6s};
  wanted.clock_set_by_us = recorded_from_us - unset_from_us;
  check_is_drive(read(drive_with(wanted)), note);
  wanted.part_length = 2500ms;
  check_is_drive(read(drive_with(wanted)), note);
}

TEST_CASE("a clock that is set back or forward while it is recorded costs no decision and makes no hole",
          "[unit][report][recording][clock]") {
  for (const auto& [by_us, words] : {std::pair{3'600 * s, "forward by 1 h"}, {-3'600 * s, "back by 1 h"}}) {
    for (const Duration part_length : {Duration::max(), Duration{2500ms}}) {
      check_is_drive(read(drive_with({.length = 12s,
                                      .part_length = part_length,
                                      .from_us = recorded_from_us - by_us,
                                      .clock_set_at = 6s,
                                      .clock_set_by_us = by_us})),
                     "The clock was set " + std::string(words) +
                         " at 2023-11-14 22:13:26; what came before is shown on the clock as it was set.");
    }
  }
}

TEST_CASE("a start without a clock stands behind what was recorded before, in files of any order",
          "[unit][report][recording][clock]") {
  const TemporaryFolder folder;
  const std::string first = folder.file("b.log", drive());
  const std::string second =
      folder.file("a.log", test::recorded_run("0 pack soc_permille 500\n",
                                              {.length = 6s,
                                               .from_us = unset_from_us,
                                               .clock_set_at = 3s,
                                               .clock_set_by_us = recorded_from_us + 3'600 * s - unset_from_us}));
  const auto files = in_order_of_time({second, first});
  REQUIRE(files);
  CHECK(files->recordings[0].path == first);
  CHECK(files->recordings[1].first_us - recorded_from_us - 3'600 * s < s);
  RecordingReport reading({});
  for (const RecordingFile& file : files->recordings) REQUIRE(read_recording(file, reading, [](std::size_t) {}));
  const ReportData data = std::move(reading).finish();
  CHECK(seconds_at(data.times_us.back()) == Approx(3'605.9).margin(0.11));
  CHECK(data.times_us.size() == Approx(180).margin(2));
  CHECK(std::is_sorted(data.times_us.begin(), data.times_us.end()));
  REQUIRE(data.holes.size() == 1);
  CHECK(seconds_at(*data.holes[0].from_us) == Approx(12.0).margin(0.06));
  CHECK(seconds_at(*data.holes[0].to_us) == Approx(3'600.0).margin(0.06));
  REQUIRE(data.notes.size() == 2);
  CHECK(data.notes[0].find(" the clock has not been set since the computer started") != std::string::npos);
  CHECK(data.notes[1].find("The clock was set forward by 19675 d 23 h at 2023-11-14 23:13:23") == 0);
}

TEST_CASE("a life whose clock is never set stays beside the one behind it", "[unit][report][recording][clock]") {
  const std::string unset = test::recorded_run("0 pack soc_permille 500\n", {.length = 3s, .from_us = unset_from_us});
  const ReportData before = read(unset + drive());
  CHECK(before.times_us.size() == Approx(150).margin(2));
  CHECK(seconds_at(before.times_us.front()) == Approx(-4.0).margin(0.2));
  CHECK(seconds_at(before.to_us()) == Approx(12.0).margin(0.2));
  REQUIRE(before.notes.size() == 1);
  CHECK(before.notes[0].find("The clock was never set before 2023-11-14 22:13:20: ") == 0);
  const ReportData behind = read(drive() + unset);
  CHECK(behind.times_us.size() == Approx(150).margin(2));
  CHECK(seconds_at(behind.to_us()) == Approx(16.0).margin(0.2));
  REQUIRE(behind.notes.size() == 1);
}

TEST_CASE("of endless settings of the clock the first twenty are noted", "[unit][report][recording][clock]") {
  const ReportData data = read(drive_with({.length = 12s, .part_length = 400ms, .clock_behind_us = 10 * s}));
  REQUIRE(data.notes.size() == 21);
  CHECK(data.notes[19].find("The clock was set back by 10.0 s at ") == 0);
  CHECK(data.notes[20].find(" more settings of the clock are left out here.") != std::string::npos);
  CHECK(data.holes.empty());
  CHECK(data.times_us.size() == Approx(120).margin(2));
}

}  // namespace bmu::report
