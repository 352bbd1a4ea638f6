// What a script can ask of the emulated world: every state, one row each. A state is a flag (contactor closed), a
// number in the unit of its name, or a word: what a module does, or what a master that runs beside the pack says.
//
// Numbers are what is really there, not what a device makes of it; only a cell's voltage is what its channel says, as
// in the property of the same name. Reading costs a table row; nothing is changed.
#pragma once

#include "mmu/scenario/scenario.hpp"

namespace bmu {

struct World;

/// What a master beside the pack last said, as indices in its vocabulary.
struct MasterReport {
  std::uint16_t phase = 0;
  std::uint16_t opened_by = 0;
};

enum class StateKind : std::uint8_t {
  flag,    // true or not: no comparison
  number,  // a comparison with a number
  phase,   // = or != one of the master's phases
  cause,   // = or != one of the master's opening causes
  mode,    // = or != one of a module unit's modes
};

struct StateSpec {
  TargetKind target;
  std::string_view name;
  StateKind kind;
  /// `place` names what this pack has. A flag is 0 or 1, a word its index.
  double (*get)(const World&, const MasterReport&, ScenarioPlace place);
  std::string_view meaning;
};

[[nodiscard]] std::span<const StateSpec> state_table();

/// What the indices of such a state mean; none where it is no word.
[[nodiscard]] std::span<const std::string_view> words_of(StateKind kind, const MasterVocabulary& master);

}  // namespace bmu
