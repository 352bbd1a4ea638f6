// Which module belongs on which node, and which one is there.
//
// A node's module is known by its serial number: the one the pack file names, else the one that was remembered when it
// was first seen there alone. Known is for good, over restarts of the daemon too: another serial number on the node, or
// known ones that have changed places, is a finding until the right module is back, somebody with authority accepts the
// new one, or the pack file says otherwise. What may have been known and cannot be read is not known, and nothing is
// remembered in its place while the fault that says so stands.
//
//   finding      found on the node                      expected there                 is a fault
//   unheard      nothing yet                            anything                       module_lost, if it stays so
//   unnamed      somebody                               nobody is known                no; about to be remembered
//   expected     A                                      A                              no
//   exchanged    X, of no node of this pack             A                              module_exchanged
//   misplaced    B, which another node expects          A, not seen on B's node        module_exchanged
//   swapped      B, which another node expects          A, seen on B's node            modules_swapped
//
// Modules on nodes that the pack does not have are strangers. What they say of themselves is kept for as long as they
// talk: which node, which serial number, and so where a missing module went.
//
// Cost: a compare a module where all is well; where it is not, a pass over all modules and strangers a finding.
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
/// By node number; the place of 0 is not used.
using KnownModules = std::array<KnownModule, internal_bus::node_count_max + 1>;

enum class ModulePlace : std::uint8_t { unheard, unnamed, expected, exchanged, misplaced, swapped };

[[nodiscard]] std::string_view to_text(ModulePlace place);

/// Why the module found on a node cannot be accepted there.
enum class AcceptRefusal : std::uint8_t {
  none,
  unheard,          // nobody has said who is there
  two_speak,        // which of them?
  named_otherwise,  // the pack file names another one
};

[[nodiscard]] std::string_view to_text(AcceptRefusal refusal);

struct ModuleFinding {
  ModulePlace place = ModulePlace::unheard;
  KnownModule expected;         // not known: nobody in particular
  bool is_from_file = false;    // the pack file names it
  std::uint8_t belongs_to = 0;  // the node that expects the module found here; 0: none does
  std::uint8_t seen_at = 0;     // the other node, a stranger's perhaps, where the expected one has been seen; 0: none
};

/// A module on a node that the pack does not have.
struct StrangerRecord {
  TimePoint seen_at{};
  bool is_identified = false;
  std::uint32_t serial_number = 0;
  std::uint8_t cell_count = 0;
};

/// A stranger that has been silent for longer is gone. Longer than the slowest poll and its answer.
inline constexpr Duration stranger_memory = 5s;

class ModuleRoster {
 public:
  void init(const CoreConfig& config);
  /// What former lives remembered.
  void restore(const KnownModules& known) { known_ = known; }
  [[nodiscard]] const KnownModules& known() const { return known_; }

  [[nodiscard]] ModuleFinding finding(const ModuleRecord& module, const ModuleTable& modules, TimePoint now) const;
  /// The first module with this finding; null if there is none.
  [[nodiscard]] const ModuleRecord* first_with(ModulePlace place, const ModuleTable& modules, TimePoint now) const;

  /// Remembers who speaks alone on a node of which nobody was known. True if there was somebody.
  bool remember(const ModuleTable& modules, TimePoint now);
  [[nodiscard]] AcceptRefusal reason_against_accepting(const ModuleRecord& module, TimePoint now) const;
  /// From now on the module found on the node belongs there, wherever it belonged before. False if there is a reason
  /// against it.
  bool accept(const ModuleRecord& module, TimePoint now);
  /// The module was given this node: it belongs there, if the pack has it, and nowhere else. Returns the node where it
  /// was a stranger until now; 0: it was none.
  std::uint8_t assign(std::uint8_t node, std::uint32_t serial_number);

  /// A checked frame of a module that the pack does not have.
  void observe_stranger(const MessageSpec& message, std::uint8_t node, const CanFrame& frame, TimePoint at);
  [[nodiscard]] const StrangerRecord& stranger(std::uint8_t node) const { return strangers_[node]; }
  [[nodiscard]] bool is_stranger(std::uint8_t node, TimePoint now) const;
  /// A stranger who has not said who it is; 0: none.
  [[nodiscard]] std::uint8_t unidentified_stranger(TimePoint now) const;

  /// Where a serial number has been seen, of this pack or a stranger; 0: nowhere.
  [[nodiscard]] std::uint8_t node_of(std::uint32_t serial_number, const ModuleTable& modules, TimePoint now) const;
  /// The serial number the pack file names for a node.
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

/// Two modules have spoken under this node number lately.
[[nodiscard]] bool has_rival(const ModuleRecord& module, TimePoint now);

}  // namespace bmu
