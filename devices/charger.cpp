#include "devices/charger.hpp"

namespace bmu {

std::string_view to_text(ChargerTrouble trouble) {
  switch (trouble) {
    case ChargerTrouble::hardware: return "hardware failure";
    case ChargerTrouble::too_hot: return "too hot";
    case ChargerTrouble::mains: return "mains voltage wrong";
    case ChargerTrouble::battery: return "battery not connected, reversed or of a wrong voltage";
    case ChargerTrouble::no_command: return "hears no command";
    case ChargerTrouble::command_refused: return "command out of its range";
    case ChargerTrouble::output_overvoltage: return "output voltage too high";
    case ChargerTrouble::unnamed: return "an error that it does not name";
  }
  return "?";
}

}  // namespace bmu
