// One session of the daemon: all that is made from one pack file, from its buses to the core, its history and
// recordings. It ends with the process, or when another pack file is loaded; the next one then starts as after a
// restart.
//
//   plan     errors of a pack on this machine, found before anything that runs is changed
//   begin    core and everything around it; the contactors are commanded open with the first tick
//   run      until the process has to end, or leave()
//   finish   history and recordings are written, as far as the disk accepts them within the limits of Memory::end()
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/pack_config.hpp"
#include "daemon/shell/can/buses.hpp"
#include "daemon/shell/can/link_watch.hpp"
#include "daemon/shell/can/rate_watch.hpp"
#include "daemon/shell/gpio/gpio_lines.hpp"
#include "daemon/shell/gpio/line_feeder.hpp"
#include "daemon/shell/loop.hpp"
#include "daemon/shell/options.hpp"
#include "daemon/shell/pack_reader.hpp"
#include "daemon/shell/recorder/memory.hpp"
#include "daemon/shell/serial/serial_console.hpp"
#include "daemon/shell/serial/service_values.hpp"
#include "daemon/shell/state/state_store.hpp"
#include "daemon/shell/status/access.hpp"
#include "daemon/shell/status/status_requests.hpp"
#include "daemon/shell/status/status_socket.hpp"
#include "daemon/shell/system/journal.hpp"
#include "daemon/shell/system/service_notify.hpp"

namespace bmu {

/// Reason why a session cannot start, and the exit code of the process if it is the first one.
struct LifeFailure {
  int exit_code = exit_system;
  std::string text;
};

/// The pack on the buses of the command line instead of the file's; or all clashes of identifiers and bit rates.
[[nodiscard]] Result<PackConfig, ConfigProblems> on_wanted_buses(PackConfig pack, const Options& options);

/// A pack as it will run: with the buses of the command line, the cell count that was set, the bit rate found.
struct LifePlan {
  PackRead read;
  PackConfig wanted;  // at the bit rate of the file
  PackConfig pack;    // at the bit rate that was found
  std::shared_ptr<Buses>
      buses;  // those of the previous session if the ports are the same: no frame is missed, nothing can fail

  /// `before`: plan of the running session, if there is one.
  [[nodiscard]] static Result<std::unique_ptr<LifePlan>, LifeFailure> make(PackRead read, const Options& options,
                                                                           const LifePlan* before);
};

/// Parts of the process that exist before and after a session.
struct LifeWorld {
  const Options& options;
  Journal& journal;
  ServiceNotify& notify;
  StatusSocket& socket;
  StateStore& store;
  Access& access;
  std::function<StatusReply(const Peer&)> reload;
  std::function<void(const SignalFrom&)> reload_by_signal;
  Watched pack_reader;
  const std::uint64_t& reloads;  // count so far, for the status
};

/// Settings carried into the next session besides the state: operator commands that hold until the process ends.
struct Legacy {
  bool is_balancing_off = false;
  TimePoint claim_held_until{};  // through the ports of the next session; zero: the next one listens
};

class DaemonLife {
 public:
  /// Starts with the state that the store has loaded, or that was carried over. The plan must outlive the session.
  [[nodiscard]] static Result<std::unique_ptr<DaemonLife>, OsError> begin(const LifePlan& plan, const LifeWorld& world,
                                                                          const Legacy& legacy);
  DaemonLife(const DaemonLife&) = delete;
  DaemonLife& operator=(const DaemonLife&) = delete;
  ~DaemonLife() = default;

  [[nodiscard]] Result<LoopEnd, OsError> run() { return loop_->run(); }
  void leave() { loop_->leave(); }
  void finish() { memory_->end(); }

  [[nodiscard]] const Core& core() const { return *core_; }
  /// `next`: plan of the next session. `left_at`: end of this session's loop.
  [[nodiscard]] Legacy legacy(const LifePlan& next, TimePoint left_at) const;

 private:
  DaemonLife(const LifePlan& plan, const LifeWorld& world);

  [[nodiscard]] Result<void, OsError> set_up(const Legacy& legacy);
  void make_core();
  [[nodiscard]] Result<void, OsError> start_console();
  [[nodiscard]] Result<void, OsError> start_link_watch();
  [[nodiscard]] Result<void, OsError> start_intake_air();
  void make_loop(const Legacy& legacy);
  void make_requests();
  [[nodiscard]] StatusView view() const;
  void log_begin() const;
  void write_down_lines() const;
  void log(Severity severity, std::string_view line) const { world_.journal.log(severity, line); }

  const LifePlan& plan_;
  LifeWorld world_;
  RateWatch rate_;
  std::optional<GpioLines> gpio_;
  std::optional<LineFeeder> lines_;
  std::unique_ptr<Core> core_;
  std::unique_ptr<Memory> memory_;
  std::shared_ptr<OpenPack> open_pack_;
  std::shared_ptr<ServiceValues> service_;
  std::unique_ptr<SerialConsole> console_;
  std::unique_ptr<LinkWatch> links_;
  std::unique_ptr<IntakeAirReader> intake_air_;
  std::unique_ptr<Loop> loop_;
  std::unique_ptr<StatusRequests> requests_;
};

}  // namespace bmu
