// Replies as text: one page per command.
#pragma once

#include "tools/bmuctl/reply.hpp"
#include "tools/common/page.hpp"

namespace bmu {

[[nodiscard]] Page status_page(const Reply& reply);
[[nodiscard]] Page cells_page(const Reply& reply);
/// Expects the "status" reply as well, under that key. In faults_text.cpp.
[[nodiscard]] Page faults_page(const Reply& reply);
/// The same, for the faults of a "faults" reply and the modules of a "status" reply.
[[nodiscard]] Page faults_page(const Reply& faults, const Reply& modules);
/// One fault, occurred or not: its meaning, freeze frame, typical cause and action.
[[nodiscard]] Page fault_page(const Reply& fault, const Reply& modules);
[[nodiscard]] Page why_page(const Reply& reply);
[[nodiscard]] Page clear_page(const Reply& reply);
/// True if the clear with this answer left a fault that does more than warn.
[[nodiscard]] bool leaves_faults(const Reply& reply);
/// In modules_text.cpp: the identity of the modules, their answers, and problems.
[[nodiscard]] Page modules_page(const Reply& reply);
[[nodiscard]] Page accept_page(const Reply& reply);
/// True if a present module could not be accepted, or if the given node has no module.
[[nodiscard]] bool leaves_unaccepted(const Reply& reply);
/// The page of a completed assignment, from a "modules" or "status" reply.
[[nodiscard]] Page assignment_page(const Reply& assignment);
[[nodiscard]] Page wake_page(const Reply& reply);
/// In reload_text.cpp: each changed value.
[[nodiscard]] Page reload_page(const Reply& reply);
/// State of balancing, its inhibits, and the state of each cell. In balance_text.cpp.
[[nodiscard]] Page balance_page(const Reply& reply);
/// "bleeding 3 cells", "idle: the pack file does not ask for balancing": from a "status" or "balance" reply.
[[nodiscard]] std::string balancing_text(const Reply& balancing);
/// Ageing of the cells, and the throughput of the pack. In health_text.cpp.
[[nodiscard]] Page health_page(const Reply& reply);
/// The chargers of a "status" reply; and whether the pack has none. In charger_text.cpp.
[[nodiscard]] Page charger_page(const Reply& status);
[[nodiscard]] bool has_no_charger(const Reply& status);
/// The inverter of a "status" reply, as a page and as a line of another page; and whether the pack has none. In
/// inverter_text.cpp.
[[nodiscard]] bool has_no_inverter(const Reply& status);
[[nodiscard]] Page inverter_page(const Reply& status);
[[nodiscard]] Line inverter_line(const Reply& inverter);
/// The buses, the frames refused on them, and the modules: from a "status" reply.
[[nodiscard]] Page buses_page(const Reply& status);
/// Throughput of the pack while it was last closed, how it closed and why it opened.
[[nodiscard]] Page drive_page(const Reply& reply);

/// Style of a value between its limits: warning or bad if it is beyond one, or if there is none.
[[nodiscard]] Style style_within(std::optional<std::int64_t> value, const Reply& limits, Unit unit);
/// "was closed for 12.0 s: charge used 0.1 Ah, ..."
[[nodiscard]] std::string drive_text(const Reply& drive);
[[nodiscard]] Style style_of_phase(std::string_view phase);
/// "cell 2.7 (no. 19): 2.7512 V, limit 2.8000 V, 3.1 s ago": the reading at which a fault was confirmed. `modules` are
/// those of a "status" reply.
[[nodiscard]] std::string fault_details(const Reply& fault, const Reply& modules);

}  // namespace bmu
