// A second of a recording, compressed: what the memory of the black box and the files of the recorder are made of.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "protocol/time.hpp"

namespace bmu {

struct RecordFrame {
  std::shared_ptr<const std::string> bytes;  // a whole zstd frame
  bool begins_part = false;                  // with all that the core knows; nothing before is needed
  TimePoint from{};
  TimePoint until{};
  std::int64_t unix_time_us = 0;  // at `from`
};

}  // namespace bmu
