// Delay of the next closing after an opening, to the nanosecond.
#include "daemon/core/contactors/reclosing.hpp"

#include <array>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint now{100s};
constexpr Duration cool_down = 7s;

constexpr std::array all_causes{OpeningCause::none,      OpeningCause::fault,           OpeningCause::request_over,
                                OpeningCause::shut_down, OpeningCause::precharge_retry, OpeningCause::permission};

Measured<std::int32_t> volts(std::int32_t value_mV, Validity validity = Validity::valid) {
  return {value_mV, now, validity};
}

}  // namespace

TEST_CASE("each phase needs the permission of its own", "[unit][core][I3]") {
  for (const Phase phase : all_phases) {
    CAPTURE(to_text(phase));
    const bool is_open = phase == Phase::open;
    const bool is_closing = phase == Phase::main_negative || phase == Phase::precharge || phase == Phase::main_positive;
    Permission permission;
    CHECK_FALSE(is_permitted(permission, phase));
    permission = {.may_close = true};
    CHECK(is_permitted(permission, phase) == is_open);
    permission = {.may_go_on = true};
    CHECK(is_permitted(permission, phase) == is_closing);
    permission = {.may_stay_closed = true};
    CHECK(is_permitted(permission, phase) == (!is_open && !is_closing));
  }
}

TEST_CASE("a wish outlives its own end and a precharge that is tried again, no other opening", "[unit][core][I3]") {
  for (const OpeningCause cause : all_causes) {
    CAPTURE(to_text(cause));
    CHECK(keeps_wish(cause) == (cause == OpeningCause::request_over || cause == OpeningCause::precharge_retry));
  }
}

TEST_CASE(
    "after an opening for a reason nothing closes for 10 s, after a wish that ended for 2 s, between two tries for "
    "the cool-down",
    "[unit][core][I5]") {
  for (const OpeningCause cause : all_causes) {
    CAPTURE(to_text(cause));
    const Duration wait = reclose_wait(cause, now, {}, cool_down);
    if (cause == OpeningCause::request_over) {
      CHECK(wait == 2s);
    } else {
      CHECK(wait == (cause == OpeningCause::precharge_retry ? cool_down : 10s));
    }
  }
}

TEST_CASE("a key that is played with waits as long as after a fault", "[unit][core][F92]") {
  const auto wait = [](Duration since_the_last) {
    return reclose_wait(OpeningCause::request_over, now, now - since_the_last, cool_down);
  };
  CHECK(wait(20s) == 10s);
  CHECK(wait(20s + 1ns) == 2s);
  CHECK(reclose_wait(OpeningCause::request_over, TimePoint{5s}, {}, cool_down) == 2s);  // the first opening of all
  CHECK(reclose_wait(OpeningCause::precharge_retry, now, now - 1s, cool_down) == cool_down);
}

TEST_CASE("a wish waits 5 s for a pack that is not ready, not at all with a fault, and for the next try of a precharge",
          "[unit][core][F90]") {
  constexpr std::array busy{Blocker::not_qualified, Blocker::locked_out};
  constexpr std::array faulty{Blocker::not_qualified, Blocker::fault};
  CHECK_FALSE(is_vain(busy, 5s - 1ns, false));
  CHECK(is_vain(busy, 5s, false));
  CHECK_FALSE(is_vain(busy, 5s, true));
  CHECK(is_vain(faulty, 0s, false));
  CHECK(is_vain(faulty, 0s, true));
  CHECK(has_fault(faulty));
  CHECK_FALSE(has_fault(busy));
  CHECK_FALSE(has_fault({}));
}

TEST_CASE("voltages agree while they are less than the limit apart, either way, and both are known",
          "[unit][core][F89]") {
  CHECK(voltages_agree(volts(100'000), volts(100'000), 1));
  CHECK(voltages_agree(volts(103'999), volts(100'000), 4'000));
  CHECK_FALSE(voltages_agree(volts(104'000), volts(100'000), 4'000));
  CHECK(voltages_agree(volts(96'001), volts(100'000), 4'000));
  CHECK_FALSE(voltages_agree(volts(96'000), volts(100'000), 4'000));
  CHECK_FALSE(voltages_agree(volts(100'000, Validity::unknown), volts(100'000), 4'000));
  CHECK_FALSE(voltages_agree(volts(100'000), volts(100'000, Validity::unknown), 4'000));
  CHECK_FALSE(voltages_agree(volts(INT32_MAX), volts(INT32_MIN), 4'000));
}
