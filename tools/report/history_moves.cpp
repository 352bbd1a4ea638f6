#include "tools/report/history_moves.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/core/records/event.hpp"
#include "tools/report/data.hpp"

namespace bmu::report {

namespace {

/// Tolerance: an event has the time of its decision, a row accumulates the time between decisions.
constexpr std::int64_t slack_ms = 150;

std::string_view name_of(EventId id) {
  return row_of(id).name;
}

/// True for a phase with both main contactors commanded closed.
bool is_closed(std::string_view phase) {
  const auto* const found =
      std::find_if(all_phases.begin(), all_phases.end(), [&](Phase one) { return to_text(one) == phase; });
  if (found == all_phases.end()) return false;
  const ContactorOutputs outputs = outputs_for({.phase = *found});
  return outputs.main_positive && outputs.main_negative;
}

std::int64_t begin_ms(const HistoryRow& row) {
  return row.uptime_ms.value_or(0) - row.span_ms.value_or(0);
}

std::int64_t closed_ms_of(const std::vector<PhasePart>& parts) {
  std::int64_t sum_ms = 0;
  for (const PhasePart& part : parts) sum_ms += part.closed_ms;
  return sum_ms;
}

PhasePart part_of(std::int64_t from_ms, std::int64_t to_ms, std::string phase, bool is_closed) {
  return {{from_ms, to_ms}, std::move(phase), is_closed ? to_ms - from_ms : 0};
}

/// The phase at the start of the minute, as far as the rows show; none: unknown.
std::optional<std::string> phase_before(const HistoryRow& row, const HistoryRow* before) {
  if (before != nullptr) return before->phase;
  // A session starts open.
  return begin_ms(row) < slack_ms ? std::optional(std::string(to_text(Phase::open))) : std::nullopt;
}

/// Phases from the row alone: exact if the contactors moved at most once.
std::vector<PhasePart> phases_by_figures(const HistoryRow& row, const HistoryRow* before) {
  const std::int64_t span_ms = row.span_ms.value_or(0);
  const bool ends_closed = is_closed(row.phase);
  const std::int64_t closed_ms =
      std::clamp<std::int64_t>(row.closed_ms.value_or(ends_closed ? span_ms : 0), 0, span_ms);
  if (closed_ms == 0 && !ends_closed) return {part_of(0, span_ms, row.phase, false)};
  if (closed_ms == span_ms && ends_closed) return {part_of(0, span_ms, row.phase, true)};
  const auto first = phase_before(row, before);
  if (first && is_closed(*first) != ends_closed) {
    const std::int64_t move_ms = ends_closed ? span_ms - closed_ms : closed_ms;
    std::vector<PhasePart> parts;
    if (move_ms > 0) parts.push_back(part_of(0, move_ms, *first, !ends_closed));
    if (move_ms < span_ms) parts.push_back(part_of(move_ms, span_ms, row.phase, ends_closed));
    return parts;
  }
  return {PhasePart{{0, span_ms}, unknown_phase, closed_ms}};
}

}  // namespace

void HistoryMoves::take(const HistoryEvent& event) {
  if (!event.life || !event.uptime_ms) return;
  Move move{.uptime_ms = *event.uptime_ms, .name = event.fault};
  if (event.name == name_of(EventId::phase_changed)) {
    const std::string_view text = event.text;
    const std::size_t from = text.find(": ");
    const std::size_t arrow = text.find(" -> ");
    if (from == std::string_view::npos || arrow == std::string_view::npos || arrow < from + 2) return;
    move.from = text.substr(from + 2, arrow - from - 2);
    move.to = text.substr(arrow + 4);
  } else if (event.name == name_of(EventId::fault_confirmed) || event.name == name_of(EventId::fault_cleared)) {
    move.what = What::fault;
    move.begins = event.name == name_of(EventId::fault_confirmed);
  } else if (event.name == name_of(EventId::fault_warned) || event.name == name_of(EventId::fault_warning_over)) {
    move.what = What::warning;
    move.begins = event.name == name_of(EventId::fault_warned);
  } else {
    return;
  }
  of_life_[*event.life].push_back(std::move(move));
}

std::vector<const HistoryMoves::Move*> HistoryMoves::moves_in(const HistoryRow& row, What what,
                                                              std::string_view name) const {
  std::vector<const Move*> moves;
  const auto found = of_life_.find(row.life.value_or(-1));
  if (found == of_life_.end()) return moves;
  const std::vector<Move>& all = found->second;
  // A transition in the decision that ended a minute belongs to that minute.
  auto at =
      std::partition_point(all.begin(), all.end(), [&](const Move& move) { return move.uptime_ms <= begin_ms(row); });
  for (; at != all.end() && at->uptime_ms <= row.uptime_ms.value_or(0); ++at) {
    if (at->what == what && (what == What::phase || at->name == name)) moves.push_back(&*at);
  }
  return moves;
}

/// Phases from the events; nothing if they contradict the row.
std::vector<PhasePart> HistoryMoves::told_phases(const HistoryRow& row, const HistoryRow* before) const {
  const std::vector<const Move*> moves = moves_in(row, What::phase);
  std::string phase = moves.empty() ? row.phase : moves.front()->from;
  const auto first = phase_before(row, before);
  if (first && *first != phase) return {};
  std::vector<PhasePart> parts;
  std::int64_t at_ms = 0;
  const auto end_part = [&](std::int64_t to_ms) {
    if (to_ms > at_ms) parts.push_back(part_of(at_ms, to_ms, phase, is_closed(phase)));
    at_ms = to_ms;
  };
  for (const Move* move : moves) {
    if (move->from != phase) return {};
    end_part(move->uptime_ms - begin_ms(row));
    phase = move->to;
  }
  end_part(row.span_ms.value_or(0));
  if (phase != row.phase) return {};
  const auto moved = static_cast<std::int64_t>(moves.size());
  if (!row.closed_ms) return parts;
  const std::int64_t off_ms = closed_ms_of(parts) - *row.closed_ms;
  return std::abs(off_ms) <= slack_ms * (moved + 1) ? parts : std::vector<PhasePart>{};
}

std::vector<PhasePart> HistoryMoves::phases_of(const HistoryRow& row, const HistoryRow* before) const {
  std::vector<PhasePart> parts = told_phases(row, before);
  return parts.empty() ? phases_by_figures(row, before) : parts;
}

std::vector<MinutePart> HistoryMoves::times_of_fault(const HistoryRow& row, std::string_view name,
                                                     bool is_warning) const {
  const std::vector<const Move*> moves = moves_in(row, is_warning ? What::warning : What::fault, name);
  std::vector<MinutePart> parts;
  bool is_so = moves.empty() || !moves.front()->begins;
  std::int64_t since_ms = 0;
  for (const Move* move : moves) {
    const std::int64_t at_ms = move->uptime_ms - begin_ms(row);
    if (move->begins == is_so) continue;
    if (is_so) parts.push_back({since_ms, at_ms});
    is_so = move->begins;
    since_ms = at_ms;
  }
  if (is_so) parts.push_back({since_ms, row.span_ms.value_or(0)});
  return parts;
}

}  // namespace bmu::report
