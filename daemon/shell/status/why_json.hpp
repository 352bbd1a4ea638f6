// The reply to "why": the present state, the last opening and each limit as a chain from signal to decision; as data
// for programs, and as sentences for people.
#pragma once

#include "daemon/shell/json/core_view.hpp"

namespace bmu {

/// {"text":[sentences], "state":{...}, "to_do":[...], "last_opening":{...}|null, "limits":{...}}; every chain has
/// "steps", each {"kind":..., "text":..., and its numbers}.
[[nodiscard]] Json why_json(const CoreView& view);
/// The last opening alone, with "text" and "steps"; null if nothing has opened since start.
[[nodiscard]] Json opening_json(const CoreView& view);
/// The confirmed faults, [{"name":..., "reason":..., "text":..., "only_warns":...}]: why a clear did not end them.
[[nodiscard]] Json staying_faults_json(const CoreView& view);

}  // namespace bmu
