// Monitors the CAN interfaces of the buses: reads the state of their controllers each second, on a thread of its own,
// and sets them up if the pack file requests it and this process may (link_keeper.hpp). The kernel's lock on link
// settings, and a controller behind SPI, may take their time, and the control loop must not wait. No decision depends
// on these values: the ports and the core detect the state of a bus by themselves.
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

/// The system's side; tests replace it, to have controllers on kernels without CAN.
class LinkSystem {
 public:
  virtual ~LinkSystem() = default;

  [[nodiscard]] virtual LinkLook look(const std::string& interface_name) = 0;
  /// Sets bit rate and restart, which requires an interface that is down; then brings it up.
  [[nodiscard]] virtual LinkTried set_up(const std::string& interface_name, const LinkSettings& settings) = 0;
};

/// The running kernel, by rtnetlink and libsocketcan.
[[nodiscard]] LinkSystem& kernel_link_system();

struct LinkWanted {
  std::string interface_name;
  std::optional<LinkSettings> set_up{};  // no value: only monitored
};

struct LinkReport {
  LinkDetails details{};
  SetUp set_up = SetUp::not_asked;
};

class LinkWatch {
 public:
  using Log = std::function<void(Severity severity, std::string_view line)>;

  static constexpr Duration look_every = 1s;

  /// Precondition: prepare_signals(), because the thread inherits its mask; without interfaces no thread is started.
  /// `log` is called on the thread, and never after this object is destroyed. The error: no thread could be created.
  [[nodiscard]] static Result<std::unique_ptr<LinkWatch>, OsError> start(const std::vector<LinkWanted>& wanted, Log log,
                                                                         LinkSystem& system = kernel_link_system());
  LinkWatch(const LinkWatch&) = delete;
  LinkWatch& operator=(const LinkWatch&) = delete;
  /// Ends the thread; one that hangs in the kernel is detached after 200 ms.
  ~LinkWatch();

  /// As of the last probe. No value for a bus that is not an interface. Never waits: returns the previous one while the
  /// thread writes it. For one thread only.
  [[nodiscard]] std::optional<LinkReport> report(const std::string& interface_name) const;

 private:
  struct Shared;

  explicit LinkWatch(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  std::shared_ptr<Shared> shared_;  // shared with the thread, which may outlive this object
  std::thread thread_;
  mutable std::vector<std::pair<std::string, LinkReport>> latest_;
};

}  // namespace bmu
