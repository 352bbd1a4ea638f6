#include "daemon/core/contactor_watch.hpp"

#include <algorithm>

namespace bmu {

void ContactorWatch::init(TimePoint started_at) {
  contacts_.fill({.commanded_at = started_at});
}

void ContactorWatch::command(const ContactorOutputs& outputs, TimePoint now) {
  const std::array commanded{outputs.main_positive, outputs.main_negative, outputs.precharge, outputs.charge};
  for (std::size_t index = 0; index < contact_count; ++index) {
    if (contacts_[index].is_commanded == commanded[index]) continue;
    contacts_[index] = {.is_commanded = commanded[index], .commanded_at = now};
  }
}

bool ContactorWatch::disobeys(const Measured<PduState>& pdu, const ContactorConfig& config, TimePoint now) {
  const std::array closed{pdu.value.main_positive_closed, pdu.value.main_negative_closed, pdu.value.precharge_closed,
                          pdu.value.charge_closed};
  bool any = false;
  for (std::size_t index = 0; index < contact_count; ++index) {
    Contact& contact = contacts_[index];
    if (pdu.taken_at > contact.commanded_at) any = judge(contact, closed[index], pdu.taken_at, config, now) || any;
  }
  return any;
}

bool ContactorWatch::is_settled() const {
  return std::all_of(contacts_.begin(), contacts_.end(), [](const Contact& contact) {
    return contact.has_settled && contact.obeying_since != TimePoint{};
  });
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
