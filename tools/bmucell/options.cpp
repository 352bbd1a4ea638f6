#include "tools/bmucell/options.hpp"

#include <algorithm>
#include <functional>
#include <iterator>

#include "daemon/shell/cli/command_line.hpp"

namespace bmu::cell {
namespace {

constexpr const char* description =
    "Fits a cell file to recorded tests of a cell, and scores the estimators of charge, resistance and capacity on "
    "recordings.";

constexpr const char* footer = R"(
Recordings are CSV, packed with gzip or not; the first line names the columns: time_s, current_A (out of the cell),
voltage_V, temp_C, ref_soc_pct (what the charge really was). See bmucell fit --help, eval --help, resistance --help and
health --help.

Examples:
  bmucell fit --base config/cells/nmc-3000.json --out my.json drive_25C.csv drive_0C.csv.gz
  bmucell eval --cell my.json --sensor-gain 1.02 --sensor-offset-A 0.015 --soc-error -10 drive_10C.csv
  bmucell resistance --cell my.json --table hppc_table_25C.csv hppc_25C.csv.gz
  bmucell health --rated-Ah 2 --current-A 1.5 --full-voltage 4.2 --end-current-A 0.1 \
          --fit one_charges.csv.gz --fit-tests one_tests.csv other_charges.csv.gz other_tests.csv

Exit codes:
  0   done
  1   a file could not be written
  2   the command line is wrong
  65  a recording or table is wrong or cannot be read: file, line and column are told
  78  the cell file is wrong: every problem is reported)";

constexpr const char* fit_footer = R"(
Examples:
  bmucell fit --base config/cells/nmc-3000.json --out my.json --svg my.svg drive_25C.csv drive_0C.csv
  bmucell fit --base my.json --slow ocv_c20_25C.csv --temperatures -10,0,25 --out my.json drive_*.csv.gz

A recording without ref_soc_pct begins at --begin-soc and is counted. What no test of a cell can be is refused, with the
likely cause: other units, a current of the other sign, a time that starts again. Rests and currents both ways tell more than steady
currents; what no recording reached is carried on smoothly, and the picture shows where that is.)";

constexpr const char* eval_footer = R"(
Examples:
  bmucell eval --cell my.json drive.csv.gz
  bmucell eval --cell my.json --sensor-gain 1.02 --sensor-offset-A 0.015 --soc-error -10 --json drive_*.csv.gz
  bmucell eval --cell my.json --from-soc 60 --soc-error 20 --estimator mixed --csv trace.csv --svg trace.svg drive.csv

The charge is compared with ref_soc_pct row by row. JSON is {"files": [...], "mean": {...}}; a figure that a recording is
too short for is null.)";

constexpr const char* resistance_footer = R"(
Examples:
  bmucell resistance --cell my.json --table hppc_table_25C.csv hppc_25C.csv.gz
  bmucell resistance --cell my.json --table hppc_table_25C.csv --column r_10s_mohm --svg r.svg --csv r.csv hppc_25C.csv

The table is CSV with the columns ref_soc_pct and pulse_A, the resistance in mOhm that --column names and, if known,
temp_C, a row a pulse. The recording needs temp_C and ref_soc_pct and must have every pulse of the table, in its order;
it may have more. JSON is {"file": ..., "table": ..., "column": ..., "scores": [...]}; a figure of a method that never
told a resistance is null.)";

constexpr const char* health_footer = R"(
Examples:
  bmucell health --rated-Ah 2 --current-A 1.5 --full-voltage 4.2 --end-current-A 0.1 \
          --fit one_charges.csv.gz --fit-tests one_tests.csv other_charges.csv.gz other_tests.csv
  bmucell health --rated-Ah 2 --current-A 1.5 --full-voltage 4.2 --end-current-A 0.1 \
          --plateau-weight 2.4 --above-weight 1.1 --sigma-Ah 0.03 --from-soc 10 --svg health.svg charges.csv tests.csv

CHARGES is a recording with a column 'cycle', the number of the charge, in each of which time_s begins anew. TESTS is
CSV with the columns cycle, capacity_Ah, charges_before: what a test of the capacity found, and the number of the charge
that precedes it. Each charge is estimated before its test. 'single' is what one charge says, 'all' what all charges so
far say together; figures in percent of the rated capacity. JSON is {"model", "fit", "single", "all", "tests"}.)";

constexpr double temperature_min_C = -60.0;
constexpr double temperature_max_C = 150.0;

void declare_fit(CLI::App& app, FitOptions& options) {
  app.footer(fit_footer);
  app.add_option("files", options.files, "recordings")->type_name("FILE.csv[.gz]");
  app.add_option("--slow", options.slow_files, "slow discharge and charge, for the ends of the open-circuit curve")
      ->type_name("FILE");
  app.add_option("--base", options.base, "cell file for everything that is not fitted: limits, heat")
      ->required()
      ->type_name("CELL.json");
  app.add_option("--out", options.out, "the cell file that is written; default: standard output")
      ->type_name("CELL.json");
  app.add_option("--svg", options.svg, "chart of the fit")->type_name("FILE");
  app.add_option("--name", options.name, "name of the cell; default: the base's");
  app.add_option("--origin", options.origin, "source of the data; default: the names of the recordings");
  app.add_option("--temperatures", options.temperatures_C,
                 "of the tables, C, as -10,0,25; default: where the recordings are")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->check(command_line::number(temperature_min_C, temperature_max_C));
  app.add_option("--capacity-Ah", options.capacity_Ah, "default: the base's")->check(command_line::number(0.01, 1e4));
  app.add_option("--charge-efficiency", options.charge_efficiency, "what of a charging current arrives; default: 1")
      ->check(command_line::number(0.5, 1.0));
  app.add_option("--pair-times-s", options.pair_times_s,
                 "time constants of the three pairs; default: the base's, or 6,60,350")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->check(command_line::number(0.1, 1e5));
  app.add_option("--activation-K", options.activation_K, "of the resistances; default: the base's tables', or 4000")
      ->check(command_line::number(0, 10000));
  app.add_option("--begin-soc", options.begin_soc_pct,
                 "percent, of recordings without ref_soc_pct; default: 100, with a warning")
      ->check(command_line::number(0, 100));
  app.add_option(
         "--rmse-max-mV", options.rmse_max_mV,
         "no cell file if the model misses a recording by more, root mean square; a slow one by three times this")
      ->check(command_line::number(0.1, 1e4))
      ->capture_default_str();
  app.add_flag("--json", options.is_json, "quality of the fit, as JSON on standard output");
  app.add_flag("--quiet", options.is_quiet, "print errors only");
}

/// As typed, in percent.
struct EvalPercent {
  double soc_error = 0.0;
  double from_soc = 100.0;
  double voltage_noise_mV = 0.0;
  std::string estimator{soc_method_names[0]};
};

void declare_eval(CLI::App& app, EvalOptions& options, EvalPercent& typed) {
  EvaluationPlan& plan = options.plan;
  app.footer(eval_footer);
  app.add_option("files", options.files, "recordings with ref_soc_pct")->required()->type_name("FILE.csv[.gz]");
  app.add_option("--cell", options.cell, "the cell file")->required()->type_name("CELL.json");
  app.add_option("--sensor-gain", plan.sensor_gain, "gain error of the current")
      ->check(command_line::number(-2, 2))
      ->capture_default_str();
  app.add_option("--sensor-offset-A", plan.sensor_offset_A, "offset error of the current")
      ->check(command_line::number(-1e5, 1e5))
      ->capture_default_str();
  app.add_option("--soc-error", typed.soc_error, "percent, by which the start is wrong")
      ->check(command_line::number(-100, 100))
      ->capture_default_str();
  app.add_option("--from-soc", typed.from_soc, "percent; switched on when the charge has come down to this")
      ->check(command_line::number(0, 100))
      ->capture_default_str();
  app.add_option("--voltage-noise-mV", typed.voltage_noise_mV, "one standard deviation")
      ->check(command_line::number(0, 1000))
      ->capture_default_str();
  app.add_option("--current-noise-A", plan.current_noise_A, "one standard deviation")
      ->check(command_line::number(0, 1e5))
      ->capture_default_str();
  app.add_option("--seed", plan.seed, "of the noise")->check(command_line::whole_number(0))->capture_default_str();
  const std::vector<std::string> names(soc_method_names.begin(), soc_method_names.end());
  app.add_option("--estimator", typed.estimator, "which one")
      ->check(command_line::one_of(names))
      ->capture_default_str();
  app.add_option("--csv", options.csv, "estimates row by row, of one recording")->type_name("FILE");
  app.add_option("--svg", options.svg, "chart of one recording")->type_name("FILE");
  app.add_flag("--json", options.is_json, "the figures as JSON on standard output");
}

void declare_resistance(CLI::App& app, ResistanceOptions& options) {
  app.footer(resistance_footer);
  app.add_option("file", options.file, "recording with pulses")->required()->type_name("FILE.csv[.gz]");
  app.add_option("--cell", options.cell, "the cell file")->required()->type_name("CELL.json");
  app.add_option("--table", options.table, "what the bench made of the pulses")
      ->required()
      ->type_name("TABLE.csv[.gz]");
  app.add_option("--column", options.column, "the table's resistance to compare with, in mOhm")->capture_default_str();
  app.add_option("--csv", options.csv, "estimates pulse by pulse")->type_name("FILE");
  app.add_option("--svg", options.svg, "chart")->type_name("FILE");
  app.add_flag("--json", options.is_json, "the figures as JSON on standard output");
}

/// As typed, in percent and Ah.
struct HealthTyped {
  double rated_Ah = 0.0;
  double from_soc = 0.0;
  double loss_per_cycle = 1.0;
  std::optional<double> plateau_weight;
  std::optional<double> above_weight;
  std::optional<double> sigma_Ah;
};

void declare_health_model(CLI::App& app, HealthOptions& options, HealthTyped& typed) {
  ChargePlateauModel& model = options.plan.model;
  app.add_option("--rated-Ah", typed.rated_Ah, "capacity that the figures are a share of")
      ->required()
      ->check(command_line::number(0.01, 1e4));
  app.add_option("--current-A", model.current_A, "of the charges")->required()->check(command_line::number(0.001, 1e4));
  app.add_option("--full-voltage", model.full_voltage_V, "V, at which they are held")
      ->required()
      ->check(command_line::number(1, 6));
  app.add_option("--end-current-A", model.end_current_A, "at which they are full")
      ->required()
      ->check(command_line::number(0.001, 1e4));
  app.add_option("--fit", options.fit_charges, "charges that the weights are fitted to: of another cell")
      ->type_name("CHARGES");
  app.add_option("--fit-tests", options.fit_tests, "and the tests behind them")->type_name("TESTS");
  app.add_option("--fit-until-cycle", options.fit_until_cycle, "to no later tests than this one; default: all")
      ->check(command_line::number(0, 1e9));
  app.add_option("--plateau-weight", typed.plateau_weight, "instead of --fit, with the next two")
      ->check(command_line::number(0, 100));
  app.add_option("--above-weight", typed.above_weight, "of the charge above the plateau")
      ->check(command_line::number(0, 100));
  app.add_option("--sigma-Ah", typed.sigma_Ah, "of a capacity from one charge")->check(command_line::number(1e-6, 1e4));
}

void declare_health(CLI::App& app, HealthOptions& options, HealthTyped& typed) {
  app.footer(health_footer);
  app.add_option("charges", options.charges, "recorded charges of a cell")->required()->type_name("CHARGES");
  app.add_option("tests", options.tests, "what its capacity was found to be")->required()->type_name("TESTS");
  declare_health_model(app, options, typed);
  app.add_option("--from-soc", typed.from_soc, "percent; plugged in when the charge has come to this")
      ->check(command_line::number(0, 100))
      ->capture_default_str();
  app.add_option("--from-voltage", options.plan.when.from_voltage_V, "V; plugged in when the voltage has come to this")
      ->check(command_line::number(0, 6))
      ->capture_default_str();
  app.add_option("--loss-per-cycle", typed.loss_per_cycle, "percent of the rated capacity that a cycle may cost")
      ->check(command_line::number(0, 100))
      ->capture_default_str();
  app.add_flag("--all-tests", options.plan.scores_all_tests,
               "also tests that follow another one without a recorded charge between them");
  app.add_option("--csv", options.csv, "test by test what was estimated")->type_name("FILE");
  app.add_option("--svg", options.svg, "chart")->type_name("FILE");
  app.add_flag("--json", options.is_json, "the figures as JSON on standard output");
}

/// Checks that CLI11 cannot make, and unit conversions.
void conclude(HealthOptions& options, const HealthTyped& typed) {
  constexpr double hour_s = 3600.0;
  constexpr double percent = 0.01;
  options.plan.rated_As = typed.rated_Ah * hour_s;
  options.plan.when.from_soc = typed.from_soc * percent;
  options.plan.loss_share_per_cycle = typed.loss_per_cycle * percent;
  if (options.fit_charges.empty() != options.fit_tests.empty()) {
    throw CLI::ValidationError("--fit", "and --fit-tests want each other");
  }
  const int given =
      int{typed.plateau_weight.has_value()} + int{typed.above_weight.has_value()} + int{typed.sigma_Ah.has_value()};
  if (given == (options.fit_charges.empty() ? 3 : 0)) {
    options.plan.model.plateau_weight = typed.plateau_weight.value_or(0.0);
    options.plan.model.above_weight = typed.above_weight.value_or(0.0);
    options.plan.model.sigma_As = typed.sigma_Ah.value_or(0.0) * hour_s;
    return;
  }
  throw CLI::ValidationError("--fit", "expected this or all of --plateau-weight, --above-weight, --sigma-Ah, not both");
}

void conclude(EvalOptions& options, const EvalPercent& typed) {
  constexpr double percent = 0.01;
  options.plan.soc_error = typed.soc_error * percent;
  options.plan.from_soc = typed.from_soc * percent;
  options.plan.voltage_noise_V = typed.voltage_noise_mV * 1e-3;
  const auto* const name = std::find(soc_method_names.begin(), soc_method_names.end(), typed.estimator);
  options.plan.method = static_cast<SocMethod>(std::distance(soc_method_names.begin(), name));
  if (options.files.size() == 1) return;
  if (!options.csv.empty()) throw CLI::ValidationError("--csv", "is the trace of one recording, and there are several");
  if (!options.svg.empty()) throw CLI::ValidationError("--svg", "allowed with one recording only");
}

void conclude(FitOptions& options) {
  if (options.files.empty() && options.slow_files.empty())
    throw CLI::ValidationError("files", "are missing: fit to what?");
  if (!options.pair_times_s.empty() && options.pair_times_s.size() != CellDynamics::pairs) {
    throw CLI::ValidationError("--pair-times-s", "expected three numbers, e.g. 6,60,350");
  }
  if (!std::is_sorted(options.pair_times_s.begin(), options.pair_times_s.end(), std::less_equal<>())) {
    throw CLI::ValidationError("--pair-times-s", "do not rise");
  }
  std::sort(options.temperatures_C.begin(), options.temperatures_C.end());
  const auto same = std::adjacent_find(options.temperatures_C.begin(), options.temperatures_C.end());
  if (same != options.temperatures_C.end()) throw CLI::ValidationError("--temperatures", "has one twice");
  if (options.temperatures_C.size() > CellDynamics::temperatures_max) {
    throw CLI::ValidationError("--temperatures", "has more than " + std::to_string(CellDynamics::temperatures_max));
  }
  if (options.out.empty() && options.is_json) {
    throw CLI::ValidationError("--json", "and the cell file would both go to standard output: give --out");
  }
}

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  CLI::App app(description, "bmucell");
  app.set_version_flag("--version", "bmucell " BMUD_VERSION);
  app.footer(footer);
  app.require_subcommand(1);
  FitOptions fit;
  EvalOptions eval;
  EvalPercent eval_typed;
  ResistanceOptions resistance;
  HealthOptions health;
  HealthTyped health_typed;
  CLI::App* const fit_app = app.add_subcommand("fit", "make a cell file from recorded tests");
  CLI::App* const eval_app = app.add_subcommand("eval", "score an estimator of the state of charge on recordings");
  CLI::App* const resistance_app =
      app.add_subcommand("resistance", "score the estimators of resistance on a recording with pulses");
  CLI::App* const health_app = app.add_subcommand("health", "score the estimate of the capacity on recorded charges");
  declare_fit(*fit_app, fit);
  declare_eval(*eval_app, eval, eval_typed);
  declare_resistance(*resistance_app, resistance);
  declare_health(*health_app, health, health_typed);
  command_line::add_self_description(app, 1);
  Options options;
  try {
    app.parse(argc, argv);
    if (fit_app->parsed()) {
      conclude(fit);
      options.fit = std::move(fit);
    } else if (eval_app->parsed()) {
      conclude(eval, eval_typed);
      options.eval = std::move(eval);
    } else if (resistance_app->parsed()) {
      options.resistance = std::move(resistance);
    } else {
      conclude(health, health_typed);
      options.health = std::move(health);
    }
  } catch (const CLI::ParseError& error) {
    return {.exit_code = command_line::report(app, error)};
  }
  return {.options = std::move(options)};
}

}  // namespace bmu::cell
