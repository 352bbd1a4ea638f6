#include "tools/bmudump/options.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <system_error>

#include <net/if.h>
#include <unistd.h>

#include "daemon/shell/cli/command_line.hpp"
#include "tools/bmudump/filter.hpp"

namespace bmu::dump {
namespace {

constexpr std::uint32_t bit_rate_max = 1'000'000;  // the maximum of classic CAN
constexpr std::uint32_t vehicle_base_max = 0x7FF - 8;

constexpr const char* description =
    "Prints what each frame on the battery's buses means, signal by signal with value and unit, as it arrives on an\n"
    "interface or out of a candump log or screen, plain or packed (zstd, gzip). Frames that the daemon would reject "
    "are\n"
    "marked with the reason. Options of candump are those of candump where it has them, but for -r.";

constexpr const char* footer = R"(
Examples:
  bmudump can0                                live, until Ctrl-C
  bmudump --follow can0                       a table that is kept up to date: last values, rates, gaps, failures
  bmudump unix:demo --filter 'CELLS_*,MODULE' two kinds of message on the embedded bus of a demonstration
  bmudump -td can0,143:7FF,#FFFFFFFF can1     filters as candump has them, times since the line before
  bmudump -r drive.log                        a log made with: candump -l can0
  bmudump vcan1 -r drive.log.zst              one bus of a packed log; buses go before -r, which takes several files
  candump -L can0 | bmudump -r -              from standard input
  bmudump -r drive.log --summary              what was on the bus, how often, longest gaps, what failed and why, load
  bmudump -r drive.log --json | jq 'select(.ok == false)'
  bmudump can0 -L > drive.log                 record as a candump log, from unix:NAME as well; -l makes up a name
  bmudump --dbc internal --nodes 1-8 > internal.dbc
  bmudump can0 --device elcon_tc              a charger on the same bus
  bmudump can0 --device i3_csc                modules of a BMW i3 in the place of ours
  bmudump --protocol-doc --device sma         the tables of an inverter

A text line: (time) bus identifier MESSAGE node N, then each signal. "unknown", "not fitted", "open", "shorted" stand
where the sender has no number. "!! wrong crc" and the like mark a frame that failed its check, with its bytes.
In the place of MESSAGE, "unknown" means that no message read there has the identifier; or that cars use it, too, and no
frame has shown whose the bus is: one with the right checksum shows the internal bus, for a device or a traction pack
it is one that fits in length and ranges. --device BUS=NAME declares a bus.
In JSON, values are in the unit their name ends with, and null where there is no number.

Filters, of a bus (BUS,FILTER,..) and of --filter: an identifier or message name, NAME*, ID:MASK (identifiers that are
equal where the mask has ones), ID~MASK (all others), #MASK (error frames of these classes), j (all masks at once, not
one of them). Hidden frames are still checked.

Exit codes:
  0  all was read (frames that failed their check are marked, which is no error); also when the reader of our output
     goes away
  1  something could not be opened, read or written
  2  the command line is wrong
  3  some of a log was damaged, or its last line torn: such lines are skipped, the first 1000 reported with file, line and column, the others
     counted; places in a packed file are reported with their offset
  4  with --strict: some frames failed their check or are unknown)";

/// Default of --nodes for bmud's buses; for a device all its nodes.
constexpr const char* usual_nodes = "1-4";

/// "1-4" and "7" of these nodes, as numbered in the rows of `whose` ("" for bmud's). Throws the library's error for an
/// invalid part.
std::vector<std::uint8_t> parse_nodes(const std::vector<std::string>& parts, const NodeRange& range,
                                      const std::string& whose) {
  std::vector<std::uint8_t> nodes;
  for (const std::string& part : parts) {
    unsigned first = 0;
    const char* const end = part.data() + part.size();
    auto [at, error] = std::from_chars(part.data(), end, first);
    unsigned last = first;
    if (error == std::errc{} && at != end && *at == '-') {
      const auto second = std::from_chars(at + 1, end, last);
      at = second.ptr;
      error = second.ec;
    }
    if (error != std::errc{} || at != end || first < range.first || last > range.last || first > last) {
      const std::string span = std::to_string(range.first) + " to " + std::to_string(range.last);
      std::string problem = "'" + part + "' is no node or range of nodes";
      problem += whose.empty() ? " from " : ": " + whose + " has ";
      problem += span;
      if (whose.empty()) problem += ", like 7 or 1-4";
      throw CLI::ValidationError("--nodes", problem);
    }
    for (unsigned node = first; node <= last; ++node) {
      nodes.push_back(static_cast<std::uint8_t>(node - range.maker_less));
    }
  }
  return nodes;
}

/// The nodes of the requested DBC.
std::vector<std::uint8_t> nodes_of(const std::string& dbc, const std::vector<std::string>& asked) {
  const std::optional<NodeRange> range = nodes_of_dbc(dbc);
  const bool is_ours = devices_of_dbc(dbc).empty();
  if (!range && asked.empty()) return {};
  if (!range) throw CLI::ValidationError("--nodes", "the messages of " + dbc + " have no nodes");
  if (!asked.empty()) return parse_nodes(asked, *range, is_ours ? "" : dbc);
  const std::string all = std::to_string(range->first) + "-" + std::to_string(range->last);
  return parse_nodes({is_ours ? usual_nodes : all}, *range, "");
}

/// True for a recording given instead of a bus, a common error. An interface takes precedence over a file of the same
/// name.
bool looks_like_file(const BusWord& word) {
  const std::string& bus = word.name;
  if (bus.starts_with("unix:") || if_nametoindex(bus.c_str()) != 0) return false;
  std::error_code ignored;
  return bus.ends_with(".log") || bus.find('/') != std::string::npos || std::filesystem::is_regular_file(bus, ignored);
}

bool wants_colour(const std::string& when) {
  if (when != "auto") return when == "always";
  return isatty(STDOUT_FILENO) == 1 && std::getenv("NO_COLOR") == nullptr;
}

/// Option texts as collected by CLI11, before interpretation.
struct Words {
  std::vector<std::string> buses;
  std::string colour = "auto";
  std::vector<std::string> nodes;
  std::vector<std::string> devices;
  std::string vehicle_base = "620";
  std::string time = "a";
  std::uint64_t silence_ms = 0;
  int colours = 0;  // number of -c
  int usual = 0;    // number of candump's options that request the default behaviour
  bool json = false;
  bool log = false;
  bool log_with_name = false;
  bool summary = false;
  bool follow = false;
};

struct TimeWord {
  std::string_view word;
  TimeForm form;
};
constexpr TimeWord time_words[] = {{"a", TimeForm::absolute},
                                   {"d", TimeForm::delta},
                                   {"z", TimeForm::zero},
                                   {"A", TimeForm::date},
                                   {"none", TimeForm::none}};

std::vector<std::string> dialect_words() {
  std::vector<std::string> words{"auto"};
  for (const Dialect& row : dialect_table) {
    if (!row.rows.empty()) words.emplace_back(row.name);
  }
  return words;
}

void declare_input(CLI::App& app, Options& options, Words& words) {
  app.add_option("BUS", words.buses,
                 "interface (can0, vcan0, any) or embedded bus (unix:NAME), optionally with filters: BUS,FILTER,..; "
                 "several are shown together; before -r: only these buses of the log");
  app.add_option("-r,--read", options.files,
                 "read logs of candump (-l or -L) or its screen in a file, plain, zstd or gzip; - is standard input")
      ->type_name("FILE");
  app.add_option("--filter", options.filter,
                 "show only these: identifiers, message names, NAME*, ID:MASK, ID~MASK, #MASK, j")
      ->type_name("WHAT[,WHAT..]")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("-n,--count", options.count, "end after this many frames shown")->check(command_line::whole_number(1));
  app.add_option("--seconds", options.seconds, "live: end after this time")->check(command_line::number(0.001, 1e9));
  app.add_option("-T,--silence", words.silence_ms, "live: end after so many milliseconds without a frame")
      ->type_name("MS")
      ->check(command_line::whole_number(1, 1'000'000'000));
}

void declare_output(CLI::App& app, Options& options, Words& words) {
  app.add_flag("--follow", words.follow, "a table of all identifiers, updated in place (once, if this is no terminal)");
  app.add_flag("--summary", words.summary, "counts at the end instead of lines; with --json as JSON");
  app.add_flag("--json", words.json, "one JSON object a line");
  app.add_flag("-L,--log", words.log, "candump log lines, as candump -L writes them");
  app.add_flag("-l", words.log_with_name, "the same into a file candump-DATE_TIME.log");
  app.add_option("-f,--log-file", options.log_file, "the same into this file")->type_name("FILE");
  app.add_option("-t,--time", words.time,
                 "time: a absolute, d since the line before, z since the first, A with date, none")
      ->capture_default_str()
      ->check(command_line::one_of({"a", "d", "z", "A", "none"}));
  app.add_flag("-x", options.start.has_direction,
               "show the direction of a frame (RX or TX) if known, and for CAN FD the flags B (BRS) and E (ESI)");
  app.add_flag("-a", options.has_letters, "where bytes are shown, show them as letters, too");
  app.add_flag("--brief", options.is_brief, "leave out flags that are not set, empty cell masks and counters");
  app.add_option("--color", words.colour, "colours: auto (on a terminal), always, never")
      ->capture_default_str()
      ->check(command_line::one_of({"auto", "always", "never"}));
  app.add_flag("-c", words.colours, "--color always");
  app.add_flag("-e,-d,-D", words.usual, "accepted for candump compatibility; always active");
  app.add_flag("--strict", options.is_strict, "exit with 4 if a frame failed its check or is unknown");
}

/// Its text is short, however many devices there are; completions offer them all.
CLI::Validator one_of_dbc_words() {
  std::string all;
  for (const std::string& word : dbc_words()) all.append(all.empty() ? "{" : ",").append(word);
  const auto check = [](const std::string& text) -> std::string {
    const std::vector<std::string> words = dbc_words();
    if (std::find(words.begin(), words.end(), text) != words.end()) return "";
    return "'" + text + "' is none of internal, vehicle, charger, and no device; " + device_advice(text);
  };
  return CLI::Validator(check, all + "}");
}

void declare_reading(CLI::App& app, Options& options, Words& words) {
  app.add_option("--vehicle-base", words.vehicle_base, "first identifier of the vehicle messages, hexadecimal")
      ->capture_default_str();
  app.add_option("--dialect", options.dialect, "dialect of the vehicle messages; auto: detected from 620h and 622h")
      ->capture_default_str()
      ->check(command_line::one_of(dialect_words()));
  app.add_option("--device", words.devices,
                 "also decode the device NAME, on every bus; with BUS=NAME on that bus, where only the devices named "
                 "so are decoded (BUS=vehicle, BUS=internal; any is every bus); --devices lists them")
      ->type_name("[BUS=]NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_flag("--devices", options.wants_devices, "list the known devices");
  app.add_flag("--sensor-little-endian", options.catalogue.sensor_little_endian,
               "the current sensor is configured for little-endian values");
  app.add_option("--bitrate", options.bit_rate, "bit/s, for the load")
      ->capture_default_str()
      ->check(command_line::whole_number(1, bit_rate_max));
  app.add_option("--dbc", options.dbc, "print a DBC file of this bus or device: internal, vehicle, charger (all), NAME")
      ->type_name("WHAT")
      ->check(one_of_dbc_words());
  app.add_option("--nodes", words.nodes,
                 "nodes in the DBC, as a pack file counts them; default: 1-4 for the buses of bmud, all for a device")
      ->type_name("N[-M][,..]")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_flag("--protocol-doc", options.wants_protocol_doc,
               "print the tables of docs/bus-protocol.md, or those of what --device names");
}

void declare(CLI::App& app, Options& options, Words& words) {
  app.set_version_flag("--version", "bmudump " BMUD_VERSION);
  app.footer(footer);
  declare_input(app, options, words);
  declare_output(app, options, words);
  declare_reading(app, options, words);
}

std::vector<DeviceWord> parse_devices(const std::vector<std::string>& words) {
  std::vector<DeviceWord> devices;
  for (const std::string& text : words) {
    const std::optional<DeviceWord> word = device_word_of(text);
    if (!word) {
      throw CLI::ValidationError("--device", "found '" + text +
                                                 "', expected NAME, BUS=NAME, BUS=internal or BUS=vehicle; " +
                                                 device_advice(std::string_view(text).substr(text.find('=') + 1)));
    }
    devices.push_back(*word);
  }
  return devices;
}

BusWord bus_word_of(const std::string& text) {
  BusWord word;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string part = text.substr(begin, end - begin);
    if (begin == 0) {
      word.name = part;
    } else if (!part.empty()) {
      word.filter.push_back(part);
    }
    begin = end + 1;
  }
  return word;
}

/// A file name as candump generates it.
std::string log_name_of_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), "candump-%Y-%m-%d_%H%M%S.log", &parts);
  return text.data();
}

/// Throws if more than one form of output is requested; JSON of a summary is one form.
void check_one_form(const Words& words, const Options& options) {
  struct Form {
    std::string_view name;
    bool is_wanted;
  };
  const Form forms[] = {
      {"--follow", words.follow}, {"--summary", words.summary}, {"--json", words.json && !words.summary},
      {"--log", words.log},       {"-l", words.log_with_name},  {"--log-file", !options.log_file.empty()}};
  std::string wanted;
  int count = 0;
  for (const Form& form : forms) {
    if (!form.is_wanted) continue;
    wanted += (wanted.empty() ? "" : " and ") + std::string(form.name);
    ++count;
  }
  if (count > 1) throw CLI::ValidationError(wanted + " exclude each other");
}

Output output_of(const Words& words, const Options& options) {
  if (words.follow) return Output::follow;
  if (words.summary) return words.json ? Output::summary_json : Output::summary;
  if (words.log || !options.log_file.empty()) return Output::log;
  return words.json ? Output::json : Output::text;
}

void conclude_input(Options& options, const Words& words) {
  for (const std::string& text : words.buses) options.buses.push_back(bus_word_of(text));
  const bool prints_tables = options.wants_protocol_doc || options.wants_devices || !options.dbc.empty();
  const bool has_input = !options.files.empty() || !options.buses.empty();
  if (!prints_tables && !has_input) {
    throw CLI::ValidationError("no input, expected a bus or -r FILE");
  }
  if (prints_tables && has_input) {
    throw CLI::ValidationError("--dbc, --devices and --protocol-doc read no bus and no log");
  }
  if (!options.files.empty()) return;
  const auto file = std::find_if(options.buses.begin(), options.buses.end(), looks_like_file);
  if (file != options.buses.end()) {
    throw CLI::ValidationError(file->name, "not a bus; to read a recording: bmudump -r " + file->name);
  }
}

/// Checks that CLI11 cannot make. Throws its error type, so that it is reported in the same way.
void conclude(Options& options, const Words& words) {
  check_one_form(words, options);
  if (words.log_with_name) options.log_file = log_name_of_now();
  options.output = output_of(words, options);
  options.is_coloured = wants_colour(words.colours > 0 ? "always" : words.colour);
  options.start.time = std::find_if(std::begin(time_words), std::end(time_words), [&words](const TimeWord& row) {
                         return row.word == words.time;
                       })->form;
  if (options.start.time != TimeForm::absolute && options.output != Output::text) {
    throw CLI::ValidationError("--time", "is for text lines; all else has absolute times");
  }
  const std::optional<std::uint32_t> base = parse_hex(words.vehicle_base);
  if (!base || *base > vehicle_base_max) {
    throw CLI::ValidationError("--vehicle-base", "'" + words.vehicle_base + "' is no hexadecimal number from 0 to 7F7");
  }
  options.catalogue.vehicle_base_id = *base;
  options.devices = parse_devices(words.devices);
  options.catalogue.devices = devices_everywhere(options.devices);
  options.nodes = nodes_of(options.dbc, words.nodes);
  conclude_input(options, words);
  const bool is_live = options.files.empty();
  if (options.seconds && !is_live) throw CLI::ValidationError("--seconds", "is for live buses only");
  if (words.silence_ms > 0 && !is_live) throw CLI::ValidationError("--silence", "is for live buses only");
  if (words.silence_ms > 0) options.silence = std::chrono::milliseconds(words.silence_ms);
}

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  CLI::App app(description, "bmudump");
  Options options;
  Words words;
  try {
    declare(app, options, words);
    command_line::add_self_description(app, 1);
    app.parse(argc, argv);
    conclude(options, words);
    return {options, exit_ok};
  } catch (const CLI::ParseError& error) {
    return {std::nullopt, command_line::report(app, error)};
  }
}

}  // namespace bmu::dump
