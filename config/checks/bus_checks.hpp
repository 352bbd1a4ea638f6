// Whether the buses can carry what the pack file asks of them: refused where a cycle does not fit, or a bus without
// modules is too small for those on it, and a warning where little is left.
#pragma once

#include <string>
#include <string_view>

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// All answers to one POLL must be through before the next, at each pace that is given, and what modules that are asked
/// alone have to say besides. `place` is the root of the pack file; values that were already refused are not judged,
/// and nor is a pace of 0, which was left out.
void check_cycle(const PackConfig& pack, const Place& place, ProblemList& problems);

/// What is on a bus without modules must fit into its bit rate.
void check_own_buses(const PackConfig& pack, const Place& place, ProblemList& problems);

/// How long an answer may take where a signal was lost once and the next is waited for: the longest cycle, where that
/// is known and longer than `at_least`.
[[nodiscard]] Duration answer_margin(const PackConfig& pack, Duration at_least);

/// What `fast_period` is where the file leaves it out: half the period, or the next five milliseconds at which the
/// answers fit and the load is not warned of; the period itself where that is none.
[[nodiscard]] Duration fast_period_left_out(const PackConfig& pack);

/// "internal bus at 500 kbit/s: in use for up to 13 % of the time, a poll cycle takes up to 14 ms". Of a pack that was
/// read.
[[nodiscard]] std::string bus_use_text(const PackConfig& pack);

/// Nothing to refuse, but worth saying. Of a pack that was read.
[[nodiscard]] ConfigProblems bus_warnings(const PackConfig& pack, std::string_view file_name);

}  // namespace bmu
