#include "tools/bmuctl/limit_text.hpp"

#include "tools/common/page.hpp"

namespace bmu {

namespace {

std::string key(std::string_view name, Unit unit) {
  return std::string(name) + "_" + std::string(spec_of(unit).token);
}

/// "zero at 2.8000 V", "held at 4.2225 V" or "25 % are left"; "" without any of these.
std::string effect(const Reply& limit, Unit unit) {
  const Reply threshold = limit[key("threshold", unit)];
  const Reply holds = limit[key("holds", unit)];
  const Reply share = limit["share_permille"];
  if (threshold.is_known()) return ", zero at " + shown(threshold, unit);
  if (holds.is_known()) return ", held at " + shown(holds, unit);
  return share.is_known() ? ", " + shown(share, Unit::permille) + " are left" : "";
}

}  // namespace

namespace {

std::string reason(const Reply& limit, bool with_effect) {
  std::string text = limit["cause"].text();
  if (limit["part"].is_known()) text += ": " + limit["part"].text();
  if (limit["target_mA"].is_known()) text += " to " + shown(limit["target_mA"], Unit::mA);
  if (limit["pack_voltage_mV"].is_known()) {
    text += ": " + shown(limit["power_max_W"], Unit::W) + " at " + shown(limit["pack_voltage_mV"], Unit::mV);
  }
  for (const Unit unit : {Unit::uV, Unit::dC, Unit::permille, Unit::mA}) {
    const Reply value = limit[key("value", unit)];
    if (!value.is_known()) continue;
    const std::string place = limit["element"]["text"].text();
    text += ":" + (place.empty() ? "" : " " + place) + " at " + shown(value, unit) +
            (with_effect ? effect(limit, unit) : "");
  }
  return text;
}

}  // namespace

std::string limit_reason(const Reply& limit) {
  return reason(limit, true);
}

std::string limit_reason(const Reply& limit, std::size_t width) {
  const std::string whole = reason(limit, true);
  return width_of(whole) <= width ? whole : reason(limit, false);
}

}  // namespace bmu
