// The one door every received frame passes before anybody looks at what it says.
//
// Form, length, checksum and counter are checked by the message's row; a frame that fails changes nothing anywhere and
// is counted by reason and by identifier. The same stage serves the daemon, the emulated modules and the dump tool, so
// that a frame the dump tool marks is a frame the daemon rejected.
//
//   counter rules   a protected frame whose counter equals the last accepted one of that identifier is `repeated`: it
//                   is old news and refreshes no timeout. If its bytes differ from those of that frame (told by the
//                   checksum, so one time in 256 they are not told apart), nobody repeated it: `conflicting`, two
//                   senders share the identifier.
//                   An answer of a module whose counter is not that of the latest POLL (RESPONSE: COMMAND) addressed to
//                   it, or to all, is `late`. The check learns these from the POLL and COMMAND frames it is shown, sent
//                   or received; before it has seen one it takes any. IDENT with counter 0 is unsolicited and taken.
//   foreign master  to a master, a frame that only it may send. In another maker's language the identifier decides that
//                   alone: what a device makes of such a frame with another length or checksum nobody knows. In our own
//                   every receiver drops it (docs/bus-protocol.md), so that it commands nobody: it is counted by what
//                   is wrong with it, as any frame.
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
  wrong_form,  // remote or error frame, or a 29-bit identifier that is nobody's here
  unknown_id,  // no row for this identifier
  wrong_length,
  wrong_crc,
  wrong_complement,  // CONTACTOR_COMMAND: b1 is not the complement of b0
  wrong_channel,     // current sensor: b0 is not the channel of this identifier
  wrong_counter,     // BMW's modules: 15, which their counter never has
  repeated_counter,
  conflicting,     // a repeated counter with other bytes: a second sender
  late,            // an answer to an older POLL or COMMAND
  not_configured,  // a node this pack does not have (judged by the owner of the check, counted here)
  foreign_master,  // a frame only we may send, from somebody else (judged by the owner, counted here)
};
inline constexpr std::size_t reject_reason_count = 12;

[[nodiscard]] std::string_view to_text(RejectReason reason);

/// What is wrong with a frame by itself, whatever came before: its form; against the row of its identifier, its length,
/// checksum, complement, channel and the range of its counter. `form_fault` is of a bus that has 11-bit identifiers
/// only.
[[nodiscard]] std::optional<RejectReason> form_fault(const CanFrame& frame);
[[nodiscard]] std::optional<RejectReason> content_fault(const MessageSpec& message, const CanFrame& frame);

struct CheckedFrame {
  const MessageSpec* message = nullptr;  // known also for most rejected frames
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
  /// Who is asking. A master learns what it polled from `note_sent` alone, and a frame that only a master may send
  /// is `foreign_master` to it. A listener (module, PDU, dump tool) learns from the POLLs and COMMANDs it hears.
  enum class Role : std::uint8_t { master, listener };

  ReceiveCheck(const Catalogue& catalogue, Role role) : catalogue_(&catalogue), role_(role) {}

  /// Judges a received frame, counts the verdict and, if accepted, remembers its counter.
  CheckedFrame check(const CanFrame& frame);
  /// A POLL or COMMAND we sent ourselves: its answers are expected from now on.
  void note_sent(const CanFrame& frame);
  /// Counts a frame that never came to `check`, as it is none of the catalogue's.
  void note_rejected(const CanFrame& frame, RejectReason reason) { count_rejected(frame, reason); }
  /// Counts a frame that passed `check` but was refused by the owner for a reason of his own.
  void reject(const CanFrame& frame, RejectReason reason);
  /// Forgets counters, keeps counts: after the bus was away, the first frame of anybody is taken again.
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
