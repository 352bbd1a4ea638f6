// The simulated bus: arbitration, lengths, error frames, counters, bus-off and recovery.
#include "tests/support/can_bus.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr Station a{1};
constexpr Station b{2};
constexpr Station c{3};
constexpr TimePoint start{1s};
constexpr Duration bit = 2us;  // at 500 kbit/s
constexpr CanFrame nothing_inside{.id = 0x123, .length = 0};

CanFrame frame_of(std::uint32_t id, std::uint8_t first = 0) {
  CanFrame frame = data_frame(id, 8);
  frame.data = {first, 0x5A, 0xA5, 0x5A, 0xA5, 0x5A, 0xA5, 0x5A};
  return frame;
}

/// Bus with three stations, and all its events.
struct Line {
  explicit Line(const BusConfig& config = {}) : bus(config) {
    for (const Station station : {a, b, c}) bus.connect(station);
  }

  void run(Duration duration) {
    const TimePoint end = now + duration;
    bus.start_if_idle(now);
    while (bus.next_at() <= end) {
      now = bus.next_at();
      for (const BusEvent& event : bus.take_due(now)) events.push_back(event);
      bus.start_if_idle(now);
    }
    now = end;
  }
  void put(Station station, const CanFrame& frame) { bus.put(station, frame); }

  [[nodiscard]] std::vector<BusEvent> of(BusEvent::Kind kind) const {
    std::vector<BusEvent> found;
    for (const BusEvent& event : events) {
      if (event.kind == kind) found.push_back(event);
    }
    return found;
  }
  [[nodiscard]] std::vector<BusEvent> heard() const { return of(BusEvent::Kind::heard); }
  [[nodiscard]] std::vector<BusEvent> errors() const { return of(BusEvent::Kind::error); }
  [[nodiscard]] std::string heard_ids() const {
    std::string text;
    for (const BusEvent& event : heard()) text += std::to_string(event.frame.id) + " ";
    return text;
  }
  /// Corrupts the next `count` frames of this station.
  void hurt(Station sender, int count, WireFault fault = {}) {
    bus.disturb = [=, left = count](Station who, const CanFrame&, TimePoint) mutable -> std::optional<WireFault> {
      if (who != sender || left == 0) return {};
      --left;
      return fault;
    };
  }

  CanBus bus;
  TimePoint now = start;
  std::vector<BusEvent> events;
};

/// The counter rises by 8 with each lost frame, and falls by 1 with each successful one: first to the largest multiple
/// of 8 below, less the excess, then by the last 8. So 255 is reached without passing 256.
void bring_transmit_counter_to(Line& line, Station station, int wanted) {
  line.bus.set_one_shot(station, true);
  const int steps = (wanted + 7) / 8;
  const int too_much = 8 * steps - wanted;
  const auto send = [&](int lost, int good) {
    line.hurt(station, lost);
    for (int count = 0; count < lost + good; ++count) line.put(station, nothing_inside);
    line.run(10ms);
  };
  if (steps > 1) {
    send(steps - 1, too_much);
    send(1, 0);
  } else {
    send(steps, too_much);
  }
  line.bus.set_one_shot(station, false);
  line.bus.disturb = {};
  line.events.clear();
}

}  // namespace

// --- lengths and load -----------------------------------------------------------------------------------------------

TEST_CASE("a frame is heard when its last bit is through, and the bus is free three bits later", "[unit][can_bus]") {
  for (const std::int64_t rate : {125'000, 250'000, 500'000, 1'000'000}) {
    Line line({.bits_per_s = rate, .stuffing = Stuffing::exact});
    const Duration one_bit{1'000'000'000 / rate};
    const CanFrame zeros{.id = 0x620, .length = 8};
    line.put(a, zeros);
    line.put(b, frame_of(0x621));
    line.run(10ms);
    REQUIRE(line.heard().size() == 2);
    CHECK(line.heard()[0].at == start + (126 - 3) * one_bit);
    CHECK(line.heard()[1].at == start + (126 + bits_on_wire(frame_of(0x621)) - 3) * one_bit);
  }
}

TEST_CASE("with the longest stuffing no frame is heard before the longest of its kind could be", "[unit][can_bus]") {
  Line line({.stuffing = Stuffing::longest});
  line.put(a, frame_of(0x124));
  line.put(b, nothing_inside);
  line.run(1ms);
  REQUIRE(line.heard().size() == 2);
  CHECK(line.heard()[0].at == start + 55 * bit);
  CHECK(line.heard()[1].at == start + (55 + 135) * bit);
}

TEST_CASE("the load of a time is the bits that were on the bus in it", "[unit][can_bus]") {
  Line line;
  const CanFrame zeros{.id = 0x620, .length = 8};
  const Duration length = 126 * bit;
  line.put(a, zeros);
  line.run(length / 2);
  CHECK(line.bus.busy(line.now) == length / 2);
  line.run(10ms);
  CHECK(line.bus.busy(line.now) == length);
  const Duration before = line.bus.busy(line.now);
  for (int count = 0; count < 4; ++count) line.put(a, zeros);
  line.run(10ms);
  CHECK((line.bus.busy(line.now) - before) * 1'000 / 10ms == 100);  // 4 x 252 us of 10 ms
}

// --- arbitration ----------------------------------------------------------------------------------------------------

TEST_CASE("of those that wait the lowest identifier is sent first", "[unit][can_bus]") {
  Line line;
  for (const auto& [station, id] : {std::pair{a, 0x300U}, {b, 0x100U}, {c, 0x200U}}) line.put(station, frame_of(id));
  line.run(5ms);
  CHECK(line.heard_ids() == "256 512 768 ");
  CHECK(line.errors().empty());
  CHECK(line.bus.counters(a) == ErrorCounters{});
}

TEST_CASE("only the head of a queue takes part: a strong frame waits behind a weak one", "[unit][can_bus]") {
  Line line;
  line.put(a, frame_of(0x700));
  line.put(a, frame_of(0x001));
  for (const std::uint32_t id : {0x300U, 0x301U}) line.put(b, frame_of(id));
  line.run(5ms);
  CHECK(line.heard_ids() == "768 769 1792 1 ");
}

TEST_CASE("a frame that has begun is not stopped by a stronger one", "[unit][can_bus]") {
  Line line;
  line.put(a, frame_of(0x700));
  line.run(20us);
  line.put(b, frame_of(0x001));
  line.run(5ms);
  CHECK(line.heard_ids() == "1792 1 ");
}

TEST_CASE("data goes before a remote request, 11 bits before 29 with the same beginning", "[unit][can_bus]") {
  Line line;
  line.put(a, {.id = 0x123U << 18, .is_extended = true, .length = 0});
  line.put(b, {.id = 0x123, .is_remote = true, .length = 0});
  line.put(c, {.id = 0x123, .length = 0});
  line.run(5ms);
  const std::vector<BusEvent> heard = line.heard();
  REQUIRE(heard.size() == 3);
  CHECK(heard[0].station == c);
  CHECK(heard[1].station == b);
  CHECK(heard[2].station == a);
  CHECK(line.errors().empty());
}

TEST_CASE("29 bits with a lower beginning go before 11 bits", "[unit][can_bus]") {
  Line line;
  line.put(a, {.id = 0x124, .length = 0});
  line.put(b, {.id = (0x123U << 18) | 0x3FFFF, .is_extended = true, .length = 0});
  line.run(5ms);
  REQUIRE(line.heard().size() == 2);
  CHECK(line.heard()[0].station == b);
}

TEST_CASE("who tries once drops what lost the arbitration, and says so", "[unit][can_bus]") {
  Line line;
  line.bus.set_one_shot(a, true);
  line.put(a, frame_of(0x300));
  line.put(b, frame_of(0x100));
  line.run(5ms);
  CHECK(line.heard_ids() == "256 ");
  REQUIRE(line.of(BusEvent::Kind::dropped).size() == 1);
  CHECK(line.of(BusEvent::Kind::dropped)[0].station == a);
  CHECK(line.bus.waiting(a) == 0);
}

// --- one identifier, two stations -----------------------------------------------------------------------------------

TEST_CASE("two stations that send the same bits do not notice, and one frame is heard", "[unit][can_bus]") {
  Line line;
  line.put(a, frame_of(0x101));
  line.put(b, frame_of(0x101));
  line.run(5ms);
  CHECK(line.heard_ids() == "257 ");
  CHECK(line.errors().empty());
}

TEST_CASE("the same identifier with other data: errors for both, until one is passive and the other gets through",
          "[unit][can_bus]") {
  Line line;
  line.put(a, frame_of(0x101, 0x00));
  line.put(b, frame_of(0x101, 0xFF));  // recessive where the other is dominant: this one detects the error
  line.run(20ms);
  CHECK(line.errors().size() == 16);  // 8 each, up to 128
  REQUIRE(line.heard().size() == 2);
  CHECK(line.heard()[0].station == a);
  CHECK(line.heard()[1].station == b);
  CHECK(line.bus.counters(a).transmit == 127);
  CHECK(line.bus.counters(b).transmit == 128 + 8 - 1);
  CHECK(line.bus.state(a) == ErrorState::warning);
  CHECK(line.bus.state(b) == ErrorState::passive);
  // Listener: 16 errors detected after others, two valid frames.
  CHECK(line.bus.counters(c).receive == 16 - 2);
}

TEST_CASE("on a bus without collisions stations with one identifier take turns", "[unit][can_bus]") {
  Line line(slowest_bus);
  line.put(a, frame_of(0x101, 0x00));
  line.put(b, frame_of(0x101, 0xFF));
  line.run(5ms);
  CHECK(line.errors().empty());
  REQUIRE(line.heard().size() == 2);
  CHECK(line.heard()[0].station == a);
  CHECK(line.heard()[1].station == b);
  CHECK(line.heard()[1].at == start + 2 * 135 * bit);
}

TEST_CASE("a collision is as long as the frame up to the first different bit, and an error frame", "[unit][can_bus]") {
  Line line;
  line.put(a, frame_of(0x101, 0x00));
  line.put(b, frame_of(0x101, 0x80));
  line.run(100us);
  REQUIRE(line.errors().size() == 1);
  const CanBits first = stuffed_bits(frame_of(0x101, 0x00));
  const CanBits second = stuffed_bits(frame_of(0x101, 0x80));
  std::size_t same = 0;
  while (first[same] == second[same]) ++same;
  CHECK(line.errors()[0].at == start + static_cast<std::int64_t>(same + 1) * bit);
}

// --- error frames ---------------------------------------------------------------------------------------------------

TEST_CASE("an error frame is 12 flag bits less the run before it, 8 of delimiter, 3 between frames",
          "[unit][can_bus]") {
  const CanFrame frame{.id = 0x555, .length = 0};  // 0 10101010101 000 00 and a stuff bit
  struct Row {
    std::size_t bit_hurt;
    std::int64_t run;
  };
  for (const Row& row : {Row{0, 1}, Row{1, 0}, Row{2, 1}, Row{12, 1}, Row{13, 2}, Row{14, 3}, Row{15, 4}, Row{16, 5}}) {
    Line line;
    line.hurt(a, 1, {.hurt = Hurt::sender, .bit = row.bit_hurt});
    line.put(a, frame);
    line.run(5ms);
    INFO("bit " << row.bit_hurt);
    REQUIRE(line.errors().size() == 1);
    REQUIRE(line.heard().size() == 1);
    const std::int64_t lost = static_cast<std::int64_t>(row.bit_hurt) + 1 + 12 - row.run + 8 + 3;
    CHECK(line.heard()[0].at == start + (lost + bits_on_wire(frame) - 3) * bit);
    CHECK(line.bus.counters(a).transmit == 8 - 1);
    CHECK(line.bus.counters(b).receive == 0);  // 1 up, 1 down
  }
}

TEST_CASE("with the longest stuffing an error frame has all its 12 flag bits", "[unit][can_bus]") {
  Line line({.stuffing = Stuffing::longest});
  line.hurt(a, 1, {.bit = 16});
  line.put(a, {.id = 0x555, .length = 0});
  line.run(5ms);
  REQUIRE(line.heard().size() == 1);
  CHECK(line.heard()[0].at == start + (17 + 12 + 8 + 3 + 55) * bit);
}

TEST_CASE("a receiver that sees an error first counts 9, the others 1, the sender 8", "[unit][can_bus]") {
  Line line;
  line.hurt(a, 1, {.hurt = Hurt::one_receiver, .receiver = b});
  line.put(a, frame_of(0x100));
  line.run(150us);
  CHECK(line.errors().size() == 1);
  CHECK(line.bus.counters(a) == ErrorCounters{.transmit = 8, .receive = 0});
  CHECK(line.bus.counters(b) == ErrorCounters{.transmit = 0, .receive = 9});
  CHECK(line.bus.counters(c) == ErrorCounters{.transmit = 0, .receive = 1});
  line.run(5ms);
  CHECK(line.heard().size() == 1);
  CHECK(line.bus.counters(b).receive == 8);
}

TEST_CASE("all receivers see an error: each counts 9", "[unit][can_bus]") {
  Line line;
  line.hurt(a, 1, {.hurt = Hurt::all_receivers});
  line.put(a, frame_of(0x100));
  line.run(150us);
  CHECK(line.bus.counters(b).receive == 9);
  CHECK(line.bus.counters(c).receive == 9);
}

TEST_CASE("an error of a passive receiver is its own: the frame goes on without it", "[unit][can_bus]") {
  Line line;
  line.bus.set_one_shot(a, true);
  line.hurt(a, 15, {.hurt = Hurt::one_receiver, .receiver = b});  // 15 x 9
  for (int count = 0; count < 15; ++count) line.put(a, frame_of(0x100));
  line.run(20ms);
  line.bus.set_one_shot(a, false);
  REQUIRE(line.bus.state(b) == ErrorState::passive);
  line.events.clear();
  const int before = line.bus.counters(b).receive;
  line.hurt(a, 1, {.hurt = Hurt::one_receiver, .receiver = b});
  line.put(a, frame_of(0x101));
  line.run(5ms);
  CHECK(line.errors().empty());
  REQUIRE(line.heard().size() == 1);
  CHECK(line.heard()[0].missed_by == b);
  CHECK(line.bus.counters(b).receive == before + 1);
  line.put(a, frame_of(0x102));
  line.run(5ms);
  CHECK(line.bus.counters(b).receive == 127);
  CHECK_FALSE(line.heard().back().missed_by);
}

TEST_CASE("a station alone: unacknowledged up to passive, and no further", "[unit][can_bus]") {
  Line line;
  line.bus.disconnect(b);
  line.bus.disconnect(c);
  line.put(a, frame_of(0x100));
  line.run(1s);
  CHECK(line.heard().empty());
  CHECK(line.bus.counters(a) == ErrorCounters{.transmit = 128, .receive = 0});
  CHECK(line.bus.state(a) == ErrorState::passive);
  CHECK(line.errors().size() > 3'000);  // it retries permanently
  line.bus.connect(b);
  line.run(1ms);
  CHECK(line.heard().size() == 1);
  CHECK(line.bus.counters(a).transmit == 127);
}

TEST_CASE("a frame nobody acknowledges ends in its slot, with a flag of 6 bits", "[unit][can_bus]") {
  Line line;
  line.bus.disconnect(b);
  line.bus.disconnect(c);
  line.put(a, frame_of(0x100));
  const std::int64_t length = bits_on_wire(frame_of(0x100));
  line.run(length * bit);
  REQUIRE(line.errors().size() == 1);
  CHECK(line.errors()[0].at ==
        start + (length - 3 - 8) * bit);  // the acknowledgement is the second of the trailer's 10
  line.run(length * bit);
  REQUIRE(line.errors().size() == 2);
  CHECK(line.errors()[1].at - line.errors()[0].at == (6 + 8 + 3 + length - 3 - 8) * bit);
}

// --- counters -------------------------------------------------------------------------------------------------------

TEST_CASE("the states begin at 96, 128 and 256", "[unit][can_bus]") {
  struct Row {
    int counter;
    ErrorState state;
  };
  for (const Row& row : {Row{0, ErrorState::active}, Row{1, ErrorState::active}, Row{95, ErrorState::active},
                         Row{96, ErrorState::warning}, Row{97, ErrorState::warning}, Row{126, ErrorState::warning},
                         Row{127, ErrorState::warning}, Row{128, ErrorState::passive}, Row{129, ErrorState::passive},
                         Row{247, ErrorState::passive}, Row{248, ErrorState::passive}, Row{254, ErrorState::passive},
                         Row{255, ErrorState::passive}}) {
    Line line;
    bring_transmit_counter_to(line, a, row.counter);
    INFO(row.counter);
    CHECK(line.bus.counters(a).transmit == row.counter);
    CHECK(line.bus.state(a) == row.state);
  }
}

TEST_CASE("from 247 a lost frame leaves a station on the bus, from 248 it is off", "[unit][can_bus]") {
  for (const int counter : {246, 247, 248, 249, 255}) {
    Line line;
    bring_transmit_counter_to(line, a, counter);
    line.hurt(a, 1);
    line.put(a, nothing_inside);
    line.run(150us);
    INFO(counter);
    CHECK((line.bus.state(a) == ErrorState::bus_off) == (counter >= 248));
  }
}

TEST_CASE("passive ends at 127, with the change told", "[unit][can_bus]") {
  Line line;
  bring_transmit_counter_to(line, a, 128);
  line.put(a, nothing_inside);
  line.run(1ms);
  const std::vector<BusEvent> states = line.of(BusEvent::Kind::state);
  REQUIRE(states.size() == 1);
  CHECK(states[0].station == a);
  CHECK(states[0].state == ErrorState::warning);
  CHECK(states[0].counters == ErrorCounters{.transmit = 127, .receive = 0});
}

TEST_CASE("a receive counter alone makes passive and never bus-off", "[unit][can_bus]") {
  Line line;
  line.hurt(a, 31, {.hurt = Hurt::one_receiver, .receiver = b});
  line.put(a, frame_of(0x100));
  line.put(c, frame_of(0x101));
  line.run(40ms);
  CHECK(line.bus.state(b) != ErrorState::bus_off);
  for (const BusEvent& event : line.of(BusEvent::Kind::state)) {
    if (event.station == b) CHECK(event.state != ErrorState::bus_off);
  }
}

TEST_CASE("a passive sender lets others go first for 8 bits", "[unit][can_bus]") {
  Line line;
  bring_transmit_counter_to(line, a, 140);
  const std::int64_t length = bits_on_wire(frame_of(0x100));
  line.put(a, frame_of(0x100));
  line.put(a, frame_of(0x101));
  const TimePoint began_at = line.now;
  line.run(100us);
  line.put(b, frame_of(0x700));
  line.run(5ms);
  CHECK(line.heard_ids() == "256 1792 257 ");
  line.events.clear();
  const TimePoint again_at = line.now;
  line.put(a, frame_of(0x100));
  line.put(a, frame_of(0x101));
  line.run(5ms);
  REQUIRE(line.heard().size() == 2);
  CHECK(line.heard()[0].at == again_at + (length - 3) * bit);
  CHECK(line.heard()[1].at == again_at + (length + 8 + bits_on_wire(frame_of(0x101)) - 3) * bit);
  CHECK(began_at < again_at);
}

// --- bus-off and back -----------------------------------------------------------------------------------------------

TEST_CASE("32 lost frames in a row end in bus-off: the queue is lost, and what is put is lost", "[unit][can_bus]") {
  Line line;
  line.hurt(a, 32);
  line.put(a, frame_of(0x100));
  line.put(a, frame_of(0x101));
  line.run(20ms);
  CHECK(line.errors().size() == 32);
  CHECK(line.bus.state(a) == ErrorState::bus_off);
  CHECK(line.of(BusEvent::Kind::dropped).size() == 2);
  line.put(a, frame_of(0x102));
  line.run(20ms);
  CHECK(line.bus.waiting(a) == 0);
  CHECK(line.heard().empty());
}

TEST_CASE("31 lost frames in a row do not", "[unit][can_bus]") {
  Line line;
  line.hurt(a, 31);
  line.put(a, frame_of(0x100));
  line.run(20ms);
  CHECK(line.heard().size() == 1);
  CHECK(line.bus.counters(a).transmit == 247);
}

TEST_CASE("a restarted controller is back after 128 times 11 recessive bits, with counters of 0", "[unit][can_bus]") {
  Line line;
  line.hurt(a, 32);
  line.put(a, frame_of(0x100));
  line.run(20ms);
  line.run(1s);
  REQUIRE(line.bus.state(a) == ErrorState::bus_off);  // not by itself
  line.events.clear();
  line.bus.restart(a, line.now);
  const TimePoint began_at = line.now;
  line.run(10ms);
  const std::vector<BusEvent> states = line.of(BusEvent::Kind::state);
  REQUIRE(states.size() == 1);
  CHECK(states[0].at == began_at + 128 * 11 * bit);
  CHECK(states[0].state == ErrorState::active);
  CHECK(line.bus.counters(a) == ErrorCounters{});
  line.put(a, frame_of(0x100));
  line.run(1ms);
  CHECK(line.heard().size() == 1);
}

TEST_CASE("on a full bus each frame brings 11 recessive bits of the 128 times that are needed", "[unit][can_bus]") {
  Line line;
  line.hurt(a, 32);
  line.put(a, frame_of(0x100));
  line.run(20ms);
  line.events.clear();
  line.bus.restart(a, line.now);
  for (int count = 0; count < 200; ++count) line.put(b, frame_of(0x200));
  line.run(200ms);
  std::size_t frames_before = 0;
  bool is_back = false;
  for (const BusEvent& event : line.events) {
    is_back = is_back || (event.kind == BusEvent::Kind::state && event.station == a);
    if (!is_back && event.kind == BusEvent::Kind::heard) ++frames_before;
  }
  CHECK(is_back);
  CHECK(frames_before == 128);
}

TEST_CASE("a controller with a restart time comes back by itself", "[unit][can_bus]") {
  Line line;
  line.bus.set_restart(a, 100ms);
  line.hurt(a, 32);
  line.put(a, frame_of(0x100));
  line.run(500ms);
  const std::vector<BusEvent> states = line.of(BusEvent::Kind::state);
  REQUIRE(states.size() >= 2);
  const BusEvent& off = states[states.size() - 2];
  CHECK(off.state == ErrorState::bus_off);
  CHECK(off.counters.transmit == 256);
  CHECK(states.back().state == ErrorState::active);
  CHECK(states.back().at >= off.at + 100ms + 128 * 11 * bit);
  CHECK(states.back().at <= off.at + 100ms + 129 * 11 * bit);
}

TEST_CASE("errors of everything for a time: nothing is heard, then all of it", "[unit][can_bus]") {
  Line line;
  const TimePoint ends_at = start + 2ms;
  line.bus.disturb = [ends_at](Station, const CanFrame&, TimePoint now) -> std::optional<WireFault> {
    if (now >= ends_at) return {};
    return WireFault{.hurt = Hurt::sender};
  };
  line.put(a, frame_of(0x100));
  line.put(b, frame_of(0x101));
  line.run(2ms);
  CHECK(line.heard().empty());
  line.run(5ms);
  CHECK(line.heard_ids() == "256 257 ");
}

TEST_CASE("who tries once drops what was lost in an error", "[unit][can_bus]") {
  Line line;
  line.bus.set_one_shot(a, true);
  line.hurt(a, 1);
  line.put(a, frame_of(0x100));
  line.put(a, frame_of(0x101));
  line.run(5ms);
  CHECK(line.heard_ids() == "257 ");
  CHECK(line.of(BusEvent::Kind::dropped).size() == 1);
}

TEST_CASE("a babbler with the strongest identifier leaves the others nothing", "[unit][can_bus]") {
  Line line;
  for (int count = 0; count < 1'000; ++count) line.put(c, {.id = 0x000, .length = 8});
  line.put(a, frame_of(0x080));
  line.run(200ms);
  CHECK(line.bus.waiting(a) == 1);
  CHECK(line.bus.busy(line.now) == 200ms);
  line.run(200ms);
  CHECK(line.bus.waiting(a) == 0);
}

TEST_CASE("a copy of a bus goes on by itself", "[unit][can_bus]") {
  Line line;
  line.put(a, frame_of(0x100));
  line.put(b, frame_of(0x101));
  line.run(100us);
  Line copy = line;
  copy.run(5ms);
  CHECK(copy.heard().size() == 2);
  CHECK(line.heard().empty());
  line.run(5ms);
  CHECK(line.heard().size() == 2);
  CHECK(line.heard()[1].at == copy.heard()[1].at);
}

}  // namespace bmu::test
