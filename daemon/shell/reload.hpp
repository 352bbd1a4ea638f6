// Taking up another pack file while the daemon runs: when that may be, and what is said of it.
//
// A running core keeps the configuration it began with; every replay and all reasoning about it rests on that. So a
// reload ends this life of the core in order and begins the next one, as a restart would, but within the process: the
// log, the status socket with its clients and the state stay. daemon.hpp does it; here is what it goes by.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "config/pack_changes.hpp"
#include "daemon/core/core.hpp"
#include "daemon/shell/json/core_view.hpp"

namespace bmu {

enum class ReloadRefusal : std::uint8_t {
  none,
  contactors_closed,  // commanded, or on the way there or back
  contact_closed,     // commanded open, and an auxiliary contact says otherwise
  close_wanted,
  node_under_way,  // a module is being given another node number
  ending,          // this process is
  under_way,       // another reload is
};

/// For people: "a contactor is closed".
[[nodiscard]] std::string_view to_text(ReloadRefusal refusal);

/// Only while the pack is open, and nothing that was begun would be lost half-way.
[[nodiscard]] ReloadRefusal reload_refusal(const Core& core, TimePoint now);

struct ReloadDone {
  std::string hash_before;
  std::string hash_now;
  std::vector<PackChange> changes;
  std::vector<std::string> warnings;  // of the new file
  bool is_new_life = false;           // false: nothing was to be changed, and nothing was
  Duration away{};                    // between the last tick of the life before and the next one's beginning
};

/// How many changes a reply tells, and a log; the rest is counted.
inline constexpr std::size_t changes_told_max = 200;
inline constexpr std::size_t changes_logged_max = 20;

/// The reply: {"config_hash_before", "config_hash", "is_new_life", "changes", "changes_left_out", "warnings"}.
[[nodiscard]] Json reload_json(const ReloadDone& done);
/// The same as lines of a log.
[[nodiscard]] std::vector<std::string> reload_lines(const ReloadDone& done);

}  // namespace bmu
