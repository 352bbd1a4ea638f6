#include "tools/bmucell/resistance_command.hpp"

#include <cstdio>

#include <nlohmann/json.hpp>

#include "config/cell_config.hpp"
#include "tools/bmucell/chart.hpp"
#include "tools/bmucell/current_steps.hpp"
#include "tools/bmucell/output.hpp"
#include "tools/bmucell/plausible_recording.hpp"
#include "tools/bmucell/resistance_score.hpp"
#include "tools/bmucell/score_terms.hpp"

namespace bmu::cell {

namespace {

using Json = nlohmann::ordered_json;

constexpr double mOhm_per_Ohm = 1e3;

std::string name_of(const ResistanceScore& score) {
  return std::string(resistance_method_names.at(static_cast<std::size_t>(score.method)));
}

void print_json(const ResistanceOptions& options, const ResistanceEvaluation& evaluation) {
  Json scores = Json::array();
  for (const ResistanceScore& score : evaluation.scores) {
    scores.push_back({{"method", name_of(score)},
                      {"charge", score.is_all ? "all" : "above 10 %"},
                      {"pulses", score.pulses},
                      {"told", score.told},
                      {"rms_pct", number_or_null(score.rms_pct)},
                      {"max_pct", number_or_null(score.max_pct)},
                      {"mean_pct", number_or_null(score.mean_pct)},
                      {"within_5_pct", score.within_5_pct},
                      {"inside_uncertainty_pct", number_or_null(score.inside_uncertainty_pct)}});
  }
  const Json all{
      {"file", options.file}, {"table", options.table}, {"column", options.column}, {"scores", std::move(scores)}};
  std::printf("%s\n", all.dump(2).c_str());
}

std::string text_of(const std::optional<double>& value, const char* form) {
  if (!value) return "-";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), form, *value);
  return text.data();
}

void print_table(const ResistanceOptions& options, const ResistanceEvaluation& evaluation) {
  std::printf("resistance, percent off %s in %s\n", options.column.c_str(), options.table.c_str());
  std::printf("method     charge      pulses    told    RMS    max   mean  within 5%%  inside%%\n");
  for (const ResistanceScore& score : evaluation.scores) {
    std::printf("%-10s %-10s %7zu %7zu %6s %6s %6s %10zu %8s\n", name_of(score).c_str(),
                score.is_all ? "all" : "above 10 %", score.pulses, score.told, text_of(score.rms_pct, "%.2f").c_str(),
                text_of(score.max_pct, "%.2f").c_str(), text_of(score.mean_pct, "%+.2f").c_str(), score.within_5_pct,
                text_of(score.inside_uncertainty_pct, "%.0f").c_str());
  }
}

std::optional<double> off_pct(const PulseResult& pulse, std::size_t method) {
  const auto& told = pulse.told.at(method);
  if (!told) return std::nullopt;
  return (told->resistance_Ohm / pulse.reference.resistance_Ohm - 1.0) * percent;
}

/// What was not told is an empty field.
std::string field(const std::optional<double>& value, const char* form) {
  return "," + (value ? text_of(value, form) : std::string{});
}

std::string csv_of(const ResistanceEvaluation& evaluation) {
  std::string text =
      "time_s,ref_soc_pct,temp_C,pulse_A,table_mOhm,recursive_mOhm,recursive_sigma_mOhm,recursive_off_pct,steps_mOhm,"
      "steps_off_pct\n";
  std::array<char, 160> head{};
  for (const PulseResult& pulse : evaluation.pulses) {
    std::snprintf(head.data(), head.size(), "%.10g,%.3f,%.2f,%.4f,%.3f", pulse.time_s, pulse.reference.soc * percent,
                  pulse.reference.temperature_C, pulse.reference.current_A,
                  pulse.reference.resistance_Ohm * mOhm_per_Ohm);
    text += head.data();
    for (std::size_t method = 0; method < resistance_methods; ++method) {
      const auto& told = pulse.told.at(method);
      const auto in_mOhm = [](std::optional<double> value_Ohm) {
        return value_Ohm ? std::optional(*value_Ohm * mOhm_per_Ohm) : std::nullopt;
      };
      text += field(told ? in_mOhm(told->resistance_Ohm) : std::nullopt, "%.3f");
      if (method == 0) text += field(told ? in_mOhm(told->sigma_Ohm) : std::nullopt, "%.3f");
      text += field(off_pct(pulse, method), "%.2f");
    }
    text += "\n";
  }
  return text;
}

std::string svg_of_pulses(const ResistanceOptions& options, const ResistanceEvaluation& evaluation) {
  ChartPanel resistance{.title = "Resistance", .x_label = "state of charge, %", .y_label = "mOhm"};
  ChartPanel off{.title = "Off by", .x_label = "state of charge, %", .y_label = "%"};
  ChartBand around{.label = "two sigma", .color = "#d9602c"};
  ChartLine table{.label = "table", .color = "#0b3c8c"};
  std::array<ChartLine, resistance_methods> told{ChartLine{.label = "recursive", .color = "#d9602c"},
                                                 ChartLine{.label = "steps", .color = "#9a9a9a"}};
  std::array<ChartLine, resistance_methods> error = told;
  for (const PulseResult& pulse : evaluation.pulses) {
    const double x = pulse.reference.soc * percent;
    table.points.push_back({x, pulse.reference.resistance_Ohm * mOhm_per_Ohm});
    for (std::size_t method = 0; method < resistance_methods; ++method) {
      const auto& one = pulse.told.at(method);
      if (!one) continue;
      told.at(method).points.push_back({x, one->resistance_Ohm * mOhm_per_Ohm});
      error.at(method).points.push_back({x, *off_pct(pulse, method)});
      if (!one->sigma_Ohm) continue;
      const double reach_Ohm = band_sigmas * *one->sigma_Ohm;
      around.low.push_back({x, (one->resistance_Ohm - reach_Ohm) * mOhm_per_Ohm});
      around.high.push_back({x, (one->resistance_Ohm + reach_Ohm) * mOhm_per_Ohm});
    }
  }
  resistance.bands = {std::move(around)};
  resistance.lines = {std::move(table), std::move(told[0]), std::move(told[1])};
  off.lines = {std::move(error[0]), std::move(error[1])};
  return svg_of(options.file, {std::move(resistance), std::move(off)});
}

bool write_pulses(const ResistanceOptions& options, const ResistanceEvaluation& evaluation) {
  const bool has_csv = options.csv.empty() || write_file(options.csv, csv_of(evaluation));
  const bool has_svg = options.svg.empty() || write_file(options.svg, svg_of_pulses(options, evaluation));
  return has_csv && has_svg;
}

Result<ResistanceEvaluation, std::string> evaluate_files(const ResistanceOptions& options, const CellFile& cell) {
  const Result<PulseTable, std::string> table = read_pulse_table(options.table, options.column);
  if (!table) return failure(table.error());
  const Result<Series, std::string> series = read_series(options.file);
  if (!series) return failure(series.error());
  if (series->torn_line != 0) complain(torn_line_text(*series));
  for (const std::string& problem : {implausible_time(*series), implausible_values(*series, cell.model)}) {
    if (!problem.empty()) return failure(series->name + problem);
  }
  const CellDynamics dynamics = cell.dynamics.value_or(dynamics_of(cell.model));
  constexpr double s_per_h = 3600.0;
  const std::string current = implausible_answers(*series, dynamics.capacity_As / s_per_h);
  if (!current.empty()) complain("warning: " + series->name + current);
  return evaluate_resistance(dynamics, *series, *table);
}

}  // namespace

int run_resistance(const ResistanceOptions& options) {
  const Result<CellFile, ConfigProblems> cell = load_cell_file(options.cell);
  if (!cell) {
    for (const ConfigProblem& problem : cell.error()) complain(to_text(problem));
    return exit_config;
  }
  const Result<ResistanceEvaluation, std::string> evaluation = evaluate_files(options, *cell);
  if (!evaluation) {
    complain(evaluation.error());
    return exit_data;
  }
  if (!write_pulses(options, *evaluation)) return exit_system;
  if (options.is_json) {
    print_json(options, *evaluation);
  } else {
    print_table(options, *evaluation);
  }
  return exit_ok;
}

}  // namespace bmu::cell
