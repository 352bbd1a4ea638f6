// Data from the control loop to the recorder: parts that can be replayed, and triggers of a black box.
#include "daemon/shell/recorder/record_feed.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/recording/replay.hpp"
#include "mmu/scenario/scenario.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"
#include "tests/support/recorded_run.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;
using bmu::test::demo_pack;

namespace {

const std::string pack_file = test::in_source("config/packs/demo-48s.json");

Scenario scenario_of(const std::string& text) {
  auto scenario = parse_scenario("0 pack soc_permille 800\n" + text, core_vocabulary());
  REQUIRE(scenario);
  return *scenario;
}

/// Core, the pack around it, and the recorder feed; the test takes the chunks instead of the recorder thread.
class Bench {
 public:
  explicit Bench(const std::string& scenario = "1 vehicle on\n", Duration part_length = 2s)
      : pack_(demo_pack()),
        run_(std::make_unique<VirtualRun>(pack_.core, simulator_config(pack_.core), scenario_of(scenario))),
        feed_({.buses = buses_,
               .part_length = part_length,
               .chunk_max_bytes = 100'000,
               .wall_clock = [this](TimePoint at) { return clock_us(at); }},
              run_->core(), queue_) {
    queue_.give_back(std::make_unique<Core>(run_->core()));
    feed_.begin(run_->now());
    run_->set_tap(&feed_);
  }

  void run_to(Duration elapsed) {
    while (run_->elapsed() < elapsed) run_->step();
  }
  /// Takes all chunks, as the recorder thread does.
  std::vector<RecordTrigger> take_all() {
    std::vector<RecordTrigger> triggers;
    RecordChunk chunk;
    while (queue_.take(chunk, Duration{})) {
      if (chunk.core) {
        append_record_head({.version = "0.1.0",
                            .buses = buses_,
                            .sources = pack_.sources,
                            .hash = pack_.core.hash,
                            .life = 1,
                            .part = chunk.part},
                           *chunk.core, chunk.clock, text_);
        queue_.give_back(std::move(chunk.core));
      }
      text_ += chunk.text;
      for (const RecordTrigger& trigger : chunk.triggers) triggers.push_back(trigger);
    }
    return triggers;
  }
  void take_while_running_to(Duration elapsed) {
    for (Duration at = run_->elapsed(); at <= elapsed; at += 500ms) {
      run_to(at);
      static_cast<void>(take_all());
    }
  }
  void end() {
    CHECK(feed_.end(Duration{}));
    static_cast<void>(take_all());
  }

  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] RecordFeed& feed() { return feed_; }
  [[nodiscard]] VirtualRun& run() { return *run_; }
  [[nodiscard]] std::int64_t clock_us(TimePoint at) const {
    const Duration elapsed = run_->elapsed() - (run_->now() - at);
    return 1'700'000'000'000'000 + std::chrono::duration_cast<std::chrono::microseconds>(elapsed).count() + ahead_us;
  }
  std::int64_t ahead_us = 0;

 private:
  const RecordBuses buses_{.internal = "vcan0", .vehicle = "vcan0"};
  PackConfig pack_;
  std::unique_ptr<VirtualRun> run_;
  RecordQueue queue_;
  RecordFeed feed_;
  std::string text_;
};

struct Replayed {
  ReplayCounts counts;
  std::optional<RecordProblem> problem;
  std::uint64_t ends_that_fit = 0;
  std::uint64_t ends_that_do_not = 0;
};

Replayed replayed(std::string_view text) {
  Replay replay({});
  Replayed result;
  std::uint64_t end = 0;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (line.starts_with("# bmud-recording")) end = replay.checksum();
    if (!replay.take(line)) break;
    if (line.starts_with("# core-end") && replay.reader().continues()) {
      ++(replay.reader().checksum() == end ? result.ends_that_fit : result.ends_that_do_not);
    }
    text.remove_prefix(line.size() + 1);
  }
  replay.end();
  result.counts = replay.counts();
  result.problem = replay.problem();
  return result;
}

}  // namespace

TEST_CASE("what the loop hands over decides again as it did, part by part", "[unit][recording][FS_6]") {
  Bench bench("1 vehicle on\n+3 load current_A 20\n");
  bench.take_while_running_to(9s);
  bench.end();
  const Replayed run = replayed(bench.text());
  if (run.problem) FAIL("line " << run.problem->line << ": " << run.problem->text);
  CHECK(run.counts.ticks > 800);
  CHECK(run.counts.ticks_different == 0);
  CHECK(run.counts.begun == 5);
  // No state of the core is omitted: the state at the end of each part equals that at the start of the next one.
  CHECK(run.ends_that_fit == 4);
  CHECK(run.ends_that_do_not == 0);
  CHECK(bench.feed().pieces_lost() == 0);
}

TEST_CASE("where lines were lost a part begins that does not say it continues", "[unit][recording][F75]") {
  Bench bench;
  bench.take_while_running_to(3s);
  bench.run_to(150s);  // no chunk is taken
  CHECK(bench.feed().pieces_lost() > 1'000);
  const std::uint64_t lost = bench.feed().pieces_lost();
  bench.take_while_running_to(155s);
  bench.end();
  // Only entries until the waiting chunks were taken are lost.
  CHECK(bench.feed().pieces_lost() < lost + 500);
  const Replayed run = replayed(bench.text());
  if (run.problem) FAIL("line " << run.problem->line << ": " << run.problem->text);
  CHECK(run.counts.ticks_different == 0);
  CHECK(run.ends_that_do_not == 0);
  CHECK(run.counts.begun > run.ends_that_fit + 1);
}

TEST_CASE("a fault that opens is one trigger, with its freeze frame", "[unit][recording][black_box]") {
  Bench bench("1 vehicle on\n+4 cell 2.7 voltage_mV 2700\n");
  bench.run_to(4'900ms);
  CHECK(bench.take_all().empty());
  bench.run_to(8s);
  const auto triggers = bench.take_all();
  REQUIRE(!triggers.empty());
  CHECK(triggers[0].event.fault == FaultId::cell_undervoltage);
  REQUIRE(triggers[0].freeze);
  CHECK(triggers[0].freeze->element == triggers[0].event.reading.element);
  CHECK(triggers[0].unix_time_us > 1'700'000'005'000'000);
}

TEST_CASE("every opening is a trigger, without a freeze frame where no fault was", "[unit][recording][black_box]") {
  Bench bench("1 vehicle on\n+4 vehicle off\n+4 vehicle on\n+4 vehicle off\n");
  bench.run_to(16s);
  const auto triggers = bench.take_all();
  REQUIRE(triggers.size() == 2);
  for (const RecordTrigger& trigger : triggers) {
    CHECK(trigger.event.id == EventId::opened);
    CHECK(trigger.event.cause == OpeningCause::request_over);
    CHECK_FALSE(trigger.freeze);
  }
}

TEST_CASE("times follow a wall clock that jumps, and the recording still decides the same", "[unit][recording][F68]") {
  Bench bench;
  bench.run_to(3s);
  bench.ahead_us = 3'600'000'000;
  bench.run().observe(WallClockSeen{.unix_time_ms = bench.clock_us(bench.run().now()) / 1000});
  bench.run_to(4s);
  bench.ahead_us = -3'600'000'000;
  bench.run().observe(WallClockSeen{.unix_time_ms = bench.clock_us(bench.run().now()) / 1000});
  bench.run_to(5s);
  bench.end();
  CHECK(bench.text().find("\n(1700003603.") != std::string::npos);
  CHECK(bench.text().find("\n(1699996404.") != std::string::npos);
  const Replayed run = replayed(bench.text());
  CHECK_FALSE(run.problem);
  CHECK(run.counts.ticks > 400);
  CHECK(run.counts.ticks_different == 0);
}

TEST_CASE("openings and faults are triggers also while lines are lost", "[unit][recording][black_box][F75]") {
  Bench bench("1 vehicle on\n+4 vehicle off\n+119 vehicle on\n+10 cell 2.7 voltage_mV 2700\n");
  bench.take_while_running_to(3s);
  bench.run_to(150s);  // no chunk is taken
  REQUIRE(bench.feed().pieces_lost() > 1'000);
  const std::vector<RecordTrigger> before = bench.take_all();
  REQUIRE(before.size() == 1);  // from before the gap
  CHECK(before[0].event.cause == OpeningCause::request_over);
  bench.run_to(152s);
  const std::vector<RecordTrigger> after = bench.take_all();
  REQUIRE(!after.empty());
  CHECK(after[0].event.fault == FaultId::cell_undervoltage);
  REQUIRE(after[0].freeze);
  CHECK(after[0].unix_time_us < 1'700'000'136'000'000);
  CHECK(bench.feed().triggers_lost() == 0);
  // Events together with it, or shortly after it, do not trigger again.
  for (const RecordTrigger& trigger : after) {
    CHECK((trigger.event.id == EventId::opened || trigger.event.fault != FaultId::cell_undervoltage ||
           &trigger == &after[0]));
  }
}

TEST_CASE("a second trigger in a chunk that waits is kept, too", "[unit][recording][black_box]") {
  Bench bench("1 vehicle on\n");
  bench.run_to(66s);  // the queue is full, and nothing lost yet
  REQUIRE(bench.feed().pieces_lost() == 0);
  const auto tell = [&](const Event& event) {
    Decisions decisions;
    decisions.events.push_back(event);
    bench.feed().decided(event.at, decisions);
  };
  const TimePoint now = bench.run().now();
  tell({.id = EventId::fault_confirmed, .at = now, .fault = FaultId::cell_undervoltage});
  tell({.id = EventId::fault_confirmed, .at = now + 1ms, .fault = FaultId::cell_undervoltage});  // already triggered
  tell({.id = EventId::fault_confirmed, .at = now + 2ms, .fault = FaultId::cell_overvoltage});
  tell({.id = EventId::opened, .at = now + 3ms, .cause = OpeningCause::request_over});
  const std::size_t waiting_before = bench.take_all().size();
  CHECK(waiting_before == 0);
  CHECK(bench.feed().end(Duration{}));
  const std::vector<RecordTrigger> triggers = bench.take_all();
  REQUIRE(triggers.size() == 3);
  CHECK(triggers[0].event.fault == FaultId::cell_undervoltage);
  CHECK(triggers[1].event.fault == FaultId::cell_overvoltage);
  CHECK(triggers[2].event.id == EventId::opened);
}

TEST_CASE("triggers for which there is no room are counted, and their faults not taken for shown",
          "[unit][recording][black_box]") {
  Bench bench("1 vehicle on\n");
  bench.run_to(66s);
  const auto tell = [&](const Event& event) {
    Decisions decisions;
    decisions.events.push_back(event);
    bench.feed().decided(event.at, decisions);
  };
  const TimePoint now = bench.run().now();
  for (std::size_t number = 0; number < record_triggers_max + 2; ++number) tell({.id = EventId::opened, .at = now});
  tell({.id = EventId::fault_confirmed, .at = now, .fault = FaultId::cell_undervoltage});
  CHECK(bench.feed().triggers_lost() == 3);
  static_cast<void>(bench.take_all());
  CHECK(bench.feed().end(Duration{}));
  CHECK(bench.take_all().size() == record_triggers_max);
  tell({.id = EventId::fault_confirmed, .at = now + 1s, .fault = FaultId::cell_undervoltage});
  CHECK(bench.take_all().size() == 1);
}

TEST_CASE("what cannot be handed over at the end is counted", "[unit][recording][black_box]") {
  Bench bench("1 vehicle on\n");
  bench.run_to(66s);
  REQUIRE(bench.feed().pieces_lost() == 0);
  Decisions decisions;
  decisions.events.push_back({.id = EventId::opened, .at = bench.run().now()});
  bench.feed().decided(bench.run().now(), decisions);
  CHECK_FALSE(bench.feed().end(1ms));
  CHECK(bench.feed().pieces_lost() > 100);
  CHECK(bench.feed().triggers_lost() == 1);
}

TEST_CASE("the memory of a text that was written is the next one's, and each text has some", "[unit][recording]") {
  constexpr std::size_t usual_bytes = 10'000;
  RecordQueue queue;
  queue.make_room(usual_bytes);
  RecordChunk of_loop;
  RecordChunk of_thread;
  of_loop.text.reserve(usual_bytes);
  for (std::size_t round = 0; round < 3 * RecordQueue::chunks_max; ++round) {
    CAPTURE(round);
    of_loop.text.assign(usual_bytes, 'x');
    REQUIRE(queue.offer(of_loop));
    CHECK(of_loop.text.empty());
    CHECK(of_loop.text.capacity() >= usual_bytes);
    REQUIRE(queue.take(of_thread, Duration{}));
    CHECK(of_thread.text.size() == usual_bytes);
  }
}
