#include "daemon/shell/serial/service_values.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

#include "daemon/shell/serial/history_log.hpp"

namespace bmu {

namespace {

constexpr double uOhm_per_Ohm = 1e6;

std::string resistance_text(const std::optional<std::int32_t>& resistance_uOhm) {
  if (!resistance_uOhm) return "-";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f", *resistance_uOhm / 1e3);
  return text.data();
}

}  // namespace

std::string service_line(const ServiceSecond& second, const HistoryLayout& layout) {
  std::string line = log_line(row_of(second.values, layout)) + " R:";
  for (std::size_t cell = 0; cell < second.values.cell_count; ++cell) {
    line += (cell == 0 ? "" : ",") + resistance_text(second.resistance_uOhm.at(cell));
  }
  return line;
}

ServiceValues::ServiceValues(const Core& core)
    : core_(core), layout_(layout_of(core.config())), averager_(core, period) {}

void ServiceValues::set_wanted(bool is_wanted) {
  is_wanted_ = is_wanted;
  const std::lock_guard lock(mutex_);
  is_new_ = false;
}

std::optional<std::string> ServiceValues::take_line() {
  const std::lock_guard lock(mutex_);
  if (!std::exchange(is_new_, false)) return std::nullopt;
  return service_line(latest_, layout_);
}

/// The first second is dropped: it started before the mode was switched on.
void ServiceValues::decided(TimePoint at, const Decisions& /*decisions*/) {
  if (!is_wanted_) {
    has_begun_ = false;
    return;
  }
  if (!std::exchange(has_begun_, true)) {
    static_cast<void>(averager_.finish(at));
    return;
  }
  if (averager_.update(at)) fill();
}

void ServiceValues::fill() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock.owns_lock()) return;
  latest_.values = averager_.minute();
  for (std::size_t cell = 0; cell < latest_.values.cell_count; ++cell) {
    const ResistanceEstimate estimate = core_.estimate().cell_resistance(cell);
    latest_.resistance_uOhm.at(cell).reset();
    if (estimate.is_known) {
      latest_.resistance_uOhm.at(cell) = static_cast<std::int32_t>(std::lround(estimate.resistance_Ohm * uOhm_per_Ohm));
    }
  }
  is_new_ = true;
}

}  // namespace bmu
