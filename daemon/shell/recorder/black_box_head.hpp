// Head of a black box: the event, its time, and the pack at that instant.
//
//   # black-box opened: the pack is open now, because of ...
//   # black-box-at (1700000000.123456)
//   # freeze | {                                   the fault's freeze frame, as bmuctl faults --json shows it
//   # freeze |   "cell_voltage_min_uV": 2795000,
#pragma once

#include <string>

#include "daemon/shell/recorder/record_queue.hpp"

namespace bmu {

[[nodiscard]] std::string black_box_head(const RecordTrigger& trigger);
/// For the file's name: "fault-cell-undervoltage", "opened-request-over".
[[nodiscard]] std::string black_box_word(const RecordTrigger& trigger);
/// An opening that is part of every drive.
[[nodiscard]] bool is_routine(const RecordTrigger& trigger);

}  // namespace bmu
