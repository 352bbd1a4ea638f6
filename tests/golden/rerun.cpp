#include "tests/golden/rerun.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <functional>
#include <memory>
#include <vector>

#include "daemon/core/core_image.hpp"
#include "daemon/recording/record_reader.hpp"
#include "protocol/fnv.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {

namespace {

constexpr std::string_view birth_mark = "began_us ";
constexpr std::string_view counter_mark = " first_counter ";

std::vector<std::uint8_t> image_of(const Core& core) {
  std::vector<std::uint8_t> bytes(core_image_size(core));
  write_core_image(core, bytes);
  return bytes;
}

/// Calls `take` for each line until it returns false.
void each_line(std::string_view text, const std::function<bool(std::string_view)>& take) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    if (!take(text.substr(0, end))) return;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

/// Appends the readable results of a decision: changes of the contactor commands, and events.
void append_told(std::string& to, double second, std::string_view lines) {
  each_line(lines, [&](std::string_view line) {
    if (!line.starts_with("# = ") && !line.starts_with("# ! ")) return true;
    std::array<char, 16> at{};
    (void)std::snprintf(at.data(), at.size(), "%9.3f s  ", second);
    to.append(at.data()).append(line.substr(2)).push_back('\n');
    return true;
  });
}

class Rerun {
 public:
  Rerun(const Birth& birth, const Proof& proof) : birth_(birth), proof_(proof) {}

  bool take(std::string_view line) {
    switch (reader_.take(line)) {
      case RecordReader::Took::nothing:
      case RecordReader::Took::of_tick: break;
      case RecordReader::Took::part:
        ++outcome_.parts;
        if (!core_) begin();
        break;
      case RecordReader::Took::observation: (void)core_->observe(reader_.observation()); break;
      case RecordReader::Took::tick: decide(reader_.tick()); break;
      case RecordReader::Took::problem:
        FAIL("line " << reader_.problem()->line << ": " << reader_.problem()->text);
        return false;
    }
    return true;
  }

  RerunOutcome end() {
    REQUIRE(core_ != nullptr);
    watch_->check();
    return std::move(outcome_);
  }

 private:
  void begin() {
    core_ = std::make_unique<Core>(reader_.pack()->core, TimePoint{std::chrono::microseconds{birth_.started_at_us}},
                                   birth_.first_counter);
    outputs_ = core_->outputs();
    watch_ = std::make_unique<ProofWatch>(proof_, *core_);
  }

  void decide(const RecordTick& tick) {
    const Decisions decisions = core_->decide(tick.at);
    watch_->decided(tick.at, decisions);
    const std::uint64_t fingerprint = fingerprint_of(decisions);
    ++outcome_.ticks;
    if (fingerprint == tick.fingerprint) ++outcome_.ticks_as_recorded;
    outcome_.fingerprint = continue_fnv(outcome_.fingerprint, std::to_string(fingerprint));
    std::string lines;
    append_decisions(lines, tick.at, decisions, outputs_, tick.lines_sum, reader_.clock(), reader_.buses());
    append_told(outcome_.told, to_s(tick.at - core_->started_at()), lines);
    outputs_ = decisions.outputs;
  }

  Birth birth_;
  const Proof& proof_;
  RecordReader reader_;
  std::unique_ptr<Core> core_;
  std::unique_ptr<ProofWatch> watch_;
  ContactorOutputs outputs_;
  RerunOutcome outcome_;
};

}  // namespace

std::string to_text(const Birth& birth) {
  return std::string(birth_mark) + std::to_string(birth.started_at_us) + std::string(counter_mark) +
         std::to_string(birth.first_counter);
}

std::optional<Birth> birth_of_text(std::string_view line) {
  const std::size_t at = line.find(counter_mark);
  if (!line.starts_with(birth_mark) || at == std::string_view::npos) return std::nullopt;
  Birth birth;
  const std::string_view began = line.substr(birth_mark.size(), at - birth_mark.size());
  const std::string_view counter = line.substr(at + counter_mark.size());
  const auto is_whole = [](std::string_view text, auto& number) {
    const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
    return read.ec == std::errc{} && read.ptr == text.data() + text.size();
  };
  if (!is_whole(began, birth.started_at_us) || !is_whole(counter, birth.first_counter)) return std::nullopt;
  return birth;
}

std::optional<Birth> birth_of_recording(const std::string& text) {
  RecordReader reader;
  std::unique_ptr<Core> recorded;
  each_line(text, [&](std::string_view line) {
    const RecordReader::Took took = reader.take(line);
    if (took != RecordReader::Took::part) return took == RecordReader::Took::nothing;
    auto core = reader.make_core(reader.pack()->core);
    if (core) recorded = std::move(*core);
    return false;
  });
  if (!recorded) return std::nullopt;
  const std::vector<std::uint8_t> wanted = image_of(*recorded);
  for (unsigned counter = 0; counter <= UINT8_MAX; ++counter) {
    const auto first_counter = static_cast<std::uint8_t>(counter);
    const auto fresh = std::make_unique<Core>(reader.pack()->core, recorded->started_at(), first_counter);
    if (image_of(*fresh) != wanted) continue;
    const auto began = recorded->started_at().time_since_epoch();
    return Birth{.started_at_us = std::chrono::floor<std::chrono::microseconds>(began).count(),
                 .first_counter = first_counter};
  }
  return std::nullopt;
}

RerunOutcome rerun(const std::string& text, const Birth& birth, const Proof& proof) {
  Rerun run(birth, proof);
  each_line(text, [&](std::string_view line) { return run.take(line); });
  return run.end();
}

}  // namespace bmu::test
