// Which one of several daemons commands a pack: who was there first.
//
// A daemon that starts beside another one, with files and a status socket of its own, would command "open" with its
// first frame, and the power distribution unit would obey. So each start listens before it sends, and two that start
// together on a silent bus find out by their first frames which one it is.
//
//   listening --heard nobody for `length`--> proving --own frame came back--> held --port down, long gap--> listening
//       |                                      |                                |
//       +------- a frame that only a master sends, from somebody else ----------+ (held: while resting only)
//                                              v
//                                            lost: nothing is sent any more, and the process ends
//
//   listening   Nothing is sent on any port. Counted from when the internal bus comes up; while it is down there is
//               nobody to listen to, nor to command, and the other ports wait for `length` after they come up
//               themselves.
//   proving     All is sent. Every participant of a bus receives the same frames in the same order, its own included:
//               of two daemons one receives the other's frame before the echo of its own, and that one loses.
//   held        A master's frame is a fault (foreign_master, which opens), but for those that the loser had sent before
//               it knew: they are ignored for two periods of CONTACTOR_COMMAND after the echo. A resting master
//               (rest_mode.hpp) is silent for up to its look_every, so that another one may have listened and started:
//               the resting one, which is open, gives way. Leaving the rest it proves its claim as after listening.
//
// The claim is kept by sending: after its port was down, or a gap of the loop after which the power distribution unit
// has opened by itself (claim_lapse), another master may be there, and this one listens again. A reload does not, where
// the ports are those of before: the process is the same, has kept its sockets, and was silent for less than anybody
// listens (claim_kept_max); another one that starts meanwhile hears the next frame. With a port of another name, or
// after a longer time, it listens as at a start.
//
// Inputs: `length`, drawn at random by the shell (claim_length), as the core's first observation; ports, echoes and the
// frames of others, with their times. Without a begin() the claim is held from the start and for ever: so recordings
// from before there was a claim decide as they did.
//
// Pure: no I/O, no clock, no allocation. Cost: some comparisons a frame and tick.
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

/// When the other master's frame was received.
enum class ClaimLoss : std::uint8_t { none, while_listening, before_own_frame, while_resting };

/// So many periods in which a master cannot have been silent, unless frames were lost one after the other.
inline constexpr int claim_periods = 3;
/// What chance adds, so that two daemons that a power-up starts together seldom end their listening together.
inline constexpr Duration claim_random_max = 250ms;
/// Of the loser of two that started together: what it had sent before it received the winner's frame.
inline constexpr Duration claim_ignore_for = 2 * internal_bus::contactor_command.period;
/// The power distribution unit opens by itself when it has received no command for this long.
inline constexpr Duration claim_lapse = 200ms;

/// The longest that an awake master of this pack is silent on the internal bus: CONTACTOR_COMMAND comes every 50 ms;
/// without a unit that obeys it, POLLs at the slowest pace are all there is.
[[nodiscard]] constexpr Duration master_silence_max(const CoreConfig& config) {
  if (config.contactors.has_pdu) return internal_bus::contactor_command.period;
  return std::max(config.poll.period, config.poll.parked_period);
}

/// How long to listen. `random`: evenly distributed. 150 to 400 ms with a power distribution unit.
[[nodiscard]] constexpr Duration claim_length(const CoreConfig& config, std::uint32_t random) {
  const auto steps = static_cast<std::uint32_t>(claim_random_max / 1us) + 1;
  return claim_periods * master_silence_max(config) + std::chrono::microseconds{random % steps};
}

/// A reload that was silent for less keeps its claim: with the period before it that is shorter than anybody listens.
[[nodiscard]] constexpr Duration claim_kept_max(const CoreConfig& config) {
  return (claim_periods - 1) * master_silence_max(config);
}

class MasterClaim {
 public:
  /// All ports count as down until told otherwise. `is_kept`: a claim of the life before, which goes on with the ports
  /// that come up before the first step().
  void begin(Duration length, bool is_kept) {
    *this = {};
    length_ = length;
    stage_ = is_kept ? ClaimStage::held : ClaimStage::listening;
    keeps_ports_ = is_kept;
  }

  void note_port(Port port, bool is_up, TimePoint at) {
    if (!is_there()) return;
    quiet_until_[index_of(port)] = is_up ? std::optional(keeps_ports_ ? at : at + length_) : std::nullopt;
    const bool must_listen = port == Port::internal && stage_ != ClaimStage::lost && !(is_up && keeps_ports_);
    if (must_listen) stage_ = ClaimStage::listening;
  }

  /// The loop was away for `gap`, until `now`: nothing was sent, and what came meanwhile was discarded. Who holds the
  /// claim may have to open by a frame; who does not has nothing to hurry for.
  void note_gap(Duration gap, TimePoint now) {
    const bool goes_on = stage_ == ClaimStage::held && gap < claim_lapse;
    if (!is_there() || is_lost() || goes_on) return;
    for (std::optional<TimePoint>& until : quiet_until_) {
      if (until) until = now + length_;
    }
    stage_ = ClaimStage::listening;
  }

  /// Once a tick, before anything is sent; not while the daemon ends, which has nothing more to begin.
  void step(TimePoint now) {
    keeps_ports_ = false;
    const bool has_listened =
        stage_ == ClaimStage::listening && is_bus_up() && now >= *quiet_until_[index_of(Port::internal)];
    if (has_listened) stage_ = ClaimStage::proving;
  }

  /// A frame that only a master sends was received from somebody else. True: that is a fault of the bus.
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

  /// A frame of our own that only a master sends was on the internal bus.
  void note_echo(TimePoint at) {
    if (stage_ != ClaimStage::proving) return;
    stage_ = ClaimStage::held;
    proved_at_ = at;
  }

  /// The rest is over, in which nothing was sent.
  void wake() {
    if (is_there() && stage_ == ClaimStage::held) stage_ = ClaimStage::proving;
  }

  [[nodiscard]] ClaimStage stage() const { return stage_; }
  [[nodiscard]] ClaimLoss loss() const { return loss_; }
  /// Of the frame it was lost by.
  [[nodiscard]] std::uint32_t rival_id() const { return rival_id_; }
  [[nodiscard]] bool is_lost() const { return stage_ == ClaimStage::lost; }
  /// For a time that ends by itself: not while the internal bus is down.
  [[nodiscard]] bool is_listening() const { return stage_ == ClaimStage::listening && is_bus_up(); }
  /// Contactors, modules and whoever else is on the internal bus.
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
  [[nodiscard]] bool is_bus_up() const { return quiet_until_[index_of(Port::internal)].has_value(); }
  bool lose(ClaimLoss loss, std::uint32_t id) {
    stage_ = ClaimStage::lost;
    loss_ = loss;
    rival_id_ = id;
    return false;
  }

  Duration length_{};  // zero: nobody claims anything
  ClaimStage stage_ = ClaimStage::held;
  ClaimLoss loss_ = ClaimLoss::none;
  std::uint32_t rival_id_ = 0;
  bool keeps_ports_ = false;
  std::array<std::optional<TimePoint>, port_count> quiet_until_{};  // nothing: the port is down
  std::optional<TimePoint> proved_at_{};                            // when the echo came that decided
  BMU_FIELDS(length_, stage_, loss_, rival_id_, keeps_ports_, quiet_until_, proved_at_)
};

}  // namespace bmu
