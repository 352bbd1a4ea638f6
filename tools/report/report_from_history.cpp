#include "tools/report/report_from_history.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/core/fault_table.hpp"

namespace bmu::report {

namespace {

constexpr double milli = 1e-3;
constexpr double micro = 1e-6;
constexpr double tenth = 0.1;
constexpr double uAs_per_Ah = 3.6e9;
/// The core tells one sigma; a page shows within what the truth lies in some 95 of 100 cases.
constexpr double sigmas_told = 2.0;
constexpr std::int64_t us_per_ms = 1000;
constexpr std::int64_t us_per_s = 1'000'000;

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

/// What is so from minute to minute, by its row in the picture.
class Spans {
 public:
  explicit Spans(std::vector<SpanReport>& to) : to_(to) {}

  void begin_minute(std::int64_t at_us) {
    at_us_ = at_us;
    now_.clear();
  }
  /// It is so in this minute.
  void add(SpanReport span) {
    const std::string key = std::to_string(static_cast<int>(span.kind)) + span.name;
    if (const auto open = open_.find(key); open != open_.end()) {
      now_.insert(*open);
      return;
    }
    span.from_us = at_us_;
    span.has_begun_before = is_first_;
    now_[key] = to_.size();
    to_.push_back(std::move(span));
  }
  void end_minute(std::int64_t end_us) {
    open_ = now_;
    for (const auto& [key, index] : open_) to_[index].to_us = end_us;
    is_first_ = false;
  }
  void break_off() {
    open_.clear();
    is_first_ = true;
  }
  void end() {
    for (const auto& [key, index] : open_) to_[index].goes_on = true;
  }

 private:
  std::vector<SpanReport>& to_;
  std::map<std::string, std::size_t> open_;
  std::map<std::string, std::size_t> now_;
  std::int64_t at_us_ = 0;
  bool is_first_ = true;
};

class Filler {
 public:
  Filler(ReportData& data, const HistoryLife& life, const HistoryOptions& options)
      : data_(data), life_(life), options_(options), spans_(data.spans) {
    data_.pack_name = life.pack_name;
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
    if (!row.unix_time_ms) {
      ++without_time_;
      return;
    }
    if (life.layout != life_.layout) {
      ++of_another_pack_;
      return;
    }
    const std::int64_t at_us = *row.unix_time_ms * us_per_ms;
    if (!data_.is_empty() && at_us <= last_us_) {
      ++times_back_;
      return;
    }
    const bool has_gap = !data_.is_empty() && at_us - last_us_ > 2 * life.period_s * us_per_s;
    if (has_gap) spans_.break_off();
    last_us_ = at_us;
    add_sample(row, at_us);
    add_spans(row, at_us, at_us + row.span_ms.value_or(life.period_s * 1000) * us_per_ms);
    add_flow(row);
    last_ = row;
    if (data_.times_us.size() >= options_.samples_max) halve(data_);
  }

  void finish() {
    spans_.end();
    for (std::size_t index = 0; index < data_.cells.size() && index < last_.cells.size(); ++index) {
      data_.cells[index].soc_percent.value = scaled(last_.cells[index].soc_permille, tenth);
      data_.cells[index].health_percent.value = scaled(last_.cells[index].health_by_capacity_permille, tenth);
    }
    note(without_time_, "minutes without a time of the clock are left out");
    note(of_another_pack_, "minutes of a pack with other modules are left out");
    note(times_back_, "minutes are left out, as the clock had been set back");
  }

 private:
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
  }

  void add_spans(const HistoryRow& row, std::int64_t at_us, std::int64_t end_us) {
    spans_.begin_minute(at_us);
    if (!row.phase.empty()) spans_.add({.kind = SpanKind::phase, .name = row.phase, .text = row.phase, .place = {}});
    if (row.closed_ms.value_or(0) > 0) {
      spans_.add(
          {.kind = SpanKind::contactor, .name = "main contactors", .text = "main contactors closed", .place = {}});
    }
    const std::pair<SpanKind, std::string_view> lists[] = {{SpanKind::fault, row.faults},
                                                           {SpanKind::warning, row.warnings}};
    for (const auto& [kind, list] : lists) {
      for (const std::string& name : names_in(list)) {
        const FaultRow* const fault = fault_called(name);
        spans_.add({.kind = kind, .name = name, .text = fault ? std::string(fault->meaning) : name, .place = {}});
      }
    }
    spans_.end_minute(end_us);
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
  const HistoryOptions& options_;
  Spans spans_;
  std::vector<std::size_t> sensors_;  // places of those that are shown in a row's array
  HistoryRow last_;
  std::int64_t last_us_ = 0;
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
  // The pack as it was last: what came before with other modules cannot stand in the same picture.
  const HistoryLife* life = nullptr;
  history.for_each_row(span, [&](const HistoryRow& row) {
    if (row.unix_time_ms) life = history.life_of(row);
    return true;
  });
  if (life == nullptr) return data;
  const HistoryLife last = *life;
  data.source = "the history " + history.path() + " by bmud " + last.version;
  Filler filler(data, last, options);
  history.for_each_row(span, [&](const HistoryRow& row) {
    filler.take(row, *history.life_of(row));
    return true;
  });
  filler.finish();
  history.for_each_event(span, [&](const HistoryEvent& event) {
    if (event.unix_time_ms) data.events.push_back({.at_us = *event.unix_time_ms * us_per_ms, .text = event.text});
    return true;
  });
  for (const std::string& problem : history.problems()) data.notes.push_back(problem);
  return data;
}

}  // namespace bmu::report
