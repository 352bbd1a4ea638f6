#include "tools/bmuctl/text_pages.hpp"

#include <array>
#include <cstdio>
#include <utility>

#include "tools/bmuctl/limit_text.hpp"

namespace bmu {

namespace {

std::string yes_no(const Reply& value, std::string_view yes, std::string_view no) {
  if (!value.is_known()) return "unknown";
  return std::string(value.is_true() ? yes : no);
}

std::string place(const Reply& element) {
  const std::string text = element["text"].text();
  return text.empty() ? "" : " (" + text + ")";
}

Line spread_line(const Reply& spread, Unit unit) {
  const auto value = [&](std::string_view name) {
    return shown(spread[std::string(name) + "_" + std::string(spec_of(unit).token)], unit);
  };
  return {plain("min " + value("min") + place(spread["min_at"]) + "   average " + value("average") + "   max " +
                value("max") + place(spread["max_at"])),
          {"   " + std::to_string(spread["count"].number_or(0)) + " of " +
               std::to_string(spread["expected"].number_or(0)) + " known",
           Style::dim}};
}

constexpr std::array<std::pair<std::string_view, std::string_view>, 3> contactor_names{
    {{"main_negative", "main negative"}, {"precharge", "precharge"}, {"main_positive", "main positive"}}};

constexpr std::array<std::pair<std::string_view, std::string_view>, 4> wear_names{{{"main_negative", "main negative"},
                                                                                   {"precharge", "precharge"},
                                                                                   {"main_positive", "main positive"},
                                                                                   {"charge", "charge"}}};

Line contactor_line(const Reply& state) {
  Line line;
  const Reply feedback = state["feedback"];
  for (const auto& [key, label] : contactor_names) {
    const bool is_wanted = state["outputs"][key].is_true();
    const bool differs = feedback.is_known() && feedback[key].is_true() != is_wanted;
    line.push_back(
        {std::string(label) + " " + yes_no(feedback[key], "closed", "open") + (is_wanted ? " (commanded)" : "") + "   ",
         differs ? Style::warning : Style::normal});
  }
  line.push_back({"feedback " + shown_span(state["feedback_age_ms"]) + " old", Style::dim});
  return line;
}

/// The permitted current now and its reason, and the continuous one if that is lower.
Line limit_line(const Reply& limit, const Reply& for_long) {
  Line line{plain(shown(limit["limit_mA"], Unit::mA)), {"   " + limit_reason(limit), Style::dim}};
  if (for_long["limit_mA"].number_or(0) < limit["limit_mA"].number_or(0)) {
    line.push_back(
        {"   continuous " + shown(for_long["limit_mA"], Unit::mA) + ", " + limit_reason(for_long), Style::dim});
  }
  return line;
}

/// Permissible power in both directions, with its cause if that differs from the cause of the current limit.
Line power_line(const Reply& status) {
  Line line;
  const auto add = [&](const char* name, const Reply& power, const Reply& limit) {
    const bool is_same = power["cause"].text() == limit["cause"].text();
    line.push_back(plain((line.empty() ? "" : "   ") + std::string(name) + " " + shown(power["limit_W"], Unit::W) +
                         (is_same ? "" : " (" + power["cause"].text() + ")")));
  };
  add("discharge", status["power_limits"]["discharge"], status["limits"]["discharge"]);
  add("charge", status["power_limits"]["charge"], status["limits"]["charge"]);
  return line;
}

/// The request to the chargers, and the output of each unit, or that its messages are missing.
void add_charger(Page& page, const Reply& charger) {
  if (!charger.is_known()) return;
  const std::string held = charger["is_held"].is_true() ? ", the highest cell held at " : "";
  Line line{plain(charger["stage"].text())};
  if (charger["asked_mA"].number_or(0) > 0) {
    line.push_back(plain(", requested " + shown(charger["asked_mA"], Unit::mA) + held +
                         (held.empty() ? "" : shown(charger["cell_full_uV"], Unit::uV))));
  }
  for (std::size_t index = 0; index < charger["units"].size(); ++index) {
    const Reply unit = charger["units"].at(index);
    const std::string number = charger["units"].size() > 1 ? shown(unit["unit"], Unit::none) + ": " : "";
    if (!unit["is_talking"].is_true()) {
      line.push_back({"   " + number + "silent", Style::warning});
      continue;
    }
    line.push_back({"   " + number + shown(unit["current_mA"], Unit::mA) + " at " + shown(unit["voltage_mV"], Unit::mV),
                    Style::dim});
    const std::string troubles = shown_list(unit["troubles"]);
    if (!troubles.empty()) line.push_back({"   " + troubles, Style::warning});
  }
  if (charger["goes_on_when_heard"].is_true())
    line.push_back({"   continues when its reports are received again", Style::warning});
  page.add_field("Charger", std::move(line));
}

/// The state of the sensor's set-up, if it is polled, and the values of both sensors.
void add_sensor(Page& page, const Reply& sensor) {
  Line line;
  for (const auto& [key, label] : {std::pair{"set_up", ""}, std::pair{"second_set_up", "   the second "}}) {
    const Reply set_up = sensor[key];
    if (!set_up.is_known()) continue;
    const Style style = set_up["results_count"].is_true() ? Style::normal : Style::warning;
    line.push_back({label + set_up["protocol"].text() + " " + set_up["stage"].text(), style});
    if (set_up["problem"].is_known()) line.push_back({"   " + set_up["problem"].text(), Style::warning});
  }
  if (sensor["second"].is_known()) {
    line.push_back(plain((line.empty() ? "" : "   ") + shown(sensor["first"]["current_mA"], Unit::mA) + " and " +
                         shown(sensor["second"]["current_mA"], Unit::mA)));
  }
  if (!line.empty()) page.add_field("Sensor", std::move(line));
}

/// Values of the insulation monitor on a bus.
void add_insulation(Page& page, const Reply& monitor) {
  if (!monitor.is_known()) return;
  Line line{plain(monitor["protocol"].text() + " " + monitor["state"].text() + "   " +
                  shown(monitor["resistance_Ohm"], Unit::Ohm))};
  if (!monitor["is_talking"].is_true()) line.push_back({"   silent", Style::warning});
  if (monitor["is_low"].is_true()) line.push_back({"   resistance low, reported by the monitor", Style::warning});
  if (monitor["is_test_pending"].is_true()) line.push_back({"   self-test pending", Style::warning});
  if (monitor["is_testing"].is_true()) line.push_back({"   self-test running", Style::dim});
  if (const std::string reasons = shown_counts(monitor["pulses_refused_by_reason"]); !reasons.empty()) {
    line.push_back({"   pulses of no state: " + reasons, Style::warning});
  }
  page.add_field("Insulation", std::move(line));
}

/// Wear of the contactors over all sessions of the daemon.
void add_wear(Page& page, const Reply& contactors) {
  std::vector<Line> rows{{{"Contactor", Style::dim},
                          {"closings", Style::dim},
                          {"openings", Style::dim},
                          {"under load", Style::dim},
                          {"max. break", Style::dim},
                          {"total break", Style::dim}}};
  for (const auto& [key, label] : wear_names) {
    const Reply wear = contactors[key];
    if (wear["closings"].number_or(0) == 0 && wear["openings"].number_or(0) == 0) continue;
    rows.push_back({plain(std::string(label)), plain(shown(wear["closings"], Unit::none)),
                    plain(shown(wear["openings"], Unit::none)), plain(shown(wear["openings_under_load"], Unit::none)),
                    plain(shown(wear["current_broken_max_mA"], Unit::mA)),
                    plain(shown(wear["current_broken_sum_mA"], Unit::mA))});
  }
  if (rows.size() > 1) page.add_table(rows, {1, 2, 3, 4, 5});
}

/// "vehicle", "charger" or both; a fixed text for none.
std::string wish_text(const Reply& wish) {
  std::string text = wish["by_vehicle"].is_true() ? "vehicle" : "";
  if (wish["by_charger"].is_true()) text += text.empty() ? "charger" : " and charger";
  return text.empty() ? "none" : text;
}

Line state_line(const Reply& state) {
  Line line{{state["phase"].text(), style_of_phase(state["phase"].text())},
            plain(" for " + shown_span(state["phase_for_ms"]) + "   mode " + state["mode"].text() + "   requested by " +
                  wish_text(state["wish"]))};
  if (state["rest"].text() == "resting" || state["rest"].text() == "looking") {
    line.push_back({"   " + state["rest"].text() + " for " + shown_span(state["rest_for_ms"]), Style::warning});
  }
  const std::string claim = state["claim"].text();
  if (!claim.empty() && claim != "held") line.push_back({"   " + claim, Style::warning});
  line.push_back({"   reported to vehicle: " + state["vehicle_state"].text(), Style::dim});
  return line;
}

/// Used share of the peak currents and of the precharge resistor; nothing while both are unused.
void add_used(Page& page, const Reply& reply) {
  const Reply overload = reply["overload"];
  if (overload["discharge_used_permille"].number_or(0) > 0 || overload["charge_used_permille"].number_or(0) > 0) {
    page.add_field("Peak used", {plain("discharge " + shown(overload["discharge_used_permille"], Unit::permille) +
                                       "   charge " + shown(overload["charge_used_permille"], Unit::permille))});
  }
  const Reply guard = reply["precharge_guard"];
  if (guard["tries_failed"].number_or(0) == 0 && guard["is_cool"].is_true()) return;
  std::string text = shown(guard["tries_failed"], Unit::none) + " of " + shown(guard["tries_max"], Unit::none) +
                     " attempts failed, heat " + std::to_string(guard["heat_mJ"].number_or(0) / 1'000) + " J";
  if (guard["heat_max_mJ"].is_known()) {
    text += " of " + std::to_string(guard["heat_max_mJ"].number_or(0) / 1'000) + " J";
  }
  page.add_field("Resistor", {{text + (guard["is_cool"].is_true() ? "" : ", cooling down"), Style::warning}});
}

/// Names of the flags that are true.
std::string names_set(const Reply& flags) {
  std::string text;
  for (const std::string& name : flags.keys()) {
    if (flags[name].is_true()) text += (text.empty() ? "" : ", ") + name;
  }
  return text;
}

void add_lines(Page& page, const Reply& lines) {
  if (!lines.is_known()) return;
  const bool is_failed = lines["state"].text() == "failed";
  Line line{{lines["chip"].text() + " " + lines["state"].text(), is_failed ? Style::bad : Style::good}};
  if (is_failed) line.push_back(plain(": " + lines["last_error"].text()));
  const Reply levels = lines["levels"];
  for (const auto& [key, what] :
       {std::pair{"estops_pressed", "emergency stop pressed: "}, std::pair{"interlocks_open", "interlock open: "}}) {
    const std::string names = names_set(levels[key]);
    if (!names.empty()) line.push_back({"   " + std::string(what) + names, Style::bad});
  }
  page.add_field("GPIO", std::move(line));
}

void add_store(Page& page, const Reply& store) {
  if (!store.is_known()) {
    page.add_field("State file", {{"none", Style::dim}});
    return;
  }
  const std::string writes = shown(store["writes"], Unit::none);
  Line line{{store["path"].text() + ", " + writes + (writes == "1" ? " write" : " writes"), Style::dim}};
  if (store["last_error"].is_known()) line.push_back({": " + store["last_error"].text(), Style::bad});
  page.add_field("State file", std::move(line));
}

/// Values of the second pack; a value that was not received recently is a dash.
void add_second_pack(Page& page, const Reply& pack) {
  if (!pack.is_known()) return;
  if (pack["is_silent"].is_true()) {
    const Reply ago = pack["heard_ago_ms"];
    page.add_field("Second pack",
                   {{ago.is_known() ? "silent for " + shown_span(ago) : "never received", Style::warning}});
    return;
  }
  const std::string name = pack["name"].is_known() ? pack["name"].text() + "   " : "";
  page.add_field("Second pack",
                 {plain(name + "SOC " + shown(pack["soc_permille"], Unit::permille) + "   " +
                        shown(pack["pack_voltage_mV"], Unit::mV) + "   " + shown(pack["current_mA"], Unit::mA)),
                  {"   " + pack["state"].text(), Style::dim}});
  const std::int64_t refused = pack["frames_refused"].number_or(0);
  const std::int64_t out_of_range = pack["values_out_of_range"].number_or(0);
  if (refused == 0 && out_of_range == 0) return;
  page.add_field(
      "", {{std::to_string(refused) + " frames refused, " + std::to_string(out_of_range) + " values out of range",
            Style::dim}});
}

void add_recorder(Page& page, const Reply& recorder) {
  if (!recorder.is_known()) return;
  const Reply box = recorder["black_box_path"];
  Line line{{box.is_known() ? "black box " + box.text() : "no black box yet", Style::dim}};
  if (recorder["record_path"].is_known())
    line.push_back({"   recording " + recorder["record_path"].text(), Style::dim});
  for (const char* key : {"black_box_error", "record_error"}) {
    if (recorder[key].is_known()) line.push_back({"   " + recorder[key].text(), Style::bad});
  }
  page.add_field("Recorder", std::move(line));
}

void add_history_store(Page& page, const Reply& history) {
  if (!history.is_known()) return;
  constexpr std::int64_t bytes_per_kB = 1'000;
  const std::string size = std::to_string(history["size_bytes"].number_or(0) / bytes_per_kB) + " kB";
  Line line{
      {history["path"].text() + ", " + shown(history["rows_written"], Unit::none) + " rows since the start, " + size,
       Style::dim}};
  if (history["rows_lost"].number_or(0) > 0) {
    line.push_back({", " + shown(history["rows_lost"], Unit::none) + " rows lost", Style::warning});
  }
  if (history["last_error"].is_known()) line.push_back({": " + history["last_error"].text(), Style::bad});
  page.add_field("History", std::move(line));
  if (history["put_aside"].is_known()) {
    page.add_field("", {{"previous database damaged, moved to " + history["put_aside"].text(), Style::warning}});
  }
}

void add_faults(Page& page, const Reply& reply) {
  const std::string present = shown_list(reply["faults_present"]);
  const std::string warnings = shown_list(reply["warnings"]);
  page.add_field("Faults", {present.empty() ? Span{"none", Style::good} : Span{present, Style::bad}});
  if (!warnings.empty()) page.add_field("Warnings", {{warnings, Style::warning}});
  for (std::size_t i = 0; i < reply["permission"]["blockers"].size(); ++i) {
    page.add_field(i == 0 ? "Inhibit" : "", {{reply["permission"]["blockers"].at(i).text(), Style::warning}});
  }
}

void add_modules(Page& page, const Reply& modules) {
  std::vector<Line> rows{{{"Module", Style::dim},
                          {"state", Style::dim},
                          {"serial", Style::dim},
                          {"answer time", Style::dim},
                          {"complete", Style::dim},
                          {"missed", Style::dim}}};
  for (std::size_t i = 0; i < modules.size(); ++i) {
    const Reply module = modules.at(i);
    const bool is_answering = module["is_answering"].is_true();
    rows.push_back(
        {plain(std::to_string(module["node"].number_or(0))),
         is_answering ? Span{module["mode"].text(), Style::good} : Span{"silent", Style::bad},
         plain(shown(module["serial_number"], Unit::none)), plain(shown(module["answer_latency_ms"], Unit::ms)),
         plain(shown(module["answers_complete"], Unit::none)), plain(shown(module["answers_missed"], Unit::none))});
  }
  page.add_table(rows, {0, 2, 3, 4, 5});
}

std::string kbit_text(const Reply& bit_per_s) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", static_cast<double>(bit_per_s.number_or(0)) / 1000);
  return text.data();
}

/// "500", "125, expected 500"; nothing without a bitrate.
Span rate_span(const Reply& port) {
  if (!port["rate_bit_per_s"].is_known()) return plain("");
  const std::string found = kbit_text(port["rate_bit_per_s"]);
  const std::string verdict = port["rate_verdict"].text();
  if (verdict != "differs" && verdict != "too slow") return plain(found);
  return {found + ", expected " + kbit_text(port["rate_wanted_bit_per_s"]), Style::bad};
}

bool has_controller(const Reply& port) {
  const std::string state = port["controller"]["state"].text();
  return !state.empty() && state != "unknown";
}

Style style_of_controller(std::string_view state) {
  if (state == "error-active") return Style::good;
  return state == "error-warning" ? Style::warning : Style::bad;
}

/// "0 / 128": the current transmit and receive error counters.
std::string error_counters(const Reply& controller) {
  if (!controller["send_errors"].is_known()) return "--";
  return shown(controller["send_errors"], Unit::none) + " / " + shown(controller["receive_errors"], Unit::none);
}

/// The controllers of those buses that have one.
void add_controllers(Page& page, const Reply& ports) {
  std::vector<Line> rows{{{"Controller", Style::dim},
                          {"state", Style::dim},
                          {"TEC / REC", Style::dim},
                          {"bus-off", Style::dim},
                          {"restarts", Style::dim},
                          {"setup", Style::dim}}};
  std::vector<std::string> shown_buses;
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const std::string bus = ports.at(i)["bus"].text();
    const bool is_shown = std::find(shown_buses.begin(), shown_buses.end(), bus) != shown_buses.end();
    if (!has_controller(ports.at(i)) || is_shown) continue;
    shown_buses.push_back(bus);
    const Reply controller = ports.at(i)["controller"];
    const std::string state = controller["state"].text();
    rows.push_back({plain(bus),
                    {state, style_of_controller(state)},
                    plain(error_counters(controller)),
                    plain(shown(controller["times_bus_off"], Unit::none)),
                    plain(shown(controller["restarts"], Unit::none)),
                    plain(controller["set_up"].text())});
  }
  if (rows.size() > 1) page.add_table(rows, {2, 3, 4});
}

void add_buses(Page& page, const Reply& reply) {
  std::vector<Line> rows{{{"Bus", Style::dim},
                          {"", Style::dim},
                          {"state", Style::dim},
                          {"sent", Style::dim},
                          {"echoed", Style::dim},
                          {"failed", Style::dim},
                          {"overruns", Style::dim},
                          {"error frames", Style::dim},
                          {"down count", Style::dim},
                          {"kbit/s", Style::dim}}};
  bool has_rate = false;
  for (std::size_t i = 0; i < reply["ports"].size(); ++i) {
    const Reply port = reply["ports"].at(i);
    has_rate = has_rate || port["rate_bit_per_s"].is_known();
    const bool is_up = port["state"].text() == "up";
    Line row{plain(port["port"].text()),
             plain(port["bus"].text()),
             {port["state"].text(), is_up ? Style::good : Style::bad}};
    for (const auto* key :
         {"frames_sent", "frames_echoed", "sends_failed", "frames_lost", "error_frames", "times_down"}) {
      row.push_back(plain(shown(port[key], Unit::none)));
    }
    row.push_back(rate_span(port));
    rows.push_back(std::move(row));
  }
  if (!has_rate) {
    for (Line& row : rows) row.pop_back();
  }
  page.add_table(rows, {3, 4, 5, 6, 7, 8, 9});
  add_controllers(page, reply["ports"]);
  const Reply receive = reply["receive"];
  Line line{plain(shown(receive["accepted"], Unit::none) + " accepted, " + shown(receive["rejected"], Unit::none) +
                  " rejected")};
  if (const std::string reasons = shown_counts(receive["rejected_by_reason"]); !reasons.empty()) {
    line.push_back(plain(" (" + reasons + ")"));
  }
  for (std::size_t i = 0; i < receive["most_rejected"].size(); ++i) {
    const Reply id = receive["most_rejected"].at(i);
    line.push_back({(i == 0 ? "; most rejected: " : ", ") + id["id"].text() + " " + id["message"].text() + " (" +
                        shown(id["count"], Unit::none) + ")",
                    Style::dim});
  }
  if (receive["sensor_results_refused"].number_or(0) > 0) {
    line.push_back(plain("; sensor results rejected: " + shown(receive["sensor_results_refused"], Unit::none) + " (" +
                         shown_counts(receive["sensor_results_refused_by_reason"]) + "), last " +
                         receive["sensor_result_refused_last"].text()));
  }
  page.add_field("Frames", std::move(line));
}

std::string precharge_text(const Reply& precharge) {
  return std::string(precharge["was_successful"].is_true() ? "" : "aborted after ") +
         shown(precharge["took_ms"], Unit::ms) + ": DC link " + shown(precharge["link_voltage_mV"], Unit::mV) + " of " +
         shown(precharge["pack_voltage_mV"], Unit::mV) + " at " + shown(precharge["current_mA"], Unit::mA) + ", " +
         shown_span(precharge["ended_ago_ms"]) + " ago";
}

void add_history(Page& page, const Reply& reply) {
  if (reply["last_precharge"].is_known()) page.add_field("Precharge", {plain(precharge_text(reply["last_precharge"]))});
  if (reply["drive"].is_known()) page.add_field("Drive", {plain(drive_text(reply["drive"]))});
  if (reply["last_opening"].is_known()) page.add_field("Opening", {plain(reply["last_opening"]["text"].text())});
}

/// The daemon names one module; the number of other silent modules follows from their state.
std::string others_lost(const Reply& modules, std::int64_t named) {
  int count = 0;
  for (std::size_t i = 0; i < modules.size(); ++i) {
    const Reply module = modules.at(i);
    if (module["node"].number_or(0) != named && !module["is_answering"].is_true()) ++count;
  }
  return count == 0 ? "" : " and " + std::to_string(count) + " more";
}

/// The reason why the clear command left this fault; "" if the daemon gives none.
std::string reason_text(const std::string& fault, const Reply& reasons) {
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    if (reasons.at(i)["name"].text() == fault) return reasons.at(i)["text"].text();
  }
  return "";
}

/// The chain of reasons from the observation to the decision.
void add_steps(Page& page, const std::string& title, const Reply& chain) {
  if (chain["steps"].size() == 0) return;
  page.add({});
  page.add({{title + ":", Style::dim}});
  for (std::size_t i = 0; i < chain["steps"].size(); ++i) {
    const Reply step = chain["steps"].at(i);
    page.add_field("  " + step["kind"].text(), {plain(step["text"].text())});
  }
}

}  // namespace

std::string drive_text(const Reply& drive) {
  return std::string(drive["is_running"].is_true() ? "closed for " : "last closed for ") +
         shown_span(drive["lasted_ms"]) + ": charge out " + shown(drive["charge_used_uAs"], Unit::uAs) +
         ", energy out " + shown_energy(drive["energy_out_mWh"]) + ", in " + shown_energy(drive["energy_in_mWh"]);
}

Style style_of_phase(std::string_view phase) {
  if (phase == "closed") return Style::good;
  return phase == "open" ? Style::strong : Style::warning;
}

Style style_within(std::optional<std::int64_t> value, const Reply& limits, Unit unit) {
  if (!value) return Style::bad;
  const auto limit = [&](std::string_view name) {
    return limits[std::string(name) + "_" + std::string(spec_of(unit).token)].number();
  };
  const auto is_below = [&](std::string_view name) { return limit(name) && *value <= *limit(name); };
  const auto is_above = [&](std::string_view name) { return limit(name) && *value >= *limit(name); };
  if (is_below("low_open") || is_above("high_open")) return Style::bad;
  if (is_below("low_warn") || is_above("high_warn")) return Style::warning;
  return Style::normal;
}

std::string fault_details(const Reply& fault, const Reply& modules) {
  const Reply seen = fault["confirmed"].is_known() ? fault["confirmed"] : fault["worst_warning"];
  std::string text = seen["element"]["text"].text();
  if (fault["name"].text() == "module_lost") text += others_lost(modules, seen["element"]["module"].number_or(0));
  // The value is meaningful only in rows with a threshold.
  if (fault["threshold_text"].is_known() && seen.is_known()) {
    text += (text.empty() ? "" : ": ") + seen["value_text"].text() + ", limit " + fault["threshold_text"].text();
  }
  if (fault["details"].is_known()) text += (text.empty() ? "" : ", ") + fault["details"].text();
  if (fault["confirmed_ago_ms"].is_known()) {
    text += (text.empty() ? "" : ", ") + shown_span(fault["confirmed_ago_ms"]) + " ago";
  }
  if (fault["is_restored"].is_true()) text += (text.empty() ? "" : ", ") + std::string("in an earlier session");
  return text;
}

/// The true value lies within two standard deviations in about 95 of 100 cases.
std::string doubt_text(const Reply& sigma_permille) {
  const auto sigma = sigma_permille.number();
  return sigma ? shown_short(2 * *sigma, Unit::permille, 1) + " %" : std::string{};
}

/// The range of the true value in about 95 of 100 cases, and the age of a restored value.
std::string doubt_of(const Reply& charge) {
  const std::string doubt = doubt_text(charge["soc_sigma_permille"]);
  if (doubt.empty()) return {};
  const std::string kept =
      charge["record_age_ms"].is_known() ? ", restored, " + shown_span(charge["record_age_ms"]) + " old" : "";
  return " (+- " + doubt + kept + ")";
}

namespace {

/// Shows known values only: a new pack has no health yet, and an idle pack no time to empty or full.
void add_outlook(Page& page, const Reply& charge, const Reply& health) {
  std::string text;
  const auto add = [&text](const Reply& value, const std::string& shown_value) {
    if (value.is_known()) text += (text.empty() ? "" : "   ") + shown_value;
  };
  const auto sigma_mWh = charge["energy_left_sigma_mWh"].number();
  add(charge["energy_left_mWh"], "energy left " + shown_energy(charge["energy_left_mWh"]) +
                                     (sigma_mWh ? " (+- " + shown_energy(2 * *sigma_mWh) + ")" : ""));
  add(charge["empty_in_ms"], "time to empty " + shown_span(charge["empty_in_ms"]));
  add(charge["full_in_ms"], "time to full " + shown_span(charge["full_in_ms"]));
  add(health["by_capacity_permille"], "SOH " + shown(health["by_capacity_permille"], Unit::permille));
  add(health["pack_resistance_uOhm"], "resistance " + shown(health["pack_resistance_uOhm"], Unit::uOhm));
  if (!text.empty()) page.add_field("Remaining", {plain(text)});
}

}  // namespace

Page buses_page(const Reply& status) {
  Page page;
  add_buses(page, status);
  page.add({});
  add_modules(page, status["modules"]);
  return page;
}

Page status_page(const Reply& reply) {
  Page page;
  const Reply state = reply["state"];
  const Reply values = reply["values"];
  const Reply charge = reply["charge"];
  page.add_field("Pack",
                 {{reply["pack"]["name"].text(), Style::strong},
                  plain(", " + shown(reply["pack"]["cell_count"], Unit::none) + " cells " +
                        reply["pack"]["cell_name"].text() + ", " + shown(reply["pack"]["module_count"], Unit::none) +
                        " modules, configuration " + reply["pack"]["config_hash"].text())});
  page.add_field("State", state_line(state));
  page.add_field("Contactors", contactor_line(state));
  page.add_field("Voltage", {plain("pack " + shown(values["pack_voltage_mV"], Unit::mV) + "   DC link " +
                                   shown(values["link_voltage_mV"], Unit::mV) + "   sum of cells " +
                                   shown(values["cell_voltage_sum_mV"], Unit::mV))});
  page.add_field("Current", {plain(shown(values["current_mA"], Unit::mA))});
  page.add_field("Charge",
                 {plain("SOC " + shown(charge["soc_permille"], Unit::permille) + doubt_of(charge) + "   DoD " +
                        shown(charge["depth_of_discharge_uAs"], Unit::uAs) + " of " +
                        shown(charge["usable_capacity_uAs"], Unit::uAs) + "   energy out " +
                        shown_energy(charge["energy_out_mWh"]) + ", in " + shown_energy(charge["energy_in_mWh"]))});
  add_outlook(page, charge, reply["health"]);
  page.add_field("Cells", spread_line(values["cell_voltage"], Unit::uV));
  page.add_field("Temperature", spread_line(values["cell_temperature"], Unit::dC));
  if (values["intake_air"].is_known()) {
    page.add_field("Intake air", {plain(shown(values["intake_air"]["temperature_dC"], Unit::dC))});
  }
  page.add_field("Discharge", limit_line(reply["limits"]["discharge"], reply["limits"]["discharge_continuous"]));
  page.add_field("Charging", limit_line(reply["limits"]["charge"], reply["limits"]["charge_continuous"]));
  page.add_field("Power", power_line(reply));
  add_charger(page, reply["charger"]);
  if (reply["inverter"].is_known()) page.add_field("Inverter", inverter_line(reply["inverter"]));
  add_sensor(page, reply["sensor"]);
  add_insulation(page, reply["insulation"]);
  if (reply["balancing"]["is_enabled"].is_true()) {
    page.add_field("Balancing", {plain(balancing_text(reply["balancing"]))});
  }
  add_used(page, reply);
  add_faults(page, reply);
  add_history(page, reply);
  add_lines(page, reply["lines"]);
  add_wear(page, reply["contactors"]);
  add_modules(page, reply["modules"]);
  add_buses(page, reply);
  const Reply daemon = reply["daemon"];
  page.add_field("Daemon",
                 {{"bmud " + daemon["version"].text() + ", up " + shown_span(daemon["uptime_ms"]) + ", " +
                       shown(daemon["ticks"], Unit::none) + " ticks, " + shown(daemon["ticks_late"], Unit::none) +
                       " late, log lines lost " + shown(daemon["log_lines_lost"], Unit::none),
                   Style::dim}});
  add_second_pack(page, reply["second_pack"]);
  add_store(page, reply["store"]);
  add_recorder(page, reply["recorder"]);
  add_history_store(page, reply["history"]);
  return page;
}

Page cells_page(const Reply& reply) {
  std::vector<Line> rows{{{"Module", Style::dim},
                          {"Cell", Style::dim},
                          {"No.", Style::dim},
                          {"Voltage", Style::dim},
                          {"SOC", Style::dim},
                          {"+-", Style::dim},
                          {"Age", Style::dim},
                          {"", Style::dim}}};
  Page page;
  for (std::size_t m = 0; m < reply["modules"].size(); ++m) {
    const Reply module = reply["modules"].at(m);
    const Reply voltages = module["cell_voltage_uV"];
    for (std::size_t i = 0; i < voltages.size(); ++i) {
      const auto value = voltages.at(i).number();
      const std::string validity = module["cell_voltage_validity"].at(i).text();
      const std::string notes =
          (validity == "valid" ? "" : validity) + (module["balancing"].at(i).is_true() ? " balancing" : "");
      rows.push_back({plain(shown(module["node"], Unit::none)),
                      plain(std::to_string(i + 1)),
                      plain(std::to_string(module["first_pack_number"].number_or(1) + static_cast<std::int64_t>(i))),
                      {shown(voltages.at(i), Unit::uV), style_within(value, reply["cell_voltage_limits"], Unit::uV)},
                      plain(shown(module["soc_permille"].at(i), Unit::permille)),
                      {doubt_text(module["soc_sigma_permille"].at(i)), Style::dim},
                      {shown(module["cell_voltage_age_ms"].at(i), Unit::ms), Style::dim},
                      plain(notes)});
    }
  }
  page.add_table(rows, {0, 1, 2, 3, 4, 5, 6});
  for (std::size_t m = 0; m < reply["modules"].size(); ++m) {
    const Reply module = reply["modules"].at(m);
    Line line{plain("cells")};
    for (std::size_t i = 0; i < module["cell_temperature_dC"].size(); ++i) {
      const Reply value = module["cell_temperature_dC"].at(i);
      line.push_back(
          {"  " + shown(value, Unit::dC), style_within(value.number(), reply["cell_temperature_limits"], Unit::dC)});
    }
    line.push_back({"   board", Style::dim});
    for (std::size_t i = 0; i < module["board_temperature_dC"].size(); ++i) {
      const Reply value = module["board_temperature_dC"].at(i);
      if (value.is_known()) line.push_back({"  " + shown(value, Unit::dC), Style::dim});
    }
    line.push_back({"   module " + shown(module["module_voltage_mV"], Unit::mV), Style::dim});
    page.add_field("Module " + shown(module["node"], Unit::none), std::move(line));
  }
  page.add_field("Voltages", spread_line(reply["cell_voltage"], Unit::uV));
  page.add_field("Temperature", spread_line(reply["cell_temperature"], Unit::dC));
  return page;
}

Page why_page(const Reply& reply) {
  Page page;
  for (std::size_t i = 0; i < reply["text"].size(); ++i) page.add({plain(reply["text"].at(i).text())});
  add_steps(page, "Last opening", reply["last_opening"]);
  add_steps(page, "Discharge limit", reply["limits"]["discharge"]);
  add_steps(page, "Charge limit", reply["limits"]["charge"]);
  return page;
}

Page clear_page(const Reply& reply) {
  Page page;
  const std::string cleared = shown_list(reply["cleared"]);
  const Reply still = reply["still_present"];
  if (cleared.empty() && still.size() == 0) page.add({plain("No faults to clear.")});
  if (!cleared.empty()) page.add({{"Cleared: " + cleared + ".", Style::good}});
  for (std::size_t i = 0; i < still.size(); ++i) {
    const std::string name = still.at(i).text();
    page.add({{"Still confirmed: " + name + ".", Style::warning}, plain(" " + reason_text(name, reply["reasons"]))});
  }
  return page;
}

bool leaves_faults(const Reply& reply) {
  const Reply still = reply["still_present"];
  const Reply reasons = reply["reasons"];
  std::size_t warnings = 0;
  for (std::size_t i = 0; i < reasons.size(); ++i) warnings += reasons.at(i)["only_warns"].is_true() ? 1U : 0U;
  return still.size() > warnings;
}

Page wake_page(const Reply& reply) {
  Page page;
  const bool was_resting = reply["rest_before"].text() == "resting";
  page.add({plain(was_resting ? "Modules woken." : "Modules already awake.")});
  return page;
}

Page drive_page(const Reply& reply) {
  Page page;
  if (!reply["drive"].is_known()) {
    page.add({plain("No drive cycle since the daemon started.")});
    for (std::size_t i = 0; i < reply["permission"]["blockers"].size(); ++i) {
      page.add({plain("Close inhibit: " + reply["permission"]["blockers"].at(i).text() + ".")});
    }
  }
  add_history(page, reply);
  return page;
}

}  // namespace bmu
