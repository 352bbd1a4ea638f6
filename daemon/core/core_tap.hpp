// Observer of a core: receives every observation and every decision in order, for a recording. The owner of a core must
// forward both to the tap.
#pragma once

#include "daemon/core/decisions.hpp"
#include "daemon/core/types/observation.hpp"

namespace bmu {

class CoreTap {
 public:
  CoreTap() = default;
  CoreTap(const CoreTap&) = delete;
  CoreTap& operator=(const CoreTap&) = delete;
  virtual ~CoreTap() = default;

  virtual void observed(const Observation& observation) = 0;
  virtual void decided(TimePoint at, const Decisions& decisions) = 0;
};

}  // namespace bmu
