#include "tests/support/can_bus.hpp"

#include <algorithm>
#include <utility>

namespace bmu::test {

namespace {

constexpr int passive_above = 127;
constexpr int bus_off_above = 255;
constexpr int warning_from = 96;
constexpr int receive_counter_max = 255;
constexpr int failed_transmission = 8;
constexpr int first_to_see_it = 9;  // 1, and 8 for the flags of the others after its own

constexpr std::int64_t flag_bits = 6;
constexpr std::int64_t flag_bits_max = 12;
constexpr std::int64_t delimiter_bits = 8;
constexpr std::int64_t suspend_bits = 8;
constexpr std::int64_t recovery_bits = 11;
constexpr int recovery_sequences = 128;

/// Order of arbitration: of two frames with equal first 11 bits the standard one wins.
std::uint64_t rank(const CanFrame& frame) {
  const std::uint64_t first_11_bits = frame.is_extended ? frame.id >> 18 : frame.id;
  const std::uint64_t rest = frame.is_extended ? (1U << 18) | (frame.id & 0x3FFFF) : 0;
  return first_11_bits << 20 | rest << 1 | (frame.is_remote ? 1U : 0U);
}

/// Number of bits before `end` that equal the last of them, which is `level`.
std::int64_t run_before(const CanBits& bits, std::size_t end, bool level) {
  std::int64_t run = 0;
  while (end > 0 && bits[end - 1] == level) ++run, --end;
  return run;
}

std::vector<Station> all_stations() {
  std::vector<Station> stations;
  for (std::size_t index = 0; index < stations_max; ++index) stations.push_back(static_cast<Station>(index));
  return stations;
}
const std::vector<Station> every_station = all_stations();

}  // namespace

const CanBus::Sender& CanBus::Carried::speaker() const {
  const auto found = std::find_if(senders.begin(), senders.end(), [](const Sender& one) { return !one.has_failed; });
  BMU_ASSERT(found != senders.end());
  return *found;
}

bool CanBus::Carried::has_sender(Station station) const {
  return std::any_of(senders.begin(), senders.end(), [station](const Sender& one) { return one.station == station; });
}

std::vector<Station> CanBus::receivers() const {
  std::vector<Station> found;
  for (const Station station : every_station) {
    if (is_there(station) && !carried_->has_sender(station)) found.push_back(station);
  }
  return found;
}

ErrorState CanBus::state(Station station) const {
  const Member& member = at(station);
  if (member.is_off) return ErrorState::bus_off;
  const int most = std::max(member.counters.transmit, member.counters.receive);
  if (most > passive_above) return ErrorState::passive;
  return most >= warning_from ? ErrorState::warning : ErrorState::active;
}

Duration CanBus::busy(TimePoint now) const {
  return carried_ ? busy_ + (std::min(now, carried_->free_at) - carried_->started_at) : busy_;
}

// --- queues ---------------------------------------------------------------------------------------------------------

void CanBus::put(Station station, const CanFrame& frame) {
  if (!at(station).is_off) at(station).queue.push_back(frame);
}

void CanBus::drop_queue(Station station) {
  at(station).queue.clear();
  at(station).keeps_frame = false;
}

// --- arbitration, and the outcome of the winner's frame --------------------------------------------------------------

void CanBus::start_if_idle(TimePoint now) {
  if (carried_) return;
  take_winners(now);
  if (!carried_) return;
  count_recessive(now);
  settle();
}

/// Selects the senders with the strongest identifier that may start now. A one-shot station that loses drops its frame.
void CanBus::take_winners(TimePoint now) {
  std::vector<Station> ready;
  for (const Station station : every_station) {
    const bool may_start = is_there(station) && !at(station).queue.empty() && at(station).may_start_at <= now;
    if (may_start) ready.push_back(station);
  }
  if (ready.empty()) return;
  std::uint64_t strongest = ~std::uint64_t{};
  for (const Station station : ready) strongest = std::min(strongest, rank(at(station).queue.front()));
  carried_ = Carried{.started_at = now};
  for (const Station station : ready) {
    Member& member = at(station);
    const CanFrame frame = member.queue.front();
    const bool is_alone = carried_->senders.empty() || config_.has_collisions;
    const bool is_winner = rank(frame) == strongest && is_alone;
    if (!is_winner && !member.is_one_shot) continue;
    member.queue.erase(member.queue.begin());
    if (is_winner) {
      member.keeps_frame = !member.is_one_shot;
      carried_->senders.push_back({.station = station, .frame = frame});
    } else {
      dropped_.push_back({.at = now, .kind = BusEvent::Kind::dropped, .station = station, .frame = frame});
    }
  }
}

void CanBus::settle() {
  if (is_lost_in_collision()) return;
  const Sender& speaker = carried_->speaker();
  if (disturb) {
    const std::optional<WireFault> fault = disturb(speaker.station, speaker.frame, carried_->started_at);
    if (fault && is_lost_by_fault(*fault)) return;
  }
  const std::vector<Station> heard_by = receivers();
  const bool is_acknowledged =
      std::any_of(heard_by.begin(), heard_by.end(), [this](Station station) { return station != carried_->missed_by; });
  is_acknowledged ? end_well() : end_without_acknowledgement();
}

/// Compares the bits of senders of one identifier. A station that sends recessive and sees dominant has failed: an
/// error-active one destroys the frame of the others too, a passive one stops alone.
bool CanBus::is_lost_in_collision() {
  auto& senders = carried_->senders;
  if (senders.size() == 1) return false;
  std::vector<CanBits> sent;
  sent.reserve(senders.size());
  for (const Sender& sender : senders) sent.push_back(stuffed_bits(sender.frame));
  const auto bit_of = [&](std::size_t sender, std::size_t bit) { return sent[sender][bit]; };
  std::size_t length = sent.front().size();
  for (const CanBits& one : sent) length = std::min(length, one.size());
  for (std::size_t bit = 0; bit < length; ++bit) {
    bool is_dominant = false;
    for (std::size_t sender = 0; sender < senders.size(); ++sender) {
      is_dominant = is_dominant || (!senders[sender].has_failed && !bit_of(sender, bit));
    }
    bool has_active_flag = false;
    for (std::size_t sender = 0; sender < senders.size() && is_dominant; ++sender) {
      if (senders[sender].has_failed || !bit_of(sender, bit)) continue;
      senders[sender].has_failed = true;
      has_active_flag = has_active_flag || !is_passive(senders[sender].station);
    }
    if (!has_active_flag) continue;
    lose_at(bit, true);
    return true;
  }
  return false;
}

bool CanBus::is_lost_by_fault(const WireFault& fault) {
  const std::vector<Station> others = receivers();
  const auto is_active = [this](Station station) { return !is_passive(station); };
  switch (fault.hurt) {
    case Hurt::sender: lose_at(fault.bit, is_active(carried_->speaker().station)); return true;
    case Hurt::one_receiver:
      if (std::find(others.begin(), others.end(), fault.receiver) == others.end()) return false;
      if (!is_active(fault.receiver)) {
        carried_->missed_by = fault.receiver;
        return false;
      }
      carried_->first_to_see = {fault.receiver};
      break;
    case Hurt::all_receivers:
      if (others.empty()) return false;
      carried_->first_to_see = others;
      if (std::none_of(others.begin(), others.end(), is_active)) {
        end_without_acknowledgement();
        return true;
      }
      break;
  }
  lose_at(fault.bit, true);
  return true;
}

/// Six equal bits in a row break the stuffing rule for all other stations, whatever the level: dominant bits of an
/// active flag, or the recessive bus of a sender that has stopped.
void CanBus::lose_at(std::size_t bit, bool has_active_flag) {
  const CanBits sent = stuffed_bits(carried_->speaker().frame);
  const std::size_t end = std::min(bit + 1, sent.size());
  std::int64_t flags = flag_bits;
  if (!receivers().empty() || carried_->senders.size() > 1) {
    const bool is_longest = config_.stuffing == Stuffing::longest;
    flags = flag_bits_max - (is_longest ? 0 : run_before(sent, end, !has_active_flag));
  }
  carried_->outcome = Outcome::lost;
  carried_->told_at = carried_->started_at + bits(static_cast<std::int64_t>(end));
  carried_->free_at = carried_->told_at + bits(flags + delimiter_bits + can_bits_between_frames);
}

/// The sender detects it in the slot after the CRC and its delimiter.
void CanBus::end_without_acknowledgement() {
  const CanFrame& frame = carried_->speaker().frame;
  const bool is_longest = config_.stuffing == Stuffing::longest;
  const std::int64_t length = is_longest ? bits_on_wire_max(frame) : bits_on_wire(frame);
  const std::int64_t seen_after = length - can_bits_between_frames - can_bits_of_trailer + 2;
  carried_->outcome = Outcome::unacknowledged;
  carried_->told_at = carried_->started_at + bits(seen_after);
  carried_->free_at = carried_->told_at + bits(flag_bits + delimiter_bits + can_bits_between_frames);
}

void CanBus::end_well() {
  const CanFrame& frame = carried_->speaker().frame;
  const bool is_longest = config_.stuffing == Stuffing::longest;
  const std::int64_t length = is_longest ? bits_on_wire_max(frame) : bits_on_wire(frame);
  carried_->free_at = carried_->started_at + bits(length);
  carried_->told_at = carried_->free_at - bits(is_longest ? 0 : can_bits_between_frames);
}

// --- effects on all stations -----------------------------------------------------------------------------------------

std::vector<BusEvent> CanBus::take_due(TimePoint now) {
  std::vector<BusEvent> events = std::exchange(dropped_, {});
  if (carried_ && !carried_->is_told && carried_->told_at <= now) tell(events);
  if (carried_ && carried_->free_at <= now) free_bus();
  if (off_count_ > 0) recover_due(now, events);
  return events;
}

void CanBus::tell(std::vector<BusEvent>& events) {
  carried_->is_told = true;
  const Sender& speaker = carried_->speaker();
  const bool is_good = carried_->outcome == Outcome::good;
  events.push_back({.at = carried_->told_at,
                    .kind = is_good ? BusEvent::Kind::heard : BusEvent::Kind::error,
                    .station = speaker.station,
                    .frame = speaker.frame,
                    .missed_by = carried_->missed_by});
  is_good ? count_good(events) : count_lost(events);
  for (const Sender& sender : carried_->senders) {
    if (is_passive(sender.station)) at(sender.station).may_start_at = carried_->free_at + bits(suspend_bits);
  }
}

void CanBus::count_good(std::vector<BusEvent>& events) {
  for (const Station station : receivers()) {
    const bool is_missed = station == carried_->missed_by;
    const int receive = at(station).counters.receive;
    const int less = receive > passive_above ? receive - passive_above : std::min(receive, 1);
    add(station, 0, is_missed ? 1 : -less, events);
  }
  for (const Sender& sender : carried_->senders) {
    if (sender.has_failed) {
      add(sender.station, failed_transmission, 0, events);
      try_again(sender, events);
    } else {
      add(sender.station, -std::min(at(sender.station).counters.transmit, 1), 0, events);
    }
  }
}

void CanBus::count_lost(std::vector<BusEvent>& events) {
  const auto& first = carried_->first_to_see;
  for (const Station station : receivers()) {
    const bool is_first = std::find(first.begin(), first.end(), station) != first.end();
    add(station, 0, is_first && !is_passive(station) ? first_to_see_it : 1, events);
  }
  for (const Sender& sender : carried_->senders) {
    const bool is_only_alone = carried_->outcome == Outcome::unacknowledged && is_passive(sender.station);
    add(sender.station, is_only_alone ? 0 : failed_transmission, 0, events);
    try_again(sender, events);
  }
}

void CanBus::try_again(const Sender& sender, std::vector<BusEvent>& events) {
  Member& member = at(sender.station);
  if (member.keeps_frame && !member.is_off) {
    member.queue.insert(member.queue.begin(), sender.frame);
  } else {
    events.push_back(
        {.at = carried_->told_at, .kind = BusEvent::Kind::dropped, .station = sender.station, .frame = sender.frame});
  }
}

void CanBus::add(Station station, int transmit, int receive, std::vector<BusEvent>& events) {
  const ErrorState before = state(station);
  ErrorCounters& counters = at(station).counters;
  counters.transmit += transmit;
  counters.receive = std::min(counters.receive + receive, receive_counter_max);
  if (counters.transmit > bus_off_above) go_off(station, carried_->told_at, events);
  if (state(station) == before) return;
  events.push_back({.at = carried_->told_at,
                    .kind = BusEvent::Kind::state,
                    .station = station,
                    .state = state(station),
                    .counters = counters});
}

void CanBus::go_off(Station station, TimePoint now, std::vector<BusEvent>& events) {
  Member& member = at(station);
  off_count_ += member.is_off ? 0 : 1;
  member.is_off = true;
  for (const CanFrame& frame : member.queue) {
    events.push_back({.at = now, .kind = BusEvent::Kind::dropped, .station = station, .frame = frame});
  }
  member.queue.clear();
  if (member.restart_after) member.restarts_at = now + *member.restart_after;
}

/// Every frame ends with 11 recessive bits, a lost one too.
void CanBus::free_bus() {
  busy_ += carried_->free_at - carried_->started_at;
  idle_since_ = carried_->free_at;
  carried_.reset();
  if (off_count_ == 0) return;
  for (Member& member : members_) {
    if (member.recessive_left) --*member.recessive_left;
  }
}

// --- back from bus-off ----------------------------------------------------------------------------------------------

void CanBus::restart(Station station, TimePoint now) {
  if (at(station).is_off && !at(station).recessive_left) begin_recovery(station, now);
}

void CanBus::begin_recovery(Station station, TimePoint now) {
  if (!carried_) count_recessive(now);
  at(station).restarts_at.reset();
  at(station).recessive_left = recovery_sequences;
}

/// Counts the sequences in the idle time so far; the next count starts now.
void CanBus::count_recessive(TimePoint now) {
  const auto sequences = static_cast<int>((now - idle_since_) / bits(recovery_bits));
  for (Member& member : members_) {
    if (member.recessive_left) *member.recessive_left = std::max(*member.recessive_left - sequences, 1);
  }
  idle_since_ = now;
}

void CanBus::recover_due(TimePoint now, std::vector<BusEvent>& events) {
  for (const Station station : every_station) {
    const std::optional<TimePoint> restarts_at = at(station).restarts_at;
    if (restarts_at && *restarts_at <= now) begin_recovery(station, *restarts_at);
  }
  for (const Station station : every_station) {
    Member& member = at(station);
    if (!member.recessive_left) continue;
    const TimePoint done_at = idle_since_ + *member.recessive_left * bits(recovery_bits);
    const bool is_done = carried_ ? *member.recessive_left <= 0 : done_at <= now;
    if (!is_done) continue;
    member.recessive_left.reset();
    member.is_off = false;
    --off_count_;
    member.counters = {};
    member.may_start_at = {};
    events.push_back({.at = carried_ ? now : done_at, .kind = BusEvent::Kind::state, .station = station});
  }
}

TimePoint CanBus::next_at() const {
  TimePoint next = TimePoint::max();
  if (carried_) next = carried_->is_told ? carried_->free_at : carried_->told_at;
  if (carried_ && off_count_ == 0) return next;
  for (const Station station : every_station) {
    const Member& member = at(station);
    if (member.restarts_at) next = std::min(next, *member.restarts_at);
    if (carried_) continue;
    if (is_there(station) && !member.queue.empty()) next = std::min(next, std::max(member.may_start_at, idle_since_));
    if (member.recessive_left) next = std::min(next, idle_since_ + *member.recessive_left * bits(recovery_bits));
  }
  return next;
}

}  // namespace bmu::test
