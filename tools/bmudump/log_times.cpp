#include "tools/bmudump/log_times.hpp"

#include <algorithm>
#include <ctime>
#include <limits>

#include "tools/bmudump/bus_table.hpp"

namespace bmu::dump {
namespace {

constexpr std::uint32_t in_order_min = 100;  // frames of one bus in order: these are times, and no differences
constexpr std::int64_t quarter_s = 900;      // no local clock is changed within one
constexpr std::int64_t sum_max_us = 1'000'000'000'000'000'000;  // maximum that a log line can hold

}  // namespace

/// candump writes seconds since 1970 in ten digits, and seconds since another line in at least three; below 100 s no
/// other program has that form.
bool LogTimes::are_absolute(std::string_view line) {
  const std::size_t begin = line.find("(0");
  return begin == std::string_view::npos || line.find('.') != begin + 4;
}

void LogTimes::note_order(const LogLine& line) {
  if (line.time_us == 0) return forget_order();  // another log starts, or the line before had the same time
  const auto known =
      std::find_if(buses_.begin(), buses_.end(), [&line](const Bus& bus) { return bus.name == line.bus; });
  if (known == buses_.end()) {
    if (buses_.size() < BusTable::bus_count_max) buses_.push_back({std::string(line.bus), line.time_us, false, 0});
    return;
  }
  if (are_in_order_) return;
  const bool stands_still = line.time_us == known->last_us;
  known->in_order = line.time_us > known->last_us ? known->in_order + 1 : 0;
  are_in_order_ = known->in_order >= in_order_min && !are_differences_;
  are_differences_ = are_differences_ || line.time_us < known->last_us || (stands_still && known->stood_still);
  known->last_us = line.time_us;
  known->stood_still = stands_still;
}

void LogTimes::take(LogLine& line, LogTimeForm form) {
  if (form == LogTimeForm::none) {
    number_ += number_ < std::numeric_limits<std::uint32_t>::max() ? 1U : 0U;
    line.number = number_;
    line.time_us = last_us_;
    return;
  }
  if (form == LogTimeForm::date) {
    line.time_us = utc_us(line.time_us);
  } else {
    if (!are_differences_) note_order(line);
    sum_us_ = std::min(sum_us_ + std::min(line.time_us, sum_max_us), sum_max_us);
    if (are_differences_) line.time_us = sum_us_;
  }
}

/// A local date that occurs twice, or not at all, when clocks are changed is interpreted as one of the two.
std::int64_t LogTimes::utc_us(std::int64_t local_us) {
  const std::int64_t local_s = local_us / 1'000'000;
  if (local_s / quarter_s != quarter_) {
    quarter_ = local_s / quarter_s;
    const std::time_t as_utc = local_s;
    std::tm parts{};
    gmtime_r(&as_utc, &parts);
    parts.tm_isdst = -1;
    const std::time_t utc = std::mktime(&parts);
    offset_s_ = utc < 0 ? 0 : local_s - utc;
  }
  return std::max<std::int64_t>(local_us - offset_s_ * 1'000'000, 0);
}

}  // namespace bmu::dump
