// Options of bmudump, and its specific exit code.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/shell/cli/exit_codes.hpp"
#include "tools/bmudump/device_choice.hpp"
#include "tools/bmudump/identify/dump_catalogue.hpp"
#include "tools/bmudump/line_start.hpp"

namespace bmu::dump {

using exit_codes::exit_damaged;
using exit_codes::exit_ok;
using exit_codes::exit_system;
using exit_codes::exit_usage;
inline constexpr int exit_suspect = 4;  // --strict: some frames failed their check or are unknown

enum class Output : std::uint8_t { text, json, log, summary, summary_json, follow };

/// "can0,123:7FF,#FFFFFFFF": a bus, and the filters of its frames.
struct BusWord {
  std::string name;
  std::vector<std::string> filter;
};

struct Options {
  std::vector<BusWord> buses;      // live: to receive from; with files: to show
  std::vector<std::string> files;  // of -r; "-" is standard input
  Output output = Output::text;
  std::string log_file;  // instead of standard output
  LineStart::Style start;
  bool is_brief = false;
  bool has_letters = false;
  bool is_strict = false;
  bool is_coloured = false;
  std::optional<std::uint64_t> count;
  std::optional<double> seconds;
  std::optional<std::chrono::milliseconds> silence;  // live: end after this time without a frame
  std::vector<std::string> filter;
  DumpCatalogue::Choice catalogue;
  std::string dialect = "auto";
  std::vector<DeviceWord> devices;
  std::uint32_t bit_rate = 500'000;
  std::string dbc;  // internal, vehicle, charger or a device: print it and exit
  std::vector<std::uint8_t> nodes;
  bool wants_protocol_doc = false;
  bool wants_devices = false;
};

/// Options, or the exit code if help or errors were printed.
struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = exit_ok;
};
[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

}  // namespace bmu::dump
