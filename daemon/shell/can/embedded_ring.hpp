// The memory of the embedded bus: one ring that all participants write, and the order in which they all read it.
//
// A participant may be killed or stopped between any two instructions and must not block or confuse the others, so
// there is no lock, and every step that others could wait for can be finished by any of them:
//
//   writer   writes its frame into an entry of its own arena, where no other participant writes;
//            puts a word that points there into the ring slot at `head` (this one CAS *is* the publication);
//            moves `head` on. If it dies before that, the next writer finds the slot taken and moves `head` for it.
//   reader   has a cursor of its own, changes nothing shared, and copies the entry that the slot's word points to.
//
// All bytes zero is an empty bus, so the creator of the memory need not initialise it, and there is no race for that.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "protocol/frame.hpp"

namespace bmu {

struct EmbeddedRing {
  static constexpr std::uint64_t slot_count = 4096;             // half a second of a full 1 Mbit/s bus
  static constexpr std::uint64_t entry_count = 2 * slot_count;  // more than slot_count: see RingWriter
  static constexpr unsigned participant_count = 32;

  using Word = std::atomic<std::uint64_t>;
  static_assert(Word::is_always_lock_free, "an atomic with a hidden lock would neither be shared nor survive SIGKILL");

  struct Entry {
    Word head;  // identifier, kind and length
    Word data;
  };
  using Arena = std::array<Entry, entry_count>;

  Word magic;              // 0 until the first participant writes the layout's number
  Word network_namespace;  // namespace of the participants' sockets
  Word head;               // position of the next frame; may be one behind, never more
  /// Participants that sleep and have to be woken; see embedded_bus.cpp.
  alignas(64) std::array<Word, participant_count> armed;
  alignas(64) std::array<Word, slot_count> slots;
  alignas(64) std::array<Arena, participant_count> arenas;
};

/// Publishes the frames of one participant. Precondition: only one writer per participant number at a time.
class RingWriter {
 public:
  RingWriter(EmbeddedRing& ring, unsigned participant);

  void publish(const CanFrame& frame);

 private:
  EmbeddedRing& ring_;
  unsigned participant_;
  std::uint64_t next_entry_;
};

class RingReader {
 public:
  struct Item {
    CanFrame frame;
    unsigned participant = 0;
  };

  /// Starts with the frame that is published next.
  explicit RingReader(const EmbeddedRing& ring);

  /// The next frame in the order of the bus; false if there is none yet. A reader that was lapped continues half a ring
  /// behind the newest frame, so that it is not lapped again at once, and counts the skipped positions.
  [[nodiscard]] bool next(Item& out);
  [[nodiscard]] bool is_at_end() const;
  [[nodiscard]] std::uint64_t frames_lost() const { return lost_; }

 private:
  const EmbeddedRing& ring_;
  std::uint64_t cursor_;
  std::uint64_t lost_ = 0;
};

}  // namespace bmu
