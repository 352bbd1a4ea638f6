// Adapts the recorded answers of modules to a second core, which polls them at other times than the recording's core.
//
// A module sends the same whichever core polls; but each answer carries the counter of its request, and to the second
// core that is the counter of some other request, or of none. So the counter of answers is changed here, and the
// consequences of polling by another core are emulated:
//
//   an answer of the recording   arrives at its recorded time, as the answer to the second core's latest POLL to this
//                                module. If that has this message already it is only stored.
//   a POLL of the second core    to all is answered with the module's last messages, where the recording's core polled
//                                nothing at that time: between two answers of a recording nothing changes, and STATUS
//                                reports how old the voltages are. Not so a POLL to one module: a core that repolls a
//                                pending value waits for the next one that was measured, for up to one and a half poll
//                                periods of the recording's core.
//   a module that owes the       recording's core an answer sends nothing to the second core either, up to the next
//                                one.
//   a COMMAND                    that both send has the recorded response; one of the second core alone gets "done".
//   balancing switches           are as commanded by the second core, once it has commanded differently
//                                (told_bleeding.hpp).
//
// An answer that was late, corrupted, duplicated or unrequested is so for the second core, too. Where both cores poll
// the same at the same time every frame is unchanged, to the last bit.
//
//   ModuleAnswers answers;
//   answers.begin(recorded_poll_config);
//   answers.note_then(poll_of_the_recording, at); answers.note_now(poll_of_the_other_core, at);
//   for each recorded frame: core.observe(the frame for the second core), if there is one
//   while (const auto frame = answers.next_due(now)) core.observe(*frame);
//
// Neither allocates nor reads a clock. Cost: a table look-up a frame; next_due() checks all nodes every five
// milliseconds while requests are open.
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
  /// Starts a part, with the same requests sent by both cores so far. `then`: poll periods of the recording's core.
  void begin(const PollConfig& then);

  /// A frame that the recording's core, or the second core, sent on the internal bus; all but POLL and COMMAND is
  /// ignored.
  void note_then(const CanFrame& sent, TimePoint at) { note(&Node::then, sent, at); }
  void note_now(const CanFrame& sent, TimePoint at) { note(&Node::now, sent, at); }

  /// A frame that was received on the internal bus, as the second core receives it; none: it does not.
  [[nodiscard]] std::optional<CanFrame> hear(const CanFrame& frame, TimePoint at);
  /// Answers that modules would have sent by now, and did not; one after the other, in the order of the bus.
  [[nodiscard]] std::optional<CanFrame> next_due(TimePoint now);

 private:
  /// STATUS, CELLS_1 to CELLS_4, TEMP_1, TEMP_2, MODULE, IDENT: the order of their identifiers, and of an answer.
  static constexpr std::size_t kinds = 9;

  struct Poll {
    bool is_known = false;
    std::uint8_t counter = 0;
    std::uint16_t wanted = 0;  // a bit for each kind, STATUS the lowest
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
    bool is_told_otherwise = false;  // balancing was commanded differently

    /// An answer to the recording's core is missing, of a kind that the module has sent before.
    [[nodiscard]] bool owes() const;
  };

  void note(Asked Node::*side, const CanFrame& sent, TimePoint at);
  void note_command(Asked Node::*side, const CanFrame& sent, std::size_t target, TimePoint at);
  /// The frame as the second core receives it, with that counter.
  [[nodiscard]] static CanFrame told(Node& node, const CanFrame& frame, unsigned counter, TimePoint at);
  [[nodiscard]] static std::optional<CanFrame> hear_answer(Node& node, std::size_t kind, const CanFrame& frame,
                                                           TimePoint at);
  [[nodiscard]] static std::optional<CanFrame> hear_response(Node& node, const CanFrame& frame, TimePoint at);
  [[nodiscard]] std::optional<CanFrame> due_answer(std::size_t kind, TimePoint now);
  [[nodiscard]] std::optional<CanFrame> due_response(TimePoint now);
  [[nodiscard]] Duration patience(std::size_t kind, const Poll& poll) const;

  PollConfig then_;
  std::array<Node, internal_bus::node_count_max + 1> nodes_{};  // entry 0 stays empty
  TimePoint look_at_ = TimePoint::max();                        // nothing is due before
};

}  // namespace bmu
