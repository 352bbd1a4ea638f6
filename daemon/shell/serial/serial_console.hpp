// The serial console: commands of serial_commands.hpp on a terminal device, on a thread of its own.
//
// A dump of ten hours takes minutes at 38 400 Bd and reads a disk; neither may affect the control loop. Nor is the loop
// queried: after each decision it stores whether the pack is open (OpenPack).
//
// In the service mode a line is sent once a second (service_values.hpp), unless the log is being dumped or earlier
// output is still unread. The mode ends with Service:off, with the device and with the console.
//
// A device that is missing, or disappears, is retried, and logged once. A user who reads the replies too slowly, or not
// at all, makes the console keep no more than a few kilobytes: it then reads no more input, and continues when they
// have been read.
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

/// Whether the contactors are open and no close request is active, as of the latest decision; for other threads.
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
  Duration look_again = 1s;       // retry period of a missing device
  Duration service_look = 200ms;  // poll period for a new line of the service mode
};

/// All are called on the console's thread, none once the console is destroyed.
struct SerialConsoleActions {
  SetCellCount set_cell_count;
  LogSource log_source;
  std::function<void(bool)> set_service{};                          // null: there is no service mode
  std::function<std::optional<std::string>()> take_service_line{};  // a new line of the service mode, if any
  std::function<void(Severity, std::string_view)> log;
};

class SerialConsole {
 public:
  /// The error: no descriptor could be created; a missing device is none. Throws std::system_error if there is no
  /// thread. Precondition: prepare_signals(), because the thread inherits its mask.
  [[nodiscard]] static Result<std::unique_ptr<SerialConsole>, OsError> start(const SerialConsoleOptions& options,
                                                                             SerialConsoleActions actions);
  SerialConsole(const SerialConsole&) = delete;
  SerialConsole& operator=(const SerialConsole&) = delete;
  /// Ends the thread; one that hangs in a disk access is detached after half a second.
  ~SerialConsole();

 private:
  struct Shared;

  explicit SerialConsole(std::shared_ptr<Shared> shared);

  std::shared_ptr<Shared> shared_;  // shared with the thread, which may outlive this object
  std::thread thread_;
};

}  // namespace bmu
