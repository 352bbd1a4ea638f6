#include "daemon/core/poll_schedule.hpp"

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

/// Once known, identities are asked again in every n-th poll: a module swapped while live gives itself away.
constexpr std::uint64_t identity_every = 100;

CanFrame poll_frame(std::uint8_t node, const PollWants& wants, std::uint8_t counter) {
  using namespace internal_bus;
  CanFrame frame = make_frame(poll);
  write<poll, "target_node">(frame, node);
  write<poll, "sync">(frame, 1);
  write<poll, "want_status">(frame, wants.status ? 1 : 0);
  write<poll, "want_cells">(frame, wants.cells ? 1 : 0);
  write<poll, "want_temp">(frame, wants.temperatures ? 1 : 0);
  write<poll, "want_module">(frame, wants.module ? 1 : 0);
  write<poll, "want_ident">(frame, wants.identity ? 1 : 0);
  seal(poll, counter, frame);
  return frame;
}

}  // namespace

void PollSchedule::init(const PollConfig& config, TimePoint started_at) {
  config_ = config;
  next_at_ = started_at;
}

Poll PollSchedule::step(TimePoint now, bool identities_known) {
  if (now < next_at_) return {};
  next_at_ += config_.period;
  if (next_at_ <= now) next_at_ = now + config_.period;  // after a gap; no burst to catch up
  const PollWants wants{.temperatures = cycle_ % config_.temperature_every == 0,
                        .identity = !identities_known || cycle_ % identity_every == 0};
  ++cycle_;
  return {.is_due = true, .frame = poll_frame(0, wants, counter_++), .wants = wants};
}

CanFrame PollSchedule::single(std::uint8_t node, const PollWants& wants) {
  return poll_frame(node, wants, counter_++);
}

}  // namespace bmu
