#include "protocol/receive_check.hpp"

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

std::string_view to_text(RejectReason reason) {
  switch (reason) {
    case RejectReason::wrong_form: return "wrong form";
    case RejectReason::unknown_id: return "unknown id";
    case RejectReason::wrong_length: return "wrong length";
    case RejectReason::wrong_crc: return "wrong crc";
    case RejectReason::wrong_complement: return "wrong complement";
    case RejectReason::wrong_channel: return "wrong channel";
    case RejectReason::wrong_counter: return "wrong counter";
    case RejectReason::repeated_counter: return "repeated counter";
    case RejectReason::conflicting: return "conflicting sender";
    case RejectReason::late: return "late";
    case RejectReason::not_configured: return "not configured";
    case RejectReason::foreign_master: return "foreign master";
  }
  return "?";
}

namespace {

/// Unsolicited IDENT, which a module sends with counter 0 after every start.
bool is_unsolicited_ident(const MessageSpec& message, std::uint8_t counter) {
  return &message == &internal_bus::ident && counter == 0;
}

/// Whether a damaged frame of this message commands no node, regardless of its sender: true if all receivers are
/// required to drop it.
constexpr bool commands_only_whole(const MessageSpec& message) {
  return message.protection == Protection::counter_crc || message.protection == Protection::counter_crc_complement;
}

}  // namespace

std::optional<RejectReason> form_fault(const CanFrame& frame) {
  if (frame.is_extended || frame.is_remote || frame.is_error) return RejectReason::wrong_form;
  return std::nullopt;
}

std::optional<RejectReason> content_fault(const MessageSpec& message, const CanFrame& frame) {
  if (frame.length > message.length || frame.length < message.shortest()) return RejectReason::wrong_length;
  if (has_crc(message) && frame.data[7] != crc_wanted(message, frame)) return RejectReason::wrong_crc;
  if (message.protection == Protection::counter_crc_complement && (frame.data[0] ^ frame.data[1]) != 0xFF) {
    return RejectReason::wrong_complement;
  }
  if (message.protection == Protection::channel_counter && frame.data[0] != message.channel) {
    return RejectReason::wrong_channel;
  }
  if (message.protection == Protection::nibble_counter_crc && counter_of(message, frame) >= nibble_counter_values) {
    return RejectReason::wrong_counter;
  }
  return std::nullopt;
}

CheckedFrame ReceiveCheck::check(const CanFrame& frame) {
  const CheckedFrame verdict = judge(frame);
  if (!verdict.is_accepted) {
    count_rejected(frame, verdict.reason);
    return verdict;
  }
  ++counts_.accepted;
  if (verdict.message->protection != Protection::none) {
    last_counter_[frame.id] = counter_of(*verdict.message, frame);
    last_crc_[frame.id] = frame.data[7];
    if (role_ == Role::listener) note_request(*verdict.message, verdict.node, frame);
  }
  return verdict;
}

CheckedFrame ReceiveCheck::judge(const CanFrame& frame) const {
  CheckedFrame verdict;
  const auto rejected = [&verdict](RejectReason reason) {
    verdict.reason = reason;
    return verdict;
  };
  const bool is_data = !frame.is_remote && !frame.is_error;
  const MessageMatch match = is_data ? catalogue_->find(frame) : MessageMatch{};
  if (match.message == nullptr) {
    return rejected(form_fault(frame) ? RejectReason::wrong_form : RejectReason::unknown_id);
  }
  const MessageSpec& message = *match.message;
  verdict.message = match.message;
  verdict.node = match.node;
  const bool is_masters = role_ == Role::master && message.sender == Sender::bmu;
  if (is_masters && !commands_only_whole(message)) return rejected(RejectReason::foreign_master);
  if (const auto fault = content_fault(message, frame)) return rejected(*fault);
  if (is_masters) return rejected(RejectReason::foreign_master);
  if (message.protection != Protection::none) {
    const std::uint8_t counter = counter_of(message, frame);
    if (is_late(message, match.node, counter)) return rejected(RejectReason::late);
    if (counter == last_counter_[frame.id] && !is_unsolicited_ident(message, counter)) {
      const bool is_same = !has_crc(message) || frame.data[7] == last_crc_[frame.id];
      return rejected(is_same ? RejectReason::repeated_counter : RejectReason::conflicting);
    }
  }
  verdict.is_accepted = true;
  return verdict;
}

bool ReceiveCheck::is_late(const MessageSpec& message, std::uint8_t node, std::uint8_t counter) const {
  if (message.sender != Sender::mmu || is_unsolicited_ident(message, counter)) return false;
  const bool answers_command = &message == &internal_bus::response;
  const std::uint16_t expected = answers_command ? commanded_counter_[node] : polled_counter_[node];
  return expected != none && expected != counter;
}

void ReceiveCheck::note_request(const MessageSpec& message, std::uint8_t node, const CanFrame& frame) {
  if (&message == &internal_bus::command) {
    commanded_counter_[node] = frame.data[6];  // no module responds to a broadcast (node 0)
  } else if (&message == &internal_bus::poll) {
    const std::uint8_t target = frame.data[0];
    for (std::size_t slot = 1; slot < node_slots; ++slot) {
      if (target == 0 || target == slot) polled_counter_[slot] = frame.data[6];
    }
  }
}

void ReceiveCheck::note_sent(const CanFrame& frame) {
  const MessageMatch match = catalogue_->find(frame);
  if (match.message != nullptr) note_request(*match.message, match.node, frame);
}

void ReceiveCheck::reject(const CanFrame& frame, RejectReason reason) {
  --counts_.accepted;
  count_rejected(frame, reason);
}

void ReceiveCheck::count_rejected(const CanFrame& frame, RejectReason reason) {
  ++counts_.rejected[static_cast<std::size_t>(reason)];
  if (!frame.is_extended && frame.id < rejected_by_id_.size()) ++rejected_by_id_[frame.id];
}

void ReceiveCheck::forget_counters() {
  last_counter_.fill(none);
  polled_counter_.fill(none);
  commanded_counter_.fill(none);
}

}  // namespace bmu
