#include "daemon/shell/foreign_modules_json.hpp"

#include <string>

#include "devices/device_list.hpp"
#include "protocol/signal.hpp"

namespace bmu {

namespace {

/// Something such modules cannot do, and what the daemon does instead.
struct Lack {
  bool (*holds)(const ModuleDriver&);
  std::string_view sentence;
};

constexpr bool always(const ModuleDriver&) {
  return true;
}

constexpr Lack lacks[] = {
    {always,
     "they watch no cell by themselves and keep no limits: nothing opens the pack but the daemon, and its limits lie "
     "10 "
     "mV within what the cell file allows"},
    {[](const ModuleDriver& driver) { return !driver.has_checksum; },
     "their frames have no checksum and no counter: a frame that is wrong and whole on the bus is believed, so two "
     "samples confirm a fault, and every cell is held against the pack's voltage"},
    {always, "they do not say when they measured: a voltage counts as older than the question that brought it"},
    {always,
     "they tell no serial number: a module that was exchanged is not noticed, and its cells are taken for those "
     "before"},
    {[](const ModuleDriver& driver) { return !driver.tells_stack_voltage; },
     "they do not measure their whole stack: the cells of one module are held against nothing but the pack's voltage"},
    {[](const ModuleDriver& driver) { return !driver.tells_errors; }, "they tell no errors of their own"},
    {[](const ModuleDriver& driver) { return driver.tells_errors; },
     "what their errors mean is not known: any is a warning"},
    {[](const ModuleDriver& driver) { return !driver.has_board_temperature; },
     "nobody sees how hot their resistors make them: balancing wants \"without_board_sensor\": true"},
    {always,
     "they bleed what is above a voltage they are told, and nobody knows for how long when they hear nothing more"},
};

}  // namespace

Json foreign_modules_json(const CoreView& view) {
  const ModuleDriver* const driver = view.core.config().foreign.driver;
  if (driver == nullptr) return nullptr;
  Json cannot = Json::array();
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
