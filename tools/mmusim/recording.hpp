// Writes what the master of a virtual run is told and decides, as the daemon would have: parts of half a minute, for
// bmureplay. There is no wall clock in virtual time: it begins on 14 November 2023 at 22:13:20 UTC.
#pragma once

#include <fstream>
#include <string>

#include "config/pack_config.hpp"
#include "daemon/recording/record_writer.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu::sim {

class Recording : public CoreTap {
 public:
  /// The run must have a core, and outlives this. Overwrites the file; finish() says whether that went well.
  Recording(const std::string& path, const PackConfig& pack, VirtualRun& run);
  ~Recording() override;

  void observed(const Observation& observation) override;
  void decided(TimePoint at, const Decisions& decisions) override;
  /// Everything is in the file when this returns true.
  [[nodiscard]] bool finish();

 private:
  void begin_part(TimePoint now);
  void write();

  VirtualRun& run_;
  RecordWriter writer_;
  std::ofstream file_;
  TimePoint part_began_at_{};
  bool has_begun_ = false;
  bool is_part_due_ = false;
};

}  // namespace bmu::sim
