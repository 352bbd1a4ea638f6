// One second of a recording, compressed: the unit of the black box memory and of the files of the recorder.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "protocol/time.hpp"

namespace bmu {

struct RecordFrame {
  std::shared_ptr<const std::string> bytes;  // a whole zstd frame
  bool begins_part = false;                  // with the complete state of the core; no earlier frame is needed
  TimePoint from{};
  TimePoint until{};
  std::int64_t unix_time_us = 0;  // at `from`
};

}  // namespace bmu
