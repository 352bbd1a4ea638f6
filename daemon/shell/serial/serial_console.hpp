// The serial console: commands of serial_commands.hpp on a terminal device, on a thread of its own.
//
// A dump of ten hours takes minutes at 38 400 Bd and reads a disk; nothing of that may come near the control loop. The
// loop is asked nothing either: it leaves behind, after each decision, whether the pack is open (OpenPack).
//
// In the service mode a line comes once a second (service_values.hpp), unless the log is being dumped or what came
// before is still unread. It ends with Service:off, with the device and with the console.
//
// A device that is not there, or goes, is looked for again, and told once. Nobody who reads its answers too slowly, or
// not at all, makes it keep more than a few kilobytes: it takes no more input then, and goes on when they are read.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "daemon/core/core.hpp"
#include "daemon/core/core_tap.hpp"
#include "daemon/core/records/event.hpp"
#include "daemon/shell/serial/log_source.hpp"
#include "daemon/shell/serial/serial_commands.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/time.hpp"

namespace bmu {

/// Whether the contactors are open and nobody wants them otherwise, as of the latest decision; for other threads.
class OpenPack final : public CoreTap {
 public:
  explicit OpenPack(const Core& core) : core_(core) {}

  void observed(const Observation& /*observation*/) override {}
  void decided(TimePoint /*at*/, const Decisions& /*decisions*/) override { is_open_ = core_.may_change_modules(); }

  [[nodiscard]] bool is_open() const { return is_open_; }

 private:
  const Core& core_;
  std::atomic<bool> is_open_ = false;
};

struct SerialConsoleOptions {
  std::string device;
  std::int32_t bit_rate_Bd = 38'400;
  Duration look_again = 1s;       // for a device that is not there
  Duration service_look = 200ms;  // for a new line of the service mode
};

/// All are called on the console's thread, none once the console is gone.
struct SerialConsoleActions {
  SetCellCount set_cell_count;
  LogSource log_source;
  std::function<void(bool)> set_service{};                          // none: there is no service mode
  std::function<std::optional<std::string>()> take_service_line{};  // of the service mode, if there is a new one
  std::function<void(Severity, std::string_view)> log;
};

class SerialConsole {
 public:
  /// The error: no thread or descriptor could be had; a device that is not there is none. After prepare_signals(),
  /// whose mask the thread inherits.
  [[nodiscard]] static Result<std::unique_ptr<SerialConsole>, OsError> start(const SerialConsoleOptions& options,
                                                                             SerialConsoleActions actions);
  SerialConsole(const SerialConsole&) = delete;
  SerialConsole& operator=(const SerialConsole&) = delete;
  /// Ends the thread; one that hangs in a disk is given up after half a second.
  ~SerialConsole();

 private:
  struct Shared;

  explicit SerialConsole(std::shared_ptr<Shared> shared);

  std::shared_ptr<Shared> shared_;  // the thread's, too: it may outlive us
  std::thread thread_;
};

}  // namespace bmu
