// Broadcast commands reach every module in every session of the daemon: tested with the emulated module and with the
// one that was written from the protocol page alone.
#include "daemon/core/modules/module_broadcasts.hpp"

#include <functional>

#include "daemon/core/modules/module_setup.hpp"
#include "daemon/core/modules/poll_schedule.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tests/support/naive_module.hpp"

using namespace bmu;
using bmu::test::MmuBench;

namespace {

naive::Frame plain(const CanFrame& frame) {
  naive::Frame plain{.id = frame.id, .length = frame.length};
  std::copy(frame.data.begin(), frame.data.end(), std::begin(plain.b));
  return plain;
}

/// One module of each kind at node 3; the masters command both.
class BothKinds {
 public:
  BothKinds() {
    naive::naive_init(naive, 3, 12, 4, 1'234'567, ms());
    for (unsigned& raw : naive.cell_raw) raw = 37'000;
    for (int& degrees : naive.board_C) degrees = 30;
    run(800ms);
  }

  MmuBench bench;
  naive::Module naive{};
  std::size_t answers = 0;  // STATUS frames of both

  [[nodiscard]] unsigned long ms() const { return static_cast<unsigned long>(to_ms(bench.now.time_since_epoch())); }
  void hear(const CanFrame& frame) {
    bench.mmu.observe(frame, bench.now);
    naive_receive(naive, plain(frame), ms());
  }
  void run(Duration duration) {
    for (const TimePoint end = bench.now + duration; bench.now < end;) {
      for (const test::TimedFrame& sent : bench.run(1ms)) count(sent.frame.id);
      naive_tick(naive, ms());
      for (naive::Frame frame; naive_send(naive, frame);) count(frame.id);
    }
  }
  void bleed(std::uint8_t counter) {
    hear(test::balance_frame(3, counter, {5, 5}));
    for (int tenth = 0; tenth < 15; ++tenth) {
      hear(test::poll_frame(0, 0, ++poll_counter_));
      run(100ms);
    }
  }
  [[nodiscard]] bool are_bleeding() const { return bench.mmu.balancing_cells() == 3 && naive_switches(naive) == 3; }
  [[nodiscard]] bool are_idle() const { return bench.mmu.balancing_cells() == 0 && naive_switches(naive) == 0; }

 private:
  void count(unsigned id) {
    if (id == internal_bus::status.base_id + 3) ++answers;
  }
  std::uint8_t poll_counter_ = 100;
};

/// One session of a master, reduced to broadcasts.
class Life {
 public:
  Life(BothKinds& modules, std::uint8_t first_counter) : modules_(modules) {
    setup_.init(test::small_pack(), first_counter);
    poll_.init({}, modules.bench.now, first_counter);
  }
  ModuleBroadcasts broadcasts;
  int commands = 0;
  bool has_given_up = false;
  std::function<bool(int number)> is_lost = [](int) { return false; };  // the COMMAND with this number, from 1

  void run(Duration duration) {
    for (const TimePoint end = modules_.bench.now + duration; modules_.bench.now < end;) {
      const ModuleBroadcasts::Step step = broadcasts.step(modules_.bench.now);
      if (step.says_stop) say(setup_.stop_balancing());
      if (step.says_clear) say(setup_.clear_faults());
      if (step.says_sleep) say(setup_.sleep());
      if (step.asks) modules_.hear(poll_.single(0, {.cells = false, .temperatures = false, .module = false}));
      has_given_up = has_given_up || step.stays_awake;
      const std::size_t before = modules_.answers;
      modules_.run(10ms);
      if (modules_.answers != before) broadcasts.note_answer();
    }
  }

 private:
  void say(const CanFrame& frame) {
    if (!is_lost(++commands)) modules_.hear(frame);
  }

  BothKinds& modules_;
  ModuleSetup setup_;
  PollSchedule poll_;
};

}  // namespace

TEST_CASE("what is said to all is heard in a second life that counts from anywhere, and when a frame is lost",
          "[unit][modules][MMU_CB]") {
  for (const int ahead : {0, 1, 2, 100}) {
    for (const int lost : {0, 1, 2}) {
      BothKinds modules;
      Life first(modules, 7);
      first.broadcasts.stop();
      first.run(100ms);
      REQUIRE(first.commands == 2);  // the modules have received 7 and 8
      Life second(modules, static_cast<std::uint8_t>(8 + ahead));
      modules.bleed(1);
      REQUIRE(modules.are_bleeding());
      // A frame with a counter that they have already received is ignored; with a lost frame that would be two.
      second.is_lost = [&](int number) { return ahead != 0 && number == lost; };
      second.broadcasts.stop();
      second.run(100ms);
      INFO("begins " << ahead << " behind the last, lost: " << lost);
      CHECK(second.commands == 2);
      CHECK(modules.are_idle());
    }
  }
}

TEST_CASE("modules are told to sleep until none answers, in every life", "[unit][modules][BMS_F.9][MMU_S]") {
  for (const int ahead : {0, 1, 100}) {
    for (const int lost : {0, 1, 2}) {
      BothKinds modules;
      Life first(modules, 7);
      first.broadcasts.clear();
      first.run(100ms);
      Life second(modules, static_cast<std::uint8_t>(8 + ahead));
      second.is_lost = [lost](int number) { return number <= lost; };
      second.broadcasts.sleep();
      second.run(1s);
      modules.run(1500ms);  // in case the last poll has woken one
      INFO("begins " << ahead << " behind the last, lost: " << lost);
      CHECK_FALSE(second.has_given_up);
      CHECK(modules.bench.mmu.is_asleep());
      CHECK(modules.naive.asleep);
      CHECK(second.commands <= 3 + lost);
    }
  }
}

TEST_CASE("who never sleeps is told so, once, and is no longer asked", "[unit][modules][BMS_F.9]") {
  BothKinds modules;
  Life life(modules, 0);
  life.is_lost = [](int) { return true; };
  life.broadcasts.sleep();
  life.run(10s);
  CHECK(life.commands == sleep_rounds);
  CHECK(life.has_given_up);
}

TEST_CASE("awake again nobody is told to sleep any more", "[unit][modules][BMS_F.9]") {
  BothKinds modules;
  Life life(modules, 0);
  life.is_lost = [](int) { return true; };
  life.broadcasts.sleep();
  life.run(250ms);
  const int before = life.commands;
  life.broadcasts.end_sleep();
  life.run(2s);
  CHECK(life.commands == before);
}
