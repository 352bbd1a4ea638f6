#include "daemon/shell/status/modules_json.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "daemon/shell/status/foreign_modules_json.hpp"
#include "daemon/shell/status/why_words.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

template <class T>
Json or_null(bool is_known, T value) {
  return is_known ? Json(value) : Json(nullptr);
}

std::int64_t to_us(Duration duration) {
  return std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
}

std::string module_name(std::uint8_t node) {
  return "module " + std::to_string(node);
}

std::string serial_text(std::uint32_t serial_number) {
  return "serial number " + std::to_string(serial_number);
}

// --- errors, as text ------------------------------------------------------------------------------------------------

/// Modules that never report an identity have no identity error.
std::string_view place_text(const ModuleRecord& module, const CoreView& view) {
  return are_modules_ours(view.core.config()) ? to_text(view.core.finding(module).place) : "not told";
}

std::string place_sentence(const ModuleRecord& module, const ModuleFinding& finding) {
  const std::string name = module_name(module.config.node);
  const std::string expected = finding.expected.is_known ? serial_text(finding.expected.serial_number) : "";
  const std::string where = finding.seen_at == 0 ? "" : " (now at node " + std::to_string(finding.seen_at) + ")";
  const std::string found = name + " has " + serial_text(module.identity.value.serial_number);
  const std::string belongs = ", registered at node " + std::to_string(finding.belongs_to);
  switch (finding.place) {
    case ModulePlace::expected:
    case ModulePlace::unnamed: return "";
    case ModulePlace::unheard: {
      if (!finding.expected.is_known) return name + " not identified (no IDENT received)";
      return name + ", expected " + expected + where + ", not identified (no IDENT received)";
    }
    case ModulePlace::exchanged: return found + ", expected " + expected + where;
    case ModulePlace::misplaced: return found + belongs + (expected.empty() ? "" : "; expected " + expected + where);
    case ModulePlace::swapped: return found + ", expected " + expected + where + ": swapped";
  }
  return "";
}

std::string count_sentence(const ModuleRecord& module, std::string_view what, int found, int expected) {
  return module_name(module.config.node) + ", " + serial_text(module.identity.value.serial_number) + ", has " +
         std::to_string(found) + " " + text(what) + ", expected " + std::to_string(expected);
}

Texts count_problems(const ModuleRecord& module) {
  if (!module.identity.is_valid()) return {};
  const ModuleIdentity& said = module.identity.value;
  Texts texts;
  if (said.cell_count != module.config.cell_count) {
    texts.push_back(count_sentence(module, "cells", said.cell_count, module.config.cell_count));
  }
  return texts;
}

Texts kind_problems(const ModuleRecord& module) {
  if (!module.identity.is_valid()) return {};
  const ModuleIdentity& said = module.identity.value;
  Texts texts;
  if (said.temperature_sensor_count != module.config.temperature_sensor_count) {
    texts.push_back(count_sentence(module, "cell temperature sensors", said.temperature_sensor_count,
                                   module.config.temperature_sensor_count));
  }
  if (said.protocol_version != internal_bus::protocol_version) {
    texts.push_back(module_name(module.config.node) + ", " + serial_text(said.serial_number) + ": protocol version " +
                    std::to_string(said.protocol_version) + ", expected " +
                    std::to_string(internal_bus::protocol_version));
  }
  return texts;
}

/// The maker does not publish the meaning of the bits.
Texts maker_problems(const ModuleRecord& module) {
  if (!module.status.is_valid() || module.status.value.maker_errors == 0) return {};
  return {module_name(module.config.node) + " reports manufacturer-specific errors, " +
          id_text(module.status.value.maker_errors)};
}

Texts rival_problems(const ModuleRecord& module, TimePoint now) {
  if (!has_rival(module, now)) return {};
  std::string sentence = "two modules answer as node " + std::to_string(module.config.node);
  if (module.rival_serial_number != 0 && module.identity.is_valid()) {
    sentence += ": serial numbers " + std::to_string(module.identity.value.serial_number) + " and " +
                std::to_string(module.rival_serial_number);
  }
  return {sentence};
}

void append(Texts& to, const Texts& more) {
  to.insert(to.end(), more.begin(), more.end());
}

std::string refusal_sentence(const ModuleRecord& module, AcceptRefusal refusal, const CoreView& view) {
  if (refusal == AcceptRefusal::two_speak) return rival_problems(module, view.now).front();
  const std::string sentence = place_sentence(module, view.core.finding(module));
  return sentence + (refusal == AcceptRefusal::named_otherwise ? " by the pack file" : "");
}

std::string setup_sentence(std::size_t index, const CoreView& view) {
  const std::string name = module_name(view.core.modules().modules()[index].config.node);
  return name +
         (view.core.module_setup().is_refused(index) ? ": cell limits refused" : ": cell limits not acknowledged");
}

Texts setup_problems(const CoreView& view) {
  Texts texts;
  for (std::size_t index = 0; index < view.core.modules().modules().size(); ++index) {
    if (view.core.module_setup().stage(index) != SetupStage::done) texts.push_back(setup_sentence(index, view));
  }
  return texts;
}

// --- one module -----------------------------------------------------------------------------------------------------

Json times_json(const ModuleRecord& module) {
  const AnswerTimes& times = module.answer_times;
  const bool is_known = times.count() > 0;
  Json bounds = Json::array();
  for (const Duration bound : AnswerTimes::bounds) bounds.push_back(to_ms(bound));
  return {{"last_us", or_null(is_known, to_us(times.last()))},
          {"mean_us", or_null(is_known, to_us(times.mean()))},
          {"worst_us", or_null(is_known, to_us(times.worst()))},
          {"jitter_us", or_null(is_known, to_us(times.jitter()))},
          {"within_95_percent_us", or_null(is_known, to_us(times.within(950)))},
          {"bounds_ms", std::move(bounds)},
          {"counts", times.counts()}};
}

std::uint32_t rejected(const ModuleRecord& module, RejectReason reason) {
  return module.rejected[static_cast<std::size_t>(reason)];
}

Json losses_json(const ModuleRecord& module) {
  const std::uint64_t asked = module.answers_complete + module.answers_missed;
  return {{"answers_complete", module.answers_complete},
          {"answers_missed", module.answers_missed},
          {"missed_permille", or_null(asked > 0, asked == 0 ? 0 : module.answers_missed * 1'000 / asked)},
          {"asked_alone", module.asked_alone},
          {"wrong_crc", rejected(module, RejectReason::wrong_crc)},
          {"wrong_length", rejected(module, RejectReason::wrong_length)},
          {"wrong_counter", rejected(module, RejectReason::wrong_counter)},
          {"repeated_counter", rejected(module, RejectReason::repeated_counter)},
          {"conflicting", rejected(module, RejectReason::conflicting)},
          {"late", rejected(module, RejectReason::late)},
          {"values_out_of_range", module.values_out_of_range},
          {"restarts", module.restarts}};
}

std::string_view setup_text(std::size_t index, const Core& core) {
  if (!are_modules_ours(core.config())) return "none of its own";
  if (core.module_setup().stage(index) == SetupStage::done) return "set";
  return core.module_setup().is_refused(index) ? "refused" : "not set";
}

Json module_json(std::size_t index, const StatusView& view) {
  const ModuleRecord& module = view.core.modules().modules()[index];
  const AgeConfig& ages = view.core.config().ages;
  const ModuleFinding finding = view.core.finding(module);
  const bool has_status = module.status.is_usable(view.now, ages.module_status);
  const ModuleStatus& said = module.status.value;
  const bool is_identified = module.identity.is_valid();
  const auto mode = std::find_if(std::begin(internal_bus::mode_names), std::end(internal_bus::mode_names),
                                 [&](const RawName& one) { return one.raw == static_cast<std::int64_t>(said.mode); });
  return {{"node", module.config.node},
          {"is_answering", is_answering(module, ages, view.now)},
          {"serial_number", or_null(is_identified, module.identity.value.serial_number)},
          {"serial_number_expected", or_null(finding.expected.is_known, finding.expected.serial_number)},
          {"is_expected_by_file", finding.is_from_file},
          {"place", place_text(module, view)},
          {"belongs_to_node", or_null(finding.belongs_to != 0, finding.belongs_to)},
          {"expected_seen_at_node", or_null(finding.seen_at != 0, finding.seen_at)},
          {"problems", module_problems(module, view)},
          {"mode", has_status ? Json(mode->name) : Json(nullptr)},
          {"on_module_supply", or_null(has_status, said.on_module_supply)},
          {"is_balancing", or_null(has_status, said.is_balancing)},
          {"maker_errors", or_null(has_status, said.maker_errors)},
          {"cell_count", or_null(is_identified, module.identity.value.cell_count)},
          {"cell_count_expected", module.config.cell_count},
          {"temperature_sensor_count", or_null(is_identified, module.identity.value.temperature_sensor_count)},
          {"temperature_sensor_count_expected", module.config.temperature_sensor_count},
          {"protocol_version", or_null(is_identified, module.identity.value.protocol_version)},
          {"limits", setup_text(index, view.core)},
          {"answer_times", times_json(module)},
          {"losses", losses_json(module)},
          {"last_answer_age_ms", ago_ms(view, module.last_answer_at)}};
}

Json strangers_json(const CoreView& view) {
  Json strangers = Json::array();
  for (std::uint8_t node = 1; node <= internal_bus::node_count_max; ++node) {
    const ModuleRoster& roster = view.core.watchers().roster;
    if (!roster.is_stranger(node, view.now)) continue;
    const StrangerRecord& stranger = roster.stranger(node);
    strangers.push_back({{"node", node},
                         {"serial_number", or_null(stranger.is_identified, stranger.serial_number)},
                         {"cell_count", or_null(stranger.is_identified, stranger.cell_count)},
                         {"last_seen_age_ms", ago_ms(view, stranger.seen_at)}});
  }
  return strangers;
}

/// The module has the requested node number already.
bool is_there_already(const ModuleAssignment& assignment) {
  return assignment.stage() == AssignmentStage::refused && assignment.refusal() == AssignmentRefusal::already_there;
}

std::string already_sentence(const AssignmentRequest& request, const CoreView& view) {
  const std::string node = std::to_string(request.node);
  const ModuleRecord* const module = view.core.modules().find(request.node);
  const bool is_expected = module == nullptr || view.core.finding(*module).place == ModulePlace::expected;
  return serial_text(request.serial_number) + " already has node " + node +
         (is_expected ? "" : "; to register it there: `bmuctl modules accept " + node + "`");
}

std::string assignment_sentence(const CoreView& view) {
  const ModuleAssignment& assignment = view.core.assignment();
  const AssignmentRequest& request = assignment.request();
  const std::string who = serial_text(request.serial_number);
  const std::string node = "node " + std::to_string(request.node);
  switch (assignment.stage()) {
    case AssignmentStage::none: return "";
    case AssignmentStage::refused:
      if (is_there_already(assignment)) return already_sentence(request, view);
      return "failed: " + text(to_text(assignment.refusal()));
    case AssignmentStage::asking: return "assigning " + node + " to " + who;
    case AssignmentStage::taken: {
      const std::string from =
          assignment.node_before() == 0 ? "" : ", previously node " + std::to_string(assignment.node_before());
      return who + ": " + node + " assigned and confirmed" + from;
    }
    case AssignmentStage::seen_other:
      return "failed: " + node + " is used by " + serial_text(assignment.other_serial_number()) + ", not " + who;
    case AssignmentStage::not_seen:
      return "failed: no answer from " + node + "; " + who + " is not connected or ignores the command";
  }
  return "";
}

}  // namespace

Texts module_problems(const ModuleRecord& module, const CoreView& view) {
  Texts texts = rival_problems(module, view.now);
  const bool is_named = are_modules_ours(view.core.config());
  const std::string place = is_named ? place_sentence(module, view.core.finding(module)) : "";
  if (!place.empty()) texts.push_back(place);
  append(texts, maker_problems(module));
  append(texts, count_problems(module));
  append(texts, kind_problems(module));
  return texts;
}

Texts stranger_problems(const CoreView& view) {
  Texts texts;
  for (const Json& stranger : strangers_json(view)) {
    const Json& serial_number = stranger["serial_number"];
    texts.push_back("unknown module at node " + stranger["node"].dump() +
                    (serial_number.is_null() ? ", not identified" : ", serial number " + serial_number.dump()));
  }
  return texts;
}

Json acceptance_json(std::uint8_t node, const KnownModules& before, const CoreView& view) {
  const ModuleRoster& roster = view.core.watchers().roster;
  Json accepted = Json::array();
  Json already = Json::array();
  Json refused = Json::array();
  Texts problems;
  for (const ModuleRecord& module : view.core.modules().modules()) {
    const std::uint8_t at = module.config.node;
    if (node != 0 && at != node) continue;
    const KnownModule& known = roster.known()[at];
    const AcceptRefusal refusal = roster.reason_against_accepting(module, view.now);
    if (refusal != AcceptRefusal::none) {
      refused.push_back(
          {{"node", at}, {"reason", to_text(refusal)}, {"text", refusal_sentence(module, refusal, view)}});
    } else if (known == before[at]) {
      already.push_back({{"node", at}, {"serial_number", module.identity.value.serial_number}});
    } else {
      accepted.push_back({{"node", at},
                          {"serial_number", known.serial_number},
                          {"serial_number_before", or_null(before[at].is_known, before[at].serial_number)}});
    }
    append(problems, count_problems(module));
    append(problems, kind_problems(module));
  }
  return {{"node", or_null(node != 0, node)},
          {"accepted", std::move(accepted)},
          {"already", std::move(already)},
          {"not_accepted", std::move(refused)},
          {"problems", std::move(problems)}};
}

std::string silence_text(const ModuleRecord& module, const CoreView& view) {
  const AgeConfig& ages = view.core.config().ages;
  const bool speaks = module.last_answer_at != TimePoint{} && view.now - module.last_answer_at <= ages.module_status;
  std::string last = "last answer " + ago_text(view, module.last_answer_at);
  if (!speaks) return last;
  const auto lacks = [&](std::string_view what, TimePoint taken_at, Duration age_max) {
    if (taken_at == TimePoint{}) return last + ", never with " + std::string(what);
    return last + ", " + std::string(what) + " " + ago_text(view, taken_at) + ", allowed " + span_text(age_max);
  };
  if (!module.status.is_fresh(view.now, ages.module_status)) {
    return lacks("its status", module.status.taken_at, ages.module_status);
  }
  TimePoint oldest = module.cell_voltage_uV[0].taken_at;
  for (std::size_t cell = 1; cell < module.config.cell_count; ++cell) {
    oldest = std::min(oldest, module.cell_voltage_uV[cell].taken_at);
  }
  if (view.now - oldest > ages.cell_voltage) return lacks("its oldest cell voltage", oldest, ages.cell_voltage);
  return lacks("its module voltage", module.module_voltage_mV.taken_at, ages.cell_voltage);
}

Texts problems_of(FaultId fault, const CoreView& view) {
  if (fault == FaultId::unknown_module) return stranger_problems(view);
  if (fault == FaultId::module_not_set_up) return setup_problems(view);
  Texts texts;
  for (const ModuleRecord& module : view.core.modules().modules()) {
    const ModuleFinding finding = view.core.finding(module);
    const bool is_swapped = finding.place == ModulePlace::swapped;
    const bool is_exchanged = finding.place == ModulePlace::exchanged || finding.place == ModulePlace::misplaced;
    const bool is_missing = finding.place == ModulePlace::unheard && finding.expected.is_known;
    const bool is_meant = (fault == FaultId::modules_swapped && is_swapped) ||
                          (fault == FaultId::module_exchanged && is_exchanged) ||
                          (fault == FaultId::module_lost && is_missing);
    if (is_meant) texts.push_back(place_sentence(module, finding));
    const bool is_lost = !is_answering(module, view.core.config().ages, view.now);
    if (fault == FaultId::module_lost && is_lost && !is_missing) {
      texts.push_back("module " + std::to_string(module.config.node) + ": " + silence_text(module, view));
    }
    if (fault == FaultId::duplicate_node) append(texts, rival_problems(module, view.now));
    if (fault == FaultId::wrong_cell_count) append(texts, count_problems(module));
    if (fault == FaultId::module_mismatch) append(texts, kind_problems(module));
  }
  return texts;
}

Json poll_json(const CoreView& view) {
  const PollPacer& pace = view.core.pace();
  return {{"pace", to_text(pace.pace())},
          {"period_ms", to_ms(pace.period())},
          {"since_ms", ago_ms(view, pace.since())},
          {"temperature_every", view.core.config().poll.temperature_every}};
}

Json assignment_json(const CoreView& view) {
  const ModuleAssignment& assignment = view.core.assignment();
  if (assignment.stage() == AssignmentStage::none) return nullptr;
  const AssignmentRequest& request = assignment.request();
  return {{"number", assignment.number()},
          {"serial_number", request.serial_number},
          {"node", request.node},
          {"node_before", or_null(assignment.node_before() != 0, assignment.node_before())},
          {"stage", to_text(assignment.stage())},
          {"is_over", !assignment.is_asking()},
          {"is_done", assignment.stage() == AssignmentStage::taken || is_there_already(assignment)},
          {"text", assignment_sentence(view)}};
}

Json modules_json(const StatusView& view) {
  Json modules = Json::array();
  for (std::size_t index = 0; index < view.core.modules().modules().size(); ++index) {
    modules.push_back(module_json(index, view));
  }
  return {{"poll", poll_json(view)},
          {"modules_answering", view.core.pack().modules_answering},
          {"modules_expected", view.core.pack().modules_expected},
          {"modules", std::move(modules)},
          {"foreign", foreign_modules_json(view)},
          {"strangers", strangers_json(view)},
          {"assignment", assignment_json(view)}};
}

}  // namespace bmu
