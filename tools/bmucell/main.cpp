// bmucell: fits cell files to recorded tests, and scores estimators on recordings.
#include "tools/bmucell/eval_command.hpp"
#include "tools/bmucell/fit_command.hpp"
#include "tools/bmucell/health_command.hpp"
#include "tools/bmucell/options.hpp"
#include "tools/bmucell/resistance_command.hpp"
#include "tools/common/standard_output.hpp"

namespace {

int run(int argc, char** argv) {
  using namespace bmu::cell;
  const ParsedOptions parsed = parse_options(argc, argv);
  if (!parsed.options) return parsed.exit_code;
  if (parsed.options->fit) return run_fit(*parsed.options->fit);
  if (parsed.options->eval) return run_eval(*parsed.options->eval);
  if (parsed.options->resistance) return run_resistance(*parsed.options->resistance);
  return run_health(*parsed.options->health);
}

}  // namespace

int main(int argc, char** argv) {
  return bmu::end_output("bmucell", run(argc, argv));
}
