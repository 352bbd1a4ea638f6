// The least a program can do instead of the daemon: it commands closed, and open as soon as a frame says that the
// emergency stop is pressed. What it takes is the machine's share of what the daemon takes.
#pragma once

#include <string>

#include "daemon/shell/system/real_time.hpp"

namespace bmu::latency {

/// Until the process is killed; returns only if something does not work.
int answer_on(const std::string& bus, const RealTimeWishes& wishes);

}  // namespace bmu::latency
