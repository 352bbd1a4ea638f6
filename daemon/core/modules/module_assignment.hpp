// Assigns a node number to the module with a serial number, and verifies that the module has adopted it.
//
//   request --not permitted--> refused, with the reason
//           --permitted------> asking: COMMAND "set node number" to all, three times within a second, identity polls
//                              of the new node in between
//                              --IDENT from the node, this serial number--> taken
//                              --1.6 s without it-----------------------> not_seen, or seen_other: another answered
//
// No module responds to a COMMAND to all, so the module's own IDENT under its new number is the only confirmation: the
// module sends it unsolicited 10 ms x node after the change, and it is polled. The command contains the serial number
// of its module, all others ignore it: it reaches one of several that share a node number, too.
//
// Permitted only while the pack is open without a close request: a changed number changes the assignment of cells. The
// node of a module that is present is in use; two modules change places by way of a third number, of the pack or not.
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
  /// Permits a module that has not been received and may nevertheless be present: several that share a number and send
  /// at the same time destroy each other's frames. The serial number is on its label.
  bool is_unheard_allowed = false;
};

enum class AssignmentRefusal : std::uint8_t {
  none,
  shutting_down,
  not_open,
  close_requested,
  bus_down,
  resting,
  busy,             // another assignment is in progress
  bad_node,         // not 1 to 63
  already_there,    // the module already has this node
  node_taken,       // by another module that is present
  named_otherwise,  // the pack file has another serial number for this node
  unheard,          // no module with this serial number has been received
  foreign_modules,  // these do not accept a node number
};

enum class AssignmentStage : std::uint8_t { none, refused, asking, taken, seen_other, not_seen };

[[nodiscard]] std::string_view to_text(AssignmentRefusal refusal);
[[nodiscard]] std::string_view to_text(AssignmentStage stage);

/// State of the core that decides on the request.
struct AssignmentView {
  bool is_shutting_down = false;
  bool is_open = false;
  bool is_close_requested = false;
  bool is_bus_up = false;
  bool is_resting = false;
  std::uint8_t node_now = 0;   // where the serial number has been received; 0: nowhere
  bool is_node_taken = false;  // by another module
  bool is_named_otherwise = false;
  bool are_modules_ours = true;
};

class ModuleAssignment {
 public:
  /// Checks the request and starts the assignment. Returns the refusal, or none.
  AssignmentRefusal ask(const AssignmentRequest& request, const AssignmentView& view, TimePoint now);
  /// Handles an IDENT of a module. True if this completed the assignment.
  bool observe_identity(std::uint8_t node, std::uint32_t serial_number, TimePoint at);

  struct Step {
    bool sends_command = false;
    bool asks_node = false;  // identity poll
    bool has_ended = false;  // without success, in this tick
  };
  /// One tick.
  [[nodiscard]] Step step(TimePoint now);

  [[nodiscard]] AssignmentStage stage() const { return stage_; }
  [[nodiscard]] AssignmentRefusal refusal() const { return refusal_; }
  [[nodiscard]] bool is_asking() const { return stage_ == AssignmentStage::asking; }
  [[nodiscard]] const AssignmentRequest& request() const { return request_; }
  [[nodiscard]] std::uint8_t node_before() const { return node_before_; }  // 0: unknown
  [[nodiscard]] TimePoint asked_at() const { return asked_at_; }
  [[nodiscard]] TimePoint ended_at() const { return ended_at_; }
  /// Serial number of the module that answered from the node instead, at stage seen_other.
  [[nodiscard]] std::uint32_t other_serial_number() const { return other_serial_number_; }
  /// Number of requests so far: a client can distinguish the result of its own request from that of another.
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
