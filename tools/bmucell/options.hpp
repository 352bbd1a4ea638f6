// The command line of bmucell.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "daemon/shell/cli/exit_codes.hpp"
#include "tools/bmucell/evaluate.hpp"
#include "tools/bmucell/fit/fit_check.hpp"
#include "tools/bmucell/fit/fit_plan.hpp"
#include "tools/bmucell/health.hpp"

namespace bmu::cell {

// Exit codes, as --help lists them.
using exit_codes::exit_config;
using exit_codes::exit_data;
using exit_codes::exit_ok;
using exit_codes::exit_system;
using exit_codes::exit_usage;

struct FitOptions {
  std::vector<std::string> files;
  std::vector<std::string> slow_files;
  std::string base;  // the cell file that provides everything not fitted
  std::string out;   // empty: standard output
  std::string svg;
  std::string name;    // empty: the base's
  std::string origin;  // empty: names the files it was fitted to
  std::vector<double> temperatures_C;
  std::optional<double> capacity_Ah;
  std::optional<double> charge_efficiency;
  std::vector<double> pair_times_s;  // empty, or one for each RC element
  std::optional<double> activation_K;
  std::optional<double> begin_soc_pct;  // of series without ref_soc_pct; not given: full, with a warning
  double rmse_max_mV = rmse_max_default_V * 1e3;
  bool is_json = false;
  bool is_quiet = false;
};

struct EvalOptions {
  std::vector<std::string> files;
  std::string cell;
  EvaluationPlan plan;
  std::string csv;
  std::string svg;
  bool is_json = false;
};

struct ResistanceOptions {
  std::string file;
  std::string cell;
  std::string table;
  std::string column = "r_1s_mohm";
  std::string csv;
  std::string svg;
  bool is_json = false;
};

struct HealthOptions {
  std::string charges;
  std::string tests;
  std::string fit_charges;  // empty: the weights are given
  std::string fit_tests;
  double fit_until_cycle = std::numeric_limits<double>::infinity();
  HealthPlan plan;
  std::string csv;
  std::string svg;
  bool is_json = false;
};

struct Options {
  std::optional<FitOptions> fit;  // exactly one of the four is set
  std::optional<EvalOptions> eval;
  std::optional<ResistanceOptions> resistance;
  std::optional<HealthOptions> health;
};

struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = exit_ok;  // if there are no options: help was requested, or the command line is wrong
};

[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

}  // namespace bmu::cell
