#include "tools/report/open_spans.hpp"

#include <string>
#include <string_view>

#include "daemon/core/faults/fault_table.hpp"

namespace bmu::report {

namespace {

struct ContactorRow {
  std::string_view name;
  bool PduState::*is_closed;
};
constexpr std::array contactor_table{
    ContactorRow{"main positive", &PduState::main_positive_closed},
    ContactorRow{"main negative", &PduState::main_negative_closed},
    ContactorRow{"precharge", &PduState::precharge_closed},
    ContactorRow{"charge contactor", &PduState::charge_closed},
};

}  // namespace

void OpenSpans::Row::set(bool is_so, const SpanReport& as, std::vector<SpanReport>& spans, std::int64_t at_us) {
  const bool goes_on = is_so && span && spans[*span].text == as.text && spans[*span].kind == as.kind;
  if (goes_on) return;
  if (span) spans[*span].to_us = at_us;
  span.reset();
  if (!is_so) return;
  span = spans.size();
  spans.push_back(as);
  spans.back().from_us = at_us;
}

void OpenSpans::Row::break_off(std::vector<SpanReport>& spans, std::int64_t at_us) {
  if (!span) return;
  spans[*span].to_us = at_us;
  spans[*span].goes_on = true;
  span.reset();
}

void OpenSpans::break_off(std::vector<SpanReport>& spans, std::int64_t at_us) {
  phase_.break_off(spans, at_us);
  for (Row& row : contactors_) row.break_off(spans, at_us);
  for (Row& row : faults_) row.break_off(spans, at_us);
  is_first_ = true;
}

void OpenSpans::look(const Core& core, TimePoint now, std::int64_t at_us, std::vector<SpanReport>& spans) {
  const std::size_t spans_before = spans.size();
  const std::string phase(to_text(core.sequence().phase));
  phase_.set(true, {.kind = SpanKind::phase, .name = phase, .text = phase, .place = {}}, spans, at_us);
  look_at_contactors(core, now, at_us, spans);
  look_at_faults(core, at_us, spans);
  if (is_first_) {
    for (std::size_t i = spans_before; i < spans.size(); ++i) spans[i].has_begun_before = true;
  }
  is_first_ = false;
}

void OpenSpans::look_at_contactors(const Core& core, TimePoint now, std::int64_t at_us,
                                   std::vector<SpanReport>& spans) {
  static_assert(contactor_table.size() == contactor_count);
  const Measured<PduState>& pdu = core.sensors().pdu;
  const bool is_heard = pdu.is_usable(now, core.config().ages.pdu_status);
  for (std::size_t i = 0; i < contactor_table.size(); ++i) {
    const std::string name(contactor_table[i].name);
    contactors_[i].set(is_heard && pdu.value.*contactor_table[i].is_closed,
                       {.kind = SpanKind::contactor, .name = name, .text = name + " closed", .place = {}}, spans,
                       at_us);
  }
}

void OpenSpans::look_at_faults(const Core& core, std::int64_t at_us, std::vector<SpanReport>& spans) {
  for (const FaultRow& row : fault_table()) {
    const FaultState& state = core.faults().state(row.id);
    Row& open = faults_[static_cast<std::size_t>(row.id)];
    const bool is_fault = state.is_present();
    const bool is_so = is_fault || state.is_warning;
    if (!is_so && !open.span) continue;
    const Reading& seen = is_fault ? state.confirmed : state.warning;
    open.set(is_so,
             {.kind = is_fault ? SpanKind::fault : SpanKind::warning,
              .name = std::string(row.name),
              .text = std::string(row.meaning),
              .place = to_text(seen.element)},
             spans, at_us);
  }
}

}  // namespace bmu::report
