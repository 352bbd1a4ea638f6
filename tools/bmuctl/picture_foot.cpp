// The lines below the cells, and the pages behind the overview.
#include <algorithm>
#include <array>

#include "tools/bmuctl/limit_text.hpp"
#include "tools/bmuctl/picture.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

constexpr std::size_t faults_shown_max = 5;
constexpr std::size_t fault_rows_max = 2;
constexpr std::size_t opening_rows_max = 3;
constexpr std::size_t page_indent = 12;

/// Adds the first rows of a wrapped line, indented; an omission is marked.
void add_wrapped(std::vector<Line>& lines, const Line& line, std::size_t rows_max, const Glyphs& glyphs, int width) {
  constexpr std::size_t indent = 3;
  std::vector<Line> rows = wrapped(line, static_cast<std::size_t>(std::max(width - 1, 10)), indent);
  if (rows.size() > rows_max) {
    rows.resize(rows_max);
    rows.back().push_back({std::string(glyphs.cut)});
  }
  lines.insert(lines.end(), rows.begin(), rows.end());
}

Line fault_line(const Reply& fault, const Reply& modules, const Glyphs& glyphs) {
  const bool is_present = fault["is_present"].is_true();
  const Style style = is_present ? Style::bad : Style::warning;
  Line line{{" " + std::string(glyphs.bullet) + " " + fault["meaning"].text(), style},
            {" [" + (is_present ? fault["stage"].text() : "warning") + "] ", style},
            {fault_details(fault, modules)}};
  if (!is_present && fault["warning_for_ms"].is_known()) {
    line.push_back({", for " + shown_span(fault["warning_for_ms"])});
  }
  return line;
}

void add_faults(std::vector<Line>& lines, const Reply& reply, const Glyphs& glyphs, int width) {
  const Reply rows = reply["faults"]["faults"];
  std::size_t shown = 0;
  std::size_t left_out = 0;
  for (const bool wants_present : {true, false}) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Reply fault = rows.at(i);
      const bool is_present = fault["is_present"].is_true();
      if (is_present != wants_present || (!is_present && !fault["is_warning"].is_true())) continue;
      if (shown++ >= faults_shown_max) {
        ++left_out;
        continue;
      }
      add_wrapped(lines, fault_line(fault, reply["status"]["modules"], glyphs), fault_rows_max, glyphs, width);
    }
  }
  if (left_out > 0) lines.push_back({{" and " + std::to_string(left_out) + " more (key f)", Style::bad}});
  if (shown == 0) lines.push_back({{" no faults", Style::good}});
}

void add_blockers(std::vector<Line>& lines, const Reply& status, const Glyphs& glyphs, int width) {
  const std::string blockers = shown_list(status["permission"]["blockers"]);
  if (status["state"]["phase"].text() != "open" || blockers.empty()) return;
  add_wrapped(lines, {{" close inhibit: ", Style::dim}, {blockers, Style::warning}}, 2, glyphs, width);
}

void add_history(std::vector<Line>& lines, const Reply& status, const Glyphs& glyphs, int width) {
  const Reply drive = status["drive"];
  if (drive.is_known()) add_wrapped(lines, {{" drive: ", Style::dim}, {drive_text(drive)}}, 2, glyphs, width);
  const std::string text = status["last_opening"]["text"].text();
  if (!text.empty()) add_wrapped(lines, {{" " + text, Style::strong}}, opening_rows_max, glyphs, width);
}

Line note(std::string text) {
  return {{std::move(text), Style::dim}};
}

void add_page(std::vector<Line>& lines, const Page& page, int width) {
  const auto room = static_cast<std::size_t>(std::max(width - 1, 20));
  for (const Line& line : page.lines()) {
    for (Line& row : wrapped(line, room, page_indent)) lines.push_back(std::move(row));
  }
}

std::vector<Line> bus_page(const Reply& status, const BusTrend& trend, int width) {
  std::vector<Line> lines = trend.lines(status);
  lines.push_back({});
  Page page;
  page.add(
      note("load: frames sent and received by bmud over two seconds, relative to the bitrate of the bus or of the pack "
           "file"));
  page.add(
      note("late: answers to an earlier poll; missed: polls without a complete answer; unsent: transmit queue full, or "
           "frame too old to send"));
  page.add({});
  add_page(lines, page, width);
  add_page(lines, buses_page(status), width);
  Page loop;
  loop.add({});
  loop.add_field("Daemon", {{shown(status["daemon"]["ticks"], Unit::none) + " decisions, " +
                             shown(status["daemon"]["ticks_late"], Unit::none) + " late; max. delay " +
                             shown(status["daemon"]["tick_latest_us"], Unit::none) + " us"}});
  add_page(lines, loop, width);
  return lines;
}

std::vector<Line> limits_page(const Reply& reply, int width) {
  constexpr std::array rows{std::pair{"discharge", "Discharge"}, std::pair{"discharge_continuous", " continuous"},
                            std::pair{"charge", "Charging"}, std::pair{"charge_continuous", " continuous"}};
  Page page;
  for (const auto& [key, label] : rows) {
    const Reply limit = reply["status"]["limits"][key];
    page.add_field(label, {{shown(limit["limit_mA"], Unit::mA), Style::strong}, {"  " + limit_reason(limit)}});
  }
  page.add({});
  std::vector<Line> lines;
  add_page(lines, page, width);
  add_page(lines, why_page(reply["why"]), width);
  return lines;
}

std::vector<Line> help_page(const Glyphs& glyphs, int width) {
  Page page;
  const auto key = [&page](std::string_view keys, std::string text) { page.add_field(keys, {{std::move(text)}}); };
  page.add({{"Keys", Style::strong}});
  key("  q Ctrl-C", "end");
  key("  arrows", "scroll by a line; also j and k");
  key("  PgUp PgDn", "scroll by a page; also the space bar. Home and End: to the ends");
  key("  a", "cells as detailed as all of them fit");
  key("  b", "cells as large bars with numbers, as many as fit; scroll to the others");
  key("  n", "cells as numbers");
  key("  z", "bars from the lowest to the highest cell, or again from limit to limit");
  key("  f", "all faults, with readings and actions");
  key("  l", "current limits with their causes, and the reasons for the state of the pack");
  key("  u", "the buses and the modules on them");
  key("  o Esc", "back to the pack; Tab: the next page");
  page.add({});
  page.add({{"Signs", Style::strong}});
  key("  " + std::string(glyphs.lowest) + " " + std::string(glyphs.highest), "the pack's lowest and highest cell");
  key("  b", "is bled by its module; B: and is the lowest or highest");
  key("  " + std::string(glyphs.levels.front()) + " to " + std::string(glyphs.levels.back()),
      "a cell's voltage, in eighths of the way from the lower limit to the upper");
  key("  ?  --", "unknown: never received, stale or implausible");
  key("  " + std::string(glyphs.contact_closed) + " " + std::string(glyphs.contact_open) + " " +
          std::string(glyphs.contact_differs),
      "contactor closed, open, or feedback mismatch");
  std::vector<Line> lines;
  add_page(lines, page, width);
  return lines;
}

}  // namespace

std::vector<Line> foot_lines(const Reply& reply, const BusTrend& trend, const Glyphs& glyphs, int width) {
  const Reply status = reply["status"];
  std::vector<Line> lines;
  add_faults(lines, reply, glyphs, width);
  add_blockers(lines, status, glyphs, width);
  for (Line& line : trend.lines(status)) lines.push_back(std::move(line));
  add_history(lines, status, glyphs, width);
  return lines;
}

std::vector<Line> topic_lines(PictureTopic topic, const Reply& reply, const BusTrend& trend, const Glyphs& glyphs,
                              int width) {
  std::vector<Line> lines;
  switch (topic) {
    case PictureTopic::overview: break;
    case PictureTopic::faults:
      add_page(lines, faults_page(reply["faults"]["faults"], reply["status"]["modules"]), width);
      break;
    case PictureTopic::limits: return limits_page(reply, width);
    case PictureTopic::buses: return bus_page(reply["status"], trend, width);
    case PictureTopic::help: return help_page(glyphs, width);
  }
  return lines;
}

}  // namespace bmu
