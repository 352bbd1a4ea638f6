// The minimal program in place of the daemon: it commands closed, and open as soon as a frame reports a pressed
// emergency stop. Its latency is the machine's share of the daemon's latency.
#pragma once

#include <string>

#include "daemon/shell/system/real_time.hpp"

namespace bmu::latency {

/// Runs until the process is killed; returns only on an error.
int answer_on(const std::string& bus, const RealTimeWishes& wishes);

}  // namespace bmu::latency
