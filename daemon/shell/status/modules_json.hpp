// Identity and answers of the modules, as JSON and as text: expected and found, unknown modules, times and losses.
#pragma once

#include "daemon/shell/status/status_view.hpp"
#include "daemon/shell/status/why_words.hpp"

namespace bmu {

/// The reply to "modules": every module of the pack, then the unknown ones, the poll rate, and the last assignment.
[[nodiscard]] Json modules_json(const StatusView& view);
/// The rate at which modules are polled, and its period.
[[nodiscard]] Json poll_json(const CoreView& view);
/// Result of accepting the modules of one node, or with 0 of all: the accepted ones, those that were registered
/// already, those that could not be accepted and why, and other deviations. `before`: the registered modules before
/// that.
[[nodiscard]] Json acceptance_json(std::uint8_t node, const KnownModules& before, const CoreView& view);
/// The last "assign_module" and its result; null before the first.
[[nodiscard]] Json assignment_json(const CoreView& view);

/// The deviations of a module, a sentence each, with node and serial numbers: "module 3 is serial number 1007, expected
/// 1003, which is at node 5: they have changed places". Empty if there are none.
[[nodiscard]] Texts module_problems(const ModuleRecord& module, const CoreView& view);
/// The same for unknown modules: "an extra module at node 9, serial number 4711".
[[nodiscard]] Texts stranger_problems(const CoreView& view);
/// The deviations of all modules, known or unknown, that the row `fault` of the fault table is about.
[[nodiscard]] Texts problems_of(FaultId fault, const CoreView& view);
/// Missing data of a module without a complete answer: the age of its last answer, or of the stale value in it.
[[nodiscard]] std::string silence_text(const ModuleRecord& module, const CoreView& view);

}  // namespace bmu
