// What bmudump makes of a log: a line of text, or of JSON that a machine can read, for every frame it shows; and a
// summary of any of them.
//
// Input: lines of a log.
#include "tools/bmudump/dump.hpp"

#include <string>

#include <nlohmann/json.hpp>

#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace bmu;

namespace {

using dump::Output;

const dump::Catalogues& catalogues() {
  static const dump::Catalogues all({}, dump::dialect_table, "auto");
  return all;
}

struct Shown {
  std::size_t frames = 0;
  std::string text;
};

Shown shown(std::string_view log, const dump::Options& options) {
  const dump::Filter filter;
  const fuzz::MemoryFile written;
  Shown result;
  dump::Dump dump(options, catalogues(), filter, {}, written.fd());
  for (const std::string_view line : fuzz::lines_of(log)) {
    const auto parsed = parse_log_line(line);
    if (!parsed || parsed->kind == LogLineKind::nothing) continue;
    if (dump.show(*parsed)) ++result.frames;
  }
  FUZZ_CHECK(dump.finish(dump::exit_ok) == dump::exit_ok);
  result.text = written.text();
  return result;
}

/// Each line by itself.
bool are_json(std::string_view text) {
  const auto lines = fuzz::lines_of(text);
  return std::all_of(lines.begin(), lines.end(), [](std::string_view line) { return nlohmann::json::accept(line); });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view log = fuzz::text_of(data, size).substr(0, 16'384);

  const Shown text = shown(log, {.output = Output::text, .start = {.has_direction = true}, .has_letters = true});
  FUZZ_CHECK(fuzz::lines_of(text.text).size() == text.frames);

  const Shown json = shown(log, {.output = Output::json, .start = {.has_direction = true}});
  FUZZ_CHECK(fuzz::lines_of(json.text).size() == json.frames && are_json(json.text));

  // What is written as a log is shown the same once more.
  const Shown as_log = shown(log, {.output = Output::log});
  FUZZ_CHECK(shown(as_log.text, {.output = Output::log}).text == as_log.text);

  FUZZ_CHECK(are_json(shown(log, {.output = Output::summary_json}).text));
  static_cast<void>(shown(log, {.output = Output::summary}));
  static_cast<void>(shown(log, {.output = Output::follow, .start = {.time = dump::TimeForm::date}}));
  return 0;
}
