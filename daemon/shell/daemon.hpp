// The daemon as a process: the objects it keeps from start to exit, and its sessions, one after another.
//
//   log, status socket with its clients, service manager, state file,
//   locks on the files and folders that only this daemon writes        kept until the process ends
//   buses, GPIO lines, core, history, recorder, serial console          of one session (daemon_life.hpp)
//
// A reload is all or nothing. The new file is read on a thread, checked completely and planned: its buses are opened,
// their bit rate is checked. Until then nothing of the running session has changed, and any error is the reply. Then
// this session ends in order, and the next one starts with the state that a restart would load. If that fails, a
// session with the old pack starts instead, and the reply reports it; only if that fails, too, the process ends.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/shell/daemon_life.hpp"
#include "daemon/shell/reload.hpp"
#include "daemon/shell/system/sole_use.hpp"

namespace bmu {

class Daemon {
 public:
  /// Precondition: prepare_signals(), because threads inherit its mask. Options and journal must outlive the daemon.
  Daemon(const Options& options, Journal& journal);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon() = default;

  /// Runs until the process has to end; returns its exit code.
  [[nodiscard]] int run(const PackConfig& pack);

 private:
  struct Asker {
    std::string who;
    std::uint64_t connection = 0;  // 0: requested by a signal, no reply
  };

  [[nodiscard]] Result<void, OsError> open();
  [[nodiscard]] Result<void, OsError> claim_files();
  [[nodiscard]] Result<void, OsError> claim_folders();
  [[nodiscard]] LifeWorld world();
  [[nodiscard]] Result<LoopEnd, OsError> run_life();
  [[nodiscard]] Result<void, LifeFailure> begin_next();
  [[nodiscard]] int fail(const LifeFailure& failure);
  void log_state() const;

  [[nodiscard]] StatusReply reload_for(const Peer& peer);
  void reload_by(const SignalFrom& from);
  [[nodiscard]] std::string ask_reload(Asker asker);
  void take_read();
  void plan_next(PackRead read);
  void take_accounts(const PackRead& read);
  void refuse_reload(const std::string& why, const std::vector<std::string>& problems = {});
  void end_reload(const ReloadDone& done);

  const Options& options_;
  Journal& journal_;
  ServiceNotify notify_;
  Access access_;
  SoleUse sole_use_;
  std::unique_ptr<StatusSocket> socket_;
  std::unique_ptr<StateStore> store_;
  std::unique_ptr<PackReader> reader_;
  std::unique_ptr<LifePlan> plan_;
  std::unique_ptr<DaemonLife> life_;
  std::optional<Asker> asker_;      // of the reload in progress
  std::unique_ptr<LifePlan> next_;  // plan of the next session, while this one ends
  ReloadDone done_;                 // the reply, if the reload succeeds
  TimePoint left_at_{};
  std::uint64_t reloads_ = 0;
};

}  // namespace bmu
