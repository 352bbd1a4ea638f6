#include "daemon/shell/reload.hpp"

#include <algorithm>

namespace bmu {

std::string_view to_text(ReloadRefusal refusal) {
  switch (refusal) {
    case ReloadRefusal::none: return "nothing is against it";
    case ReloadRefusal::contactors_closed: return "the pack is not open";
    case ReloadRefusal::contact_closed: return "a contactor that should be open says that it is closed";
    case ReloadRefusal::close_wanted: return "a closed pack is asked for";
    case ReloadRefusal::node_under_way: return "a module is being given a node number";
    case ReloadRefusal::ending: return "the daemon is about to end";
    case ReloadRefusal::under_way: return "another reload is under way";
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
  if (!done.is_new_life) return {"nothing to change: configuration " + done.hash_now + " is in force already"};
  std::vector<std::string> lines{"configuration " + done.hash_now + " is in force, it was " + done.hash_before + ": " +
                                 std::to_string(done.changes.size()) +
                                 (done.changes.size() == 1 ? " value" : " values") + " changed, " +
                                 std::to_string(to_ms(done.away)) + " ms away"};
  const std::size_t count = std::min(done.changes.size(), changes_logged_max);
  for (std::size_t i = 0; i < count; ++i) lines.push_back("changed: " + to_text(done.changes[i]));
  if (done.changes.size() > count) {
    lines.push_back("and " + std::to_string(done.changes.size() - count) + " more");
  }
  return lines;
}

}  // namespace bmu
