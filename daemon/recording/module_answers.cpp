#include "daemon/recording/module_answers.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "protocol/assert.hpp"
#include "protocol/receive_check.hpp"

namespace bmu {

namespace {

using internal_bus::ident;
using internal_bus::status;

/// Distance of the identifiers of two kinds of answers: one identifier for each node.
constexpr unsigned id_step = internal_bus::cells_1.base_id - status.base_id;
/// A module has answered within this time.
constexpr Duration answer_time = 5ms;
/// A RESPONSE is sent within 10 ms.
constexpr Duration response_time = 20ms;

constexpr std::size_t kind_of(const MessageSpec& message) {
  return (message.base_id - std::size_t{status.base_id}) / id_step;
}
constexpr std::uint16_t bit_of(const MessageSpec& message) {
  return static_cast<std::uint16_t>(1U << kind_of(message));
}

struct Wish {
  bool is_made;
  std::uint16_t kinds;
};

std::uint16_t wanted_by(const CanFrame& poll) {
  using namespace internal_bus;
  const Wish wishes[] = {
      {read_raw<internal_bus::poll, "want_status">(poll) != 0, bit_of(status)},
      {read_raw<internal_bus::poll, "want_cells">(poll) != 0,
       static_cast<std::uint16_t>(bit_of(cells_1) | bit_of(cells_2) | bit_of(cells_3) | bit_of(cells_4))},
      {read_raw<internal_bus::poll, "want_temp">(poll) != 0,
       static_cast<std::uint16_t>(bit_of(temp_1) | bit_of(temp_2))},
      {read_raw<internal_bus::poll, "want_module">(poll) != 0, bit_of(internal_bus::module)},
      {read_raw<internal_bus::poll, "want_ident">(poll) != 0, bit_of(ident)},
  };
  std::uint16_t wanted = 0;
  for (const Wish& wish : wishes) {
    if (wish.is_made) wanted |= wish.kinds;
  }
  return wanted;
}

std::uint8_t counter_of(const CanFrame& frame) {
  return frame.data[6];
}

/// STATUS again, with voltages that have grown older meanwhile: they belong to the recorded current. No older than a
/// core that polls continuously would accept.
CanFrame aged(const CanFrame& frame, Duration since) {
  constexpr std::int64_t age_max_ms = 254;
  const SignalValue then = read<status, "cell_voltage_age_ms">(frame);
  if (!then.is_valid()) return frame;
  CanFrame older = frame;
  const std::int64_t age_ms = then.value + std::chrono::duration_cast<std::chrono::milliseconds>(since).count();
  write<status, "cell_voltage_age_ms">(older, std::min(age_ms, age_max_ms));
  return older;
}

/// A valid frame of a module; none: a frame that is passed on unchanged.
MessageMatch module_message(const CanFrame& frame) {
  if (form_fault(frame)) return {};
  const MessageMatch match = internal_bus::catalogue.find(frame.id);
  const bool is_module_s = match.message != nullptr && match.message->sender == Sender::mmu;
  return is_module_s && !content_fault(*match.message, frame) ? match : MessageMatch{};
}

}  // namespace

void ModuleAnswers::begin(const PollConfig& then) {
  *this = {};
  then_ = then;
}

void ModuleAnswers::note(Asked Node::*side, const CanFrame& sent, TimePoint at) {
  const MessageMatch match = internal_bus::catalogue.find(sent.id);
  if (match.message == &internal_bus::command) return note_command(side, sent, match.node, at);
  if (match.message != &internal_bus::poll) return;
  const auto target = static_cast<std::size_t>(read_raw<internal_bus::poll, "target_node">(sent));
  for (std::size_t node = 1; node < nodes_.size(); ++node) {
    if (target != 0 && target != node) continue;
    (nodes_[node].*side).poll = {.is_known = true,
                                 .counter = counter_of(sent),
                                 .wanted = wanted_by(sent),
                                 .answered = 0,
                                 .is_to_all = target == 0,
                                 .at = at};
  }
  if (side == &Node::now) look_at_ = std::min(look_at_, at + answer_time);
}

void ModuleAnswers::note_command(Asked Node::*side, const CanFrame& sent, std::size_t target, TimePoint at) {
  for (std::size_t node = 1; node < nodes_.size(); ++node) {
    if (target == 0 || target == node) (nodes_[node].*side).bleeding.note(sent, at);
  }
  if (target == 0) return;  // no module responds
  (nodes_[target].*side).order = {
      .is_known = true, .is_open = true, .counter = counter_of(sent), .operation = sent.data[0], .at = at};
  if (side == &Node::now) look_at_ = std::min(look_at_, at + answer_time);
}

/// Cells that the second core has not commanded are as recorded, except that those commanded by the recording's core
/// are off.
CanFrame ModuleAnswers::told(Node& node, const CanFrame& frame, unsigned counter, TimePoint at) {
  using internal_bus::module;
  CanFrame heard = frame;
  const MessageSpec* const message = internal_bus::catalogue.find(frame.id).message;
  BMU_ASSERT(message != nullptr);
  node.is_told_otherwise = node.is_told_otherwise || !node.now.bleeding.is_as(node.then.bleeding);
  const Said& last_module = node.last[kind_of(module)];
  if (node.is_told_otherwise && last_module.is_known) {
    const ToldBleeding& own = node.now.bleeding;
    const auto recorded = static_cast<unsigned>(read_raw<module, "balancing_cells">(last_module.frame));
    const unsigned others = recorded & ~unsigned{own.told()} & ~unsigned{node.then.bleeding.told()};
    const std::int64_t on = others | own.on(at);
    if (message == &module) write<module, "balancing_cells">(heard, on);
    if (message == &status) write<status, "balancing">(heard, on != 0 ? 1 : 0);
  }
  seal(*message, static_cast<std::uint8_t>(counter), heard);
  return heard;
}

std::optional<CanFrame> ModuleAnswers::hear(const CanFrame& frame, TimePoint at) {
  const MessageMatch match = module_message(frame);
  if (match.message == nullptr) return frame;
  Node& node = nodes_[match.node];
  if (match.message == &internal_bus::response) return hear_response(node, frame, at);
  return hear_answer(node, kind_of(*match.message), frame, at);
}

std::optional<CanFrame> ModuleAnswers::hear_answer(Node& node, std::size_t kind, const CanFrame& frame, TimePoint at) {
  const auto bit = static_cast<std::uint16_t>(1U << kind);
  Poll& then = node.then.poll;
  Poll& now = node.now.poll;
  const bool is_unasked = kind == kind_of(ident) && counter_of(frame) == 0;
  const unsigned lag = then.is_known ? then.counter - counter_of(frame) : 0U;
  if (lag % 256 != 0 && !is_unasked) return now.is_known ? told(node, frame, now.counter - lag, at) : frame;
  const bool was_said = (then.answered & bit) != 0;
  const bool was_asked = !then.is_known || (then.wanted & bit) != 0;
  then.answered |= bit;
  node.last[kind] = {.is_known = true, .frame = frame, .at = at};
  if (!now.is_known || is_unasked) return frame;
  // A duplicate, or an unrequested answer: a fault of the module, which the second core would have received, too.
  const bool has_it = (now.answered & bit) != 0;
  if (has_it && was_asked && !was_said) return std::nullopt;
  now.answered |= bit;
  return told(node, frame, now.counter, at);
}

std::optional<CanFrame> ModuleAnswers::hear_response(Node& node, const CanFrame& frame, TimePoint at) {
  Order& then = node.then.order;
  Order& now = node.now.order;
  const unsigned lag = then.is_known ? then.counter - counter_of(frame) : 0U;
  if (!now.is_known) return frame;
  if (lag % 256 != 0) return told(node, frame, now.counter - lag, at);
  const bool was_waited_for = std::exchange(then.is_open, false);
  const bool is_waited_for = now.is_open && now.operation == frame.data[0];
  if (was_waited_for && !is_waited_for) return std::nullopt;
  now.is_open = false;
  return told(node, frame, now.counter, at);
}

bool ModuleAnswers::Node::owes() const {
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    if (last[kind].is_known && (then.poll.open() & (1U << kind)) != 0) return true;
  }
  return false;
}

/// Minimum age of the last answer to be sent again.
Duration ModuleAnswers::patience(std::size_t kind, const Poll& poll) const {
  const bool may_repeat = poll.is_to_all || kind == kind_of(ident);  // which changes with the module only
  if (may_repeat) return Duration{};
  const bool is_temperature = kind == kind_of(internal_bus::temp_1) || kind == kind_of(internal_bus::temp_2);
  return then_.period * (is_temperature ? then_.temperature_every : 1) * 3 / 2;
}

std::optional<CanFrame> ModuleAnswers::next_due(TimePoint now) {
  if (now < look_at_) return std::nullopt;
  for (std::size_t kind = 0; kind < kinds; ++kind) {
    if (auto frame = due_answer(kind, now)) return frame;
  }
  if (auto frame = due_response(now)) return frame;
  const bool is_waiting = std::any_of(nodes_.begin(), nodes_.end(), [](const Node& node) {
    return node.now.poll.open() != 0 || node.now.order.is_open;
  });
  look_at_ = is_waiting ? now + answer_time : TimePoint::max();
  return std::nullopt;
}

std::optional<CanFrame> ModuleAnswers::due_answer(std::size_t kind, TimePoint now) {
  const auto bit = static_cast<std::uint16_t>(1U << kind);
  for (Node& node : nodes_) {
    Poll& poll = node.now.poll;
    const Said& last = node.last[kind];
    const bool is_open = (poll.open() & bit) != 0 && now - poll.at >= answer_time;
    if (!is_open || !last.is_known || node.owes() || now - last.at < patience(kind, poll)) continue;
    poll.answered |= bit;
    const Duration since = std::min(now - last.at, then_.period);
    return told(node, kind == kind_of(status) ? aged(last.frame, since) : last.frame, poll.counter, now);
  }
  return std::nullopt;
}

std::optional<CanFrame> ModuleAnswers::due_response(TimePoint now) {
  for (std::size_t number = 1; number < nodes_.size(); ++number) {
    Node& node = nodes_[number];
    Order& order = node.now.order;
    const bool is_given_then = node.then.order.is_open && node.then.order.operation == order.operation;
    const bool is_there = node.last[kind_of(status)].is_known && !node.owes();
    if (!order.is_open || is_given_then || !is_there || now - order.at < response_time) continue;
    order.is_open = false;
    CanFrame frame = make_frame(internal_bus::response, static_cast<std::uint8_t>(number));
    write<internal_bus::response, "operation">(frame, order.operation);
    write<internal_bus::response, "result">(frame, static_cast<std::int64_t>(internal_bus::CommandResult::done));
    seal(internal_bus::response, order.counter, frame);
    return frame;
  }
  return std::nullopt;
}

}  // namespace bmu
