// One COMMAND to a module at a time. Its RESPONSE carries the counter of the COMMAND it answers, and one that answers
// any but the last is late: who sends a second one meanwhile loses the first one's answer, and counts a late frame
// against a module that did nothing wrong.
#pragma once

#include <array>

#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// A RESPONSE comes within 10 ms, and waits on a busy bus until all answers have gone before it. One that has not come
/// by then is lost.
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
  std::array<TimePoint, modules_max> sent_at_{};  // of a COMMAND that is not answered; zero: none
  BMU_FIELDS(sent_at_)
};

}  // namespace bmu
