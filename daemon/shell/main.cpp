// bmud: reads command line and pack file, then checks the pack, opens GPIO outputs, or runs the daemon.
#include <csignal>
#include <cstdio>
#include <optional>
#include <system_error>
#include <vector>

#include <unistd.h>

#include "config/checks/bus_checks.hpp"
#include "config/checks/pack_checks.hpp"
#include "config/pack_config.hpp"
#include "daemon/shell/daemon.hpp"
#include "daemon/shell/daemon_life.hpp"
#include "daemon/shell/gpio/driven_lines.hpp"
#include "daemon/shell/gpio/gpio_lines.hpp"
#include "daemon/shell/options.hpp"
#include "daemon/shell/system/journal.hpp"
#include "daemon/shell/system/real_time.hpp"

namespace {

using namespace bmu;

// Limit of the wait for a blocked log at the end; well below the stop timeout of the service manager.
constexpr Duration log_flush_max = 300ms;

/// Signals come through the loop's descriptor; a client that hangs up raises none. Precondition: no thread has started.
void prepare_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&set, signal);
  sigprocmask(SIG_BLOCK, &set, nullptr);
  static_cast<void>(std::signal(SIGPIPE, SIG_IGN));
}

int open_gpio(const std::optional<GpioConfig>& gpio) {
  if (!gpio || gpio->has_no_outputs()) {
    std::printf("no outputs on GPIO lines\n");
    return exit_ok;
  }
  const std::vector<OsError> errors = open_gpio_outputs(*gpio);
  for (const OsError& error : errors) std::fprintf(stderr, "bmud: not opened: %s\n", to_text(error).c_str());
  if (!errors.empty()) return exit_system;
  std::printf("%s: all outputs open\n", gpio->chip.c_str());
  return exit_ok;
}

/// The lines that a daemon has driven before; no value: use those of the pack file.
std::optional<GpioConfig> lines_driven_before(const Options& options) {
  if (options.driven_lines.empty()) return std::nullopt;
  const auto driven = read_driven_lines(options.driven_lines);
  if (driven) return *driven;
  std::fprintf(stderr, "bmud: %s; opening those of the pack file\n", to_text(driven.error()).c_str());
  return std::nullopt;
}

int run_daemon(const PackConfig& pack, const Options& options) {
  prepare_signals();
  prepare_real_time(options.real_time);
  Journal journal(*severity_from_text(options.log_level));
  const int code = Daemon(options, journal).run(pack);
  // exit() might wait for a blocked sink; nothing that is left needs it.
  if (!journal.flush(log_flush_max)) ::_exit(code);
  return code;
}

int fail_for(const ConfigProblems& problems) {
  for (const ConfigProblem& problem : problems) std::fprintf(stderr, "%s\n", to_text(problem).c_str());
  return exit_config;
}

int check(const PackConfig& read, const Options& options) {
  const auto pack = on_wanted_buses(read, options);
  if (!pack) return fail_for(pack.error());
  for (const ConfigProblem& warning : pack_warnings(*pack, options.config)) {
    std::printf("warning: %s\n", to_text(warning).c_str());
  }
  std::printf("%s: ok: %s, %zu modules, %zu cells\n%s\n", options.config.c_str(), pack->name.c_str(),
              pack->core.modules.size(), cell_count(pack->core), bus_use_text(*pack).c_str());
  return exit_ok;
}

int check_or_run(const Options& options) {
  if (options.open_gpio) {
    if (const auto driven = lines_driven_before(options)) return open_gpio(driven);
  }
  const auto pack = load_pack_config(options.config);
  if (!pack) return fail_for(pack.error());
  if (options.check_config) return check(*pack, options);
  if (options.open_gpio) return open_gpio(pack->gpio);
  return run_daemon(*pack, options);
}

}  // namespace

int main(int argc, char** argv) {
  // No orderly opening from here: the state of the process is unknown. The contactor command expires at its receiver.
  try {
    const ParsedOptions parsed = parse_options(argc, argv);
    return parsed.options ? check_or_run(*parsed.options) : parsed.exit_code;
  } catch (const std::system_error& error) {
    std::fprintf(stderr, "bmud: %s\n", error.what());
    return exit_system;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bmud: %s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "bmud: an unknown error\n");
  }
  return exit_internal;
}
