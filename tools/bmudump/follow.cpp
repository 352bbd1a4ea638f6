#include "tools/bmudump/follow.hpp"

#include <algorithm>

#include <unistd.h>

#include "tools/bmudump/words.hpp"
#include "tools/common/glyphs.hpp"
#include "tools/common/terminal.hpp"

namespace bmu::dump {
namespace {

constexpr std::int64_t window_us = 1'000'000;
// Older than this, and than some periods, a row is greyed: nobody sends it any more, or not now.
constexpr std::int64_t old_us = 1'000'000;
constexpr double old_periods = 5.0;
constexpr std::size_t name_width = 24;
constexpr std::string_view bus_column_title = "bus";
// Of the last table where no window limits it.
constexpr int width_elsewhere = 200;
constexpr int rows_of_piece = 64;
// With fewer in a window, its rate says more of when it began than of them.
constexpr double frames_of_rate = 5.0;

/// As short as it can be told: "0.04 s", "12.3 s", "3 min", "5 h".
std::string duration_text(std::int64_t time_us) {
  const double seconds = static_cast<double>(time_us) * 1e-6;
  if (seconds < 1.0) return formatted("%.3f s", seconds);
  if (seconds < 100.0) return formatted("%.1f s", seconds);
  if (seconds < 6'000.0) return formatted("%.0f min", seconds / 60.0);
  return formatted("%.0f h", seconds / 3'600.0);
}

/// "   3 failed"; empty for none.
std::string count_text(std::uint64_t count, const char* what) {
  return count == 0 ? "" : formatted("   %llu %s", static_cast<unsigned long long>(count), what);
}

std::string rate_text(double per_s) {
  if (per_s <= 0) return "-";
  return formatted(per_s < 100.0 ? "%.1f/s" : "%.0f/s", per_s);
}

}  // namespace

void Follow::Window::look(std::int64_t now_us, double count) {
  if (begin_us == 0) {
    begin_us = now_us;
    count_at_begin = count;
    return;
  }
  const std::int64_t passed_us = now_us - begin_us;
  if (passed_us < window_us) return;
  per_s = (count - count_at_begin) * 1e6 / static_cast<double>(passed_us);
  is_whole = count - count_at_begin >= frames_of_rate;
  begin_us = now_us;
  count_at_begin = count;
}

Follow::Key Follow::key_of(const Bus& bus, const SeenFrame& seen, const IdStatistics* row) {
  const CanFrame& frame = seen.line.frame;
  if (frame.is_error) return {bus.index, Kind::error, 0};
  if (row == nullptr) return {bus.index, Kind::other, 0};
  return {bus.index, frame.is_extended ? Kind::extended : Kind::standard, frame.id};
}

void Follow::note(const Bus& bus, const SeenFrame& seen, const IdStatistics* row) {
  newest_us_ = std::max(newest_us_, seen.line.time_us);
  Row& known = rows_[key_of(bus, seen, row)];
  known.bus = &bus;
  known.statistics = row;
  known.last_us = seen.line.time_us;
  ++known.frames;
  if (known.frames > 1 && known.verdict.is_accepted && !seen.verdict.is_accepted) return;
  known.line = seen.line;
  known.line.bus = bus.name;
  known.verdict = seen.verdict;
}

int Follow::head_rows() const {
  return static_cast<int>(buses_->buses().size()) + 1;
}

std::size_t Follow::rows_in(int height) const {
  return static_cast<std::size_t>(std::max(height - head_rows() - 1, 1));
}

void Follow::draw(std::int64_t now_us, std::size_t first_row, Canvas& canvas) {
  draw_heads(now_us, canvas);
  const std::size_t room = rows_in(canvas.height());
  const std::size_t end = std::min(first_row + room, rows_.size());
  std::size_t index = 0;
  int line = head_rows();
  for (auto& [key, row] : rows_) {
    // Also those outside the window: they are looked at once a second, or their rate would be one of long ago.
    row.window.look(now_us, static_cast<double>(row.frames));
    if (index >= first_row && index < end) draw_row(line++, key, row, now_us, canvas);
    ++index;
  }
  std::string foot = "q: quit";
  if (rows_.size() > room) {
    foot =
        formatted("rows %zu to %zu of %zu   arrows, page up, page down: scroll   ", first_row + 1, end, rows_.size()) +
        foot;
  }
  if (!is_over_) canvas.put(canvas.height() - 1, 0, foot, Style::dim);
}

void Follow::draw_heads(std::int64_t now_us, Canvas& canvas) {
  int line = 0;
  heads_.resize(buses_->buses().size());
  for (const std::unique_ptr<Bus>& bus : buses_->buses()) {
    const BusStatistics& all = bus->statistics;
    Head& head = heads_[bus->index];
    head.frames.look(now_us, static_cast<double>(all.frames));
    head.bits.look(now_us, static_cast<double>(all.bits));
    int column = canvas.put(line, 0, bus->name, Style::strong);
    column = canvas.put(line, column, head_text(all, head));
    column = canvas.put(line, column, count_text(all.failed, "failed"), Style::bad);
    canvas.put(line, column, count_text(all.error, "error frames"), Style::bad);
    ++line;
  }
  canvas.put(
      line, 0,
      bus_column(bus_column_title) + formatted("%-8s  %-*s %9s %9s %9s %9s  %s", "id", static_cast<int>(name_width),
                                               "message", "frames", "rate", "gap max", "age", "values"));
  canvas.fill(line, Style::title);
}

std::string Follow::head_text(const BusStatistics& all, const Head& head) const {
  if (all.frames == 0) return "   no frame yet";
  const bool is_recent = head.frames.is_whole && !is_over_;
  const double over_all = all.span_s() > 0 ? static_cast<double>(all.frames - 1) / all.span_s() : 0.0;
  const double load = is_recent ? head.bits.per_s : all.load_bit_per_s();
  return formatted("   %llu frames   ", static_cast<unsigned long long>(all.frames)) +
         rate_text(is_recent ? head.frames.per_s : over_all) +
         formatted("   load %.1f %% of %u kbit/s", 100.0 * load / static_cast<double>(bit_rate_),
                   static_cast<unsigned>(bit_rate_ / 1'000));
}

void Follow::draw_row(int line, const Key& key, const Row& row, std::int64_t now_us, Canvas& canvas) {
  const std::int64_t age_us = std::max<std::int64_t>(now_us - row.last_us, 0);
  const double over_all = row.statistics == nullptr ? 0.0 : row.statistics->rate_per_s();
  const bool is_old = age_us > old_us && static_cast<double>(age_us) * over_all > old_periods * 1e6;
  const auto style = [is_old](Style usual) { return is_old ? Style::dim : usual; };
  const std::string rate = rate_text(row.window.is_whole && !is_over_ ? row.window.per_s : over_all);
  const bool has_gap = row.statistics != nullptr && row.statistics->gap_max_us > 0;
  const std::string gap = has_gap ? duration_text(row.statistics->gap_max_us) : "-";
  int column =
      canvas.put(line, 0, bus_column(row.bus->name) + formatted("%-8s  ", id_text(key).c_str()), style(Style::normal));
  column = canvas.put(line, column, formatted("%-*s ", static_cast<int>(name_width), row_name(key, row).c_str()),
                      style(Style::strong));
  column = canvas.put(
      line, column, formatted("%9llu %9s %9s ", static_cast<unsigned long long>(row.frames), rate.c_str(), gap.c_str()),
      style(Style::normal));
  column = canvas.put(line, column, formatted("%9s", duration_text(age_us).c_str()),
                      is_old ? Style::warning : Style::normal);
  const std::string failures = row.statistics == nullptr ? "" : failures_text(*row.statistics);
  if (!failures.empty()) column = canvas.put(line, column, "  !! " + failures, Style::bad);
  canvas.put(line, column, values_of(row), style(Style::normal));
}

/// Nothing where there is only one.
std::string Follow::bus_column(std::string_view name) const {
  if (buses_->buses().size() < 2) return "";
  std::size_t width = bus_column_title.size();
  for (const std::unique_ptr<Bus>& bus : buses_->buses()) width = std::max(width, bus->name.size());
  return std::string(name) + std::string(width - std::min(width, name.size()) + 2, ' ');
}

std::string Follow::id_text(const Key& key) {
  const Kind kind = std::get<Kind>(key);
  if (kind == Kind::error || kind == Kind::other) return "-";
  return formatted(kind == Kind::extended ? "%08X" : "%03X", static_cast<unsigned>(std::get<std::uint32_t>(key)));
}

std::string Follow::row_name(const Key& key, const Row& row) {
  switch (std::get<Kind>(key)) {
    case Kind::error: return "error frames";
    case Kind::other: return "remote, FD and others";
    default: return name_text(row.verdict.message, row.verdict.node);
  }
}

std::string Follow::values_of(const Row& row) {
  words_.drop_pending();
  words_.begin_line();
  (*formats_)[row.bus->reader].print_meaning({row.line, row.verdict}, words_);
  return std::string(words_.pending());
}

/// In pieces: a canvas for all the rows a hostile log can have would take much memory.
void Follow::print_last(bool is_coloured, TextWriter& out) {
  is_over_ = true;
  const int width = ::isatty(STDOUT_FILENO) != 0 ? window_size().width : width_elsewhere;
  const int height = head_rows() + rows_of_piece + 1;
  for (std::size_t first_row = 0; first_row == 0 || first_row < rows_.size(); first_row += rows_of_piece) {
    Canvas canvas(width, height, glyphs_for_locale().cut);
    draw(newest_us_, first_row, canvas);
    const auto rows = static_cast<int>(std::min<std::size_t>(rows_.size() - first_row, rows_of_piece));
    for (int row = first_row == 0 ? 0 : head_rows(); row < head_rows() + rows; ++row) {
      out.begin_line();
      out.text(canvas.row_text(row, is_coloured) + "\n");
    }
  }
}

}  // namespace bmu::dump
