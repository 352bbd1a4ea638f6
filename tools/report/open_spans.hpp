// The states of a report that are still active: the phase, the contactors that the PDU reports closed, the present
// faults and warnings, read from the core at every decision.
//
// Cost: a check of every row of the fault table.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/core/core.hpp"
#include "tools/report/data.hpp"

namespace bmu::report {

class OpenSpans {
 public:
  /// Starts in `spans` the states that are active from this decision on, and ends those that are not. States that are
  /// active in the first call, and in the first after break_off(), started before.
  void look(const Core& core, TimePoint now, std::int64_t at_us, std::vector<SpanReport>& spans);
  /// Called before an unknown time: active states continue.
  void break_off(std::vector<SpanReport>& spans, std::int64_t at_us);

 private:
  struct Row {
    std::optional<std::size_t> span;  // its index in the report; none: not active

    void set(bool is_so, const SpanReport& as, std::vector<SpanReport>& spans, std::int64_t at_us);
    void break_off(std::vector<SpanReport>& spans, std::int64_t at_us);
  };
  static constexpr std::size_t contactor_count = 4;

  void look_at_contactors(const Core& core, TimePoint now, std::int64_t at_us, std::vector<SpanReport>& spans);
  void look_at_faults(const Core& core, std::int64_t at_us, std::vector<SpanReport>& spans);

  Row phase_;
  std::array<Row, contactor_count> contactors_;
  std::array<Row, fault_count> faults_;
  bool is_first_ = true;
};

}  // namespace bmu::report
