// Arbitration between several daemons on the bus of one pack: the first one commands it.
//
// A daemon that starts beside another one, with files and a status socket of its own, would send "open" with its first
// CONTACTOR_COMMAND, and the PDU would open a closed pack. So each start listens before it sends, and two daemons that
// start together on a silent bus decide by their first frames which one goes on.
//
//   listening --no master for `length`--> proving --echo of an own frame--> held --200 ms of silence--> listening
//       |                                    |                                |
//       +----- second master's frame --------+--------------------------------+ (held: only while resting)
//                                            v
//                                           lost: nothing is sent any more, and the process ends
//
//   listening   Nothing is sent on any port. Counted from the time at which the internal bus comes up. While that bus
//               is down no master can be received or commanded, and each other port waits for `length` after it comes
//               up for the first time.
//   proving     Everything is sent. All participants of a bus receive the same frames in the same order, their own
//               included: of two daemons one receives the other's frame before the echo of its own frame, and loses.
//   held        A second master's frame is a fault (foreign_master, which opens), except for the frames that the loser
//               sent before it received the winner's: they are ignored for two periods of CONTACTOR_COMMAND after the
//               echo. A resting master (rest_mode.hpp) is silent for up to its look_every, so another daemon may have
//               listened and started meanwhile: the resting one, whose contactors are open, gives way. At the end of a
//               rest it proves its claim as after listening.
//
// The claim is kept by sending. After its port was down, or the loop stalled, for as long as the PDU waits before it
// opens (claim_lapse), a second master may be there, and this one listens again. A reload with unchanged ports does
// not: the process is the same, keeps its sockets, and was silent for less than any start listens (claim_kept_max), so
// a daemon that starts meanwhile receives the next frame. With another port, or after a longer silence, it listens as
// at a start.
//
// Inputs: `length`, drawn at random by the shell (claim_length), as the core's first observation; state of the ports,
// echoes and second masters' frames, with their times. Output: whether a port may send. Without a begin() the claim is
// held from the start and permanently: recordings from before there was a claim replay identically.
//
// Pure: no I/O, no clock, no allocation. Cost: some comparisons per frame and tick.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "daemon/core/core_config.hpp"
#include "daemon/core/observation.hpp"
#include "protocol/fields.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "protocol/time.hpp"

namespace bmu {

enum class ClaimStage : std::uint8_t { held, listening, proving, lost };

[[nodiscard]] constexpr std::string_view to_text(ClaimStage stage) {
  switch (stage) {
    case ClaimStage::held: return "held";
    case ClaimStage::listening: return "listening for another master";
    case ClaimStage::proving: return "waiting for the echo of the first frame";
    case ClaimStage::lost: return "lost to another master";
  }
  return "?";
}

/// When the second master's frame was received.
enum class ClaimLoss : std::uint8_t { none, while_listening, before_own_frame, while_resting };

/// Count of a master's periods to listen for: two frames in a row may be lost.
inline constexpr int claim_periods = 3;
/// Maximum of the random part: two daemons that one power-up starts rarely end their listening at the same time.
inline constexpr Duration claim_random_max = 250ms;
/// Time after the proving echo in which frames that the loser sent before it lost are ignored.
inline constexpr Duration claim_ignore_for = 2 * internal_bus::contactor_command.period;
/// Timeout of the PDU: it opens when it has received no command for this long.
inline constexpr Duration claim_lapse = 200ms;

/// The longest silence of an awake master of this pack on the internal bus: CONTACTOR_COMMAND comes every 50 ms;
/// without a PDU only POLLs come, at the slowest pace.
[[nodiscard]] constexpr Duration master_silence_max(const CoreConfig& config) {
  if (config.contactors.has_pdu) return internal_bus::contactor_command.period;
  return std::max(config.poll.period, config.poll.parked_period);
}

/// How long a start listens. `random`: uniform. 150 to 400 ms with a PDU; without one three polls and up to 250 ms.
[[nodiscard]] constexpr Duration claim_length(const CoreConfig& config, std::uint32_t random) {
  return claim_periods * master_silence_max(config) +
         std::chrono::microseconds{random % (static_cast<std::uint32_t>(claim_random_max / 1us) + 1)};
}

/// A reload that was silent for less keeps its claim: with the period before it the silence is shorter than any start
/// listens.
[[nodiscard]] constexpr Duration claim_kept_max(const CoreConfig& config) {
  return (claim_periods - 1) * master_silence_max(config);
}

class MasterClaim {
 public:
  /// All ports count as down until note_port(). `is_kept`: the previous session's claim, which continues on the ports
  /// that come up before the first step().
  void begin(Duration length, bool is_kept) {
    *this = {};
    length_ = length;
    stage_ = is_kept ? ClaimStage::held : ClaimStage::listening;
    keeps_ports_ = is_kept;
  }

  void note_port(Port port, bool is_up, TimePoint at) {
    if (!is_there()) return;
    if (port == Port::internal) return note_bus(is_up, at);
    std::optional<TimePoint>& until = quiet_until_[index_of(port)];
    if (is_up && !until) until = keeps_ports_ ? at : at + length_;
  }

  /// The loop stalled for `gap`, until `now`: nothing was sent, and frames received meanwhile were discarded. A held
  /// claim outlives a short one, since the contactors may have to be opened by a frame at once.
  void note_gap(Duration gap, TimePoint now) {
    const bool goes_on = stage_ == ClaimStage::held && gap < claim_lapse;
    if (is_there() && !is_lost() && !goes_on) listen_from(now);
  }

  /// Once per tick, before anything is sent. Not called while the daemon shuts down.
  void step(TimePoint now) {
    keeps_ports_ = false;
    if (is_listening() && now >= quiet_until_[index_of(Port::internal)]) stage_ = ClaimStage::proving;
  }

  /// A frame that only a master sends was received. True: it is a fault of the bus (foreign_master).
  [[nodiscard]] bool note_rival(std::uint32_t id, TimePoint at, bool is_resting) {
    switch (stage_) {
      case ClaimStage::listening: return lose(ClaimLoss::while_listening, id);
      case ClaimStage::proving: return lose(ClaimLoss::before_own_frame, id);
      case ClaimStage::held: break;
      case ClaimStage::lost: return false;
    }
    if (is_there() && is_resting) return lose(ClaimLoss::while_resting, id);
    return !proved_at_ || at - *proved_at_ >= claim_ignore_for;
  }

  /// Echo of an own frame on the internal bus.
  void note_echo(TimePoint at) {
    if (stage_ != ClaimStage::proving) return;
    stage_ = ClaimStage::held;
    proved_at_ = at;
  }

  /// End of a rest, in which nothing was sent.
  void wake() {
    if (is_there() && stage_ == ClaimStage::held) stage_ = ClaimStage::proving;
  }

  [[nodiscard]] ClaimStage stage() const { return stage_; }
  [[nodiscard]] ClaimLoss loss() const { return loss_; }
  /// Identifier of the frame by which the claim was lost; 0: it is not.
  [[nodiscard]] std::uint32_t rival_id() const { return rival_id_; }
  [[nodiscard]] bool is_lost() const { return stage_ == ClaimStage::lost; }
  /// Listening for a bounded time: false while the internal bus is down.
  [[nodiscard]] bool is_listening() const { return stage_ == ClaimStage::listening && is_bus_up_; }
  /// Whether the nodes of the internal bus may be commanded.
  [[nodiscard]] bool may_command() const { return stage_ == ClaimStage::held || stage_ == ClaimStage::proving; }
  [[nodiscard]] bool may_send(Port port, TimePoint now) const {
    if (!is_there()) return true;
    if (port == Port::internal) return may_command();
    const std::optional<TimePoint>& until = quiet_until_[index_of(port)];
    return until && now >= *until && !is_lost() && !is_listening();
  }

 private:
  [[nodiscard]] static constexpr std::size_t index_of(Port port) { return static_cast<std::size_t>(port); }
  [[nodiscard]] bool is_there() const { return length_ > Duration{}; }
  /// A bus that was down for less than the PDU waits is back before another start can have listened, and the contactors
  /// may have to be opened by a frame at once.
  void note_bus(bool is_up, TimePoint at) {
    is_bus_up_ = is_up;
    if (is_lost()) return;
    const bool was_held = stage_ == ClaimStage::held;
    if (!is_up) {
      held_until_ = was_held ? at : TimePoint{};
      stage_ = ClaimStage::listening;
    } else if (held_until_ != TimePoint{} && at - held_until_ < claim_lapse) {
      stage_ = ClaimStage::held;
    } else if (!keeps_ports_) {
      listen_from(at);
    }
  }
  void listen_from(TimePoint at) {
    quiet_until_[index_of(Port::internal)] = at + length_;
    held_until_ = {};
    stage_ = ClaimStage::listening;
  }
  bool lose(ClaimLoss loss, std::uint32_t id) {
    stage_ = ClaimStage::lost;
    loss_ = loss;
    rival_id_ = id;
    return false;
  }

  Duration length_{};  // zero: begin() was not called
  ClaimStage stage_ = ClaimStage::held;
  ClaimLoss loss_ = ClaimLoss::none;
  std::uint32_t rival_id_ = 0;
  bool keeps_ports_ = false;  // until the first step
  bool is_bus_up_ = false;
  TimePoint held_until_{};  // when the internal bus went down under a held claim; zero: it did not
  std::array<std::optional<TimePoint>, port_count> quiet_until_{};  // no value: the port was never up
  std::optional<TimePoint> proved_at_{};                            // time of the echo that proved the claim
  BMU_FIELDS(length_, stage_, loss_, rival_id_, keeps_ports_, is_bus_up_, held_until_, quiet_until_, proved_at_)
};

}  // namespace bmu
