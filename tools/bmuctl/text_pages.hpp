// Replies as text for people: one page a command.
#pragma once

#include "tools/bmuctl/reply.hpp"
#include "tools/common/page.hpp"

namespace bmu {

[[nodiscard]] Page status_page(const Reply& reply);
[[nodiscard]] Page cells_page(const Reply& reply);
/// Wants the "status" reply as well, under that key. In faults_text.cpp.
[[nodiscard]] Page faults_page(const Reply& reply);
/// The same, of the faults of a "faults" reply and the modules of a "status" reply.
[[nodiscard]] Page faults_page(const Reply& faults, const Reply& modules);
/// One of them, seen or not: what it is, what is remembered, what is often behind it and what to do.
[[nodiscard]] Page fault_page(const Reply& fault, const Reply& modules);
[[nodiscard]] Page why_page(const Reply& reply);
[[nodiscard]] Page clear_page(const Reply& reply);
/// Whether a fault that does more than warn was not ended by the clear this is the answer to.
[[nodiscard]] bool leaves_faults(const Reply& reply);
/// In modules_text.cpp: who the modules are, how they answer, what is wrong with that.
[[nodiscard]] Page modules_page(const Reply& reply);
[[nodiscard]] Page accept_page(const Reply& reply);
/// Whether a module that is there could not be accepted, or, of one node, none is there.
[[nodiscard]] bool leaves_unaccepted(const Reply& reply);
/// Of an assignment that is over, as "modules" and "status" tell it.
[[nodiscard]] Page assignment_page(const Reply& assignment);
[[nodiscard]] Page wake_page(const Reply& reply);
/// In reload_text.cpp: each value that is another one now.
[[nodiscard]] Page reload_page(const Reply& reply);
/// What balancing does, why not, and each cell's part in it. In balance_text.cpp.
[[nodiscard]] Page balance_page(const Reply& reply);
/// "bleeding 3 cells", "idle: the pack file does not ask for balancing": of a "status" or "balance" reply.
[[nodiscard]] std::string balancing_text(const Reply& balancing);
/// How the cells have aged, and what has flowed through the pack. In health_text.cpp.
[[nodiscard]] Page health_page(const Reply& reply);
/// The chargers of a "status" reply; and whether the pack has none. In charger_text.cpp.
[[nodiscard]] Page charger_page(const Reply& status);
[[nodiscard]] bool has_no_charger(const Reply& status);
/// The inverter of a "status" reply, as a page and as a line of another; and whether the pack has none. In
/// inverter_text.cpp.
[[nodiscard]] bool has_no_inverter(const Reply& status);
[[nodiscard]] Page inverter_page(const Reply& status);
[[nodiscard]] Line inverter_line(const Reply& inverter);
/// The buses, what was refused on them, and the modules: of a "status" reply.
[[nodiscard]] Page buses_page(const Reply& status);
/// What went through the pack while it was last closed, how it closed and why it opened.
[[nodiscard]] Page drive_page(const Reply& reply);

/// Style of a value between its limits: warning or bad where it is beyond one, or where there is none.
[[nodiscard]] Style style_within(std::optional<std::int64_t> value, const Reply& limits, Unit unit);
/// "was closed for 12.0 s: charge used 0.1 Ah, ..."
[[nodiscard]] std::string drive_text(const Reply& drive);
[[nodiscard]] Style style_of_phase(std::string_view phase);
/// "cell 2.7 (no. 19): 2.7512 V, limit 2.8000 V, 3.1 s ago": what was seen when a fault was believed. `modules` are
/// those of a "status" reply.
[[nodiscard]] std::string fault_details(const Reply& fault, const Reply& modules);

}  // namespace bmu
