// The emulated pack's two buses are swapped against the daemon's: the frames that the real filters pass must suffice to
// identify this.
#include <algorithm>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/daemon_bench.hpp"

namespace bmu {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using test::Bench;

namespace {

constexpr const char* cause = "buses/internal and buses/vehicle are swapped";

/// The emulator's internal bus is the daemon's vehicle bus, and the reverse.
struct SwappedBench : Bench {
  SwappedBench() { more_emulator_options = {"--vehicle-bus", other_bus}; }
  SwappedBench(const SwappedBench&) = delete;
  SwappedBench& operator=(const SwappedBench&) = delete;
  ~SwappedBench() { std::filesystem::remove("/dev/shm/bmud-bus." + other_bus.substr(5)); }

  void start_swapped_daemon() {
    std::vector<std::string> words = daemon_command();
    std::replace(words.begin(), words.end(), bus, other_bus);
    words.insert(words.end(), {"--bus-vehicle", bus});
    daemon = std::make_unique<Process>(words, ProcessOptions{.err_file = log});
    prefer(*daemon);
  }

  /// No command arrives on the emulator's bus that could pace this loop.
  template <class IsSo>
  [[nodiscard]] static bool is_so_in_time(IsSo is_so) {
    const auto give_up_at = steady_clock::now() + test::hang_max;
    while (!is_so()) {
      if (steady_clock::now() >= give_up_at) return false;
      std::this_thread::sleep_for(milliseconds(50));
    }
    return true;
  }

  std::string other_bus = bus + "-vehicle";
};

}  // namespace

TEST_CASE("a daemon whose internal and vehicle bus are swapped names that, and commands nothing on either",
          "[integration][daemon][F38][bus]") {
  SwappedBench bench;
  bench.start_emulator("0 vehicle on\n");
  bench.start_swapped_daemon();
  CHECK(bench.is_so_in_time([&] { return bench.ask({"why"}).out.find(cause) != std::string::npos; }));
  CHECK(bench.is_so_in_time([&] { return read_file(bench.log).find(cause) != std::string::npos; }));
  const nlohmann::json status = bench.ask_json("status");
  REQUIRE(status.is_object());
  CHECK(status.at("permission").at("may_close") == false);
  CHECK(status.at("receive").at("accepted") == 0);
  CHECK(bench.listener.count_within(milliseconds(0)) == 0);
}

}  // namespace bmu
