// Two daemons with their own sockets and files on one bus: which of them commands the pack.
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"
#include "tests/support/notify_socket.hpp"

namespace bmu {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using test::Bench;
using test::is_closed;

namespace {

/// The same command, with another socket.
std::vector<std::string> command_of_another(const Bench& bench, const std::string& socket) {
  std::vector<std::string> words = bench.daemon_command();
  std::replace(words.begin(), words.end(), bench.socket, socket);
  return words;
}

/// Receives every frame of the bus that only a master sends.
class MasterReceiver {
 public:
  explicit MasterReceiver(const std::string& bus) {
    std::vector<std::uint32_t> ids{internal_bus::contactor_command.base_id, internal_bus::poll.base_id};
    for (std::uint32_t node = 0; node <= internal_bus::node_count_max; ++node) {
      ids.push_back(internal_bus::command.base_id + node);
    }
    auto port = open_bus(bus, {.receive_ids = std::move(ids)});
    REQUIRE(port);
    port_ = std::move(*port);
  }
  /// Reads the pending frames.
  void read() {
    ReceivedFrame received;
    while (port_->read(received) == ReadStatus::frame) {
      ++frames_;
      if (received.frame.id != internal_bus::contactor_command.base_id) continue;
      const std::uint8_t counter = received.frame.data[6];
      if (commands_ > 0 && counter != static_cast<std::uint8_t>(counter_ + 1)) is_in_order_ = false;
      counter_ = counter;
      ++commands_;
      was_opened_ = was_opened_ || !is_closed(outputs_of(received.frame));
    }
  }
  [[nodiscard]] int frames() const { return frames_; }
  [[nodiscard]] int commands() const { return commands_; }
  /// True if each contactor command has the counter after that of the one before: one sender.
  [[nodiscard]] bool is_in_order() const { return is_in_order_ && port_->frames_lost() == 0; }
  [[nodiscard]] bool was_opened() const { return was_opened_; }

 private:
  std::unique_ptr<BusPort> port_;
  int frames_ = 0;
  int commands_ = 0;
  std::uint8_t counter_ = 0;
  bool is_in_order_ = true;
  bool was_opened_ = false;
};

}  // namespace

TEST_CASE("a daemon that starts beside one whose pack is closed sends nothing and ends, and the pack stays closed",
          "[integration][daemon][F39][bus]") {
  const auto bench = test::driven([](Bench& one) {
    one.start_emulator("");
    one.start_daemon();
    if (!one.closes()) return false;
    MasterReceiver receiver(one.bus);
    const std::string log = one.folder / "second.log";
    Process second(command_of_another(one, one.folder / "second.sock"), {.err_file = log});
    const int status = second.wait(test::hang_max);
    receiver.read();
    const nlohmann::json answer = one.ask_json("status");
    receiver.read();
    INFO(read_file(log));
    CHECK(status == 71);
    CHECK(read_file(log).find("second master: ") != std::string::npos);
    CHECK(read_file(log).find("this daemon sends nothing and exits") != std::string::npos);
    // The first daemon received no frame that only a master sends.
    REQUIRE(answer.is_object());
    CHECK(answer.at("receive").at("rejected_by_reason").value("foreign master", 0) == 0);
    CHECK(receiver.commands() > 0);
    const bool is_well = receiver.is_in_order() && !receiver.was_opened() && answer.at("state").at("phase") == "closed";
    return is_well && one.listener.hears_commands(3) && is_closed(one.listener.last());
  });
  REQUIRE(bench->daemon);
  CHECK(bench->daemon->wait(milliseconds(0)) == -1);
  CHECK(is_closed(bench->listener.last()));
}

TEST_CASE("of two daemons that start together on a silent bus exactly one goes on, each of twenty times",
          "[integration][daemon][F39][bus]") {
  for (int time = 1; time <= 20; ++time) {
    INFO("time " << time);
    const Bench bench;
    const std::array<std::string, 2> sockets{bench.folder / "one.sock", bench.folder / "other.sock"};
    const std::array<std::string, 2> logs{bench.folder / "one.log", bench.folder / "other.log"};
    std::array<std::unique_ptr<Process>, 2> daemons;
    for (std::size_t which = 0; which < daemons.size(); ++which) {
      daemons.at(which) = std::make_unique<Process>(command_of_another(bench, sockets.at(which)),
                                                    ProcessOptions{.err_file = logs.at(which)});
    }
    // Waits for the first one to end.
    std::array<int, 2> status{-1, -1};
    const auto give_up_at = steady_clock::now() + test::hang_max;
    while (status[0] == -1 && status[1] == -1 && steady_clock::now() < give_up_at) {
      for (std::size_t which = 0; which < daemons.size(); ++which) {
        status.at(which) = daemons.at(which)->wait(milliseconds(10));
      }
    }
    const std::size_t loser = status[0] == -1 ? 1 : 0;
    INFO("one: " << read_file(logs[0]));
    INFO("other: " << read_file(logs[1]));
    REQUIRE(status.at(loser) == 71);
    CHECK(read_file(logs.at(loser)).find("second master: ") != std::string::npos);
    // The other continues, with its claim held and no fault of the bus.
    Process& winner = *daemons.at(1 - loser);
    nlohmann::json answer;
    const auto is_held = [&] {
      const Finished asked = run_program({program("bmuctl"), "--socket", sockets.at(1 - loser), "--json", "status"});
      answer = nlohmann::json::parse(asked.out, nullptr, false);
      return answer.is_object() && answer.at("state").at("claim") == "held";
    };
    bool is_winner_held = is_held();  // a starved one may have to listen again
    while (!is_winner_held && steady_clock::now() < give_up_at) is_winner_held = is_held();
    REQUIRE(is_winner_held);
    CHECK(answer.at("faults_present").dump().find("foreign_master") == std::string::npos);
    CHECK(winner.wait(milliseconds(0)) == -1);
    winner.signal(SIGTERM);
    CHECK(winner.wait(test::hang_max) == 0);
  }
}

TEST_CASE("a daemon is ready after it has listened, and its status shows the listening before that",
          "[integration][daemon][bus]") {
  Bench bench;
  test::NotifySocket notify(bench.folder / "notify");
  bench.start_daemon({.environment = {"NOTIFY_SOCKET=" + (bench.folder / "notify")}});
  std::string before_ready;
  const auto give_up_at = steady_clock::now() + test::hang_max;
  while (steady_clock::now() < give_up_at) {
    const auto message = notify.next(milliseconds(500));
    if (message == "READY=1") break;
    before_ready += message.value_or("") + "\n";
  }
  CHECK(before_ready.find("STATUS=open, listening for another master") != std::string::npos);
  REQUIRE(bench.listener.next(test::hang_max));  // a command, if it sends any, comes in the same tick
}

}  // namespace bmu
