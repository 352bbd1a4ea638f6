// Looks after the CAN interfaces of the buses: each second, on a thread of its own, how their controllers are; and sets
// them up, where the pack file wants it and this process may (link_keeper.hpp). The kernel's lock on link settings, and
// a controller behind SPI, may take their time, and the control loop has none. Nothing is decided by what is seen here:
// the ports and the core notice by themselves what a bus does.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "daemon/shell/can/link_keeper.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// The system's side, so that tests can have controllers on kernels without CAN.
class LinkSystem {
 public:
  virtual ~LinkSystem() = default;

  [[nodiscard]] virtual LinkLook look(const std::string& interface_name) = 0;
  /// Bit rate and restart, which take an interface that is down; then up.
  [[nodiscard]] virtual LinkTried set_up(const std::string& interface_name, const LinkSettings& settings) = 0;
};

/// The running kernel, by rtnetlink and libsocketcan.
[[nodiscard]] LinkSystem& kernel_link_system();

struct LinkWanted {
  std::string interface_name;
  std::optional<LinkSettings> set_up{};  // none: only looked at
};

struct LinkReport {
  LinkDetails details{};
  SetUp set_up = SetUp::not_asked;
};

class LinkWatch {
 public:
  using Log = std::function<void(Severity severity, std::string_view line)>;

  static constexpr Duration look_every = 1s;

  /// After prepare_signals(), whose mask the thread inherits; none is started for no interfaces. `log` is called on the
  /// thread, and not once this is gone. The error: no thread could be had.
  [[nodiscard]] static Result<std::unique_ptr<LinkWatch>, OsError> start(const std::vector<LinkWanted>& wanted, Log log,
                                                                         LinkSystem& system = kernel_link_system());
  LinkWatch(const LinkWatch&) = delete;
  LinkWatch& operator=(const LinkWatch&) = delete;
  /// Ends the thread; one that hangs in the kernel is given up after a moment.
  ~LinkWatch();

  /// As of the last look. Nothing for a bus that is no interface. Never waits: the one before while the thread writes
  /// it. Of one thread.
  [[nodiscard]] std::optional<LinkReport> report(const std::string& interface_name) const;

 private:
  struct Shared;

  explicit LinkWatch(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  std::shared_ptr<Shared> shared_;  // the thread's, too: it may outlive us
  std::thread thread_;
  mutable std::vector<std::pair<std::string, LinkReport>> latest_;
};

}  // namespace bmu
