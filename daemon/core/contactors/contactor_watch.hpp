// Monitor of the contactor feedback: auxiliary contacts against commands, each contactor by itself.
//
// A contactor has `feedback_timeout` to follow a change of its command. Once it has followed for `settle`, or that
// timeout has elapsed, a status against the command is a feedback mismatch, which the fault table confirms as soon as
// it has lasted a tick: a main contact that opens by itself and closes again would connect the pack to a DC link that
// has lost its charge, bypassing the precharge. A status from before the command is ignored.
#pragma once

#include <array>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// The first contactor of each kind with a feedback mismatch: 1 + ContactorId, 0 for none.
struct Disobedience {
  std::uint8_t not_following = 0;  // open, and should be closed
  std::uint8_t welded = 0;         // closed, and should be open

  explicit constexpr operator bool() const { return not_following != 0 || welded != 0; }
};

class ContactorWatch {
 public:
  /// All contactors are commanded open from `started_at` on: contacts that the previous session left closed have their
  /// time, too.
  void init(TimePoint started_at);
  /// Takes over the outputs commanded from `now` on; called every tick, whether they have changed or not.
  void command(const ContactorOutputs& outputs, TimePoint now);
  /// Compares the latest PDU state with the commands. Precondition: the state is fresh.
  [[nodiscard]] Disobedience disobeys(const Measured<PduState>& pdu, const ContactorConfig& config, TimePoint now);
  /// Every contactor follows its command, and has done so for `settle` once since it was commanded.
  [[nodiscard]] bool is_settled() const;
  /// When the last contactor was seen to follow its command: earlier samples are not valid for the commanded state.
  /// Meaningful while all are settled.
  [[nodiscard]] TimePoint obeying_since() const;

 private:
  struct Contact {
    bool is_commanded = false;
    TimePoint commanded_at{};
    TimePoint obeying_since{};
    bool has_settled = false;
  };

  [[nodiscard]] static bool judge(Contact& contact, bool is_closed, TimePoint seen_at, const ContactorConfig& config,
                                  TimePoint now);

  std::array<Contact, contactor_id_count> contacts_{};
  BMU_FIELDS(contacts_)
};

}  // namespace bmu
