#include "daemon/core/contactors/close_request.hpp"

namespace bmu {

void CloseRequest::Line::follow(bool is_on) {
  is_wished = is_on && (is_wished || !was_on);
  was_on = is_on;
}

bool CloseRequest::follow(const PduState& pdu, bool contactors_open, TimePoint now) {
  const bool was_present = is_present();
  if (!lines_known_) {
    lines_known_ = true;
    vehicle_.was_on = pdu.vehicle_on;
    charger_.was_on = pdu.charger_connected;
    if (contactors_open) drop();
  }
  vehicle_.follow(pdu.vehicle_on);
  charger_.follow(pdu.charger_connected);
  is_plugged_in_ = pdu.charger_connected;
  if (is_present()) has_charger_asked_last_ = !vehicle_.is_wished;
  if (is_present() == was_present) return false;
  since_ = now;
  return true;
}

void CloseRequest::drop() {
  vehicle_.is_wished = false;
  drop_charger();
}

void CloseRequest::drop_charger() {
  charger_.is_wished = false;
}

}  // namespace bmu
