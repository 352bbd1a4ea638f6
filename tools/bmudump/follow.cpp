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
// A head has what it needs in less than this only if it leaves something out.
constexpr int short_head_width = 72;
// Of the last table where no window limits it.
constexpr int width_elsewhere = 200;
constexpr int rows_of_piece = 64;
// With fewer in a window, its rate says more of when it began than of them.
constexpr double frames_of_rate = 5.0;

/// The shortest form: "0.04 s", "12.3 s", "3 min", "5 h", "19676 d". At most seven letters for any time a log may have,
/// which is the room in its column.
std::string duration_text(std::int64_t time_us) {
  constexpr double hour_s = 3'600.0;
  constexpr double day_s = 24.0 * hour_s;
  constexpr double year_s = 365.25 * day_s;
  const double seconds = static_cast<double>(time_us) * 1e-6;
  if (seconds < 1.0) return formatted("%.2f s", seconds);
  if (seconds < 100.0) return formatted("%.1f s", seconds);
  if (seconds < 6'000.0) return formatted("%.0f min", seconds / 60.0);
  if (seconds < 1'000.0 * hour_s) return formatted("%.0f h", seconds / hour_s);
  return seconds < 99'999.0 * day_s ? formatted("%.0f d", seconds / day_s) : formatted("%.0f y", seconds / year_s);
}

/// Of at most `room` letters, four at least: 1234567, 12345k.
std::string whole_number_text(double number, std::size_t room) {
  std::string text = formatted("%.0f", number);
  for (const char* const unit : {"k", "M", "G", "T", "P"}) {
    if (text.size() <= room) break;
    number /= 1'000.0;
    text = formatted("%.0f%s", number, unit);
  }
  return text;
}

/// "   3 failed"; empty for none.
std::string count_text(std::uint64_t count, const char* what) {
  return count == 0 ? "" : formatted("   %llu %s", static_cast<unsigned long long>(count), what);
}

/// Its end: names of buses differ there.
std::string end_of(const std::string& name, int room) {
  const auto left = static_cast<std::size_t>(std::max(room, 0));
  return name.size() > left ? name.substr(name.size() - left) : name;
}

std::string_view without_first_value(std::string_view values) {
  const std::size_t end = values.find("  ");
  return end == std::string_view::npos ? std::string_view() : values.substr(end + 2);
}

std::string rate_text(double per_s) {
  constexpr std::size_t number_room = 5;  // seven letters with "/s"
  if (per_s <= 0) return "-";
  return per_s < 100.0 ? formatted("%.1f/s", per_s) : whole_number_text(per_s, number_room) + "/s";
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

void Follow::note(const Bus& bus, const SeenFrame& seen, const IdStatistics* row, std::int64_t left_out_us) {
  const std::int64_t at_us = seen.line.time_us - left_out_us;
  newest_us_ = std::max(newest_us_, at_us);
  Row& known = rows_[key_of(bus, seen, row)];
  known.bus = &bus;
  known.statistics = row;
  known.last_us = at_us;
  ++known.frames;
  if (known.frames > 1 && known.verdict.is_accepted && !seen.verdict.is_accepted) return;
  known.line = seen.line;
  known.line.bus = bus.name;
  known.long_frame = seen.line.long_frame;
  known.line.long_frame = known.long_frame;
  known.verdict = seen.verdict;
}

int Follow::head_rows() const {
  return static_cast<int>(buses_->buses().size()) + 1;
}

std::size_t Follow::rows_in(int height) const {
  return static_cast<std::size_t>(std::max(height - head_rows() - 1, 1));
}

FollowColumns Follow::columns_for(int width) const {
  ColumnNeeds needs;
  for (const auto& [key, row] : rows_) {
    needs.id = std::max(needs.id, static_cast<int>(id_text(key).size()));
    needs.name = std::max(needs.name, static_cast<int>(row_name(key, row).size()));
  }
  for (const std::unique_ptr<Bus>& bus : buses_->buses()) {
    if (buses_->buses().size() > 1) needs.bus = std::max(needs.bus, static_cast<int>(width_of(bus->name)));
  }
  return fit_columns(needs, width);
}

void Follow::draw(std::int64_t now_us, const Place& place, Canvas& canvas) {
  draw_in(columns_for(canvas.width()), now_us, place, canvas);
}

void Follow::draw_in(const FollowColumns& columns, std::int64_t now_us, const Place& place, Canvas& canvas) {
  draw_heads(now_us, canvas);
  draw_titles(head_rows() - 1, columns, place.value > 0, canvas);
  value_max_ = 0;
  const std::size_t end = std::min(place.row + rows_in(canvas.height()), rows_.size());
  std::size_t index = 0;
  int line = head_rows();
  for (auto& [key, row] : rows_) {
    // Also those outside the window: they are looked at once a second, or their rate would be one of long ago.
    row.window.look(now_us, static_cast<double>(row.frames));
    if (index >= place.row && index < end) draw_row(line++, key, row, now_us, columns, place.value, canvas);
    ++index;
  }
  if (!is_over_) draw_foot(place.row, end, canvas);
}

void Follow::draw_foot(std::size_t first_row, std::size_t end_row, Canvas& canvas) const {
  const bool has_more_rows = rows_.size() > rows_in(canvas.height());
  const std::string quit = "q: quit";
  std::string place, keys;
  if (has_more_rows) {
    place = formatted("rows %zu to %zu of %zu   ", first_row + 1, end_row, rows_.size());
    keys = "arrows, page up, page down: scroll   ";
  } else if (value_max_ > 0) {
    keys = "arrows: more values   ";
  }
  const bool has_room = width_of(place + keys + quit) <= static_cast<std::size_t>(canvas.width());
  canvas.put(canvas.height() - 1, 0, place + (has_room ? keys : "") + quit, Style::dim);
}

void Follow::draw_heads(std::int64_t now_us, Canvas& canvas) {
  int line = 0;
  heads_.resize(buses_->buses().size());
  for (const std::unique_ptr<Bus>& bus : buses_->buses()) {
    const BusStatistics& all = bus->statistics;
    Head& head = heads_[bus->index];
    head.frames.look(now_us, static_cast<double>(all.frames - all.untimed.frames));
    head.bits.look(now_us, static_cast<double>(all.bits - all.bits_untimed));
    int column = canvas.put(line, 0, bus->name, Style::strong);
    column = canvas.put(line, column, head_text(all, head, canvas.width() < short_head_width));
    column = canvas.put(line, column, count_text(all.failed, "failed"), Style::bad);
    column = canvas.put(line, column, count_text(all.error, "error frames"), Style::bad);
    canvas.put(line, column, count_text(all.lost, "lost"), Style::bad);
    ++line;
  }
}

void Follow::draw_titles(int line, const FollowColumns& columns, bool is_aside, Canvas& canvas) {
  int column = canvas.put_within(line, 0, columns.bus, "bus");
  column = canvas.put_within(line, column, columns.id, "id");
  column = canvas.put_within(line, column, columns.name, "message");
  for (const auto& [title, width] : {std::pair{"frames", columns.frames}, std::pair{"rate", columns.rate},
                                     std::pair{"gap max", columns.gap}, std::pair{"age", columns.age}}) {
    column = canvas.put_within(line, column, width, formatted("%*s", width, title));
  }
  canvas.put(line, column,
             std::string(static_cast<std::size_t>(columns.values_space), ' ') + (is_aside ? "<- values" : "values"));
  canvas.fill(line, Style::title);
}

std::string Follow::head_text(const BusStatistics& all, const Head& head, bool is_short) const {
  if (all.frames == 0) return "   no frame yet";
  const bool is_recent = head.frames.is_whole && !is_over_;
  const double load = is_recent ? head.bits.per_s : all.load_bit_per_s();
  const std::string rate = rate_text(is_recent ? head.frames.per_s : all.frames_per_s());
  const double load_percent = 100.0 * load / static_cast<double>(bit_rate_);
  if (is_short) return formatted("  %s  load %.1f %%", rate.c_str(), load_percent);
  return formatted("   %llu frames   %s   load %.1f %% of %u kbit/s", static_cast<unsigned long long>(all.frames),
                   rate.c_str(), load_percent, static_cast<unsigned>(bit_rate_ / 1'000));
}

void Follow::draw_row(int line, const Key& key, const Row& row, std::int64_t now_us, const FollowColumns& columns,
                      std::size_t first_value, Canvas& canvas) {
  const std::int64_t age_us = std::max<std::int64_t>(now_us - row.last_us, 0);
  const double over_all = row.statistics == nullptr ? 0.0 : row.statistics->rate_per_s();
  const bool is_old = age_us > old_us && static_cast<double>(age_us) * over_all > old_periods * 1e6;
  const auto style = [is_old](Style usual) { return is_old ? Style::dim : usual; };
  const std::string rate = rate_text(row.window.is_whole && !is_over_ ? row.window.per_s : over_all);
  const bool has_gap = row.statistics != nullptr && row.statistics->gap_max_us > 0;
  int column = 0;
  const auto put = [&](int width, const std::string& text, Style usual) {
    canvas.put_within(line, column, width - 1, text, style(usual));
    column += width;
  };
  const auto put_number = [&](int width, const std::string& text, Style usual) {
    canvas.put_within(line, column + 1, width - 1, formatted("%*s", width - 1, text.c_str()), usual);
    column += width;
  };
  put(columns.bus, end_of(row.bus->name, columns.bus - 1), Style::normal);
  put(columns.id, id_text(key), Style::normal);
  put(columns.name, row_name(key, row), Style::strong);
  const auto frames_room = static_cast<std::size_t>(std::max(columns.frames - 1, 0));
  put_number(columns.frames, whole_number_text(static_cast<double>(row.frames), frames_room), style(Style::normal));
  put_number(columns.rate, rate, style(Style::normal));
  put_number(columns.gap, has_gap ? duration_text(row.statistics->gap_max_us) : "-", style(Style::normal));
  put_number(columns.age, row.line.number != 0 ? "-" : duration_text(age_us), is_old ? Style::warning : Style::normal);
  draw_values(line, column + columns.values_space, row, style(Style::normal), first_value, canvas);
}

/// From the value `first_value` on: numbers are whole or not there, as half a number would pass for another.
void Follow::draw_values(int line, int column, const Row& row, Style style, std::size_t first_value, Canvas& canvas) {
  const std::size_t room = static_cast<std::size_t>(std::max(canvas.width() - column, 0));
  const std::string failures = row.statistics == nullptr ? "" : failures_text(*row.statistics);
  const std::string all = (failures.empty() ? "" : "!! " + failures + "  ") + values_of(row);
  std::string_view left = all;
  std::size_t skipped = 0;
  for (; left.size() > room; ++skipped) left = without_first_value(left);
  value_max_ = std::max(value_max_, skipped);
  left = all;
  for (skipped = 0; skipped < first_value; ++skipped) left = without_first_value(left);
  const bool has_failures = !failures.empty() && first_value == 0;
  const std::size_t bad = has_failures ? left.find("  ") : 0;
  canvas.put(line, canvas.put(line, column, left.substr(0, bad), Style::bad), left.substr(std::min(bad, left.size())),
             style);
}

std::string Follow::id_text(const Key& key) {
  const Kind kind = std::get<Kind>(key);
  if (kind == Kind::error || kind == Kind::other) return "-";
  return formatted(kind == Kind::extended ? "%08X" : "%03X", static_cast<unsigned>(std::get<std::uint32_t>(key)));
}

std::string Follow::row_name(const Key& key, const Row& row) {
  switch (std::get<Kind>(key)) {
    case Kind::error: return "error frames";
    case Kind::other: return "remote, FD, other";
    default: return name_text(row.verdict.message, row.verdict.node);
  }
}

std::string Follow::values_of(const Row& row) {
  words_.drop_pending();
  words_.begin_line();
  (*formats_)[row.bus->reader].print_meaning({row.line, row.verdict}, words_);
  const std::string_view words = words_.pending();
  return std::string(words.substr(std::min(words.find_first_not_of(' '), words.size())));
}

/// In pieces: a canvas for all the rows a hostile log can have would take much memory.
void Follow::print_last(bool is_coloured, TextWriter& out) {
  is_over_ = true;
  const int width = ::isatty(STDOUT_FILENO) != 0 ? window_size().width : width_elsewhere;
  const int height = head_rows() + rows_of_piece + 1;
  const FollowColumns columns = columns_for(width);
  for (std::size_t first_row = 0; first_row == 0 || first_row < rows_.size(); first_row += rows_of_piece) {
    Canvas canvas(width, height, glyphs_for_locale().cut);
    draw_in(columns, newest_us_, {.row = first_row}, canvas);
    const auto rows = static_cast<int>(std::min<std::size_t>(rows_.size() - first_row, rows_of_piece));
    for (int row = first_row == 0 ? 0 : head_rows(); row < head_rows() + rows; ++row) {
      out.begin_line();
      out.text(canvas.row_text(row, is_coloured) + "\n");
    }
  }
}

}  // namespace bmu::dump
