// Meaning of one seed: a pack, a drive and faults, each with a start and an end. All of it is drawn before the run, and
// each fault has numbers of its own: one can be left out, and everything else stays as it was.
//
// Some packs have a guest: a charger that is controlled over a bus, or an inverter. The plans of all others are drawn
// as if there were no guests at all.
//
//   Plan plan = draw_plan(17);
//   keep_only(plan, {1, 4});     of its faults those with these numbers, counted from 1
//
// A kind of fault is a row: its effect, the required reaction and the time for it. Times are those of the catalogue
// (docs/reaction-times.md), where each of them is measured; here they hold together with any other events.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/types/core_config.hpp"
#include "mmu/devices/random.hpp"
#include "tests/simulation/stage.hpp"

namespace bmu::test {

/// Effect of a fault on a pack that was closed when it started.
enum class Effect : std::uint8_t {
  opens,          // within its time, and nothing closes as long as it lasts
  opens_once,     // the same, but an open pack does not show it: it may be tried again
  opens_driving,  // as `opens`, but only if the vehicle alone requests a closed pack
  opens_at_end,   // counted from its end: the core itself was away
  may_open,       // depends on its time, or on its amount
  stays_closed,
};

/// End of the time.
enum class Reached : std::uint8_t {
  on_the_bus,   // CONTACTOR_COMMAND with all contactors open is through
  in_the_core,  // decided by the core; this bus carries nothing any more, and the PDU opens by itself
};

/// Device on the other bus.
enum class Guest : std::uint8_t { nobody, charger, inverter };

/// Runs in which a fault can occur, by their guest.
enum class Happens : std::uint8_t { to_anybody, to_any_guest, to_a_charger, to_an_inverter };

struct FaultEvent;

/// Drivers of all devices, by name.
[[nodiscard]] const std::vector<const ChargerDriver*>& charger_drivers();
[[nodiscard]] const std::vector<const InverterDriver*>& inverter_drivers();

/// Source of the drawn events.
struct Draw {
  const CoreConfig& config;
  RandomSource random;

  [[nodiscard]] std::int64_t between(std::int64_t least, std::int64_t most);
  [[nodiscard]] const ModuleConfig& module();
};

struct FaultKind {
  std::string_view name;
  std::string_view group;  // never two of a group at the same time
  Effect effect = Effect::opens;
  Duration allowed{};  // of effects that open
  Reached reached = Reached::on_the_bus;
  bool hides = false;  // others may be detected later while it lasts, or not at all
  Happens happens = Happens::to_anybody;
  Duration shortest = 500ms;
  Duration longest = 8s;
  void (*draw)(Draw&, FaultEvent&) = nullptr;
  // nullptr: only the event's texts, in the script language.
  void (*begin)(Stage&, const FaultEvent&) = nullptr;
  void (*end)(Stage&, const FaultEvent&) = nullptr;
};

/// Those that occur in all runs come first.
[[nodiscard]] std::span<const FaultKind> fault_kinds();
[[nodiscard]] bool can_happen(const FaultKind& kind, Guest guest);
[[nodiscard]] std::string_view to_text(Effect effect);

struct FaultEvent {
  std::size_t number = 0;  // in its plan, from 1
  const FaultKind* kind = nullptr;
  Duration begins_at{};  // since the start
  Duration ends_at{};
  std::string begin_text;
  std::string end_text;
  std::int64_t amount = 0;  // for kinds without a text: a share, a number of milliseconds, a choice

  [[nodiscard]] Duration length() const { return ends_at - begins_at; }
};

/// Action of an operator: key, charger, load.
struct DriveEvent {
  Duration at{};
  std::string text;
};

struct Plan {
  std::uint64_t seed = 0;
  std::string_view pack_name;
  const CoreConfig* config = nullptr;  // valid as long as the program, or as this plan
  std::shared_ptr<const CoreConfig> with_guest;
  Guest guest = Guest::nobody;
  bool ends_with_mains_cut = false;  // with a charger: at the end its charge is interrupted again, and has to go on
  Duration devices_ahead{};
  std::vector<DriveEvent> drive;
  std::vector<FaultEvent> faults;  // by their start
  Duration length{};               // all faults are over by then
};

/// `has_guests` false: all plans are drawn without guests.
[[nodiscard]] Plan draw_plan(std::uint64_t seed, bool has_guests = true);
void keep_only(Plan& plan, std::span<const std::size_t> numbers);
/// A line for each event, as `--trace` prints it.
[[nodiscard]] std::string to_text(const Plan& plan);

}  // namespace bmu::test
