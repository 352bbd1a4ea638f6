// Set-up of a CAN interface, and the log lines about it.
#include "daemon/shell/can/link_keeper.hpp"

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "daemon/shell/can/link_watch.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr LinkSettings wanted{.bit_rate_bit_per_s = 500'000, .restart_ms = 200};
constexpr TimePoint start{100s};

LinkDetails down() {
  return {.is_can = true, .state = ControllerState::stopped};
}
LinkDetails up(std::uint32_t bit_per_s = 500'000, std::uint32_t restart_ms = 200) {
  return {.is_can = true,
          .is_up = true,
          .bit_rate_bit_per_s = bit_per_s,
          .restart_ms = restart_ms,
          .state = ControllerState::error_active};
}
LinkLook seen(const LinkDetails& details, bool has_right = true) {
  return {.details = details, .has_right = has_right};
}

std::string lines(LinkKeeper& keeper) {
  std::string all;
  for (const LinkLine& line : keeper.take_lines()) all += (all.empty() ? "" : "\n") + line.text;
  return all;
}

}  // namespace

TEST_CASE("an interface that is down is set up once, and that is told once", "[unit][links]") {
  LinkKeeper keeper("can0", wanted);
  REQUIRE(keeper.look(seen(down()), start));
  keeper.tried({}, start);
  CHECK(keeper.set_up() == SetUp::done);
  CHECK(lines(keeper) == "can0: configured: 500 kbit/s, restart 200 ms after bus-off");
  for (int i = 1; i < 10; ++i) CHECK_FALSE(keeper.look(seen(up()), start + i * 1s));
  CHECK(lines(keeper).empty());
  CHECK(keeper.details() == up());
  // Another process sets it down: the daemon sets it up.
  CHECK(keeper.look(seen(down()), start + 20s));
}

TEST_CASE("an interface that is up is never touched, whatever it is set to", "[unit][links]") {
  LinkKeeper keeper("can0", wanted);
  CHECK_FALSE(keeper.look(seen(up()), start));
  CHECK(keeper.set_up() == SetUp::as_wanted);
  CHECK(lines(keeper) == "can0: already up with 500 kbit/s, restart 200 ms after bus-off as configured");
  CHECK_FALSE(keeper.look(seen(up(250'000, 0)), start + 1s));
  CHECK(keeper.set_up() == SetUp::left_alone);
  CHECK(lines(keeper) ==
        "can0: up with 250 kbit/s, no restart after bus-off, expected 500 kbit/s, restart 200 ms after bus-off; left "
        "unchanged, will be configured when it is down");
  CHECK_FALSE(keeper.look(seen(up(250'000, 0)), start + 2s));
  CHECK(lines(keeper).empty());
  // A controller divides its clock: half a percent is tolerated.
  CHECK_FALSE(keeper.look(seen(up(502'500)), start + 3s));
  CHECK(keeper.set_up() == SetUp::as_wanted);
  CHECK_FALSE(keeper.look(seen(up(502'501)), start + 4s));
  CHECK(keeper.set_up() == SetUp::left_alone);
}

TEST_CASE("without the right nothing is tried, and who has to do it is told", "[unit][links]") {
  LinkKeeper keeper("can0", wanted);
  for (int i = 0; i < 5; ++i) CHECK_FALSE(keeper.look(seen(down(), false), start + i * 1s));
  CHECK(keeper.set_up() == SetUp::no_right);
  const std::string told = lines(keeper);
  CHECK(told.find("CAP_NET_ADMIN") != std::string::npos);
  CHECK(told.find("80-can0.network") != std::string::npos);
  CHECK(told.find('\n') == std::string::npos);
  // The network manager has set it up.
  CHECK_FALSE(keeper.look(seen(up(), false), start + 6s));
  CHECK(keeper.set_up() == SetUp::as_wanted);
}

TEST_CASE("what cannot be set up is tried again, not every second", "[unit][links]") {
  LinkKeeper keeper("can0", wanted);
  REQUIRE(keeper.look(seen(down()), start));
  keeper.tried({.result = -EOPNOTSUPP}, start);
  CHECK(keeper.set_up() == SetUp::failed);
  CHECK(lines(keeper) == "can0: configuration failed: Operation not supported; retry every 10 s");
  CHECK_FALSE(keeper.look(seen(down()), start + LinkKeeper::retry - 1us));
  REQUIRE(keeper.look(seen(down()), start + LinkKeeper::retry));
  keeper.tried({.result = -EOPNOTSUPP}, start + LinkKeeper::retry);
  CHECK(lines(keeper).empty());
}

TEST_CASE("a driver without restart has its bus all the same", "[unit][links]") {
  LinkKeeper keeper("can0", wanted);
  REQUIRE(keeper.look(seen(down()), start));
  keeper.tried({.has_restart = false}, start);
  CHECK(keeper.set_up() == SetUp::done);
  CHECK(lines(keeper) ==
        "can0: configured: 500 kbit/s, no restart after bus-off (automatic restart not supported by the driver)");
  CHECK_FALSE(keeper.look(seen(up(500'000, 0)), start + 1s));
  CHECK(lines(keeper).empty());
}

TEST_CASE("an interface that comes back is set up anew and told of anew", "[unit][links]") {
  LinkKeeper keeper("can0", wanted);
  CHECK_FALSE(keeper.look({.result = -ENODEV}, start));
  CHECK(keeper.set_up() == SetUp::waits);
  for (int i = 1; i < 3; ++i) {
    REQUIRE(keeper.look(seen(down()), start + i * 10s));
    keeper.tried({}, start + i * 10s);
    CHECK(lines(keeper).starts_with("can0 set up"));
    CHECK_FALSE(keeper.look({.result = -ENODEV}, start + i * 10s + 5s));
    CHECK(keeper.details() == LinkDetails{});
  }
}

TEST_CASE("vcan, and what nobody asked for, is only looked at", "[unit][links]") {
  LinkKeeper without("can0", std::nullopt);
  CHECK_FALSE(without.look(seen(down()), start));
  CHECK(without.set_up() == SetUp::not_asked);
  CHECK(without.details() == down());
  LinkKeeper keeper("vcan0", wanted);
  CHECK_FALSE(keeper.look(seen({.is_up = false}), start));
  CHECK_FALSE(keeper.look({.result = -EBADMSG}, start));
  CHECK(lines(keeper).empty());
}

namespace {

/// Simulated interfaces.
class FakeLinks final : public LinkSystem {
 public:
  LinkLook look(const std::string& name) override {
    const std::lock_guard lock(mutex_);
    ++looks_;
    changed_.notify_all();
    const auto found = links_.find(name);
    return found == links_.end() ? LinkLook{.result = -ENODEV} : seen(found->second);
  }
  LinkTried set_up(const std::string& name, const LinkSettings& settings) override {
    const std::lock_guard lock(mutex_);
    links_[name] = up(settings.bit_rate_bit_per_s, settings.restart_ms);
    return {};
  }
  void put(const std::string& name, const LinkDetails& details) {
    const std::lock_guard lock(mutex_);
    links_[name] = details;
  }
  /// Waits for this number of further probes.
  [[nodiscard]] bool is_looked_at(int times) {
    std::unique_lock lock(mutex_);
    const int until = looks_ + times;
    return changed_.wait_for(lock, 60s, [&] { return looks_ >= until; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, LinkDetails> links_;
  int looks_ = 0;
};

}  // namespace

TEST_CASE("interfaces are looked after by a thread, and what it saw can be asked for", "[unit][links]") {
  FakeLinks links;
  links.put("can0", down());
  links.put("can1", up(250'000));
  std::mutex mutex;
  std::vector<std::string> told;
  {
    auto watch = LinkWatch::start(
        {{.interface_name = "can0", .set_up = wanted}, {.interface_name = "can1"}},
        [&](Severity, std::string_view line) {
          const std::lock_guard lock(mutex);
          told.emplace_back(line);
        },
        links);
    REQUIRE(watch);
    // can0 twice, because it is set up, and can1; then the next round, which begins when the first one has ended.
    REQUIRE(links.is_looked_at(4));
    auto first = (*watch)->report("can0");
    // A query never waits: while the thread writes its report, the previous one is returned.
    const auto give_up_at = std::chrono::steady_clock::now() + 60s;
    while (first && first->set_up != SetUp::done && std::chrono::steady_clock::now() < give_up_at) {
      std::this_thread::yield();
      first = (*watch)->report("can0");
    }
    REQUIRE(first);
    CHECK(first->details == up());
    CHECK(first->set_up == SetUp::done);
    const auto second = (*watch)->report("can1");
    REQUIRE(second);
    CHECK(second->details.bit_rate_bit_per_s == 250'000);
    CHECK(second->set_up == SetUp::not_asked);
    CHECK_FALSE((*watch)->report("unix:demo"));
  }
  REQUIRE(told.size() == 1);
  CHECK(told.front().starts_with("can0 set up"));
}

TEST_CASE("no interfaces, no thread", "[unit][links]") {
  const auto watch = LinkWatch::start({}, {});
  REQUIRE(watch);
  CHECK_FALSE((*watch)->report("can0"));
}
