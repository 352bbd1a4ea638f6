// The number of cells that an operator set over the serial console: stored beside the state file, in force from the
// next start on, and only for the pack file for which it was set.
//
// A running core keeps the configuration it started with. A wrong number closes nothing: modules report how many cells
// they have, and a difference is the fault wrong_cell_count.
#pragma once

#include <cstddef>
#include <string>

#include "config/pack_config.hpp"
#include "daemon/shell/serial/serial_commands.hpp"
#include "daemon/shell/state/state_file.hpp"

namespace bmu {

class CellCountSetting {
 public:
  /// `state_path`: of the state file; empty: nothing is stored. Reads the stored number; not for the control loop's
  /// thread, and neither is set().
  CellCountSetting(const PackConfig& file_pack, const std::string& state_path, FileCalls& calls = system_file_calls());

  /// The pack with the number that was set, or as in its file.
  [[nodiscard]] const PackConfig& pack() const { return pack_; }
  /// Log line for the start; empty: none.
  [[nodiscard]] const std::string& told() const { return told_; }

  /// `is_open`: the contactors are open, and no close request is active. The error: reason of the refusal.
  [[nodiscard]] Result<CellCountSet, std::string> set(std::size_t cell_count, bool is_open);

 private:
  void read();

  PackConfig file_pack_;
  PackConfig pack_;
  StateFile file_;
  bool is_kept_ = false;  // there is a state file to store it beside
  std::size_t next_count_ = 0;
  std::string told_;
};

}  // namespace bmu
