// Records the observations and decisions of the master of a virtual run in the daemon's format: parts of half a minute,
// for bmureplay. Virtual time has no wall clock: it starts on 14 November 2023 at 22:13:20 UTC.
#pragma once

#include <fstream>
#include <string>

#include "config/pack_config.hpp"
#include "daemon/recording/record_writer.hpp"
#include "tools/common/virtual_run.hpp"

namespace bmu::sim {

class Recording : public CoreTap {
 public:
  /// Precondition: the run has a core, and outlives the object. Overwrites the file; finish() returns whether that
  /// succeeded.
  Recording(const std::string& path, const PackConfig& pack, VirtualRun& run);
  ~Recording() override;

  void observed(const Observation& observation) override;
  void decided(TimePoint at, const Decisions& decisions) override;
  /// Returns true if everything is in the file.
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
