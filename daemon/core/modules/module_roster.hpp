// Registry of the modules: which module belongs on which node, and which one is there.
//
// The module of a node is identified by its serial number: the one in the pack file, else the one that was registered
// when it was first received there alone. A registration is permanent, over restarts of the daemon too: another serial
// number on the node, or registered modules that have changed places, is a finding until the right module is back, an
// authorised operator accepts the new one, or the pack file is changed. Registrations in a state file that cannot be
// read are unknown, and no module is registered in their place while the fault store_unreadable is present.
//
//   finding      found on the node                      expected there                 is a fault
//   unheard      nothing yet                            anything                       module_lost, if it stays so
//   unnamed      a module                               none registered                no; about to be registered
//   expected     A                                      A                              no
//   exchanged    X, of no node of this pack             A                              module_exchanged
//   misplaced    B, which another node expects          A, not seen on B's node        module_exchanged
//   swapped      B, which another node expects          A, seen on B's node            modules_swapped
//
// Modules on nodes that the pack does not have are unknown modules. Their reports of themselves are kept for as long as
// they send: node, serial number, and so the new node of a missing module.
//
// Cost: a compare a module if all are as expected; else a pass over all modules and unknown modules a finding.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"

namespace bmu {

struct KnownModule {
  bool is_known = false;
  std::uint32_t serial_number = 0;

  friend bool operator==(const KnownModule&, const KnownModule&) = default;
};
/// Indexed by node number; entry 0 is not used.
using KnownModules = std::array<KnownModule, internal_bus::node_count_max + 1>;

enum class ModulePlace : std::uint8_t { unheard, unnamed, expected, exchanged, misplaced, swapped };

[[nodiscard]] std::string_view to_text(ModulePlace place);

/// Reason why the module found on a node cannot be accepted there.
enum class AcceptRefusal : std::uint8_t {
  none,
  unheard,          // no IDENT has been received
  two_speak,        // two modules use this node number
  named_otherwise,  // the pack file has another serial number
};

[[nodiscard]] std::string_view to_text(AcceptRefusal refusal);

struct ModuleFinding {
  ModulePlace place = ModulePlace::unheard;
  KnownModule expected;         // unknown: any module
  bool is_from_file = false;    // `expected` is from the pack file
  std::uint8_t belongs_to = 0;  // the node that expects the module found here; 0: none
  std::uint8_t seen_at = 0;     // another node, in the pack or not, where the expected module has been seen; 0: none
};

/// A module on a node that the pack does not have.
struct StrangerRecord {
  TimePoint seen_at{};
  bool is_identified = false;
  std::uint32_t serial_number = 0;
  std::uint8_t cell_count = 0;
};

/// Timeout after which an unknown module counts as removed. Longer than the slowest poll and its answer.
inline constexpr Duration stranger_memory = 5s;

class ModuleRoster {
 public:
  void init(const CoreConfig& config);
  /// Registrations of previous sessions.
  void restore(const KnownModules& known) { known_ = known; }
  [[nodiscard]] const KnownModules& known() const { return known_; }

  [[nodiscard]] ModuleFinding finding(const ModuleRecord& module, const ModuleTable& modules, TimePoint now) const;
  /// The first module with this finding; null if there is none.
  [[nodiscard]] const ModuleRecord* first_with(ModulePlace place, const ModuleTable& modules, TimePoint now) const;

  /// Registers each module that is alone on a node without a registration. True if there was one.
  bool remember(const ModuleTable& modules, TimePoint now);
  [[nodiscard]] AcceptRefusal reason_against_accepting(const ModuleRecord& module, TimePoint now) const;
  /// Registers the module found on the node there, wherever it belonged before. False if there is a refusal.
  bool accept(const ModuleRecord& module, TimePoint now);
  /// The module was assigned this node: registers it there, if the pack has the node, and nowhere else. Returns the
  /// node where it was an unknown module until now; 0: none.
  std::uint8_t assign(std::uint8_t node, std::uint32_t serial_number);

  /// Handles a checked frame of a module that the pack does not have.
  void observe_stranger(const MessageSpec& message, std::uint8_t node, const CanFrame& frame, TimePoint at);
  [[nodiscard]] const StrangerRecord& stranger(std::uint8_t node) const { return strangers_[node]; }
  [[nodiscard]] bool is_stranger(std::uint8_t node, TimePoint now) const;
  /// An unknown module without an IDENT yet; 0: none.
  [[nodiscard]] std::uint8_t unidentified_stranger(TimePoint now) const;

  /// Node on which a serial number was received, of this pack or an unknown module; 0: none.
  [[nodiscard]] std::uint8_t node_of(std::uint32_t serial_number, const ModuleTable& modules, TimePoint now) const;
  /// The serial number that the pack file has for a node.
  [[nodiscard]] KnownModule named_by_file(std::uint8_t node) const { return named_[node]; }

 private:
  [[nodiscard]] const KnownModule& expected(std::uint8_t node) const;
  [[nodiscard]] std::uint8_t node_expecting(std::uint32_t serial_number) const;

  KnownModules named_{};
  KnownModules known_{};
  std::array<bool, internal_bus::node_count_max + 1> is_ours_{};
  std::array<StrangerRecord, internal_bus::node_count_max + 1> strangers_{};
  BMU_FIELDS(skipped(named_), known_, skipped(is_ours_), strangers_)
};

/// Two modules have used this node number within conflict_memory.
[[nodiscard]] bool has_rival(const ModuleRecord& module, TimePoint now);

}  // namespace bmu
