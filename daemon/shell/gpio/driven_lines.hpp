// Record of the output lines that a daemon drives, for the program that opens them after it. Levels may stay on their
// wires when the daemon is gone (gpio_lines.hpp), and by then the pack file may name others, or have an error.
//
//   the daemon    write_driven_lines() before it requests its lines, at its start and with each reload, also when there
//                 are none
//   --open-gpio   read_driven_lines(); without a record it uses the pack file
//
// JSON, of the outputs only:
//   {"chip": "/dev/gpiochip0", "outputs": {"main_positive": {"line": 17, "active_low": false}}}
// With outputs the chip is the file of a device and no line occurs twice, as in a pack file: any other text is damaged.
// It belongs into a folder that is removed with the service or at power-off, e.g. the RuntimeDirectory of the unit.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "config/types/gpio_config.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// Text of the file; without a configuration as without outputs.
[[nodiscard]] std::string driven_lines_text(const std::optional<GpioConfig>& gpio);
/// No value if it is not such a text.
[[nodiscard]] std::optional<GpioConfig> parse_driven_lines(std::string_view text);

/// The old file is removed in any case: lines of another pack would be worse than none. "" is no path: nothing is done.
[[nodiscard]] Result<void, OsError> write_driven_lines(const std::string& path, const std::optional<GpioConfig>& gpio);

/// Outputs only, in a configuration without them if none are driven; no value if there is no such file. A file that
/// cannot be read, or has another form than the above, is an error that names file, found and wanted.
[[nodiscard]] Result<std::optional<GpioConfig>, OsError> read_driven_lines(const std::string& path);

}  // namespace bmu
