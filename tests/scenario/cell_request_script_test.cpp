// A display in the emulated vehicle that requests data, by a script.
#include <algorithm>
#include <string_view>
#include <vector>

#include "devices/device_list.hpp"
#include "mmu/devices/can_requester.hpp"
#include "mmu/devices/request_words.hpp"
#include "protocol/candump.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/patched_pack.hpp"
#include "tests/support/sim_run.hpp"

using namespace bmu;

namespace {

CoreConfig answering_pack(const char* more = "") {
  return test::patched_pack(std::string(R"({"vehicle": {"request_id": "745")") + more + "}}");
}

bool is_refused(Simulator& simulator, std::string_view event, std::string_view words) {
  const auto applied = simulator.apply(event);
  return !applied && applied.error().wanted.find(words) != std::string::npos;
}

std::uint8_t word_of(std::string_view word) {
  const auto found = std::find(request_words.begin(), request_words.end(), word);
  REQUIRE(found != request_words.end());
  return static_cast<std::uint8_t>(found - request_words.begin());
}

}  // namespace

TEST_CASE("what an emulated display asks is what the maker's table has", "[scenario][requests]") {
  CanRequester display(0x745);
  display.ask(word_of("pack_lowest_voltage"));
  display.number = 5;
  display.ask(word_of("cell_voltage"));
  display.ask(word_of("clear_faults"));
  const std::array<std::array<std::uint8_t, 4>, 3> worked{
      {{0x03, 0x10, 0x43, 0x00}, {0x03, 0x10, 0x14, 0x05}, {0x03, 0x14, 0x62, 0x00}}};
  // The first of these has no number, since none was set.
  for (const std::array<std::uint8_t, 4>& bytes : worked) {
    const std::optional<CanFrame> frame = display.take();
    REQUIRE(frame);
    CHECK(frame->id == 0x745);
    CHECK(frame->length == 8);
    CHECK(std::equal(bytes.begin(), bytes.end(), frame->data.begin()));
  }
  CHECK_FALSE(display.take());
  for (std::size_t count = 0; count < 2 * CanRequester::waiting_max; ++count) display.ask(0);
  std::size_t asked = 0;
  while (display.take()) ++asked;
  CHECK(asked == CanRequester::waiting_max);
}

TEST_CASE("a script asks the master for data, and waits for the answer", "[scenario][requests][VEH_1]") {
  test::SimRun run(answering_pack());
  run.run_to(2.0);
  run.apply("vehicle asks pack_lowest_voltage");
  run.apply("vehicle asks_about 5");
  run.apply("vehicle asks cell_voltage");
  run.run_to(2.2);
  CHECK(run.core().cell_requests().answered == 2);
  run.apply("vehicle asks_about 255");
  run.apply("vehicle asks cell_voltage");  // no such cell
  run.run_to(2.4);
  CHECK(run.core().cell_requests().answered == 2);
  CHECK(run.core().cell_requests().unanswered == 1);
  run.apply("vehicle asks clear_faults");  // not allowed by the pack file
  run.run_to(2.6);
  CHECK(run.core().cell_requests().refused == 1);
}

TEST_CASE("a script that asks of a master who answers nothing is an error", "[scenario][requests]") {
  Simulator silent(simulator_config(test::patched_pack("{}")), {}, test::SimRun::start);
  CHECK(is_refused(silent, "vehicle asks cell_voltage", "vehicle/request_id"));
  CHECK(is_refused(silent, "vehicle asks_about 3", "vehicle/request_id"));
  Simulator answering(simulator_config(answering_pack()), {}, test::SimRun::start);
  CHECK(answering.apply("vehicle asks cell_voltage"));
  CHECK_FALSE(answering.apply("vehicle asks nothing"));
}
