// Pulses of an insulation monitor on a line of a chip of the kernel: from the kernel's times of the edges, through
// GpioLines, to the state and the resistance. Started by tests/rig/gpio_guest.sh.
#include <chrono>
#include <optional>

#include "daemon/shell/can/bus_port.hpp"
#include "daemon/shell/gpio/gpio_lines.hpp"
#include "protocol/ir155_capture.hpp"
#include "tests/rig/gpio/chip.hpp"
#include "tests/rig/gpio/insulation_monitor.hpp"

namespace bmu {

using namespace test;
using ir155::State;

namespace {

/// The reading that a daemon would have at each of its ticks, until its state is `wanted` or patience_ms are over.
std::optional<ir155::Reading> read_until(GpioLines& lines, State wanted) {
  const TimePoint began_at = monotonic_now();
  std::optional<ir155::Reading> last;
  while (monotonic_now() - began_at < std::chrono::milliseconds(patience_ms)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const auto levels = lines.read();
    INFO((levels ? "" : to_text(levels.error())));
    REQUIRE(levels);
    if (const auto pwm = lines.pulses(monotonic_now())) last = ir155::decode(*pwm);
    if (last && last->state == wanted) return last;
  }
  return last;
}

void require_open(GpioLines& lines) {
  const auto opened = lines.open();
  INFO((opened ? "" : to_text(opened.error())));
  REQUIRE(opened);
}

}  // namespace

TEST_CASE("each word of an IR155 on a line is read by the kernel's times of its edges") {
  PackFile pack;
  pack.capture_pulses();
  InsulationMonitor monitor({State::normal, known(300'000)});
  GpioLines lines(pack.lines());
  require_open(lines);
  const auto normal = read_until(lines, State::normal);
  CHECK(monitor.works());
  REQUIRE(normal);
  REQUIRE(normal->state == State::normal);
  REQUIRE(normal->resistance_Ohm.is_valid());
  CHECK(normal->resistance_Ohm.value > 250'000);
  CHECK(normal->resistance_Ohm.value < 350'000);
  for (const State state : {State::undervoltage, State::speed_start_bad, State::speed_start_good, State::device_error,
                            State::earth_fault, State::normal}) {
    INFO(to_text(state));
    monitor.say({state, known(300'000)});
    const auto read = read_until(lines, state);
    REQUIRE(read);
    CHECK(read->state == state);
  }
  CHECK(monitor.works());
}

}  // namespace bmu
