#include "config/fields/reaction_reader.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "config/fields/pack_fields.hpp"
#include "config/fields/word_fields.hpp"
#include "daemon/core/faults/fault_table.hpp"

namespace bmu {
namespace {

constexpr std::array<std::string_view, 4> reaction_names{"warn", "refuse_close", "open_after_grace", "open_now"};

/// The longest grace of the fault table.
constexpr double grace_max_ms = 5'000;

constexpr std::array reaction_table{
    [] {
      auto field = choice<&StricterReaction::reaction, reaction_names>(
          {.key = "reaction", .meaning = "what the fault does once it is confirmed: docs/faults.md"});
      field.info.is_required = true;
      return field;
    }(),
    number<&StricterReaction::grace>(
        {.key = "grace_ms",
         .min = 0,
         .max = grace_max_ms,
         .meaning =
             "exactly with `open_after_grace`: how long the current may take to fall; less than the fault's own"}),
};

std::string name_of(Reaction reaction) {
  return std::string(reaction_names.at(static_cast<std::size_t>(reaction)));
}

std::string ms_text(Duration span) {
  return std::to_string(to_ms(span)) + " ms";
}

/// "open_after_grace or open_now": reactions stricter than the row's, or as strict with less grace.
std::string stricter_names(const FaultRow& row) {
  const bool may_shorten = row.reaction == Reaction::open_after_grace;
  std::string names;
  for (const Reaction reaction : {Reaction::refuse_close, Reaction::open_after_grace, Reaction::open_now}) {
    const bool is_stricter = reaction > row.reaction || (may_shorten && reaction == row.reaction);
    if (!is_stricter || reaction > strictest_reaction(row)) continue;
    names += (names.empty() ? "" : " or ") + name_of(reaction);
  }
  return names;
}

void check_grace(const JsonValue& value, const StricterReaction& entry, const FaultRow& row, const Place& entry_place,
                 ProblemList& problems) {
  const Place place = entry_place.at("grace_ms");
  const std::string found = value.contains("grace_ms") ? shown(value.at("grace_ms")) : "nothing";
  if (entry.reaction != Reaction::open_after_grace) {
    if (entry.grace == Duration{}) return;
    return problems.add(place, found, "no grace beside " + name_of(entry.reaction));
  }
  const bool has_own = row.grace > Duration{};
  const bool is_short_enough = !has_own || entry.grace < row.grace;
  if (entry.grace > Duration{} && is_short_enough) return;
  const std::string most =
      has_own ? std::to_string(to_ms(row.grace) - 1) + ", less than the fault's own grace of " + ms_text(row.grace)
              : number_text(grace_max_ms);
  problems.add(place, found, "a whole number from 1 to " + most);
}

void check_reaction(const JsonValue& value, const StricterReaction& entry, const FaultRow& row, const Place& place,
                    ProblemList& problems) {
  if (row.reaction == Reaction::open_now) {
    return problems.add(place, shown(value),
                        "no entry: this fault opens at once in every pack, which cannot be made stricter");
  }
  const std::string found = shown(value.at("reaction"));
  if (entry.reaction > strictest_reaction(row)) {
    return problems.add(place.at("reaction"), found,
                        stricter_names(row) + " at most: one sample confirms this fault, and one alone opens nothing");
  }
  const bool is_stricter =
      entry.reaction > row.reaction || (entry.reaction == row.reaction && row.reaction == Reaction::open_after_grace);
  if (!is_stricter) {
    return problems.add(place.at("reaction"), found,
                        stricter_names(row) + ", stricter than the fault's own, " + name_of(row.reaction));
  }
  check_grace(value, entry, row, place, problems);
}

void read_reaction(const JsonValue& value, const Place& place, const FaultRow& row, CoreConfig& core,
                   ProblemList& problems) {
  if (!is_object(value, place, problems)) return;
  check_keys(value, place, keys_of(reaction_fields()), problems);
  StricterReaction entry{.fault = row.id};
  read_fields(value, place, reaction_fields(), entry, problems);
  if (problems.is_good_throughout(place)) check_reaction(value, entry, row, place, problems);
  if (problems.is_good_throughout(place)) core.stricter_reactions.push_back(entry);
}

}  // namespace

std::span<const Field<StricterReaction>> reaction_fields() {
  return reaction_table;
}

void read_reactions(const JsonValue& root, const Place& root_place, CoreConfig& core, ProblemList& problems) {
  const Place place = root_place.at("faults");
  const JsonValue* object = find_section(root, root_place, "faults", problems);
  if (object == nullptr) return;
  std::vector<std::string_view> names;
  for (const FaultRow& row : fault_table()) names.push_back(row.name);
  check_keys(*object, place, names, problems);
  for (const FaultRow& row : fault_table()) {
    const auto found = object->find(row.name);
    if (found != object->end()) read_reaction(*found, place.at(row.name), row, core, problems);
  }
}

namespace {

/// The confirm time of a fault that opens no pack by default, and its maximum, a grace included, if the pack file makes
/// it open. Other such faults have times that are no keys.
struct OpeningTime {
  FaultId fault;
  std::string_view key;
  Duration ConfirmTimes::*confirm;
  Duration confirmed_max;
};
/// Like the other bits of the same STATUS: with its age within 450 ms.
constexpr std::array opening_times{
    OpeningTime{FaultId::module_warning, "module_warning_ms", &ConfirmTimes::module_warning, 150ms},
};

}  // namespace

void check_reaction_times(const CoreConfig& core, const Place& root_place, ProblemList& problems) {
  for (const OpeningTime& row : opening_times) {
    const FaultReaction does = reaction_of(row_of(row.fault), core.stricter_reactions);
    const Place confirm_place = root_place.at("confirm").at(row.key);
    if (does.reaction < Reaction::open_after_grace || !problems.is_good(confirm_place)) continue;
    const Duration confirm = core.limits.confirm.*row.confirm;
    if (confirm + does.grace <= row.confirmed_max) continue;
    const std::string budget = "so that " + std::string(row_of(row.fault).name) +
                               ", which opens this pack, does so within " + ms_text(electrical_reaction_max);
    if (does.grace >= row.confirmed_max) {
      problems.add(root_place.at("faults").at(row_of(row.fault).name).at("grace_ms"), std::to_string(to_ms(does.grace)),
                   "less than " + std::to_string(to_ms(row.confirmed_max)) + ", " + budget);
      continue;
    }
    problems.add(confirm_place, std::to_string(to_ms(confirm)),
                 "at most " + std::to_string(to_ms(row.confirmed_max - does.grace)) + ", " + budget +
                     (does.grace > Duration{} ? ", its grace of " + ms_text(does.grace) + " included" : ""));
  }
}

}  // namespace bmu
