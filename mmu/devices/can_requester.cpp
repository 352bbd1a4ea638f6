#include "mmu/devices/can_requester.hpp"

#include "devices/lithiumate_requests/lithiumate_requests.hpp"
#include "mmu/devices/request_words.hpp"

namespace bmu {

namespace {

using namespace lithiumate_requests;

constexpr std::uint8_t read_mode = 0x10;
constexpr std::uint8_t clear_mode = 0x14;
constexpr std::uint8_t faults_parameter = 0x62;
/// Number of bytes after the first.
constexpr std::uint8_t bytes_asked = 3;

}  // namespace

void CanRequester::ask(std::size_t word) {
  if (word >= request_words.size() || count_ == waiting_max) return;
  const bool clears = word == request_words.size() - 1;
  CanFrame frame = make_frame(lithiumate_requests::request);
  frame.id = request_id_;
  write<lithiumate_requests::request, "byte_count">(frame, bytes_asked);
  write<lithiumate_requests::request, "mode">(frame, clears ? clear_mode : read_mode);
  write<lithiumate_requests::request, "parameter">(
      frame, clears ? faults_parameter : static_cast<std::int64_t>(parameter_names[word].raw));
  write<lithiumate_requests::request, "number">(frame, clears ? 0 : number);
  waiting_[(first_ + count_) % waiting_max] = frame;
  ++count_;
}

std::optional<CanFrame> CanRequester::take() {
  if (count_ == 0) return std::nullopt;
  const CanFrame frame = waiting_[first_];
  first_ = (first_ + 1) % waiting_max;
  --count_;
  return frame;
}

}  // namespace bmu
