// What a pack asks of its internal bus at worst: every frame as long as stuffing can make it (protocol/can_bits.hpp).
//
// A poll cycle is a POLL and all answers to it. Its longest time is
//
//   cycle = (B8 + B8 + sum of answers x B8 + stronger(cycle)) / bit rate + 2 ms
//
// B8 is the longest frame of eight bytes, 135 bits: one that is already on the wire, the POLL, then all that the
// modules have to say. The 2 ms are what the protocol gives a module to begin. `stronger` is what goes ahead of answers
// meanwhile: CONTACTOR_COMMAND and PDU_STATUS, each once a period and once more for a change, and of the others on the
// bus (config/checks/bus_guests.hpp) those with a lower identifier than the weakest answer. What is weaker than the
// answers, the sensors' results above all, waits for them, as long as a cycle at most.
//
// Who owes something of its answer is asked alone shortly before the next POLL, at most two modules a cycle
// (daemon/core/modules/poll_schedule.hpp). What they still have to say then comes on top of the answers to that POLL:
//
//   period >= cycle + 2 x (POLL and the longest answer of a module) x B8 / bit rate
//
// The load is what all messages of the pack and of the others on its bus take together, in their periods, with as many
// stuff bits as there can be; temperatures and IDENT in their own, whatever the pace. Restarts, modules asked alone,
// commands to modules and errors come on top: that is what the rest is for. Pure; each call is a few hundred additions.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"

namespace bmu {

/// From the POLL to the start of the answer, at most (docs/bus-protocol.md).
inline constexpr Duration answer_delay_max = 2ms;

/// Above this there is too little left for what comes on top.
inline constexpr std::int64_t bus_load_max_permille = 700;

/// What controllers and modules can be set to.
inline constexpr std::int32_t bus_rates_kbit_per_s[] = {125, 250, 500, 1'000};

/// The frames of one module's answer.
[[nodiscard]] std::int64_t answer_frames(const ModuleConfig& module, const PollWants& wants);

/// Everything a POLL can ask for.
inline constexpr PollWants all_wants{.identity = true};

/// From a POLL that is ready to be sent to the last bit of the last answer, at worst. Rounded up to a
/// nanosecond. With a bus that the stronger frames alone would fill there is none.
[[nodiscard]] std::optional<Duration> cycle_time_max(const CoreConfig& core, const PollWants& wants,
                                                     std::int32_t rate_kbit_per_s);

/// From one POLL to the next at least, rounded up to a nanosecond: the longest cycle, and what modules that were asked
/// alone before it may still have to say. None: as with cycle_time_max.
[[nodiscard]] std::optional<Duration> period_min(const CoreConfig& core, std::int32_t rate_kbit_per_s);

/// At worst, with a POLL every `period`; temperatures are asked for every `temperature_every` of core.poll.period, or
/// with each POLL where that is slower. Who else is on the bus follows from core.served_by.
[[nodiscard]] std::int64_t bus_load_permille(const CoreConfig& core, Duration period, std::int32_t rate_kbit_per_s);

/// Of a bus without modules, likewise.
[[nodiscard]] std::int64_t guest_load_permille(const CoreConfig& core, Port bus, std::int32_t rate_kbit_per_s);

}  // namespace bmu
