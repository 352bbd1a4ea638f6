// View of a running daemon at one instant: everything that the status texts may read.
#pragma once

#include <cstdint>
#include <string_view>

#include "daemon/history/history_store.hpp"
#include "daemon/shell/can/buses.hpp"
#include "daemon/shell/can/link_watch.hpp"
#include "daemon/shell/can/rate_watch.hpp"
#include "daemon/shell/gpio/line_feeder.hpp"
#include "daemon/shell/json/core_view.hpp"
#include "daemon/shell/recorder/recorder.hpp"
#include "daemon/shell/state/state_store.hpp"
#include "daemon/shell/status/drive_record.hpp"
#include "daemon/shell/status/loop_counters.hpp"
#include "daemon/shell/status/user_names.hpp"

namespace bmu {

struct StatusView {
  const Core& core;
  const Buses& buses;
  const LoopCounters& loop;
  const DriveRecord& drive;
  const StateStore& store;
  const HistoryStore& history;
  const RateFinding& rate;
  const UserNames& users;
  const LineFeeder* lines = nullptr;   // null: no lines of this machine
  const Recorder* recorder = nullptr;  // null: nothing is recorded
  const LinkWatch* links = nullptr;    // null: interfaces are not monitored
  std::string_view pack_name;
  std::string_view cell_name;
  std::uint64_t reloads = 0;  // of this process; its uptime counts from the last one
  std::uint64_t log_lines_lost = 0;
  std::uint64_t notify_sends_failed = 0;
  std::uint64_t clients_dropped = 0;
  TimePoint now{};

  /// The view of the core alone.
  operator CoreView() const {  // NOLINT(google-explicit-constructor): a part of it, without loss
    return {.core = core, .now = now, .lines = lines};
  }
};

}  // namespace bmu
