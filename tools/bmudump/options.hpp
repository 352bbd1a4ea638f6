// What bmudump was asked to do, and its exit codes.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/bmudump/dump_catalogue.hpp"

namespace bmu::dump {

enum ExitCode : int {
  exit_ok = 0,
  exit_system = 1,   // something could not be opened, read or written
  exit_usage = 2,    // the command line
  exit_damaged = 3,  // some log lines were damaged and skipped
  exit_suspect = 4,  // --strict: some frames failed their check or are unknown
};

enum class Output : std::uint8_t { text, json, log, summary };

struct Options {
  std::vector<std::string> buses;
  std::vector<std::string> files;  // of -r; "-" is standard input
  Output output = Output::text;
  bool is_brief = false;
  bool is_strict = false;
  bool is_coloured = false;
  std::optional<std::uint64_t> count;
  std::optional<double> seconds;
  std::vector<std::string> filter;
  DumpCatalogue::Choice catalogue;
  std::uint32_t bit_rate = 500'000;
  std::string dbc;  // internal or vehicle: print it and end
  std::vector<std::uint8_t> nodes;
  bool wants_protocol_doc = false;
};

/// Options, or the exit code to end with: help and errors are printed.
struct ParsedOptions {
  std::optional<Options> options;
  int exit_code = exit_ok;
};
[[nodiscard]] ParsedOptions parse_options(int argc, const char* const* argv);

/// The frames --filter lets through. Without one it lets everything through.
class Filter {
 public:
  /// Each word is a hexadecimal identifier, a message name, or the beginning of names followed by '*'.
  /// False if a word is neither; `complaint` says which.
  [[nodiscard]] bool add(const std::vector<std::string>& words, const Catalogue& catalogue, std::string& complaint);
  [[nodiscard]] bool passes(const CanFrame& frame) const;

 private:
  bool add_names(std::string_view word, const Catalogue& catalogue);

  bool is_empty_ = true;
  std::bitset<Catalogue::id_count> ids_;
  std::vector<std::uint32_t> extended_ids_;
};

}  // namespace bmu::dump
