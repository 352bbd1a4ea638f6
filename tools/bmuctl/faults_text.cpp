// The page of "bmuctl faults": present and past faults, then for each of these the freeze frame and the action.
#include <array>
#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

/// Confirmed in this session or a previous one, or pending.
bool has_something(const Reply& fault) {
  return fault["count"].number_or(0) > 0 || fault["is_present"].is_true() || fault["is_warning"].is_true() ||
         fault["stage"].text() != "good";
}

/// True if the fault gets a row: it was detected, or the pack file sets its reaction.
bool is_listed(const Reply& fault) {
  return has_something(fault) || fault["usual_reaction"].is_known();
}

Style style_of(const Reply& fault) {
  if (fault["is_present"].is_true()) return Style::bad;
  return fault["is_warning"].is_true() ? Style::warning : Style::normal;
}

Line row_line(const Reply& fault, const Reply& modules) {
  const Style style = style_of(fault);
  const bool is_mere_warning = fault["is_warning"].is_true() && !fault["is_present"].is_true();
  return {{fault["name"].text(), style},
          {fault["stage"].text() + (is_mere_warning ? ", warning" : ""), style},
          plain(shown(fault["count"], Unit::none)),
          {fault["reaction"].text() + (fault["usual_reaction"].is_known() ? ", by the pack file" : ""), Style::dim},
          plain(fault_details(fault, modules))};
}

/// Joins non-empty parts with "; ".
void add_part(std::string& text, const std::string& part) {
  if (!part.empty()) text += (text.empty() ? "" : "; ") + part;
}

struct FrameRow {
  std::string_view label;
  std::string_view key;  // with its unit
  Unit unit;
  std::string_view place = {};  // the key of the position of the value
};
constexpr std::array frame_table{
    FrameRow{"pack", "pack_voltage_mV", Unit::mV},
    FrameRow{"DC link", "link_voltage_mV", Unit::mV},
    FrameRow{"sum of cells", "cell_voltage_sum_mV", Unit::mV},
    FrameRow{"sum of module voltages", "module_voltage_sum_mV", Unit::mV},
    FrameRow{"current", "current_mA", Unit::mA},
    FrameRow{"second sensor", "current_2_mA", Unit::mA},
    FrameRow{"SOC", "soc_permille", Unit::permille},
    FrameRow{"cell voltage min", "cell_voltage_min_uV", Unit::uV, "cell_voltage_min_at"},
    FrameRow{"max", "cell_voltage_max_uV", Unit::uV, "cell_voltage_max_at"},
    FrameRow{"cell temperature min", "cell_temperature_min_dC", Unit::dC, "cell_temperature_min_at"},
    FrameRow{"max", "cell_temperature_max_dC", Unit::dC, "cell_temperature_max_at"},
    FrameRow{"board temperature min", "board_temperature_min_dC", Unit::dC, "board_temperature_min_at"},
    FrameRow{"max", "board_temperature_max_dC", Unit::dC, "board_temperature_max_at"},
    FrameRow{"insulation", "insulation_Ohm", Unit::Ohm},
    FrameRow{"limits: discharge", "discharge_limit_mA", Unit::mA},
    FrameRow{"charge", "charge_limit_mA", Unit::mA},
    FrameRow{"peak budget used: discharge", "discharge_overload_permille", Unit::permille},
    FrameRow{"charge", "charge_overload_permille", Unit::permille},
};

std::string seen_text(const Reply& fault) {
  const std::int64_t count = fault["count"].number_or(0);
  if (count == 0) return has_something(fault) ? "pending" : "never";
  const std::string last = shown_time(fault["last_unix_time_ms"]);
  if (count == 1) return "once, " + last;
  return std::to_string(count) + " times, first " + shown_time(fault["first_unix_time_ms"]) + ", last " + last;
}

/// The freeze frame: values of the pack when the fault was last confirmed.
std::string frame_text(const Reply& frame) {
  std::string text;
  for (const FrameRow& row : frame_table) {
    if (!frame[row.key].is_known()) continue;
    text += (text.empty()         ? ""
             : row.label == "max" ? " "
                                  : ", ") +
            std::string(row.label) + " " + shown(frame[row.key], row.unit);
    const std::string place = row.place.empty() ? "" : frame[row.place]["text"].text();
    if (!place.empty()) text += " (" + place + ")";
  }
  return text;
}

/// "main_positive, main_negative"; "none".
std::string names_that_are(const Reply& object, bool wanted) {
  std::string names;
  for (const std::string& key : object.keys()) {
    if (object[key].is_boolean() && object[key].is_true() == wanted) names += (names.empty() ? "" : ", ") + key;
  }
  return names.empty() ? "none" : names;
}

/// States of contactors and inputs.
std::string switches_text(const Reply& frame) {
  std::string text;
  if (frame["outputs"].is_known()) add_part(text, "commanded closed: " + names_that_are(frame["outputs"], true));
  if (frame["feedback"].is_known()) add_part(text, "feedback closed: " + names_that_are(frame["feedback"], true));
  const Reply inputs = frame["inputs"];
  if (!inputs.is_known()) return text;
  add_part(text, "inputs active: " + names_that_are(inputs, true));
  add_part(text, "inactive: " + names_that_are(inputs, false));
  add_part(text, "insulation monitor: " + inputs["insulation_state"].text());
  return text;
}

std::string trigger_text(const Reply& frame) {
  std::string text = frame["element"]["text"].text();
  if (frame["threshold_text"].is_known()) {
    text += (text.empty() ? "" : ": ") + frame["value_text"].text() + ", limit " + frame["threshold_text"].text();
  }
  add_part(text, "contactors " + frame["phase"].text());
  if (frame["mode"].is_known()) add_part(text, "pack " + frame["mode"].text());
  return text;
}

std::string cleared_text(const Reply& cleared) {
  const std::string name = cleared["user_name"].text();
  return shown_time(cleared["unix_time_ms"]) + " by " +
         (name.empty() ? "user " + shown(cleared["user_id"], Unit::none) : name) +
         (cleared["authority"].text() == "service" ? ", authorised" : "");
}

/// "open after grace of 250 ms".
std::string reaction_text(const Reply& reaction, const Reply& grace_ms) {
  return reaction.text() + (grace_ms.is_known() ? " of " + shown(grace_ms, Unit::ms) : "");
}

std::string kind_text(const Reply& fault) {
  std::string text = reaction_text(fault["reaction"], fault["grace_ms"]);
  if (fault["usual_reaction"].is_known()) {
    text += " by the pack file, usually " + reaction_text(fault["usual_reaction"], fault["usual_grace_ms"]);
  }
  add_part(text, "affects " + fault["concerns"].text());
  const std::string latch = fault["latch"].text();
  add_part(text, latch == "none" ? "not latched" : "latched " + latch);
  if (fault["dtc"].is_known()) add_part(text, "DTC " + shown(fault["dtc"], Unit::none));
  if (fault["lithiumate_code"].is_known()) {
    add_part(text, "Lithiumate code " + shown(fault["lithiumate_code"], Unit::none));
  }
  return text;
}

void add_details(Page& page, const Reply& fault) {
  page.add({{fault["name"].text(), style_of(fault)}, plain(": " + fault["meaning"].text())});
  page.add_field("  occurred", {plain(seen_text(fault))});
  for (std::size_t i = 0; i < fault["modules"].size(); ++i) {
    page.add_field(i == 0 ? "  affected" : "", {{fault["modules"].at(i).text(), style_of(fault)}});
  }
  if (const Reply frame = fault["freeze_frame"]; frame.is_known()) {
    page.add_field("  frame", {plain(trigger_text(frame))});
    page.add_field("", {{frame_text(frame), Style::dim}});
    if (const std::string switches = switches_text(frame); !switches.empty()) {
      page.add_field("", {{switches, Style::dim}});
    }
  }
  if (fault["cleared"].is_known()) page.add_field("  cleared", {plain(cleared_text(fault["cleared"]))});
  if (fault["is_locked"].is_true()) {
    const bool needs_authority = fault["latch"].text() == "until cleared with authority";
    const std::string until = needs_authority ? "until authorised clear" : "until cleared";
    page.add_field("  latched", {{until + ", persists over restarts", Style::warning}});
  }
  page.add_field("  reaction", {{kind_text(fault), Style::dim}});
  if (!fault["cause"].text().empty()) page.add_field("  cause", {plain(fault["cause"].text())});
  if (!fault["remedy"].text().empty()) page.add_field("  action", {plain(fault["remedy"].text())});
}

}  // namespace

Page fault_page(const Reply& fault, const Reply& modules) {
  Page page;
  add_details(page, fault);
  if (has_something(fault))
    page.add_field("  status", {plain(fault["stage"].text() + ", " + fault_details(fault, modules))});
  return page;
}

Page faults_page(const Reply& reply) {
  return faults_page(reply["faults"], reply["status"]["modules"]);
}

Page faults_page(const Reply& faults, const Reply& modules) {
  Page page;
  std::vector<Line> rows{{{"Fault", Style::dim},
                          {"status", Style::dim},
                          {"count", Style::dim},
                          {"reaction", Style::dim},
                          {"reading", Style::dim}}};
  std::vector<Reply> told;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (!is_listed(faults.at(i))) continue;
    told.push_back(faults.at(i));
    rows.push_back(row_line(told.back(), modules));
  }
  if (!told.empty()) page.add_table(rows, {2});
  for (const Reply& fault : told) {
    page.add({});
    add_details(page, fault);
  }
  if (!told.empty()) page.add({});
  page.add({{(told.empty() ? "No fault recorded; " : "") + std::to_string(faults.size() - told.size()) +
                 (told.empty() ? " monitored" : " others not recorded") + " (all of them: bmuctl --json faults).",
             Style::dim}});
  return page;
}

}  // namespace bmu
