// The daemon as a process: what lasts from its start to its end, and the lives one after the other in it.
//
//   log, status socket with its clients, service manager, state file,
//   the locks on what it alone writes                                  last
//   buses, GPIO lines, core, history, recorder, serial console          are a life's (daemon_life.hpp)
//
// A reload is all or nothing. The new file is read on a thread, checked whole, and planned: its buses are opened, their
// bit rate is judged. Until here nothing that runs has been touched, and whatever is wrong is the answer. Then this
// life ends in order and the next one begins with the state as a restart would find it. Should that fail all the same,
// a life with the old pack begins in its place, and the answer says so; only if that fails, too, the process ends.
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
  /// After prepare_signals(): threads inherit its mask. Options and journal outlive it.
  Daemon(const Options& options, Journal& journal);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon() = default;

  /// Until the process is to end; what it ends with.
  [[nodiscard]] int run(const PackConfig& pack);

 private:
  struct Asker {
    std::string who;
    std::uint64_t connection = 0;  // 0: a signal, which wants no answer
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
  std::optional<Asker> asker_;      // of the reload that is under way
  std::unique_ptr<LifePlan> next_;  // what this life is being left for
  ReloadDone done_;                 // the answer, if that goes well
  TimePoint left_at_{};
  std::uint64_t reloads_ = 0;
};

}  // namespace bmu
