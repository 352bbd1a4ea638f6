// Log of the recorder's state: each new black box, each change between a disk that accepts all data and one that does
// not, and lost data.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "daemon/core/records/event.hpp"
#include "daemon/shell/recorder/recorder.hpp"

namespace bmu {

class RecorderTeller {
 public:
  using Log = std::function<void(Severity severity, std::string_view line)>;

  /// To be called about once a second.
  void tell(const RecorderStatus& status, std::uint64_t pieces_lost, const Log& log);

 private:
  std::string told_path_;
  std::string told_box_error_;
  std::string told_record_error_;
  std::uint64_t told_frames_lost_ = 0;
  std::uint64_t told_boxes_lost_ = 0;
  std::uint64_t told_pieces_lost_ = 0;
};

}  // namespace bmu
