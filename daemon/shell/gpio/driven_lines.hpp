// Which output lines a daemon drives, written down where whoever opens them after it finds them. Levels may stay on
// their wires when it is gone (gpio_lines.hpp), and by then the pack file may name others, or have a mistake.
//
//   the daemon    write_driven_lines() before it takes its lines, at its start and with each reload, also when there
//                 are none
//   --open-gpio   read_driven_lines(); where nothing was written down the pack file has to do
//
// JSON, of its outputs only:
//   {"chip": "/dev/gpiochip0", "outputs": {"main_positive": {"line": 17, "active_low": false}}}
// With outputs the chip is a device's file and no line stands twice, as in a pack file: what says otherwise is damaged.
// It belongs into a folder that ends with the service or with the machine, as the unit's RuntimeDirectory.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "config/types/gpio_config.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// What the file says; of no configuration as of one without outputs.
[[nodiscard]] std::string driven_lines_text(const std::optional<GpioConfig>& gpio);
/// Nothing if it is no such text.
[[nodiscard]] std::optional<GpioConfig> parse_driven_lines(std::string_view text);

/// What was there before is gone in any case: lines of another pack would be worse than none. "" is no path, and
/// nothing to be done.
[[nodiscard]] Result<void, OsError> write_driven_lines(const std::string& path, const std::optional<GpioConfig>& gpio);

/// Outputs only, in a configuration without them if none are driven; nothing if there is no such file. What is there
/// and cannot be read, or says something else than the above, is an error that names file, found and wanted.
[[nodiscard]] Result<std::optional<GpioConfig>, OsError> read_driven_lines(const std::string& path);

}  // namespace bmu
