#include "tools/bmudump/line_start.hpp"

#include <algorithm>

namespace bmu::dump {

void LineStart::print(const LogLine& line, TextWriter& out) {
  if (style_.time != TimeForm::none) {
    out.letter('(');
    if (line.number != 0) {
      out.decimal(line.number);
    } else {
      print_time(line.time_us, out);
    }
    out.text(") ");
  }
  out.text(line.bus);
  bus_width_ = std::max(bus_width_, line.bus.size());
  out.spaces(bus_width_ - line.bus.size());
  if (!style_.has_direction) return;
  out.text(line.direction == Direction::sent ? " TX" : line.direction == Direction::received ? " RX" : "  -");
  print_fd_flags(line, out);
}

/// "B" for a faster data phase (BRS), "E" for an error-passive sender (ESI), "-" for neither. Omitted while all frames
/// are classic CAN.
void LineStart::print_fd_flags(const LogLine& line, TextWriter& out) {
  const bool is_classic = line.kind == LogLineKind::frame;
  has_fd_flags_ = has_fd_flags_ || !is_classic;
  if (!has_fd_flags_) return;
  const unsigned flags = is_classic ? 0U : long_frame_of(line).flags;
  out.text((flags & 1U) != 0 ? " B" : " -");
  out.text((flags & 2U) != 0 ? " E" : " -");
}

void LineStart::print_time(std::int64_t time_us, TextWriter& out) {
  if (style_.time == TimeForm::absolute) return out.time(time_us);
  if (style_.time == TimeForm::date) return print_date(time_us, out);
  out.time(time_us - since_us_.value_or(time_us));
  if (style_.time == TimeForm::delta || !since_us_) since_us_ = time_us;
}

void LineStart::print_date(std::int64_t time_us, TextWriter& out) {
  const std::int64_t seconds = time_us / 1'000'000;
  if (seconds != date_s_) {
    date_s_ = seconds;
    const std::time_t at = seconds;
    std::tm parts{};
    const bool is_date = localtime_r(&at, &parts) != nullptr;
    const std::size_t length = is_date ? std::strftime(date_.data(), date_.size(), "%Y-%m-%d %H:%M:%S", &parts) : 0;
    date_[length] = '\0';
  }
  if (date_[0] == '\0') return out.time(time_us);  // a log may hold seconds outside of any calendar
  out.text(date_.data());
  out.letter('.');
  const std::int64_t below_us = time_us % 1'000'000;
  for (std::int64_t weight = 100'000; weight > 0; weight /= 10) {
    out.letter(static_cast<char>('0' + below_us / weight % 10));
  }
}

}  // namespace bmu::dump
