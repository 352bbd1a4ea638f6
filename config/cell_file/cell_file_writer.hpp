// Text of a cell file, formatted for people: keys in the order of docs/configuration.md, a list on a line.
#pragma once

#include <string>

#include "config/cell_file/cell_config.hpp"

namespace bmu {

/// Precondition: a cell within the ranges of its keys. parse_cell_file reads the same cell from the text except for
/// rounding: voltages of the dynamics to 10 uV, resistances to 1 uOhm, times to 1 ms. A curve that is level to the last
/// digit is written with the smallest rise that the reader accepts. The table "ocv" is written to the microvolt.
[[nodiscard]] std::string cell_file_text(const CellFile& cell);

/// The key "charge_plateau" alone, to be added to a file by hand: `"charge_plateau": { ... }`, without a line break at
/// the end.
[[nodiscard]] std::string charge_plateau_text(const ChargePlateauModel& model);

}  // namespace bmu
