#include "daemon/shell/reload.hpp"

#include <algorithm>

namespace bmu {

std::string_view to_text(ReloadRefusal refusal) {
  switch (refusal) {
    case ReloadRefusal::none: return "none";
    case ReloadRefusal::contactors_closed: return "contactors not open";
    case ReloadRefusal::contact_closed: return "contactor feedback closed although commanded open";
    case ReloadRefusal::close_wanted: return "close request active";
    case ReloadRefusal::node_under_way: return "node assignment in progress";
    case ReloadRefusal::ending: return "daemon shutting down";
    case ReloadRefusal::under_way: return "another reload in progress";
  }
  return "?";
}

ReloadRefusal reload_refusal(const Core& core, TimePoint now) {
  if (core.outputs().any_contactor() || core.sequence().phase != Phase::open) return ReloadRefusal::contactors_closed;
  if (core.is_close_requested()) return ReloadRefusal::close_wanted;
  // Outputs and request were checked above: this session has been commanded to end.
  if (!core.may_change_modules()) return ReloadRefusal::ending;
  const Measured<PduState>& pdu = core.sensors().pdu;
  const bool is_heard = pdu.is_usable(now, core.config().ages.pdu_status);
  if (is_heard && pdu.value.any_contactor_closed()) return ReloadRefusal::contact_closed;
  if (core.assignment().is_asking()) return ReloadRefusal::node_under_way;
  return ReloadRefusal::none;
}

Json reload_json(const ReloadDone& done) {
  const auto or_null = [](const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); };
  Json changes = Json::array();
  const std::size_t count = std::min(done.changes.size(), changes_told_max);
  for (std::size_t i = 0; i < count; ++i) {
    const PackChange& change = done.changes[i];
    changes.push_back({{"file", change.file},
                       {"path", change.path},
                       {"before", or_null(change.before)},
                       {"now", or_null(change.now)}});
  }
  return {{"config_hash_before", done.hash_before},
          {"config_hash", done.hash_now},
          {"is_new_life", done.is_new_life},
          {"away_ms", to_ms(done.away)},
          {"changes", std::move(changes)},
          {"changes_left_out", done.changes.size() - count},
          {"warnings", done.warnings}};
}

std::vector<std::string> reload_lines(const ReloadDone& done) {
  if (!done.is_new_life) return {"configuration " + done.hash_now + " unchanged"};
  std::vector<std::string> lines{"configuration " + done.hash_now + " active, previously " + done.hash_before + ": " +
                                 std::to_string(done.changes.size()) +
                                 (done.changes.size() == 1 ? " value" : " values") + " changed, downtime " +
                                 std::to_string(to_ms(done.away)) + " ms"};
  const std::size_t count = std::min(done.changes.size(), changes_logged_max);
  for (std::size_t i = 0; i < count; ++i) lines.push_back("changed: " + to_text(done.changes[i]));
  if (done.changes.size() > count) {
    const std::size_t more = done.changes.size() - count;
    lines.push_back(std::to_string(more) + (more == 1 ? " more change" : " more changes"));
  }
  return lines;
}

}  // namespace bmu
