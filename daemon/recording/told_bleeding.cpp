#include "daemon/recording/told_bleeding.hpp"

#include <chrono>

namespace bmu {

namespace {

constexpr std::size_t bytes_of_an_order = 6;  // followed by counter and checksum
constexpr std::int64_t minutes_unchanged = 7;

std::uint16_t bit_of(std::size_t cell) {
  return static_cast<std::uint16_t>(1U << cell);
}

}  // namespace

void ToldBleeding::note(const CanFrame& command, TimePoint at) {
  using internal_bus::Operation;
  constexpr std::size_t first = signal_index(internal_bus::command, "balancing_time_1_s");
  const auto operation = static_cast<Operation>(read_raw<internal_bus::command, "operation">(command));
  if (operation != Operation::balance && operation != Operation::stop_balancing) return;
  for (std::size_t byte = 0; byte < bytes_of_an_order; ++byte) {
    orders_ = (orders_ ^ command.data[byte]) * fnv_prime;
  }
  for (std::size_t cell = 0; cell < until_.size(); ++cell) {
    const bool is_stop = operation == Operation::stop_balancing;
    note_minutes(cell, is_stop ? 0 : raw_of(internal_bus::command.signals[first + cell], command.data), at);
  }
}

/// The same minutes again, while they run, change nothing.
void ToldBleeding::note_minutes(std::size_t cell, std::int64_t minutes, TimePoint at) {
  if (minutes == minutes_unchanged) return;
  told_ |= bit_of(cell);
  if (minutes == minutes_[cell] && at < until_[cell]) return;
  minutes_[cell] = minutes;
  until_[cell] = at + std::chrono::minutes(minutes);
}

std::uint16_t ToldBleeding::on(TimePoint now) const {
  std::uint16_t cells = 0;
  for (std::size_t cell = 0; cell < until_.size(); ++cell) {
    if (now < until_[cell]) cells |= bit_of(cell);
  }
  return cells;
}

}  // namespace bmu
