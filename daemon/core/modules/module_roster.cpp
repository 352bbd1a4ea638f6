#include "daemon/core/modules/module_roster.hpp"

#include <algorithm>

#include "protocol/tables/internal_bus.hpp"

namespace bmu {

std::string_view to_text(ModulePlace place) {
  switch (place) {
    case ModulePlace::unheard: return "unheard";
    case ModulePlace::unnamed: return "unnamed";
    case ModulePlace::expected: return "expected";
    case ModulePlace::exchanged: return "exchanged";
    case ModulePlace::misplaced: return "misplaced";
    case ModulePlace::swapped: return "swapped";
  }
  return "?";
}

std::string_view to_text(AcceptRefusal refusal) {
  switch (refusal) {
    case AcceptRefusal::none: return "none";
    case AcceptRefusal::unheard: return "unheard";
    case AcceptRefusal::two_speak: return "two speak";
    case AcceptRefusal::named_otherwise: return "named otherwise";
  }
  return "?";
}

namespace {

bool is_module(const KnownModule& known, std::uint32_t serial_number) {
  return known.is_known && known.serial_number == serial_number;
}

bool has_said(const ModuleRecord& module, std::uint32_t serial_number) {
  return module.identity.is_valid() && module.identity.value.serial_number == serial_number;
}

}  // namespace

bool has_rival(const ModuleRecord& module, TimePoint now) {
  return module.rival_seen_at != TimePoint{} && now - module.rival_seen_at <= conflict_memory;
}

void ModuleRoster::init(const CoreConfig& config) {
  for (const ModuleConfig& module : config.modules) {
    is_ours_[module.node] = true;
    if (module.serial_number) named_[module.node] = {true, *module.serial_number};
  }
}

const KnownModule& ModuleRoster::expected(std::uint8_t node) const {
  return named_[node].is_known ? named_[node] : known_[node];
}

std::uint8_t ModuleRoster::node_expecting(std::uint32_t serial_number) const {
  for (std::uint8_t node = 1; node <= internal_bus::node_count_max; ++node) {
    if (is_ours_[node] && is_module(expected(node), serial_number)) return node;
  }
  return 0;
}

ModuleFinding ModuleRoster::finding(const ModuleRecord& module, const ModuleTable& modules, TimePoint now) const {
  const std::uint8_t node = module.config.node;
  ModuleFinding found{.expected = expected(node), .is_from_file = named_[node].is_known};
  if (found.expected.is_known && has_said(module, found.expected.serial_number)) {
    found.place = ModulePlace::expected;
    found.belongs_to = node;
    return found;
  }
  if (found.expected.is_known) {
    const std::uint8_t elsewhere = node_of(found.expected.serial_number, modules, now);
    found.seen_at = elsewhere == node ? std::uint8_t{0} : elsewhere;
  }
  if (!module.identity.is_valid()) return found;
  found.belongs_to = node_expecting(module.identity.value.serial_number);
  if (found.belongs_to != 0) {
    found.place = found.seen_at == found.belongs_to ? ModulePlace::swapped : ModulePlace::misplaced;
  } else {
    found.place = found.expected.is_known ? ModulePlace::exchanged : ModulePlace::unnamed;
  }
  return found;
}

const ModuleRecord* ModuleRoster::first_with(ModulePlace place, const ModuleTable& modules, TimePoint now) const {
  const auto* const found =
      std::find_if(modules.modules().begin(), modules.modules().end(),
                   [&](const ModuleRecord& module) { return finding(module, modules, now).place == place; });
  return found == modules.modules().end() ? nullptr : found;
}

bool ModuleRoster::remember(const ModuleTable& modules, TimePoint now) {
  bool has_news = false;
  for (const ModuleRecord& module : modules.modules()) {
    if (has_rival(module, now) || finding(module, modules, now).place != ModulePlace::unnamed) continue;
    known_[module.config.node] = {true, module.identity.value.serial_number};
    has_news = true;
  }
  return has_news;
}

AcceptRefusal ModuleRoster::reason_against_accepting(const ModuleRecord& module, TimePoint now) const {
  const KnownModule& named = named_[module.config.node];
  if (!module.identity.is_valid()) return AcceptRefusal::unheard;
  if (has_rival(module, now)) return AcceptRefusal::two_speak;
  const bool is_named_otherwise = named.is_known && named.serial_number != module.identity.value.serial_number;
  return is_named_otherwise ? AcceptRefusal::named_otherwise : AcceptRefusal::none;
}

bool ModuleRoster::accept(const ModuleRecord& module, TimePoint now) {
  if (reason_against_accepting(module, now) != AcceptRefusal::none) return false;
  if (!named_[module.config.node].is_known) assign(module.config.node, module.identity.value.serial_number);
  return true;
}

std::uint8_t ModuleRoster::assign(std::uint8_t node, std::uint32_t serial_number) {
  for (KnownModule& known : known_) {
    if (is_module(known, serial_number)) known = {};
  }
  if (is_ours_[node]) known_[node] = {true, serial_number};
  strangers_[node] = {};
  std::uint8_t left = 0;
  for (std::uint8_t other = 1; other <= internal_bus::node_count_max; ++other) {
    if (!strangers_[other].is_identified || strangers_[other].serial_number != serial_number) continue;
    strangers_[other] = {};
    left = other;
  }
  return left;
}

void ModuleRoster::observe_stranger(const MessageSpec& message, std::uint8_t node, const CanFrame& frame,
                                    TimePoint at) {
  StrangerRecord& stranger = strangers_[node];
  if (!is_stranger(node, at)) stranger = {};
  stranger.seen_at = at;
  if (message.base_id != internal_bus::ident.base_id) return;
  stranger.is_identified = true;
  stranger.serial_number = static_cast<std::uint32_t>(read_raw<internal_bus::ident, "serial_number">(frame));
  stranger.cell_count = static_cast<std::uint8_t>(read_raw<internal_bus::ident, "cell_count">(frame));
}

bool ModuleRoster::is_stranger(std::uint8_t node, TimePoint now) const {
  const TimePoint seen_at = strangers_[node].seen_at;
  return seen_at != TimePoint{} && now - seen_at <= stranger_memory;
}

std::uint8_t ModuleRoster::unidentified_stranger(TimePoint now) const {
  for (std::uint8_t node = 1; node <= internal_bus::node_count_max; ++node) {
    if (is_stranger(node, now) && !strangers_[node].is_identified) return node;
  }
  return 0;
}

std::uint8_t ModuleRoster::node_of(std::uint32_t serial_number, const ModuleTable& modules, TimePoint now) const {
  for (const ModuleRecord& module : modules.modules()) {
    const bool is_rival = has_rival(module, now) && module.rival_serial_number == serial_number;
    const bool is_live = module.last_answer_at != TimePoint{} && now - module.last_answer_at <= stranger_memory;
    if (is_live && (has_said(module, serial_number) || is_rival)) return module.config.node;
  }
  for (std::uint8_t node = 1; node <= internal_bus::node_count_max; ++node) {
    const StrangerRecord& stranger = strangers_[node];
    if (is_stranger(node, now) && stranger.is_identified && stranger.serial_number == serial_number) return node;
  }
  return 0;
}

}  // namespace bmu
