// Check that every received frame passes before its content is used.
//
// Form, length, checksum and counter are checked against the message's row; a rejected frame changes no state and is
// counted by reason and by identifier. The daemon, the emulated modules and the dump tool use the same check, so that a
// frame marked by the dump tool is a frame the daemon rejected.
//
//   counter rules   a protected frame with the counter of the last accepted one of that identifier is `repeated`: it
//                   carries no new data and refreshes no timeout. If its bytes differ from those of that frame
//                   (detected by the checksum, which misses a difference one time in 256), it is `conflicting`: two
//                   senders share the identifier.
//                   An answer of a module with another counter than the latest POLL (RESPONSE: COMMAND) addressed to
//                   it, or to all, is `late`. The check takes these counters from the POLL and COMMAND frames passed to
//                   it, sent or received; before the first it accepts any. IDENT with counter 0 is unsolicited and
//                   accepted.
//   foreign master  to a master, a frame that only a master may send. In a third-party protocol the identifier alone
//                   decides: the reaction of a device to such a frame with another length or checksum is unknown. On
//                   the internal bus every receiver drops such a frame (docs/bus-protocol.md), so that it has no
//                   effect: it is counted by its error, as any frame.
//
// Cost: a table read, nine more for the CRC, a few compares; about 20 ns. State: about 20 kB, no allocation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/fields.hpp"
#include "protocol/message.hpp"

namespace bmu {

enum class RejectReason : std::uint8_t {
  wrong_form,  // remote or error frame, or a 29-bit identifier without a row
  unknown_id,  // no row for this identifier
  wrong_length,
  wrong_crc,
  wrong_complement,  // CONTACTOR_COMMAND: b1 is not the complement of b0
  wrong_channel,     // current sensor: b0 is not the channel of this identifier
  wrong_counter,     // BMW's modules: 15, which their counter never reaches
  repeated_counter,
  conflicting,     // a repeated counter with other bytes: a second sender
  late,            // an answer to an older POLL or COMMAND
  not_configured,  // a node that is not in this pack (detected by the owner of the check, counted here)
  foreign_master,  // a frame that only a master may send, from another node; sensor commands are detected by the owner
};
inline constexpr std::size_t reject_reason_count = 12;

[[nodiscard]] std::string_view to_text(RejectReason reason);

/// Errors of a frame by itself, regardless of earlier frames: its form; and against the row of its identifier, its
/// length, checksum, complement, channel and the range of its counter. `form_fault` is for a bus that has 11-bit
/// identifiers only.
[[nodiscard]] std::optional<RejectReason> form_fault(const CanFrame& frame);
[[nodiscard]] std::optional<RejectReason> content_fault(const MessageSpec& message, const CanFrame& frame);

struct CheckedFrame {
  const MessageSpec* message = nullptr;  // also set for most rejected frames
  std::uint8_t node = 0;
  bool is_accepted = false;
  RejectReason reason = RejectReason::unknown_id;  // meaningful only if not accepted
};

struct ReceiveCounts {
  std::uint64_t accepted = 0;
  std::array<std::uint64_t, reject_reason_count> rejected{};

  [[nodiscard]] constexpr std::uint64_t rejected_total() const {
    std::uint64_t total = 0;
    for (const std::uint64_t count : rejected) total += count;
    return total;
  }
};

class ReceiveCheck {
 public:
  /// Role of the owner. A master takes its polls from `note_sent` alone, and rejects a frame that only a master may
  /// send as `foreign_master`. A listener (module, PDU, dump tool) takes them from the POLLs and COMMANDs it receives.
  enum class Role : std::uint8_t { master, listener };

  ReceiveCheck(const Catalogue& catalogue, Role role) : catalogue_(&catalogue), role_(role) {}

  /// Checks a received frame, counts the result and, if accepted, stores its counter.
  CheckedFrame check(const CanFrame& frame);
  /// Registers a POLL or COMMAND that the owner sent: its answers are expected from now on.
  void note_sent(const CanFrame& frame);
  /// Counts a frame that was not passed to `check` because it is not in the catalogue.
  void note_rejected(const CanFrame& frame, RejectReason reason) { count_rejected(frame, reason); }
  /// Counts a frame that passed `check` but was rejected by the owner for another reason.
  void reject(const CanFrame& frame, RejectReason reason);
  /// Resets counters, keeps counts: after a bus outage the first frame of every sender is accepted.
  void forget_counters();

  [[nodiscard]] const Catalogue& catalogue() const { return *catalogue_; }
  [[nodiscard]] const ReceiveCounts& counts() const { return counts_; }
  /// Rejected frames under one identifier, all reasons together.
  [[nodiscard]] std::uint32_t rejected_under(std::uint32_t id) const {
    return id < rejected_by_id_.size() ? rejected_by_id_[id] : 0;
  }

 private:
  static constexpr std::uint16_t none = 0xFFFF;
  static constexpr std::size_t node_slots = 64;

  [[nodiscard]] CheckedFrame judge(const CanFrame& frame) const;
  [[nodiscard]] bool is_late(const MessageSpec& message, std::uint8_t node, std::uint8_t counter) const;
  void note_request(const MessageSpec& message, std::uint8_t node, const CanFrame& frame);
  void count_rejected(const CanFrame& frame, RejectReason reason);

  const Catalogue* catalogue_;
  Role role_;
  ReceiveCounts counts_;
  std::array<std::uint32_t, Catalogue::id_count> rejected_by_id_{};
  std::array<std::uint16_t, Catalogue::id_count> last_counter_ = filled<Catalogue::id_count>();
  std::array<std::uint8_t, Catalogue::id_count> last_crc_{};  // of the frame that last_counter_ is from
  std::array<std::uint16_t, node_slots> polled_counter_ = filled<node_slots>();
  std::array<std::uint16_t, node_slots> commanded_counter_ = filled<node_slots>();

  template <std::size_t Size>
  static constexpr std::array<std::uint16_t, Size> filled() {
    std::array<std::uint16_t, Size> slots{};
    slots.fill(none);
    return slots;
  }
  BMU_FIELDS(skipped(catalogue_), role_, counts_, rejected_by_id_, last_counter_, last_crc_, polled_counter_,
             commanded_counter_)
};

}  // namespace bmu
