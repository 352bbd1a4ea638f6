#include "tools/mmusim/recording.hpp"

namespace bmu::sim {

namespace {

constexpr Duration part_length = 30s;
constexpr std::int64_t clock_at_start_us = 1'700'000'000'000'000;
constexpr std::size_t write_after_bytes = std::size_t{1} << 20;

}  // namespace

Recording::Recording(const std::string& path, const PackConfig& pack, VirtualRun& run)
    : run_(run),
      writer_({.version = BMUD_VERSION,
               .buses = record_buses(pack.buses),
               .sources = pack.sources,
               .hash = pack.core.hash}),
      file_(path, std::ios::binary | std::ios::trunc) {
  begin_part(run.now());
  run_.set_tap(this);
}

Recording::~Recording() {
  run_.set_tap(nullptr);
}

void Recording::begin_part(TimePoint now) {
  const Duration elapsed = now - VirtualRun::start;
  const std::int64_t clock_us =
      clock_at_start_us + std::chrono::duration_cast<std::chrono::microseconds>(elapsed).count();
  writer_.begin(run_.core(), now, clock_us, has_begun_);
  has_begun_ = true;
  part_began_at_ = now;
}

void Recording::observed(const Observation& observation) {
  // Before an observation, all recorded observations have been processed and decided on.
  if (is_part_due_) begin_part(observation.at);
  is_part_due_ = false;
  writer_.observed(observation);
}

void Recording::decided(TimePoint at, const Decisions& decisions) {
  writer_.decided(at, decisions);
  is_part_due_ = is_part_due_ || at - part_began_at_ >= part_length;
  if (writer_.text().size() > write_after_bytes) write();
}

void Recording::write() {
  file_ << writer_.text();
  writer_.clear();
}

bool Recording::finish() {
  write();
  file_.flush();
  return file_.good();
}

}  // namespace bmu::sim
