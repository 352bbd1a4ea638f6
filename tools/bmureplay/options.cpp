#include "tools/bmureplay/options.hpp"

#include "daemon/shell/cli/command_line.hpp"

namespace bmu::replay {

namespace {

constexpr const char* description =
    "Replays a recording or black box of bmud with the same core and compares every decision: sent frames, contactor "
    "commands, events and reports.";

constexpr const char* footer = R"(
A file is a recording of bmud --record or --black-box, compressed with zstd or gzip or not; - is standard input. Several
files are one recording in that order.

With --config the core has another pack file, and differences are shown. Measurements stay as recorded; they do not
react to the changed decisions. The pack must have the same modules.

Examples:
  bmureplay /var/lib/bmud/black-box/blackbox-20260301T101530.123Z-fault-cell-undervoltage.log.zst
  bmureplay drive-*.log.zst
  bmureplay --show-config drive-20260301T101530.123Z.log.zst > then.json
  bmureplay --config other.json drive-20260301T101530.123Z.log.zst
  bmureplay --json drive-*.log.zst | jq .identical

Exit codes:
  0   all decisions match the recording, or with --config: no difference
  1   decisions differ, and are shown; or standard output could not be written completely
  2   the command line is wrong
  3   a file is damaged: its undamaged part was replayed, the places are named, and nothing before them differs
  65  a file is not a recording, or of another version of the core, or cannot be read
  78  the file of --config is wrong: every problem is reported; or is of a pack with other modules)";

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  Options options;
  CLI::App app(description, "bmureplay");
  app.footer(footer);
  app.set_version_flag("--version", "bmureplay " BMUD_VERSION);
  app.add_option("file", options.files, "recordings or black boxes")->required()->type_name("FILE...");
  auto* config = app.add_option("--config", options.config, "pack file to use instead of the recorded one")
                     ->type_name("PACK.json");
  app.add_option("--differences", options.differences_max, "number of differing ticks to print; all are counted")
      ->check(command_line::whole_number(0, 1'000'000))
      ->capture_default_str();
  app.add_option("--threads", options.threads, "number of parts to replay in parallel; default: one per CPU core")
      ->check(command_line::whole_number(1, 256));
  app.add_flag("--show-config", options.shows_config, "print the recorded pack file and exit")->excludes(config);
  app.add_flag("--json", options.is_json, "one JSON object");
  app.add_flag("--quiet,-q", options.is_quiet, "no progress on a terminal");
  command_line::add_self_description(app, 1);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return {.options = std::nullopt, .exit_code = command_line::report(app, error)};
  }
  return {.options = options};
}

}  // namespace bmu::replay
