// Requests for a closed pack: edges of two inputs, and the end of a request.
#include "daemon/core/contactors/close_request.hpp"

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};
constexpr PduState both_off{};
constexpr PduState vehicle{.vehicle_on = true};
constexpr PduState charger{.charger_connected = true};
constexpr PduState both{.vehicle_on = true, .charger_connected = true};

/// Both inputs have been off, so that the next one that switches on is an edge.
CloseRequest seen_off() {
  CloseRequest request;
  (void)request.follow(both_off, true, start);
  return request;
}

}  // namespace

TEST_CASE("a line that was on when it was first seen asks for nothing", "[unit][request][F64]") {
  for (const PduState& lines : {vehicle, charger, both}) {
    CloseRequest request;
    CHECK_FALSE(request.follow(lines, true, start));
    CHECK_FALSE(request.follow(lines, true, start + 1s));
    CHECK_FALSE(request.is_present());
  }
}

TEST_CASE("a line that comes on asks, as long as it stays on", "[unit][request]") {
  for (const PduState& line : {vehicle, charger}) {
    CloseRequest request = seen_off();
    CHECK_FALSE(request.is_present());
    CHECK(request.follow(line, true, start + 1s));
    CHECK(request.is_present());
    CHECK(request.since() == start + 1s);
    CHECK_FALSE(request.follow(line, false, start + 2s));
    CHECK(request.is_present());
    CHECK(request.since() == start + 1s);
    CHECK(request.follow(both_off, false, start + 3s));
    CHECK_FALSE(request.is_present());
    CHECK(request.since() == start + 3s);
  }
}

TEST_CASE("each line has a wish of its own", "[unit][request][I3]") {
  CloseRequest request = seen_off();
  CHECK(request.follow(vehicle, true, start + 1s));
  CHECK_FALSE(request.follow(both, false, start + 2s));
  CHECK_FALSE(request.follow(charger, false, start + 3s));
  CHECK(request.is_present());
  CHECK(request.follow(both_off, false, start + 4s));
  CHECK_FALSE(request.is_present());
}

TEST_CASE("a plug is pulled where its line ends and nobody else asks, until somebody does", "[unit][request][F100]") {
  CloseRequest request = seen_off();
  CHECK_FALSE(request.is_unplugged());
  (void)request.follow(charger, true, start + 1s);
  CHECK_FALSE(request.is_unplugged());
  (void)request.follow(both_off, false, start + 2s);
  CHECK(request.is_unplugged());
  (void)request.follow(both_off, false, start + 3s);
  CHECK(request.is_unplugged());
  (void)request.follow(vehicle, true, start + 4s);
  CHECK_FALSE(request.is_unplugged());
  (void)request.follow(both_off, false, start + 5s);  // the key is switched off
  CHECK_FALSE(request.is_unplugged());
  (void)request.follow(charger, true, start + 6s);
  (void)request.follow(both, false, start + 7s);
  (void)request.follow(vehicle, false, start + 8s);  // the vehicle still requests
  CHECK_FALSE(request.is_unplugged());
  (void)request.follow(both_off, false, start + 9s);
  CHECK_FALSE(request.is_unplugged());
  // A charge has ended; the current still gets its time to end when the plug is pulled.
  (void)request.follow(charger, true, start + 10s);
  request.drop_charger();
  CHECK_FALSE(request.is_unplugged());
  (void)request.follow(both_off, false, start + 11s);
  CHECK(request.is_unplugged());
  (void)request.follow(charger, true, start + 12s);
  CHECK_FALSE(request.is_unplugged());
  // The vehicle has requested since the end of the charge: its key and the plug end together.
  request.drop_charger();
  (void)request.follow(both, true, start + 13s);
  (void)request.follow(both_off, false, start + 14s);
  CHECK_FALSE(request.is_present());
  CHECK_FALSE(request.is_unplugged());
}

TEST_CASE("a wish that was dealt with needs a new edge, whichever line it came from", "[unit][request]") {
  for (const PduState& line : {vehicle, charger}) {
    CloseRequest request = seen_off();
    (void)request.follow(line, true, start + 1s);
    request.drop();
    CHECK_FALSE(request.is_present());
    CHECK_FALSE(request.follow(line, true, start + 2s));
    CHECK_FALSE(request.is_present());
    (void)request.follow(both_off, true, start + 3s);
    CHECK(request.follow(line, true, start + 4s));
    CHECK(request.is_present());
  }
}

TEST_CASE("lines nobody saw for a while: a closed pack keeps its wish, an open one forgets it",
          "[unit][request][F64]") {
  for (const PduState& line : {vehicle, charger}) {
    CloseRequest closed = seen_off();
    (void)closed.follow(line, true, start + 1s);
    closed.lose_sight();
    CHECK(closed.is_present());
    CHECK_FALSE(closed.follow(line, false, start + 2s));
    CHECK(closed.is_present());
    closed.lose_sight();
    CHECK(closed.follow(both_off, false, start + 3s));
    CHECK_FALSE(closed.is_present());

    CloseRequest open = seen_off();
    (void)open.follow(line, true, start + 1s);
    open.lose_sight();
    CHECK(open.follow(line, true, start + 2s));
    CHECK_FALSE(open.is_present());
    CHECK_FALSE(open.follow(line, true, start + 3s));
    CHECK_FALSE(open.is_present());
  }
}

TEST_CASE("a line that came on while nobody looked is no edge", "[unit][request][F64]") {
  for (const PduState& line : {vehicle, charger}) {
    CloseRequest request = seen_off();
    request.lose_sight();
    CHECK_FALSE(request.follow(line, true, start + 1s));
    CHECK_FALSE(request.is_present());
  }
}
