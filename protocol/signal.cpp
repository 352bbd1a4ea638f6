#include "protocol/signal.hpp"

#include "protocol/message.hpp"

namespace bmu {

std::string_view to_text(Validity validity) {
  switch (validity) {
    case Validity::valid: return "valid";
    case Validity::unknown: return "unknown";
    case Validity::not_fitted: return "not fitted";
    case Validity::open_circuit: return "open";
    case Validity::short_circuit: return "shorted";
    case Validity::sensor_fault: return "sensor fault";
    case Validity::above_range: return "above range";
    case Validity::unchanged: return "unchanged";
    case Validity::out_of_range: return "out of range";
    case Validity::doubtful: return "doubtful";
  }
  return "?";
}

std::string_view to_text(Sender sender) {
  switch (sender) {
    case Sender::bmu: return "BMU";
    case Sender::mmu: return "MMU";
    case Sender::pdu: return "PDU";
    case Sender::sensor: return "SENSOR";
    case Sender::charger: return "CHARGER";
    case Sender::inverter: return "INVERTER";
    case Sender::insulation_monitor: return "INSULATION_MONITOR";
    case Sender::module: return "MODULE";
    case Sender::tool: return "TOOL";
  }
  return "?";
}

}  // namespace bmu
