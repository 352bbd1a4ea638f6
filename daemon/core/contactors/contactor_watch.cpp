#include "daemon/core/contactors/contactor_watch.hpp"

#include <algorithm>

namespace bmu {

void ContactorWatch::init(TimePoint started_at) {
  contacts_.fill({.commanded_at = started_at});
}

void ContactorWatch::command(const ContactorOutputs& outputs, TimePoint now) {
  const std::array commanded{outputs.main_positive, outputs.main_negative, outputs.precharge, outputs.charge};
  for (std::size_t index = 0; index < contactor_id_count; ++index) {
    if (contacts_[index].is_commanded == commanded[index]) continue;
    contacts_[index] = {.is_commanded = commanded[index], .commanded_at = now};
  }
}

Disobedience ContactorWatch::disobeys(const Measured<PduState>& pdu, const ContactorConfig& config, TimePoint now) {
  const std::array closed{pdu.value.main_positive_closed, pdu.value.main_negative_closed, pdu.value.precharge_closed,
                          pdu.value.charge_closed};
  Disobedience found;
  for (std::size_t index = 0; index < contactor_id_count; ++index) {
    Contact& contact = contacts_[index];
    if (pdu.taken_at <= contact.commanded_at) continue;
    if (!judge(contact, closed[index], pdu.taken_at, config, now)) continue;
    std::uint8_t& kind = closed[index] ? found.welded : found.not_following;
    if (kind == 0) kind = static_cast<std::uint8_t>(index + 1);
  }
  return found;
}

bool ContactorWatch::is_settled() const {
  return std::all_of(contacts_.begin(), contacts_.end(), [](const Contact& contact) {
    return contact.has_settled && contact.obeying_since != TimePoint{};
  });
}

TimePoint ContactorWatch::obeying_since() const {
  TimePoint latest{};
  for (const Contact& contact : contacts_) latest = std::max(latest, contact.obeying_since);
  return latest;
}

bool ContactorWatch::judge(Contact& contact, bool is_closed, TimePoint seen_at, const ContactorConfig& config,
                           TimePoint now) {
  if (is_closed == contact.is_commanded) {
    if (contact.obeying_since == TimePoint{}) contact.obeying_since = now;
    contact.has_settled = contact.has_settled || now - contact.obeying_since >= config.settle;
    return false;
  }
  contact.obeying_since = {};
  return contact.has_settled || seen_at - contact.commanded_at >= config.feedback_timeout;
}

}  // namespace bmu
