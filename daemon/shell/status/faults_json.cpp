// Every row of the fault table as JSON: its description, its present state, and its records.
//
// Most bytes of the reply never change: the description of a row is written once, with the first reply.
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "daemon/shell/json/freeze_json.hpp"
#include "daemon/shell/status/advice.hpp"
#include "daemon/shell/status/modules_json.hpp"
#include "daemon/shell/status/status_json.hpp"
#include "daemon/shell/status/why_words.hpp"

namespace bmu {

namespace {

/// Members of the description of the row, which never change.
std::string lasting_members(const FaultRow& row) {
  JsonText to;
  to.put("name", row.name);
  to.put("meaning", row.meaning);
  to.put("cause", usual_cause_of(row.id));
  to.put("remedy", row.remedy);
  to.put("concerns", to_text(row.concerns));
  to.put("latch", to_text(row.latch));
  to.put("dtc", if_known(row.dtc != 0, row.dtc));
  to.put("lithiumate_code", if_known(row.lithiumate_code != 0, row.lithiumate_code));
  return to.take();
}

/// Its reaction in this pack, and where the pack file is stricter, the usual one.
void put_reaction(JsonText& to, const FaultRow& row, const StricterReactions& stricter) {
  const FaultReaction does = reaction_of(row, stricter);
  to.put("reaction", to_text(does.reaction));
  to.put("grace_ms", if_known(does.grace > Duration{}, to_ms(does.grace)));
  to.put("usual_reaction", if_known(does.is_stricter, to_text(row.reaction)));
  to.put("usual_grace_ms", if_known(does.is_stricter && row.grace > Duration{}, to_ms(row.grace)));
}

/// In the order of FaultId.
const std::array<std::string, fault_count>& all_lasting_members() {
  static const auto members = [] {
    std::array<std::string, fault_count> made;
    for (const FaultRow& row : fault_table()) made[static_cast<std::size_t>(row.id)] = lasting_members(row);
    return made;
  }();
  return members;
}

/// Rows that are just true or false have no threshold to show.
void put_thresholds(JsonText& to, const FaultRow& row, const Thresholds& thresholds) {
  if (!row.has_limit()) return;
  to.put(key_with_unit("threshold", row.unit), thresholds.open);
  to.put("threshold_text", value_text(row.unit, thresholds.open));
  if (thresholds.has_warning) to.put(key_with_unit("warning", row.unit), thresholds.warn);
}

void put_reading(JsonText& to, std::string_view name, bool is_of_now, const Reading& reading, const FaultRow& row,
                 const StatusView& view) {
  if (!is_of_now || !reading.is_known) return to.put(name, nullptr);
  to.object(name, [&] {
    to.put(key_with_unit("value", row.unit), reading.value);
    to.put("value_text", value_text(row.unit, reading.value));
    put_element(to, "element", reading.element, place_text(row, reading.element, view));
    to.put("age_ms", ago_ms(view, reading.taken_at));
  });
}

void put_state(JsonText& to, const FaultRow& row, const FaultState& state, const StatusView& view) {
  const auto since = [&](bool is_so, TimePoint at) { return is_so ? ago_ms(view, at) : std::nullopt; };
  const bool has_been_confirmed = state.count > 0;
  to.put("stage", to_text(state.stage));
  to.put("is_present", state.is_present());
  to.put("is_warning", state.is_warning);
  to.put("count_since_start", state.count);
  put_reading(to, "latest", true, state.latest, row, view);
  to.put("is_restored", state.is_restored);
  put_reading(to, "confirmed", has_been_confirmed || state.is_restored, state.confirmed, row, view);
  put_reading(to, "worst_warning", state.is_warning, state.warning, row, view);
  to.put("warning_for_ms", since(state.is_warning, state.warning_since));
  to.put("suspected_for_ms", since(state.stage != FaultStage::good, state.suspected_since));
  to.put("confirmed_ago_ms", since(has_been_confirmed, state.confirmed_at));
}

/// Details of the few faults that are more than true or false, and have no value with a limit.
std::string details_text(const FaultRow& row, const StatusView& view) {
  if (row.id == FaultId::lines_failed) return lines_text(view);
  if (row.id == FaultId::charger_runaway) return excess_text(view.core.charger_watch().excess());
  return likely_text(row, view);
}

void put_details(JsonText& to, const FaultRow& row, bool is_present, const StatusView& view) {
  const std::string details = is_present ? details_text(row, view) : "";
  to.put("details", if_known(!details.empty(), std::string_view(details)));
  to.array("modules", [&] {
    if (!is_present) return;
    for (const std::string& problem : problems_of(row.id, view)) to.add(problem);
  });
}

void put_cleared(JsonText& to, const std::optional<ClearRecord>& cleared, const StatusView& view) {
  if (!cleared) return to.put("cleared", nullptr);
  const std::string name = view.users.name_of(cleared->user_id);
  to.object("cleared", [&] {
    to.put("unix_time_ms", time_or_nothing(cleared->unix_time_ms));
    to.put("user_id", cleared->user_id);
    to.put("user_name", if_known(!name.empty(), std::string_view(name)));
    to.put("authority", to_text(cleared->authority));
  });
}

void put_record(JsonText& to, const FaultRow& row, const FaultRecord& record, const StatusView& view) {
  to.put("count", record.count);
  to.put("first_unix_time_ms", time_or_nothing(record.first_unix_time_ms));
  to.put("last_unix_time_ms", time_or_nothing(record.last_unix_time_ms));
  to.put("is_locked", record.is_locked);
  put_cleared(to, record.cleared, view);
  if (!record.frame) return to.put("freeze_frame", nullptr);
  to.object("freeze_frame", [&] { put_freeze(to, *record.frame, row, place_text(row, record.frame->element, view)); });
}

void put_row(JsonText& to, const FaultRow& row, const StatusView& view) {
  const auto index = static_cast<std::size_t>(row.id);
  const FaultState& state = view.core.faults().state(row.id);
  to.raw(all_lasting_members()[index]);
  put_reaction(to, row, view.core.config().stricter_reactions);
  put_thresholds(to, row, thresholds_of(row, view.core.config().limits));
  put_state(to, row, state, view);
  put_details(to, row, state.is_present(), view);
  put_record(to, row, view.core.persistent().faults[index], view);
}

}  // namespace

void put_faults(JsonText& to, const StatusView& view) {
  to.array("faults", [&] {
    for (const FaultRow& row : fault_table()) to.object([&] { put_row(to, row, view); });
  });
}

}  // namespace bmu
