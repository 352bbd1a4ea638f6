#include "tools/report/from_history.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/core/faults/fault_table.hpp"
#include "tools/report/history_clock.hpp"
#include "tools/report/history_moves.hpp"

namespace bmu::report {

namespace {

constexpr double milli = 1e-3;
constexpr double micro = 1e-6;
constexpr double tenth = 0.1;
constexpr double uAs_per_Ah = 3.6e9;
constexpr std::int64_t us_per_ms = 1000;
constexpr std::int64_t us_per_s = 1'000'000;
/// Minimum length of a reported gap between two rows; corrections of a clock are smaller.
constexpr std::int64_t gap_min_us = us_per_s;

float scaled(const HistoryNumber& value, double step) {
  return value ? static_cast<float>(static_cast<double>(*value) * step) : not_known;
}

const FaultRow* fault_called(std::string_view name) {
  for (const FaultRow& row : fault_table()) {
    if (row.name == name) return &row;
  }
  return nullptr;
}

std::vector<std::string> names_in(std::string_view list) {
  std::vector<std::string> names;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    names.emplace_back(list.substr(0, end));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return names;
}

/// Subtracts the other parts from the parts of a minute; both in order.
std::vector<MinutePart> without(const std::vector<MinutePart>& parts, const std::vector<MinutePart>& others) {
  std::vector<MinutePart> left;
  for (MinutePart part : parts) {
    for (const MinutePart& other : others) {
      if (other.to_ms <= part.from_ms || other.from_ms >= part.to_ms) continue;
      if (other.from_ms > part.from_ms) left.push_back({part.from_ms, other.from_ms});
      part.from_ms = std::min(other.to_ms, part.to_ms);
    }
    const bool is_touched = !others.empty() && part.from_ms == part.to_ms;
    if (!is_touched) left.push_back(part);
  }
  return left;
}

/// The states over the minutes, by their row in the chart: a part that starts where the one before it ended continues
/// it.
class Spans {
 public:
  explicit Spans(std::vector<SpanReport>& to) : to_(to) {}

  /// Data is available from here on.
  void begin(std::int64_t at_us) { begin_us_ = end_us_ = at_us; }
  /// Adds a state that lasts from `from_us` to `to_us`.
  void add(SpanReport span) {
    const std::string key = std::to_string(static_cast<int>(span.kind)) + span.name;
    const auto open = open_.find(key);
    const bool goes_on = open != open_.end() && to_[open->second].to_us == span.from_us &&
                         !to_[open->second].lasted_us && !span.lasted_us;
    if (goes_on) {
      to_[open->second].to_us = span.to_us;
      return;
    }
    span.has_begun_before = span.from_us == begin_us_;
    open_[key] = to_.size();
    to_.push_back(std::move(span));
  }
  void end_minute(std::int64_t end_us) { end_us_ = end_us; }
  /// Called if the following time is unknown, or at the end.
  void break_off() {
    for (const auto& [key, index] : open_) to_[index].goes_on = to_[index].to_us == end_us_;
    open_.clear();
  }

 private:
  std::vector<SpanReport>& to_;
  std::map<std::string, std::size_t> open_;
  std::int64_t begin_us_ = 0;
  std::int64_t end_us_ = 0;
};

class Filler {
 public:
  Filler(ReportData& data, const HistoryLife& life, const HistoryMoves& moves, const HistoryClock& clock,
         const HistoryOptions& options)
      : data_(data), life_(life), moves_(moves), clock_(clock), options_(options), spans_(data.spans) {
    data_.pack_name = life.pack_name;
    data_.is_of_means = true;
    data_.sample_us = life.period_s * us_per_s;
    for (const HistoryPlace& place : life.layout.cells()) {
      CellReport& cell = data_.cells.emplace_back();
      cell.name = std::to_string(place.module) + "." + std::to_string(place.place);
      cell.module = static_cast<std::uint8_t>(place.module);
      cell.pack_number = static_cast<std::uint16_t>(place.number);
    }
    const std::vector<HistoryPlace> sensors = life.layout.sensors();
    for (std::size_t index = 0; index < sensors.size(); ++index) {
      if (sensors[index].is_board) continue;
      sensors_.push_back(index);
      data_.sensors.push_back(
          {.name = "sensor " + std::to_string(sensors[index].module) + "." + std::to_string(sensors[index].place),
           .temperature_C = {}});
    }
  }

  void take(const HistoryRow& row, const HistoryLife& life) {
    seen_before_ = std::exchange(seen_, row.sequence);
    if (!row.unix_time_ms) {
      ++without_time_;
      return;
    }
    if (life.layout != life_.layout) {
      ++of_another_pack_;
      return;
    }
    const std::int64_t at_us = clock_.shown_ms(row).value_or(*row.unix_time_ms) * us_per_ms;
    if (!data_.is_empty() && at_us <= last_us_) {
      ++times_back_;
      return;
    }
    const std::int64_t span_us = row.span_ms.value_or(life.period_s * 1000) * us_per_ms;
    joins_last_ = joins_last(row);
    const std::int64_t begin_us = follow(row, at_us);
    last_us_ = at_us;
    end_us_ = at_us + span_us;
    covered_us_ += span_us;
    add_sample(row, at_us);
    add_spans(row, begin_us);
    add_flow(row);
    last_ = row;
    if (data_.times_us.size() >= options_.samples_max) halve(data_);
  }

  void finish() {
    spans_.break_off();
    data_.end_us = end_us_;
    data_.covered_us = covered_us_;
    for (std::size_t index = 0; index < data_.cells.size() && index < last_.cells.size(); ++index) {
      data_.cells[index].soc_percent.value = scaled(last_.cells[index].soc_permille, tenth);
      data_.cells[index].health_percent.value = scaled(last_.cells[index].health_by_capacity_permille, tenth);
    }
    note(without_time_, "rows without a time of the clock are left out");
    note(of_another_pack_, "rows of a pack with other modules are left out");
    note(times_back_, "rows are left out, as the clock had been set back");
  }

 private:
  /// True if the row starts where the last one ended, except for changes of the clock.
  [[nodiscard]] bool joins_last(const HistoryRow& row) const {
    constexpr std::int64_t apart_max_ms = 1;  // times and lengths were each truncated to milliseconds
    if (data_.is_empty() || row.life != last_.life || !row.span_ms || !row.uptime_ms || !last_.uptime_ms) return false;
    return std::abs(*row.uptime_ms - *row.span_ms - *last_.uptime_ms) <= apart_max_ms;
  }

  /// Start of the row for continuing states: the end of the last row if it joins that.
  std::int64_t follow(const HistoryRow& row, std::int64_t at_us) {
    if (joins_last_ && std::abs(at_us - end_us_) < gap_min_us) return end_us_;
    spans_.break_off();
    spans_.begin(at_us);
    if (!data_.is_empty() && at_us - end_us_ >= gap_min_us) {
      data_.holes.push_back({.from_us = end_us_, .to_us = at_us, .text = why_missing(row), .is_damage = false});
    }
    return at_us;
  }

  [[nodiscard]] std::string why_missing(const HistoryRow& row) const {
    if (row.sequence > seen_before_ + 1) {
      const std::string first = std::to_string(seen_before_ + 1);
      return row.sequence == seen_before_ + 2
                 ? "row " + first + " is missing or cannot be read"
                 : "rows " + first + " to " + std::to_string(row.sequence - 1) + " are missing or cannot be read";
    }
    if (row.sequence > last_.sequence + 1) return "what is there is left out";
    return row.life != last_.life ? "the daemon did not run, or its last row was not kept"
                                  : "the clock was set forward";
  }

  void add_sample(const HistoryRow& row, std::int64_t at_us) {
    data_.times_us.push_back(at_us);
    for (std::size_t index = 0; index < data_.cells.size(); ++index) {
      const HistoryCell cell = index < row.cells.size() ? row.cells[index] : HistoryCell{};
      data_.cells[index].voltage_V.add(scaled(cell.voltage_min_uV, micro), scaled(cell.voltage_average_uV, micro),
                                       scaled(cell.voltage_max_uV, micro));
    }
    for (std::size_t index = 0; index < sensors_.size(); ++index) {
      const HistorySensor sensor =
          sensors_[index] < row.sensors.size() ? row.sensors[sensors_[index]] : HistorySensor{};
      data_.sensors[index].temperature_C.add(scaled(sensor.temperature_min_dC, tenth),
                                             scaled(sensor.temperature_average_dC, tenth),
                                             scaled(sensor.temperature_max_dC, tenth));
    }
    data_.pack_voltage_V.add(scaled(row.pack_voltage_min_mV, milli), scaled(row.pack_voltage_average_mV, milli),
                             scaled(row.pack_voltage_max_mV, milli));
    data_.link_voltage_V.add(scaled(row.link_voltage_min_mV, milli), scaled(row.link_voltage_average_mV, milli),
                             scaled(row.link_voltage_max_mV, milli));
    data_.current_A.add(scaled(row.current_min_mA, milli), scaled(row.current_average_mA, milli),
                        scaled(row.current_max_mA, milli));
    data_.discharge_limit_A.add(scaled(row.discharge_limit_mA, milli));
    data_.charge_limit_A.add(scaled(row.charge_limit_mA, milli));
    data_.discharge_cause.add(row.discharge_limit_cause);
    data_.charge_cause.add(row.charge_limit_cause);
    data_.soc_percent.add(scaled(row.soc_permille, tenth));
    data_.soc_doubt_percent.add(scaled(row.soc_sigma_permille, tenth * sigmas_told));
    data_.energy_left_Wh = {.value = scaled(row.energy_left_mWh, milli),
                            .doubt = scaled(row.energy_left_sigma_mWh, milli * sigmas_told)};
  }

  /// Adds the states up to the end of the row; `begin_us` is the end of the row before it.
  void add_spans(const HistoryRow& row, std::int64_t begin_us) {
    const std::int64_t span_ms = row.span_ms.value_or(0);
    const auto at = [&](std::int64_t since_begin_ms) {
      if (since_begin_ms <= 0) return begin_us;
      return since_begin_ms >= span_ms ? end_us_ : last_us_ + since_begin_ms * us_per_ms;
    };
    add_phases(row, at);
    const std::vector<std::string> faults = names_in(row.faults);
    for (const std::string& name : names_in(row.warnings)) {
      // A name that is also a fault is a warning only for the remaining time.
      const bool is_fault = std::find(faults.begin(), faults.end(), name) != faults.end();
      const std::vector<MinutePart> as_fault =
          is_fault ? moves_.times_of_fault(row, name, false) : std::vector<MinutePart>{};
      add_fault_spans(name, SpanKind::warning, without(moves_.times_of_fault(row, name, true), as_fault), at);
    }
    for (const std::string& name : faults) {
      add_fault_spans(name, SpanKind::fault, moves_.times_of_fault(row, name, false), at);
    }
    spans_.end_minute(end_us_);
  }

  template <class At>
  void add_fault_spans(const std::string& name, SpanKind kind, const std::vector<MinutePart>& parts, const At& at) {
    const FaultRow* const fault = fault_called(name);
    for (const MinutePart& part : parts) {
      spans_.add({.kind = kind,
                  .name = name,
                  .text = fault ? std::string(fault->meaning) : name,
                  .place = {},
                  .from_us = at(part.from_ms),
                  .to_us = at(part.to_ms)});
    }
  }

  template <class At>
  void add_phases(const HistoryRow& row, const At& at) {
    if (row.phase.empty()) return;
    for (const PhasePart& part : moves_.phases_of(row, joins_last_ ? &last_ : nullptr)) {
      const std::int64_t from_us = at(part.from_ms);
      const std::int64_t to_us = at(part.to_ms);
      spans_.add({.kind = SpanKind::phase,
                  .name = part.phase,
                  .text = part.phase,
                  .place = {},
                  .from_us = from_us,
                  .to_us = to_us});
      if (part.closed_ms == 0) continue;
      SpanReport closed{.kind = SpanKind::contactor,
                        .name = "main contactors",
                        .text = "main contactors closed",
                        .place = {},
                        .from_us = from_us,
                        .to_us = to_us};
      if (!part.is_closed()) closed.lasted_us = part.closed_ms * us_per_ms;
      spans_.add(std::move(closed));
    }
  }

  void add_flow(const HistoryRow& row) {
    const auto add = [](std::optional<double>& sum, const HistoryNumber& value, double step) {
      if (value) sum = sum.value_or(0.0) + static_cast<double>(*value) * step;
    };
    add(data_.energy_out_Wh, row.energy_out_mWh, milli);
    add(data_.energy_in_Wh, row.energy_in_mWh, milli);
    add(data_.charge_out_Ah, row.charge_out_uAs, 1.0 / uAs_per_Ah);
    add(data_.charge_in_Ah, row.charge_in_uAs, 1.0 / uAs_per_Ah);
  }

  void note(std::size_t count, const char* what) {
    if (count > 0) data_.notes.push_back(std::to_string(count) + " " + what + ".");
  }

  ReportData& data_;
  const HistoryLife& life_;
  const HistoryMoves& moves_;
  const HistoryClock& clock_;
  const HistoryOptions& options_;
  Spans spans_;
  std::vector<std::size_t> sensors_;  // indexes of the shown ones in a row's array
  HistoryRow last_;
  std::int64_t last_us_ = 0;  // start and end of the row taken last
  std::int64_t end_us_ = 0;
  std::int64_t covered_us_ = 0;
  std::int64_t seen_ = 0;  // the latest row, taken or not, and the one before it
  std::int64_t seen_before_ = 0;
  bool joins_last_ = false;  // the current row
  std::size_t without_time_ = 0;
  std::size_t of_another_pack_ = 0;
  std::size_t times_back_ = 0;
};

HistoryNumber ms(const std::optional<std::int64_t>& time_us) {
  return time_us ? HistoryNumber(*time_us / us_per_ms) : std::nullopt;
}

}  // namespace

ReportData report_from_history(HistoryReader& history, const HistoryOptions& options) {
  ReportData data;
  const HistorySpan span{.from_unix_ms = ms(options.from_us), .to_unix_ms = ms(options.to_us)};
  // The pack as it was last: earlier minutes with other modules cannot be in the same chart.
  const HistoryLife* life = nullptr;
  HistoryClock clock;
  history.for_each_row(span, [&](const HistoryRow& row) {
    clock.take(row);
    if (row.unix_time_ms) life = history.life_of(row);
    return true;
  });
  if (life == nullptr) return data;
  const HistoryLife last = *life;
  data.source = "the history " + history.path() + " by bmud " + last.version;
  HistoryMoves moves;
  // The last minute ends after the span.
  const HistorySpan to_its_end{
      .from_unix_ms = span.from_unix_ms,
      .to_unix_ms = span.to_unix_ms ? HistoryNumber(*span.to_unix_ms + 2'000 * last.period_s) : std::nullopt};
  history.for_each_event(to_its_end, [&](const HistoryEvent& event) {
    moves.take(event);
    if (event.unix_time_ms && span.has(event.unix_time_ms)) {
      const std::int64_t at_ms = clock.shown_ms(event).value_or(*event.unix_time_ms);
      data.events.push_back({.at_us = at_ms * us_per_ms, .text = event.text});
    }
    return true;
  });
  Filler filler(data, last, moves, clock, options);
  history.for_each_row(span, [&](const HistoryRow& row) {
    filler.take(row, *history.life_of(row));
    return true;
  });
  filler.finish();
  for (std::string& text : clock.notes()) data.notes.push_back(std::move(text));
  for (const std::string& problem : history.problems()) data.notes.push_back(problem);
  return data;
}

}  // namespace bmu::report
