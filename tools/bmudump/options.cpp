#include "tools/bmudump/options.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include <net/if.h>
#include <unistd.h>

#include "tools/common/command_line.hpp"

namespace bmu::dump {
namespace {

constexpr std::uint32_t bit_rate_max = 1'000'000;  // classic CAN has no more
constexpr std::uint32_t vehicle_base_max = 0x7FF - 8;

constexpr const char* description =
    "Prints what each frame on the battery's buses means, signal by signal with value and unit, as it arrives on an\n"
    "interface or out of a candump log. Frames that the daemon would reject are marked with the reason.";

constexpr const char* footer = R"(
Examples:
  bmudump can0                                live, until Ctrl-C
  bmudump unix:demo --filter 'CELLS_*,MODULE' two kinds of message on the embedded bus of a demonstration
  bmudump -r drive.log                        a log made with: candump -l can0
  candump -L can0 | bmudump -r -              from standard input
  bmudump -r drive.log --summary              what was on the bus, what failed and why, how busy it was
  bmudump -r drive.log --json | jq 'select(.ok == false)'
  bmudump can0 --log > drive.log              record as a candump log, from unix:NAME as well
  bmudump --dbc internal --nodes 1-8 > internal.dbc

A text line: (time) bus identifier MESSAGE node N, then each signal. "unknown", "not fitted", "open", "shorted" stand
where the sender has no number. "!! wrong crc" and the like mark a frame that failed its check, with its bytes.
In JSON, values are in the unit their name ends with, and null where there is no number.

Exit codes:
  0  all was read (frames that failed their check are marked, which is no error); also when the reader of our output
     goes away
  1  something could not be opened, read or written
  2  the command line is wrong
  3  some log lines were damaged: each is reported with file, line and column, and skipped
  4  with --strict: some frames failed their check or are unknown)";

std::optional<std::uint32_t> parse_hex(std::string_view word) {
  if (word.starts_with("0x") || word.starts_with("0X")) word.remove_prefix(2);
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number, 16);
  if (error != std::errc{} || end != word.data() + word.size() || word.empty()) return std::nullopt;
  return number;
}

/// "1-4" and "7": nodes 1 to 63. Throws the library's error for what is none.
std::vector<std::uint8_t> parse_nodes(const std::vector<std::string>& parts) {
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
    if (error != std::errc{} || at != end || first < 1 || last > 63 || first > last) {
      throw CLI::ValidationError("--nodes", "'" + part + "' is no node or range of nodes from 1 to 63, like 7 or 1-4");
    }
    for (unsigned node = first; node <= last; ++node) nodes.push_back(static_cast<std::uint8_t>(node));
  }
  return nodes;
}

std::string upper(std::string_view text) {
  std::string all(text);
  std::transform(all.begin(), all.end(), all.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return all;
}

/// A recording where a bus is wanted, as a newcomer writes it. An interface goes before a file of the same name.
bool looks_like_file(const std::string& bus) {
  if (bus.starts_with("unix:") || if_nametoindex(bus.c_str()) != 0) return false;
  std::error_code ignored;
  return bus.ends_with(".log") || bus.find('/') != std::string::npos || std::filesystem::is_regular_file(bus, ignored);
}

bool wants_colour(const std::string& when) {
  if (when != "auto") return when == "always";
  return isatty(STDOUT_FILENO) == 1 && std::getenv("NO_COLOR") == nullptr;
}

/// Text as CLI11 collects it, before it means something.
struct Words {
  std::string colour = "auto";
  std::vector<std::string> nodes{"1-4"};
  std::string vehicle_base = "620";
  bool json = false;
  bool log = false;
  bool summary = false;
};

void declare(CLI::App& app, Options& options, Words& words) {
  app.set_version_flag("--version", "bmudump " BMUD_VERSION);
  app.footer(footer);
  app.add_option("BUS", options.buses, "interface (can0, vcan0) or embedded bus (unix:NAME); several show together");
  app.add_option("-r,--read", options.files, "read a candump log (candump -l or -L) instead; - is standard input")
      ->type_name("FILE");
  CLI::Option* json = app.add_flag("--json", words.json, "one JSON object a line");
  CLI::Option* log = app.add_flag("--log", words.log, "candump log lines, as candump -L writes them");
  CLI::Option* summary = app.add_flag("--summary", words.summary, "counts at the end instead of lines");
  json->excludes(log)->excludes(summary);
  log->excludes(summary);
  app.add_flag("--brief", options.is_brief, "leave out flags that are not set, empty cell masks and counters");
  app.add_option("--filter", options.filter, "show only these: identifiers, message names in any case, or NAME*")
      ->type_name("WHAT[,WHAT..]")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--count", options.count, "end after this many frames shown")->check(command_line::whole_number(1));
  app.add_option("--seconds", options.seconds, "live: end after this time")->check(command_line::number(0.001, 1e9));
  app.add_flag("--strict", options.is_strict, "exit with 4 if a frame failed its check or is unknown");
  app.add_option("--vehicle-base", words.vehicle_base, "first identifier of the vehicle messages, hexadecimal")
      ->capture_default_str();
  app.add_flag("--sensor-little-endian", options.catalogue.sensor_little_endian,
               "the current sensor is configured for little-endian values");
  app.add_option("--bitrate", options.bit_rate, "bit/s, for the load in --summary")
      ->capture_default_str()
      ->check(command_line::whole_number(1, bit_rate_max));
  app.add_option("--color", words.colour, "colours: auto (on a terminal), always, never")
      ->capture_default_str()
      ->check(command_line::one_of({"auto", "always", "never"}));
  app.add_option("--dbc", options.dbc, "print a DBC file of this bus: internal or vehicle")
      ->check(command_line::one_of({"internal", "vehicle"}));
  app.add_option("--nodes", words.nodes, "nodes in the DBC")
      ->capture_default_str()
      ->type_name("N[-M][,..]")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_flag("--protocol-doc", options.wants_protocol_doc, "print the tables of docs/bus-protocol.md");
}

/// What CLI11 cannot check. Throws its error type, to be reported in the same way.
void conclude(Options& options, const Words& words) {
  if (words.json) options.output = Output::json;
  if (words.log) options.output = Output::log;
  if (words.summary) options.output = Output::summary;
  options.is_coloured = wants_colour(words.colour);
  const std::optional<std::uint32_t> base = parse_hex(words.vehicle_base);
  if (!base || *base > vehicle_base_max) {
    throw CLI::ValidationError("--vehicle-base", "'" + words.vehicle_base + "' is no hexadecimal number from 0 to 7F7");
  }
  options.catalogue.vehicle_base_id = *base;
  options.nodes = parse_nodes(words.nodes);
  const bool prints_tables = options.wants_protocol_doc || !options.dbc.empty();
  const int inputs = (prints_tables ? 1 : 0) + (options.files.empty() ? 0 : 1) + (options.buses.empty() ? 0 : 1);
  if (inputs == 0) throw CLI::ValidationError("what shall be shown? Wanted is a bus, or a recording with -r FILE");
  if (inputs > 1) throw CLI::ValidationError("a bus, -r and --dbc exclude each other");
  const auto file = std::find_if(options.buses.begin(), options.buses.end(), looks_like_file);
  if (file != options.buses.end()) {
    throw CLI::ValidationError(*file, "this is no bus; to read a recording: bmudump -r " + *file);
  }
  if (options.seconds && options.buses.empty()) throw CLI::ValidationError("--seconds", "is for live buses only");
}

}  // namespace

ParsedOptions parse_options(int argc, const char* const* argv) {
  CLI::App app(description, "bmudump");
  Options options;
  Words words;
  try {
    declare(app, options, words);
    app.parse(argc, argv);
    conclude(options, words);
    return {options, exit_ok};
  } catch (const CLI::ParseError& error) {
    return {std::nullopt, command_line::report(app, error)};
  }
}

bool Filter::add(const std::vector<std::string>& words, const Catalogue& catalogue, std::string& complaint) {
  for (const std::string& word : words) {
    is_empty_ = false;
    if (add_names(word, catalogue)) continue;
    const std::optional<std::uint32_t> id = parse_hex(word);
    if (!id || *id > 0x1FFF'FFFF) {
      complaint = word;
      return false;
    }
    if (*id < ids_.size() && word.size() < 8) {
      ids_.set(*id);
    } else {
      extended_ids_.push_back(*id);
    }
  }
  return true;
}

bool Filter::add_names(std::string_view word, const Catalogue& catalogue) {
  const bool is_beginning = word.ends_with('*');
  if (is_beginning) word.remove_suffix(1);
  const std::string name = upper(word);  // as all names of messages are
  bool is_found = false;
  for (const MessageSpec* message : catalogue.messages()) {
    if (is_beginning ? !message->name.starts_with(name) : message->name != name) continue;
    is_found = true;
    for (unsigned node = message->node_min; node <= message->node_max; ++node) ids_.set(message->base_id + node);
  }
  return is_found;
}

bool Filter::passes(const CanFrame& frame) const {
  if (is_empty_) return true;
  if (!frame.is_extended && !frame.is_error) return ids_.test(frame.id);
  return std::find(extended_ids_.begin(), extended_ids_.end(), frame.id) != extended_ids_.end();
}

}  // namespace bmu::dump
