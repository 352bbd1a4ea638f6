// Every row of the fault table as JSON: what it is, what is seen now, and what is remembered of it.
#include <optional>
#include <string>
#include <utility>

#include "daemon/shell/advice.hpp"
#include "daemon/shell/freeze_json.hpp"
#include "daemon/shell/modules_json.hpp"
#include "daemon/shell/status_json.hpp"
#include "daemon/shell/why_words.hpp"

namespace bmu {

namespace {

Json reading_json(const Reading& reading, const FaultRow& row, const StatusView& view) {
  if (!reading.is_known) return nullptr;
  return {{key_with_unit("value", row.unit), reading.value},
          {"value_text", value_text(row.unit, reading.value)},
          {"element", place_json(row, reading.element, view)},
          {"age_ms", ago_ms(view, reading.taken_at)}};
}

/// What there is to say of the few that are more than true or not, and have no value with a limit.
std::string details_text(const FaultRow& row, const StatusView& view) {
  if (row.id == FaultId::lines_failed) return lines_text(view);
  if (row.id == FaultId::charger_runaway) return excess_text(view.core.charger_watch().excess());
  return {};
}

Json frame_json(const std::optional<FreezeFrame>& frame, const FaultRow& row, const StatusView& view) {
  return frame ? freeze_json(*frame, row, place_json(row, frame->element, view)) : Json(nullptr);
}

Json cleared_json(const std::optional<ClearRecord>& cleared, const StatusView& view) {
  if (!cleared) return nullptr;
  const std::string name = view.users.name_of(cleared->user_id);
  return {{"unix_time_ms", time_json(cleared->unix_time_ms)},
          {"user_id", cleared->user_id},
          {"user_name", name.empty() ? Json(nullptr) : Json(name)},
          {"authority", to_text(cleared->authority)}};
}

/// What the row says of itself, whatever happens.
Json row_json(const FaultRow& row, const Thresholds& thresholds) {
  Json json{{"name", row.name},
            {"meaning", row.meaning},
            {"cause", usual_cause_of(row.id)},
            {"remedy", row.remedy},
            {"reaction", to_text(row.reaction)},
            {"concerns", to_text(row.concerns)},
            {"latch", to_text(row.latch)},
            {"dtc", row.dtc == 0 ? Json(nullptr) : Json(row.dtc)},
            {"lithiumate_code", row.lithiumate_code == 0 ? Json(nullptr) : Json(row.lithiumate_code)}};
  // Rows that are simply true or not have no threshold worth showing.
  if (!row.has_limit()) return json;
  json[key_with_unit("threshold", row.unit)] = thresholds.open;
  json["threshold_text"] = value_text(row.unit, thresholds.open);
  if (thresholds.has_warning) json[key_with_unit("warning", row.unit)] = thresholds.warn;
  return json;
}

void put_state(Json& json, const FaultRow& row, const FaultState& state, const StatusView& view) {
  const bool is_suspected = state.stage != FaultStage::good;
  json["stage"] = to_text(state.stage);
  json["is_present"] = state.is_present();
  json["is_warning"] = state.is_warning;
  json["count_since_start"] = state.count;
  json["latest"] = reading_json(state.latest, row, view);
  json["is_restored"] = state.is_restored;
  json["confirmed"] = state.count > 0 || state.is_restored ? reading_json(state.confirmed, row, view) : Json(nullptr);
  json["worst_warning"] = state.is_warning ? reading_json(state.warning, row, view) : Json(nullptr);
  json["warning_for_ms"] = state.is_warning ? ago_ms(view, state.warning_since) : Json(nullptr);
  json["suspected_for_ms"] = is_suspected ? ago_ms(view, state.suspected_since) : Json(nullptr);
  json["confirmed_ago_ms"] = state.count > 0 ? ago_ms(view, state.confirmed_at) : Json(nullptr);
}

void put_record(Json& json, const FaultRow& row, const FaultRecord& record, const StatusView& view) {
  json["count"] = record.count;
  json["first_unix_time_ms"] = time_json(record.first_unix_time_ms);
  json["last_unix_time_ms"] = time_json(record.last_unix_time_ms);
  json["is_locked"] = record.is_locked;
  json["cleared"] = cleared_json(record.cleared, view);
  json["freeze_frame"] = frame_json(record.frame, row, view);
}

}  // namespace

Json faults_json(const StatusView& view) {
  Json rows = Json::array();
  for (const FaultRow& row : fault_table()) {
    Json json = row_json(row, thresholds_of(row, view.core.config().limits));
    put_state(json, row, view.core.faults().state(row.id), view);
    const bool is_present = view.core.faults().state(row.id).is_present();
    const std::string details = is_present ? details_text(row, view) : "";
    json["details"] = details.empty() ? Json(nullptr) : Json(details);
    json["modules"] = is_present ? Json(problems_of(row.id, view)) : Json::array();
    put_record(json, row, view.core.persistent().faults[static_cast<std::size_t>(row.id)], view);
    rows.push_back(std::move(json));
  }
  return {{"faults", std::move(rows)}};
}

}  // namespace bmu
