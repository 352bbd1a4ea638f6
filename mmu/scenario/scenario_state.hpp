// States of the emulated world that a script can query, one row each. A state is a flag (contactor closed), a number in
// the unit of its name, or a word: the mode of a module, or a report of a master that runs beside the pack.
//
// Numbers are the actual values, not the measurements of a device; only a cell's voltage is that of its channel, as in
// the property of the same name. Reading costs a table row; nothing is changed.
#pragma once

#include "mmu/scenario/scenario.hpp"

namespace bmu {

struct World;

/// Last report of a master beside the pack, as indices in its vocabulary.
struct MasterReport {
  std::uint16_t phase = 0;
  std::uint16_t opened_by = 0;
};

enum class StateKind : std::uint8_t {
  flag,    // true or not: no comparison
  number,  // a comparison with a number
  phase,   // = or != one of the master's phases
  cause,   // = or != one of the master's opening causes
  mode,    // = or != one of a module's modes
};

struct StateSpec {
  TargetKind target;
  std::string_view name;
  StateKind kind;
  /// Precondition: this pack has `place`. A flag is 0 or 1, a word its index.
  double (*get)(const World&, const MasterReport&, ScenarioPlace place);
  std::string_view meaning;
};

[[nodiscard]] std::span<const StateSpec> state_table();

/// Words of the indices of such a state; none if it is not a word.
[[nodiscard]] std::span<const std::string_view> words_of(StateKind kind, const MasterVocabulary& master);

}  // namespace bmu
