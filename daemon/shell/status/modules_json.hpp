// Who the modules are and how they answer, as JSON and in words: expected against found, strangers, times and losses.
#pragma once

#include "daemon/shell/status/status_view.hpp"
#include "daemon/shell/status/why_words.hpp"

namespace bmu {

/// The answer to "modules": every module of the pack, then the strangers, the pace, and the last assignment.
[[nodiscard]] Json modules_json(const StatusView& view);
/// The pace at which modules are asked, and its period.
[[nodiscard]] Json poll_json(const CoreView& view);
/// The last "assign_module" and what came of it; null before the first.
/// What became of accepting the modules of one node, or with 0 of all: who was accepted, who belonged there already,
/// who could not be accepted and why, what else of them is not as expected. `before`: who was remembered before that.
[[nodiscard]] Json acceptance_json(std::uint8_t node, const KnownModules& before, const CoreView& view);
[[nodiscard]] Json assignment_json(const CoreView& view);

/// What is not as expected of a module, a sentence each, with node and serial numbers: "module 3 is serial number 1007,
/// expected 1003, which is at node 5: they have changed places". Nothing if all is well.
[[nodiscard]] Texts module_problems(const ModuleRecord& module, const CoreView& view);
/// The same of strangers: "an extra module at node 9, serial number 4711".
[[nodiscard]] Texts stranger_problems(const CoreView& view);
/// Of all modules and strangers: what the rows of the fault table named `fault` are about.
[[nodiscard]] Texts problems_of(FaultId fault, const CoreView& view);
/// What a module that does not answer, or not completely, owes: its last answer, or what in its answers is too old.
[[nodiscard]] std::string silence_text(const ModuleRecord& module, const CoreView& view);

}  // namespace bmu
