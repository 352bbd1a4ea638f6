// Rows 21 to 37 of the catalogue: answers of modules that are lost or changed on their way. After them 108 to 112:
// modules that do not follow commands, or are powered by their own cells.
#include <array>
#include <stdexcept>

#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/catalogue/frames.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr Duration budget = 400ms;

std::function<bool(const WiredPack&)> counts(RejectReason reason, std::uint64_t at_least = 1) {
  return [=](const WiredPack& pack) {
    return pack.core().receive_counts().rejected[static_cast<std::size_t>(reason)] >= at_least;
  };
}

std::uint8_t counter_of(const CanFrame& frame) {
  const bool is_of_sensor = station_of(frame) == Station::sensor;
  return is_of_sensor ? static_cast<std::uint8_t>(frame.data[1] & 0x0FU) : frame.data[6];
}

FrameTest is_from(Station station) {
  return [station](const CanFrame& frame, const WiredPack&) { return station_of(frame) == station; };
}

/// Changes the last module's whole answer to the next POLL, and no other.
Act on_next_answer(const FrameChange& change) {
  return [=](WiredPack& pack) {
    const auto counter = static_cast<std::uint8_t>(pack.poll_counter() + 1);
    changing([=](const CanFrame& frame,
                 const WiredPack& now) { return is_of_last_module(frame, now) && frame.data[6] == counter; },
             change)(pack);
  };
}

/// Damages three of every ten frames of the last module, evenly.
Act damaging_three_in_ten() {
  return [](WiredPack& pack) {
    pack.on_sent = [count = 0](CanFrame& frame, const WiredPack& now) mutable {
      if (is_of_last_module(frame, now) && ++count * 3 % 10 < 3) frame.data[2] ^= 0x10U;
      return Fate{};
    };
  };
}

/// Changes only the last module's next frame.
Act on_next_frame(const FrameChange& change) {
  return [change](WiredPack& pack) {
    pack.on_sent = [change, is_done = false](CanFrame& frame, const WiredPack& now) mutable {
      if (!is_done && is_of_last_module(frame, now)) {
        is_done = true;
        change(frame, now);
      }
      return Fate{};
    };
  };
}

FrameChange count_on(int steps) {
  return [steps](CanFrame& frame, const WiredPack&) {
    reseal(frame, static_cast<std::uint8_t>(counter_of(frame) + steps));
  };
}

FrameChange damage() {
  return [](CanFrame& frame, const WiredPack&) { frame.data[2] ^= 0x10U; };
}

/// Sends the last frames from before now again, in place of the new ones.
Act repeating(const FrameTest& test) {
  return [test](WiredPack& pack) {
    changing(test, [old = pack.last_sent()](CanFrame& frame, const WiredPack&) {
      const auto known = old.find(frame.id);
      if (known != old.end()) frame = known->second;
    })(pack);
  };
}

/// Freezes the counter at its last value; the data goes on.
Act freezing_counter(const FrameTest& test) {
  return [test](WiredPack& pack) {
    changing(test, [old = pack.last_sent()](CanFrame& frame, const WiredPack&) {
      const auto known = old.find(frame.id);
      if (known != old.end()) reseal(frame, counter_of(known->second));
    })(pack);
  };
}

/// A second module with the last one's node number: it sends each frame after the first one's, with other data.
Act twin_of_last_module() {
  return [](WiredPack& pack) {
    pack.on_sent = [](CanFrame& frame, const WiredPack& now) {
      if (!is_of_last_module(frame, now)) return Fate{};
      CanFrame twin = frame;
      twin.data[1] ^= 0x04U;
      reseal(twin, twin.data[6]);
      return Fate{.twin = twin};
    };
  };
}

/// Unsolicited answers of the last module, each 10 ms, with a counter `steps` from that of the last POLL.
Act answers_without_question(int steps) {
  return [steps](WiredPack& pack) {
    pack.each_ms = [steps, ms = 0](WiredPack& now) mutable {
      if (++ms % 10 != 0) return;
      for (const MessageSpec* row : {&internal_bus::status, &internal_bus::cells_1}) {
        CanFrame frame = now.last_sent().at(row->base_id + now.last_node());
        reseal(frame, static_cast<std::uint8_t>(now.poll_counter() + steps));
        now.send_as_stranger(frame);
      }
    };
  };
}

/// Every identifier that is received, with each wrong length, as remote frame and as its extended twin.
Act malformed_frames() {
  return [](WiredPack& pack) {
    pack.each_ms = [ms = 0U](WiredPack& now) mutable {
      ++ms;
      const std::uint32_t node = now.last_node();
      const std::array<std::uint32_t, 8> ids{0x040,        0x041,        0x080, 0x100 + node,
                                             0x140 + node, 0x240 + node, 0x521, 0x522};
      CanFrame frame = data_frame(ids[ms % ids.size()], 8);
      const std::size_t form = ms / ids.size() % 11;
      if (form < 8) frame.length = static_cast<std::uint8_t>(form == frame.length ? 0 : form);
      frame.is_remote = form == 8;
      frame.is_extended = form >= 9;
      if (station_of(frame) == Station::sensor && frame.length == 6) return;  // its correct length
      now.send_as_stranger(frame);
    };
  };
}

/// A module that is not configured answers each POLL.
Act unknown_module() {
  return [](WiredPack& pack) {
    pack.on_sent = [](CanFrame& frame, const WiredPack& now) {
      if (!is_of_last_module(frame, now)) return Fate{};
      CanFrame other = frame;
      other.id += 1;
      reseal(other, other.data[6]);
      return Fate{.twin = other};
    };
  };
}

/// The pack file names the serial number of each module.
void name_modules(CoreConfig& config) {
  constexpr std::uint32_t emulated_serial_base = 1000;
  for (ModuleConfig& module : config.modules) module.serial_number = emulated_serial_base + module.node;
}

/// Balances whenever there is a reason to, open or closed, after a short settling time.
void balance_at_rest(CoreConfig& config) {
  config.balancing.is_enabled = true;
  config.balancing.method = BalancingMethod::ocv;
  config.balancing.requires_closed = false;
  config.balancing.settle = 2s;
}

/// Runs until the last cell is bled.
void bleed_last_cell(WiredPack& pack) {
  pack.apply("pack soc_permille 500; cell $C soc_permille 520");
  const auto is_bled = [](const WiredPack& now) {
    return now.core().watchers().switches.on(now.config().modules.size() - 1) != 0;
  };
  if (!pack.run_until(is_bled, 60s)) throw std::runtime_error("no cell is bled");
}

/// Applies the events and runs for `duration` before the test goes on.
Act lasting(Duration duration, std::string_view events) {
  return [=](WiredPack& pack) {
    pack.apply(events);
    pack.run(duration);
  };
}

std::function<bool(const WiredPack&)> is_still_closed() {
  return [](const WiredPack& pack) { return pack.phase() == Phase::closed; };
}

Act masquerade_as_first() {
  return changing(is_of_last_module,
                  [](CanFrame& frame, const WiredPack& pack) { frame.id = frame.id - pack.last_node() + 1; });
}

}  // namespace

FAULT(21, "a module falls silent", budget,
      {{.what = "a module falls silent",
        .inject = script("module $N silent"),
        .repair = script("module $N talking"),
        .fault = "module_lost",
        .configured = seen::in_module_silence}})

FAULT(22, "all modules fall silent", budget,
      {{.what = "all modules fall silent",
        .inject = losing(is_of_a_module),
        .repair = heal,
        .fault = "module_lost",
        .configured = seen::in_module_silence},
       {.what = "everybody but the master falls silent",
        .inject = losing(is_of_anybody),
        .repair = heal,
        .fault = "pdu_lost",
        .configured = seen::in_pdu_silence}})

FAULT(23, "a module answers with a part of its frames", budget,
      {{.what = "a module's STATUS does not come",
        .inject = losing(is_message(internal_bus::status)),
        .repair = heal,
        .fault = "module_lost",
        .configured = seen::in_module_silence},
       {.what = "three of a module's cells do not come",
        .inject = losing(is_message(internal_bus::cells_1)),
        .repair = heal,
        .fault = "module_lost",
        .configured = seen::in_module_silence},
       {.what = "the last frame of a module's answer does not come",
        .inject = losing(is_message(internal_bus::module)),
        .repair = heal,
        .fault = "module_lost",
        .configured = seen::in_module_silence}})

FAULT(23, "a module answers without its temperatures", budget,
      {{.what = "a module's temperatures do not come",
        .inject = losing(is_message(internal_bus::temp_1)),
        .repair = heal,
        .fault = "temperature_not_measured",
        .configured = seen::in_temperature_silence}})

SLOW_FAULT(24, "a module answers slower than it is asked", budget,
           {{.what = "a module answers 120 ms late",
             .inject = delaying(is_of_last_module, 120ms),
             .repair = heal,
             .fault = "module_lost",
             .configured = seen::in_module_silence,
             .holds = counts(RejectReason::late, 3)},
            {.what = "a module answers 40 ms late, before it is asked again",
             .inject = delaying(is_of_last_module, 40ms),
             .outcome = Outcome::stays_closed}})

FAULT(25, "a counter stands still while the data goes on", budget,
      {{.what = "a module's counter stands still",
        .inject = freezing_counter(is_of_last_module),
        .repair = heal,
        .fault = "module_lost",
        .configured = seen::in_module_silence,
        .holds = counts(RejectReason::late, 10)},
       {.what = "the counter of the power distribution unit stands still",
        .inject = freezing_counter(is_from(Station::pdu)),
        .repair = heal,
        .fault = "pdu_lost",
        .configured = seen::in_pdu_silence,
        .holds = counts(RejectReason::repeated_counter)},
       {.what = "the current sensor's counter stands still",
        .inject = freezing_counter(is_from(Station::sensor)),
        .repair = heal,
        .fault = "current_sensor_lost",
        .configured = seen::in_current_silence,
        .holds = counts(RejectReason::repeated_counter)}})

SLOW_FAULT(26, "a counter jumps", budget,
           {{.what = "one answer of a module with a counter two ahead",
             .inject = on_next_answer(count_on(2)),
             .outcome = Outcome::stays_closed,
             .holds = counts(RejectReason::late)},
            {.what = "one answer of a module with a counter seven back",
             .inject = on_next_answer(count_on(-7)),
             .outcome = Outcome::stays_closed,
             .holds = counts(RejectReason::late)},
            {.what = "all answers of a module with a counter two ahead",
             .inject = changing(is_of_last_module, count_on(2)),
             .repair = heal,
             .fault = "module_lost",
             .configured = seen::in_module_silence},
            {.what = "the counter of the power distribution unit jumps by three, as if two words were lost",
             .inject = changing(is_from(Station::pdu), count_on(2)),
             .outcome = Outcome::stays_closed},
            {.what = "the counter of the power distribution unit jumps by eight",
             .inject = changing(is_from(Station::pdu), count_on(7)),
             .fault = "pdu_opened_by_itself",
             .configured = seen::in_the_next_word},
            {.what = "the counter of the power distribution unit jumps back by two",
             .inject = changing(is_from(Station::pdu), count_on(-3)),
             .fault = "pdu_opened_by_itself",
             .configured = seen::in_the_next_word}})

FAULT(27, "old frames again", budget,
      {{.what = "a module's old answers instead of new ones",
        .inject = repeating(is_of_last_module),
        .repair = heal,
        .fault = "module_lost",
        .configured = seen::in_module_silence,
        .holds = counts(RejectReason::late, 10)},
       {.what = "an old word of the power distribution unit instead of new ones",
        .inject = repeating(is_from(Station::pdu)),
        .repair = heal,
        .fault = "pdu_lost",
        .configured = seen::in_pdu_silence,
        .holds = counts(RejectReason::repeated_counter)}})

SLOW_FAULT(28, "damaged frames", budget,
           {{.what = "one damaged frame of a module",
             .inject = on_next_frame(damage()),
             .outcome = Outcome::stays_closed,
             .holds = counts(RejectReason::wrong_crc)},
            {.what = "one whole answer of a module damaged",
             .inject = on_next_answer(damage()),
             .fault = "module_disturbed",
             .configured = seen::in_damaged_frames,
             .holds = counts(RejectReason::wrong_crc, 3)},
            {.what = "three of ten frames of a module damaged",
             .inject = damaging_three_in_ten(),
             .repair = heal,
             .fault = "module_disturbed",
             .configured = seen::in_damaged_frames},
            {.what = "all frames of a module damaged",
             .inject = script("module $N damaged_frames on"),
             .repair = script("module $N damaged_frames off"),
             .fault = "module_disturbed",
             .configured = seen::in_damaged_frames,
             .holds = counts(RejectReason::wrong_crc, 3)},
            {.what = "all frames of the power distribution unit damaged",
             .inject = script("pdu damaged_frames on"),
             .repair = script("pdu damaged_frames off"),
             .fault = "pdu_lost",
             .configured = seen::in_pdu_silence,
             .holds = counts(RejectReason::wrong_crc)}})

FAULT(29, "a module's frames under another module's identifiers", budget,
      {{.what = "the last module's frames under the first one's identifiers",
        .inject = masquerade_as_first(),
        .repair = heal,
        .fault = "module_disturbed",
        .configured = seen::in_damaged_frames,
        .holds = [](const WiredPack& pack) {
          const FaultState& disturbed = pack.core().faults().state(find_fault("module_disturbed")->id);
          return counts(RejectReason::wrong_crc, 3)(pack) && disturbed.confirmed.element.module_node == 1;
        }}})

FAULT(30, "two modules under one node number", budget,
      {{.what = "a second module answers under a node number",
        .inject = twin_of_last_module(),
        .repair = heal,
        .fault = "duplicate_node",
        .configured = seen::in_two_answers,
        .holds = counts(RejectReason::conflicting)}})

SLOW_FAULT(31, "a module nobody configured", 1s,
           {{.what = "a module nobody configured begins to answer: told",
             .inject = unknown_module(),
             .fault = "unknown_module",
             .configured = seen::in_two_answers,
             .until = Until::told,
             .has_way_back = false},
            {.what = "a module nobody configured begins to answer: a closed pack",
             .inject = unknown_module(),
             .fault = "unknown_module",
             .outcome = Outcome::stays_closed},
            {.what = "a module nobody configured answers from the start",
             .inject = unknown_module(),
             .fault = "unknown_module",
             .outcome = Outcome::never_closes}})

FAULT(32, "a module is missing at start", 0ms,
      {{.what = "a module is missing at start",
        .inject = script("module $N silent"),
        .fault = "module_lost",
        .outcome = Outcome::never_closes}})

SLOW_FAULT(33, "a module starts anew", budget,
           {{.what = "a module starts anew and answers the next POLL",
             .inject = script("module $N restart"),
             .outcome = Outcome::stays_closed},
            {.what = "a module starts anew and is away for 600 ms",
             .inject = for_a_while("module $N silent; module $N restart", 600ms, "module $N talking"),
             .fault = "module_lost",
             .configured = seen::in_module_silence}})

SLOW_FAULT(34, "frames of a wrong form under our identifiers", 0ms,
           {{.what = "wrong lengths, remote frames, extended twins",
             .inject = malformed_frames(),
             .outcome = Outcome::stays_closed,
             .holds = [](const WiredPack& pack) {
               return counts(RejectReason::wrong_length, 100)(pack) && counts(RejectReason::wrong_form, 100)(pack);
             }}})

SLOW_FAULT(35, "answers nobody asked for", budget,
           {{.what = "a silent module, and a stranger who answers for it unasked",
             .inject = all({script("module $N silent"), answers_without_question(-3)}),
             .repair = all({script("module $N talking"), heal}),
             .fault = "module_lost",
             .configured = seen::in_module_silence,
             .holds = counts(RejectReason::late, 10)},
            {.what = "answers nobody asked for, beside the right ones",
             .inject = answers_without_question(-3),
             .outcome = Outcome::stays_closed,
             .holds = counts(RejectReason::late, 10)}})

FAULT(36, "a module reports a fault of its own", 450ms,
      {{.what = "a module's front end fails its self-test",
        .inject = script("module $N self_test failed"),
        .repair = script("module $N self_test ok"),
        .fault = "module_reports_fault",
        .configured = seen::in_module_status},
       {.what = "a module says that a cell is beyond its limit",
        .inject = forging(is_message(internal_bus::status),
                          [](CanFrame& frame, const WiredPack&) {
                            write<internal_bus::status, "overvoltage_cells">(frame, 1);
                          }),
        .repair = heal,
        .fault = "module_reports_fault",
        .configured = seen::in_module_status},
       {.what = "a module says that a measuring wire is off",
        .inject = forging(is_message(internal_bus::status),
                          [](CanFrame& frame, const WiredPack&) {
                            write<internal_bus::status, "open_cell_wire">(frame, 1);
                          }),
        .repair = heal,
        .fault = "open_wire",
        .configured = seen::in_module_status}})

FAULT(
    37, "a module that is not the one configured", 400ms,
    {{.what = "a module speaks another version of the protocol",
      .inject = forging(is_message(internal_bus::ident),
                        [](CanFrame& frame, const WiredPack&) {
                          write<internal_bus::ident, "protocol_version">(frame, 2);
                        }),
      .fault = "module_mismatch",
      .outcome = Outcome::never_closes},
     {.what = "a module has one cell less",
      .inject = forging(is_message(internal_bus::status),
                        [](CanFrame& frame, const WiredPack& pack) {
                          const auto& last = pack.config().modules[pack.config().modules.size() - 1];
                          write<internal_bus::status, "cell_count">(frame, last.cell_count - 1);
                        }),
      .fault = "wrong_cell_count",
      .outcome = Outcome::never_closes},
     {.what = "a module has one temperature sensor more",
      .inject = script("module $N temperature_sensor_count 5"),
      .fault = "module_mismatch",
      .outcome = Outcome::never_closes},
     {.what = "a module has another serial number than the pack file names",
      .inject = script("module $N serial_number 5555"),
      .fault = "module_exchanged",
      .outcome = Outcome::never_closes,
      .fit = name_modules},
     {.what = "a module is exchanged in an open pack",
      .inject = script("module $N serial_number 5555; module $N restart"),
      .fault = "module_exchanged",
      .configured = seen::in_an_identity,
      .until = Until::told,
      .in_phase = Phase::open,
      .has_way_back = false},
     {.what = "a module is exchanged in a closed pack",
      .inject = script("module $N serial_number 5555; module $N restart"),
      .fault = "duplicate_node",
      .configured = seen::in_an_identity,
      .has_way_back = false},
     {.what = "two modules have each other's serial numbers",
      .inject = script("module 1 serial_number 1002; module 2 serial_number 1001"),
      .fault = "modules_swapped",
      .outcome = Outcome::never_closes,
      .fit = name_modules},
     {.what = "two modules change places in an open pack",
      .inject = script("module 1 serial_number 1002; module 2 serial_number 1001; module 1 restart; module 2 restart"),
      .fault = "modules_swapped",
      .configured = seen::in_an_identity,
      .until = Until::told,
      .in_phase = Phase::open,
      .has_way_back = false}})

SLOW_FAULT(108, "a module never takes its limits", 2500ms,
           {{.what = "a module obeys no command from the start",
             .inject = script("module $N commands ignored"),
             .fault = "module_not_set_up",
             .outcome = Outcome::never_closes},
            {.what = "a module of a closed pack starts anew and obeys no command",
             .inject = script("module $N commands ignored; module $N restart"),
             .fault = "module_not_set_up",
             .configured = seen::in_limits_not_taken,
             .until = Until::told,
             .has_way_back = false,
             .holds = is_still_closed()}})

SLOW_FAULT(109, "a balancing switch stays on", 3500ms,
           {{.what = "a balancing switch has been on for 4 s when the key is turned",
             .inject = lasting(1500ms, "cell $C balancing_switch stays_on"),
             .fault = "balancing_stays_on",
             .outcome = Outcome::never_closes},
            {.what = "a balancing switch of a closed pack goes on by itself and stays on",
             .inject = script("cell $C balancing_switch stays_on"),
             .fault = "balancing_stays_on",
             .configured = seen::in_a_balancing_switch,
             .until = Until::told,
             .has_way_back = false,
             .holds = is_still_closed()}})

SLOW_FAULT(110, "a balancing switch stays off", 3500ms,
           {{.what = "the switch of a cell that is bled goes off and stays off",
             .inject = script("cell $C balancing_switch stays_off"),
             .fault = "balancing_stays_off",
             .configured = seen::in_a_balancing_switch,
             .until = Until::told,
             .in_phase = Phase::open,
             .prepare = bleed_last_cell,
             .fit = balance_at_rest,
             .has_way_back = false}})

FAULT(111, "a module is left to its own cells", 850ms,
      {{.what = "the external supply of a module of a closed pack fails: it is silent",
        .inject = script("module $N external_supply_mV 0"),
        .repair = script("module $N external_supply_mV 12000"),
        .fault = "module_lost",
        .configured = seen::in_module_silence},
       {.what = "the external supply of a module fails whose cells feed its CAN side, too",
        .inject = script("module $N talks_on_own_supply on; module $N external_supply_mV 0"),
        .repair = script("module $N external_supply_mV 12000"),
        .fault = "module_supply_lost"}})

FAULT(112, "a front end reports a fault of its own", 450ms,
      {{.what = "a front end reports undervoltage of its supply",
        .inject = script("module $N front_end_supply_low on"),
        .repair = script("module $N front_end_supply_low off"),
        .fault = "front_end_supply_low",
        .is_kept_by_module = true,
        .configured = seen::in_module_status},
       {.what = "a front end reports its thermal shutdown",
        .inject = script("module $N front_end_thermal_shutdown on"),
        .repair = script("module $N front_end_thermal_shutdown off"),
        .fault = "front_end_overtemperature",
        .is_kept_by_module = true,
        .configured = seen::in_module_status}})

}  // namespace bmu::test
