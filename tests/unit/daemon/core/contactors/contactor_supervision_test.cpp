// Transmission of contactor commands and feedback of the contacts: command_link and contactor_watch at their exact
// limits.
#include "daemon/core/contactors/command_link.hpp"
#include "daemon/core/contactors/contactor_watch.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

constexpr TimePoint start{10s};

/// Command path with an echoed first command; the second is due 10 ms after `start`.
CommandLink echoed_link() {
  CommandLink link;
  link.note_sent(1, start);
  link.note_echo(1);
  return link;
}

ContactorOutputs only(std::size_t contactor) {
  return {.main_positive = contactor == 0,
          .main_negative = contactor == 1,
          .precharge = contactor == 2,
          .charge = contactor == 3};
}

Measured<PduState> word(const ContactorOutputs& closed, TimePoint taken_at) {
  return {.value = {.main_positive_closed = closed.main_positive,
                    .main_negative_closed = closed.main_negative,
                    .precharge_closed = closed.precharge,
                    .charge_closed = closed.charge},
          .taken_at = taken_at,
          .validity = Validity::valid};
}

/// One contactor commanded at `start`; each test supplies the feedback.
class WatchBench {
 public:
  explicit WatchBench(std::size_t contactor) : contactor_(contactor) {
    watch_.init(start - 10s);
    (void)word_at(start - 9s, false);
    (void)word_at(start - 8s, false);
    watch_.command(only(contactor_), start);
  }
  /// Whether a PDU status with this feedback is a mismatch; received and checked at the same instant.
  [[nodiscard]] bool word_at(TimePoint at, bool is_closed) {
    return static_cast<bool>(watch_.disobeys(word(is_closed ? only(contactor_) : ContactorOutputs{}, at), config_, at));
  }
  [[nodiscard]] ContactorWatch& watch() { return watch_; }

 private:
  std::size_t contactor_;
  ContactorConfig config_{.settle = 100ms, .feedback_timeout = 300ms};
  ContactorWatch watch_;
};

}  // namespace

TEST_CASE("a command is due at once, the second a tick later, and then every 50 ms", "[unit][command_link]") {
  CommandLink link;
  CHECK(link.is_due(start, false));
  link.note_sent(1, start);
  CHECK_FALSE(link.is_due(start + 10ms - 1ns, false));
  CHECK(link.is_due(start + 10ms, false));
  link.note_echo(1);
  link.note_sent(2, start + 10ms);
  CHECK_FALSE(link.is_due(start + 60ms - 1ns, false));
  CHECK(link.is_due(start + 60ms, false));
}

TEST_CASE("a command sent late does not shift the next one, unless it is a whole period late", "[unit][command_link]") {
  CommandLink late = echoed_link();
  late.note_sent(2, start + 60ms - 1ns);  // due at 10 ms
  late.note_echo(2);
  CHECK_FALSE(late.is_due(start + 60ms - 1ns, false));
  CHECK(late.is_due(start + 60ms, false));
  CommandLink too_late = echoed_link();
  too_late.note_sent(2, start + 60ms);
  too_late.note_echo(2);
  CHECK_FALSE(too_late.is_due(start + 100ms - 1ns, false));
  CHECK(too_late.is_due(start + 100ms, false));
}

TEST_CASE("a changed command goes out at once, and the next one with the tick before a period has passed",
          "[unit][command_link]") {
  CommandLink link = echoed_link();
  CHECK(link.is_due(start + 3ms, true));
  link.note_sent(2, start + 3ms);
  link.note_echo(2);
  CHECK_FALSE(link.is_due(start + 43ms - 1ns, false));
  CHECK(link.is_due(start + 43ms, false));
}

TEST_CASE("two commands wait at most, until 500 ms without an echo", "[unit][command_link]") {
  CommandLink link = echoed_link();
  link.note_sent(2, start + 10ms);
  CHECK(link.is_due(start + 60ms, false));  // one is pending: its echo may be lost in this host
  link.note_sent(3, start + 60ms);
  CHECK_FALSE(link.is_due(start + 110ms, false));
  CHECK(link.is_due(start + 110ms, true));  // the commanded outputs have changed
  CHECK_FALSE(link.is_due(start + 560ms - 1ns, false));
  CHECK(link.is_due(start + 560ms, false));
  link.note_sent(4, start + 560ms);
  CHECK_FALSE(link.is_due(start + 1060ms - 1ns, false));
  CHECK(link.is_due(start + 1060ms, false));
}

TEST_CASE("nothing is queued behind two commands that wait: the next word may have to be open",
          "[unit][command_link]") {
  CommandLink link = echoed_link();
  link.note_sent(2, start + 10ms);
  CHECK_FALSE(link.is_stuck(start + 30ms));
  link.note_sent(3, start + 60ms);
  CHECK(link.is_stuck(start + 60ms));
  link.note_echo(3);
  CHECK_FALSE(link.is_stuck(start + 60ms));
}

TEST_CASE("only the echo of the last command ends the wait", "[unit][command_link]") {
  CommandLink link = echoed_link();
  link.note_sent(2, start + 10ms);
  link.note_sent(3, start + 60ms);
  link.note_echo(2);
  CHECK_FALSE(link.is_due(start + 110ms, false));
  CHECK(link.is_stuck(start + 110ms));
  link.note_echo(3);
  CHECK(link.is_due(start + 110ms, false));
  CHECK_FALSE(link.is_stuck(start + 110ms));
}

TEST_CASE("a command is stuck after more than 20 ms", "[unit][command_link]") {
  CommandLink link;
  CHECK_FALSE(link.is_stuck(start + 1h));
  link.note_sent(7, start);
  CHECK_FALSE(link.is_stuck(start + 20ms));
  CHECK(link.is_stuck(start + 20ms + 1ns));
  SECTION("until its echo") {
    link.note_echo(7);
  }
  SECTION("not when it was not taken") {
    link.note_failed();
  }
  SECTION("not when echoes were lost here") {
    link.note_echoes_lost();
  }
  SECTION("not when the bus and its queue are gone") {
    link.forget();
  }
  CHECK_FALSE(link.is_stuck(start + 1h));
}

TEST_CASE("commands count as being on the bus for 130 ms without an echo", "[unit][command_link]") {
  CommandLink link;
  CHECK_FALSE(link.is_on_bus(start));
  link.note_sent(1, start);
  CHECK_FALSE(link.is_on_bus(start));  // no echo received yet
  link.note_echo(1);
  CHECK(link.is_on_bus(start + 1h));  // no command is pending
  link.note_sent(2, start + 10ms);
  CHECK(link.is_on_bus(start + 140ms));
  CHECK_FALSE(link.is_on_bus(start + 140ms + 1ns));
  link.note_sent(3, start + 60ms);  // a newer command does not reduce the age of the older one
  CHECK(link.is_on_bus(start + 140ms));
  CHECK_FALSE(link.is_on_bus(start + 140ms + 1ns));
  link.note_echo(2);
  CHECK_FALSE(link.is_on_bus(start + 140ms + 1ns));
  link.note_echo(3);
  CHECK(link.is_on_bus(start + 140ms + 1ns));
}

TEST_CASE("an echo of what was never sent is none of ours", "[unit][command_link]") {
  CommandLink link;
  link.note_echo(0);  // counter value before the first command
  CHECK_FALSE(link.is_on_bus(start));
}

TEST_CASE("a command that was not taken is given again at once, and is not on the bus", "[unit][command_link]") {
  CommandLink link = echoed_link();
  link.note_sent(2, start + 10ms);
  link.note_failed();
  CHECK(link.is_due(start + 10ms, false));
  CHECK_FALSE(link.is_on_bus(start + 141ms));
  link.note_sent(3, start + 20ms);
  CHECK_FALSE(link.is_due(start + 20ms, false));
  CHECK_FALSE(link.is_on_bus(start + 141ms));
  link.note_echo(3);
  CHECK(link.is_on_bus(start + 141ms));
}

TEST_CASE("after the bus was away the link knows nothing of before", "[unit][command_link]") {
  CommandLink link = echoed_link();
  link.forget();
  CHECK_FALSE(link.is_on_bus(start));
  CHECK(link.is_due(start, false));
}

TEST_CASE("a contactor has its time to follow, by the unit's word and not by our clock", "[unit][contactors]") {
  const ContactorConfig config{.settle = 100ms, .feedback_timeout = 300ms};
  for (std::size_t contactor = 0; contactor < 4; ++contactor) {
    WatchBench bench(contactor);
    CHECK_FALSE(bench.word_at(start + 300ms - 1ns, false));
    CHECK_FALSE(bench.watch().disobeys(word({}, start + 300ms - 1ns), config, start + 1h));
    CHECK(bench.word_at(start + 300ms, false));
    CHECK_FALSE(bench.word_at(start + 310ms, true));
  }
}

TEST_CASE("a word from before a command, or from its very moment, says nothing about it", "[unit][contactors]") {
  WatchBench bench(1);
  REQUIRE_FALSE(bench.word_at(start + 20ms, true));
  REQUIRE_FALSE(bench.word_at(start + 120ms, true));
  bench.watch().command({}, start + 200ms);
  CHECK_FALSE(bench.word_at(start + 199ms, true));
  CHECK_FALSE(bench.word_at(start + 200ms, false));
  CHECK_FALSE(bench.word_at(start + 300ms, false));  // the first status that counts
  CHECK_FALSE(bench.watch().is_settled());
  CHECK_FALSE(bench.word_at(start + 400ms, false));
  CHECK(bench.watch().is_settled());
}

TEST_CASE("contacts have settled after following for 100 ms, each of them", "[unit][contactors]") {
  for (std::size_t contactor = 0; contactor < 4; ++contactor) {
    WatchBench bench(contactor);
    CHECK_FALSE(bench.watch().is_settled());
    (void)bench.word_at(start + 20ms, true);
    CHECK_FALSE(bench.watch().is_settled());
    (void)bench.word_at(start + 120ms - 1ns, true);
    CHECK_FALSE(bench.watch().is_settled());
    (void)bench.word_at(start + 120ms, true);
    CHECK(bench.watch().is_settled());
  }
}

TEST_CASE("a contact that lets go after it has settled disobeys at once", "[unit][contactors][F84]") {
  for (std::size_t contactor = 0; contactor < 4; ++contactor) {
    WatchBench bench(contactor);
    (void)bench.word_at(start + 20ms, true);
    (void)bench.word_at(start + 120ms, true);
    CHECK(bench.word_at(start + 130ms, false));
    CHECK_FALSE(bench.watch().is_settled());
    CHECK_FALSE(bench.word_at(start + 140ms, true));
    CHECK(bench.watch().is_settled());
    CHECK(bench.word_at(start + 150ms, false));
  }
}

TEST_CASE("a contact that bounces before it has settled is given the rest of its time", "[unit][contactors]") {
  WatchBench bench(0);
  CHECK_FALSE(bench.word_at(start + 20ms, true));
  CHECK_FALSE(bench.word_at(start + 119ms, false));
  CHECK_FALSE(bench.word_at(start + 120ms, true));  // matching again from here
  CHECK_FALSE(bench.word_at(start + 219ms, true));
  CHECK_FALSE(bench.watch().is_settled());
  CHECK_FALSE(bench.word_at(start + 220ms, true));
  CHECK(bench.watch().is_settled());
}

TEST_CASE("one contact that disobeys is enough, and hides none of the others", "[unit][contactors]") {
  const ContactorConfig config{.settle = 100ms, .feedback_timeout = 300ms};
  const ContactorOutputs mains{.main_positive = true, .main_negative = true};
  ContactorWatch watch;
  watch.init(start);
  watch.command(mains, start);
  CHECK(watch.disobeys(word({.main_negative = true}, start + 300ms), config, start + 300ms));
  CHECK(watch.disobeys(word({.main_positive = true}, start + 310ms), config, start + 310ms));
  CHECK_FALSE(watch.disobeys(word(mains, start + 320ms), config, start + 320ms));
  CHECK_FALSE(watch.is_settled());
  CHECK_FALSE(watch.disobeys(word(mains, start + 420ms - 1ns), config, start + 420ms - 1ns));
  CHECK_FALSE(watch.is_settled());
  CHECK_FALSE(watch.disobeys(word(mains, start + 420ms), config, start + 420ms));
  CHECK(watch.is_settled());
}

TEST_CASE("a command that is repeated, or that changes another contactor, starts no new time", "[unit][contactors]") {
  WatchBench bench(1);
  bench.watch().command({.main_negative = true}, start + 200ms);
  CHECK(bench.word_at(start + 300ms, false));
  bench.watch().command({.main_negative = true, .precharge = true}, start + 310ms);
  CHECK(bench.word_at(start + 320ms, false));
}

TEST_CASE("contacts that another life left closed have their time to open", "[unit][contactors]") {
  const ContactorConfig config{.settle = 100ms, .feedback_timeout = 300ms};
  ContactorWatch watch;
  watch.init(start);
  const ContactorOutputs left_closed{.main_negative = true};
  CHECK_FALSE(watch.disobeys(word(left_closed, start + 300ms - 1ns), config, start + 300ms - 1ns));
  CHECK(watch.disobeys(word(left_closed, start + 300ms), config, start + 300ms));
}

TEST_CASE("the first contactor of each kind that disobeys is told: open against its command, or closed",
          "[unit][contactors]") {
  const ContactorConfig config{.settle = 100ms, .feedback_timeout = 300ms};
  const auto found = [&config](const ContactorOutputs& commanded, const ContactorOutputs& closed) {
    ContactorWatch watch;
    watch.init(start);
    watch.command(commanded, start);
    return watch.disobeys(word(closed, start + 300ms), config, start + 300ms);
  };
  for (std::size_t contactor = 0; contactor < 4; ++contactor) {
    CHECK(found(only(contactor), {}).not_following == contactor + 1);
    CHECK(found(only(contactor), {}).welded == 0);
    CHECK(found({}, only(contactor)).welded == contactor + 1);
    CHECK(found({}, only(contactor)).not_following == 0);
    CHECK(found({}, only(contactor)));
  }
  const ContactorOutputs mains{.main_positive = true, .main_negative = true};
  const ContactorOutputs others{.precharge = true, .charge = true};
  CHECK(found(mains, others).not_following == 1);
  CHECK(found(mains, others).welded == 3);
  CHECK_FALSE(found(mains, mains));
}
