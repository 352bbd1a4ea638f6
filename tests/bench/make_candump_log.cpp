// Writes a candump log as of a pack of eight 12-cell modules: POLL every 100 ms with all answers, the power
// distribution unit and the current sensor in their periods, the vehicle messages once a second. Every frame passes its
// receive check. The same number of lines gives the same log, byte for byte.
//
//   make_candump_log LINES > FILE
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <vector>

#include "protocol/candump.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"

namespace {

using namespace bmu;

constexpr std::uint8_t module_count = 8;
constexpr std::int64_t step_us = 10'000;

/// Gives the same numbers with every standard library, unlike its distributions.
class Random {
 public:
  std::int64_t between(std::int64_t low, std::int64_t high) {
    state_ = state_ * 6'364'136'223'846'793'005U + 1'442'695'040'888'963'407U;
    return low + static_cast<std::int64_t>((state_ >> 33) % static_cast<std::uint64_t>(high - low + 1));
  }

 private:
  std::uint64_t state_ = 20'260'101;
};

class LogMaker {
 public:
  explicit LogMaker(long line_count) : lines_left_(line_count) {}

  void run() {
    for (std::int64_t step = 0; lines_left_ > 0; ++step) {
      time_us_ = 1'700'000'000'000'000 + step * step_us;
      if (step % 5 == 0) contactors();
      if (step % 2 == 0) sensor(internal_bus::sensor_current, -60'000, 180'000);
      if (step % 6 == 0) {
        sensor(internal_bus::sensor_u1, 345'000, 355'000);
        sensor(internal_bus::sensor_u2, 345'000, 355'000);
      }
      if (step % 10 == 0) poll_cycle();
      if (step % 100 >= 20 && step % 100 < 29) send(*vehicle_bus::rows[step % 100 - 20], 0, 0);
    }
  }

 private:
  /// A plausible value: within the range of the field, limited to that of a healthy pack.
  std::int64_t plausible(const SignalSpec& signal) {
    const RawRange range = raw_range(signal);
    const auto in_field = [&](std::int64_t low, std::int64_t high) {
      return std::clamp(random_.between(low, high), range.min * signal.scale, range.max * signal.scale);
    };
    switch (signal.unit) {
      case Unit::uV: return in_field(3'640'000, 3'660'000);
      case Unit::mV: return in_field(43'700, 43'900);
      case Unit::mA: return in_field(0, 200'000);
      case Unit::dC: return in_field(180, 320);
      case Unit::text: return 0x424D'5544'2030'2E31;
      default: return signal.bit_count > 8 ? in_field(0, 3) : in_field(0, 1);
    }
  }

  void send(const MessageSpec& message, std::uint8_t node, std::uint8_t counter) {
    CanFrame frame = make_frame(message, node);
    for (const SignalSpec& signal : message.signals) encode_signal(signal, known(plausible(signal)), frame.data);
    finish(message, counter, frame);
  }

  void sensor(const MessageSpec& message, std::int64_t low, std::int64_t high) {
    CanFrame frame = make_frame(message);
    encode_signal(message.signals.front(), known(random_.between(low, high)), frame.data);
    finish(message, next_counter(message), frame);
  }

  void contactors() {
    send(internal_bus::contactor_command, 0, next_counter(internal_bus::contactor_command));
    send(internal_bus::pdu_status, 0, next_counter(internal_bus::pdu_status));
  }

  void poll_cycle() {
    const std::uint8_t counter = next_counter(internal_bus::poll);
    CanFrame poll = make_frame(internal_bus::poll);
    write<internal_bus::poll, "want_status">(poll, 1);
    write<internal_bus::poll, "want_cells">(poll, 1);
    write<internal_bus::poll, "want_temp">(poll, 1);
    write<internal_bus::poll, "want_module">(poll, 1);
    finish(internal_bus::poll, counter, poll);
    for (const MessageSpec* answer :
         {&internal_bus::status, &internal_bus::cells_1, &internal_bus::cells_2, &internal_bus::cells_3,
          &internal_bus::cells_4, &internal_bus::temp_1, &internal_bus::temp_2, &internal_bus::module}) {
      for (std::uint8_t node = 1; node <= module_count; ++node) send(*answer, node, counter);
    }
  }

  std::uint8_t next_counter(const MessageSpec& message) { return ++counters_[message.base_id]; }

  void finish(const MessageSpec& message, std::uint8_t counter, CanFrame& frame) {
    if (lines_left_ == 0) return;
    --lines_left_;
    seal(message, counter, frame);
    std::array<char, log_line_length_max> text{};
    const LogLine line{.kind = LogLineKind::frame, .time_us = time_us_, .bus = "vcan0", .frame = frame};
    const std::size_t length = print_log_line(line, text);
    text[length] = '\n';
    std::fwrite(text.data(), 1, length + 1, stdout);
    time_us_ += 230;  // duration of a full frame at 500 kbit/s
  }

  long lines_left_;
  std::int64_t time_us_ = 0;
  std::map<std::uint32_t, std::uint8_t> counters_;
  Random random_;
};

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): running out of memory may end it
int main(int argc, char** argv) {
  const long line_count = argc == 2 ? std::atol(argv[1]) : 0;  // NOLINT(cert-err34-c): 0 is refused below
  if (line_count <= 0) {
    std::fputs("usage: make_candump_log LINES > FILE\n", stderr);
    return 2;
  }
  LogMaker(line_count).run();
  return std::fflush(stdout) == 0 ? 0 : 1;
}
