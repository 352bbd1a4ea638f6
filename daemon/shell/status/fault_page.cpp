#include "daemon/shell/status/fault_page.hpp"

#include <algorithm>

#include "config/fields/pack_fields.hpp"
#include "daemon/core/contactors/permission.hpp"
#include "daemon/core/faults/fault_evaluate.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "daemon/core/records/event.hpp"
#include "daemon/shell/status/advice.hpp"

namespace bmu {

namespace {

std::string ms_text(Duration span) {
  return std::to_string(to_ms(span)) + " ms";
}

std::string code(std::string_view text) {
  return "`" + std::string(text) + "`";
}

/// Key of its thresholds in a pack file; empty for those that are not there.
std::string key_of(const FaultRow& row) {
  if (row.limit == nullptr) return "";
  const auto rows = limit_rows();
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](const LimitRow& one) { return one.member == row.limit; });
  return found == rows.end() ? "insulation" : "limits/" + std::string(found->key);
}

std::string watched(const FaultRow& row) {
  const std::string times = row.samples > 1 ? ", in at least " + std::to_string(row.samples) + " samples" : "";
  const std::string warns = row.confirms_warning ? "; a warning is confirmed for as long" : "";
  if (row.confirm_time != nullptr) {
    return "confirmed after " + code("confirm/" + std::string(row.name) + "_ms") + " of the pack file, " +
           ms_text(ConfirmTimes{}.*row.confirm_time) + times;
  }
  if (!row.has_limit()) {
    return row.confirm > 0ns ? "confirmed after " + ms_text(row.confirm) + times : "confirmed immediately" + times;
  }
  const std::string side = row.sense == Sense::at_or_above ? "at or above" : "at or below";
  return side + " " + code(key_of(row)) + " of the pack file" + times + warns;
}

std::string reaction(const FaultRow& row) {
  std::string text(to_text(row.reaction));
  if (row.grace > 0ns) text += " of " + ms_text(row.grace) + ", sooner when the current has fallen";
  if (row.waits_above_rating) {
    text += ", or, while the current is above `contactors/break_current_max_mA`, " + ms_text(break_wait_max) + " later";
  }
  if (row.concerns != Concerns::all) text += "; affects " + std::string(to_text(row.concerns)) + " only";
  return text;
}

std::string end(const FaultRow& row) {
  const std::string after = row.has_limit() ? "its `clear_ms`" : ms_text(row.clear);
  const std::string gone = after + " after the cause is gone";
  const std::string kept =
      row.outlives == Outlives::if_closed ? "; persists over a restart if the pack was closed" : "";
  switch (row.latch) {
    case Latch::none: return "automatically " + gone;
    case Latch::until_cleared: return "by `bmuctl clear`, at the earliest " + gone + kept;
    case Latch::until_authorised: return "by `bmuctl clear --authorised`, at the earliest " + gone;
  }
  return "?";
}

std::string codes(const FaultRow& row) {
  std::string text;
  if (row.dtc != 0) text += "622h trouble code " + std::to_string(row.dtc);
  if (row.lithiumate_code != 0) {
    text += (text.empty() ? "" : ", ") + std::string("Lithiumate fault ") + std::to_string(row.lithiumate_code);
  }
  return text;
}

std::string capitalised(std::string_view words) {
  std::string text(words);
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

std::string section(const FaultRow& row) {
  std::string text = "### " + std::string(row.name) + "\n\n" + capitalised(row.meaning) + ".\n\n";
  text += "- Condition: " + watched(row) + "\n";
  text += "- Reaction: " + reaction(row) + "\n";
  text += "- Cleared: " + end(row) + "\n";
  if (const std::string numbers = codes(row); !numbers.empty()) text += "- Codes: " + numbers + "\n";
  text += "- Typical cause: " + std::string(usual_cause_of(row.id)) + "\n";
  return text + "- Action: " + std::string(row.remedy) + "\n\n";
}

}  // namespace

std::string fault_page_markdown() {
  std::string page =
      "# Fault reference\n\n"
      "Made from the fault table by `BMUD_REWRITE=1 test_unit \"[docs]\"`. `bmuctl faults` lists the confirmed "
      "faults,\n"
      "`bmuctl faults NAME` shows the section of one below, `bmuctl why` their effect on the pack. The severity of a "
      "fault is its reaction:\n\n"
      "| reaction | means |\n|---|---|\n"
      "| warn | reported only |\n"
      "| refuse to close | a closed pack stays closed, an open one stays open |\n"
      "| open after grace | the permitted current is zero immediately; the pack opens when the current has fallen, or "
      "after the grace |\n"
      "| open now | the contactors are commanded open in the same tick |\n\n"
      "A pack file may make a reaction stricter, and a grace shorter, never weaker: `faults` in "
      "[configuration](configuration.md).\n\n"
      "Debouncing: a fault is confirmed when the value exceeds its threshold for the confirm time and in at least two "
      "samples;\n"
      "a single bad sample never opens the contactors. A temperature that jumps further than a cell can is used from "
      "the module's\n"
      "next sample on. For the maximum reaction times see [reaction times](reaction-times.md).\n\n"
      "Faults that require a clear command persist over a restart of the daemon. Faults that also occur when modules, "
      "sensors or\n"
      "the insulation monitor are switched off persist only if they were confirmed in a closed pack and not during "
      "shutdown; a\n"
      "persisting cause is detected again.\n\n";
  for (const FaultRow& row : fault_table()) page += section(row);
  page.pop_back();
  return page;
}

std::string blocker_sections_markdown() {
  std::string text;
  for (std::size_t index = 0; index < blocker_count; ++index) {
    const auto blocker = static_cast<Blocker>(index);
    const BlockerAdvice& advice = advice_on(blocker);
    text += "### " + capitalised(to_text(blocker)) + "\n\n" + std::string(advice.meaning) +
            "\n\n- Action: " + std::string(advice.remedy) + "\n\n";
  }
  return text;
}

}  // namespace bmu
