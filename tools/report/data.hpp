// What a report shows of a pack over time, wherever it comes from: a recording, a black box, the history.
//
// Samples follow each other in time and stand for `sample_us` each; where the next is later than that there is a gap.
// What was not known is `not_known`, which is drawn as a gap, never as zero. A value may be the mean of what was seen
// within its sample, with the extremes beside it, so that neither a long span nor a coarse source loses a peak.
//
// A hole is a stretch of which nothing can be told although something is known before or behind it: what is so on both
// of its sides is one thing going on, as far as anybody knows, and not another one that has begun.
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

/// Of two values of which either may be not_known.
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
  /// Nothing of it was ever known.
  [[nodiscard]] bool is_unknown() const;
};

/// A figure and within what the truth lies in some 95 of 100 cases: two standard deviations.
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
  Figure health_percent;      // what is left of the capacity
  float bled_Ah = not_known;  // by balancing
};

struct SensorReport {
  std::string name;  // "module 3, sensor 1"
  Series temperature_C;
};

/// From whose reason a limit comes: for each sample an index into `texts`.
struct CauseReport {
  std::vector<std::string> texts;
  std::vector<std::uint16_t> of_sample;

  void add(const std::string& text);
};

enum class SpanKind : std::uint8_t { phase, contactor, warning, fault };

/// Something that was so from one time to another: a phase, a contactor that was closed, a fault.
struct SpanReport {
  SpanKind kind = SpanKind::phase;
  std::string name;   // of the row it stands in: "cell_undervoltage", "main positive"; a phase: "closed"
  std::string text;   // "a cell's voltage is too low"
  std::string place;  // "cell 2.7 (no. 19)"
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
  bool has_begun_before = false;            // of what the report shows, or in a hole
  bool goes_on = false;                     // at its end, or into a hole
  std::optional<std::int64_t> lasted_us{};  // of these times, where nobody knows which

  [[nodiscard]] std::int64_t length_us() const { return lasted_us.value_or(to_us - from_us); }
};
/// What a phase is called where nobody knows which it was.
inline constexpr const char* unknown_phase = "not known";

/// Nothing is known from one time to another; without one of them, to that end of the report.
struct HoleReport {
  std::optional<std::int64_t> from_us;
  std::optional<std::int64_t> to_us;
  std::string text;        // why, and where in the file
  bool is_damage = false;  // something that was there cannot be read
};

struct EventReport {
  std::int64_t at_us = 0;
  std::string text;
};

struct ReportData {
  std::string pack_name;
  std::string cell_name;
  std::string source;              // "recording drive.log, by bmud 0.1.0"
  std::vector<std::string> notes;  // what the reader should know of it: torn, samples left out

  std::vector<std::int64_t> times_us;  // of each sample's begin, since 1970, rising
  std::int64_t sample_us = 100'000;
  std::optional<std::int64_t> end_us;      // where that is not the last sample's
  std::optional<std::int64_t> covered_us;  // where samples are not all of one length
  std::vector<HoleReport> holes;           // in their order
  bool is_of_means = false;                // each sample a mean, of which nobody knows how the value went

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

  // What flowed within the span.
  std::optional<double> energy_out_Wh;
  std::optional<double> energy_in_Wh;
  std::optional<double> charge_out_Ah;
  std::optional<double> charge_in_Ah;

  [[nodiscard]] bool is_empty() const { return times_us.empty(); }
  [[nodiscard]] std::int64_t from_us() const { return times_us.front(); }
  [[nodiscard]] std::int64_t to_us() const { return end_us.value_or(times_us.back() + sample_us); }
  /// Between this sample and the one before it something is missing.
  [[nodiscard]] bool has_gap_before(std::size_t sample) const;
};

/// Two samples become one, twice as long, so that a source of unknown length stays within bounds.
void halve(ReportData& data);

}  // namespace bmu::report
