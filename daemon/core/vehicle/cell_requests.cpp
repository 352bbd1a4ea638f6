#include "daemon/core/vehicle/cell_requests.hpp"

#include <algorithm>

#include "daemon/core/vehicle/cell_question.hpp"

namespace bmu {

namespace {

constexpr std::uint8_t mode_read = 0x10;
constexpr std::uint8_t mode_clear = 0x14;
constexpr std::uint8_t answer_bit = 0x40;
constexpr std::uint8_t pid_faults = 0x62;
constexpr std::uint8_t header_bytes = 3;  // mode and PID follow the first byte
constexpr std::uint8_t frame_length = 8;

const PidRow* find_row(std::uint8_t pid) {
  for (const std::span<const PidRow> rows : {cell_answers(), system_answers()}) {
    const auto found = std::find_if(rows.begin(), rows.end(), [pid](const PidRow& row) { return row.pid == pid; });
    if (found != rows.end()) return &*found;
  }
  return nullptr;
}

bool is_request(const CanFrame& frame, std::uint8_t mode) {
  return frame.length == frame_length && frame.data[0] == header_bytes && frame.data[1] == mode;
}

}  // namespace

std::optional<CanFrame> answer_request(const CanFrame& request, const CellRequestView& view) {
  if (!is_request(request, mode_read)) return std::nullopt;
  const PidRow* const row = find_row(request.data[2]);
  if (row == nullptr) return std::nullopt;
  const std::optional<RequestScope> scope = scope_of(row->about, request.data[3], view);
  if (!scope) return std::nullopt;
  const RequestData data = row->answer({view, *scope});
  if (data.empty()) return std::nullopt;
  CanFrame answer = data_frame(reply_id_of(view.config->vehicle), frame_length);
  answer.data = {static_cast<std::uint8_t>(header_bytes + data.size()), mode_read | answer_bit, request.data[2],
                 request.data[3]};
  std::copy(data.begin(), data.end(), answer.data.begin() + 1 + header_bytes);
  return answer;
}

bool is_clear_request(const CanFrame& request) {
  return is_request(request, mode_clear) && request.data[2] == pid_faults && request.data[3] == 0;
}

CanFrame clear_answer(const VehicleConfig& vehicle) {
  CanFrame answer = data_frame(reply_id_of(vehicle), frame_length);
  answer.data = {header_bytes, mode_clear | answer_bit, pid_faults};
  return answer;
}

void CellRequests::take(const CanFrame& request) {
  if (count_ == waiting_max) {
    ++counts_.dropped;
    return;
  }
  waiting_[(first_ + count_) % waiting_max] = request;
  ++count_;
}

std::optional<CanFrame> CellRequests::step(const CellRequestView& view) {
  if (count_ == 0) return std::nullopt;
  const CanFrame request = waiting_[first_];
  first_ = (first_ + 1) % waiting_max;
  --count_;
  // A clear request that is not permitted is never queued.
  const std::optional<CanFrame> answer =
      is_clear_request(request) ? std::optional(clear_answer(view.config->vehicle)) : answer_request(request, view);
  ++(answer ? counts_.answered : counts_.unanswered);
  return answer;
}

}  // namespace bmu
