// Hears all that a core is told and all that it decides, in that order: what a recording is made of. Whoever feeds a
// core tells its tap, too.
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
