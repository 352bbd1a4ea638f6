#include "daemon/shell/recorder/recorder_teller.hpp"

#include <utility>

namespace bmu {

namespace {

/// Log text for an error that appeared, changed or ended; "" if it did not.
std::string change_of(std::string& told, const std::string& error, std::string_view what, std::string_view over) {
  if (error == told) return "";
  told = error;
  return error.empty() ? std::string(over) : std::string(what) + error;
}

}  // namespace

void RecorderTeller::tell(const RecorderStatus& status, std::uint64_t pieces_lost, const Log& log) {
  if (status.black_box_path != std::exchange(told_path_, status.black_box_path)) {
    log(Severity::info, "black box: " + status.black_box_path);
  }
  const std::string box = change_of(told_box_error_, status.black_box_error,
                                    "a black box waits for the disk: ", "the black box is written");
  if (!box.empty()) log(status.black_box_error.empty() ? Severity::info : Severity::warning, box);
  const std::string record =
      change_of(told_record_error_, status.record_error, "the recording waits for the disk: ", "the recording goes on");
  if (!record.empty()) log(status.record_error.empty() ? Severity::info : Severity::warning, record);
  // While a disk accepts nothing the count grows with every part.
  const bool is_news = status.frames_lost >= 2 * told_frames_lost_ || status.record_error.empty();
  if (is_news && status.frames_lost != std::exchange(told_frames_lost_, status.frames_lost)) {
    log(Severity::warning, "seconds that no recording has: " + std::to_string(status.frames_lost));
  }
  if (status.black_boxes_lost != std::exchange(told_boxes_lost_, status.black_boxes_lost)) {
    log(Severity::warning, "openings or faults of which no black box tells, or not to its end: " +
                               std::to_string(status.black_boxes_lost));
  }
  if (pieces_lost != std::exchange(told_pieces_lost_, pieces_lost)) {
    log(Severity::warning,
        "observations and decisions that no recording has, as its thread was held up: " + std::to_string(pieces_lost));
  }
}

}  // namespace bmu
