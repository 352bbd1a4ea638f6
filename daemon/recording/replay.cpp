#include "daemon/recording/replay.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "config/bus_rate.hpp"
#include "daemon/core/core_image.hpp"
#include "daemon/recording/image_lines.hpp"
#include "daemon/recording/record_writer.hpp"

namespace bmu {

namespace {

/// Of a damaged or hostile file; ours are a tenth of it.
constexpr std::size_t image_size_max = std::size_t{32} << 20;

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

template <class Number>
std::optional<Number> number(std::string_view text, int base = 10) {
  Number value{};
  const auto done = std::from_chars(text.data(), text.data() + text.size(), value, base);
  const bool is_whole = !text.empty() && done.ec == std::errc{} && done.ptr == text.data() + text.size();
  return is_whole ? std::optional(value) : std::nullopt;
}

/// "| the end of a line", or "+ a part" that the next goes on with.
bool append_line(std::string& text, std::string_view rest) {
  if (rest.empty() || (rest[0] != '|' && rest[0] != '+')) return false;
  if (rest.size() > 2) text += rest.substr(2);
  if (rest[0] == '|') text += '\n';
  return true;
}

}  // namespace

bool Replay::fail(std::string text, ReplayProblemKind kind) {
  problem_ = ReplayProblem{.kind = kind, .line = counts_.lines, .text = std::move(text)};
  return false;
}

bool Replay::fail_without_head() {
  return fail("found no whole head before, wanted '# bmud-recording' to '# core-end'",
              is_in_head_ ? ReplayProblemKind::damaged : ReplayProblemKind::no_recording);
}

bool Replay::take(std::string_view line) {
  ++counts_.lines;
  const auto parsed = parse_record_line(line, clock_, head_.buses);
  if (!parsed) {
    if (core_ == nullptr && !is_in_head_) return fail_without_head();
    return fail("column " + std::to_string(parsed.error().column + 1) + ": wanted " + parsed.error().wanted);
  }
  if (const auto* const note = std::get_if<RecordNote>(&*parsed)) return take_note(*note);
  if (core_ == nullptr || is_in_head_) {
    return std::holds_alternative<RecordNothing>(*parsed) || fail_without_head();
  }
  const bool is_of_tick = std::holds_alternative<RecordSent>(*parsed) ||
                          std::holds_alternative<RecordOutputs>(*parsed) ||
                          std::holds_alternative<RecordEvent>(*parsed);
  if (is_of_tick) {
    if (!tick_) return fail("found a part of a decision, wanted its tick before it");
    tick_->recorded_lines.emplace_back(line);
    return true;
  }
  compare();
  if (const auto* const tick = std::get_if<RecordTick>(&*parsed)) decide(*tick);
  if (const auto* const observation = std::get_if<Observation>(&*parsed)) {
    ++counts_.observations;
    static_cast<void>(core_->observe(*observation));
  }
  return true;
}

void Replay::decide(const RecordTick& tick) {
  const Decisions decisions = core_->decide(tick.at);
  ++counts_.ticks;
  if (counts_.first_log_us == 0) counts_.first_log_us = clock_.to_log_us(tick.at);
  if (counts_.last != TimePoint{} && tick.at > counts_.last) counts_.covered += tick.at - counts_.last;
  counts_.last = tick.at;
  tick_ = Tick{.line = counts_.lines, .recorded = tick, .fingerprint = fingerprint_of(decisions)};
  if (tick_->fingerprint != tick.fingerprint) {
    std::string text;
    append_decisions(text, tick.at, decisions, outputs_, clock_, head_.buses);
    tick_->replayed_lines = lines_of(text);
    tick_->replayed_lines.erase(tick_->replayed_lines.begin());  // the tick's own
  }
  outputs_ = decisions.outputs;
}

void Replay::compare() {
  if (!tick_) return;
  if (tick_->fingerprint != tick_->recorded.fingerprint) {
    ++counts_.ticks_different;
    if (options_.differs) {
      options_.differs({.line = tick_->line,
                        .at = tick_->recorded.at,
                        .log_us = clock_.to_log_us(tick_->recorded.at),
                        .recorded = std::move(tick_->recorded_lines),
                        .replayed = std::move(tick_->replayed_lines)});
    }
  }
  tick_.reset();
}

void Replay::end() {
  compare();
}

std::uint64_t Replay::checksum() const {
  if (core_ == nullptr) return 0;
  std::vector<std::uint8_t> bytes(core_image_size(*core_));
  write_core_image(*core_, bytes);
  return image_checksum(bytes);
}

// --- the head -------------------------------------------------------------------------------------------------------

bool Replay::take_note(const RecordNote& note) {
  compare();
  const std::string_view word = note.word;
  const std::string_view rest = note.rest;
  if (word == "bmud-recording") {
    if (number<int>(rest) != record_format) {
      return fail("found a recording of format '" + std::string(rest) + "', wanted " + std::to_string(record_format),
                  ReplayProblemKind::other_version);
    }
    head_ = {};
    is_in_head_ = true;
    return true;
  }
  return take_head(note.word, note.rest);
}

bool Replay::take_head(std::string_view word, std::string_view rest) {
  if (word == "version") {
    head_.version = rest;
  } else if (word == "bus") {
    const std::size_t space = rest.find(' ');
    if (space == std::string_view::npos) return fail("wanted which bus, and its name");
    (rest.substr(0, space) == to_text(Port::vehicle) ? head_.buses.vehicle : head_.buses.internal) =
        rest.substr(space + 1);
  } else if (word == "ahead_us") {
    const auto ahead_us = number<std::int64_t>(rest);
    if (!ahead_us) return fail("wanted microseconds between both clocks");
    clock_.ahead_us = *ahead_us;
  } else if (word == "continues") {
    head_.continues = true;
  } else if (word == "configuration") {
    head_.origin.hash = rest;
  } else if (word == "internal_kbit_per_s") {
    const auto rate = number<std::int32_t>(rest);
    if (!rate || *rate < 1) return fail("wanted a bit rate in kbit/s");
    head_.origin.internal_kbit_per_s = *rate;
  } else if (word == "pack-file") {
    head_.origin.sources.pack_name = rest;
  } else if (word == "cell-file") {
    head_.origin.sources.cell_name = rest;
  } else if (word == "pack" || word == "cell") {
    return append_line(word == "pack" ? head_.origin.sources.pack_text : head_.origin.sources.cell_text, rest) ||
           fail("wanted a line of a file behind '|' or '+'");
  } else if (word == "core") {
    const std::size_t space = std::min(rest.find(' '), rest.size());
    const auto layout = number<std::uint64_t>(rest.substr(0, space), 16);
    const auto size = number<std::size_t>(rest.substr(std::min(space + 1, rest.size())));
    if (!layout || !size || *size > image_size_max) return fail("wanted layout and size of a core");
    head_.layout = *layout;
    head_.image_size = *size;
  } else if (word == "image") {
    if (!append_image_bytes(rest, head_.image_size, head_.image)) {
      return fail("wanted base64 of at most " + std::to_string(head_.image_size) + " bytes");
    }
  } else if (word == "zeros") {
    if (!append_image_zeros(rest, head_.image_size, head_.image)) {
      return fail("wanted a number of zeros, and at most " + std::to_string(head_.image_size) + " bytes");
    }
  } else if (word == "core-end") {
    return begin_core(rest);
  }
  return true;  // what a later version adds
}

bool Replay::read_pack() {
  if (pack_ && head_.origin == origin_of_pack_) return true;
  auto pack = parse_pack_config(head_.origin.sources);
  if (!pack) return fail("the recorded configuration: " + to_text(pack.error().front()));
  std::array<char, 17> hash{};
  std::snprintf(hash.data(), hash.size(), "%016llx", static_cast<unsigned long long>(pack->core.hash));
  if (head_.origin.hash != hash.data()) {
    return fail("found configuration " + std::string(hash.data()) + ", wanted " + head_.origin.hash +
                " as the head says");
  }
  origin_of_pack_ = head_.origin;
  const std::int64_t bit_per_s = std::int64_t{head_.origin.internal_kbit_per_s} * 1000;
  pack_ = bit_per_s == 0 ? std::move(*pack) : at_rate(*pack, bit_per_s);
  return true;
}

bool Replay::begin_core(std::string_view checksum) {
  if (!read_pack()) return false;
  if (head_.layout != core_image_layout()) {
    return fail("it was written by version " + head_.version + ", whose core has other members than this one's",
                ReplayProblemKind::other_version);
  }
  is_in_head_ = false;
  checksum_at_begin_ = image_checksum(head_.image);
  if (head_.image.size() != head_.image_size || number<std::uint64_t>(checksum, 16) != checksum_at_begin_) {
    return fail("the state of the core is damaged");
  }
  ++counts_.begun;
  const bool goes_on = options_.other && head_.continues && core_ != nullptr;
  if (goes_on) return true;
  const auto config = options_.other ? options_.other(*pack_) : pack_->core;
  if (!config) return fail(config.error(), ReplayProblemKind::other_pack);
  core_ = std::make_unique<Core>(*config, TimePoint{});
  if (const auto problem = read_core_image(head_.image, *core_)) {
    core_ = nullptr;
    return fail("the state of the core: " + std::string(to_text(*problem)));
  }
  outputs_ = core_->outputs();
  counts_.last = TimePoint{};
  head_.image = {};
  return true;
}

}  // namespace bmu
