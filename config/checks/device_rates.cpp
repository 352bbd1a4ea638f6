#include "config/checks/device_rates.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "config/fields/pack_fields.hpp"
#include "devices/device_list.hpp"

namespace bmu {
namespace {

constexpr std::uint32_t bit_per_kbit = 1'000;

/// The key that has the bit rate of a bus.
struct RateKey {
  Port bus;
  std::string_view section;
  std::string_view key;
  std::int32_t (*in_file)(const PackConfig&);  // 0: the file has none
};
template <auto Member>
std::int32_t interface_rate(const PackConfig& pack) {
  return pack.interfaces.*Member;
}
constexpr RateKey rate_keys[] = {
    {Port::internal, "buses", "internal_kbit_per_s",
     [](const PackConfig& pack) { return pack.buses.internal_kbit_per_s; }},
    {Port::vehicle, "interfaces", "vehicle_kbit_per_s", interface_rate<&InterfaceConfig::vehicle_kbit_per_s>},
    {Port::charger, "interfaces", "charger_kbit_per_s", interface_rate<&InterfaceConfig::charger_kbit_per_s>},
    {Port::second_pack, "interfaces", "second_pack_kbit_per_s",
     interface_rate<&InterfaceConfig::second_pack_kbit_per_s>},
    {Port::inverter, "interfaces", "inverter_kbit_per_s", interface_rate<&InterfaceConfig::inverter_kbit_per_s>},
};

const RateKey& rate_key_of(Port bus) {
  return *std::find_if(std::begin(rate_keys), std::end(rate_keys),
                       [bus](const RateKey& row) { return row.bus == bus; });
}

/// A device that the file names, and the key that names it.
struct NamedDevice {
  const Device* device;
  std::string_view section;
  std::string_view key;
};

/// Devices on the bus that is served by `bus`, chargers first. Requests for single values are answered at any rate.
std::vector<NamedDevice> devices_on(const CoreConfig& core, Port bus) {
  std::vector<NamedDevice> devices;
  const auto add = [&](const auto* driver, Port port, std::string_view section, std::string_view key) {
    if (driver != nullptr && serves(core, bus, port)) devices.push_back({find_device(driver->name), section, key});
  };
  add(core.charger.driver, Port::charger, "charger", "protocol");
  add(core.insulation.driver, core.insulation.bus, "insulation", "protocol");
  add(core.sensor.set_up, Port::internal, "sensor", "protocol");
  add(core.sensor.first, core.sensor.bus, "sensor", "current_protocol");
  add(core.sensor.second, core.sensor.bus, "sensor", "second_protocol");
  add(core.inverter.driver, Port::inverter, "inverter", "protocol");
  add(core.foreign.driver, Port::internal, "foreign_modules", "protocol");
  return devices;
}

bool can_have(const NamedDevice& named, std::uint32_t bit_rate) {
  const auto& rates = named.device->bit_rates;
  return std::find(rates.begin(), rates.end(), bit_rate) != rates.end();
}

/// First rate of the first device that all others support, otherwise its usual one; 0 without a device.
std::int32_t common_kbit_per_s(const std::vector<NamedDevice>& devices) {
  if (devices.empty()) return 0;
  const auto& rates = devices.front().device->bit_rates;
  const auto common = std::find_if(rates.begin(), rates.end(), [&devices](std::uint32_t rate) {
    return std::all_of(devices.begin(), devices.end(),
                       [rate](const NamedDevice& other) { return can_have(other, rate); });
  });
  return static_cast<std::int32_t>((common != rates.end() ? *common : rates.front()) / bit_per_kbit);
}

/// "250 or 500, the bit rates of Elcon or TC charger (charger/protocol)".
std::string rates_text(const NamedDevice& named) {
  std::vector<std::uint32_t> rates(named.device->bit_rates.begin(), named.device->bit_rates.end());
  std::sort(rates.begin(), rates.end());
  std::string text;
  for (const std::uint32_t rate : rates) text += (text.empty() ? "" : " or ") + std::to_string(rate / bit_per_kbit);
  return text + (rates.size() == 1 ? ", the only bit rate of " : ", the bit rates of ") +
         std::string(named.device->title) + " (" + std::string(named.section) + "/" + std::string(named.key) + ")";
}

void check_bus(const PackConfig& pack, const RateKey& row, const Place& root, ProblemList& problems) {
  const std::int32_t rate_kbit_per_s = row.in_file(pack);
  const Place place = root.at(row.section).at(row.key);
  if (rate_kbit_per_s == 0) return;
  for (const NamedDevice& named : devices_on(pack.core, row.bus)) {
    if (can_have(named, static_cast<std::uint32_t>(rate_kbit_per_s) * bit_per_kbit)) continue;
    if (!problems.is_good(place) || !problems.is_good(root.at(named.section).at(named.key))) continue;
    problems.add(place, std::to_string(rate_kbit_per_s), rates_text(named));
  }
}

}  // namespace

std::int32_t bit_rate_kbit_per_s(const PackConfig& pack, Port bus) {
  const std::int32_t in_file = rate_key_of(bus).in_file(pack);
  return in_file != 0 ? in_file : common_kbit_per_s(devices_on(pack.core, bus));
}

void check_device_rates(const PackConfig& pack, const Place& place, ProblemList& problems) {
  for (const RateKey& row : rate_keys) check_bus(pack, row, place, problems);
}

}  // namespace bmu
