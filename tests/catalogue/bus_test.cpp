// Rows 38 to 58 of the catalogue: the bus and the interface to it, as far as the core can detect their faults.
#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/core/plausibility/bus_watch.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/catalogue/catalogue.hpp"
#include "tests/catalogue/frames.hpp"
#include "tests/support/catch.hpp"

namespace bmu::test {
namespace {

constexpr Duration link_budget = 100ms;
constexpr Duration communication_budget = 400ms;
constexpr Duration dead_man_budget = 300ms;

// The kernel's CAN_ERR_* classes.
constexpr std::uint32_t controller_problem = 0x004;
constexpr std::uint32_t protocol_violation = 0x008;
constexpr std::uint32_t bus_off = 0x040;
constexpr std::uint32_t restarted = 0x100;

void port_down(WiredPack& pack) {
  pack.set_port(false);
}
void port_up(WiredPack& pack) {
  pack.set_port(true);
}

/// Down now, up again after `duration`.
Act port_away(Duration duration) {
  return [duration](WiredPack& pack) {
    pack.set_port(false);
    const TimePoint ends_at = pack.now() + duration;
    pack.each_ms = [ends_at](WiredPack& now) {
      if (now.now() >= ends_at) now.set_port(true);
    };
  };
}

void goes_bus_off(WiredPack& pack) {
  pack.is_swallowing = true;
  pack.observe(BusErrorSeen{Port::internal, bus_off});
}
void comes_back(WiredPack& pack) {
  heal(pack);
  pack.observe(BusErrorSeen{Port::internal, restarted});
}

void swallows(WiredPack& pack) {
  pack.is_swallowing = true;
}
void is_alone(WiredPack& pack) {
  losing(is_of_anybody)(pack);
  pack.set_acknowledged(false);
}
void fails_to_send(WiredPack& pack) {
  pack.sends_fail = true;
}
void loses_its_wire(WiredPack& pack) {
  pack.is_cut = true;
}

/// Sends fail for `failing_ms` of each `period_ms`.
Act fails_to_send_at_times(int failing_ms, int period_ms) {
  return [=](WiredPack& pack) {
    pack.each_ms = [=, ms = 0](WiredPack& now) mutable { now.sends_fail = ms++ % period_ms < failing_ms; };
  };
}

Act errors(std::uint32_t classes, int each_ms, int at_once) {
  return [=](WiredPack& pack) {
    pack.each_ms = [=, ms = 0](WiredPack& now) mutable {
      for (int count = 0; ms % each_ms == 0 && count < at_once; ++count) {
        now.observe(BusErrorSeen{Port::internal, classes});
      }
      ++ms;
    };
  };
}

Act flooded_with(std::uint32_t id) {
  return [id](WiredPack& pack) {
    CanFrame frame = data_frame(id, 8);
    frame.data.fill(0x55);
    pack.flood = frame;
  };
}

CanFrame poll_of_a_stranger() {
  CanFrame frame = make_frame(internal_bus::poll);
  write<internal_bus::poll, "want_status">(frame, 1);
  seal(internal_bus::poll, 200, frame);
  return frame;
}

CanFrame command_of_a_stranger() {
  CanFrame frame = make_frame(internal_bus::command, 1);
  write<internal_bus::command, "operation">(frame, 4);
  seal(internal_bus::command, 200, frame);
  return frame;
}

/// A frame of 620h to 628h, here 622h, from another node on the vehicle's bus.
void foreign_report(WiredPack& pack) {
  pack.observe(FrameReceived{Port::vehicle, data_frame(0x622, 8)});
}

void has_been_bus_off_twice(WiredPack& pack) {
  for (int time = 0; time < 2; ++time) {
    goes_bus_off(pack);
    pack.run(100ms);
    comes_back(pack);
    pack.run(2500ms);
  }
}

/// Every frame sent within `duration` is lost for the core, which is notified of lost frames.
Act loses_frames_for(Duration duration) {
  return [duration](WiredPack& pack) {
    const TimePoint ends_at = pack.now() + duration;
    losing([ends_at](const CanFrame&, const WiredPack& now) { return now.now() < ends_at; })(pack);
    pack.observe(FramesLost{Port::internal, 50});
  };
}

}  // namespace

FAULT(38, "somebody else sends the pack's reports", link_budget,
      {{.what = "a stranger sends 622h on the vehicle's bus: told",
        .inject = foreign_report,
        .fault = "foreign_reporter",
        .configured = seen::in_the_next_tick,
        .until = Until::told,
        .has_way_back = false},
       {.what = "a stranger sends 622h on the vehicle's bus: a closed pack",
        .inject = foreign_report,
        .fault = "foreign_reporter",
        .outcome = Outcome::stays_closed}})

FAULT(39, "somebody else sends what only the master may send", link_budget,
      {{.what = "a contactor command of a second master: open",
        .inject = strange(contactor_command_frame({}, 200)),
        .fault = "foreign_master",
        .configured = seen::in_a_line},
       {.what = "a contactor command of a second master: closed",
        .inject = strange(contactor_command_frame({.main_positive = true, .main_negative = true}, 200)),
        .fault = "foreign_master",
        .configured = seen::in_a_line},
       {.what = "a POLL of a second master",
        .inject = strange(poll_of_a_stranger()),
        .fault = "foreign_master",
        .configured = seen::in_a_line},
       {.what = "a COMMAND of a second master",
        .inject = strange(command_of_a_stranger()),
        .fault = "foreign_master",
        .configured = seen::in_a_frame_behind_all}})

FAULT(40, "the interface goes down", link_budget,
      {{.what = "the interface goes down",
        .inject = port_down,
        .repair = port_up,
        .fault = "internal_bus_down",
        .configured = seen::in_the_next_tick,
        .until = Until::decision}})

FAULT(40, "the interface is down, and the unit hears nobody", dead_man_budget,
      {{.what = "the interface goes down: the contactors",
        .inject = port_down,
        .repair = port_up,
        .fault = "internal_bus_down",
        .configured = seen::in_the_unit_alone,
        .until = Until::coils,
        .has_way_back = false}})

FAULT(41, "the interface is gone and comes back", link_budget,
      {{.what = "the interface is gone for a second",
        .inject = port_away(1s),
        .fault = "internal_bus_down",
        .configured = seen::in_the_next_tick,
        .until = Until::decision}})

FAULT(42, "the interface is missing at start", 0ms,
      {{.what = "the interface is missing at start",
        .inject = port_down,
        .fault = "internal_bus_down",
        .outcome = Outcome::never_closes}})

FAULT(43, "an interface that is there and carries nothing", 0ms,
      {{.what = "every send fails from the start, and nothing comes",
        .inject = all({fails_to_send, losing(is_of_anybody)}),
        .fault = "module_lost",
        .outcome = Outcome::never_closes}})

FAULT(44, "bus-off", link_budget,
      {{.what = "bus-off, told by an error frame",
        .inject = goes_bus_off,
        .repair = comes_back,
        .fault = "internal_bus_down",
        .configured = seen::in_the_next_tick,
        .until = Until::decision}})

FAULT(45, "bus-off again and again", link_budget,
      {{.what = "bus-off for the third time in a minute",
        .inject = goes_bus_off,
        .repair =
            [](WiredPack& pack) {
              comes_back(pack);
              pack.run(BusWatch::storm_span);
            },
        .fault = "bus_off_storm",
        .configured = seen::in_the_next_tick,
        .until = Until::decision,
        .prepare = has_been_bus_off_twice}})

FAULT(46, "bus-off, and every send succeeds", communication_budget,
      {{.what = "sends succeed and nothing is on the bus",
        .inject = swallows,
        .repair = heal,
        .fault = "pdu_lost",
        .or_any_silence = true,
        .configured = seen::in_missing_echoes,
        .until = Until::decision}})

FAULT(47, "error passive is told", 1s,
      {{.what = "the controller becomes error passive",
        .inject =
            [](WiredPack& pack) {
              pack.observe(BusErrorSeen{Port::internal, controller_problem, 0x20});
            },
        .fault = "bus_error_passive",
        .configured = seen::in_the_next_tick,
        .until = Until::told,
        .has_way_back = false}})

FAULT(47, "error passive", 0ms,
      {{.what = "the controller tells of error passive every 100 ms",
        .inject = errors(controller_problem, 100, 1),
        .outcome = Outcome::stays_closed}})

FAULT(48, "nobody acknowledges", communication_budget,
      {{.what = "alone on the bus: nothing comes, nobody acknowledges",
        .inject = is_alone,
        .repair = heal,
        .fault = "pdu_lost",
        .or_any_silence = true,
        .configured = seen::in_missing_echoes,
        .until = Until::decision}})

FAULT(49, "the send queue stays full", communication_budget,
      {{.what = "the system takes no frame any more",
        .inject = fails_to_send,
        .repair = heal,
        .fault = "command_not_on_bus",
        .or_any_silence = true,
        .configured = seen::in_missing_echoes,
        .until = Until::decision,
        .is_seen_open = false}})

FAULT(50, "sends fail for moments", 0ms,
      {{.what = "the system takes no frame for 60 ms of each 300",
        .inject = fails_to_send_at_times(60, 300),
        .outcome = Outcome::stays_closed,
        .holds = [](const WiredPack& pack) { return pack.core().port(Port::internal).sends_failed > 5; }}})

FAULT(51, "a babbling idiot", communication_budget,
      {{.what = "identifier 0 fills the bus",
        .inject = flooded_with(0x000),
        .repair = heal,
        .fault = "pdu_lost",
        .or_any_silence = true,
        .configured = seen::in_missing_echoes,
        .until = Until::decision}})

SLOW_FAULT(52, "a flood of identifiers that are listened to", communication_budget,
           {{.what = "damaged frames of the unit's identifier fill the bus",
             .inject = flooded_with(0x041),
             .repair = heal,
             .fault = "current_sensor_lost",
             .configured = seen::in_current_silence,
             .until = Until::decision},
            {.what = "damaged answers of a module nobody has fill what is left of the bus",
             .inject = flooded_with(0x3BF),
             .repair = heal,
             .fault = "current_sensor_lost",
             .configured = seen::in_current_silence},
            {.what = "wrong results under the sensor's last identifier fill what is left of the bus",
             .inject = flooded_with(0x528),
             .outcome = Outcome::stays_closed}})

FAULT(53, "received frames are lost on this machine", communication_budget,
      {{.what = "the daemon is stopped for 200 ms, its receive queue runs over",
        .inject = [](WiredPack& pack) { pack.stall(200ms); },
        .fault = "control_loop_gap"},
       {.what = "all frames of 60 ms are lost in the receive queue",
        .inject = loses_frames_for(60ms),
        .outcome = Outcome::stays_closed,
        .holds = [](const WiredPack& pack) { return pack.core().port(Port::internal).frames_lost == 50; }}})

FAULT(54, "a flood of error frames", 0ms,
      {{.what = "five error frames a millisecond",
        .inject = errors(protocol_violation, 1, 5),
        .outcome = Outcome::stays_closed,
        .holds = [](const WiredPack& pack) { return pack.core().port(Port::internal).error_frames > 5'000; }}})

FAULT(55, "a wrong bit rate", 0ms,
      {{.what = "nothing but errors from the start",
        .inject = all({is_alone, errors(protocol_violation, 1, 5)}),
        .fault = "module_lost",
        .outcome = Outcome::never_closes}})

FAULT(56, "somebody takes the interface down and up again", link_budget,
      {{.what = "the interface is down for 20 ms",
        .inject = port_away(20ms),
        .fault = "internal_bus_down",
        .configured = seen::in_the_next_tick,
        .until = Until::decision}})

FAULT(57, "the wire is cut behind an interface that knows nothing of it", communication_budget,
      {{.what = "own frames come back, and nobody else's",
        .inject = loses_its_wire,
        .repair = heal,
        .fault = "pdu_lost",
        .or_any_silence = true,
        .configured = seen::in_pdu_silence,
        .until = Until::decision},
       {.what = "own frames come back, and nobody else's: the contactors",
        .inject = loses_its_wire,
        .repair = heal,
        .fault = "pdu_lost",
        .configured = seen::in_the_unit_alone,
        .until = Until::coils,
        .has_way_back = false}})

FAULT(58, "frames are delayed", communication_budget,
      {{.what = "everything comes 300 ms late",
        .inject = [](WiredPack& pack) { pack.latency = 300ms; },
        .repair = heal,
        .fault = "pdu_lost",
        .or_any_silence = true,
        .configured = seen::in_missing_echoes,
        .is_seen_open = false}})

}  // namespace bmu::test
