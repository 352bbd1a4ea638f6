#include "tests/simulation/oracle.hpp"

#include <algorithm>
#include <array>

#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/tables/vehicle_bus.hpp"

namespace bmu::test {

namespace {

/// A reaction to a hidden fault may come later by the time for which the hiding one may be undetected itself.
constexpr Duration hidden_for = 500ms;
/// A tick and the frame before it, after an age.
constexpr Duration tick_and_frame = 30ms;
constexpr Duration pause_for_reason = 10s;
constexpr Duration pause_else = 2s;
constexpr Duration played_within = 20s;
/// From a change of an input to the master: a status message of the PDU, and its delays.
constexpr Duration line_known_after = 600ms;
/// The cause of a latched fault, and successive attempts of a precharge, may open later.
constexpr Duration aftermath = 15s;
/// Time after the last decision for it in which a contact may be closed: the command's validity, a period, a frame, the
/// mechanism.
constexpr Duration contact_follows = 320ms;
constexpr double permille = 1e3;

ContactorOutputs only_contactors(ContactorOutputs outputs) {
  outputs.auxiliary = outputs.fan = outputs.heater = false;
  return outputs;
}

bool opens_anything(const FaultKind& kind) {
  return kind.effect != Effect::stays_closed;
}

const World& world_of(const Stage& stage) {
  return stage.pack.simulator().world();
}

std::string why_opened(const OpeningRecord& opening) {
  return std::string(opening.cause == OpeningCause::fault ? row_of(opening.fault).name : to_text(opening.cause));
}

bool never_falls(const PackTotals& before, const PackTotals& now) {
  return now.charge_out_uAs >= before.charge_out_uAs && now.charge_in_uAs >= before.charge_in_uAs &&
         now.energy_out_mWh >= before.energy_out_mWh && now.energy_in_mWh >= before.energy_in_mWh;
}
bool never_falls(const ContactorLedgerEntries& before, const ContactorLedgerEntries& now) {
  return std::equal(before.begin(), before.end(), now.begin(), [](const ContactorWear& old, const ContactorWear& one) {
    return one.closings >= old.closings && one.openings >= old.openings &&
           one.openings_under_load >= old.openings_under_load &&
           one.current_broken_max_mA >= old.current_broken_max_mA &&
           one.current_broken_sum_mA >= old.current_broken_sum_mA;
  });
}

}  // namespace

std::string_view to_text(Rule rule) {
  constexpr std::array<std::string_view, 21> names{"permission", "fresh",   "edge",     "pause", "healthy", "precharge",
                                                   "counter",    "wakes",   "gate",     "soc",   "totals",  "published",
                                                   "reason",     "in_time", "contacts", "asks",  "stops",   "allows",
                                                   "withdraws",  "silence", "recovery"};
  return names[static_cast<std::size_t>(rule)];
}

View view_of(const Core& core) {
  return {.may_stay_closed = core.permission().may_stay_closed,
          .may_charge = core.permission().may_charge,
          .may_discharge = core.permission().may_discharge,
          .charge_mA = std::min(core.limits().charge.limit_mA, core.limits().charge_continuous.limit_mA),
          .discharge_mA = std::min(core.limits().discharge.limit_mA, core.limits().discharge_continuous.limit_mA),
          .outputs = core.outputs(),
          .soc_permille = core.soc_permille(),
          .totals = core.totals(),
          .wear = core.persistent().contactors,
          .gate_refusals = core.gate_refusals(),
          .is_resting = core.rest().is_resting(),
          .is_port_up = core.port(Port::internal).is_up};
}

bool Oracle::Line::follow(bool is_on_now, TimePoint now) {
  const bool fell = is_on && !is_on_now;
  if (is_on_now && !is_on) turned_on_at = now;
  if (fell) turned_off_at = now;
  is_on = is_on_now;
  return fell;
}

Oracle::Oracle(const CoreConfig& config, TimePoint started_at)
    : config_(&config),
      started_at_(started_at),
      heard_(config),
      flow_(config, started_at, [this](Rule rule, TimePoint now, const std::string& text) { blame(rule, now, text); }),
      quiet_since_(started_at),
      decided_at_(started_at),
      edge_needed_since_(started_at),
      may_close_at_(started_at + 2 * config.poll.period),
      soc_(config) {}

void Oracle::blame(Rule rule, TimePoint now, const std::string& text) {
  if (!violation_) violation_ = Violation{rule, now - started_at_, text};
}

void Oracle::note_told(const ObservedThing& what, TimePoint now) {
  const auto* frame = std::get_if<FrameReceived>(&what);
  if (frame != nullptr && frame->port == Port::internal) heard_.note_told(frame->frame, now);
  flow_.note_told(what, now);
}

// --- with every decision --------------------------------------------------------------------------------------------

void Oracle::note_decided(const Decisions& decisions, const View& view, const Stage& stage) {
  const TimePoint now = stage.pack.now();
  const bool was_away = now - decided_at_ > loop_gap_max;
  if (was_away) edge_needed_since_ = now;
  follow_resumed(now);
  check_commanded(view, only_contactors(decisions.outputs), stage);
  check_frames(decisions, view, now);
  check_soc(view, now);
  check_totals(view, now);
  check_flow(decisions, view, stage, was_away);
  require(view.gate_refusals == 0, Rule::gate, now, "a frame of the core's own was refused");
  require(decisions.wake_at > now && decisions.wake_at <= now + tick_period, Rule::wakes, now,
          "the next tick is asked for " + std::to_string(to_ms(decisions.wake_at - now)) + " ms from now");
  decided_at_ = now;
}

void Oracle::check_commanded(const View& view, const ContactorOutputs& outputs, const Stage& stage) {
  const TimePoint now = stage.pack.now();
  const bool is_any = outputs.any_contactor();
  const bool was_any = before_.any_contactor();
  if (is_any) {
    require(view.may_stay_closed, Rule::permission, now, "something is commanded closed without permission");
    const std::string stale = heard_.stale(now, tick_and_frame);
    require(stale.empty(), Rule::fresh, now, "commanded closed though " + stale);
    closed_at_ = now;
  }
  if (is_any && !was_any) check_begin_of_closing(now);
  if (outputs.main_positive && !before_.main_positive) check_main_positive(stage, now);
  if (!is_any && was_any) note_opening(stage, now);
  before_ = outputs;
}

void Oracle::check_begin_of_closing(TimePoint now) {
  const std::string stale = heard_.stale(now, 1ms);
  require(stale.empty(), Rule::fresh, now, "a closing begins though " + stale);
  const auto has_edge = [this](const Line& line) {
    return line.is_on && line.turned_on_at > edge_needed_since_ - line_known_after;
  };
  const bool may_be_deceived = heard_.forged() > 0;  // about the inputs, too
  require(has_edge(vehicle_) || has_edge(charger_) || may_be_deceived, Rule::edge, now,
          "a closing begins though nobody has turned a key since " +
              std::to_string(to_ms(edge_needed_since_ - started_at_)) + " ms");
  require(now >= may_close_at_, Rule::pause, now,
          "a closing begins " + std::to_string(to_ms(may_close_at_ - now)) + " ms too soon");
  const bool is_welded = main_closed_since_ != TimePoint{} && now - main_closed_since_ > line_known_after;
  require(!is_welded, Rule::healthy, now, "a closing begins though main positive is closed");
}

/// A charge that was interrupted by a silence goes on as if its charger had been plugged in again; a pause may still
/// delay it, and the charger may be silent again meanwhile.
void Oracle::follow_resumed(TimePoint now) {
  if (!charger_.is_on || !flow_.may_resume(now)) return;
  charger_.turned_on_at = now;
  flow_.note_resumed();
}

/// By the real voltages, with a margin of two hundredths for the sensors' periods.
void Oracle::check_main_positive(const Stage& stage, TimePoint now) {
  ++times_closed_;
  const Plant& plant = stage.pack.simulator().plant();
  const double share = config_->contactors.precharge_done_permille / permille - 0.02;
  const bool is_deceived = is_present("voltage") || heard_.forged() > 0;
  require(is_deceived || plant.link_V() >= share * plant.pack_V(), Rule::precharge, now,
          "main positive is commanded with the link at " + std::to_string(plant.link_V()) + " V of " +
              std::to_string(plant.pack_V()) + " V");
}

void Oracle::note_opening(const Stage& stage, TimePoint now) {
  const bool was_closed = before_.main_positive || before_.main_negative;
  const bool is_request_over = !is_wanted() || (line_fell_at_ != TimePoint{} && now - line_fell_at_ < line_known_after);
  const bool is_for_reason = before_.main_positive && !is_request_over;
  if (was_closed) ++times_opened_;
  // Only the charger requests a closed pack.
  const bool is_for_silence = !vehicle_.is_on && flow_.is_charger_silent(now);
  require(!is_for_reason || is_for_silence || !is_quiet() || now - quiet_since_ < aftermath, Rule::reason, now,
          "a closed pack opens for nothing; the core says: " + why_opened(stage.pack.core().last_opening()));
  if (is_for_reason) edge_needed_since_ = now;
  const bool is_played_with =
      is_request_over && request_over_at_ != TimePoint{} && now - request_over_at_ <= played_within - line_known_after;
  may_close_at_ = now + (is_for_reason || is_played_with ? pause_for_reason : pause_else);
  if (is_request_over && !is_wanted()) request_over_at_ = now;
}

void Oracle::check_frames(const Decisions& decisions, const View& view, TimePoint now) {
  constexpr Duration command_late = 130ms;  // two may wait for a busy bus; the PDU opens after 200 ms
  for (const OutgoingFrame& out : decisions.frames) {
    if (out.port == Port::vehicle) check_published(out.frame, now);
    if (out.port != Port::internal || out.frame.id != internal_bus::contactor_command.base_id) continue;
    require(!content_fault(internal_bus::contactor_command, out.frame), Rule::counter, now, "a command is malformed");
    require(only_contactors(outputs_of(out.frame)) == only_contactors(decisions.outputs), Rule::permission, now,
            "the command is not what was decided");
    const std::uint8_t counter = out.frame.data[6];
    const auto wanted = static_cast<std::uint8_t>(command_counter_.value_or(counter - 1) + 1);
    require(counter == wanted || was_port_down_, Rule::counter, now,
            "the commands' counter is " + std::to_string(counter) + ", not " + std::to_string(wanted));
    command_counter_ = counter;
    command_at_ = now;
    was_port_down_ = false;
  }
  was_port_down_ = was_port_down_ || !view.is_port_up;
  const bool is_missed = command_at_ != TimePoint{} && now - command_at_ > command_late;
  const bool is_excused = view.is_resting || was_port_down_ || is_hidden(nullptr, now);
  require(!is_missed || is_excused, Rule::counter, now,
          "no command for " + std::to_string(to_ms(now - command_at_)) + " ms");
}

void Oracle::check_soc(const View& view, TimePoint now) {
  if (!view.soc_permille) return soc_.begin_anew();
  const auto told = static_cast<double>(*view.soc_permille);
  const bool is_counted_wrong =
      std::exchange(forged_before_, heard_.forged()) != heard_.forged() || is_present("damage");
  if (soc_kept_permille_ && !is_counted_wrong) {
    constexpr double record_permille = 25.0;  // a record is at most 1 % behind; the remainder may have flowed since
    require(
        std::abs(told - *soc_kept_permille_) <= record_permille, Rule::soc, now,
        "a life begins with " + std::to_string(told) + " where " + std::to_string(*soc_kept_permille_) + " was kept");
  }
  soc_kept_permille_.reset();
  if (is_counted_wrong) soc_.allow_step();
  require(soc_.follow(told, now), Rule::soc, now,
          "the state of charge steps to " + std::to_string(*view.soc_permille) + " permille");
}

void Oracle::check_totals(const View& view, TimePoint now) {
  require(view.totals.has_value(), Rule::totals, now, "nothing is counted");
  require(view.totals && never_falls(totals_, *view.totals), Rule::totals, now, "charge or energy went back");
  require(never_falls(wear_, view.wear), Rule::totals, now, "a contactor's wear went back");
  totals_ = view.totals.value_or(totals_);
  wear_ = view.wear;
}

void Oracle::check_flow(const Decisions& decisions, const View& view, const Stage& stage, bool was_away) {
  const TimePoint now = stage.pack.now();
  const auto is_off_for_long = [now](const Line& line) {
    return !line.is_on && now - line.turned_off_at > line_known_after;
  };
  flow_.note_decided(decisions, {.now = now,
                                 .view = &view,
                                 .stage = &stage,
                                 .outputs = decisions.outputs,
                                 .was_away = was_away,
                                 .is_plugged_in = !is_off_for_long(charger_),
                                 .plugged_since = charger_.is_on ? charger_.turned_on_at : TimePoint{},
                                 .is_key_off = is_off_for_long(vehicle_),
                                 .is_hidden = is_hidden(nullptr, now),
                                 .is_deceived = heard_.forged() > 0});
}

void Oracle::check_published(const CanFrame& frame, TimePoint now) {
  using namespace vehicle_bus;
  const std::uint32_t id = frame.id - config_->vehicle.base_id + default_base_id;
  // An open pack without a request is polled slowly, and may publish received values for two of these periods.
  const Duration seldom = before_.any_contactor() ? Duration{} : 2 * config_->poll.parked_period;
  // Frames that waited in a device for a full bus arrive as if they were new: this is not detectable.
  const bool was_flooded = flooded_at_ != TimePoint{} && now - flooded_at_ <= hidden_for;
  const auto allow = [&](bool is_valid, Heard::Kind kind, std::string_view what) {
    const std::string stale = heard_.stale(now, tick_and_frame + seldom, kind);
    require(!is_valid || stale.empty() || was_flooded, Rule::published, now,
            std::string(what) + " is told as valid though " + stale);
  };
  if (id == pack_voltage.base_id) {
    allow(read<pack_voltage, "pack_voltage_mV">(frame).is_valid(), Heard::Kind::pack_voltage, "the pack voltage");
    allow(read<pack_voltage, "cell_voltage_min_uV">(frame).is_valid(), Heard::Kind::cells, "the lowest cell");
    allow(read<pack_voltage, "cell_voltage_max_uV">(frame).is_valid(), Heard::Kind::cells, "the highest cell");
  } else if (id == pack_current.base_id) {
    allow(read<pack_current, "pack_current_mA">(frame).is_valid(), Heard::Kind::current, "the current");
  } else if (id == pack_temperature.base_id) {
    allow(read<pack_temperature, "cell_temperature_max_dC">(frame).is_valid(), Heard::Kind::temperatures,
          "the hottest cell");
  }
}

// --- faults ---------------------------------------------------------------------------------------------------------

void Oracle::note_begin(const FaultEvent& fault, const Stage& stage) {
  const TimePoint now = stage.pack.now();
  present_.push_back({.fault = &fault,
                      .began_at = now,
                      .due_at = now + fault.kind->allowed,
                      .was_closed = stage.is_alive() && before_.main_positive});
  const bool are_hands_in_it = fault.kind->group == "estop" || fault.kind->group == "interlock";
  if (are_hands_in_it && stage.is_alive() && !is_hidden(&fault, now)) flow_.note_hands();
}

void Oracle::note_end(const FaultEvent& fault, TimePoint now) {
  if (opens_anything(*fault.kind)) quiet_since_ = now;
  const auto found = std::find_if(present_.begin(), present_.end(),
                                  [&fault](const Present& present) { return present.fault == &fault; });
  if (found == present_.end()) return;
  found->has_ended = true;
  if (fault.kind->effect != Effect::opens_at_end) return;
  found->began_at = now;
  found->due_at = now + fault.kind->allowed;
}

/// The restored values are the lower bounds of all counters from now on.
void Oracle::note_boot(const PersistentState& kept, TimePoint now) {
  flow_.note_boot();
  before_ = {};
  command_counter_.reset();
  command_at_ = {};
  decided_at_ = now;
  soc_.begin_anew();
  soc_kept_permille_.reset();
  if (kept.soc.is_kept && !is_present("cell")) soc_kept_permille_ = kept.soc.told_ppm / permille;
  totals_ = kept.totals;
  wear_ = kept.contactors;
  edge_needed_since_ = now;
  may_close_at_ = now + 2 * config_->poll.period;
}

bool Oracle::is_quiet() const {
  return std::none_of(present_.begin(), present_.end(), [](const Present& present) {
    return opens_anything(*present.fault->kind) && !present.has_ended;
  });
}

bool Oracle::is_present(std::string_view group) const {
  return std::any_of(present_.begin(), present_.end(), [group](const Present& present) {
    return present.fault->kind->group == group && !present.has_ended;
  });
}

bool Oracle::is_hidden(const FaultEvent* except, TimePoint now) const {
  if (hid_ != nullptr && hid_ != except && now - hidden_at_ <= hidden_for) return true;
  return std::any_of(present_.begin(), present_.end(), [except](const Present& present) {
    return present.fault != except && present.fault->kind->hides && !present.has_ended;
  });
}

// --- every millisecond ----------------------------------------------------------------------------------------------

void Oracle::note_millisecond(const Stage& stage) {
  const TimePoint now = stage.pack.now();
  follow_lines(stage);
  check_contacts(stage);
  flow_.note_millisecond(stage);
  if (is_present("flood")) flooded_at_ = now;
  for (Present& present : present_) {
    if (present.fault->kind->hides && !present.has_ended) {
      hidden_at_ = now;
      hid_ = present.fault;
    }
    check_fault(present, stage);
  }
  std::erase_if(present_, [now](const Present& present) {
    const bool has_more = present.fault->kind->effect == Effect::opens_at_end && now <= present.due_at;
    return present.has_ended && !has_more;
  });
}

void Oracle::follow_lines(const Stage& stage) {
  const TimePoint now = stage.pack.now();
  const PduInputs& inputs = world_of(stage).inputs;
  const bool vehicle_fell = vehicle_.follow(inputs.vehicle_on, now);
  const bool charger_fell = charger_.follow(inputs.charger_connected, now);
  if (vehicle_fell || charger_fell) line_fell_at_ = now;
  const bool is_main_closed = world_of(stage).plant.is_closed(ContactorName::main_positive);
  if (!is_main_closed) main_closed_since_ = {};
  if (is_main_closed && main_closed_since_ == TimePoint{}) main_closed_since_ = now;
}

/// Whether it must be open now, by the kind of fault and the requests.
bool Oracle::must_be_open(Present& present, const Stage& stage) const {
  const TimePoint now = stage.pack.now();
  switch (present.fault->kind->effect) {
    case Effect::opens: return !present.has_ended;
    case Effect::opens_once: return present.was_closed && !present.has_opened && !present.has_ended;
    case Effect::opens_at_end: return present.was_closed && !present.has_opened && present.has_ended;
    case Effect::opens_driving: {
      const bool is_driving = vehicle_.is_on && !charger_.is_on && !present.has_ended;
      if (!is_driving) present.driving_since = {};
      if (is_driving && present.driving_since == TimePoint{}) {
        present.driving_since = now;
        present.due_at = std::max(present.due_at, now + present.fault->kind->allowed + line_known_after);
        if (now - present.began_at <= 1ms) present.due_at = present.began_at + present.fault->kind->allowed;
      }
      return is_driving;
    }
    case Effect::may_open:
    case Effect::stays_closed: return false;
  }
  return false;
}

void Oracle::check_fault(Present& present, const Stage& stage) {
  const TimePoint now = stage.pack.now();
  const FaultKind& kind = *present.fault->kind;
  if (!must_be_open(present, stage)) return;
  if (!stage.is_alive()) {
    present.due_at = std::max(present.due_at, now + kind.allowed + hidden_for);
    return;
  }
  if (!present.was_hidden && is_hidden(present.fault, now)) {
    present.was_hidden = true;
    present.due_at += hidden_for;
  }
  // If another fault occupies the bus, the decision counts.
  const bool is_on_bus = kind.reached == Reached::on_the_bus && !present.was_hidden;
  const bool is_open = is_on_bus ? !stage.pack.commanded().any_contactor() : !before_.any_contactor();
  if (is_open && !present.has_opened && present.was_closed) reactions_.push_back({&kind, now - present.began_at});
  present.has_opened = present.has_opened || is_open;
  require(is_open || now <= present.due_at, Rule::in_time, now,
          "fault " + std::to_string(present.fault->number) + ", " + std::string(kind.name) + ": not open " +
              std::to_string(to_ms(now - present.began_at)) + " ms after its beginning");
}

void Oracle::check_contacts(const Stage& stage) {
  const TimePoint now = stage.pack.now();
  const Plant& plant = stage.pack.simulator().plant();
  if (closed_at_ != TimePoint{} && now - closed_at_ <= contact_follows) return;
  for (const ContactorName name :
       {ContactorName::main_positive, ContactorName::main_negative, ContactorName::precharge}) {
    const bool is_excused = name == ContactorName::main_positive && is_present("contactor");
    require(is_excused || !plant.is_closed(name), Rule::contacts, now,
            std::string(contactor_names[static_cast<std::size_t>(name)]) +
                " is closed though nothing has been commanded for " + std::to_string(to_ms(now - closed_at_)) + " ms");
  }
}

}  // namespace bmu::test
