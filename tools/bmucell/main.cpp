// bmucell: cell files from recorded tests, and estimators scored on recordings.
#include "tools/bmucell/eval_command.hpp"
#include "tools/bmucell/fit_command.hpp"
#include "tools/bmucell/options.hpp"

int main(int argc, char** argv) {
  const bmu::cell::ParsedOptions parsed = bmu::cell::parse_options(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  return parsed.options->fit ? run_fit(*parsed.options->fit) : run_eval(*parsed.options->eval);
}
