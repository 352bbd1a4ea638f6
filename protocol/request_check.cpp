#include "protocol/request_check.hpp"

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

CheckedFrame RequestCheck::check(const CanFrame& frame) {
  CheckedFrame verdict;
  const auto rejected = [&](RejectReason reason) {
    verdict.reason = reason;
    ++counts_.rejected[static_cast<std::size_t>(reason)];
    return verdict;
  };
  if (const auto fault = form_fault(frame)) return rejected(*fault);
  const MessageMatch match = internal_bus::catalogue.find(frame.id);
  if (match.message == nullptr) return rejected(RejectReason::unknown_id);
  verdict.message = match.message;
  verdict.node = match.node;
  if (const auto fault = content_fault(*match.message, frame)) return rejected(*fault);
  Heard& heard = heard_[slot_of(match)];
  const Heard now{.exists = true, .id = frame.id, .counter = frame.data[6], .crc = frame.data[7]};
  if (heard.exists && heard.id == now.id && heard.counter == now.counter) {
    return rejected(heard.crc == now.crc ? RejectReason::repeated_counter : RejectReason::conflicting);
  }
  heard = now;
  ++counts_.accepted;
  verdict.is_accepted = true;
  return verdict;
}

RequestCheck::Slot RequestCheck::slot_of(const MessageMatch& match) {
  if (match.message == &internal_bus::poll) return Slot::poll;
  return match.node == 0 ? Slot::command_to_all : Slot::command_to_us;
}

}  // namespace bmu
