// What the modules of a recording say to another core than the one that asked them then, at other times than then.
//
// A module says the same whoever asks; but each answer carries the counter of its question, and to another core that is
// the counter of some other question, or of none. So here answers change their counter, and what follows from being
// asked by another core:
//
//   an answer of the recording   comes when it came, as the answer to the other core's latest POLL to this module. If
//                                that has this message already it is only remembered.
//   a POLL of the other core     to all is answered with what the module said last, where the recording's core asked
//                                nothing at that time: between two answers of a recording nothing changes, and STATUS
//                                says how old the voltages are. Not so a POLL to one module: who doubts a value waits
//                                for the next one that was measured, up to half as long again as the recording's core
//                                took to its next question.
//   a module that owes the       recording's core an answer says nothing to the other core either, up to its next one.
//   a COMMAND                    that both give has the answer of then; one of the other core alone gets "done".
//   balancing switches           are as the other core told them, once it has told otherwise (told_bleeding.hpp).
//
// What was late, damaged, said twice or not asked for is so to the other core, too. Where both cores ask the same at
// the same time every frame stays what it is, to the last bit.
//
//   ModuleAnswers answers;
//   answers.begin(recorded_poll_config);
//   answers.note_then(poll_of_the_recording, at); answers.note_now(poll_of_the_other_core, at);
//   if (const auto frame = answers.hear(recorded_frame, at)) core.observe(*frame);
//   while (const auto frame = answers.next_due(now)) core.observe(*frame);
//
// Neither allocates nor reads a clock. Cost: a look into a table a frame; next_due() looks through all nodes every five
// milliseconds while questions are open.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/core/types/core_config.hpp"
#include "daemon/recording/told_bleeding.hpp"
#include "protocol/frame.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

class ModuleAnswers {
 public:
  /// A part begins, with the same questions asked by both cores so far. `then`: how fast the recording's core asks.
  void begin(const PollConfig& then);

  /// A frame that the recording's core sent on the internal bus, or the other core; all but POLL and COMMAND is
  /// ignored.
  void note_then(const CanFrame& sent, TimePoint at) { note(&Node::then, sent, at); }
  void note_now(const CanFrame& sent, TimePoint at) { note(&Node::now, sent, at); }

  /// A frame that came on the internal bus, as the other core hears it; none: it does not.
  [[nodiscard]] std::optional<CanFrame> hear(const CanFrame& frame, TimePoint at);
  /// What modules would have said by now, and did not; one after the other, in the order of the bus.
  [[nodiscard]] std::optional<CanFrame> next_due(TimePoint now);

 private:
  /// STATUS, CELLS_1 to CELLS_4, TEMP_1, TEMP_2, MODULE, IDENT: the order of their identifiers, and of an answer.
  static constexpr std::size_t kinds = 9;

  struct Poll {
    bool is_known = false;
    std::uint8_t counter = 0;
    std::uint16_t wanted = 0;  // a bit a kind, STATUS the lowest
    std::uint16_t answered = 0;
    bool is_to_all = false;
    TimePoint at{};

    [[nodiscard]] std::uint16_t open() const { return wanted & static_cast<std::uint16_t>(~answered); }
  };
  struct Order {
    bool is_known = false;
    bool is_open = false;
    std::uint8_t counter = 0;
    std::uint8_t operation = 0;
    TimePoint at{};
  };
  struct Asked {
    Poll poll;
    Order order;
    ToldBleeding bleeding;
  };
  struct Said {
    bool is_known = false;
    CanFrame frame;
    TimePoint at{};
  };
  struct Node {
    Asked then;
    Asked now;
    std::array<Said, kinds> last{};
    bool is_told_otherwise = false;  // to bleed

    /// Something to the recording's core, that it has said before.
    [[nodiscard]] bool owes() const;
  };

  void note(Asked Node::*side, const CanFrame& sent, TimePoint at);
  void note_command(Asked Node::*side, const CanFrame& sent, std::size_t target, TimePoint at);
  /// As the other core hears it, under that counter.
  [[nodiscard]] static CanFrame told(Node& node, const CanFrame& frame, unsigned counter, TimePoint at);
  [[nodiscard]] static std::optional<CanFrame> hear_answer(Node& node, std::size_t kind, const CanFrame& frame,
                                                           TimePoint at);
  [[nodiscard]] static std::optional<CanFrame> hear_response(Node& node, const CanFrame& frame, TimePoint at);
  [[nodiscard]] std::optional<CanFrame> due_answer(std::size_t kind, TimePoint now);
  [[nodiscard]] std::optional<CanFrame> due_response(TimePoint now);
  [[nodiscard]] Duration patience(std::size_t kind, const Poll& poll) const;

  PollConfig then_;
  std::array<Node, internal_bus::node_count_max + 1> nodes_{};  // that of 0 stays empty
  TimePoint look_at_ = TimePoint::max();                        // nothing is due before
};

}  // namespace bmu
