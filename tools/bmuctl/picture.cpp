#include "tools/bmuctl/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "tools/bmuctl/limit_text.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

constexpr int contactors_width = 34;
constexpr int cell_rows_min = 2;
constexpr int bar_length_min = 4;  // a shorter one is meaningless

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return text;
}

// --- head -----------------------------------------------------------------------------------------------------------

void draw_title(const Reply& status, std::string_view notice, Canvas& canvas) {
  const Reply state = status["state"];
  const std::string left =
      " " + status["pack"]["name"].text() + "  " + shown(status["pack"]["cell_count"], Unit::none) + " cells";
  const std::string middle = upper(state["phase"].text()) + " for " + shown_span(state["phase_for_ms"]);
  const std::string right = "bmud up " + shown_span(status["daemon"]["uptime_ms"]) + " ";
  const int end = canvas.put(0, 0, left);
  const int wanted = (canvas.width() - static_cast<int>(width_of(middle))) / 2;
  const int middle_end = canvas.put(0, std::max(wanted, end + 2), middle);
  const int right_at = canvas.width() - static_cast<int>(width_of(right));
  if (right_at > middle_end + 1) canvas.put(0, right_at, right);
  canvas.fill(0, Style::title);
  int column = canvas.put(1, 1, "reported: ", Style::dim);
  column = canvas.put(1, column, state["vehicle_state"].text(), style_of_phase(state["phase"].text()));
  canvas.put(1, column, state["close_requested"].is_true() ? "; close request" : "; no close request", Style::dim);
  if (!notice.empty()) {
    const std::string text = " " + std::string(notice) + " ";
    canvas.put(1, std::max(canvas.width() - static_cast<int>(width_of(text)), 0), text, Style::bad);
  }
}

// --- contactors -----------------------------------------------------------------------------------------------------

Span contact(const Reply& state, std::string_view name, const Glyphs& glyphs) {
  const bool is_wanted = state["outputs"][name].is_true();
  if (!state["feedback"].is_known()) return {std::string(glyphs.contact_unknown), Style::bad};
  const bool is_closed = state["feedback"][name].is_true();
  if (is_wanted != is_closed) return {std::string(glyphs.contact_differs), Style::warning};
  return is_closed ? Span{std::string(glyphs.contact_closed), Style::good}
                   : Span{std::string(glyphs.contact_open), Style::normal};
}

std::string wire(const Glyphs& glyphs, int length) {
  std::string text;
  for (int i = 0; i < length; ++i) text += glyphs.line;
  return text;
}

///  pack + ──┬──● main + ─────┬── link +
///           └──○ precharge ──┘
///  pack − ─────● main − ──────── link −
void draw_contactors(const Reply& state, const Glyphs& glyphs, int row, Canvas& canvas) {
  const auto put = [&](int at, std::string left, const Span& sign, std::string right) {
    canvas.put(at, 1, {{std::move(left)}, sign, {std::move(right)}});
  };
  const std::string two = wire(glyphs, 2);
  const std::string minus(glyphs.minus);
  put(row, "pack + " + two + std::string(glyphs.corner_down) + two, contact(state, "main_positive", glyphs),
      " main + " + wire(glyphs, 5) + std::string(glyphs.corner_end) + two + " +");
  put(row + 1, "         " + std::string(glyphs.low_left) + two, contact(state, "precharge", glyphs),
      " precharge " + two + std::string(glyphs.low_right));
  put(row + 2, "pack " + minus + " " + wire(glyphs, 5), contact(state, "main_negative", glyphs),
      " main " + minus + " " + wire(glyphs, 8) + " " + minus);
}

// --- values ---------------------------------------------------------------------------------------------------------

struct BarRow {
  std::string label;
  std::string value;
  double share = 0;  // of the bar, 0 to 1
  Style style = Style::normal;
  bool is_known = false;
};

void draw_bar(const BarRow& bar, const Glyphs& glyphs, int row, int column, Canvas& canvas) {
  canvas.put(row, column, bar.label, Style::dim);
  canvas.put(row, column + 9, bar.value, bar.is_known ? Style::strong : Style::bad);
  const int from = column + 24;
  const int length = canvas.width() - from - 1;
  if (length < bar_length_min) return;
  const int filled = bar.is_known ? static_cast<int>(std::lround(std::clamp(bar.share, 0.0, 1.0) * length)) : 0;
  for (int i = 0; i < length; ++i) {
    canvas.put(row, from + i, i < filled ? glyphs.bar_full : glyphs.bar_empty, i < filled ? bar.style : Style::dim);
  }
}

/// Position of a pack voltage between all cells at their lower and all at their upper limit.
double voltage_share(const Reply& reply, std::int64_t voltage_mV) {
  const Reply limits = reply["cells"]["cell_voltage_limits"];
  const auto cells = static_cast<double>(reply["status"]["pack"]["cell_count"].number_or(1));
  const double low_mV = static_cast<double>(limits["low_open_uV"].number_or(0)) * cells / 1000;
  const double high_mV = static_cast<double>(limits["high_open_uV"].number_or(1)) * cells / 1000;
  return (static_cast<double>(voltage_mV) - low_mV) / std::max(high_mV - low_mV, 1.0);
}

BarRow voltage_bar(const Reply& reply, std::string label, std::string_view key, bool from_zero) {
  const Reply value = reply["status"]["values"][key];
  const auto number = value.number();
  BarRow bar{
      .label = std::move(label), .value = shown(value, Unit::mV), .style = Style::good, .is_known = number.has_value()};
  if (!number) return bar;
  const auto pack_mV = reply["status"]["values"]["pack_voltage_mV"].number();
  bar.share = from_zero && pack_mV && *pack_mV > 0 ? static_cast<double>(*number) / static_cast<double>(*pack_mV)
                                                   : voltage_share(reply, *number);
  return bar;
}

BarRow current_bar(const Reply& reply) {
  const Reply status = reply["status"];
  const auto number = status["values"]["current_mA"].number();
  BarRow bar{
      .label = "current", .value = shown(status["values"]["current_mA"], Unit::mA), .is_known = number.has_value()};
  if (!number) return bar;
  const Reply limit = status["limits"][*number >= 0 ? "discharge" : "charge"]["limit_mA"];
  const auto magnitude = static_cast<double>(*number >= 0 ? *number : -*number);
  const auto limit_mA = static_cast<double>(limit.number_or(0));
  bar.share = limit_mA > 0 ? magnitude / limit_mA : 0;
  bar.style = bar.share > 1 ? Style::warning : Style::good;
  return bar;
}

BarRow soc_bar(const Reply& reply) {
  const Reply soc = reply["status"]["charge"]["soc_permille"];
  const auto number = soc.number();
  const auto sigma = reply["status"]["charge"]["soc_sigma_permille"].number();
  // The true value lies within two standard deviations in about 95 of 100 cases.
  const std::string doubt = sigma ? " +-" + shown_short(2 * *sigma, Unit::permille, 1) : "";
  BarRow bar{.label = "SOC",
             .value = shown(soc, Unit::permille) + doubt,
             .style = Style::good,
             .is_known = number.has_value()};
  if (number) bar.share = static_cast<double>(*number) / 1000;
  if (number && *number < 200) bar.style = Style::warning;
  return bar;
}

/// "discharge  40.000 A  cell voltage low: cell 2.7 (no. 19) at 2.9000 V, zero at 2.8000 V", as far as it fits.
Line limit_line(std::string_view name, const Reply& limit, const Reply& for_long, int width) {
  const bool is_reduced = limit["cause"].text() != "continuous limit" && limit["cause"].text() != "peak";
  const std::string value = shown(limit["limit_mA"], Unit::mA);
  const int room = width - static_cast<int>(width_of(name) + width_of(value)) - 4;
  std::string reason = limit_reason(limit, static_cast<std::size_t>(std::max(room, 1)));
  if (for_long["limit_mA"].number_or(0) < limit["limit_mA"].number_or(0)) {
    const std::string more = ";  " + shown(for_long["limit_mA"], Unit::mA) + " continuous";
    if (static_cast<int>(width_of(reason + more)) <= room) reason += more;
  }
  return {{std::string(name), Style::dim},
          {value, Style::strong},
          {"  " + reason, is_reduced ? Style::warning : Style::dim}};
}

/// The stage of a charge while a vehicle is plugged in; empty if no charger is controlled.
std::string charge_stage(const Reply& status) {
  const std::string stage = status["charger"].is_known() ? status["charger"]["stage"].text() : "off";
  return stage == "off" ? "" : "charge: " + stage;
}

/// The charge stage and the bleeding cells, or the result of the last closing.
void draw_doing(const Reply& status, int row, Canvas& canvas) {
  const Reply precharge = status["last_precharge"];
  const auto on = status["balancing"]["cells_on"].number_or(0);
  std::string doing = charge_stage(status);
  if (on > 0 && doing.empty()) {
    doing = "bleeding " + std::to_string(on) + (on == 1 ? " cell" : " cells");
  } else if (on > 0) {
    doing += ", bleeding " + std::to_string(on);
  }
  if (!doing.empty()) {
    canvas.put(row, 1, doing, Style::active);
  } else if (precharge.is_known()) {
    const bool is_good = precharge["was_successful"].is_true();
    canvas.put(row, 1,
               std::string(is_good ? "precharge done after " : "precharge aborted after ") +
                   shown(precharge["took_ms"], Unit::ms),
               is_good ? Style::dim : Style::warning);
  }
}

void draw_values(const Reply& reply, const Glyphs& glyphs, int row, Canvas& canvas) {
  const Reply status = reply["status"];
  const int column = contactors_width + 2;
  draw_contactors(status["state"], glyphs, row, canvas);
  const std::array bars{voltage_bar(reply, "pack", "pack_voltage_mV", false),
                        voltage_bar(reply, "DC link", "link_voltage_mV", true), current_bar(reply), soc_bar(reply)};
  for (std::size_t i = 0; i < bars.size(); ++i) draw_bar(bars[i], glyphs, row + static_cast<int>(i), column, canvas);
  draw_doing(status, row + 3, canvas);
  const Reply limits = status["limits"];
  canvas.put(row + 4, 1,
             limit_line("discharge  ", limits["discharge"], limits["discharge_continuous"], canvas.width()));
  canvas.put(row + 5, 1, limit_line("charge     ", limits["charge"], limits["charge_continuous"], canvas.width()));
}

/// "cell 2.7 (no. 19)", or "2.7" if that is too long.
std::string place_text(const Reply& at, bool is_short) {
  if (!is_short) return at["text"].text();
  return std::to_string(at["module"].number_or(0)) + "." + std::to_string(at["number"].number_or(0));
}

Line spread_line(const Reply& status, const Glyphs& glyphs, bool is_short) {
  const Reply voltage = status["values"]["cell_voltage"];
  const Reply temperature = status["values"]["cell_temperature"];
  Line line{{" Cells ", Style::dim}};
  const auto add = [&](std::string_view mark, const Reply& value, const Reply& at) {
    line.push_back({std::string(mark) + shown(value, Unit::uV), Style::strong});
    line.push_back({" " + place_text(at, is_short) + "  ", Style::dim});
  };
  add(glyphs.lowest, voltage["min_uV"], voltage["min_at"]);
  add(glyphs.highest, voltage["max_uV"], voltage["max_at"]);
  line.push_back({" " + shown_short(temperature["min_dC"].number(), Unit::dC, 1) + " to " +
                  shown(temperature["max_dC"], Unit::dC)});
  return line;
}

void draw_spread(const Reply& status, const Glyphs& glyphs, int row, Canvas& canvas) {
  Line line = spread_line(status, glyphs, false);
  std::size_t width = 0;
  for (const Span& span : line) width += width_of(span.text);
  if (static_cast<int>(width) > canvas.width()) line = spread_line(status, glyphs, true);
  canvas.put(row, 0, line);
}

// --- the whole ------------------------------------------------------------------------------------------------------

constexpr int values_row = 2;
constexpr int spread_row = 8;
constexpr int cells_row = 9;

struct TopicRow {
  PictureTopic topic;
  std::string_view name;
};
constexpr std::array topic_table{
    TopicRow{PictureTopic::faults, "Faults"},
    TopicRow{PictureTopic::limits, "Limits"},
    TopicRow{PictureTopic::buses, "Buses and modules"},
    TopicRow{PictureTopic::help, "Help"},
};

/// Draws the last row: the keys, and the position on the right.
void draw_keys(const PictureView& view, const std::string& where, Canvas& canvas) {
  const int row = canvas.height() - 1;
  canvas.put(row, 0, std::string(static_cast<std::size_t>(canvas.width()), ' '));
  constexpr std::array overview{"q quit",   "? help",  "arrows scroll", "f faults",
                                "l limits", "u buses", "b n a cells",   "z zoom"};
  constexpr std::array page{"q quit", "? help", "arrows scroll", "o back", "Tab next page"};
  const int end = canvas.width() - (where.empty() ? 0 : static_cast<int>(width_of(where)) + 2);
  int column = 1;
  const auto put = [&](std::string_view key) {
    if (column + static_cast<int>(width_of(key)) > end) return;
    column = canvas.put(row, column, key, Style::dim) + 2;
  };
  if (view.topic == PictureTopic::overview) {
    std::for_each(overview.begin(), overview.end(), put);
  } else {
    std::for_each(page.begin(), page.end(), put);
  }
  canvas.put(row, std::max(canvas.width() - static_cast<int>(width_of(where)) - 1, 0), where, Style::strong);
}

PictureExtent draw_overview(const Reply& reply, const PictureView& view, const BusTrend& trend, const Glyphs& glyphs,
                            Canvas& canvas) {
  draw_values(reply, glyphs, values_row, canvas);
  draw_spread(reply["status"], glyphs, spread_row, canvas);

  const int end = canvas.height() - 1;  // of all rows except the keys
  const std::vector<Line> foot = foot_lines(reply, trend, glyphs, canvas.width());
  const int room = end - cells_row - static_cast<int>(foot.size());
  const CellsDrawn cells = draw_cells(reply["cells"], view, glyphs, cells_row, std::max(room, cell_rows_min), canvas);
  // If there is room to spare, an empty line separates the cells from the lines below.
  int row = cells_row + cells.rows + (room > cells.rows ? 1 : 0);
  for (const Line& line : foot) canvas.put(row++, 0, line);
  if (row > end) put_more(row - end + 1, end - 1, canvas);
  const std::string zoom = view.bars_span_cells ? "zoomed" : "";
  draw_keys(view, zoom + (zoom.empty() || cells.modules.empty() ? "" : ", ") + cells.modules, canvas);
  return cells.extent;
}

PictureExtent draw_topic(const Reply& reply, const PictureView& view, const BusTrend& trend, const Glyphs& glyphs,
                         Canvas& canvas) {
  constexpr int first_row = 3;
  const std::vector<Line> lines = topic_lines(view.topic, reply, trend, glyphs, canvas.width());
  const int total = static_cast<int>(lines.size());
  const int rows = std::max(canvas.height() - 1 - first_row, 1);
  const int first = std::clamp(view.first, 0, std::max(total - rows, 0));
  const int shown = std::min(rows, total - first);
  const auto* const topic = std::find_if(topic_table.begin(), topic_table.end(),
                                         [&](const TopicRow& one) { return one.topic == view.topic; });
  if (topic != topic_table.end()) canvas.put(2, 1, topic->name, Style::strong);
  for (int i = 0; i < shown; ++i) {
    canvas.put(first_row + i, 1, lines[static_cast<std::size_t>(first) + static_cast<std::size_t>(i)]);
  }
  const std::string where = shown == total ? ""
                                           : "lines " + std::to_string(first + 1) + " to " +
                                                 std::to_string(first + shown) + " of " + std::to_string(total);
  draw_keys(view, where, canvas);
  return {.shown = shown, .total = total};
}

}  // namespace

void put_more(int count, int row, Canvas& canvas) {
  const std::string text = " + " + std::to_string(count) + " more lines: keys f, l and u, or a larger window";
  canvas.put(row, 0, std::string(static_cast<std::size_t>(canvas.width()), ' '));
  canvas.put(row, 0, text, Style::warning);
}

PictureExtent draw_picture(const Reply& reply, const PictureView& view, const BusTrend& trend, std::string_view notice,
                           const Glyphs& glyphs, Canvas& canvas) {
  if (!reply["status"].is_known()) {
    canvas.put(0, 0, notice.empty() ? "waiting for the daemon" : notice, Style::strong);
    return {};
  }
  draw_title(reply["status"], notice, canvas);
  if (view.topic == PictureTopic::overview) return draw_overview(reply, view, trend, glyphs, canvas);
  return draw_topic(reply, view, trend, glyphs, canvas);
}

std::string compact_line(const Reply& reply) {
  const Reply status = reply["status"];
  const Reply values = status["values"];
  const auto volts = [&](const Reply& value) { return shown_short(value.number(), Unit::uV, 4); };
  const auto amperes = [&](std::string_view name) {
    return shown_short(status["limits"][name]["limit_mA"].number(), Unit::mA, 1);
  };
  std::string phase = status["state"]["phase"].text();
  phase.resize(std::max<std::size_t>(phase.size(), 13), ' ');
  std::string faults = shown_list(status["faults_present"]);
  const std::string warnings = shown_list(status["warnings"]);
  if (faults.empty()) faults = warnings.empty() ? "no faults" : "warning: " + warnings;
  std::string charge = charge_stage(status);
  if (!charge.empty()) charge += "  ";
  return phase + "  " + shown(values["pack_voltage_mV"], Unit::mV) + "  DC link " +
         shown(values["link_voltage_mV"], Unit::mV) + "  " + shown(values["current_mA"], Unit::mA) + "  SOC " +
         shown(status["charge"]["soc_permille"], Unit::permille) + "  cells " +
         volts(values["cell_voltage"]["min_uV"]) + " to " + volts(values["cell_voltage"]["max_uV"]) + " V  " +
         shown_short(values["cell_temperature"]["min_dC"].number(), Unit::dC, 1) + " to " +
         shown(values["cell_temperature"]["max_dC"], Unit::dC) + "  limits " + amperes("discharge") + " / " +
         amperes("charge") + " A  " + charge + faults;
}

}  // namespace bmu
