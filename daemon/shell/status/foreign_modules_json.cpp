#include "daemon/shell/status/foreign_modules_json.hpp"

#include <string>

#include "config/checks/foreign_module_checks.hpp"
#include "devices/device_list.hpp"
#include "protocol/signal.hpp"

namespace bmu {

namespace {

/// A capability that such modules lack, and the daemon's substitute for it.
struct Lack {
  bool (*holds)(const ModuleDriver&);
  std::string_view sentence;
};

constexpr bool always(const ModuleDriver&) {
  return true;
}

constexpr Lack lacks[] = {
    {[](const ModuleDriver& driver) { return !driver.has_checksum; },
     "their frames have no checksum and no counter: a frame that is wrong and whole on the bus is used, so two samples "
     "confirm a fault, values that no cell can have are counted and not used, and the sum of all cells is held against "
     "the pack's voltage"},
    {always,
     "they do not report when they measured, and an answer names no question: a voltage counts as older than the "
     "question that brought it, and a late answer as one to the question before"},
    {always,
     "they report no serial number: a module that was exchanged is not noticed, and its cells are taken for those "
     "before"},
    {always, "they take no node number from the daemon: they keep the one the car gave them"},
    {[](const ModuleDriver& driver) { return !driver.tells_stack_voltage; },
     "they do not measure their whole stack: the cells of one module are held against nothing but the pack's voltage"},
    {[](const ModuleDriver& driver) { return !driver.tells_errors; }, "they report no errors of their own"},
    {[](const ModuleDriver& driver) { return driver.tells_errors; },
     "the meaning of their errors is not known: any is a warning"},
    {[](const ModuleDriver& driver) { return !driver.has_board_temperature; },
     "they do not measure how hot their resistors are: balancing requires \"without_board_sensor\": true"},
    {always,
     "they bleed every cell above a commanded voltage, and it is not known for how long after the last command"},
};

std::string text_in_mV(std::int32_t value_uV) {
  return std::to_string(mV_from_uV(value_uV)) + " mV";
}

/// The limits for a pack file with such modules, in numbers.
std::string limits_sentence(const CoreConfig& config) {
  const std::int32_t upper_uV = foreign_overvoltage_margin_uV(config);
  return "they watch no cell by themselves and keep no limits: nothing but the daemon opens the pack, and its limits "
         "lie "
         "within what the cell file allows, by at least " +
         text_in_mV(foreign_margin_uV) + " for undervoltage and " + text_in_mV(upper_uV) + " for overvoltage";
}

std::string bled_sentence() {
  return "a cell reads low while it is bled, in a log of an i3 by " + text_in_mV(foreign_bled_low_uV) +
         ": bleeding pauses for a measurement, and where cells are balanced the overvoltage limit lies lower by that";
}

}  // namespace

Json foreign_modules_json(const CoreView& view) {
  const ModuleDriver* const driver = view.core.config().foreign.driver;
  if (driver == nullptr) return nullptr;
  Json cannot = Json::array({limits_sentence(view.core.config()), bled_sentence()});
  for (const Lack& lack : lacks) {
    if (lack.holds(*driver)) cannot.push_back(std::string(lack.sentence));
  }
  const std::optional<std::int32_t> above_uV = view.core.bleed_above_uV();
  return {{"protocol", std::string(driver->name)},
          {"title", std::string(find_device(driver->name)->title)},
          {"bleed_above_mV", above_uV ? Json(mV_from_uV(*above_uV)) : Json(nullptr)},
          {"cannot", std::move(cannot)}};
}

}  // namespace bmu
