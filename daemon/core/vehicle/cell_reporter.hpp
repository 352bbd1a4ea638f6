// Cell voltages and temperatures for other control units of the vehicle, once a period (vehicle/cell_data_period_ms):
// CELL_VOLTAGES and CELL_TEMPERATURES of devices/cell_data, three values in a frame. Nothing is sent without an
// identifier in the pack file.
//
// The frames of a round are spread evenly over its period, so that they never come as a burst; the configuration allows
// no period that requires more than one for each tick. A missing, invalid or stale value is sent as unknown, never as 0
// and never as the value before.
//
// Cost: a comparison on most ticks; with a frame a pass over the modules. Pure, no allocation.
#pragma once

#include <cstddef>
#include <optional>

#include "daemon/core/measurement/module_table.hpp"
#include "daemon/core/types/core_config.hpp"
#include "protocol/fields.hpp"
#include "protocol/frame.hpp"

namespace bmu {

/// Number of frames in a round, of both kinds; 0: nothing is sent.
struct CellDataBlocks {
  std::size_t voltages = 0;
  std::size_t temperatures = 0;

  [[nodiscard]] std::size_t count() const { return voltages + temperatures; }
};
[[nodiscard]] CellDataBlocks cell_data_blocks(const CoreConfig& config);

/// Frame `index` of a round, below cell_data_blocks().count(): the voltages come first.
[[nodiscard]] CanFrame cell_data_frame(std::size_t index, const ModuleTable& modules, TimePoint now,
                                       const CoreConfig& config);

class CellReporter {
 public:
  void init(const CoreConfig& config, TimePoint started_at);
  [[nodiscard]] bool is_due(TimePoint now) const { return blocks_.count() > 0 && now >= next_at(); }
  /// The frame due at `now`, or none. Deadlines advance by their period; after a gap of more than a period a round
  /// starts from its beginning, without a burst.
  [[nodiscard]] std::optional<CanFrame> step(TimePoint now, const ModuleTable& modules, const CoreConfig& config);

 private:
  [[nodiscard]] TimePoint next_at() const {
    return round_at_ + period_ * static_cast<std::int64_t>(index_) / static_cast<std::int64_t>(blocks_.count());
  }

  CellDataBlocks blocks_;
  Duration period_{};
  TimePoint round_at_{};
  std::size_t index_ = 0;
  [[nodiscard]] bool are_fields_possible() const { return index_ == 0 || index_ < blocks_.count(); }
  BMU_FIELDS(skipped(blocks_), skipped(period_), round_at_, index_)
};

}  // namespace bmu
