// Worst-case load of a pack on its internal bus: every frame with the most stuff bits possible (protocol/can_bits.hpp).
//
// A poll cycle is a POLL and all answers to it. Its maximum duration is
//
//   cycle = (B8 + B8 + sum of answers x B8 + stronger(cycle)) / bit rate + 2 ms
//
// B8 is the longest frame of eight bytes, 135 bits: one that is already on the wire, the POLL, then all answers of the
// modules. The 2 ms are the protocol's limit for the start of an answer. `stronger` are the messages with a higher
// priority than answers during that time: CONTACTOR_COMMAND, PDU_STATUS and, if used, PDU_TEMPERATURE, each once a
// period and one more for a change, and of the other nodes' messages (config/checks/bus_guests.hpp) those with a lower
// identifier than the weakest answer. Messages with a lower priority than the answers, in particular the sensors'
// results, wait for them, at most for one cycle.
//
// A module with an incomplete answer is polled singly shortly before the next POLL, at most two modules a cycle
// (daemon/core/modules/poll_schedule.hpp). Their pending answers then add to the answers to that POLL:
//
//   period >= cycle + 2 x (POLL and the longest answer of a module) x B8 / bit rate
//
// The load is the time that all messages of the pack and of the other nodes on its bus take in their periods, with the
// most stuff bits possible; temperatures and IDENT in their own periods, regardless of the poll rate. Restarts, single
// polls, commands to modules and errors come in addition: the remaining capacity is for them. Pure; each call is a few
// hundred additions.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// Maximum time from the POLL to the start of the answer (docs/bus-protocol.md).
inline constexpr Duration answer_delay_max = 2ms;

/// Above this the remaining capacity is too small for the additional traffic.
inline constexpr std::int64_t bus_load_max_permille = 700;

/// Bit rates that controllers and modules support.
inline constexpr std::int32_t bus_rates_kbit_per_s[] = {125, 250, 500, 1'000};

/// Number of frames in one module's answer.
[[nodiscard]] std::int64_t answer_frames(const ModuleConfig& module, const PollWants& wants);

/// Everything that a POLL can request.
inline constexpr PollWants all_wants{.identity = true};

/// Maximum time from a POLL that is ready to be sent to the last bit of the last answer, rounded up to a nanosecond.
/// None if the higher-priority frames alone would fill the bus.
[[nodiscard]] std::optional<Duration> cycle_time_max(const CoreConfig& core, const PollWants& wants,
                                                     std::int32_t rate_kbit_per_s);

/// Minimum time from one POLL to the next, rounded up to a nanosecond: the longest cycle, and the pending answers of
/// modules that were polled singly before it. None: as with cycle_time_max.
[[nodiscard]] std::optional<Duration> period_min(const CoreConfig& core, std::int32_t rate_kbit_per_s);

/// Maximum load with a POLL every `period`; temperatures are polled every `temperature_every` of core.poll.period, or
/// with each POLL if that is slower. The other nodes on the bus follow from core.served_by.
[[nodiscard]] std::int64_t bus_load_permille(const CoreConfig& core, Duration period, std::int32_t rate_kbit_per_s);

/// Likewise for a bus without modules.
[[nodiscard]] std::int64_t guest_load_permille(const CoreConfig& core, Port bus, std::int32_t rate_kbit_per_s);

}  // namespace bmu
