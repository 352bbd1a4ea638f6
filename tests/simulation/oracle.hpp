// Checks a simulated run by its observable behaviour: the frames on the bus, the contacts, voltages and inputs of the
// emulated pack, and the values that the core publishes. It computes nothing in the way of the core and uses none of
// its state; of a fault it uses the cause in the emulated pack, and of a reaction the time that the catalogue allows.
//
// The rules, by the time at which each is checked:
//
//   with every decision
//     permission        nothing is commanded closed without the permission that is published
//     fresh             nothing is commanded closed, nor a closing started, on values older than their age, by their
//                       real reception
//     edge              a closing has a turn of the key, or of the charger, after the last opening for a reason, start
//                       or gap
//     pause             2 s between an opening and a closing, 10 s after one for a reason
//     healthy           no closing starts while main positive is closed already: it is welded
//     precharge         main positive is commanded only when the DC link is charged, by its real voltage
//     counter           the commands' counter goes on by one, and none is missing
//     wakes             the next tick is requested within a tick
//     gate              the output gate of the core never has to refuse a frame
//     soc               the published state of charge does not jump
//     totals            charge, energy and wear never go back, nor after a power cut below the saved values
//     published         no stale value is sent to the vehicle as valid
//     reason            a closed pack with a request opens for a fault only
//     asks, allows,     commands to a charger or an inverter: flow_oracle.hpp
//     withdraws, silence
//   every millisecond
//     in_time           a fault that must open the pack opens it in time, and keeps it open
//     contacts          the contacts are open soon after nothing is commanded closed
//     stops, withdraws  commands that a charger or an inverter has received
//   at the end
//     recovery          with all faults gone, cleared, and the key turned or the charger plugged in again it closes; a
//                       charger charges then, and goes on after a power cut, and an inverter is allowed something
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/simulation/flow_oracle.hpp"
#include "tests/simulation/heard.hpp"
#include "tests/simulation/plan.hpp"
#include "tests/simulation/rules.hpp"
#include "tests/simulation/soc_watch.hpp"

namespace bmu::test {

struct Violation {
  Rule rule{};
  Duration at{};  // since the start
  std::string text;
};

[[nodiscard]] View view_of(const Core& core);

/// Time that a fault took to open a pack that was closed when it started.
struct TimedOpening {
  const FaultKind* kind = nullptr;
  Duration took{};
};

class Oracle {
 public:
  Oracle(const CoreConfig& config, TimePoint started_at);

  // Events, in their order.
  void note_sent(const CanFrame& frame, TimePoint now) { heard_.note_sent(frame, now); }
  void note_told(const ObservedThing& what, TimePoint now);
  void note_carried(const CanFrame& frame, bool is_taken_in, TimePoint now) {
    flow_.note_carried(frame, is_taken_in, now);
  }
  void note_decided(const Decisions& decisions, const View& view, const Stage& stage);
  void note_millisecond(const Stage& stage);
  void note_begin(const FaultEvent& fault, const Stage& stage);
  void note_end(const FaultEvent& fault, TimePoint now);
  /// A core starts, with its saved state.
  void note_boot(const PersistentState& kept, TimePoint now);
  void note_no_recovery(const std::string& why, TimePoint now) { blame(Rule::recovery, now, why); }

  /// The first; later ones usually follow from it.
  [[nodiscard]] const std::optional<Violation>& violation() const { return violation_; }
  [[nodiscard]] const std::vector<TimedOpening>& reactions() const { return reactions_; }
  [[nodiscard]] std::uint64_t times_closed() const { return times_closed_; }
  [[nodiscard]] std::uint64_t times_opened() const { return times_opened_; }

 private:
  struct Present {
    const FaultEvent* fault = nullptr;
    TimePoint began_at{};
    TimePoint due_at{};
    TimePoint driving_since{};  // zero: not requested by the vehicle alone
    bool was_closed = false;    // when it started
    bool was_hidden = false;
    bool has_opened = false;
    bool has_ended = false;  // kept for the reaction to its end
  };
  struct Line {
    bool is_on = false;
    TimePoint turned_on_at{};
    TimePoint turned_off_at{};

    /// True if it fell.
    bool follow(bool is_on_now, TimePoint now);
  };

  void blame(Rule rule, TimePoint now, const std::string& text);
  void require(bool holds, Rule rule, TimePoint now, const std::string& text) {
    if (!holds) blame(rule, now, text);
  }

  // with every decision
  void check_commanded(const View& view, const ContactorOutputs& outputs, const Stage& stage);
  void check_begin_of_closing(TimePoint now);
  void follow_resumed(TimePoint now);
  void check_main_positive(const Stage& stage, TimePoint now);
  void note_opening(const Stage& stage, TimePoint now);
  void check_frames(const Decisions& decisions, const View& view, TimePoint now);
  void check_soc(const View& view, TimePoint now);
  void check_totals(const View& view, TimePoint now);
  void check_flow(const Decisions& decisions, const View& view, const Stage& stage, bool was_away);
  void check_published(const CanFrame& frame, TimePoint now);
  // every millisecond
  void follow_lines(const Stage& stage);
  void check_fault(Present& present, const Stage& stage);
  void check_contacts(const Stage& stage);

  [[nodiscard]] bool is_hidden(const FaultEvent* except, TimePoint now) const;
  [[nodiscard]] bool must_be_open(Present& present, const Stage& stage) const;
  [[nodiscard]] bool is_quiet() const;
  [[nodiscard]] bool is_present(std::string_view group) const;
  [[nodiscard]] bool is_wanted() const { return vehicle_.is_on || charger_.is_on; }

  const CoreConfig* config_;
  TimePoint started_at_;
  Heard heard_;
  FlowOracle flow_;
  std::optional<Violation> violation_;
  std::vector<TimedOpening> reactions_;
  std::uint64_t times_closed_ = 0;
  std::uint64_t times_opened_ = 0;

  std::vector<Present> present_;
  TimePoint quiet_since_;            // no fault that may open since then
  TimePoint hidden_at_{};            // the last time at which something was hidden
  const FaultEvent* hid_ = nullptr;  // and the fault that hid it
  TimePoint flooded_at_{};           // the last time at which the bus was full
  Line vehicle_;
  Line charger_;
  TimePoint line_fell_at_{};
  TimePoint main_closed_since_{};  // by the contacts; zero: it is open

  ContactorOutputs before_;  // commanded with the last decision
  TimePoint decided_at_;
  TimePoint closed_at_{};  // the last decision with anything closed
  TimePoint edge_needed_since_;
  TimePoint may_close_at_;
  TimePoint request_over_at_{};
  std::optional<std::uint8_t> command_counter_;
  TimePoint command_at_{};
  bool was_port_down_ = false;  // since the last command

  SocWatch soc_;
  std::optional<double> soc_kept_permille_;  // restored at the start, until the first published value
  std::uint64_t forged_before_ = 0;
  PackTotals totals_;
  ContactorLedgerEntries wear_{};
};

}  // namespace bmu::test
