// Why the memory orders suffice.
//
// Publication: the entry is written before the slot's CAS releases, the reader acquires the slot's word and then reads
// the entry: it sees that frame or a later one.
//
// Reuse: the writer writes an entry again only after entry_count - 1 >= slot_count further publications of its own.
// Each loaded `head`, which only ever changes by compare-exchange, so the load acquires everything that was done before
// every earlier position was passed: the slot that pointed to the entry was overwritten before the entry is. Entries
// are stored with release and loaded with acquire; a reader that saw a word of the new frame therefore also sees the
// slot changed when it checks it again, and discards its copy. The words of a slot never repeat, as they hold the
// position.
//
// Waking needs more than that: a writer stores a slot and then checks which readers sleep, a reader marks itself as
// sleeping and then checks the slot again. At least one must see the other, hence sequential consistency for those
// accesses.
#include "daemon/shell/can/embedded_ring.hpp"

namespace bmu {

namespace {

using Word = EmbeddedRing::Word;

// Layout of a slot's word: 46 bits of position, enough for two years of a million frames a second.
constexpr unsigned entry_bits = 13;
constexpr unsigned participant_bits = 5;
static_assert(EmbeddedRing::entry_count == 1U << entry_bits);
static_assert(EmbeddedRing::participant_count == 1U << participant_bits);

struct SlotContent {
  std::uint64_t end = 0;  // the frame's position plus one, so that zero means never used
  unsigned participant = 0;
  std::uint64_t entry = 0;
};

constexpr std::uint64_t pack(const SlotContent& content) {
  return content.end << (participant_bits + entry_bits) | std::uint64_t{content.participant} << entry_bits |
         content.entry;
}

constexpr SlotContent unpack(std::uint64_t word) {
  return {.end = word >> (participant_bits + entry_bits),
          .participant = static_cast<unsigned>(word >> entry_bits) % EmbeddedRing::participant_count,
          .entry = word % EmbeddedRing::entry_count};
}

constexpr unsigned extended_bit = 29;
constexpr unsigned remote_bit = 30;
constexpr unsigned error_bit = 31;
constexpr unsigned length_shift = 32;

void store(EmbeddedRing::Entry& entry, const CanFrame& frame) {
  std::uint64_t data = 0;
  for (std::size_t i = 0; i < frame.data.size(); ++i) data |= std::uint64_t{frame.data[i]} << (8 * i);
  const std::uint64_t head = std::uint64_t{frame.id} | std::uint64_t{frame.is_extended} << extended_bit |
                             std::uint64_t{frame.is_remote} << remote_bit | std::uint64_t{frame.is_error} << error_bit |
                             std::uint64_t{frame.length} << length_shift;
  entry.head.store(head, std::memory_order_release);
  entry.data.store(data, std::memory_order_release);
}

CanFrame load(const EmbeddedRing::Entry& entry) {
  const std::uint64_t head = entry.head.load(std::memory_order_acquire);
  const std::uint64_t data = entry.data.load(std::memory_order_acquire);
  CanFrame frame;
  frame.id = static_cast<std::uint32_t>(head & ((1U << extended_bit) - 1));
  frame.is_extended = (head >> extended_bit & 1) != 0;
  frame.is_remote = (head >> remote_bit & 1) != 0;
  frame.is_error = (head >> error_bit & 1) != 0;
  frame.length = static_cast<std::uint8_t>(head >> length_shift);
  for (std::size_t i = 0; i < frame.data.size(); ++i) frame.data[i] = static_cast<std::uint8_t>(data >> (8 * i));
  return frame;
}

/// Moves the head past a published slot, whichever writer published it. A failure means that another one did.
void advance(Word& head, std::uint64_t from) {
  head.compare_exchange_strong(from, from + 1, std::memory_order_acq_rel, std::memory_order_relaxed);
}

/// Entry with which the new owner of a participant number continues: behind the entry that its predecessor published
/// last. All entries that the ring still points to are then the last slot_count at most before this one, wherever the
/// predecessor was killed.
std::uint64_t entry_after_last(const EmbeddedRing& ring, unsigned participant) {
  SlotContent last;
  for (const Word& slot : ring.slots) {
    const SlotContent content = unpack(slot.load(std::memory_order_acquire));
    if (content.end > last.end && content.participant == participant) last = content;
  }
  return last.end == 0 ? 0 : (last.entry + 1) % EmbeddedRing::entry_count;
}

}  // namespace

RingWriter::RingWriter(EmbeddedRing& ring, unsigned participant)
    : ring_(ring), participant_(participant), next_entry_(entry_after_last(ring, participant)) {}

void RingWriter::publish(const CanFrame& frame) {
  store(ring_.arenas[participant_][next_entry_], frame);
  while (true) {
    const std::uint64_t position = ring_.head.load(std::memory_order_acquire);
    Word& slot = ring_.slots[position % EmbeddedRing::slot_count];
    std::uint64_t word = slot.load(std::memory_order_acquire);
    const std::uint64_t end = unpack(word).end;
    if (end > position) {  // taken: by a writer that has not moved the head yet, or `position` is outdated
      advance(ring_.head, position);
      continue;
    }
    const std::uint64_t ours = pack({.end = position + 1, .participant = participant_, .entry = next_entry_});
    if (!slot.compare_exchange_strong(word, ours, std::memory_order_seq_cst, std::memory_order_relaxed)) continue;
    advance(ring_.head, position);
    break;
  }
  next_entry_ = (next_entry_ + 1) % EmbeddedRing::entry_count;
}

RingReader::RingReader(const EmbeddedRing& ring) : ring_(ring), cursor_(ring.head.load(std::memory_order_acquire)) {
  // The head is one behind if the last writer died in the middle. That frame is older than this reader, and on a quiet
  // bus may be days old.
  if (!is_at_end()) ++cursor_;
}

bool RingReader::is_at_end() const {
  const Word& slot = ring_.slots[cursor_ % EmbeddedRing::slot_count];
  return unpack(slot.load(std::memory_order_seq_cst)).end <= cursor_;
}

bool RingReader::next(Item& out) {
  while (true) {
    const Word& slot = ring_.slots[cursor_ % EmbeddedRing::slot_count];
    const std::uint64_t word = slot.load(std::memory_order_seq_cst);
    const SlotContent content = unpack(word);
    if (content.end <= cursor_) return false;
    if (content.end == cursor_ + 1) {
      out.frame = load(ring_.arenas[content.participant][content.entry]);
      out.participant = content.participant;
      if (slot.load(std::memory_order_acquire) == word) {
        ++cursor_;
        return true;
      }
    }
    const std::uint64_t resumed = ring_.head.load(std::memory_order_acquire) - EmbeddedRing::slot_count / 2;
    lost_ += resumed - cursor_;
    cursor_ = resumed;
  }
}

}  // namespace bmu
