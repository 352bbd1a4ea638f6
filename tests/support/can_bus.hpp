// A classic CAN bus in virtual time (ISO 11898-1): arbitration bit by bit, exact frame lengths, error frames, error
// counters, bus-off and recovery. Deterministic, and a value: a copy runs on by itself.
//
//   connect(station)        its controller is on the bus: it acknowledges, counts errors, and may send
//   put(station, frame)     the frame waits in the station's queue; only the head of a queue takes part in arbitration,
//                           as in a controller with one transmit buffer behind the kernel's queue
//   take_due(now)           events up to now, in order: frames received, errors, changes of a station's state
//   start_if_idle(now)      arbitration among the waiting stations
//   next_at()               when take_due() or start_if_idle() next have something to do without further input
//
// Features of the model
//   Arbitration   The lower identifier wins, data before remote, 11 bits before 29. Stations with the same identifier
//                 go on sending together: as long as they send the same bits they do not notice, and one frame is
//                 received. At the first different bit each station that sent recessive has a bit error.
//   Error frame   An error-active station that sees an error sends six dominant bits. These break the stuffing rule, so
//                 the others answer with their own six at the latest when six equal bits are through: 12 - r bits, r
//                 being the run of dominant bits before the flag. Then 8 bits of delimiter and the 3 between frames. A
//                 passive station's flag is recessive: it spoils its own frame, not those of others.
//   Counters      Transmit counter +8 for each failed frame, -1 for each that went through; receive counter +1 for an
//                 error, +9 for the station that saw it first, -1 for a good frame (from above 127 to 127). Above 127:
//                 passive; a passive transmitter also waits 8 bits after its own frame. Transmit counter above 255:
//                 bus-off. A frame without acknowledgement takes a transmitter to passive and no further.
//   Bus-off       The queue is lost, and each frame put later is discarded silently. After `restart_after`, or by
//                 restart(), the controller waits for 128 times 11 recessive bits and is back with counters of 0.
//
// Not modelled: overload frames, a transmitter's second error inside an error frame, passive receivers that delay the
// bus, and wires that reach only some of the stations. The set of stations that a frame reaches is fixed at its start.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "protocol/can_bits.hpp"
#include "protocol/frame.hpp"
#include "protocol/time.hpp"

namespace bmu::test {

/// Modules have their node numbers.
enum class Station : std::uint8_t { master = 0, module_first = 1, pdu = 64, sensor = 65, stranger = 66, twin = 67 };
inline constexpr std::size_t stations_max = 68;

/// Length of a frame. `longest`: the maximum that stuffing can give it, error flags of 12 bits, and reception only
/// after the bits between frames: no answer on a real bus comes later.
enum class Stuffing : std::uint8_t { exact, longest };

struct BusConfig {
  std::int64_t bits_per_s = 500'000;
  Stuffing stuffing = Stuffing::exact;
  /// False: stations with one identifier never start in the same bit, and so take turns. A test that measures
  /// durations, and not the effect of a collision, then has the same frames on the bus whatever their data.
  bool has_collisions = true;
};
/// No answer of a real bus comes later than on this one.
inline constexpr BusConfig slowest_bus{.stuffing = Stuffing::longest, .has_collisions = false};

[[nodiscard]] constexpr Duration bit_time(std::int64_t bits_per_s) {
  return Duration{1'000'000'000 / bits_per_s};
}

/// The maximum length of a frame, the bits after it included.
[[nodiscard]] constexpr Duration time_on_wire(const CanFrame& frame, std::int64_t bits_per_s = 500'000) {
  return bits_on_wire_max(frame) * bit_time(bits_per_s);
}
static_assert(time_on_wire({.length = 8}) == 270us);

enum class ErrorState : std::uint8_t { active, warning, passive, bus_off };

struct ErrorCounters {
  int transmit = 0;
  int receive = 0;

  friend constexpr bool operator==(const ErrorCounters&, const ErrorCounters&) = default;
};

/// Where a frame is disturbed: one bit is wrong for ...
enum class Hurt : std::uint8_t {
  sender,         // the sender: all stations discard the frame
  one_receiver,   // a single station: all discard the frame, unless that station is passive and only misses it
  all_receivers,  // all stations but the sender
};
struct WireFault {
  Hurt hurt = Hurt::sender;
  Station receiver = Station::master;  // of one_receiver
  std::size_t bit = 20;                // counted from the start of frame, stuff bits included; at most the last of CRC
};

struct BusEvent {
  enum class Kind : std::uint8_t {
    heard,    // frame complete; `station` sent it
    error,    // error frame; `station` sent the frame that was lost in it
    dropped,  // a frame of `station` that is not retransmitted: one shot, or bus-off
    state,    // of `station`
  };
  TimePoint at;
  Kind kind = Kind::heard;
  Station station = Station::master;
  CanFrame frame;
  std::optional<Station> missed_by;       // for a completed frame: a passive receiver that saw an error of its own
  ErrorState state = ErrorState::active;  // of `state`, with the counters
  ErrorCounters counters;
};

class CanBus {
 public:
  explicit CanBus(const BusConfig& config = {}) : config_(config) {}

  /// Called as a frame starts; a fault it returns disturbs that frame.
  std::function<std::optional<WireFault>(Station sender, const CanFrame& frame, TimePoint now)> disturb;

  void connect(Station station) { at(station).is_connected = true; }
  /// Unplugs it: it receives nothing, acknowledges nothing and keeps its queue.
  void disconnect(Station station) { at(station).is_connected = false; }
  /// A frame is sent once: lost in arbitration or in an error, it is dropped.
  void set_one_shot(Station station, bool is_one_shot) { at(station).is_one_shot = is_one_shot; }
  /// Delay from bus-off to the automatic restart of the controller; nothing: only by restart().
  void set_restart(Station station, std::optional<Duration> after) { at(station).restart_after = after; }
  /// Manual restart. Without effect on a station that is not bus-off.
  void restart(Station station, TimePoint now);

  void put(Station station, const CanFrame& frame);
  /// Discards the queue of a station: the interface disappeared.
  void drop_queue(Station station);
  [[nodiscard]] std::size_t waiting(Station station) const { return at(station).queue.size(); }

  [[nodiscard]] std::vector<BusEvent> take_due(TimePoint now);
  void start_if_idle(TimePoint now);
  /// TimePoint::max() if nothing will happen without further input. Call start_if_idle() first.
  [[nodiscard]] TimePoint next_at() const;

  [[nodiscard]] ErrorState state(Station station) const;
  [[nodiscard]] ErrorCounters counters(Station station) const { return at(station).counters; }
  /// Time for which the bus has been in use up to now, bits between frames included: the difference of two such values,
  /// divided by the time between them, is the bus load of that time.
  [[nodiscard]] Duration busy(TimePoint now) const;

 private:
  struct Member {
    std::vector<CanFrame> queue;
    ErrorCounters counters;
    bool is_connected = false;
    bool is_one_shot = false;
    bool is_off = false;
    bool keeps_frame = false;  // the frame on the wire goes back to the head of the queue if it is lost
    TimePoint may_start_at{};  // passive: 8 bits after its own frame
    std::optional<Duration> restart_after;
    std::optional<TimePoint> restarts_at;
    std::optional<int> recessive_left;  // after a restart: sequences of 11 recessive bits still missing
  };

  struct Sender {
    Station station{};
    CanFrame frame;
    bool has_failed = false;  // a passive one that stopped while another's frame went on
  };
  enum class Outcome : std::uint8_t { good, lost, unacknowledged };
  /// The frame on the wire; its end is determined when it starts.
  struct Carried {
    std::vector<Sender> senders;        // of one identifier
    std::vector<Station> first_to_see;  // receivers that saw the error before the others
    std::optional<Station> missed_by;
    Outcome outcome = Outcome::good;
    bool is_told = false;
    TimePoint started_at{};
    TimePoint told_at{};
    TimePoint free_at{};

    [[nodiscard]] const Sender& speaker() const;  // the one with its bits on the bus
    [[nodiscard]] bool has_sender(Station station) const;
  };

  [[nodiscard]] Member& at(Station station) { return members_[static_cast<std::size_t>(station)]; }
  [[nodiscard]] const Member& at(Station station) const { return members_[static_cast<std::size_t>(station)]; }
  [[nodiscard]] bool is_there(Station station) const { return at(station).is_connected && !at(station).is_off; }
  [[nodiscard]] bool is_passive(Station station) const { return state(station) == ErrorState::passive; }
  [[nodiscard]] Duration bits(std::int64_t count) const { return count * bit_time(config_.bits_per_s); }
  [[nodiscard]] std::vector<Station> receivers() const;

  // arbitration, and the outcome of the winner's frame
  void take_winners(TimePoint now);
  void settle();
  [[nodiscard]] bool is_lost_in_collision();
  [[nodiscard]] bool is_lost_by_fault(const WireFault& fault);
  void lose_at(std::size_t bit, bool has_active_flag);
  void end_without_acknowledgement();
  void end_well();

  // effects on all stations
  void tell(std::vector<BusEvent>& events);
  void count_good(std::vector<BusEvent>& events);
  void count_lost(std::vector<BusEvent>& events);
  void try_again(const Sender& sender, std::vector<BusEvent>& events);
  void add(Station station, int transmit, int receive, std::vector<BusEvent>& events);
  void go_off(Station station, TimePoint now, std::vector<BusEvent>& events);
  void free_bus();
  void begin_recovery(Station station, TimePoint now);
  void count_recessive(TimePoint now);
  void recover_due(TimePoint now, std::vector<BusEvent>& events);

  BusConfig config_;
  std::array<Member, stations_max> members_;
  std::optional<Carried> carried_;
  std::vector<BusEvent> dropped_;  // in start_if_idle(); reported by the next take_due()
  int off_count_ = 0;              // members in bus-off; 0: there is no restart and no recovery to check
  TimePoint idle_since_{};
  Duration busy_{};
};

}  // namespace bmu::test
