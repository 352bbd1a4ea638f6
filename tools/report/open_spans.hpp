// The spans of a report that are not over yet: the phase, the contactors that the unit says are closed, the faults and
// warnings that are there, looked for in the core at every decision.
//
// Cost: a look at every row of the fault table.
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
  /// Begins in `spans` what is so from this decision on, and ends what is so no longer. What is so at the first look,
  /// and at the first behind break_off(), has begun before.
  void look(const Core& core, TimePoint now, std::int64_t at_us, std::vector<SpanReport>& spans);
  /// Nothing is known of what follows: what is so goes on.
  void break_off(std::vector<SpanReport>& spans, std::int64_t at_us);

 private:
  struct Row {
    std::optional<std::size_t> span;  // its place in the report; none: it is not so

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
