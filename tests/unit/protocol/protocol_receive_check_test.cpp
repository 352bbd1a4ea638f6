// Check of every received frame: each reject reason, the counters, and effects that a rejected frame must not have.
#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;
using internal_bus::catalogue;
using Role = ReceiveCheck::Role;

CanFrame sealed(const MessageSpec& message, std::uint8_t node, std::uint8_t counter) {
  CanFrame frame = make_frame(message, node);
  seal(message, counter, frame);
  return frame;
}
CanFrame status_of(std::uint8_t node, std::uint8_t counter) {
  return sealed(internal_bus::status, node, counter);
}
CanFrame poll_to(std::uint8_t target, std::uint8_t counter) {
  CanFrame frame = make_frame(internal_bus::poll);
  write<internal_bus::poll, "target_node">(frame, target);
  seal(internal_bus::poll, counter, frame);
  return frame;
}

/// "ok" or the reason, so that a failed comparison reads well.
std::string verdict(ReceiveCheck& check, const CanFrame& frame) {
  const CheckedFrame checked = check.check(frame);
  return checked.is_accepted ? "ok" : std::string(to_text(checked.reason));
}

}  // namespace

TEST_CASE("all worked frames pass the check, in their order", "[unit][protocol]") {
  ReceiveCheck internal(catalogue, Role::listener);
  for (const WorkedFrame& worked : internal_worked_frames()) {
    const CheckedFrame checked = internal.check(worked.frame());
    CHECK(checked.is_accepted);
    CHECK(checked.message == worked.message);
    CHECK(checked.node == worked.node);
  }
  ReceiveCheck vehicle(vehicle_bus::catalogue, Role::listener);
  for (const WorkedFrame& worked : vehicle_worked_frames()) CHECK(verdict(vehicle, worked.frame()) == "ok");
  CHECK(internal.counts().accepted == 14);
  CHECK(internal.counts().rejected_total() == 0);
}

TEST_CASE("a frame of another form or an unknown identifier is refused", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::listener);
  const CanFrame good = status_of(3, 1);
  CanFrame extended = good;
  extended.is_extended = true;
  CanFrame remote = good;
  remote.is_remote = true;
  CanFrame error = good;
  error.is_error = true;
  CanFrame unknown = good;
  unknown.id = 0x7FF;
  CHECK(verdict(check, extended) == "wrong form");
  CHECK(verdict(check, remote) == "wrong form");
  CHECK(verdict(check, error) == "wrong form");
  CHECK(verdict(check, unknown) == "unknown id");
  CHECK(verdict(check, good) == "ok");
}

TEST_CASE("a frame of any wrong length is refused", "[unit][protocol]") {
  for (const Catalogue* bus : {&catalogue, &vehicle_bus::catalogue, &vehicle_bus_elithion::catalogue}) {
    ReceiveCheck check(*bus, Role::listener);
    for (const MessageSpec* message : bus->messages()) {
      for (std::uint8_t length = 0; length <= 8; ++length) {
        CanFrame frame = sealed(*message, message->node_min, 1);
        frame.length = length;
        CHECK(verdict(check, frame) == (length == message->length ? "ok" : "wrong length"));
      }
    }
  }
}

TEST_CASE("a damaged frame is refused, changes nothing, and its counter may still come", "[unit][protocol]") {
  for (const MessageSpec* message : catalogue.messages()) {
    if (!has_crc(*message)) continue;
    const CanFrame good = sealed(*message, message->node_min, 7);
    for (std::size_t bit = 0; bit < 64; ++bit) {
      ReceiveCheck check(catalogue, Role::listener);
      CanFrame damaged = good;
      damaged.data[bit / 8] = static_cast<std::uint8_t>(damaged.data[bit / 8] ^ (1U << (bit % 8)));
      REQUIRE(verdict(check, damaged) == "wrong crc");
      REQUIRE(check.counts().accepted == 0);
      REQUIRE(check.rejected_under(good.id) == 1);
      REQUIRE(verdict(check, good) == "ok");
    }
  }
}

TEST_CASE("a contactor command whose complement is wrong is refused although its checksum is right",
          "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::listener);
  CanFrame frame = sealed(internal_bus::contactor_command, 0, 1);
  frame.data[0] = 0x01;
  frame.data[7] = frame_crc(frame);
  CHECK(verdict(check, frame) == "wrong complement");
  seal(internal_bus::contactor_command, 1, frame);
  CHECK(verdict(check, frame) == "ok");
}

TEST_CASE("a sensor frame must name the channel of its identifier and advance its counter", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::listener);
  CanFrame frame = sealed(internal_bus::sensor_u1, 0, 1);
  frame.data[0] = 2;
  CHECK(verdict(check, frame) == "wrong channel");
  CHECK(verdict(check, sealed(internal_bus::sensor_u1, 0, 15)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::sensor_u1, 0, 15)) == "repeated counter");
  CHECK(verdict(check, sealed(internal_bus::sensor_u1, 0, 0)) == "ok");
}

TEST_CASE("a repeated counter is refused under its identifier only", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::listener);
  CHECK(verdict(check, status_of(3, 9)) == "ok");
  CHECK(verdict(check, status_of(3, 9)) == "repeated counter");
  CHECK(verdict(check, status_of(4, 9)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::cells_1, 3, 9)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::pdu_status, 0, 255)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::pdu_status, 0, 0)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::pdu_status, 0, 0)) == "repeated counter");
}

TEST_CASE("a refused frame does not move the counter", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::listener);
  CHECK(verdict(check, status_of(3, 9)) == "ok");
  CanFrame damaged = status_of(3, 10);
  damaged.data[2] ^= 1;
  CHECK(verdict(check, damaged) == "wrong crc");
  CHECK(verdict(check, status_of(3, 9)) == "repeated counter");
  CHECK(verdict(check, status_of(3, 10)) == "ok");
}

TEST_CASE("an answer is late unless it has the counter of the latest poll to its module", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::master);
  CHECK(verdict(check, status_of(3, 77)) == "ok");  // nothing was polled yet
  check.note_sent(poll_to(0, 10));
  CHECK(verdict(check, status_of(3, 10)) == "ok");
  CHECK(verdict(check, status_of(4, 9)) == "late");
  CHECK(verdict(check, status_of(4, 11)) == "late");

  // A poll to one module leaves the answers of the others to the broadcast before it valid.
  check.note_sent(poll_to(3, 11));
  CHECK(verdict(check, status_of(4, 10)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::cells_1, 3, 10)) == "late");
  CHECK(verdict(check, status_of(3, 11)) == "ok");
  check.note_sent(poll_to(0, 12));
  CHECK(verdict(check, sealed(internal_bus::cells_1, 4, 10)) == "late");
  CHECK(verdict(check, sealed(internal_bus::cells_1, 4, 12)) == "ok");
}

TEST_CASE("a response is late unless it has the counter of the latest command to its module", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::master);
  check.note_sent(poll_to(0, 50));
  check.note_sent(sealed(internal_bus::command, 3, 7));
  CHECK(verdict(check, sealed(internal_bus::response, 3, 6)) == "late");
  CHECK(verdict(check, sealed(internal_bus::response, 3, 50)) == "late");
  CHECK(verdict(check, sealed(internal_bus::response, 3, 7)) == "ok");
  check.note_sent(sealed(internal_bus::command, 0, 8));  // no module answers a broadcast
  CHECK(verdict(check, sealed(internal_bus::response, 3, 7)) == "repeated counter");
}

TEST_CASE("an identity with counter 0 is taken at any time, again and again", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::master);
  check.note_sent(poll_to(0, 10));
  CHECK(verdict(check, sealed(internal_bus::ident, 3, 0)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::ident, 3, 0)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::ident, 3, 9)) == "late");
  CHECK(verdict(check, sealed(internal_bus::ident, 3, 10)) == "ok");
  CHECK(verdict(check, sealed(internal_bus::ident, 3, 10)) == "repeated counter");
  CHECK(verdict(check, status_of(3, 0)) == "late");
}

TEST_CASE("a listener learns from the polls and commands it hears, a master only from its own", "[unit][protocol]") {
  ReceiveCheck listener(catalogue, Role::listener);
  CHECK(verdict(listener, poll_to(0, 10)) == "ok");
  CHECK(verdict(listener, status_of(3, 9)) == "late");
  CHECK(verdict(listener, status_of(3, 10)) == "ok");
  CHECK(verdict(listener, sealed(internal_bus::command, 3, 4)) == "ok");
  CHECK(verdict(listener, sealed(internal_bus::response, 3, 3)) == "late");

  ReceiveCheck master(catalogue, Role::master);
  for (const MessageSpec* foreign : {&internal_bus::poll, &internal_bus::command, &internal_bus::contactor_command}) {
    CHECK(verdict(master, sealed(*foreign, foreign->node_min, 10)) == "foreign master");
  }
  CHECK(verdict(master, status_of(3, 9)) == "ok");
}

TEST_CASE("a repeated or damaged poll teaches a listener nothing", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::listener);
  CHECK(verdict(check, poll_to(0, 10)) == "ok");
  CHECK(verdict(check, poll_to(0, 11)) == "ok");
  CanFrame damaged = poll_to(0, 12);
  damaged.data[3] ^= 0x10;
  CHECK(verdict(check, damaged) == "wrong crc");
  CHECK(verdict(check, status_of(3, 12)) == "late");
  CHECK(verdict(check, status_of(3, 11)) == "ok");
}

TEST_CASE("after forgetting counters the first frame of anybody is taken, and the counts stay", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::listener);
  CHECK(verdict(check, poll_to(0, 10)) == "ok");
  CHECK(verdict(check, status_of(3, 10)) == "ok");
  CHECK(verdict(check, status_of(3, 10)) == "repeated counter");
  check.forget_counters();
  CHECK(check.counts().accepted == 2);
  CHECK(check.counts().rejected_total() == 1);
  CHECK(verdict(check, status_of(3, 10)) == "ok");
  CHECK(verdict(check, status_of(4, 200)) == "ok");
}

TEST_CASE("a frame refused by its owner moves from accepted to rejected", "[unit][protocol]") {
  ReceiveCheck check(catalogue, Role::master);
  const CanFrame frame = status_of(63, 1);
  CHECK(verdict(check, frame) == "ok");
  check.reject(frame, RejectReason::not_configured);
  CHECK(check.counts().accepted == 0);
  CHECK(check.counts().rejected[static_cast<std::size_t>(RejectReason::not_configured)] == 1);
  CHECK(check.rejected_under(frame.id) == 1);
  CHECK(check.rejected_under(5000) == 0);
}

TEST_CASE("every reason has a text of its own", "[unit][protocol]") {
  for (std::size_t one = 0; one < reject_reason_count; ++one) {
    for (std::size_t other = 0; other < one; ++other) {
      CHECK(to_text(static_cast<RejectReason>(one)) != to_text(static_cast<RejectReason>(other)));
    }
  }
}
