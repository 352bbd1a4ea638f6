#include "daemon/shell/status/why_json.hpp"

#include <algorithm>
#include <utility>

#include "daemon/shell/status/advice.hpp"
#include "daemon/shell/status/modules_json.hpp"
#include "daemon/shell/status/why_limits.hpp"
#include "daemon/shell/status/why_words.hpp"

namespace bmu {

namespace {

// --- the last opening -----------------------------------------------------------------------------------------------

/// Age of the last reception before the opening, and its limit. A module may have answered just before, and not
/// completely: values are a little older than the answer that has them, so a value that is younger than the limit by
/// more than that is no silence.
std::string heard_text(const OpeningRecord& opening, const Silence& silence, const std::string& before) {
  constexpr Duration value_age_max = 50ms;
  const TimePoint at = opening.reading.taken_at;
  if (at == TimePoint{}) return "never received";
  const std::string age = span_text(opening.at - at);
  const bool is_partial = opening.confirmed_at - at + value_age_max < silence.limit;
  if (is_partial) return "partly received " + age + before;
  return "last received " + age + before + ", limit " + span_text(silence.limit);
}

/// Age of the reading: ", measured 8 ms before opening"; "" for a condition without a sample, which is true or false
/// when it is evaluated.
std::string seen_text(const OpeningRecord& opening, const FaultRow& row, const CoreView& view) {
  if (opening.is_restored) return ", confirmed in an earlier session";
  const Silence silence = silence_of(row.id, view);
  const TimePoint at = opening.reading.taken_at;
  if (silence.is_one) {
    return ", " + heard_text(opening, silence, " before opening");
  }
  const bool has_sample = row.has_limit() || at != opening.confirmed_at;
  return has_sample ? ", measured " + span_text(opening.at - at) + " before opening" : "";
}

Json signal_step(const OpeningRecord& opening, const FaultRow& row, const CoreView& view) {
  const Reading& reading = opening.reading;
  const std::string what = reading_text(row, reading, view);
  const Duration age = opening.at - reading.taken_at;
  const bool has_time = !opening.is_restored && reading.taken_at != TimePoint{};  // not without a reception
  Json json = step("signal", text(row.meaning) + (what.empty() ? "" : ": " + what) + seen_text(opening, row, view));
  if (row.has_limit()) json[key_with_unit("value", row.unit)] = reading.is_known ? Json(reading.value) : Json(nullptr);
  json["element"] = place_json(row, reading.element, view);
  json["taken_ago_ms"] = opening.is_restored ? std::nullopt : ago_ms(view, reading.taken_at);
  json["taken_before_opening_ms"] = has_time ? Json(to_ms(age)) : Json(nullptr);
  return json;
}

Json limit_step(const OpeningRecord& opening, const FaultRow& row) {
  const bool is_upper = row.sense == Sense::at_or_above;
  Json json = step("limit", text(is_upper ? "at or above " : "at or below ") + value_text(row.unit, opening.threshold) +
                                " for " + span_text(opening.confirmed_at - opening.suspected_since));
  json[key_with_unit("threshold", row.unit)] = opening.threshold;
  json["beyond_for_ms"] = to_ms(opening.confirmed_at - opening.suspected_since);
  return json;
}

Json fault_step(const OpeningRecord& opening, const FaultRow& row, const CoreView& view) {
  const Duration confirm = thresholds_of(row, view.core.config().limits).confirm;
  const std::string confirmed = confirm > Duration{} ? "after " + span_text(confirm) : "immediately";
  const FaultReaction does = reaction_of(row, view.core.config().stricter_reactions);
  Json json = step("fault", "fault " + text(row.name) + ", confirmed " + confirmed + ", reaction: " +
                                text(to_text(does.reaction)) + (does.is_stricter ? ", by the pack file" : ""));
  json["name"] = row.name;
  json["reaction"] = to_text(does.reaction);
  json["confirm_ms"] = to_ms(confirm);
  json["grace_ms"] = to_ms(does.grace);
  json["confirmed_before_opening_ms"] =
      opening.is_restored ? Json(nullptr) : Json(to_ms(opening.at - opening.confirmed_at));
  return json;
}

std::string current_text(const OpeningRecord& opening) {
  return opening.current_mA.is_valid() ? value_text(Unit::mA, opening.current_mA.value) : "unknown current";
}

Json current_json(const OpeningRecord& opening) {
  return opening.current_mA.is_valid() ? Json(opening.current_mA.value) : Json(nullptr);
}

Json decision_step(const OpeningRecord& opening, const CoreView& view) {
  Json json = step("decision", "opened " + ago_text(view, opening.at) + " from " + text(to_text(opening.from)) +
                                   " at " + current_text(opening));
  json["opened_ago_ms"] = ago_ms(view, opening.at);
  json["from"] = to_text(opening.from);
  json["current_mA"] = current_json(opening);
  return json;
}

/// "cell 2.7 (no. 19): 2.8512 V, limit 2.9000 V, exceeded for 0.21 s; sample 8 ms before opening."
std::string fault_sentence(const OpeningRecord& opening, const FaultRow& row, const CoreView& view) {
  const std::string what = reading_text(row, opening.reading, view);
  std::string sentence = text(row.meaning) + (what.empty() ? "" : ": " + what);
  if (opening.is_restored) return sentence + ", confirmed in an earlier session, not cleared since";
  if (row.has_limit()) {
    sentence += ", limit " + value_text(row.unit, opening.threshold) + ", exceeded for " +
                span_text(opening.confirmed_at - opening.suspected_since);
  }
  const TimePoint at = opening.reading.taken_at;
  const Silence silence = silence_of(row.id, view);
  if (silence.is_one) {
    return sentence + "; " + heard_text(opening, silence, " before opening");
  }
  if (at == TimePoint{}) return sentence + "; no earlier sample";
  const bool has_sample = row.has_limit() || at != opening.confirmed_at;
  return sentence + (has_sample ? "; sample " + span_text(opening.at - at) + " before opening" : "");
}

std::string opening_reason(const OpeningRecord& opening, const CoreView& view) {
  switch (opening.cause) {
    case OpeningCause::none: return "nothing";
    case OpeningCause::fault: return fault_sentence(opening, row_of(opening.fault), view);
    case OpeningCause::request_over: return "close request ended (vehicle off, no charger)";
    case OpeningCause::shut_down: return "the daemon was stopped";
    case OpeningCause::precharge_retry: return "precharge timeout; next attempt after the cool-down time";
    case OpeningCause::permission: {
      const std::string where = to_text(opening.reading.element);
      return "permission withdrawn: " + text(to_text(opening.blocker)) + (where.empty() ? "" : ": " + where);
    }
  }
  return "?";
}

// --- the present state ---

std::string clearing_command(const FaultRow& row) {
  return row.latch == Latch::until_authorised ? "`bmuctl clear --authorised`" : "`bmuctl clear`";
}

/// Condition for the end of a latched fault.
std::string latched_text(const FaultRow& row, const FaultState& state) {
  if (state.judged == Verdict::unknown) return "state of the cause unknown";
  if (state.judged != Verdict::good || state.is_doubtful()) return "cause recurring";
  return "cause gone, waiting for " + clearing_command(row);
}

/// In this pack: its file may be stricter than the fault table.
bool only_warns(const FaultRow& row, const CoreView& view) {
  return reaction_of(row, view.core.config().stricter_reactions).reaction == Reaction::warn;
}

/// Details of a blocker at present: the faults, modules, sensors or inputs that it is about.
Texts present_faults(const CoreView& view) {
  Texts texts;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = view.core.faults().state(row.id);
    if (!state.is_present() || only_warns(row, view)) continue;
    const Texts modules = problems_of(row.id, view);  // with nodes and serial numbers, if the modules are the subject
    const std::string what = modules.empty() ? confirmed_text(row, state, view) : joined(modules);
    std::string line = text(row.meaning) + (what.empty() ? "" : " (" + what + ")");
    if (state.stage == FaultStage::latched) line += ", " + latched_text(row, state);
    if (const std::string likely = likely_text(row, view); !likely.empty()) line += "; " + likely;
    texts.push_back(line);
  }
  return texts;
}

/// Reason why a fault was not ended by a clear command.
std::string staying_reason(const FaultRow& row, const FaultState& state, const CoreView& view) {
  const std::string clear = span_text(thresholds_of(row, view.core.config().limits).clear);
  if (state.stage == FaultStage::latched) {
    const bool is_gone = state.judged == Verdict::good && !state.is_doubtful();
    return is_gone ? "inspect the pack, then run " + clearing_command(row) : latched_text(row, state);
  }
  if (state.good_since != TimePoint{}) {
    return "cause gone for " + span_text(view.now - state.good_since) + ", required " + clear;
  }
  const std::string what = state.latest.is_known ? reading_text(row, state.latest, view) : "";
  const std::string cause = "cause still present" + (what.empty() ? "" : " (" + what + ")");
  return row.latch == Latch::none ? cause + "; clears automatically " + clear + " after the cause is gone" : cause;
}

Texts incomplete_modules(const CoreView& view) {
  const AgeConfig& ages = view.core.config().ages;
  Texts texts;
  for (const ModuleRecord& module : view.core.modules().modules()) {
    const std::string name = "module " + std::to_string(module.config.node);
    if (!is_answering(module, ages, view.now)) {
      texts.push_back(name + " (" + silence_text(module, view) + ")");
      continue;
    }
    for (unsigned i = 0; i < module.config.temperature_sensor_count; ++i) {
      if (module.cell_temperature_dC[i].is_usable(view.now, ages.temperature)) continue;
      texts.push_back("temperature sensor " + std::to_string(module.config.node) + "." + std::to_string(i + 1));
    }
  }
  return texts;
}

Texts missing_sensors(const CoreView& view) {
  const SensorTable& sensors = view.core.sensors();
  const AgeConfig& ages = view.core.config().ages;
  Texts texts;
  const auto check = [&](std::string_view name, const Measured<std::int32_t>& value, Duration age_max) {
    if (!value.is_usable(view.now, age_max)) texts.push_back(text(name) + " (" + ago_text(view, value.taken_at) + ")");
  };
  check("current", sensors.current_mA, ages.pack_current);
  check("pack voltage", sensors.pack_voltage_mV, ages.pack_voltage);
  check("DC link voltage", sensors.link_voltage_mV, ages.pack_voltage);
  return texts;
}

Texts unhealthy_inputs(const CoreView& view) {
  const PduState& pdu = view.core.sensors().pdu.value;
  const std::pair<bool, const char*> inputs[] = {{pdu.estop_1_released, "emergency stop 1 (PDU) pressed"},
                                                 {pdu.estop_2_released, "emergency stop 2 (PDU) pressed"},
                                                 {pdu.interlock_closed, "interlock loop open"},
                                                 {pdu.insulation_monitor_ok, "insulation monitor not OK"},
                                                 {!pdu.opened_by_timeout, "PDU opened by itself"},
                                                 {!pdu.alarm_loop_open, "alarm loop of the modules open"}};
  Texts texts;
  for (const auto& [is_healthy, meaning] : inputs) {
    if (!is_healthy) texts.emplace_back(meaning);
  }
  for (const std::string& stop : line_texts("emergency stop", GpioInputKind::estop, pdu.estops_pressed, view)) {
    texts.push_back(stop + " pressed");
  }
  for (const std::string& loop : line_texts("interlock", GpioInputKind::interlock, pdu.interlocks_open, view)) {
    texts.push_back(loop + " open");
  }
  return texts;
}

Texts modules_without_limits(const CoreView& view) {
  Texts texts;
  const auto& modules = view.core.modules().modules();
  for (std::size_t index = 0; index < modules.size(); ++index) {
    if (view.core.module_setup().stage(index) == SetupStage::done) continue;
    const char* refuses = view.core.module_setup().is_refused(index) ? " (refused)" : "";
    texts.push_back("module " + std::to_string(modules[index].config.node) + refuses);
  }
  return texts;
}

Texts lockout_left(const CoreView& view) {
  return {span_text(view.core.locked_out_until() - view.now) + " remaining"};
}

Texts link_and_pack(const CoreView& view) {
  const PackState& pack = view.core.pack();
  return {value_text(Unit::mV, pack.link_voltage_mV.value) + " of " + value_text(Unit::mV, pack.pack_voltage_mV.value)};
}

Texts suspected_faults(const CoreView& view) {
  Texts texts;
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = view.core.faults().state(row.id);
    if (only_warns(row, view) || state.stage != FaultStage::suspected) continue;
    const std::string where = to_text(state.latest.element);
    texts.push_back(text(row.meaning) + (where.empty() ? "" : ", " + where));
  }
  return texts;
}

/// The missing status: of the PDU, or of lines of this machine, without which that of the PDU alone is not enough.
Texts silent_sources(const CoreView& view) {
  const SensorTable& sensors = view.core.sensors();
  const CoreConfig& config = view.core.config();
  const Duration age_max = config.ages.pdu_status;
  Texts texts;
  if (config.contactors.has_pdu && !sensors.pdu_word.is_usable(view.now, age_max)) {
    const TimePoint at = sensors.pdu_word.taken_at;
    texts.push_back("PDU_STATUS " +
                    (at == TimePoint{} ? std::string("never received") : "last received " + ago_text(view, at)));
  }
  if (config.lines.are_used && !sensors.lines.is_usable(view.now, age_max)) {
    texts.emplace_back("GPIO lines not readable");
  }
  return texts;
}

Texts insulation_state(const CoreView& view) {
  return {"insulation monitor state \"" + text(to_text(view.core.sensors().pdu.value.insulation_state)) + "\""};
}

Texts no_details(const CoreView&) {
  return {};
}

struct BlockerRow {
  Blocker blocker;
  Texts (*details)(const CoreView&);
};

constexpr BlockerRow blocker_table[] = {
    {Blocker::shutting_down, no_details},
    {Blocker::fault, present_faults},
    {Blocker::resting, no_details},
    {Blocker::internal_bus_down, no_details},
    {Blocker::pdu_unknown, silent_sources},
    {Blocker::inputs_unhealthy, unhealthy_inputs},
    {Blocker::insulation_unknown, insulation_state},
    {Blocker::modules_incomplete, incomplete_modules},
    {Blocker::sensors_incomplete, missing_sensors},
    {Blocker::not_qualified, no_details},
    {Blocker::modules_not_set_up, modules_without_limits},
    {Blocker::suspicion, suspected_faults},
    {Blocker::commands_not_on_bus, no_details},
    {Blocker::contacts_unsettled, no_details},
    {Blocker::contactor_closed, no_details},
    {Blocker::link_follows, link_and_pack},
    {Blocker::precharge_hot, no_details},
    {Blocker::locked_out, lockout_left},
    {Blocker::no_claim, no_details},
};
static_assert(std::size(blocker_table) == blocker_count);

std::string blocker_text(Blocker blocker, const CoreView& view) {
  const auto* row = std::find_if(std::begin(blocker_table), std::end(blocker_table),
                                 [&](const BlockerRow& one) { return one.blocker == blocker; });
  const std::string details = row == std::end(blocker_table) ? "" : joined(row->details(view));
  return text(to_text(blocker)) + (details.empty() ? "" : ": " + details);
}

/// Condition for a close request: an edge of one of the two inputs.
std::string asking_text(const CoreView& view) {
  const PduState& pdu = view.core.sensors().pdu.value;
  if (!pdu.vehicle_on && !pdu.charger_connected) return "vehicle-on or charger-connected must switch on";
  return std::string(pdu.vehicle_on ? "vehicle-on" : "charger-connected") +
         " is on, but must switch on again: switch it off and on";
}

std::string state_sentence(const CoreView& view) {
  const SequenceState& sequence = view.core.sequence();
  const std::string since = span_text(view.now - std::max(sequence.entered_at, view.core.started_at()));
  const std::string now = "phase \"" + text(to_text(sequence.phase)) + "\" for " + since;
  if (sequence.phase != Phase::open) return now + ": close request active, no close inhibit";
  if (!view.core.permission().may_close) return now + ", closing inhibited";
  return now + (view.core.is_close_requested() ? ", close request active" : ": no close request; " + asking_text(view));
}

Json state_chain(const CoreView& view) {
  Json steps = Json::array();
  const bool is_requested = view.core.is_close_requested();
  Json request = step("request", is_requested ? "close request active" : "no close request");
  request["close_requested"] = is_requested;
  steps.push_back(std::move(request));
  for (const Blocker blocker : view.core.permission().blockers) {
    steps.push_back(step("blocker", blocker_text(blocker, view)));
  }
  const RefusalRecord& refusal = view.core.last_refusal();
  if (refusal.has_happened) {
    steps.push_back(
        step("refusal", "last close request refused " + ago_text(view, refusal.at) + ": " +
                            refusal_text(refusal.blocker, refusal.fault, refusal.reading, refusal.threshold) +
                            "; request again when this condition has ended"));
  }
  steps.push_back(step("decision", state_sentence(view)));
  return {{"phase", to_text(view.core.sequence().phase)},
          {"may_close", view.core.permission().may_close},
          {"may_stay_closed", view.core.permission().may_stay_closed},
          {"text", capitalised(state_sentence(view)) + "."},
          {"steps", std::move(steps)}};
}

// --- actions ---

/// For each fault that inhibits closing; where there is none, for the foremost blocker.
Json to_do_list(const CoreView& view) {
  Json list = Json::array();
  for (const FaultRow& row : fault_table()) {
    if (only_warns(row, view) || !view.core.faults().state(row.id).is_present()) continue;
    list.push_back({{"about", row.name}, {"remedy", row.remedy}});
  }
  const auto& blockers = view.core.permission().blockers;
  if (!list.empty() || blockers.empty()) return list;
  list.push_back({{"about", to_text(*blockers.begin())}, {"remedy", advice_on(*blockers.begin()).remedy}});
  return list;
}

std::string to_do_sentence(const Json& one) {
  return "Action: " + one["remedy"].get<std::string>() + " (" + one["about"].get<std::string>() + ").";
}

// --- closing ---

std::string precharge_sentence(const PrechargeRecord& record, const CoreView& view) {
  const std::string numbers = "DC link " + value_text(Unit::mV, record.link_mV) + " of " +
                              value_text(Unit::mV, record.pack_mV) + ", " + value_text(Unit::mA, record.current_mA);
  return text(record.was_successful ? "Precharge done after " : "Precharge aborted after ") + span_text(record.took) +
         ", " + ago_text(view, record.ended_at) + " (" + numbers + ").";
}

}  // namespace

Json opening_json(const CoreView& view) {
  const OpeningRecord& opening = view.core.last_opening();
  if (opening.cause == OpeningCause::none) return nullptr;
  Json steps = Json::array();
  if (opening.cause == OpeningCause::fault) {
    const FaultRow& row = row_of(opening.fault);
    steps.push_back(signal_step(opening, row, view));
    if (row.has_limit() && !opening.is_restored) steps.push_back(limit_step(opening, row));
    steps.push_back(fault_step(opening, row, view));
  } else {
    steps.push_back(step("cause", opening_reason(opening, view)));
  }
  steps.push_back(decision_step(opening, view));
  Json json{{"cause", to_text(opening.cause)},
            {"opened_ago_ms", ago_ms(view, opening.at)},
            {"from", to_text(opening.from)},
            {"current_mA", current_json(opening)},
            {"fault", opening.cause == OpeningCause::fault ? Json(row_of(opening.fault).name) : Json(nullptr)},
            {"reason", opening_reason(opening, view)},
            {"text", "Opened " + ago_text(view, opening.at) + ": " + opening_reason(opening, view) + "."},
            {"steps", std::move(steps)}};
  return json;
}

Json staying_faults_json(const CoreView& view) {
  Json rows = Json::array();
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = view.core.faults().state(row.id);
    if (!state.is_present()) continue;
    const std::string reason = staying_reason(row, state, view);
    rows.push_back({{"name", row.name},
                    {"reason", reason},
                    {"text", capitalised(text(row.meaning) + ": " + reason) + "."},
                    {"only_warns", only_warns(row, view)}});
  }
  return rows;
}

Json why_json(const CoreView& view) {
  const PrechargeRecord& precharge = view.core.last_precharge();
  Json state = state_chain(view);
  Json opening = opening_json(view);
  Json discharge = limit_chain(Concerns::discharge, view);
  Json charge = limit_chain(Concerns::charge, view);

  Json sentences = Json::array({state["text"]});
  for (const Blocker blocker : view.core.permission().blockers) {
    sentences.push_back("Close inhibit: " + blocker_text(blocker, view) + ".");
  }
  Json to_do = to_do_list(view);
  for (const Json& one : to_do) sentences.push_back(to_do_sentence(one));
  if (!opening.is_null()) sentences.push_back(opening["text"]);
  if (precharge.has_run) sentences.push_back(precharge_sentence(precharge, view));
  sentences.push_back(discharge["text"]);
  sentences.push_back(charge["text"]);
  const BalancingBlockers against = view.core.balancing().blockers();
  if (view.core.config().balancing.is_enabled && against != 0) {
    sentences.push_back("Balancing inhibit: " + std::string(row_of(first_of(against)).meaning) + ".");
  }
  return {{"text", std::move(sentences)},
          {"state", std::move(state)},
          {"to_do", std::move(to_do)},
          {"last_opening", std::move(opening)},
          {"limits", {{"discharge", std::move(discharge)}, {"charge", std::move(charge)}}}};
}

}  // namespace bmu
