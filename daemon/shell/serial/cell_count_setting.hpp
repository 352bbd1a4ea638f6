// The number of cells that somebody set over the serial console: kept beside the state file, in force from the next
// start on, and for the pack file only that it was set for.
//
// A running core keeps the configuration it began with. A wrong number closes nothing: modules tell how many cells they
// have, and the fault wrong_cell_count is what comes of a difference.
#pragma once

#include <cstddef>
#include <string>

#include "config/pack_config.hpp"
#include "daemon/shell/serial/serial_commands.hpp"
#include "daemon/shell/state/state_file.hpp"

namespace bmu {

class CellCountSetting {
 public:
  /// `state_path`: of the state file; empty: nothing is kept. Reads what was set; not for the control loop's thread,
  /// as set() is not.
  CellCountSetting(const PackConfig& file_pack, const std::string& state_path, FileCalls& calls = system_file_calls());

  /// With the number that was set, or as its file has it.
  [[nodiscard]] const PackConfig& pack() const { return pack_; }
  /// What is to be said about it at start; empty: nothing.
  [[nodiscard]] const std::string& told() const { return told_; }

  /// `is_open`: the contactors are, and nobody wants them otherwise. Refused: why.
  [[nodiscard]] Result<CellCountSet, std::string> set(std::size_t cell_count, bool is_open);

 private:
  void read();

  PackConfig file_pack_;
  PackConfig pack_;
  StateFile file_;
  bool is_kept_ = false;  // there is a place for it
  std::size_t next_count_ = 0;
  std::string told_;
};

}  // namespace bmu
