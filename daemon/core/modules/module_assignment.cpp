#include "daemon/core/modules/module_assignment.hpp"

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

namespace {

constexpr std::uint8_t commands_max = 3;
constexpr Duration command_spacing = 300ms;
/// The module reports its new number 10 ms x node after the change: 630 ms at most, after the last command.
constexpr Duration patience = commands_max * command_spacing + 700ms;
/// Long enough for any answer to the previous poll.
constexpr Duration question_spacing = 100ms;

AssignmentRefusal reason_against(const AssignmentRequest& request, const AssignmentView& view) {
  const bool is_node = request.node >= 1 && request.node <= internal_bus::node_count_max;
  if (!view.are_modules_ours) return AssignmentRefusal::foreign_modules;
  if (view.is_shutting_down) return AssignmentRefusal::shutting_down;
  if (!view.is_open) return AssignmentRefusal::not_open;
  if (view.is_close_requested) return AssignmentRefusal::close_requested;
  if (!view.is_bus_up) return AssignmentRefusal::bus_down;
  if (view.is_resting) return AssignmentRefusal::resting;
  if (!is_node) return AssignmentRefusal::bad_node;
  if (view.node_now == request.node) return AssignmentRefusal::already_there;
  if (view.is_named_otherwise) return AssignmentRefusal::named_otherwise;
  if (view.is_node_taken) return AssignmentRefusal::node_taken;
  if (view.node_now == 0 && !request.is_unheard_allowed) return AssignmentRefusal::unheard;
  return AssignmentRefusal::none;
}

}  // namespace

std::string_view to_text(AssignmentRefusal refusal) {
  switch (refusal) {
    case AssignmentRefusal::none: return "none";
    case AssignmentRefusal::shutting_down: return "daemon shutting down";
    case AssignmentRefusal::not_open: return "contactors not open";
    case AssignmentRefusal::close_requested:
      return "close request active: switch the key off and disconnect the charger";
    case AssignmentRefusal::bus_down: return "internal bus down";
    case AssignmentRefusal::resting: return "modules asleep: run `bmuctl wake` first";
    case AssignmentRefusal::busy: return "another assignment in progress: retry in 2 s";
    case AssignmentRefusal::bad_node: return "invalid node number, expected 1 to 63";
    case AssignmentRefusal::already_there: return "the module already has this node number";
    case AssignmentRefusal::node_taken:
      return "node in use by another module: assign a free number from 1 to 63 to that module first";
    case AssignmentRefusal::named_otherwise: return "the pack file assigns this node to another serial number";
    case AssignmentRefusal::unheard:
      return "no module with this serial number has been received; check the number, or use --unheard if several "
             "modules share a node number";
    case AssignmentRefusal::foreign_modules: return "modules of another manufacturer do not support node assignment";
  }
  return "?";
}

std::string_view to_text(AssignmentStage stage) {
  switch (stage) {
    case AssignmentStage::none: return "none";
    case AssignmentStage::refused: return "refused";
    case AssignmentStage::asking: return "asking";
    case AssignmentStage::taken: return "taken";
    case AssignmentStage::seen_other: return "seen other";
    case AssignmentStage::not_seen: return "not seen";
  }
  return "?";
}

AssignmentRefusal ModuleAssignment::ask(const AssignmentRequest& request, const AssignmentView& view, TimePoint now) {
  if (is_asking()) return AssignmentRefusal::busy;  // the one in progress continues
  const std::uint32_t number = number_ + 1;
  *this = {};
  number_ = number;
  request_ = request;
  node_before_ = view.node_now;
  asked_at_ = now;
  refusal_ = reason_against(request, view);
  stage_ = AssignmentStage::asking;
  if (refusal_ != AssignmentRefusal::none) end(AssignmentStage::refused, now);
  return refusal_;
}

void ModuleAssignment::end(AssignmentStage stage, TimePoint at) {
  stage_ = stage;
  ended_at_ = at;
}

bool ModuleAssignment::observe_identity(std::uint8_t node, std::uint32_t serial_number, TimePoint at) {
  if (!is_asking() || node != request_.node || commands_sent_ == 0) return false;
  if (serial_number != request_.serial_number) {
    has_seen_other_ = true;
    other_serial_number_ = serial_number;
    return false;
  }
  end(AssignmentStage::taken, at);
  return true;
}

ModuleAssignment::Step ModuleAssignment::step(TimePoint now) {
  if (!is_asking()) return {};
  if (now - asked_at_ >= patience) {
    end(has_seen_other_ ? AssignmentStage::seen_other : AssignmentStage::not_seen, now);
    return {.has_ended = true};
  }
  Step step;
  step.sends_command = commands_sent_ < commands_max && now - asked_at_ >= commands_sent_ * command_spacing;
  if (step.sends_command) ++commands_sent_;
  step.asks_node = !step.sends_command && now - node_asked_at_ >= question_spacing;
  if (step.asks_node) node_asked_at_ = now;
  return step;
}

}  // namespace bmu
