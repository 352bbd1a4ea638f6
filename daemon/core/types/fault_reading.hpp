// Input of a test of the fault table: one number, its element, its sample time.
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
  bool is_partial = false;  // an input of this row is missing: a failed test counts, a passed one does not
};

}  // namespace bmu
