#include "daemon/recording/replay.hpp"

#include <algorithm>

#include "daemon/core/core_image.hpp"
#include "daemon/recording/image_lines.hpp"

namespace bmu {

namespace {

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.emplace_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

}  // namespace

void count_tick(ReplayCounts& counts, TimePoint at, const RecordClock& clock) {
  ++counts.ticks;
  if (counts.first_log_us == 0) counts.first_log_us = clock.to_log_us(at);
  if (counts.last != TimePoint{} && at > counts.last) counts.covered += at - counts.last;
  counts.last = at;
}

bool Replay::take(std::string_view line) {
  const RecordReader::Took took = reader_.take(line);
  counts_.lines = reader_.lines();
  if (took == RecordReader::Took::nothing) return true;  // does not end a tick, either
  if (took == RecordReader::Took::of_tick) {
    if (tick_) tick_->recorded_lines.emplace_back(line);
    return true;
  }
  compare();
  switch (took) {
    case RecordReader::Took::nothing:
    case RecordReader::Took::of_tick: break;
    case RecordReader::Took::part: return begin_part();
    case RecordReader::Took::tick:
      if (reader_.alteration() && options_.altered) options_.altered(*reader_.alteration());
      decide(reader_.tick());
      break;
    case RecordReader::Took::observation:
      ++counts_.observations;
      static_cast<void>(core_->observe(reader_.observation()));
      break;
    case RecordReader::Took::problem: problem_ = reader_.problem(); return false;
  }
  return true;
}

bool Replay::begin_part() {
  auto core = reader_.make_core(reader_.pack()->core);
  if (!core) {
    problem_ = core.error();
    return false;
  }
  core_ = std::move(*core);
  outputs_ = core_->outputs();
  counts_.last = TimePoint{};
  ++counts_.begun;
  return true;
}

void Replay::decide(const RecordTick& tick) {
  const Decisions decisions = core_->decide(tick.at);
  count_tick(counts_, tick.at, reader_.clock());
  tick_ = Tick{.line = counts_.lines, .recorded = tick, .fingerprint = fingerprint_of(decisions)};
  if (tick_->fingerprint != tick.fingerprint) {
    std::string text;
    append_decisions(text, tick.at, decisions, outputs_, tick.lines_sum, reader_.clock(), reader_.buses());
    tick_->replayed_lines = lines_of(text);
    tick_->replayed_lines.erase(tick_->replayed_lines.begin());  // the tick's own line
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
                        .log_us = reader_.clock().to_log_us(tick_->recorded.at),
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

}  // namespace bmu
