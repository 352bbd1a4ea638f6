#include "tools/bmuctl/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tools/bmuctl/limit_text.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

constexpr int contactors_width = 34;
constexpr std::size_t faults_shown_max = 5;
constexpr int opening_rows_max = 3;
constexpr int cell_rows_min = 2;
constexpr int bar_length_min = 4;  // a shorter one says nothing

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
  canvas.put(1, column, state["close_requested"].is_true() ? "; closing is asked for" : "; nobody asks for closing",
             Style::dim);
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
  const int from = column + 22;
  const int length = canvas.width() - from - 1;
  if (length < bar_length_min) return;
  const int filled = bar.is_known ? static_cast<int>(std::lround(std::clamp(bar.share, 0.0, 1.0) * length)) : 0;
  for (int i = 0; i < length; ++i) {
    canvas.put(row, from + i, i < filled ? glyphs.bar_full : glyphs.bar_empty, i < filled ? bar.style : Style::dim);
  }
}

/// Where a pack voltage lies between all cells at their lower and all at their upper limit.
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
  BarRow bar{.label = "SOC", .value = shown(soc, Unit::permille), .style = Style::good, .is_known = number.has_value()};
  if (number) bar.share = static_cast<double>(*number) / 1000;
  if (number && *number < 200) bar.style = Style::warning;
  return bar;
}

Line limit_line(std::string_view name, const Reply& limit) {
  const std::string cause = limit["cause"].text();
  const bool is_reduced = cause != "continuous";
  Line line{{std::string(name), Style::dim}, {shown(limit["limit_mA"], Unit::mA), Style::strong}};
  line.push_back({"  " + limit_reason(limit), is_reduced ? Style::warning : Style::dim});
  return line;
}

void draw_values(const Reply& reply, const Glyphs& glyphs, int row, Canvas& canvas) {
  const Reply status = reply["status"];
  const int column = contactors_width + 2;
  draw_contactors(status["state"], glyphs, row, canvas);
  const std::array bars{voltage_bar(reply, "pack", "pack_voltage_mV", false),
                        voltage_bar(reply, "link", "link_voltage_mV", true), current_bar(reply), soc_bar(reply)};
  for (std::size_t i = 0; i < bars.size(); ++i) draw_bar(bars[i], glyphs, row + static_cast<int>(i), column, canvas);
  const Reply precharge = status["last_precharge"];
  if (precharge.is_known()) {
    const bool is_good = precharge["was_successful"].is_true();
    canvas.put(
        row + 3, 1,
        std::string(is_good ? "precharged in " : "precharge broken off after ") + shown(precharge["took_ms"], Unit::ms),
        is_good ? Style::dim : Style::warning);
  }
  canvas.put(row + 4, 1, limit_line("discharge limit  ", status["limits"]["discharge"]));
  canvas.put(row + 5, 1, limit_line("charge limit     ", status["limits"]["charge"]));
}

void draw_spread(const Reply& status, const Glyphs& glyphs, int row, Canvas& canvas) {
  const Reply voltage = status["values"]["cell_voltage"];
  const Reply temperature = status["values"]["cell_temperature"];
  int column = canvas.put(row, 1, "Cells ", Style::dim);
  const auto put = [&](std::string_view mark, const Reply& value, const Reply& at) {
    column = canvas.put(row, column, std::string(mark) + shown(value, Unit::uV), Style::strong);
    column = canvas.put(row, column, " " + at["text"].text() + "  ", Style::dim);
  };
  put(glyphs.lowest, voltage["min_uV"], voltage["min_at"]);
  put(glyphs.highest, voltage["max_uV"], voltage["max_at"]);
  canvas.put(
      row, column,
      " " + shown_short(temperature["min_dC"].number(), Unit::dC, 1) + " to " + shown(temperature["max_dC"], Unit::dC));
}

// --- foot -----------------------------------------------------------------------------------------------------------

std::vector<std::string> wrapped(std::string_view text, std::size_t width, std::size_t rows_max, std::string_view cut) {
  std::vector<std::string> rows;
  while (!text.empty() && rows.size() < rows_max) {
    std::size_t length = text.size();
    if (length > width) {
      const std::size_t space = text.rfind(' ', width);
      length = space == std::string_view::npos || space == 0 ? width : space;
    }
    rows.emplace_back(text.substr(0, length));
    text.remove_prefix(std::min(text.find_first_not_of(' ', length), text.size()));
  }
  if (!text.empty() && !rows.empty()) rows.back() += cut;
  return rows;
}

std::vector<Line> fault_lines(const Reply& reply, const Glyphs& glyphs) {
  std::vector<Line> lines;
  const Reply rows = reply["faults"]["faults"];
  for (const bool wants_present : {true, false}) {
    for (std::size_t i = 0; i < rows.size() && lines.size() < faults_shown_max; ++i) {
      const Reply fault = rows.at(i);
      const bool is_present = fault["is_present"].is_true();
      if (is_present != wants_present || (!is_present && !fault["is_warning"].is_true())) continue;
      const Style style = is_present ? Style::bad : Style::warning;
      const std::string stage = is_present ? fault["stage"].text() : "warning";
      lines.push_back({{" " + std::string(glyphs.bullet) + " " + fault["meaning"].text(), style},
                       {" [" + stage + "] ", style},
                       {fault_details(fault, reply["status"]["modules"])}});
    }
  }
  if (lines.empty()) lines.push_back({{" no faults", Style::good}});
  return lines;
}

std::vector<Line> blocker_lines(const Reply& status) {
  std::vector<Line> lines;
  const std::string blockers = shown_list(status["permission"]["blockers"]);
  if (status["state"]["phase"].text() == "open" && !blockers.empty()) {
    lines.push_back({{" may not close: ", Style::dim}, {blockers, Style::warning}});
  }
  return lines;
}

std::vector<Line> history_lines(const Reply& status, const Glyphs& glyphs, const Canvas& canvas) {
  std::vector<Line> lines;
  const Reply drive = status["drive"];
  if (drive.is_known()) lines.push_back({{" drive: ", Style::dim}, {drive_text(drive)}});
  const std::string text = status["last_opening"]["text"].text();
  const auto width = static_cast<std::size_t>(std::max(canvas.width() - 2, 10));
  for (const std::string& row : wrapped(text, width, opening_rows_max, glyphs.cut)) {
    lines.push_back({{" " + row, Style::strong}});
  }
  return lines;
}

std::vector<Line> bus_lines(const Reply& status) {
  std::vector<Line> lines;
  const Reply ports = status["ports"];
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const Reply port = ports.at(i);
    if (i > 0 && port["is_shared"].is_true()) break;
    const bool is_up = port["state"].text() == "up";
    Line line{{" " + port["bus"].text() + " ", Style::dim}, {port["state"].text(), is_up ? Style::good : Style::bad}};
    std::string counts = "  seen back " + shown(port["frames_echoed"], Unit::none);
    if (i == 0) {
      counts += "  heard " + shown(status["receive"]["accepted"], Unit::none) + "  rejected " +
                shown(status["receive"]["rejected"], Unit::none);
    }
    counts += "  failed " + shown(port["sends_failed"], Unit::none) + "  lost " +
              shown(port["frames_lost"], Unit::none) + "  errors " + shown(port["error_frames"], Unit::none);
    line.push_back({counts, Style::dim});
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<Line> foot_lines(const Reply& reply, const Glyphs& glyphs, const Canvas& canvas) {
  const Reply status = reply["status"];
  std::vector<Line> lines = fault_lines(reply, glyphs);
  for (auto& more : {blocker_lines(status), history_lines(status, glyphs, canvas), bus_lines(status)}) {
    lines.insert(lines.end(), more.begin(), more.end());
  }
  return lines;
}

}  // namespace

void put_more(int count, std::string_view things, int row, Canvas& canvas) {
  const std::string text = " + " + std::to_string(count) + " more " + std::string(things) + " (make the window larger)";
  canvas.put(row, 0, std::string(static_cast<std::size_t>(canvas.width()), ' '));
  canvas.put(row, 0, text, Style::warning);
}

void draw_picture(const Reply& reply, std::string_view notice, const Glyphs& glyphs, Canvas& canvas) {
  if (!reply["status"].is_known()) {
    canvas.put(0, 0, notice.empty() ? "waiting for the daemon" : notice, Style::strong);
    return;
  }
  constexpr int values_row = 2;
  constexpr int spread_row = 8;
  constexpr int cells_row = 9;
  draw_title(reply["status"], notice, canvas);
  draw_values(reply, glyphs, values_row, canvas);
  draw_spread(reply["status"], glyphs, spread_row, canvas);

  const std::vector<Line> foot = foot_lines(reply, glyphs, canvas);
  const int room = canvas.height() - cells_row - static_cast<int>(foot.size());
  const int used = draw_cells(reply["cells"], glyphs, cells_row, std::max(room, cell_rows_min), canvas);
  // Where there is room to spare, an empty line tells the cells from the rest.
  int row = cells_row + used + (room > used ? 1 : 0);
  for (const Line& line : foot) canvas.put(row++, 0, line);
  if (row > canvas.height()) put_more(row - canvas.height() + 1, "lines", canvas.height() - 1, canvas);
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
  return phase + "  " + shown(values["pack_voltage_mV"], Unit::mV) + "  link " +
         shown(values["link_voltage_mV"], Unit::mV) + "  " + shown(values["current_mA"], Unit::mA) + "  SOC " +
         shown(status["charge"]["soc_permille"], Unit::permille) + "  cells " +
         volts(values["cell_voltage"]["min_uV"]) + " to " + volts(values["cell_voltage"]["max_uV"]) + " V  " +
         shown_short(values["cell_temperature"]["min_dC"].number(), Unit::dC, 1) + " to " +
         shown(values["cell_temperature"]["max_dC"], Unit::dC) + "  limits " + amperes("discharge") + " / " +
         amperes("charge") + " A  " + faults;
}

}  // namespace bmu
