#include "tools/bmucell/health_command.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <limits>

#include <nlohmann/json.hpp>

#include "config/cell_file/cell_file_writer.hpp"
#include "tools/bmucell/chart.hpp"
#include "tools/bmucell/data/score_terms.hpp"
#include "tools/bmucell/output.hpp"

namespace bmu::cell {

namespace {

using Json = nlohmann::ordered_json;

constexpr double hour_s = 3600.0;
constexpr double no_point = std::numeric_limits<double>::quiet_NaN();

struct Told {
  ChargePlateauModel model;
  std::optional<PlateauFit> fit;
  HealthResult result;
};

Json to_json(const HealthScore& score) {
  if (score.tests == 0) return nullptr;
  return {{"tests", score.tests},
          {"rmse_pct", score.rmse_pct},
          {"max_pct", score.max_pct},
          {"inside_uncertainty_pct", score.inside_uncertainty_pct}};
}

Json to_json(const ChargePlateauModel& model) {
  return {{"plateau_weight", model.plateau_weight}, {"above_weight", model.above_weight},
          {"sigma_Ah", model.sigma_As / hour_s},    {"current_A", model.current_A},
          {"full_voltage_V", model.full_voltage_V}, {"end_current_A", model.end_current_A}};
}

void print_json(const Told& told) {
  Json fit = nullptr;
  if (told.fit) fit = {{"charges", told.fit->charges}, {"rmse_Ah", told.fit->rmse_As / hour_s}};
  const Json all = {
      {"file", told.result.file}, {"tests", told.result.rows.size()},      {"model", to_json(told.model)},
      {"fit", std::move(fit)},    {"single", to_json(told.result.single)}, {"all", to_json(told.result.told)}};
  std::printf("%s\n", all.dump(2).c_str());
}

void print_line(const char* what, const HealthScore& score) {
  if (score.tests == 0) {
    std::printf("%-8s no charge showed all that is needed\n", what);
    return;
  }
  std::printf("%-8s %8zu %8.2f %8.2f %8.0f\n", what, score.tests, score.rmse_pct, score.max_pct,
              score.inside_uncertainty_pct);
}

void print_table(const Told& told) {
  const ChargePlateauModel& model = told.model;
  std::printf("capacity of %s, %zu tests, percent of the rated one\n", told.result.file.c_str(),
              told.result.rows.size());
  std::printf("%.3f of the plateau, %.3f of what is above it, sigma %.4f Ah", model.plateau_weight, model.above_weight,
              model.sigma_As / hour_s);
  if (told.fit) std::printf("; fitted to %zu charges", told.fit->charges);
  std::printf("\n                                      truth\n");
  std::printf("            tests     RMSE      max  inside%%\n");
  print_line("single", told.result.single);
  print_line("all", told.result.told);
  if (told.fit) std::printf("\nfor the cell file:\n%s\n", charge_plateau_text(model).c_str());
}

std::string csv_of(const HealthResult& result) {
  std::string text = "cycle,capacity_Ah,single_Ah,single_sigma_Ah,all_Ah,all_sigma_Ah\n";
  const auto add = [&text](const char* form, double value) {
    std::array<char, 40> field{};
    std::snprintf(field.data(), field.size(), form, value);
    text += field.data();
  };
  const auto add_two = [&add, &text](const std::optional<double>& value_As, double sigma_As) {
    if (!value_As) {
      text += ",,";
      return;
    }
    add(",%.5f", *value_As / hour_s);
    add(",%.5f", sigma_As / hour_s);
  };
  for (const HealthRow& row : result.rows) {
    add("%.10g", row.cycle);
    add(",%.5f", row.true_As / hour_s);
    add_two(row.single_As, row.single_sigma_As);
    add_two(row.told_As, row.told_sigma_As);
    text += '\n';
  }
  return text;
}

std::string svg_of_health(const HealthResult& result) {
  ChartPanel capacity{.title = "Capacity", .x_label = "test", .y_label = "Ah"};
  ChartBand around{.label = "two sigma", .color = "#d9602c"};
  ChartLine truth{.label = "test", .color = "#0b3c8c"};
  ChartLine single{.label = "one charge", .color = "#e6a03c"};
  ChartLine told{.label = "all charges", .color = "#d9602c"};
  for (const HealthRow& row : result.rows) {
    truth.points.push_back({row.cycle, row.true_As / hour_s});
    single.points.push_back({row.cycle, row.single_As.value_or(no_point) / hour_s});
    told.points.push_back({row.cycle, row.told_As.value_or(no_point) / hour_s});
    if (!row.told_As) continue;
    around.low.push_back({row.cycle, (*row.told_As - band_sigmas * row.told_sigma_As) / hour_s});
    around.high.push_back({row.cycle, (*row.told_As + band_sigmas * row.told_sigma_As) / hour_s});
  }
  capacity.bands = {std::move(around)};
  capacity.lines = {std::move(truth), std::move(single), std::move(told)};
  return svg_of(std::filesystem::path(result.file).filename().string(), {std::move(capacity)});
}

/// Determines the weights, fitted if they were not given; false after an error message if that is not possible.
bool find_weights(const HealthOptions& options, Told& told) {
  told.model = options.plan.model;
  if (options.fit_charges.empty()) return true;
  const Result<AgeingData, std::string> data = read_ageing(options.fit_charges, options.fit_tests);
  if (!data) {
    complain(data.error());
    return false;
  }
  const Result<PlateauFit, std::string> fit =
      fit_plateau(*data, options.plan.model, options.plan.rated_As, options.fit_until_cycle);
  if (!fit) {
    complain(fit.error());
    return false;
  }
  told.fit = *fit;
  told.model = fit->model;
  return true;
}

}  // namespace

int run_health(const HealthOptions& options) {
  Told told;
  if (!find_weights(options, told)) return exit_data;
  const Result<AgeingData, std::string> data = read_ageing(options.charges, options.tests);
  if (!data) {
    complain(data.error());
    return exit_data;
  }
  HealthPlan plan = options.plan;
  plan.model = told.model;
  told.result = score_health(plan, *data);
  if (!options.csv.empty() && !write_file(options.csv, csv_of(told.result))) return exit_system;
  if (!options.svg.empty() && !write_file(options.svg, svg_of_health(told.result))) return exit_system;
  if (options.is_json) {
    print_json(told);
  } else {
    print_table(told);
  }
  return exit_ok;
}

}  // namespace bmu::cell
