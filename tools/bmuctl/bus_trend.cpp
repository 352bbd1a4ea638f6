#include "tools/bmuctl/bus_trend.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace bmu {

namespace {

constexpr std::int64_t load_span_ms = 2'000;
constexpr std::int64_t trouble_span_ms = 10'000;
constexpr std::int64_t load_high_permille = 700;

std::int64_t answers_missed(const Reply& status) {
  std::int64_t missed = 0;
  for (std::size_t i = 0; i < status["modules"].size(); ++i) {
    missed += status["modules"].at(i)["answers_missed"].number_or(0);
  }
  return missed;
}

std::int64_t rejected(const Reply& status, std::string_view reason) {
  return status["receive"]["rejected_by_reason"][reason].number_or(0);
}

/// Error counters of a bus. Received frames are checked on the internal bus only.
struct TroubleRow {
  std::string_view label;
  bool of_internal_only;
  bool is_told_at_zero;
  std::int64_t (*count)(const Reply& status, const Reply& port);
};
constexpr std::array trouble_table{
    TroubleRow{"errors", false, true,
               [](const Reply&, const Reply& port) { return port["error_frames"].number_or(0); }},
    TroubleRow{"lost", false, true, [](const Reply&, const Reply& port) { return port["frames_lost"].number_or(0); }},
    TroubleRow{"late", true, true, [](const Reply& status, const Reply&) { return rejected(status, "late"); }},
    TroubleRow{"missed", true, true, [](const Reply& status, const Reply&) { return answers_missed(status); }},
    TroubleRow{"bad CRC", true, true, [](const Reply& status, const Reply&) { return rejected(status, "wrong crc"); }},
    TroubleRow{"unsent", false, false,
               [](const Reply&, const Reply& port) { return port["sends_failed"].number_or(0); }},
    TroubleRow{"refused", true, false,
               [](const Reply& status, const Reply&) { return status["receive"]["rejected"].number_or(0); }},
};

bool concerns(const TroubleRow& row, const Reply& port) {
  return !row.of_internal_only || port["port"].text() == "internal";
}

/// The bit rate of the port; if it is unknown, the one planned in the pack file.
std::optional<std::int64_t> rate_of(const Reply& port) {
  const auto found = port["rate_bit_per_s"].number();
  return found ? found : port["rate_planned_bit_per_s"].number();
}

Span load_span(const Reply& port, std::optional<std::int64_t> bit_per_s) {
  if (!bit_per_s) return {"  load --", Style::dim};
  const auto rate = rate_of(port);
  if (!rate || *rate <= 0) return {"  load " + std::to_string(*bit_per_s / 1000) + " kbit/s", Style::normal};
  const std::int64_t permille = *bit_per_s * 1000 / *rate;
  return {"  load " + std::to_string((permille + 5) / 10) + " %",
          permille >= load_high_permille ? Style::warning : Style::normal};
}

/// True if an earlier port has the same bus and is shown already.
bool is_shown_above(const Reply& ports, std::size_t index) {
  for (std::size_t above = 0; above < index; ++above) {
    if (ports.at(above)["bus"].text() == ports.at(index)["bus"].text()) return true;
  }
  return false;
}

}  // namespace

void BusTrend::take(const Reply& status) {
  const auto uptime_ms = status["daemon"]["uptime_ms"].number();
  if (!uptime_ms) return;
  if (!samples_.empty() && *uptime_ms <= samples_.back().uptime_ms) samples_.clear();
  Sample sample{.uptime_ms = *uptime_ms, .ports = {}};
  for (std::size_t i = 0; i < status["ports"].size(); ++i) {
    const Reply port = status["ports"].at(i);
    Port& counted = sample.ports.emplace_back();
    counted.bits = port["bits_seen"].number_or(0);
    for (const TroubleRow& row : trouble_table) counted.troubles.push_back(row.count(status, port));
  }
  if (!samples_.empty() && samples_.back().ports.size() != sample.ports.size()) samples_.clear();
  samples_.push_back(std::move(sample));
  while (samples_.back().uptime_ms - samples_.front().uptime_ms > trouble_span_ms) samples_.pop_front();
}

std::optional<std::int64_t> BusTrend::bit_per_s(std::size_t port) const {
  if (samples_.size() < 2 || port >= samples_.back().ports.size()) return std::nullopt;
  const Sample& last = samples_.back();
  const auto first = std::find_if(samples_.begin(), samples_.end() - 2, [&](const Sample& sample) {
    return last.uptime_ms - sample.uptime_ms <= load_span_ms;
  });
  return (last.ports[port].bits - first->ports[port].bits) * 1000 / (last.uptime_ms - first->uptime_ms);
}

bool BusTrend::has_grown(std::size_t port, const std::string& counter) const {
  const auto* const row = std::find_if(trouble_table.begin(), trouble_table.end(),
                                       [&](const TroubleRow& one) { return one.label == counter; });
  if (samples_.empty() || row == trouble_table.end() || port >= samples_.back().ports.size()) return false;
  const auto index = static_cast<std::size_t>(row - trouble_table.begin());
  return samples_.back().ports[port].troubles[index] > samples_.front().ports[port].troubles[index];
}

std::vector<Line> BusTrend::lines(const Reply& status) const {
  std::vector<Line> lines;
  for (std::size_t i = 0; i < status["ports"].size(); ++i) {
    const Reply port = status["ports"].at(i);
    if (is_shown_above(status["ports"], i)) continue;
    const bool is_up = port["state"].text() == "up";
    Line line{{" " + port["bus"].text() + " ", Style::dim}, {port["state"].text(), is_up ? Style::good : Style::bad}};
    line.push_back(load_span(port, bit_per_s(i)));
    for (const TroubleRow& row : trouble_table) {
      if (!concerns(row, port)) continue;
      const std::int64_t count = row.count(status, port);
      if (count == 0 && !row.is_told_at_zero) continue;
      const std::string label(row.label);
      const Style style = count == 0 ? Style::dim : has_grown(i, label) ? Style::warning : Style::normal;
      line.push_back({"  " + label + " " + std::to_string(count), style});
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace bmu
