// The temperature of the intake air from a file of the kernel: `in_temp_input` of an IIO device, or `temp1_input` of a
// hwmon device, each a decimal number of milli-degrees Celsius.
//
// Such a file may be behind I2C or 1-Wire, where reading it takes up to a second, so that a thread of its own reads it
// once a second. The control loop takes the last reading and never waits, and the core treats a stale reading as
// unknown: a sensor that was removed, and a thread that hangs in the kernel, need no report.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "daemon/core/records/event.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// 0.1 degrees Celsius, to nearest, from "23437\n"; no value for any other text.
[[nodiscard]] std::optional<std::int32_t> air_temperature_dC(std::string_view text);

class IntakeAirReader {
 public:
  using Log = std::function<void(Severity severity, std::string_view line)>;

  static constexpr Duration read_every = 1s;

  /// Precondition: prepare_signals(), because the thread inherits its mask. `log` is called on the thread when the file
  /// becomes readable or unreadable, and never after the reader is destroyed. The error: no thread could be created.
  [[nodiscard]] static Result<std::unique_ptr<IntakeAirReader>, OsError> start(const std::string& file, Log log);
  IntakeAirReader(const IntakeAirReader&) = delete;
  IntakeAirReader& operator=(const IntakeAirReader&) = delete;
  /// Ends the thread; one that hangs in the kernel is detached after 200 ms.
  ~IntakeAirReader();

  /// A reading that has not been taken yet; no value if there is none, or while the thread writes it. Never waits.
  [[nodiscard]] std::optional<std::int32_t> take_dC();

 private:
  struct Shared;

  explicit IntakeAirReader(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  std::shared_ptr<Shared> shared_;  // shared with the thread, which may outlive this object
  std::thread thread_;
};

}  // namespace bmu
