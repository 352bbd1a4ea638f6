// What a row of the fault table judges: one number, where it comes from, how old it is.
#pragma once

#include <cstdint>

#include "daemon/core/types/element.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct Reading {
  bool is_known = false;  // unknown neither raises nor clears
  std::int64_t value = 0;
  Element element;
  TimePoint taken_at{};
  bool is_partial = false;  // something this row watches is missing: bad news counts, good news does not
};

}  // namespace bmu
