// bmuctl: queries and commands the daemon, and shows its answer.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "daemon/shell/cli/command_line.hpp"
#include "daemon/shell/cli/exit_codes.hpp"
#include "tools/bmuctl/client.hpp"
#include "tools/bmuctl/history_command.hpp"
#include "tools/bmuctl/report_command.hpp"
#include "tools/bmuctl/text_pages.hpp"
#include "tools/bmuctl/time_words.hpp"
#include "tools/bmuctl/watch.hpp"
#include "tools/common/standard_output.hpp"

namespace {

using namespace bmu;

using exit_codes::exit_ok;
constexpr int exit_no_answer = 1;
constexpr int exit_still_present = 3;
constexpr std::chrono::milliseconds answer_max{2000};
/// The daemon reads a pack file from a disk, ends its session and starts another.
constexpr std::chrono::milliseconds reload_answer_max{30'000};
/// Updates during an assignment, 50 ms apart: together more than twice its maximum duration.
constexpr int assignment_period_ms = 50;
constexpr int assignment_pictures_max = 80;

constexpr const char* footer = R"(Examples:
  bmuctl status                    overview of the pack
  bmuctl watch                     live view; q or Ctrl-C ends it
  bmuctl watch --seconds 60 >log   one line per second for a minute, the live view at the end
  bmuctl why                       reasons for the present state, the last opening and the current limits
  bmuctl faults cell_imbalance     one fault: meaning, freeze frame, typical cause and action
  bmuctl clear                     clear latched faults whose cause is gone
  bmuctl clear --authorised        also clear faults that require an inspection of the pack
  bmuctl modules                   module identities, expected identities and answer times (bmuctl modules --help)
  bmuctl balance --off             switch balancing off until --on or a restart of the daemon
  bmuctl health                    capacities, resistances, energy and cycles over all sessions of the daemon
  bmuctl charger                   requests to the chargers, their outputs and reports
  bmuctl inverter                  values sent to the inverter, and its keep-alive
  bmuctl report drive.log          HTML report of a recording (bmuctl report --help)
  bmuctl history --from today      minute averages from the history database (bmuctl history --help)
  bmuctl wake                      wake the modules from sleep after an undervoltage
  bmuctl reload                    reload the pack file, completely or not at all, and list the changes
  bmuctl --json cells | jq .modules[0]
  bmuctl --json drive | jq .drive  the reply to "status", which contains the drive

Group bmud has read access; clear, wake, reload, balance --on and --off, modules accept and modules assign require group
bmud-admin, root or the user of the daemon. The daemon's log lists all commands with their user, "bmuctl faults" also
the last clear of each fault.

Exit codes: 0 answered; 1 no daemon answers, the connection was lost, the request was refused, or the output cannot be
written; 2 command line; 3 incomplete: "clear" left a confirmed fault above "warn" (the output, or "still_present" and
"reasons" of --json, name it with the reason), "modules accept" left a module unregistered (with the reason), "modules
assign" failed, or the pack has no charger or inverter for "charger" or "inverter".)";

constexpr const char* modules_footer = R"(Examples:
  bmuctl modules                         both tables, and all deviations
  bmuctl --json modules | jq '.modules[] | {node, serial_number, problems}'
  bmuctl modules accept 3                register the module found at node 3
  bmuctl modules accept                  the same for all nodes
  bmuctl modules assign 4711 3           assign node 3 to the module with serial number 4711, and verify it
  bmuctl modules assign 4711 3 --unheard the same for a module that was not received, e.g. with a shared node number

The first table shows the module identities: the serial number found and, if it differs, the expected one; the identity
(expected, exchanged, misplaced, swapped, unheard); mode, supply, cells, temperatures, and whether the cell limits of
the pack are set. The second shows the answers: times from POLL to the end of the answer, jitter, complete and missed
answers, single polls of a module with missing data, rejected frames by reason, restarts.

"accept" and "assign" require group bmud-admin, root or the user of the daemon, open contactors and no close request.

Exit codes of "accept": 0 all received modules are registered; modules not received are listed; 3 a received module
could not be registered (two modules with one node number, another serial number in the pack file), or no module was
received at the given NODE; 1 refused, or no answer. Of "assign": 0 the module confirmed the node number, or already had
it; 3 it did not; 1 refused (with the reason), or no answer.
To swap two modules use a third, free node number.)";

constexpr const char* watch_footer = R"(Examples:
  bmuctl watch                     q or Ctrl-C ends it
  bmuctl watch --seconds 60 >log   one line per second for a minute, the live view at the end

Exit codes: 0 ended by key, signal or --seconds; 1 no daemon answers, the connection was lost or the request was
refused; 2 command line.)";

constexpr const char* report_footer_begin = R"(Examples:
  bmuctl report drive.log                            writes drive.html
  bmuctl report drive.log --out - | ssh desk 'cat >drive.html'
  bmuctl report /var/lib/bmud/drives/*.log.zst --out day.html   several, ordered by time, in one page
  bmuctl report drive.log.zst --from "2026-03-01 17:05" --to "2026-03-01 17:20"
  bmuctl report --from -7d --out week.html           of the daemon's history; without --from the last day
  bmuctl report /mnt/card/history.sqlite --from -30d
  bmuctl report /mnt/card/history.sqlite --from begin

)";
constexpr const char* report_footer_end = R"( The page itself uses UTC,
the terminal output the time zone of this host.

The page needs no network: cell voltages over time as bands, with the outliers named, state of charge with its
uncertainty, current and limits with their causes, contactors and faults, temperatures, resistance and balancing of each
cell. The daemon is queried only for the path of its history.

Damaged parts are skipped; reading resumes at the next part of the recording, or at the next valid minute. Gaps, also
between two recordings, are shown in the charts, in a list on the page and on standard error. Data that two recordings
have in common is shown once.

Exit codes: 0 written; 1 input or output error, or no data; 2 command line; 3 written, but a recording or the history is
damaged, or one of several files is not a recording: the page names the places.)";

/// A command with one request and one answer.
struct CommandRow {
  const char* name;
  const char* asks;  // the daemon's command
  const char* help;
  Page (*page)(const Reply&);
  const char* prints;
  const char* example;                          // the text after "bmuctl "
  const char* page_also_asks = nullptr;         // a second request; the page finds its answer under this name
  bool (*falls_short)(const Reply&) = nullptr;  // true if the daemon answered, but did not do all that was requested
  const char* when_short = nullptr;
  std::chrono::milliseconds answer_max = ::answer_max;
};

constexpr std::array command_table{
    CommandRow{
        .name = "status",
        .asks = "status",
        .help = "overview of the pack",
        .page = status_page,
        .prints = "state, values, limits and what binds them, faults, contactors, modules, buses, the daemon itself",
        .example = "--json status | jq .values.current_mA"},
    CommandRow{.name = "cells",
               .asks = "cells",
               .help = "every cell: voltage, temperature, balancing, age",
               .page = cells_page,
               .prints = "a row for each cell, then the temperatures of each module",
               .example = "--json cells | jq .modules[0]"},
    CommandRow{.name = "faults",
               .asks = "faults",
               .help = "all faults with status, count and last reading",
               .page = faults_page,
               .prints = "present and past faults: count, times, freeze frame, typical cause and action",
               .example = "faults cell_imbalance",
               .page_also_asks = "status"},
    CommandRow{.name = "why",
               .asks = "why",
               .help = "reasons for the present state, the last opening and the current limits",
               .page = why_page,
               .prints = "sentences, then the chain of reasons from the measurement to the decision",
               .example = "why | grep Action"},
    CommandRow{.name = "drive",
               .asks = "status",
               .help = "last drive cycle: precharge, throughput, opening",
               .page = drive_page,
               .prints = "the last closing with its precharge, charge and energy since, the last opening",
               .example = "--json drive | jq .drive"},
    CommandRow{.name = "clear",
               .asks = "clear",
               .help = "clear latched faults whose cause is gone",
               .page = clear_page,
               .prints = "the cleared faults, and the reasons for those still confirmed",
               .example = "clear --authorised",
               .falls_short = leaves_faults,
               .when_short = "a fault above \"warn\" is still confirmed"},
    CommandRow{.name = "modules",
               .asks = "modules",
               .help = "module identities, expected identities and answer times",
               .page = modules_page,
               .prints = "",
               .example = ""},
    CommandRow{.name = "balance",
               .asks = "balance",
               .help = "balancing per cell, plan and balancing inhibits",
               .page = balance_page,
               .prints = "the plan, the balancing inhibits, and a row for each cell that takes part",
               .example = "balance --off"},
    CommandRow{
        .name = "health",
        .asks = "health",
        .help = "capacity, resistance and SOH of every cell",
        .page = health_page,
        .prints = "the pack's health, energy and cycles over all sessions of the daemon, then a row for each cell",
        .example = "health"},
    CommandRow{
        .name = "charger",
        .asks = "status",
        .help = "requests to the chargers, their outputs and reports",
        .page = charger_page,
        .prints =
            "stage of the charge, request, and for each unit its output, troubles, temperature and refused frames. "
            "--json prints the reply to \"status\", which contains it as \"charger\"",
        .example = "--json charger | jq .charger.units",
        .falls_short = has_no_charger,
        .when_short = "the pack has no charger; \"charger\" is null then"},
    CommandRow{.name = "inverter",
               .asks = "status",
               .help = "values sent to the inverter, and its reports",
               .page = inverter_page,
               .prints =
                   "keep-alive, permitted charge and discharge, reports. --json prints the reply to \"status\", which "
                   "contains it as \"inverter\"",
               .example = "--json inverter | jq .inverter.told",
               .falls_short = has_no_inverter,
               .when_short = "the pack has no inverter; \"inverter\" is null then"},
    CommandRow{.name = "wake",
               .asks = "wake",
               .help = "wake the modules from sleep after an undervoltage",
               .page = wake_page,
               .prints = "whether the modules were asleep",
               .example = "wake"},
    CommandRow{.name = "reload",
               .asks = "reload",
               .help = "reload the pack file (contactors must be open)",
               .page = reload_page,
               .prints = "the changed values, or all errors of the file",
               .example = "reload",
               .answer_max = reload_answer_max},
};

/// Help text of one command in addition to its options.
std::string footer_of(const CommandRow& row) {
  std::string codes = "0 answered; 1 no daemon answers, connection lost or request refused; 2 command line";
  if (row.when_short != nullptr) codes += "; 3 answered, but " + std::string(row.when_short);
  return "Prints " + std::string(row.prints) + ".\n\nExample:\n  bmuctl " + row.example + "\n\nExit codes: " + codes +
         ".";
}

struct Options {
  std::string socket = "/run/bmud/bmud.sock";
  std::string colour = "auto";
  bool json = false;
  double seconds = 0;
  double period_s = 0;
  bool reconnect = false;
  bool authorised = false;
  std::string fault;  // the name of one; "": all that occurred
  std::uint64_t serial_number = 0;
  std::uint64_t node = 0;  // 0: none given
  bool unheard = false;
  bool balancing_on = false;
  bool balancing_off = false;
};

constexpr CommandRow accept_row{.name = "accept",
                                .asks = "accept_modules",
                                .help = "register the modules found at their nodes",
                                .page = accept_page,
                                .prints = "",
                                .example = "",
                                .falls_short = leaves_unaccepted};

int fail(const char* what) {
  std::fprintf(stderr, "bmuctl: %s\n", what);
  return exit_no_answer;
}

int fail(const std::string& what) {
  return fail(what.c_str());
}

bool wants_colour(const Options& options) {
  if (options.colour != "auto") return options.colour == "always";
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
  return ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr;
}

Result<std::string, std::string> answer_to(const nlohmann::json& question, Client& client,
                                           std::chrono::milliseconds at_most = answer_max) {
  if (auto sent = client.send_line(question.dump()); !sent) return failure(sent.error());
  return client.read_line(at_most);
}

int refused(const Reply& reply) {
  const std::string message = reply["error"]["message"].text();
  const Reply problems = reply["error"]["problems"];
  const int status = fail(message.empty() ? "invalid reply from the daemon" : "refused: " + message);
  for (std::size_t i = 0; i < problems.size(); ++i) std::fprintf(stderr, "%s\n", problems.at(i).text().c_str());
  return status;
}

int ask(const CommandRow& row, const Options& options) {
  auto client = Client::connect(options.socket);
  if (!client) return fail(client.error());
  nlohmann::json question{{"cmd", row.asks}};
  if (options.authorised) question["authorised"] = true;
  if (options.node != 0) question["node"] = options.node;
  if (options.balancing_on) question["switch"] = "on";
  if (options.balancing_off) question["switch"] = "off";
  const auto line = answer_to(question, *client, row.answer_max);
  if (!line) return fail(line.error());
  nlohmann::json json = nlohmann::json::parse(*line, nullptr, false);
  const Reply reply(json);
  if (options.json) write_out(*line + "\n");
  if (!reply["ok"].is_true()) return refused(reply);
  const int status = row.falls_short != nullptr && row.falls_short(reply) ? exit_still_present : exit_ok;
  if (options.json) return status;
  if (row.page_also_asks != nullptr) {
    const auto more = answer_to({{"cmd", row.page_also_asks}}, *client);
    if (!more) return fail(more.error());
    json[row.page_also_asks] = nlohmann::json::parse(*more, nullptr, false);
  }
  write_out(row.page(reply).text(wants_colour(options)));
  return status;
}

/// Suggests the fault names that contain `name`, or the command that lists all of the more than 100 names.
std::string no_such_fault(const std::string& name, const Reply& faults) {
  std::string alike;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    const std::string other = faults.at(i)["name"].text();
    if (other.find(name) != std::string::npos) alike += (alike.empty() ? "" : ", ") + other;
  }
  return "unknown fault \"" + name + "\"; " +
         (alike.empty() ? "all names: bmuctl --json faults | jq -r .faults[].name" : "similar: " + alike);
}

/// Shows one fault by its name, whether it ever occurred or not.
int ask_fault(const Options& options) {
  auto client = Client::connect(options.socket);
  if (!client) return fail(client.error());
  std::array<nlohmann::json, 2> answers;
  constexpr std::array<const char*, 2> questions{"faults", "status"};
  for (std::size_t i = 0; i < questions.size(); ++i) {
    const auto line = answer_to({{"cmd", questions.at(i)}}, *client);
    if (!line) return fail(line.error());
    answers.at(i) = nlohmann::json::parse(*line, nullptr, false);
    if (const Reply reply(answers.at(i)); !reply["ok"].is_true()) return refused(reply);
  }
  const Reply faults = Reply(answers[0])["faults"];
  for (std::size_t i = 0; i < faults.size(); ++i) {
    if (faults.at(i)["name"].text() != options.fault) continue;
    write_out(options.json ? answers[0]["faults"][i].dump() + "\n"
                           : fault_page(faults.at(i), Reply(answers[1])["modules"]).text(wants_colour(options)));
    return exit_ok;
  }
  fail(no_such_fault(options.fault, faults));
  return command_line::exit_usage;
}

/// The assignment of this connection once it is over; the error if the daemon reports another assignment or does not
/// report the end.
Result<nlohmann::json, std::string> assignment_end(std::int64_t number, Client& client) {
  if (auto sent = client.send_line(nlohmann::json{{"cmd", "watch"}, {"period_ms", assignment_period_ms}}.dump());
      !sent) {
    return failure(sent.error());
  }
  for (int picture = 0; picture < assignment_pictures_max; ++picture) {
    const auto line = client.read_line(answer_max);
    if (!line) return failure(line.error());
    nlohmann::json json = nlohmann::json::parse(*line, nullptr, false);
    const Reply assignment = Reply(json)["status"]["assignment"];
    if (assignment["number"].number() != number) return failure(std::string("superseded by another node assignment"));
    if (assignment["is_over"].is_true()) return json["status"]["assignment"];
  }
  return failure(std::string("result unknown: see bmuctl modules"));
}

int assign(const Options& options) {
  auto client = Client::connect(options.socket);
  if (!client) return fail(client.error());
  nlohmann::json question{{"cmd", "assign_module"}, {"serial_number", options.serial_number}, {"node", options.node}};
  if (options.unheard) question["unheard"] = true;
  const auto line = answer_to(question, *client);
  if (!line) return fail(line.error());
  const nlohmann::json json = nlohmann::json::parse(*line, nullptr, false);
  const Reply reply(json);
  if (!reply["ok"].is_true()) {
    if (options.json) write_out(*line + "\n");
    return refused(reply);
  }
  const auto end = assignment_end(reply["assignment"]["number"].number_or(0), *client);
  if (!end) return fail(end.error());
  const Reply assignment(*end);
  write_out(options.json ? end->dump() + "\n" : assignment_page(assignment).text(wants_colour(options)));
  return assignment["is_done"].is_true() ? exit_ok : exit_still_present;
}

std::optional<std::chrono::milliseconds> milliseconds_of(double seconds) {
  if (seconds <= 0) return std::nullopt;
  return std::chrono::milliseconds(static_cast<std::int64_t>(std::llround(seconds * 1000)));
}

int watch_pack(const Options& options) {
  return watch({.socket = options.socket,
                .period = milliseconds_of(options.period_s),
                .duration = milliseconds_of(options.seconds),
                .reconnect = options.reconnect,
                .json = options.json,
                .with_colour = wants_colour(options)});
}

CLI::App* add_watch(CLI::App& app, Options& options) {
  CLI::App* watch = app.add_subcommand("watch", "live view on a terminal; one line per second if redirected");
  watch->add_option("--seconds", options.seconds, "end after this time")->check(command_line::number(0.1, 1e6));
  watch->add_option("--period", options.period_s, "seconds between two updates or lines")
      ->check(command_line::number(0.05, 60.0));
  watch->add_flag("--reconnect", options.reconnect, "reconnect when the connection is lost, instead of ending");
  watch->footer(watch_footer);
  return watch;
}

void add_modules(CLI::App& modules, Options& options) {
  constexpr std::uint64_t node_max = 63;
  modules.footer(modules_footer);
  modules.require_subcommand(0, 1);
  CLI::App* accept = modules.add_subcommand(accept_row.name, accept_row.help);
  accept->add_option("NODE", options.node, "node number; default: all nodes")
      ->check(command_line::whole_number(1, node_max));
  CLI::App* assign = modules.add_subcommand("assign", "assign a node number to the module with this serial number");
  assign->add_option("SERIAL", options.serial_number, "the module's serial number")
      ->required()
      ->check(command_line::whole_number(0, UINT32_MAX));
  assign->add_option("NODE", options.node, "its new node number")
      ->required()
      ->check(command_line::whole_number(1, node_max));
  assign->add_flag("--unheard", options.unheard, "assign even if no module with this serial number has been received");
}

void add_report(CLI::App& app, ReportOptions& options) {
  CLI::App* report = app.add_subcommand("report", "HTML report with charts of a recording, a black box or the history");
  report->footer(std::string(report_footer_begin) + time_words_help + report_footer_end);
  report->add_option("FILE", options.files,
                     "recordings and black boxes, or a history database; default: the daemon's history");
  report
      ->add_option("-o,--out", options.out,
                   "the page; default: the (earliest) FILE with .html instead of its ending; - is standard output")
      ->type_name("PATH");
  report
      ->add_option("--from", options.from,
                   "start of the time range, e.g. \"2026-03-01 17:05\"; default for a history: the last day")
      ->type_name("TIME");
  report->add_option("--to", options.to, "end of the time range")->type_name("TIME");
}

/// Returns the watch command, which has its own options.
const CLI::App* add_options(CLI::App& app, Options& options) {
  app.add_option("--socket", options.socket, "the daemon's socket")->type_name("PATH")->capture_default_str();
  app.add_flag("--json", options.json, "the reply of the daemon, one line of JSON");
  app.add_option("--color", options.colour, "auto, always or never")
      ->check(command_line::one_of({"auto", "always", "never"}))
      ->capture_default_str();
  app.set_version_flag("--version", "bmuctl " BMUD_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  app.footer(footer);
  for (const CommandRow& row : command_table) app.add_subcommand(row.name, row.help)->footer(footer_of(row));
  app.get_subcommand("clear")->add_flag("--authorised", options.authorised,
                                        "also clear faults that require an inspection of the pack");
  app.get_subcommand("faults")->add_option("NAME", options.fault,
                                           "this fault only, recorded or not, with typical cause and action");
  add_modules(*app.get_subcommand("modules"), options);
  CLI::App* balance = app.get_subcommand("balance");
  CLI::Option* off =
      balance->add_flag("--off", options.balancing_off, "switch balancing off until --on or a restart of the daemon");
  balance->add_flag("--on", options.balancing_on, "return to the setting of the pack file")->excludes(off);
  return add_watch(app, options);
}

int ask_modules(const CLI::App& modules, const Options& options) {
  if (modules.got_subcommand("assign")) return assign(options);
  if (modules.got_subcommand(accept_row.name)) return ask(accept_row, options);
  const auto* row = std::find_if(command_table.begin(), command_table.end(),
                                 [](const CommandRow& one) { return one.page == modules_page; });
  return ask(*row, options);
}

int parse_and_ask(int argc, char** argv) {
  Options options;
  ReportOptions report_options;
  CLI::App app("Queries and controls a running bmud.", "bmuctl");
  const CLI::App* watch = add_options(app, options);
  add_report(app, report_options);
  HistoryCommand history;
  history.add_to(app);
  command_line::add_self_description(app, 1);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return command_line::report(app, error);
  }
  if (watch->parsed()) return watch_pack(options);
  report_options.socket = options.socket;
  if (app.got_subcommand("report")) return write_report(report_options);
  if (history.is_given()) {
    return history.run({.socket = options.socket, .json = options.json, .with_colour = wants_colour(options)});
  }
  if (const CLI::App* modules = app.get_subcommand("modules"); modules->parsed()) return ask_modules(*modules, options);
  if (!options.fault.empty()) return ask_fault(options);
  for (const CommandRow& row : command_table) {
    if (app.got_subcommand(row.name)) return ask(row, options);
  }
  return command_line::exit_usage;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return end_output("bmuctl", parse_and_ask(argc, argv));
  } catch (const std::exception& error) {
    return fail(error.what());
  } catch (...) {
    return exit_no_answer;
  }
}
