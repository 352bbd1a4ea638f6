#include "devices/charger.hpp"

namespace bmu {
namespace {

/// In the order of ChargerTrouble.
struct TroubleRow {
  ChargerTrouble trouble;
  std::string_view text;
  bool is_normal_while_idle = false;  // while no charging is requested
};
constexpr std::array<TroubleRow, charger_trouble_count> trouble_rows{{
    {ChargerTrouble::hardware, "hardware failure"},
    {ChargerTrouble::too_hot, "too hot"},
    {ChargerTrouble::mains, "mains voltage wrong"},
    {ChargerTrouble::battery, "battery reversed or of a wrong voltage"},
    {ChargerTrouble::no_command, "hears no command", true},
    {ChargerTrouble::command_refused, "command out of its range"},
    {ChargerTrouble::output_overvoltage, "output voltage too high"},
    {ChargerTrouble::unnamed, "an error that it does not name"},
    {ChargerTrouble::no_battery, "battery not connected, or its voltage low", true},
    {ChargerTrouble::no_mains, "mains voltage low", true},
}};

}  // namespace

std::string_view to_text(ChargerTrouble trouble) {
  const auto index = static_cast<std::size_t>(trouble);
  return index < trouble_rows.size() ? trouble_rows.at(index).text : "?";
}

std::uint16_t troubles_among(std::uint16_t bits, bool is_asked) {
  for (const TroubleRow& row : trouble_rows) {
    if (row.is_normal_while_idle && !is_asked) bits &= static_cast<std::uint16_t>(~bit_of(row.trouble));
  }
  return bits;
}

}  // namespace bmu
