// Frame check of a module unit: the same results as those of receive_check.
#include "protocol/request_check.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mmu_bench.hpp"
#include "tests/support/worked_frames.hpp"

namespace bmu {
namespace {

using namespace bmu::test;

TEST_CASE("POLLs and COMMANDs, whole, damaged and repeated: the same verdicts as of the large check",
          "[unit][protocol][mmu]") {
  RequestCheck small;
  ReceiveCheck large(internal_bus::catalogue, ReceiveCheck::Role::listener);
  Random random(3);
  for (int trial = 0; trial < 50'000; ++trial) {
    const auto counter = static_cast<std::uint8_t>(random.below(3));
    const auto byte = static_cast<std::uint8_t>(random.below(2));
    CanFrame frame = poll_frame(byte, 1, counter);
    if (random.below(2) == 0) frame = command_frame(random.below(2) == 0 ? 0 : 7, counter, {3, byte});
    switch (random.below(12)) {
      case 0: frame.data[random.below(8)] ^= 0x10; break;
      case 1: frame.length = 7; break;
      case 2: frame.is_extended = true; break;
      case 3: frame.is_remote = true; break;
      case 4: frame.is_error = true; break;
      default: break;
    }
    if (random.below(100) == 0) {
      small.forget_counters();
      large.forget_counters();
    }
    const CheckedFrame one = small.check(frame);
    const CheckedFrame other = large.check(frame);
    REQUIRE(one.is_accepted == other.is_accepted);
    REQUIRE(one.message == other.message);
    REQUIRE(one.node == other.node);
    if (!one.is_accepted) REQUIRE(one.reason == other.reason);
  }
  CHECK(small.counts().accepted == large.counts().accepted);
  CHECK(small.counts().rejected == large.counts().rejected);
  for (const RejectReason reason : {RejectReason::wrong_form, RejectReason::wrong_length, RejectReason::wrong_crc,
                                    RejectReason::repeated_counter, RejectReason::conflicting}) {
    INFO(to_text(reason));
    CHECK(small.counts().rejected[static_cast<std::size_t>(reason)] > 100);
  }
}

TEST_CASE("a new node number is a new identifier: the counter of the old one says nothing about it",
          "[unit][protocol][mmu]") {
  RequestCheck check;
  CHECK(check.check(command_frame(7, 9, {4})).is_accepted);
  CHECK(check.check(command_frame(8, 9, {4})).is_accepted);
  CHECK_FALSE(check.check(command_frame(8, 9, {4})).is_accepted);
}

TEST_CASE("an identifier of nobody is unknown", "[unit][protocol][mmu]") {
  RequestCheck check;
  CHECK(check.check(data_frame(0x7F0, 8)).reason == RejectReason::unknown_id);
}

}  // namespace
}  // namespace bmu
