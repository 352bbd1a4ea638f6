// A cell as the text of a cell file, for people to read: keys in the order of docs/configuration.md, a list on a line.
#pragma once

#include <string>

#include "config/cell_file/cell_config.hpp"

namespace bmu {

/// Of a cell within the ranges of its keys; parse_cell_file reads it back the same but for the rounding: voltages of
/// the dynamics to 10 uV, resistances to 1 uOhm, times to 1 ms. A curve that is level to the last digit is written
/// with the least rise that the reader takes. The table "ocv" is written to the microvolt.
[[nodiscard]] std::string cell_file_text(const CellFile& cell);

/// Its key "charge_plateau" alone, for who adds it to a file by hand: `"charge_plateau": { ... }`, no line break
/// behind.
[[nodiscard]] std::string charge_plateau_text(const ChargePlateauModel& model);

}  // namespace bmu
