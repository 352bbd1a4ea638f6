#include "tests/simulation/plan.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "config/checks/pack_defaults.hpp"
#include "config/pack_config.hpp"
#include "devices/device_list.hpp"
#include "tests/support/core_bench.hpp"
#include "tests/support/folders.hpp"

namespace bmu::test {

namespace {

struct Shape {
  std::string name;
  CoreConfig config;
  unsigned weight = 1;  // how often it is drawn; large packs take long
};

/// The emulated charger needs a final voltage, and the insulation monitor the full voltage of this pack.
CoreConfig with_full_cells(CoreConfig config) {
  config.cell.voltage_max_uV = 4'200'000;
  return config;
}
CoreConfig with_charge_contactor(CoreConfig config) {
  config.contactors.has_charge_contactor = true;
  return config;
}

CoreConfig shipped(const std::string& name) {
  const auto pack = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  if (!pack) throw std::runtime_error("config/packs/" + name + ".json cannot be read");
  return pack->core;
}

std::vector<Shape> make_shapes() {
  return {{"2x4", with_full_cells(small_pack()), 6},
          {"1x12", with_full_cells(pack_of(1)), 5},
          {"3x12 with charge contactor", with_charge_contactor(with_full_cells(pack_of(3))), 5},
          {"6x12", with_full_cells(pack_of(6)), 3},
          {"16x12", with_full_cells(pack_of(16)), 1},
          {"lipo-6s-24v", shipped("lipo-6s-24v"), 5},
          {"shell-eco-6s", shipped("shell-eco-6s"), 4},
          {"fs-20s3p-84v", shipped("fs-20s3p-84v"), 4},
          {"demo-48s", shipped("demo-48s"), 4},
          {"lfp-96s", shipped("lfp-96s"), 2},
          {"traction-16x12", shipped("traction-16x12"), 1}};
}

const Shape& draw_shape(RandomSource& random) {
  static const std::vector<Shape> shapes = make_shapes();
  unsigned all = 0;
  for (const Shape& shape : shapes) all += shape.weight;
  auto left = static_cast<unsigned>(random.next() % all);
  for (const Shape& shape : shapes) {
    if (left < shape.weight) return shape;
    left -= shape.weight;
  }
  return shapes.front();
}

Duration milliseconds_between(Draw& draw, Duration least, Duration most) {
  return std::chrono::milliseconds{draw.between(to_ms(least), to_ms(most))};
}

std::string amperes(std::int64_t current_mA) {
  return std::to_string(current_mA / 1'000) + "." + std::to_string(current_mA % 1'000 / 100);
}

constexpr Duration settles_for = 3s;  // modules identified and set up, insulation known
constexpr Duration faults_span = 40s;

void sort_drive(Plan& plan) {
  std::stable_sort(plan.drive.begin(), plan.drive.end(),
                   [](const DriveEvent& one, const DriveEvent& other) { return one.at < other.at; });
}

/// Key on and off, with loads of up to a fifth of the continuous current; at times a charger instead.
void draw_drive(Draw& draw, Plan& plan) {
  const CurrentLimitConfig& current = draw.config.current;
  Duration at = settles_for;
  while (at < faults_span) {
    const bool is_charging = draw.between(0, 4) == 0;
    const bool is_both = draw.between(0, 9) == 0;
    plan.drive.push_back({at, is_charging ? "charger connected" : "vehicle on"});
    if (is_both) plan.drive.push_back({at + 300ms, is_charging ? "vehicle on" : "charger connected"});
    const Duration off_at = at + milliseconds_between(draw, 4s, 18s);
    const std::int64_t most_mA = is_charging ? current.charge_continuous_mA / 5 : current.discharge_continuous_mA / 5;
    const std::string_view carrier = is_charging ? "charger current_A " : "load current_A ";
    for (Duration next = at + 3s; next < off_at; next += milliseconds_between(draw, 500ms, 4s)) {
      plan.drive.push_back({next, std::string(carrier) + amperes(draw.between(0, most_mA))});
    }
    if (draw.between(0, 3) != 0) plan.drive.push_back({off_at - 100ms, "load current_A 0; charger current_A 0"});
    plan.drive.push_back({off_at, "vehicle off; charger disconnected"});
    plan.drive.push_back({off_at + 200ms, "load current_A 0; charger current_A 0"});
    at = off_at + milliseconds_between(draw, 400ms, 12s);
  }
  sort_drive(plan);
}

/// Minimum time between two faults of a group.
constexpr Duration apart{50ms};

bool collides(const Plan& plan, const FaultEvent& event) {
  return std::any_of(plan.faults.begin(), plan.faults.end(), [&event](const FaultEvent& other) {
    return other.kind->group == event.kind->group && other.begins_at <= event.ends_at + apart &&
           event.begins_at <= other.ends_at + apart;
  });
}

/// Draws one of these kinds, unless another of its group is present then.
void draw_fault(Draw& draw, const std::vector<const FaultKind*>& kinds, Plan& plan) {
  FaultEvent event{.kind = kinds[static_cast<std::size_t>(draw.between(0, std::ssize(kinds) - 1))]};
  event.begins_at = milliseconds_between(draw, settles_for, faults_span);
  // Short ones as often as long ones.
  const Duration longest = milliseconds_between(draw, event.kind->shortest, event.kind->longest);
  event.ends_at = event.begins_at + milliseconds_between(draw, event.kind->shortest, longest);
  event.kind->draw(draw, event);
  if (!collides(plan, event)) plan.faults.push_back(std::move(event));
}

std::vector<const FaultKind*> kinds_that_happen(bool to_anybody, Guest guest) {
  std::vector<const FaultKind*> found;
  for (const FaultKind& kind : fault_kinds()) {
    if ((kind.happens == Happens::to_anybody) == to_anybody && can_happen(kind, guest)) found.push_back(&kind);
  }
  return found;
}

/// Uniform over the time of the drive; a kind that was drawn less often is not more likely.
void draw_faults(Draw& draw, Plan& plan) {
  static const std::vector<const FaultKind*> kinds = kinds_that_happen(true, Guest::nobody);
  const std::int64_t wanted = draw.between(2, 9);
  for (std::int64_t tried = 0; tried < wanted; ++tried) draw_fault(draw, kinds, plan);
}

void sort_faults(Plan& plan) {
  std::stable_sort(plan.faults.begin(), plan.faults.end(),
                   [](const FaultEvent& one, const FaultEvent& other) { return one.begins_at < other.begins_at; });
  for (std::size_t index = 0; index < plan.faults.size(); ++index) plan.faults[index].number = index + 1;
}

// --- guests ---------------------------------------------------------------------------------------------------------

template <class Driver>
std::vector<const Driver*> drivers(const Driver* Device::*kind) {
  std::vector<const Driver*> found;
  for (const Device* device : all_devices()) {
    if (device->*kind != nullptr) found.push_back(device->*kind);
  }
  return found;
}

/// Defaults of keys that a pack file would leave out, by the same rules; nothing else of the pack changes.
CoreConfig completed(const CoreConfig& config) {
  CoreConfig all = config;
  complete_defaults(all);
  return all;
}

void add_charger(Draw& draw, CoreConfig& config) {
  const bool is_brusa = draw.between(0, 3) == 0;
  const ChargerDriver& driver = *find_device(is_brusa ? "brusa_nlg5" : "elcon_tc")->charger;  // one in four
  config.charger = {.driver = &driver, .unit_count = static_cast<std::uint8_t>(draw.between(1, driver.unit_count_max))};
  config.charger.requests_mains = driver.can_request_mains && draw.between(0, 1) == 0;
  config.charger = completed(config).charger;
  const Port bus = draw.between(0, 1) == 0 ? Port::charger : Port::vehicle;
  config.served_by[static_cast<std::size_t>(Port::charger)] = bus;
}

void add_inverter(Draw& draw, CoreConfig& config) {
  using enum SilentInverter;
  constexpr SilentInverter reactions[] = {open, open, stop, warn};
  const auto form = static_cast<std::size_t>(draw.between(0, std::ssize(inverter_drivers()) - 1));
  config.inverter = {.driver = inverter_drivers()[form], .when_silent = reactions[draw.between(0, 3)]};
  config.inverter.silence_max = std::chrono::milliseconds{draw.between(2'000, 5'000)};
  config.inverter.soh_assumed_permille = 1'000;
  const CoreConfig all = completed(config);
  config.inverter.charge_voltage_max_mV = all.inverter.charge_voltage_max_mV;
  config.inverter.discharge_voltage_min_mV = all.inverter.discharge_voltage_min_mV;
  const Port bus = draw.between(0, 1) == 0 ? Port::inverter : Port::vehicle;
  config.served_by[static_cast<std::size_t>(Port::inverter)] = bus;
}

/// Plugged in most of the time, at times driven meanwhile, at times driven instead.
void draw_charges(Draw& draw, Plan& plan) {
  const CurrentLimitConfig& current = draw.config.current;
  plan.drive.clear();
  Duration at = settles_for;
  while (at < faults_span) {
    const bool is_driven_only = draw.between(0, 5) == 0;
    const bool is_both = draw.between(0, 4) == 0;
    const Duration off_at = at + milliseconds_between(draw, 5s, 26s);
    if (!is_driven_only) {
      // The current that it can give: less or more than commanded.
      const std::int64_t rating_mA = current.charge_continuous_mA * draw.between(2, 12) / 10;
      plan.drive.push_back({at, "charger current_A " + amperes(rating_mA) + "; charger connected"});
    }
    if (is_driven_only || is_both) {
      const Duration on_at = is_both ? at + milliseconds_between(draw, 300ms, 4s) : at;
      plan.drive.push_back({on_at, "vehicle on"});
      plan.drive.push_back(
          {on_at + 3s, "load current_A " + amperes(draw.between(0, current.discharge_continuous_mA / 5))});
    }
    plan.drive.push_back({off_at, "vehicle off; charger disconnected; load current_A 0"});
    at = off_at + milliseconds_between(draw, 400ms, 8s);
  }
}

/// A switch that is on for most of the time, with an inverter that draws and charges.
void draw_storage(Draw& draw, Plan& plan) {
  const CurrentLimitConfig& current = draw.config.current;
  plan.drive.clear();
  Duration at = settles_for;
  while (at < faults_span) {
    const Duration off_at = at + milliseconds_between(draw, 6s, 30s);
    plan.drive.push_back({at, "vehicle on"});
    for (Duration next = at + 2s; next < off_at; next += milliseconds_between(draw, 500ms, 5s)) {
      // It takes as much of this current as it is allowed.
      const bool is_charging = draw.between(0, 1) == 0;
      const std::int64_t most_mA = is_charging ? current.charge_continuous_mA : current.discharge_continuous_mA / 2;
      plan.drive.push_back(
          {next, std::string("inverter current_A ") + (is_charging ? "-" : "") + amperes(draw.between(0, most_mA))});
    }
    plan.drive.push_back({off_at, "vehicle off; inverter current_A 0"});
    at = off_at + milliseconds_between(draw, 400ms, 8s);
  }
}

/// A random sequence of its own: plans without a guest do not depend on it.
void draw_guest(const CoreConfig& config, Plan& plan) {
  constexpr std::int64_t charger_permille = 250;
  constexpr std::int64_t inverter_permille = 150;
  Draw chance{config, RandomSource(plan.seed ^ 0x6E57ULL)};
  const std::int64_t drawn = chance.between(0, 999);
  if (drawn >= charger_permille + inverter_permille) return;
  plan.guest = drawn < charger_permille ? Guest::charger : Guest::inverter;
  auto with_guest = std::make_shared<CoreConfig>(config);
  plan.guest == Guest::charger ? add_charger(chance, *with_guest) : add_inverter(chance, *with_guest);
  plan.with_guest = with_guest;
  plan.config = plan.with_guest.get();
  Draw draw{*plan.config, chance.random};
  plan.guest == Guest::charger ? draw_charges(draw, plan) : draw_storage(draw, plan);
  sort_drive(plan);
  plan.ends_with_mains_cut = plan.guest == Guest::charger && draw.between(0, 2) == 0;
  const std::vector<const FaultKind*> kinds = kinds_that_happen(false, plan.guest);
  const std::int64_t wanted = draw.between(1, 4);
  for (std::int64_t tried = 0; tried < wanted; ++tried) draw_fault(draw, kinds, plan);
}

std::string_view name_of_guest(const Plan& plan) {
  if (plan.guest == Guest::charger) return plan.config->charger.driver->name;
  return plan.guest == Guest::inverter ? plan.config->inverter.driver->name : std::string_view{};
}

std::string time_text(Duration at) {
  char text[24];
  std::snprintf(text, sizeof(text), "%9.3f s  ", to_s(at));
  return text;
}

}  // namespace

const std::vector<const ChargerDriver*>& charger_drivers() {
  static const std::vector<const ChargerDriver*> found = drivers(&Device::charger);
  return found;
}

const std::vector<const InverterDriver*>& inverter_drivers() {
  static const std::vector<const InverterDriver*> found = drivers(&Device::inverter);
  return found;
}

Plan draw_plan(std::uint64_t seed, bool has_guests) {
  RandomSource random(seed);
  const Shape& shape = draw_shape(random);
  Plan plan{.seed = seed, .pack_name = shape.name, .config = &shape.config};
  plan.devices_ahead = std::chrono::microseconds{random.next() % 1'000'000};
  Draw draw{shape.config, random};
  draw_drive(draw, plan);
  draw_faults(draw, plan);
  if (has_guests) draw_guest(shape.config, plan);
  sort_faults(plan);
  plan.length = faults_span;
  for (const FaultEvent& fault : plan.faults) plan.length = std::max(plan.length, fault.ends_at);
  // That of a guest goes on so long that it would overlap with the check of the recovery.
  if (plan.guest == Guest::nobody) return plan;
  std::erase_if(plan.drive, [&plan](const DriveEvent& event) { return event.at >= plan.length; });
  return plan;
}

void keep_only(Plan& plan, std::span<const std::size_t> numbers) {
  std::erase_if(plan.faults, [numbers](const FaultEvent& fault) {
    return std::find(numbers.begin(), numbers.end(), fault.number) == numbers.end();
  });
}

std::string to_text(const Plan& plan) {
  std::string text = "seed " + std::to_string(plan.seed) + ": " + std::string(plan.pack_name) + ", devices " +
                     std::to_string(plan.devices_ahead.count() / 1'000) + " us ahead";
  if (plan.guest != Guest::nobody) text += ", with " + std::string(name_of_guest(plan));
  text += "\n";
  for (const FaultEvent& fault : plan.faults) {
    text += time_text(fault.begins_at) + "fault " + std::to_string(fault.number) + ": " +
            std::string(fault.kind->name) + " for " + std::to_string(to_ms(fault.length())) + " ms";
    if (!fault.begin_text.empty()) text += " (" + fault.begin_text.substr(0, 60) + ")";
    if (fault.amount != 0) text += " (" + std::to_string(fault.amount) + ")";
    text += "\n";
  }
  return text;
}

}  // namespace bmu::test
