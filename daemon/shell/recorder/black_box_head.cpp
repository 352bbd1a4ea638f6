#include "daemon/shell/recorder/black_box_head.hpp"

#include <array>
#include <cinttypes>
#include <cstdio>

#include "daemon/recording/record_writer.hpp"
#include "daemon/shell/json/freeze_json.hpp"

namespace bmu {

namespace {

bool is_of_fault(const Event& event) {
  return event.id == EventId::fault_confirmed || event.cause == OpeningCause::fault;
}

}  // namespace

bool is_routine(const RecordTrigger& trigger) {
  const Event& event = trigger.event;
  return event.id == EventId::opened &&
         (event.cause == OpeningCause::request_over || event.cause == OpeningCause::shut_down);
}

std::string black_box_word(const RecordTrigger& trigger) {
  const Event& event = trigger.event;
  return is_of_fault(event) ? "fault-" + std::string(row_of(event.fault).name)
                            : "opened-" + std::string(to_text(event.cause));
}

std::string black_box_head(const RecordTrigger& trigger) {
  std::array<char, 64> time{};
  std::snprintf(time.data(), time.size(), "# black-box-at (%" PRId64 ".%06" PRId64 ")\n",
                trigger.unix_time_us / 1'000'000, trigger.unix_time_us % 1'000'000);
  std::string head = "# black-box " + to_text(trigger.event) + "\n" + time.data();
  if (!trigger.freeze) return head;
  const FaultRow& row = row_of(trigger.event.fault);
  JsonText freeze;
  freeze.object([&] { put_freeze(freeze, *trigger.freeze, row, element_text(trigger.freeze->element, row.unit)); });
  append_record_text("freeze", Json::parse(freeze.take()).dump(2) + "\n", head);
  return head;
}

}  // namespace bmu
