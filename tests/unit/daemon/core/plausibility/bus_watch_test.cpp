// Events of the buses, and how long they are remembered.
#include "daemon/core/plausibility/bus_watch.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{100s};

}  // namespace

TEST_CASE("three times off the bus within a minute is a storm, for a minute after the first", "[unit][can][F45]") {
  BusWatch watch;
  CHECK_FALSE(watch.is_storm(start));
  watch.note_bus_off(start);
  watch.note_bus_off(start + 30s);
  CHECK_FALSE(watch.is_storm(start + 30s));
  watch.note_bus_off(start + 60s);
  CHECK(watch.is_storm(start + 60s));
  CHECK_FALSE(watch.is_storm(start + 60s + 1ns));
  watch.note_bus_off(start + 61s);
  CHECK(watch.is_storm(start + 61s));  // 30, 60 and 61
  CHECK(watch.is_storm(start + 90s));
  CHECK_FALSE(watch.is_storm(start + 90s + 1ns));
}

TEST_CASE("a stranger among the modules has to speak twice, and is remembered for 5 s", "[unit][can][F31]") {
  BusWatch watch;
  CHECK(watch.unknown_module(start) == 0);
  watch.note_unknown_module(9, start);
  CHECK(watch.unknown_module(start) == 0);  // one frame may be accidental
  watch.note_unknown_module(9, start);
  CHECK(watch.unknown_module(start) == 0);  // twice the same one
  watch.note_unknown_module(9, start + 5s);
  CHECK(watch.unknown_module(start + 5s) == 9);
  CHECK(watch.unknown_module_at() == start + 5s);
  CHECK(watch.unknown_module(start + 10s) == 9);
  CHECK(watch.unknown_module(start + 10s + 1ns) == 0);
  BusWatch slow;
  slow.note_unknown_module(9, start);
  slow.note_unknown_module(9, start + 5s + 1ns);
  CHECK(slow.unknown_module(start + 6s) == 0);
  BusWatch others;
  others.note_unknown_module(9, start);
  others.note_unknown_module(10, start + 1s);
  CHECK(others.unknown_module(start + 1s) == 0);
}

TEST_CASE("somebody else's report is remembered for 5 s", "[unit][can][F38]") {
  BusWatch watch;
  CHECK_FALSE(watch.has_foreign_report(TimePoint{1s}));
  watch.note_foreign_report(start);
  CHECK(watch.foreign_report_at() == start);
  CHECK(watch.has_foreign_report(start + 5s));
  CHECK_FALSE(watch.has_foreign_report(start + 5s + 1ns));
}

TEST_CASE("a controller is error-passive as long as it says so", "[unit][can][F47]") {
  BusWatch watch;
  CHECK_FALSE(watch.is_error_passive());
  watch.note_error_passive(true);
  CHECK(watch.is_error_passive());
  watch.note_error_passive(false);
  CHECK_FALSE(watch.is_error_passive());
}
