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
    log(Severity::info, "black box written: " + status.black_box_path);
  }
  const std::string box = change_of(told_box_error_, status.black_box_error,
                                    "black box: write failed, will be retried: ", "black box: written after a retry");
  if (!box.empty()) log(status.black_box_error.empty() ? Severity::info : Severity::warning, box);
  const std::string record = change_of(told_record_error_, status.record_error,
                                       "recording: write failed, will be retried: ", "recording: resumed");
  if (!record.empty()) log(status.record_error.empty() ? Severity::info : Severity::warning, record);
  // While a disk accepts nothing the count grows with every part.
  const bool is_news = status.frames_lost >= 2 * told_frames_lost_ || status.record_error.empty();
  if (is_news && status.frames_lost != std::exchange(told_frames_lost_, status.frames_lost)) {
    log(Severity::warning, "recording: " + std::to_string(status.frames_lost) + " s lost");
  }
  if (status.black_boxes_lost != std::exchange(told_boxes_lost_, status.black_boxes_lost)) {
    log(Severity::warning, "black box: " + std::to_string(status.black_boxes_lost) +
                               (status.black_boxes_lost == 1 ? " trigger" : " triggers") +
                               " without a complete black box");
  }
  if (pieces_lost != std::exchange(told_pieces_lost_, pieces_lost)) {
    log(Severity::warning, "recording: " + std::to_string(pieces_lost) + " entries lost (recorder thread stalled)");
  }
}

}  // namespace bmu
