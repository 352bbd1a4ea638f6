// One COMMAND to a module at a time. Its RESPONSE contains the counter of the COMMAND that it answers, and a RESPONSE
// to any but the last COMMAND is late: if a second COMMAND is sent meanwhile, the response to the first is lost, and a
// late frame is counted against a module without a defect.
#pragma once

#include <array>

#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// A RESPONSE is sent within 10 ms, and waits on a busy bus until all answers have been sent before it. One that has
/// not been received by then is lost.
inline constexpr Duration response_patience = 100ms;

class CommandTurns {
 public:
  [[nodiscard]] bool is_free(std::size_t module_index, TimePoint now) const {
    const TimePoint sent_at = sent_at_[module_index];
    return sent_at == TimePoint{} || now - sent_at >= response_patience;
  }
  void note_sent(std::size_t module_index, TimePoint now) { sent_at_[module_index] = now; }
  void note_response(std::size_t module_index) { sent_at_[module_index] = {}; }

 private:
  std::array<TimePoint, modules_max> sent_at_{};  // of a COMMAND without response; zero: none
  BMU_FIELDS(sent_at_)
};

}  // namespace bmu
