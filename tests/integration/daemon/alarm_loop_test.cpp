// The programs on an embedded bus: a daemon that is stopped while another sender repeats its last command cannot keep
// an overcharged pack closed, because the modules' alarm outputs are in the enable loop of the power distribution unit.
#include <csignal>
#include <optional>

#include "daemon/shell/can/bus_port.hpp"
#include "protocol/message.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/daemon_bench.hpp"

namespace bmu {
namespace {

using internal_bus::contactor_command;
using internal_bus::pdu_status;
using test::Bench;
using test::milliseconds;
using test::steady_clock;

/// Repeats the last CONTACTOR_COMMAND of the daemon with a continued counter and a right checksum, and receives the
/// reports of the PDU.
class LiveSender {
 public:
  explicit LiveSender(const std::string& bus) {
    auto port = open_bus(bus, {.receive_ids = {contactor_command.base_id, pdu_status.base_id}});
    REQUIRE(port);
    port_ = std::move(*port);
  }
  /// Receives, and sends after begin_sending(), until a condition is met; false if it was not met within that time.
  template <class IsSo>
  [[nodiscard]] bool run_until(IsSo is_so, milliseconds at_most) {
    const auto give_up_at = steady_clock::now() + at_most;
    while (steady_clock::now() < give_up_at) {
      receive();
      if (is_so()) return true;
      if (is_sending_) send();
      pollfd wait{.fd = port_->fd(), .events = POLLIN, .revents = 0};
      static_cast<void>(::poll(&wait, 1, period_ms));
    }
    return false;
  }
  void begin_sending() { is_sending_ = true; }
  [[nodiscard]] bool has_command() const { return command_.has_value(); }
  [[nodiscard]] bool is_command_to_close() const { return test::is_closed(outputs_of(*command_)); }
  [[nodiscard]] bool is_pack_closed() const {
    return status_ && read_raw<pdu_status, "main_positive_closed">(*status_) != 0 &&
           read_raw<pdu_status, "main_negative_closed">(*status_) != 0;
  }
  [[nodiscard]] bool is_pack_open() const {
    return status_ && read_raw<pdu_status, "main_positive_closed">(*status_) == 0 &&
           read_raw<pdu_status, "main_negative_closed">(*status_) == 0;
  }
  [[nodiscard]] bool is_alarm_loop_open() const {
    return status_ && read_raw<pdu_status, "alarm_loop_open">(*status_) != 0;
  }
  [[nodiscard]] bool has_opened_by_itself() const {
    return status_ && read_raw<pdu_status, "opened_by_timeout">(*status_) != 0;
  }

 private:
  static constexpr int period_ms = 20;

  void receive() {
    ReceivedFrame received;
    while (port_->read(received) == ReadStatus::frame) {
      if (received.frame.id == pdu_status.base_id) status_ = received.frame;
      const bool is_command = received.frame.id == contactor_command.base_id;
      if (is_command && !is_sending_) command_ = received.frame;
    }
  }
  void send() {
    const auto now = steady_clock::now();
    if (now < next_at_) return;
    next_at_ = now + milliseconds(period_ms);
    seal(contactor_command, static_cast<std::uint8_t>(command_->data[6] + 1), *command_);
    REQUIRE(port_->send(*command_));
  }

  std::unique_ptr<BusPort> port_;
  std::optional<CanFrame> command_;
  std::optional<CanFrame> status_;
  bool is_sending_ = false;
  steady_clock::time_point next_at_{};
};

/// Result of one drive.
struct Outcome {
  bool stayed_closed = false;  // by the sender alone, before a cell was overcharged
  bool was_loop_closed = false;
  bool opened = false;
  bool is_reported_as_own = false;
  bool stayed_open = false;

  [[nodiscard]] bool is_right() const {
    return stayed_closed && was_loop_closed && opened && is_reported_as_own && stayed_open;
  }
};

Outcome overcharge_with_stopped_daemon(Bench& bench) {
  Outcome outcome;
  bench.start_emulator("0 pdu alarm_loop on\n");
  bench.start_daemon();
  if (!bench.closes()) return outcome;
  LiveSender sender(bench.bus);
  if (!sender.run_until([&] { return sender.has_command() && sender.is_pack_closed(); }, test::hang_max))
    return outcome;
  bench.daemon->signal(SIGSTOP);
  REQUIRE(sender.is_command_to_close());
  sender.begin_sending();
  // Longer than a command is valid: the sender alone keeps the pack closed.
  outcome.stayed_closed = !sender.run_until([&] { return sender.is_pack_open(); }, milliseconds(3'000));
  outcome.was_loop_closed = !sender.is_alarm_loop_open();
  if (outcome.stayed_closed) {
    bench.send_event("cell 1.2 voltage_mV 4600");
    outcome.opened =
        sender.run_until([&] { return sender.is_alarm_loop_open() && sender.is_pack_open(); }, test::hang_max);
    outcome.is_reported_as_own = sender.has_opened_by_itself();
    outcome.stayed_open = !sender.run_until([&] { return sender.is_pack_closed(); }, milliseconds(1'000));
  }
  bench.daemon->signal(SIGCONT);
  return outcome;
}

}  // namespace

TEST_CASE("a stopped daemon whose last command is repeated cannot keep an overcharged pack closed",
          "[integration][SEC_1][BMS_F.3]") {
  Outcome outcome;
  static_cast<void>(test::driven([&](Bench& bench) {
    outcome = overcharge_with_stopped_daemon(bench);
    return outcome.is_right();
  }));
  CHECK(outcome.stayed_closed);
  CHECK(outcome.was_loop_closed);
  CHECK(outcome.opened);
  CHECK(outcome.is_reported_as_own);
  CHECK(outcome.stayed_open);
}

}  // namespace bmu
