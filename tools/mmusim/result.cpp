#include "tools/mmusim/result.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace bmu::sim {
namespace {

using Json = nlohmann::ordered_json;

double seconds_of(Duration duration) {
  return std::round(to_s(duration) * 1e6) / 1e6;
}

const ScenarioOutcome* outcome_of(const ScenarioPlayer& script, const ScenarioStep* step) {
  const auto outcomes = script.outcomes();
  // From the latest: news refer to the latest decision.
  const auto found = std::find_if(outcomes.rbegin(), outcomes.rend(),
                                  [step](const ScenarioOutcome& outcome) { return outcome.step == step; });
  return found == outcomes.rend() ? nullptr : &*found;
}

std::string fixed(double value, int decimals) {
  std::array<char, 64> text{};
  (void)std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

/// "a.scn:12:7: at 3 s: waited ..."
std::string failure_text(const Options& options, const ScenarioPlayer& script) {
  std::string place = options.scenario;
  if (const ScenarioLine* line = script.deciding_line()) {
    place += ":" + std::to_string(line->line) + ":" + std::to_string(line->column);
  }
  return place + ": " + script.failure();
}

std::size_t held_count(const ScenarioPlayer& script) {
  const auto outcomes = script.outcomes();
  return static_cast<std::size_t>(
      std::count_if(outcomes.begin(), outcomes.end(), [](const ScenarioOutcome& one) { return one.has_held; }));
}

// --- text -----------------------------------------------------------------------------------------------------------

void print_text(const Options& options, const RunResult& result) {
  const ScenarioPlayer& script = *result.script;
  std::string ran = "ran " + fixed(result.ran_s, 3) + " s";
  if (result.took_s) {
    ran += " in " + fixed(*result.took_s, 3) + " s: " + fixed(result.ran_s / std::max(*result.took_s, 1e-6), 0) +
           " times real time";
  }
  std::printf("%s, seed %s\n", ran.c_str(), std::to_string(options.seed).c_str());
  for (const std::string& line : result.lines) std::printf("%s\n", line.c_str());
  for (const Opening& opening : result.openings.value_or(std::vector<Opening>{})) {
    std::printf("opened at %.3f s: %s\n", opening.at_s, opening.text.c_str());
  }
  if (script.scenario().is_test()) {
    std::printf("script: %s, conditions held: %s\n", std::string(to_text(script.verdict())).c_str(),
                std::to_string(held_count(script)).c_str());
  }
}

// --- JSON -----------------------------------------------------------------------------------------------------------

Json conditions_json(const ScenarioPlayer& script) {
  Json conditions = Json::array();
  for (const ScenarioOutcome& outcome : script.outcomes()) {
    const ScenarioLine& line = script.line_of(*outcome.step);
    conditions.push_back({{"line", line.line},
                          {"column", line.column},
                          {"text", line.text},
                          {"held", outcome.has_held},
                          {"began_at_s", seconds_of(outcome.began_at - script.started_at())},
                          {"ended_at_s", seconds_of(outcome.ended_at - script.started_at())}});
  }
  return conditions;
}

Json result_json(const Options& options, const RunResult& result) {
  const ScenarioPlayer& script = *result.script;
  Json json{{"result", to_text(script.verdict())},
            {"scenario", options.scenario},
            {"pack", options.pack},
            {"seed", options.seed},
            {"ran_s", result.ran_s},
            {"conditions", conditions_json(script)}};
  if (result.took_s) json["took_s"] = *result.took_s;
  if (!script.failure().empty()) json["failure"] = script.failure();
  if (const ScenarioLine* line = script.deciding_line()) json["decided_by_line"] = line->line;
  if (result.events) json["events"] = {{"taken", result.events->taken}, {"refused", result.events->refused}};
  if (result.ended_by_signal) json["ended_by_signal"] = *result.ended_by_signal;
  if (result.openings) {
    json["openings"] = Json::array();
    for (const Opening& opening : *result.openings) {
      json["openings"].push_back({{"at_s", opening.at_s}, {"reason", opening.text}});
    }
  }
  return json;
}

}  // namespace

std::string stop_signal_name(int signal) {
  return signal == SIGINT ? "SIGINT" : "SIGTERM";
}

std::string news_text(const ScenarioPlayer& script, const ScenarioNews& news) {
  const ScenarioLine& line = script.line_of(*news.step);
  if (line.verb == ScenarioVerb::event) return news.step->event.text;
  const ScenarioOutcome* const outcome = outcome_of(script, news.step);
  if (outcome == nullptr || !outcome->has_held) return line.text + ": does not hold";
  if (line.verb != ScenarioVerb::wait) return line.text + ": holds";
  return line.text + ": after " + fixed(to_s(outcome->ended_at - outcome->began_at), 3) + " s";
}

int tell_result(const Options& options, const RunResult& result) {
  const ScenarioPlayer& script = *result.script;
  if (result.ended_by_signal) {
    std::fprintf(stderr, "mmusim: ended by %s after %.3f s\n", result.ended_by_signal->c_str(), result.ran_s);
  }
  if (options.is_json) {
    std::printf("%s\n", result_json(options, result).dump(2).c_str());
  } else if (!options.is_quiet) {
    print_text(options, result);
  }
  std::fflush(stdout);
  if (script.verdict() == ScriptVerdict::passed) return exit_ok;
  std::fprintf(stderr, "mmusim: %s\n", failure_text(options, script).c_str());
  return exit_failed;
}

}  // namespace bmu::sim
