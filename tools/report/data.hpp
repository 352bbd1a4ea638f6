// The data of a report of a pack over time, from any source: a recording, a black box, the history.
//
// Samples follow each other in time and stand for `sample_us` each; if the next is later than that, there is a gap. An
// unknown value is `not_known`, which is drawn as a gap, never as zero. A value may be the mean over its sample, with
// the extremes beside it, so that neither a long span nor a coarse source loses a peak.
//
// A gap (HoleReport) is a period without data before or after periods with data: a state that is the same on both sides
// counts as one that continues, not as a second one that has started.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace bmu::report {

inline constexpr float not_known = std::numeric_limits<float>::quiet_NaN();
inline constexpr double sigmas_told = 2.0;

/// The lower or higher of two values, either of which may be not_known.
[[nodiscard]] inline float lower(float a, float b) {
  return std::isnan(a) ? b : std::isnan(b) ? a : std::min(a, b);
}
[[nodiscard]] inline float higher(float a, float b) {
  return std::isnan(a) ? b : std::isnan(b) ? a : std::max(a, b);
}

/// A quantity over time, an entry for each sample. `low` and `high` are as long as `mean`.
struct Series {
  std::vector<float> mean;
  std::vector<float> low;
  std::vector<float> high;

  void add(float value) { add(value, value, value); }
  void add(float low_value, float mean_value, float high_value);
  [[nodiscard]] std::size_t size() const { return mean.size(); }
  /// True if no value of it was ever known.
  [[nodiscard]] bool is_unknown() const;
};

/// A value and its uncertainty: the true value lies within two standard deviations in about 95 of 100 cases.
struct Figure {
  float value = not_known;
  float doubt = not_known;
};

struct CellReport {
  std::string name;         // "3.9"
  std::uint8_t module = 0;  // node
  std::uint16_t pack_number = 0;
  Series voltage_V;
  // At the end:
  Figure resistance_mOhm;
  Figure soc_percent;
  Figure health_percent;      // remaining share of the capacity
  float bled_Ah = not_known;  // by balancing
};

struct SensorReport {
  std::string name;  // "module 3, sensor 1"
  Series temperature_C;
};

/// Source of a limit: for each sample an index into `texts`.
struct CauseReport {
  std::vector<std::string> texts;
  std::vector<std::uint16_t> of_sample;

  void add(const std::string& text);
};

enum class SpanKind : std::uint8_t { phase, contactor, warning, fault };

/// A state that lasted from one time to another: a phase, a closed contactor, a fault.
struct SpanReport {
  SpanKind kind = SpanKind::phase;
  std::string name;   // of the row it is shown in: "cell_undervoltage", "main positive"; a phase: "closed"
  std::string text;   // "a cell's voltage is too low"
  std::string place;  // "cell 2.7 (no. 19)"
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
  bool has_begun_before = false;            // before the report, or in a gap
  bool goes_on = false;                     // at its end, or into a gap
  std::optional<std::int64_t> lasted_us{};  // sum, if it is unknown which of these times

  [[nodiscard]] std::int64_t length_us() const { return lasted_us.value_or(to_us - from_us); }
};
/// Name of an unknown phase.
inline constexpr const char* unknown_phase = "not known";

/// No data from one time to another; a missing bound is that end of the report.
struct HoleReport {
  std::optional<std::int64_t> from_us;
  std::optional<std::int64_t> to_us;
  std::string text;        // cause, and position in the file
  bool is_damage = false;  // recorded data cannot be read
};

struct EventReport {
  std::int64_t at_us = 0;
  std::string text;
};

struct ReportData {
  std::string pack_name;
  std::string cell_name;
  std::string source;              // "recording drive.log, by bmud 0.1.0"
  std::vector<std::string> notes;  // remarks for the reader: truncated, omitted samples

  std::vector<std::int64_t> times_us;  // start of each sample, since 1970, rising
  std::int64_t sample_us = 100'000;
  std::optional<std::int64_t> end_us;      // if it differs from the end of the last sample
  std::optional<std::int64_t> covered_us;  // if samples differ in length
  std::vector<HoleReport> holes;           // in their order
  bool is_of_means = false;                // each sample is a mean, and the values within it are unknown

  std::vector<CellReport> cells;
  std::vector<SensorReport> sensors;
  Series pack_voltage_V;
  Series link_voltage_V;
  Series current_A;  // positive out of the pack
  Series discharge_limit_A;
  Series charge_limit_A;  // positive
  CauseReport discharge_cause;
  CauseReport charge_cause;
  Series soc_percent;
  Series soc_doubt_percent;  // as in Figure

  std::vector<SpanReport> spans;
  std::vector<EventReport> events;

  // State of energy at the end.
  Figure energy_left_Wh;

  // Throughput within the span.
  std::optional<double> energy_out_Wh;
  std::optional<double> energy_in_Wh;
  std::optional<double> charge_out_Ah;
  std::optional<double> charge_in_Ah;

  [[nodiscard]] bool is_empty() const { return times_us.empty(); }
  [[nodiscard]] std::int64_t from_us() const { return times_us.front(); }
  [[nodiscard]] std::int64_t to_us() const { return end_us.value_or(times_us.back() + sample_us); }
  /// True if data is missing between this sample and the one before it.
  [[nodiscard]] bool has_gap_before(std::size_t sample) const;
};

/// Merges pairs of samples into one of twice the length, so that a source of unknown length stays within bounds.
void halve(ReportData& data);

}  // namespace bmu::report
