// Module answers for a core that polls at other times than the recorded one.
#include "daemon/recording/module_answers.hpp"

#include <optional>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr std::uint8_t node = 3;

CanFrame poll(std::uint8_t counter, std::uint8_t target = 0, bool wants_temperatures = false) {
  CanFrame frame = make_frame(internal_bus::poll);
  write<internal_bus::poll, "target_node">(frame, target);
  write<internal_bus::poll, "want_status">(frame, 1);
  write<internal_bus::poll, "want_cells">(frame, 1);
  write<internal_bus::poll, "want_temp">(frame, wants_temperatures ? 1 : 0);
  seal(internal_bus::poll, counter, frame);
  return frame;
}

CanFrame answer(const MessageSpec& message, std::uint8_t counter, std::uint8_t value = 0x11, std::uint8_t of = node) {
  CanFrame frame = make_frame(message, of);
  frame.data[0] = value;
  seal(message, counter, frame);
  return frame;
}

CanFrame order(internal_bus::Operation operation, std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::command, node);
  write<internal_bus::command, "operation">(frame, static_cast<std::int64_t>(operation));
  seal(internal_bus::command, counter, frame);
  return frame;
}

CanFrame response(internal_bus::Operation operation, std::uint8_t counter,
                  internal_bus::CommandResult result = internal_bus::CommandResult::done) {
  CanFrame frame = make_frame(internal_bus::response, node);
  write<internal_bus::response, "operation">(frame, static_cast<std::int64_t>(operation));
  write<internal_bus::response, "result">(frame, static_cast<std::int64_t>(result));
  seal(internal_bus::response, counter, frame);
  return frame;
}

using internal_bus::cells_1;
using internal_bus::status;
using internal_bus::temp_1;

/// Both cores have sent the same poll, and the module has answered.
struct Bench {
  ModuleAnswers answers;

  Bench() {
    answers.begin({.period = 100ms, .temperature_every = 10});
    answers.note_now(poll(7), TimePoint{1s});
    answers.note_then(poll(7), TimePoint{1s});
    CHECK(answers.hear(answer(status, 7), TimePoint{1'001ms}) == answer(status, 7));
    CHECK(answers.hear(answer(cells_1, 7), TimePoint{1'002ms}) == answer(cells_1, 7));
  }
};

}  // namespace

TEST_CASE("what both ask at once stays as it is", "[unit][recording]") {
  Bench bench;
  CHECK(bench.answers.next_due(TimePoint{1'099ms}) == std::nullopt);
  bench.answers.note_now(poll(8), TimePoint{1'100ms});
  bench.answers.note_then(poll(8), TimePoint{1'100ms});
  CHECK(bench.answers.hear(answer(status, 8, 0x22), TimePoint{1'101ms}) == answer(status, 8, 0x22));
  // Frames that are damaged, of another kind, or in no catalogue are not changed.
  CanFrame damaged = answer(cells_1, 8);
  damaged.data[0] ^= 1;
  CHECK(bench.answers.hear(damaged, TimePoint{1'102ms}) == damaged);
  const CanFrame other = data_frame(0x7F0, 8);
  CHECK(bench.answers.hear(other, TimePoint{1'102ms}) == other);
}

TEST_CASE("an answer comes under the counter of the latest question that waits for it", "[unit][recording]") {
  Bench bench;
  bench.answers.note_now(poll(8, node), TimePoint{1'020ms});  // a value is implausible
  bench.answers.note_now(poll(9, node), TimePoint{1'040ms});
  // No new measurement exists: the second core has to wait.
  CHECK(bench.answers.next_due(TimePoint{1'090ms}) == std::nullopt);
  bench.answers.note_now(poll(10), TimePoint{1'100ms});
  bench.answers.note_then(poll(8), TimePoint{1'100ms});
  CHECK(bench.answers.hear(answer(status, 8, 0x22), TimePoint{1'101ms}) == answer(status, 10, 0x22));
  CHECK(bench.answers.hear(answer(cells_1, 8, 0x23), TimePoint{1'102ms}) == answer(cells_1, 10, 0x23));
}

TEST_CASE("an answer to a question that only the recording's core asked is not heard", "[unit][recording]") {
  Bench bench;
  bench.answers.note_then(poll(8, node), TimePoint{1'020ms});
  CHECK(bench.answers.hear(answer(status, 8, 0x22), TimePoint{1'021ms}) == std::nullopt);
  CHECK(bench.answers.hear(answer(cells_1, 8, 0x23), TimePoint{1'022ms}) == std::nullopt);
  // It is the last answer of the module nevertheless.
  bench.answers.note_now(poll(8), TimePoint{1'300ms});
  const auto last = bench.answers.next_due(TimePoint{1'305ms});
  REQUIRE(last);
  CHECK(last->data[0] == 0x22);
  CHECK(last->data[6] == 8);
  CHECK(read<status, "cell_voltage_age_ms">(*last).value == 100);  // not older than without waiting
}

TEST_CASE("where the recording's core asked more slowly a module says again what it said", "[unit][recording]") {
  Bench bench;
  bench.answers.note_now(poll(8), TimePoint{1'050ms});
  CHECK(bench.answers.next_due(TimePoint{1'054ms}) == std::nullopt);
  const auto again = bench.answers.next_due(TimePoint{1'059ms});
  REQUIRE(again);
  CHECK(again->id == status.base_id + node);
  CHECK(again->data[0] == 0x11);
  CHECK(again->data[6] == 8);
  // The age of its voltages counts from their measurement.
  CHECK(read<status, "cell_voltage_age_ms">(*again).value == 58);
  CHECK(bench.answers.next_due(TimePoint{1'059ms}) == answer(cells_1, 8));
  CHECK(bench.answers.next_due(TimePoint{1'059ms}) == std::nullopt);
  CHECK(bench.answers.next_due(TimePoint{1'300ms}) == std::nullopt);  // only once
}

TEST_CASE("temperatures of the recording are heard under a question that does not want them", "[unit][recording]") {
  Bench bench;
  bench.answers.note_then(poll(8, 0, true), TimePoint{1'100ms});
  bench.answers.note_now(poll(8), TimePoint{1'100ms});
  CHECK(bench.answers.hear(answer(temp_1, 8), TimePoint{1'101ms}) == answer(temp_1, 8));
}

TEST_CASE("switches are as the other core told them, once it has told otherwise", "[unit][recording]") {
  using internal_bus::Operation;
  const auto module_with = [](std::uint8_t counter, unsigned cells) {
    CanFrame frame = make_frame(internal_bus::module, node);
    write<internal_bus::module, "balancing_cells">(frame, cells);
    seal(internal_bus::module, counter, frame);
    return frame;
  };
  const auto bleed = [](std::uint8_t counter, unsigned cell) {
    CanFrame frame = make_frame(internal_bus::command, node);
    write<internal_bus::command, "operation">(frame, static_cast<std::int64_t>(Operation::balance));
    constexpr std::size_t first = signal_index(internal_bus::command, "balancing_time_1_s");
    encode_signal(internal_bus::command.signals[first + cell], known(120), frame.data);
    seal(internal_bus::command, counter, frame);
    return frame;
  };
  Bench bench;
  const auto heard_at = [&](TimePoint at, std::uint8_t counter, unsigned cells) {
    bench.answers.note_now(poll(counter), at);
    bench.answers.note_then(poll(counter), at);
    const auto frame = bench.answers.hear(module_with(counter, cells), at + 1ms);
    REQUIRE(frame);
    return read_raw<internal_bus::module, "balancing_cells">(*frame);
  };
  // With the same command from both cores the switches are as recorded, whatever that is.
  bench.answers.note_now(bleed(1, 0), TimePoint{2s});
  bench.answers.note_then(bleed(1, 0), TimePoint{2s});
  CHECK(heard_at(TimePoint{3s}, 10, 0x801) == 0x801);
  // Cell 3 by the recorded core alone, cell 5 by the second one.
  bench.answers.note_then(bleed(2, 2), TimePoint{4s});
  bench.answers.note_now(bleed(2, 4), TimePoint{4s});
  CHECK(heard_at(TimePoint{5s}, 11, 0x804) == 0x010);  // each command sets all twelve, some of them to 0 minutes
  CHECK(heard_at(TimePoint{125s}, 12, 0x804) == 0);    // its two minutes have elapsed
  bench.answers.note_now(bleed(3, 4), TimePoint{130s});
  CHECK(heard_at(TimePoint{131s}, 13, 0) == 0x010);
  CanFrame stop = make_frame(internal_bus::command, 0);
  write<internal_bus::command, "operation">(stop, static_cast<std::int64_t>(Operation::stop_balancing));
  seal(internal_bus::command, 9, stop);
  bench.answers.note_now(stop, TimePoint{132s});
  CHECK(heard_at(TimePoint{133s}, 14, 0x004) == 0);
}

TEST_CASE("a module that owes an answer to the recording's core says nothing to the other", "[unit][recording]") {
  Bench bench;
  bench.answers.note_now(poll(8), TimePoint{1'100ms});
  bench.answers.note_then(poll(8), TimePoint{1'100ms});
  for (int later = 0; later < 20; ++later) {
    bench.answers.note_now(poll(static_cast<std::uint8_t>(9 + later)), TimePoint{1'200ms} + later * 100ms);
    CHECK(bench.answers.next_due(TimePoint{1'290ms} + later * 100ms) == std::nullopt);
  }
}

TEST_CASE("a module that is silent says nothing at all, asked for whatever", "[unit][recording]") {
  Bench bench;
  bench.answers.note_now(poll(8, 0, true), TimePoint{1'100ms});
  bench.answers.note_then(poll(8, 0, true), TimePoint{1'100ms});
  static_cast<void>(bench.answers.hear(answer(status, 8), TimePoint{1'101ms}));
  static_cast<void>(bench.answers.hear(answer(cells_1, 8), TimePoint{1'101ms}));
  static_cast<void>(bench.answers.hear(answer(temp_1, 8), TimePoint{1'101ms}));
  bench.answers.note_then(poll(9), TimePoint{1'200ms});  // no answer
  bench.answers.note_now(poll(9, 0, true), TimePoint{4s});
  CHECK(bench.answers.next_due(TimePoint{5s}) == std::nullopt);
  bench.answers.note_now(order(internal_bus::Operation::balance, 3), TimePoint{5s});
  CHECK(bench.answers.next_due(TimePoint{6s}) == std::nullopt);
}

TEST_CASE("temperatures are said again after their own time", "[unit][recording]") {
  Bench bench;
  bench.answers.note_now(poll(8, 0, true), TimePoint{1'100ms});
  bench.answers.note_then(poll(8, 0, true), TimePoint{1'100ms});
  CHECK(bench.answers.hear(answer(temp_1, 8), TimePoint{1'101ms}) == answer(temp_1, 8));
  bench.answers.note_now(poll(9, node, true), TimePoint{1'700ms});
  bench.answers.note_then(poll(9), TimePoint{1'700ms});
  static_cast<void>(bench.answers.hear(answer(status, 9), TimePoint{1'701ms}));
  static_cast<void>(bench.answers.hear(answer(cells_1, 9), TimePoint{1'702ms}));
  CHECK(bench.answers.next_due(TimePoint{2'600ms}) == std::nullopt);
  CHECK(bench.answers.next_due(TimePoint{2'605ms}) == answer(temp_1, 9));
}

TEST_CASE("what was late, said twice or not asked for stays so", "[unit][recording]") {
  Bench bench;
  bench.answers.note_now(poll(20), TimePoint{1'100ms});
  bench.answers.note_then(poll(8), TimePoint{1'100ms});
  CHECK(bench.answers.hear(answer(status, 6), TimePoint{1'101ms}) == answer(status, 18));
  CHECK(bench.answers.hear(answer(status, 8), TimePoint{1'102ms}) == answer(status, 20));
  CHECK(bench.answers.hear(answer(status, 8, 0x55), TimePoint{1'103ms}) == answer(status, 20, 0x55));  // two senders
  CHECK(bench.answers.hear(answer(temp_1, 8), TimePoint{1'104ms}) == answer(temp_1, 20));              // not requested
  // An unsolicited identity has the counter 0 for both cores.
  CHECK(bench.answers.hear(answer(internal_bus::ident, 0), TimePoint{1'105ms}) == answer(internal_bus::ident, 0));
}

TEST_CASE("a question to one module leaves the others to the question before", "[unit][recording]") {
  Bench bench;
  bench.answers.note_now(poll(8, 5), TimePoint{1'050ms});
  bench.answers.note_then(poll(8), TimePoint{1'100ms});
  bench.answers.note_now(poll(9), TimePoint{1'100ms});
  CHECK(bench.answers.hear(answer(status, 8, 0x22, 5), TimePoint{1'101ms}) == answer(status, 9, 0x22, 5));
  CHECK(bench.answers.hear(answer(status, 8), TimePoint{1'101ms}) == answer(status, 9));
}

TEST_CASE("an order that both give has the answer of then, another one is done", "[unit][recording]") {
  using internal_bus::CommandResult;
  using internal_bus::Operation;
  Bench bench;
  bench.answers.note_now(order(Operation::balance, 3), TimePoint{1'010ms});
  bench.answers.note_then(order(Operation::balance, 1), TimePoint{1'010ms});
  CHECK(bench.answers.next_due(TimePoint{1'050ms}) == std::nullopt);
  CHECK(bench.answers.hear(response(Operation::balance, 1, CommandResult::hardware_fault), TimePoint{1'051ms}) ==
        response(Operation::balance, 3, CommandResult::hardware_fault));
  bench.answers.note_now(order(Operation::stop_balancing, 4), TimePoint{1'060ms});
  CHECK(bench.answers.next_due(TimePoint{1'079ms}) == std::nullopt);
  CHECK(bench.answers.next_due(TimePoint{1'084ms}) == response(Operation::stop_balancing, 4));
  CHECK(bench.answers.next_due(TimePoint{1'100ms}) == std::nullopt);
  // Command of the recorded core alone.
  bench.answers.note_then(order(Operation::balance, 2), TimePoint{1'110ms});
  CHECK(bench.answers.hear(response(Operation::balance, 2), TimePoint{1'112ms}) == std::nullopt);
}

TEST_CASE("an order to a module that nobody heard is not answered", "[unit][recording]") {
  ModuleAnswers answers;
  answers.begin({.period = 100ms});
  answers.note_now(order(internal_bus::Operation::balance, 3), TimePoint{1s});
  CHECK(answers.next_due(TimePoint{2s}) == std::nullopt);
}
