// Gives a node number to the module with a serial number, and finds out whether it has taken it.
//
//   asked for --may not--> refused, with the reason
//             --may------> asking: COMMAND "set node number" to all, three times within a second, the new node asked
//                          who it is in between
//                          --IDENT from the node, this serial number--> taken
//                          --1.6 s without it-----------------------> not_seen, or seen_other: who answered instead
//
// A COMMAND to all is answered by nobody, so the module's own IDENT under its new number is the only proof: it comes by
// itself 10 ms x node after the change, and is asked for. The command names its module by the serial number, which all
// others ignore: it reaches one of several that share a node number, too.
//
// Only while the pack is open and nobody wants it closed: whoever changes numbers changes which cell is which. A node
// of somebody who is there is taken; two modules change places by way of a third number, the pack's or not.
//
// Cost: a compare a tick.
#pragma once

#include <cstdint>
#include <string_view>

#include "protocol/fields.hpp"
#include "protocol/time.hpp"

namespace bmu {

struct AssignmentRequest {
  std::uint32_t serial_number = 0;
  std::uint8_t node = 0;
  /// The module has not been heard, and may be there all the same: several that share a number and speak at once
  /// destroy each other's frames. The serial number is on its label.
  bool is_unheard_allowed = false;
};

enum class AssignmentRefusal : std::uint8_t {
  none,
  shutting_down,
  not_open,
  close_requested,
  bus_down,
  resting,
  busy,             // another assignment is under way
  bad_node,         // not 1 to 63
  already_there,    // the module has this node
  node_taken,       // by another module that is there
  named_otherwise,  // the pack file names another serial number for this node
  unheard,          // nobody with this serial number has been heard
  foreign_modules,  // which take no number from us
};

enum class AssignmentStage : std::uint8_t { none, refused, asking, taken, seen_other, not_seen };

[[nodiscard]] std::string_view to_text(AssignmentRefusal refusal);
[[nodiscard]] std::string_view to_text(AssignmentStage stage);

/// What the request is judged by.
struct AssignmentView {
  bool is_shutting_down = false;
  bool is_open = false;
  bool is_close_requested = false;
  bool is_bus_up = false;
  bool is_resting = false;
  std::uint8_t node_now = 0;   // where the serial number has been heard; 0: nowhere
  bool is_node_taken = false;  // by another module
  bool is_named_otherwise = false;
  bool are_modules_ours = true;
};

class ModuleAssignment {
 public:
  /// Judges and begins. Returns the reason against it, or none.
  AssignmentRefusal ask(const AssignmentRequest& request, const AssignmentView& view, TimePoint now);
  /// A module has said who it is. True if this ended the assignment well.
  bool observe_identity(std::uint8_t node, std::uint32_t serial_number, TimePoint at);

  struct Step {
    bool sends_command = false;
    bool asks_node = false;  // who it is
    bool has_ended = false;  // in vain, with this tick
  };
  /// One tick.
  [[nodiscard]] Step step(TimePoint now);

  [[nodiscard]] AssignmentStage stage() const { return stage_; }
  [[nodiscard]] AssignmentRefusal refusal() const { return refusal_; }
  [[nodiscard]] bool is_asking() const { return stage_ == AssignmentStage::asking; }
  [[nodiscard]] const AssignmentRequest& request() const { return request_; }
  [[nodiscard]] std::uint8_t node_before() const { return node_before_; }  // 0: not known
  [[nodiscard]] TimePoint asked_at() const { return asked_at_; }
  [[nodiscard]] TimePoint ended_at() const { return ended_at_; }
  /// Who answered under the node instead, at stage seen_other.
  [[nodiscard]] std::uint32_t other_serial_number() const { return other_serial_number_; }
  /// Requests so far: whoever asked can tell his own answer from another's.
  [[nodiscard]] std::uint32_t number() const { return number_; }

 private:
  void end(AssignmentStage stage, TimePoint at);

  AssignmentStage stage_ = AssignmentStage::none;
  AssignmentRefusal refusal_ = AssignmentRefusal::none;
  AssignmentRequest request_;
  std::uint8_t node_before_ = 0;
  TimePoint asked_at_{};
  TimePoint ended_at_{};
  TimePoint node_asked_at_{};
  std::uint8_t commands_sent_ = 0;
  bool has_seen_other_ = false;
  std::uint32_t other_serial_number_ = 0;
  std::uint32_t number_ = 0;
  BMU_FIELDS(stage_, refusal_, request_, node_before_, asked_at_, ended_at_, node_asked_at_, commands_sent_,
             has_seen_other_, other_serial_number_, number_)
};

}  // namespace bmu
