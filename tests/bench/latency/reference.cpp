#include "tests/bench/latency/reference.hpp"

#include <cstdio>

#include <poll.h>

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/shell/can/bus_port.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::latency {

int answer_on(const std::string& bus, const RealTimeWishes& wishes) {
  constexpr Duration command_period = 50ms;
  prepare_real_time(wishes);
  auto port = open_bus(bus, {.receive_ids = {internal_bus::pdu_status.base_id}});
  const auto entered = enter_real_time(wishes);
  if (!port || !entered) {
    std::fprintf(stderr, "%s\n", to_text(port ? entered.error() : port.error()).c_str());
    return 1;
  }
  ContactorOutputs outputs{.main_positive = true, .main_negative = true};
  std::uint8_t counter = 0;
  TimePoint send_at{};
  while (true) {
    if (monotonic_now() >= send_at) {
      static_cast<void>((*port)->send(contactor_command_frame(outputs, counter++)));
      send_at = monotonic_now() + command_period;
    }
    pollfd wait{.fd = (*port)->fd(), .events = POLLIN, .revents = 0};
    ::poll(&wait, 1, static_cast<int>(to_ms(command_period)));
    ReceivedFrame received;
    while ((*port)->read(received) == ReadStatus::frame) {
      if (read_raw<internal_bus::pdu_status, "estop_1_released">(received.frame) != 0) continue;
      outputs = {};
      send_at = {};
    }
  }
}

}  // namespace bmu::latency
