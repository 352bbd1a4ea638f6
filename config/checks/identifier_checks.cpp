#include "config/checks/identifier_checks.hpp"

#include <string>
#include <string_view>
#include <vector>

#include "config/checks/device_rates.hpp"
#include "config/fields/pack_fields.hpp"
#include "devices/device_list.hpp"

namespace bmu {
namespace {

/// Consecutive identifiers that belong to one protocol.
struct Claim {
  std::string_view section;
  std::string_view key;
  std::string_view who;
  Port port;
  unsigned first = 0;
  unsigned count = 0;
  bool is_extended = false;
  bool is_protocol = false;  // the file names a protocol, not an identifier
};

/// Claims every message of the device that is not a row of the internal bus, because those rows are received anyway.
void claim_device(std::string_view section, std::string_view key, std::string_view name, Port port,
                  std::vector<Claim>& claims) {
  const Device& device = *find_device(name);
  for (const MessageSpec* message : device.catalogue->messages()) {
    const bool is_ours = !message->is_extended && internal_bus::catalogue.find(message->base_id).message == message;
    if (is_ours) continue;
    claims.push_back({section, key, device.title, port, message->base_id, 1, message->is_extended, true});
  }
}

void claim_sensors(const CoreConfig& core, std::vector<Claim>& claims) {
  const auto claim = [&claims](std::string_view section, std::string_view key, const auto* driver, Port port) {
    if (driver != nullptr) claim_device(section, key, driver->name, port, claims);
  };
  claim("sensor", "protocol", core.sensor.set_up, Port::internal);
  claim("sensor", "current_protocol", core.sensor.first, core.sensor.bus);
  claim("sensor", "second_protocol", core.sensor.second, core.sensor.bus);
  claim("insulation", "protocol", core.insulation.driver, core.insulation.bus);
  const auto claim_one = [&claims](std::string_view key, std::string_view who, unsigned id) {
    if (id != 0) claims.push_back({"sensor", key, who, Port::internal, id, 1});
  };
  claim_one("second_command_id", "commands to the second current sensor", core.sensor.second_command_id);
  claim_one("second_response_id", "answers of the second current sensor", core.sensor.second_response_id);
}

/// Claims the identifiers of every possible node, because modules with other numbers could be connected.
void add_modules(const CoreConfig& core, std::vector<Claim>& claims) {
  if (are_modules_ours(core)) return;
  const std::string_view title = find_device(core.foreign.driver->name)->title;
  for (const MessageSpec* message : core.foreign.driver->catalogue->messages()) {
    if (message->sender == Sender::sensor) continue;  // of the car, which the pack need not have
    for (std::uint32_t node = message->node_min; node <= message->node_max; ++node) {
      claims.push_back(
          {"foreign_modules", "protocol", title, Port::internal, message->id_of(node), 1, message->is_extended, true});
    }
  }
}

std::vector<Claim> claims_of(const PackConfig& pack) {
  constexpr unsigned messages = std::size(vehicle_bus::rows);
  const VehicleConfig& vehicle = pack.core.vehicle;
  std::vector<Claim> claims{
      {"vehicle", "base_id", "the messages to the vehicle", Port::vehicle, vehicle.base_id, messages}};
  add_modules(pack.core, claims);
  if (vehicle.request_id != 0) {
    claims.push_back({"vehicle", "request_id", "requests for data", Port::vehicle, vehicle.request_id, 1});
    claims.push_back({"vehicle", "reply_id", "answers to requests", Port::vehicle, reply_id_of(vehicle), 1});
  }
  const auto claim_cell_data = [&claims](std::string_view key, std::string_view who, unsigned id) {
    if (id != 0) claims.push_back({"vehicle", key, who, Port::vehicle, id, 1});
  };
  claim_cell_data("cell_voltages_id", "the cell voltages", vehicle.cell_voltages_id);
  claim_cell_data("cell_temperatures_id", "the cell temperatures", vehicle.cell_temperatures_id);
  if (pack.core.second_pack.base_id != 0) {
    claims.push_back({"second_pack", "base_id", "the messages of the second pack", Port::second_pack,
                      pack.core.second_pack.base_id, messages});
  }
  if (pack.core.charger.driver != nullptr) {
    claim_device("charger", "protocol", pack.core.charger.driver->name, Port::charger, claims);
  }
  if (pack.core.inverter.driver != nullptr) {
    claim_device("inverter", "protocol", pack.core.inverter.driver->name, Port::inverter, claims);
  }
  claim_sensors(pack.core, claims);
  return claims;
}

std::string in_quotes(unsigned id) {
  return "\"" + hex_text(id) + "\"";
}

Place place_of(const Claim& claim, const Place& root) {
  return root.at(claim.section).at(claim.key);
}

/// Value in the file: an identifier, or the name of a protocol.
std::string found_of(const Claim& claim) {
  return claim.is_protocol ? std::string(claim.who) : in_quotes(claim.first);
}

std::string identifiers(const Claim& claim) {
  if (claim.is_protocol) return "one with identifiers";
  return claim.count == 1 ? "an identifier" : "nine identifiers";
}

bool are_on_one_bus(const PackConfig& pack, Port one, Port other) {
  const ServedBy serving = served_by(pack.buses);
  return serving[static_cast<std::size_t>(one)] == serving[static_cast<std::size_t>(other)];
}

/// The identifiers of inverters are those of commands to MMUs and cannot be moved: they are allowed on another bus, and
/// beside third-party modules; those are separate claims.
void check_inverter_apart(const PackConfig& pack, const Place& root, ProblemList& problems) {
  const InverterDriver* const driver = pack.core.inverter.driver;
  if (driver == nullptr || !are_on_one_bus(pack, Port::inverter, Port::internal)) return;
  if (!are_modules_ours(pack.core)) return;
  const std::string title(find_device(driver->name)->title);
  problems.add(
      root.at("inverter").at("protocol"), title,
      "a bus of its own (buses/inverter) or the vehicle's, and not the internal one: 351 would be both COMMAND "
      "to a module and the limits for the " +
          title);
}

/// Third-party modules replace MMUs on that bus, and an inverter may be beside them.
void check_against_internal(const Claim& claim, const PackConfig& pack, const Place& root, ProblemList& problems) {
  const bool is_inverter = claim.port == Port::inverter;
  const bool is_beside =
      is_inverter && !are_modules_ours(pack.core) && are_on_one_bus(pack, Port::inverter, Port::internal);
  if (is_inverter && !is_beside) return;
  using namespace internal_bus;
  const bool is_without_ours = is_inverter || claim.section == "foreign_modules";
  const Catalogue& internal = is_without_ours ? catalogue_without_modules : catalogue;
  for (unsigned id = claim.first; id < claim.first + claim.count && !claim.is_extended; ++id) {
    const MessageSpec* const taken = internal.find(id).message;
    if (taken == nullptr) continue;
    problems.add(place_of(claim, root), found_of(claim),
                 identifiers(claim) + " that the internal bus does not use; " + hex_text(id) + " is " +
                     std::string(taken->name));
    return;
  }
}

/// The problem names both: either may be moved.
void check_pair(const PackConfig& pack, const Claim& one, const Claim& other, const Place& root,
                ProblemList& problems) {
  const bool are_together = are_on_one_bus(pack, one.port, other.port);
  const unsigned first_common = std::max(one.first, other.first);
  const bool is_one_protocol = one.port == other.port && one.section == other.section && one.key == other.key;
  if (!are_together || is_one_protocol || one.is_extended != other.is_extended ||
      first_common >= std::min(one.first + one.count, other.first + other.count))
    return;
  problems.add(place_of(other, root), found_of(other),
               identifiers(other) + " apart from those of " + std::string(one.who) + " (" + std::string(one.section) +
                   "/" + std::string(one.key) + "), or another bus; " + hex_text(first_common) + " would be both " +
                   std::string(one.who) + " and " + std::string(other.who));
}

}  // namespace

void check_identifiers(const PackConfig& pack, const Place& place, ProblemList& problems) {
  if (problems.is_good(place.at("inverter").at("protocol"))) check_inverter_apart(pack, place, problems);
  const std::vector<Claim> claims = claims_of(pack);
  const auto is_good = [&](const Claim& claim) { return problems.is_good(place_of(claim, place)); };
  for (std::size_t index = 0; index < claims.size(); ++index) {
    if (!is_good(claims[index])) continue;
    check_against_internal(claims[index], pack, place, problems);
    for (std::size_t before = 0; before < index && is_good(claims[index]); ++before) {
      if (is_good(claims[before])) check_pair(pack, claims[before], claims[index], place, problems);
    }
  }
}

ConfigProblems bus_clashes(const PackConfig& pack) {
  ProblemList problems;
  const Place place{pack.sources.pack_name, ""};
  check_identifiers(pack, place, problems);
  check_device_rates(pack, place, problems);
  return problems.take();
}

}  // namespace bmu
