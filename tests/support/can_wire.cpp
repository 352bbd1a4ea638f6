#include "tests/support/can_wire.hpp"

#include <utility>

namespace bmu::test {

namespace {

/// What arbitration compares: of two frames whose first 11 bits are equal the standard one wins.
std::uint64_t rank(const CanFrame& frame) {
  const std::uint64_t first_11_bits = frame.is_extended ? frame.id >> 18 : frame.id;
  const std::uint64_t rest = frame.is_extended ? (1U << 18) | (frame.id & 0x3FFFF) : 0;
  return first_11_bits << 20 | rest << 1 | (frame.is_remote ? 1U : 0U);
}

}  // namespace

void CanWire::start_if_idle(TimePoint now) {
  if (carried_) return;
  auto winner = queues_.end();
  for (auto one = queues_.begin(); one != queues_.end(); ++one) {
    const auto silent = is_silent_.find(one->first);
    if (one->second.empty() || (silent != is_silent_.end() && silent->second)) continue;
    if (winner == queues_.end() || rank(one->second.front()) < rank(winner->second.front())) winner = one;
  }
  if (winner == queues_.end()) return;
  const CanFrame frame = winner->second.front();
  winner->second.pop_front();
  carried_ = Carried{.from = winner->first, .frame = frame, .done_at = now + time_on_wire(frame)};
}

std::optional<CanWire::Carried> CanWire::take_done(TimePoint now) {
  if (!carried_ || carried_->done_at > now) return {};
  return std::exchange(carried_, std::nullopt);
}

std::size_t CanWire::waiting(Station station) const {
  const auto queue = queues_.find(station);
  return queue == queues_.end() ? 0 : queue->second.size();
}

}  // namespace bmu::test
