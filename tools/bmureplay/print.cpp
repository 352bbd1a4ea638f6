#include "tools/bmureplay/print.hpp"

#include <array>
#include <cstdio>
#include <ctime>
#include <utility>

#include <nlohmann/json.hpp>

#include "tools/bmureplay/options.hpp"
#include "tools/common/formatted.hpp"

namespace bmu::replay {

namespace {

using Json = nlohmann::ordered_json;

std::string utc_text(std::int64_t log_us) {
  const auto seconds = static_cast<std::time_t>(log_us / 1'000'000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 40> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S", &utc);
  return std::string(text.data(), length) + formatted(".%06d UTC", static_cast<int>(log_us % 1'000'000));
}

std::string count_text(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string since_text(std::int64_t log_us, const Outcome& outcome) {
  return formatted("%+12.6f s", static_cast<double>(log_us - outcome.first_log_us) * 1e-6);
}

void add_head(const Outcome& outcome, std::string& to) {
  if (outcome.counts.ticks == 0) return;
  to += outcome.pack_name + ", recorded by bmud " + outcome.version + "\n";
  for (const BlackBoxHead& box : outcome.black_boxes) {
    to += "black box: " + box.cause + (outcome.black_boxes.size() > 1 ? " (" + box.file + ")" : "") + "\n";
  }
  const double covered_s = to_s(outcome.counts.covered);
  const double took_s = to_s(outcome.took);
  to += formatted("%.1f s from ", covered_s) + utc_text(outcome.first_log_us) + ": " +
        count_text(outcome.counts.ticks, "decision", "decisions") + ", " +
        count_text(outcome.counts.observations, "observation", "observations") + ", " +
        count_text(outcome.counts.begun, "part", "parts") + "\n";
  to += formatted("run in %.3f s, %.0f times as fast as it happened\n", took_s, took_s > 0 ? covered_s / took_s : 0.0);
}

void add_lines(const char* mark, const std::vector<std::string>& lines, std::string& to) {
  for (const std::string& line : lines) to += "    " + std::string(mark) + line.substr(2) + "\n";
}

/// The lines that only one of the two lists has.
std::vector<std::string> only_in(const std::vector<std::string>& lines, const std::vector<std::string>& others) {
  std::vector<std::string> own;
  for (const std::string& line : lines) {
    bool is_shared = false;
    for (const std::string& other : others) is_shared = is_shared || other == line;
    if (!is_shared) own.push_back(line);
  }
  return own;
}

void add_difference(const Difference& difference, std::string& to) {
  to += "  " + utc_text(difference.log_us) + formatted(" (%+.6f s), ", to_s(difference.since_begin)) + difference.file +
        ":" + std::to_string(difference.line) + "\n";
  const auto recorded = only_in(difference.recorded, difference.replayed);
  const auto replayed = only_in(difference.replayed, difference.recorded);
  add_lines("recorded  ", recorded, to);
  add_lines("now       ", replayed, to);
  if (recorded.empty() && replayed.empty()) {
    to += "    only the time of the next decision differs\n";
  }
}

/// Added once for all differences after the same modified lines.
void add_cause(const Difference& difference, std::uint64_t told_line, std::string& to) {
  if (difference.altered_line == 0 || difference.altered_line == told_line) return;
  to += "    preceded by modified lines: " + difference.file + ":" + std::to_string(difference.altered_line) + "\n";
}

void add_differences(const Outcome& outcome, std::string& to) {
  to += "DIFFERENT in " + count_text(outcome.counts.ticks_different, "decision", "decisions") + ", the first:\n";
  std::uint64_t told_line = 0;
  for (const Difference& difference : outcome.differences) {
    add_difference(difference, to);
    add_cause(difference, std::exchange(told_line, difference.altered_line), to);
  }
}

std::string hex_text(const CanFrame& frame) {
  std::string text;
  for (std::size_t index = 0; index < frame.length; ++index) text += formatted("%02X", frame.data[index]);
  return text;
}

void add_moves(const Outcome& outcome, std::string& to) {
  const DecisionChanges& changes = outcome.changes;
  for (const WhatIfMove& move : changes.moves()) {
    to += "  " + since_text(move.log_us, outcome) + (move.is_recorded ? "  recorded:   " : "  simulated:  ") +
          move.text + (move.parts ? " (diverges here)" : "") + "\n";
  }
  if (changes.moves_left_out() > 0) to += "  and " + std::to_string(changes.moves_left_out()) + " more\n";
}

void add_changes(const Outcome& outcome, const std::string& other_name, std::string& to) {
  to += "differences with " + other_name + ":\n";
  add_moves(outcome, to);
  for (const auto& [id, changes] : outcome.changes.reports()) {
    to += "  " + since_text(changes.first.log_us, outcome) + "  " + count_text(changes.count, "report ", "reports ") +
          formatted("%03X", id) + ", the first " + hex_text(changes.first.other) + " instead of " +
          hex_text(changes.first.recorded) + "\n";
  }
}

std::string place_of(const Damage& damage) {
  return damage.file + (damage.line == 0 ? "" : ":" + std::to_string(damage.line));
}

std::string left_out_text(const Damage& damage) {
  std::string text;
  if (damage.not_run_us > 0) text += formatted("; %.1f s are not run", static_cast<double>(damage.not_run_us) * 1e-6);
  if (damage.goes_on_line != 0) text += "; reading goes on at line " + std::to_string(damage.goes_on_line);
  return text;
}

Json damage_json(const Damage& damage) {
  return {{"file", damage.file},
          {"line", damage.line},
          {"text", damage.text},
          {"goes_on_line", damage.goes_on_line == 0 ? Json(nullptr) : Json(damage.goes_on_line)},
          {"not_run_s", damage.not_run_us == 0 ? Json(nullptr) : Json(static_cast<double>(damage.not_run_us) * 1e-6)}};
}

Json difference_json(const Difference& difference) {
  return {{"file", difference.file},
          {"line", difference.line},
          {"unix_time_us", difference.log_us},
          {"recorded", difference.recorded},
          {"replayed", difference.replayed},
          {"altered_line", difference.altered_line == 0 ? Json(nullptr) : Json(difference.altered_line)}};
}

Json black_boxes_json(const Outcome& outcome) {
  Json boxes = Json::array();
  for (const BlackBoxHead& box : outcome.black_boxes) boxes.push_back({{"file", box.file}, {"cause", box.cause}});
  return boxes;
}

Json changes_json(const DecisionChanges& changes) {
  Json moves = Json::array();
  for (const WhatIfMove& move : changes.moves()) {
    moves.push_back({{"unix_time_us", move.log_us}, {"is_recorded", move.is_recorded}, {"text", move.text}});
  }
  Json reports = Json::array();
  for (const auto& [id, change] : changes.reports()) {
    reports.push_back({{"id", id},
                       {"count", change.count},
                       {"first_unix_time_us", change.first.log_us},
                       {"last_unix_time_us", change.last_log_us},
                       {"first_recorded", hex_text(change.first.recorded)},
                       {"first_otherwise", hex_text(change.first.other)}});
  }
  return {{"moves", moves}, {"moves_left_out", changes.moves_left_out()}, {"reports", reports}};
}

}  // namespace

int exit_code_of(const Outcome& outcome) {
  if (!outcome.misfit.empty()) return exit_config;
  if (outcome.counts.ticks_different > 0 || outcome.states_different > 0 || !outcome.changes.is_empty()) {
    return exit_differs;
  }
  if (!outcome.not_replayable.empty() || outcome.has_unreadable_file || outcome.counts.ticks == 0)
    return exit_not_replayable;
  return outcome.damages.empty() ? exit_ok : exit_damaged;
}

std::string outcome_text(const Outcome& outcome, const std::string& other_name) {
  std::string text;
  add_head(outcome, text);
  const bool is_same = outcome.counts.ticks_different == 0 && outcome.changes.is_empty();
  if (outcome.counts.ticks > 0 && is_same) {
    text += other_name.empty() ? "identical: all decisions match the recording" : "no difference with " + other_name;
    if (outcome.states_compared > outcome.states_different) {
      text += ", and " + count_text(outcome.states_compared - outcome.states_different, "part ends", "parts end") +
              " in the state that the next begins with";
    }
    text += "\n";
  }
  if (!is_same && other_name.empty()) add_differences(outcome, text);
  if (!is_same && !other_name.empty()) add_changes(outcome, other_name, text);
  if (outcome.states_different > 0) {
    text += "DIFFERENT: the final state of " + count_text(outcome.states_different, "part", "parts") +
            " differs from the initial state of the next part\n";
  }
  for (const std::string& reason : outcome.not_replayable) text += "cannot be replayed: " + reason + "\n";
  for (const Damage& damage : outcome.damages) {
    text += "damaged: " + place_of(damage) + ": " + damage.text + left_out_text(damage) + "\n";
  }
  for (const Join& join : outcome.joins) {
    text += "note: " + join.file + ":" + std::to_string(join.line) + ": " + join.text + "\n";
  }
  const bool is_empty = outcome.counts.ticks == 0 && outcome.not_replayable.empty() && outcome.damages.empty();
  if (is_empty) text += "no decisions found: nothing recorded yet, or not a recording\n";
  return text;
}

std::string outcome_json(const Outcome& outcome, const std::string& other_name) {
  const bool is_identical =
      outcome.counts.ticks_different == 0 && outcome.states_different == 0 && outcome.changes.is_empty();
  Json json{{"pack", outcome.pack_name},
            {"version", outcome.version},
            {"black_boxes", black_boxes_json(outcome)},
            {"config", other_name.empty() ? Json(nullptr) : Json(other_name)},
            {"config_misfit", outcome.misfit.empty() ? Json(nullptr) : Json(outcome.misfit)},
            {"first_unix_time_us", outcome.first_log_us},
            {"covered_s", to_s(outcome.counts.covered)},
            {"took_s", to_s(outcome.took)},
            {"observations", outcome.counts.observations},
            {"ticks", outcome.counts.ticks},
            {"parts", outcome.counts.begun},
            {"identical", is_identical && outcome.counts.ticks > 0},
            {"ticks_different", outcome.counts.ticks_different},
            {"states_compared", outcome.states_compared},
            {"states_different", outcome.states_different}};
  json["differences"] = Json::array();
  for (const Difference& difference : outcome.differences) json["differences"].push_back(difference_json(difference));
  json["changes"] = changes_json(outcome.changes);
  json["not_replayable"] = outcome.not_replayable;
  json["damages"] = Json::array();
  for (const Damage& damage : outcome.damages) json["damages"].push_back(damage_json(damage));
  json["joins"] = Json::array();
  for (const Join& join : outcome.joins) {
    json["joins"].push_back({{"file", join.file}, {"line", join.line}, {"text", join.text}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace bmu::replay
