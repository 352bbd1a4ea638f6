// Loading another pack file while the daemon runs: the conditions and the reply.
//
// A running core keeps the configuration it started with; every replay and all reasoning about it rely on that. So a
// reload ends this session of the core in order and starts the next one, as a restart would, but within the process:
// the log, the status socket with its clients and the state are kept. daemon.hpp executes it; its rules are here.
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
  contactors_closed,  // commanded closed, or closing or opening
  contact_closed,     // commanded open, but the feedback reports closed
  close_wanted,
  node_under_way,  // a module is being given another node number
  ending,          // the process ends
  under_way,       // another reload is in progress
};

/// Text for people, e.g. "the pack is not open".
[[nodiscard]] std::string_view to_text(ReloadRefusal refusal);

/// Permitted only while the pack is open and no operation would be lost half-way.
[[nodiscard]] ReloadRefusal reload_refusal(const Core& core, TimePoint now);

struct ReloadDone {
  std::string hash_before;
  std::string hash_now;
  std::vector<PackChange> changes;
  std::vector<std::string> warnings;  // of the new file
  bool is_new_life = false;           // false: the configuration was the same, and nothing has changed
  Duration away{};                    // from the end of the previous session's loop to the start of the next session
};

/// Maximum number of changes in a reply, and in a log; the others are counted.
inline constexpr std::size_t changes_told_max = 200;
inline constexpr std::size_t changes_logged_max = 20;

/// The reply: {"config_hash_before", "config_hash", "is_new_life", "away_ms", "changes", "changes_left_out",
/// "warnings"}.
[[nodiscard]] Json reload_json(const ReloadDone& done);
/// The same as lines of a log.
[[nodiscard]] std::vector<std::string> reload_lines(const ReloadDone& done);

}  // namespace bmu
