// Whether the contacts do what they were told: auxiliary contacts against commands, each contactor by itself.
//
// A contactor has `feedback_timeout` to follow a change of its command. Once it has followed for `settle`, or that time
// is over, a word against the command is disobedience, which the fault table believes as soon as it has lasted a tick:
// a main contact that opens by itself and closes again would connect the pack to a link that has lost its charge, past
// the precharge. Words from before the command say nothing about it.
#pragma once

#include <array>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/measurement/sensor_table.hpp"
#include "protocol/fields.hpp"

namespace bmu {

/// The first contactor of each kind that disobeys: 1 + ContactorId, 0 for none.
struct Disobedience {
  std::uint8_t not_following = 0;  // open, and should be closed
  std::uint8_t welded = 0;         // closed, and should be open

  explicit constexpr operator bool() const { return not_following != 0 || welded != 0; }
};

class ContactorWatch {
 public:
  /// Everything is commanded open from `started_at` on: contacts that another life left closed have their time, too.
  void init(TimePoint started_at);
  /// What is commanded from `now` on; called every tick, whether it has changed or not.
  void command(const ContactorOutputs& outputs, TimePoint now);
  /// Judges the unit's latest word, which the caller found to be fresh.
  [[nodiscard]] Disobedience disobeys(const Measured<PduState>& pdu, const ContactorConfig& config, TimePoint now);
  /// Every contactor has followed its command, and has done so for `settle`.
  [[nodiscard]] bool is_settled() const;
  /// When the last contactor was seen to follow its command: samples from before say nothing about what is commanded.
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
