// Behaves on the bus like a master with a decision that hangs while its sending goes on: repeats the last
// CONTACTOR_COMMAND of another one, with a counter that goes on and a correct checksum.
//
//   live_sender INTERFACE     e.g. live_sender vcan0; until a signal ends it
//
// It only receives at first, and prints "has a command" once it has received one. From SIGUSR1 on it sends every 20 ms.
// Exit status: 1 if the interface cannot be used, or SIGUSR1 came before any command; 64 wrong usage.
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <poll.h>

#include "daemon/shell/can/bus_port.hpp"
#include "protocol/message.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace {

using bmu::internal_bus::contactor_command;

constexpr int period_ms = 20;

volatile std::sig_atomic_t is_to_send = 0;

extern "C" void begin_to_send(int /*signal*/) {
  is_to_send = 1;
}

/// The last command received, from those waiting in the port; `before` if there is none.
std::optional<bmu::CanFrame> last_command(bmu::BusPort& port, std::optional<bmu::CanFrame> before) {
  bmu::ReceivedFrame received;
  while (port.read(received) == bmu::ReadStatus::frame) {
    if (!before) {
      std::puts("has a command");
      std::fflush(stdout);
    }
    before = received.frame;
  }
  return before;
}

std::optional<bmu::CanFrame> listen(bmu::BusPort& port) {
  std::optional<bmu::CanFrame> command;
  while (is_to_send == 0) {
    pollfd wait{.fd = port.fd(), .events = POLLIN, .revents = 0};
    static_cast<void>(::poll(&wait, 1, period_ms));
    command = last_command(port, command);
  }
  return last_command(port, command);
}

/// Sends until a frame cannot be sent; returns the error.
bmu::SendError repeat(bmu::BusPort& port, bmu::CanFrame command) {
  while (true) {
    bmu::seal(contactor_command, static_cast<std::uint8_t>(command.data[6] + 1), command);
    if (const auto sent = port.send(command); !sent) return sent.error();
    std::this_thread::sleep_for(std::chrono::milliseconds(period_ms));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: live_sender INTERFACE\n");
    return 64;
  }
  std::signal(SIGUSR1, begin_to_send);
  const auto port = bmu::open_bus(argv[1], {.receive_ids = {contactor_command.base_id}});
  if (!port) {
    std::fprintf(stderr, "live_sender: %s\n", to_text(port.error()).c_str());
    return 1;
  }
  const std::optional<bmu::CanFrame> command = listen(**port);
  if (!command) {
    std::fprintf(stderr, "live_sender: found no command on %s, expected one before SIGUSR1\n", argv[1]);
    return 1;
  }
  std::fprintf(stderr, "live_sender: %s\n", std::string(to_text(repeat(**port, *command))).c_str());
  return 1;
}
