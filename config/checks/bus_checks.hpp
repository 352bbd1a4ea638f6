// Checks whether the buses can carry the traffic of the pack file: an error if a cycle does not fit, or if a bus
// without modules is too slow for its nodes, and a warning if little capacity remains.
#pragma once

#include <string>
#include <string_view>

#include "config/json/json_reader.hpp"
#include "config/types/pack.hpp"

namespace bmu {

/// Checks that all answers to one POLL, and those of modules that are polled singly, are complete before the next POLL,
/// for each poll period given. `place` is the root of the pack file; values that were already rejected are not checked,
/// nor is a period of 0, which the file does not give.
void check_cycle(const PackConfig& pack, const Place& place, ProblemList& problems);

/// Checks that the messages on a bus without modules fit into its bit rate.
void check_own_buses(const PackConfig& pack, const Place& place, ProblemList& problems);

/// Time allowed for an answer when a signal was lost once and the next is expected: the longest cycle and the sample
/// age of third-party modules, if the cycle is known and this is longer than `at_least`.
[[nodiscard]] Duration answer_margin(const PackConfig& pack, Duration at_least);

/// Default of `fast_period`: half the period, or the next multiple of five milliseconds at which the answers fit and
/// the load causes no warning; the period itself if there is none.
[[nodiscard]] Duration fast_period_left_out(const PackConfig& pack);

/// "internal bus at 500 kbit/s: in use for up to 13 % of the time, a poll cycle takes up to 14 ms". Precondition: the
/// pack was read without errors.
[[nodiscard]] std::string bus_use_text(const PackConfig& pack);

/// Warnings, which do not reject the pack file. Precondition: the pack was read without errors.
[[nodiscard]] ConfigProblems bus_warnings(const PackConfig& pack, std::string_view file_name);

}  // namespace bmu
