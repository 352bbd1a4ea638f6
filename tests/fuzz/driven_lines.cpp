// The file of driven lines, as the stop hook reads it: an accepted one is written as a text with the same content that
// is written the same again, and all its lines are opened and no other. For a damaged file there is a message of one
// line, and the lines of the pack file are opened.
//
// Input: the file. Whether the kernel grants all lines in one request follows from its size.
#include "daemon/shell/gpio/driven_lines.hpp"

#include <cerrno>
#include <set>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "daemon/shell/gpio/gpio_lines.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/memory_file.hpp"

using namespace bmu;

namespace {

using nlohmann::json;

/// A chip and one of its lines.
using Line = std::pair<std::string, std::uint32_t>;

constexpr std::uint32_t chip_lines = UINT32_MAX;  // the maximum of a chip: its last line has one number less

/// A kernel with every chip and every line, which records the lines that it is requested to drive.
class EveryChip final : public GpioSystem {
 public:
  explicit EveryChip(bool grants_one_at_a_time) : grants_one_at_a_time_(grants_one_at_a_time) {}

  std::set<Line> driven;

  int open_chip(const std::string& file) override {
    chip_ = file.c_str();  // up to the zero byte, as the kernel reads it
    return chip_fd;
  }
  int chip_info(int, gpiochip_info& out) override {
    out.lines = chip_lines;
    return 0;
  }
  int line_info(int, gpio_v2_line_info&) override { return 0; }
  int request_lines(int chip, gpio_v2_line_request& request) override {
    FUZZ_CHECK(chip == chip_fd && request.num_lines >= 1 && request.num_lines <= gpio_output_count);
    if (grants_one_at_a_time_ && request.num_lines > 1) return -EBUSY;
    for (std::uint32_t index = 0; index < request.num_lines; ++index) driven.emplace(chip_, request.offsets[index]);
    return lines_fd;
  }
  int get_values(int, gpio_v2_line_values&) override { return -EINVAL; }
  int set_values(int, const gpio_v2_line_values&) override { return -EINVAL; }
  int read_edges(int, std::span<gpio_v2_line_event>) override { return -EAGAIN; }
  void close_fd(int) override {}

 private:
  static constexpr int chip_fd = 1000;  // not a real descriptor
  static constexpr int lines_fd = 1001;

  std::string chip_;
  bool grants_one_at_a_time_;
};

GpioConfig of_pack_file() {
  GpioConfig gpio{.chip = "/dev/gpiochip-of-the-pack-file"};
  gpio.outputs.at(static_cast<std::size_t>(GpioOutput::main_positive)) = {.line = 17, .active_low = true};
  gpio.outputs.at(static_cast<std::size_t>(GpioOutput::fan)) = {.line = 18, .active_low = false};
  return gpio;
}

std::set<Line> lines_of(const GpioConfig& gpio) {
  std::set<Line> lines;
  for (const auto& output : gpio.outputs) {
    if (output) lines.emplace(gpio.chip, output->line);
  }
  return lines;
}

/// The lines in the file, found by a generic JSON reader.
std::set<Line> lines_in(std::string_view text) {
  std::set<Line> lines;
  const json file = json::parse(text);
  for (const json& output : file.at("outputs")) lines.emplace(file.at("chip"), output.at("line"));
  return lines;
}

void check_written_again(const GpioConfig& gpio) {
  const std::string written = driven_lines_text(gpio);
  const auto again = parse_driven_lines(written);
  FUZZ_CHECK(again && driven_lines_text(again) == written && again->chip == gpio.chip);
  for (std::size_t output = 0; output < gpio_output_count; ++output) {
    const auto& line = gpio.outputs.at(output);
    const auto& line_again = again->outputs.at(output);
    FUZZ_CHECK(line.has_value() == line_again.has_value());
    FUZZ_CHECK(!line || (line->line == line_again->line && line->active_low == line_again->active_low));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzz::text_of(data, size);
  const fuzz::MemoryFile file(text);
  const auto read = read_driven_lines(file.path());
  if (read) {
    FUZZ_CHECK(read->has_value());  // the file exists
    check_written_again(**read);
  } else {
    const std::string message = to_text(read.error());
    FUZZ_CHECK(message.starts_with(file.path() + ": found ") && message.find('\n') == std::string::npos);
  }

  // As the hook does (main.cpp).
  EveryChip chip(size % 2 == 0);
  const std::size_t refused = open_gpio_outputs(read ? **read : of_pack_file(), chip).size();
  std::set<Line> wanted = read ? lines_in(text) : lines_of(of_pack_file());
  const std::size_t not_there = std::erase_if(wanted, [](const Line& line) { return line.second >= chip_lines; });
  FUZZ_CHECK(chip.driven == wanted && refused == not_there);
  return 0;
}
