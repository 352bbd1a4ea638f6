// bmuctl: asks the daemon, and shows the answer.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <nlohmann/json.hpp>
#include <unistd.h>

#include "tools/bmuctl/client.hpp"
#include "tools/bmuctl/terminal.hpp"
#include "tools/bmuctl/text_pages.hpp"
#include "tools/bmuctl/watch.hpp"
#include "tools/common/command_line.hpp"

namespace {

using namespace bmu;

constexpr int exit_ok = 0;
constexpr int exit_no_answer = 1;
constexpr int exit_still_present = 3;
constexpr std::chrono::milliseconds answer_max{2000};

constexpr const char* footer = R"(Examples:
  bmuctl status                    the whole pack at a glance
  bmuctl watch                     the live picture; q or Ctrl-C ends it
  bmuctl watch --seconds 60 >log   a line a second for a minute, the picture at the end
  bmuctl why                       why it opened, why it does not close, why it is limited
  bmuctl clear                     end faults that wait for it and whose cause is gone
  bmuctl clear --authorised        those, too, that need somebody who has looked at the pack
  bmuctl wake                      wake the modules of a pack that rests after an undervoltage
  bmuctl --json cells | jq .modules[0]
  bmuctl --json drive | jq .drive  the answer to "status", in which the drive is

With --authorised the daemon obeys root and the user it runs as, nobody else; who cleared what is in the log and in
"bmuctl faults".

Exit codes: 0 answered; 1 no daemon answers, it went away, or it refused; 2 command line; 3 answered, but "clear" left a
fault that does more than warn: what it prints, or "still_present" and "reasons" of --json, say which and why.)";

/// A command that is one question and one answer.
struct CommandRow {
  const char* name;
  const char* asks;  // the daemon's command
  const char* help;
  Page (*page)(const Reply&);
  const char* page_also_asks = nullptr;         // a second question, whose answer the page finds under its name
  bool (*falls_short)(const Reply&) = nullptr;  // was answered, and did not do all that was asked for
};

constexpr std::array command_table{
    CommandRow{"status", "status", "the whole pack at a glance", status_page},
    CommandRow{"cells", "cells", "every cell: voltage, temperature, balancing, age", cells_page},
    CommandRow{"faults", "faults", "every fault the daemon knows, and what was seen", faults_page, "status"},
    CommandRow{"why", "why", "why the pack is in its state, why it opened, why it is limited", why_page},
    CommandRow{"drive", "status", "how the pack closed last, what went through it, why it opened", drive_page},
    CommandRow{"clear", "clear", "clear latched faults whose cause is gone", clear_page, nullptr, leaves_faults},
    CommandRow{"wake", "wake", "wake the modules of a pack that rests after an undervoltage", wake_page},
};

struct Options {
  std::string socket = "/run/bmud/bmud.sock";
  std::string colour = "auto";
  bool json = false;
  double seconds = 0;
  double period_s = 0;
  bool reconnect = false;
  bool authorised = false;
};

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

Result<std::string, std::string> answer_to(const nlohmann::json& question, Client& client) {
  if (auto sent = client.send_line(question.dump()); !sent) return failure(sent.error());
  return client.read_line(answer_max);
}

int ask(const CommandRow& row, const Options& options) {
  auto client = Client::connect(options.socket);
  if (!client) return fail(client.error());
  nlohmann::json question{{"cmd", row.asks}};
  if (options.authorised) question["authorised"] = true;
  const auto line = answer_to(question, *client);
  if (!line) return fail(line.error());
  nlohmann::json json = nlohmann::json::parse(*line, nullptr, false);
  const Reply reply(json);
  if (options.json) write_out(*line + "\n");
  if (!reply["ok"].is_true()) {
    const std::string message = reply["error"]["message"].text();
    return fail(message.empty() ? "the daemon's answer makes no sense" : "the daemon refuses: " + message);
  }
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
  CLI::App* watch = app.add_subcommand("watch", "the live picture on a terminal, a line a second elsewhere");
  watch->add_option("--seconds", options.seconds, "end after so long")->check(command_line::number(0.1, 1e6));
  watch->add_option("--period", options.period_s, "seconds between two pictures or lines")
      ->check(command_line::number(0.05, 60.0));
  watch->add_flag("--reconnect", options.reconnect, "wait for the daemon while it is away, instead of ending");
  return watch;
}

/// Returns the watch command, which has options of its own.
const CLI::App* add_options(CLI::App& app, Options& options) {
  app.add_option("--socket", options.socket, "the daemon's socket")->type_name("PATH")->capture_default_str();
  app.add_flag("--json", options.json, "the daemon's own answer, a line of JSON");
  app.add_option("--color", options.colour, "auto, always or never")
      ->check(command_line::one_of({"auto", "always", "never"}))
      ->capture_default_str();
  app.set_version_flag("--version", "bmuctl " BMUD_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  app.footer(footer);
  for (const CommandRow& row : command_table) app.add_subcommand(row.name, row.help);
  app.get_subcommand("clear")->add_flag("--authorised", options.authorised,
                                        "those, too, that need somebody who has looked at the pack");
  return add_watch(app, options);
}

int parse_and_ask(int argc, char** argv) {
  Options options;
  CLI::App app("Shows and asks a running bmud.", "bmuctl");
  const CLI::App* watch = add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return command_line::report(app, error);
  }
  if (watch->parsed()) return watch_pack(options);
  for (const CommandRow& row : command_table) {
    if (app.got_subcommand(row.name)) return ask(row, options);
  }
  return command_line::exit_usage;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return parse_and_ask(argc, argv);
  } catch (const std::exception& error) {
    return fail(error.what());
  } catch (...) {
    return exit_no_answer;
  }
}
