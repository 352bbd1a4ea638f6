#include "tools/bmucell/fit_command.hpp"

#include <cstdio>
#include <filesystem>

#include <nlohmann/json.hpp>

#include "config/cell_file/cell_config.hpp"
#include "config/cell_file/cell_file_writer.hpp"
#include "tools/bmucell/chart.hpp"
#include "tools/bmucell/data/score_terms.hpp"
#include "tools/bmucell/fit/fit.hpp"
#include "tools/bmucell/fit/fit_check.hpp"
#include "tools/bmucell/fit/fit_data.hpp"
#include "tools/bmucell/fit/fitted_file.hpp"
#include "tools/bmucell/output.hpp"

namespace bmu::cell {

namespace {

using Json = nlohmann::ordered_json;

constexpr double mV = 1e3;
constexpr double mOhm = 1e3;
constexpr double half_full = 0.5;

FitPlan plan_for(const FitOptions& options, const CellFile& base, const std::vector<FitSeries>& data) {
  constexpr double uAs_per_Ah = 3.6e9;
  FitPlan plan;
  plan.capacity_Ah = options.capacity_Ah.value_or(static_cast<double>(base.model.capacity_uAs) / uAs_per_Ah);
  plan.temperatures_C = options.temperatures_C.empty() ? temperatures_of(data) : options.temperatures_C;
  if (base.dynamics) {
    plan.pair_time_constant_s = base.dynamics->pair_time_constant_s;
    plan.activation_K = base.dynamics->activation_K;
    plan.hysteresis_charge = base.dynamics->hysteresis_charge;
    plan.charge_efficiency = base.dynamics->charge_efficiency;
  }
  plan.activation_K = options.activation_K.value_or(plan.activation_K);
  for (std::size_t k = 0; k < options.pair_times_s.size(); ++k) plan.pair_time_constant_s[k] = options.pair_times_s[k];
  plan.charge_efficiency = options.charge_efficiency.value_or(plan.charge_efficiency);
  return plan;
}

/// The typical resistance falls with the size of the cell.
FitWishes wishes_for(const FitPlan& plan) {
  constexpr double usual_of_one_ampere_hour_Ohm = 0.060;
  FitWishes wishes;
  wishes.typical_Ohm = usual_of_one_ampere_hour_Ohm / plan.capacity_Ah;
  return wishes;
}

std::string origin_of(const FitOptions& options) {
  if (!options.origin.empty()) return options.origin;
  std::string text = "fitted to";
  for (const auto* const files : {&options.files, &options.slow_files}) {
    for (const std::string& file : *files) text += " " + std::filesystem::path(file).filename().string();
  }
  constexpr std::size_t origin_max = 1024;
  if (text.size() > origin_max) text.replace(origin_max - 4, std::string::npos, " ...");
  return text;
}

void print_summary(std::FILE* out, const FitPlan& plan, const Fit& fit) {
  std::fprintf(out, "what the model is off by:\n     RMSE      max     rows\n");
  for (const FitQuality& one : fit.quality) {
    std::fprintf(out, "%6.1f mV %5.0f mV %8zu  %s%s\n", one.rmse_V * mV, one.worst_V * mV, one.rows, one.name.c_str(),
                 one.is_slow_curve ? " (slow: only for what no other reached)" : "");
  }
  std::fprintf(out,
               "\ntables at half charge, and what a filter is told of the model's error:\n"
               "    at C   OCV V  hyst mV  R0 mOhm  kinetic  pairs: %.3g s  %.3g s  %.3g s   slow mV  fast mV\n",
               plan.pair_time_constant_s[0], plan.pair_time_constant_s[1], plan.pair_time_constant_s[2]);
  for (const CellDynamics::Row& row : fit.cell.rows) {
    const CellPoint here = at(fit.cell, half_full, row.temperature_C);
    std::fprintf(out, "%8.0f  %6.3f %8.1f %8.2f %8.2f %13.2f %6.2f %6.2f %9.1f %8.1f\n", row.temperature_C, here.ocv_V,
                 here.hysteresis_V * mV, here.series_Ohm * mOhm, here.kinetic_Ohm * mOhm, here.pair_Ohm[0] * mOhm,
                 here.pair_Ohm[1] * mOhm, here.pair_Ohm[2] * mOhm, row.slow_error_V * mV, row.fast_error_V * mV);
  }
  std::fprintf(out,
               "activation %.0f K, exchange current %.3g C at 25 C with %.0f K, hysteresis over %.3g of the capacity\n",
               plan.activation_K, plan.exchange_current_C, plan.exchange_activation_K, plan.hysteresis_charge);
}

void print_json(const FitPlan& plan, const Fit& fit) {
  Json files = Json::array();
  for (const FitQuality& one : fit.quality) {
    files.push_back({{"file", one.name},
                     {"slow", one.is_slow_curve},
                     {"rmse_mV", one.rmse_V * mV},
                     {"max_mV", one.worst_V * mV},
                     {"rows", one.rows}});
  }
  const Json json{{"files", std::move(files)},
                  {"misfit", fit.misfit},
                  {"capacity_Ah", plan.capacity_Ah},
                  {"temperatures_C", plan.temperatures_C},
                  {"pair_time_constants_s", plan.pair_time_constant_s},
                  {"activation_K", plan.activation_K},
                  {"exchange_current_C", plan.exchange_current_C},
                  {"exchange_activation_K", plan.exchange_activation_K},
                  {"hysteresis_charge", plan.hysteresis_charge}};
  std::printf("%s\n", json.dump(2).c_str());
}

std::string label_of(const CellDynamics::Row& row) {
  return std::to_string(static_cast<int>(row.temperature_C)) + " C";
}

template <std::size_t Points>
ChartLine table_line(const CellDynamics& cell, std::size_t row, const OverCharge<Points>& values, double unit) {
  ChartLine line{.label = label_of(cell.rows[row]), .color = chart_color(row, cell.rows.size())};
  for (std::size_t k = 0; k < Points; ++k) {
    line.points.push_back({100.0 * static_cast<double>(k) / (Points - 1), values[k] * unit});
  }
  return line;
}

std::string svg_of_fit(const std::string& name, const CellDynamics& cell) {
  ChartPanel ocv{.title = "Open-circuit voltage", .x_label = "state of charge, %", .y_label = "V"};
  ChartPanel series{.title = "Resistance at once", .x_label = "state of charge, %", .y_label = "mOhm"};
  ChartPanel settled{.title = "Resistance when settled", .x_label = "state of charge, %", .y_label = "mOhm"};
  ChartPanel hysteresis{.title = "Hysteresis", .x_label = "state of charge, %", .y_label = "mV"};
  for (std::size_t k = 0; k < cell.rows.size(); ++k) {
    const CellDynamics::Row& row = cell.rows[k];
    CellDynamics::Resistance all{};
    for (std::size_t point = 0; point < all.size(); ++point) {
      all[point] = row.series_Ohm[point] + row.kinetic_Ohm[point];
      for (const auto& pair : row.pair_Ohm) all[point] += pair[point];
    }
    ocv.lines.push_back(table_line(cell, k, row.ocv_V, 1.0));
    series.lines.push_back(table_line(cell, k, row.series_Ohm, mOhm));
    settled.lines.push_back(table_line(cell, k, all, mOhm));
    hysteresis.lines.push_back(table_line(cell, k, row.hysteresis_V, mV));
  }
  return svg_of(name, {std::move(ocv), std::move(series), std::move(settled), std::move(hysteresis)});
}

int tell(const FitOptions& options, const FitPlan& plan, const Fit& fit, const CellFile& file) {
  if (!options.svg.empty() && !write_file(options.svg, svg_of_fit(file.name, fit.cell))) return exit_system;
  const std::string text = cell_file_text(file);
  if (options.out.empty()) {
    std::fputs(text.c_str(), stdout);
  } else if (!write_file(options.out, text)) {
    return exit_system;
  }
  if (options.is_json) {
    print_json(plan, fit);
  } else if (!options.is_quiet) {
    print_summary(options.out.empty() ? stderr : stdout, plan, fit);
  }
  return exit_ok;
}

}  // namespace

int run_fit(const FitOptions& options) {
  Result<CellFile, ConfigProblems> base = load_cell_file(options.base);
  if (!base) {
    for (const ConfigProblem& problem : base.error()) complain(to_text(problem));
    return exit_config;
  }
  FitSource source{.files = options.files, .slow_files = options.slow_files};
  if (options.begin_soc_pct) source.begin_soc = *options.begin_soc_pct / percent;
  source.cell = base->model;
  source.capacity_Ah = plan_for(options, *base, {}).capacity_Ah;
  const Result<std::vector<FitSeries>, std::string> data = read_fit_data(source);
  if (!data) {
    complain(data.error());
    return exit_data;
  }
  // Logged also if the fit is refused: the omitted line may be the cause.
  for (const FitSeries& one : *data) {
    if (one.series.torn_line != 0) complain(torn_line_text(one.series));
  }
  const FitPlan plan = plan_for(options, *base, *data);
  const FitWishes wishes = wishes_for(plan);
  const Fit found = fit(plan, wishes, *data);
  const std::string implausible = implausible_fit(found, *data, base->model, options.rmse_max_mV / mV);
  if (!implausible.empty()) {
    complain(implausible);
    return exit_data;
  }
  for (const std::string& remark : remarks_on(found, *data)) complain(remark);
  CellFile file = with_fit(std::move(*base), found);
  if (!options.name.empty()) file.name = options.name;
  file.origin = origin_of(options);
  // A file that the daemon would refuse is not written.
  if (const auto read = parse_cell_file(cell_file_text(file), "what was fitted"); !read) {
    for (const ConfigProblem& problem : read.error()) complain(to_text(problem));
    return exit_data;
  }
  return tell(options, plan, found, file);
}

}  // namespace bmu::cell
