#include "tools/bmucell/eval_command.hpp"

#include <cstdio>
#include <filesystem>

#include <nlohmann/json.hpp>

#include "config/cell_config.hpp"
#include "tools/bmucell/chart.hpp"
#include "tools/bmucell/current_steps.hpp"
#include "tools/bmucell/output.hpp"
#include "tools/bmucell/plausible_recording.hpp"
#include "tools/bmucell/score_terms.hpp"

namespace bmu::cell {

namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Score& score) {
  return {{"file", score.file},
          {"estimator", soc_method_names.at(static_cast<std::size_t>(score.method))},
          {"rmse_pct", score.rmse_pct},
          {"max_pct", score.max_pct},
          {"rmse_after_20min_pct", number_or_null(score.rmse_after_20min_pct)},
          {"max_after_20min_pct", number_or_null(score.max_after_20min_pct)},
          {"settle_3pct_s", number_or_null(score.settle_3pct_s)},
          {"inside_uncertainty_pct", score.inside_uncertainty_pct},
          {"misfit", score.misfit},
          {"rows", score.rows},
          {"rows_left_out",
           {{"before_start", score.left_out.before_start},
            {"time_not_forward", score.left_out.time_not_forward},
            {"without_reference", score.left_out.without_reference}}}};
}

void print_json(const std::vector<Score>& scores) {
  Json files = Json::array();
  for (const Score& score : scores) files.push_back(to_json(score));
  Json mean = to_json(mean_of(scores));
  mean.erase("file");
  std::printf("%s\n", Json{{"files", std::move(files)}, {"mean", std::move(mean)}}.dump(2).c_str());
}

std::string cell_of(const std::optional<double>& value, const char* form) {
  if (!value) return "-";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), form, *value);
  return text.data();
}

void print_line(const Score& score) {
  std::printf("%8.2f %8.2f %8s %8s %8s %7.0f %8zu  %s\n", score.rmse_pct, score.max_pct,
              cell_of(score.rmse_after_20min_pct, "%.2f").c_str(), cell_of(score.max_after_20min_pct, "%.2f").c_str(),
              cell_of(score.settle_3pct_s, "%.0f").c_str(), score.inside_uncertainty_pct, score.rows,
              score.file.c_str());
}

void print_table(const std::vector<Score>& scores) {
  std::printf("state of charge by %s, percent off\n",
              std::string(soc_method_names.at(static_cast<std::size_t>(scores.front().method))).c_str());
  std::printf("    from the start  after 20 min    within   truth\n");
  std::printf("    RMSE      max     RMSE      max   3%%, s  inside%%     rows\n");
  for (const Score& score : scores) print_line(score);
  if (scores.size() > 1) print_line(mean_of(scores));
}

std::string csv_of(const std::vector<TraceRow>& trace) {
  std::string text = "time_s,current_A,voltage_V,temp_C,ref_soc_pct,soc_pct,sigma_pct\n";
  std::array<char, 160> line{};
  for (const TraceRow& row : trace) {
    std::snprintf(line.data(), line.size(), "%.10g,%.5g,%.5f,%.4g,%.3f,%.3f,%.3f\n", row.time_s, row.current_A,
                  row.voltage_V, row.temperature_C, row.true_soc * percent, row.soc * percent, row.sigma * percent);
    text += line.data();
  }
  return text;
}

std::string svg_of_trace(const Evaluation& evaluation) {
  constexpr double minute_s = 60.0;
  ChartPanel charge{.title = "State of charge", .x_label = "minutes", .y_label = "%"};
  ChartPanel off{.title = "Off by", .x_label = "minutes", .y_label = "%"};
  ChartPanel voltage{.title = "Voltage", .x_label = "minutes", .y_label = "V"};
  ChartBand around{.label = "two sigma", .color = "#d9602c"};
  ChartBand allowed{.label = "two sigma", .color = "#d9602c"};
  ChartLine truth{.label = "reference", .color = "#0b3c8c"};
  ChartLine told{.label = "told", .color = "#d9602c"};
  ChartLine error{.label = "told less reference", .color = "#0b3c8c"};
  ChartLine volts{.label = "", .color = "#1f6feb"};
  for (const TraceRow& row : evaluation.trace) {
    const double x = row.time_s / minute_s;
    const double reach = band_sigmas * row.sigma * percent;
    truth.points.push_back({x, row.true_soc * percent});
    told.points.push_back({x, row.soc * percent});
    error.points.push_back({x, (row.soc - row.true_soc) * percent});
    around.low.push_back({x, row.soc * percent - reach});
    around.high.push_back({x, row.soc * percent + reach});
    allowed.low.push_back({x, -reach});
    allowed.high.push_back({x, reach});
    volts.points.push_back({x, row.voltage_V});
  }
  charge.bands = {std::move(around)};
  charge.lines = {std::move(truth), std::move(told)};
  charge.y_range = {0.0, percent};
  off.bands = {std::move(allowed)};
  off.lines = {std::move(error)};
  off.y_range = {-5.0, 5.0};  // a wrong start reaches beyond; what matters is what is left of it
  voltage.lines = {std::move(volts)};
  const std::string name = std::filesystem::path(evaluation.score.file).filename().string();
  return svg_of(name, {std::move(charge), std::move(off), std::move(voltage)});
}

bool write_trace(const EvalOptions& options, const Evaluation& evaluation) {
  const bool has_csv = options.csv.empty() || write_file(options.csv, csv_of(evaluation.trace));
  const bool has_svg = options.svg.empty() || write_file(options.svg, svg_of_trace(evaluation));
  return has_csv && has_svg;
}

}  // namespace

namespace {

/// "9 of 100 rows left out: 2 whose time does not go forward, 7 without ref_soc_pct"
std::string left_out_text(const Score& score) {
  const RowsLeftOut& rows = score.left_out;
  struct Reason {
    std::size_t count;
    const char* text;
  };
  const std::array reasons{Reason{rows.before_start, " before the charge is as low as --from-soc"},
                           Reason{rows.time_not_forward, " whose time does not go forward"},
                           Reason{rows.without_reference, " without ref_soc_pct"}};
  std::string text =
      std::to_string(rows.count()) + " of " + std::to_string(score.rows + rows.count()) + " rows left out";
  const char* between = ": ";
  for (const Reason& reason : reasons) {
    if (reason.count == 0) continue;
    text += between + std::to_string(reason.count) + reason.text;
    between = ", ";
  }
  return text;
}

/// What a recording has that casts doubt on its figures: on standard error, and the figures follow nevertheless.
void warn(const EvalOptions& options, const CellDynamics& cell, const Series& series, const Score& score) {
  constexpr double s_per_h = 3600.0;
  const double capacity_Ah = cell.capacity_As / s_per_h;
  if (score.left_out.count() > 0) complain(series.name + ": " + left_out_text(score));
  const std::string time = implausible_time(series);
  const std::string current =
      time.empty() ? implausible_answers(series, capacity_Ah) : implausible_current(series, capacity_Ah);
  for (const std::string& problem : {time, current, implausible_charge(series, capacity_Ah, 1.0)}) {
    if (!problem.empty()) complain("warning: " + series.name + problem);
  }
  if (score.misfit >= 1.0) {
    complain(series.name + ": behaves like no cell of " + options.cell +
             ": another cell, a voltage or a resistance far off, or a current with the wrong sign");
  }
}

}  // namespace

int run_eval(const EvalOptions& options) {
  const Result<CellFile, ConfigProblems> cell = load_cell_file(options.cell);
  if (!cell) {
    for (const ConfigProblem& problem : cell.error()) complain(to_text(problem));
    return exit_config;
  }
  const CellDynamics dynamics = cell->dynamics.value_or(dynamics_of(cell->model));
  std::vector<Score> scores;
  for (const std::string& file : options.files) {
    const Result<Series, std::string> series = read_series(file);
    if (!series) {
      complain(series.error());
      return exit_data;
    }
    if (series->torn_line != 0) complain(torn_line_text(*series));
    const std::string problem = implausible_values(*series, cell->model);
    if (!problem.empty()) {
      complain(file + problem);
      return exit_data;
    }
    const Result<Evaluation, std::string> evaluation = evaluate(options.plan, dynamics, *series);
    if (!evaluation) {
      complain(evaluation.error());
      return exit_data;
    }
    scores.push_back(evaluation->score);
    warn(options, dynamics, *series, evaluation->score);
    if (!write_trace(options, *evaluation)) return exit_system;
  }
  if (options.is_json) {
    print_json(scores);
  } else {
    print_table(scores);
  }
  return exit_ok;
}

}  // namespace bmu::cell
