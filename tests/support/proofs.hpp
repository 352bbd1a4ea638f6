// The proof: disturbances around a pack and the required reaction to each, with its cause and its time.
//
// Each has a script, vcan-fixtures/proof/NAME.scn, that mmusim plays and that states when the contacts have to be open.
// It is run in virtual time (tests/scenario/proof_test.cpp) and, with the programs themselves, on vcan
// (tests/rig/proof.sh); bmud's recording of that run is a golden log (tests/golden/proof_test.cpp). ProofWatch monitors
// the core in all of them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/core.hpp"
#include "daemon/core/core_tap.hpp"

namespace bmu::test {

enum class ProofEnd : std::uint8_t {
  opens,               // the daemon commands all contactors open
  tells_no_second_soc  // SOC2 in 626h is unknown, and the pack stays closed
};

struct Proof {
  std::string_view name;
  /// The last time without the disturbance, by the core's data at `now`: when it last received the device, or now.
  TimePoint (*well_until)(const Core& core, TimePoint now);
  /// From then to the frame of the reaction: the time stated in the pages, and a decision.
  Duration allowed{};
  OpeningCause cause = OpeningCause::fault;  // none: nothing opens
  FaultId fault{};                           // if the cause is a fault
  ProofEnd end = ProofEnd::opens;
};

[[nodiscard]] const std::vector<Proof>& proofs();
[[nodiscard]] std::string proof_folder();
/// The pack file that a script names in its head: "# Pack: config/packs/i3-96s.json", from the project's folder.
[[nodiscard]] std::string pack_file_of(const std::string& script);

/// Monitors a core at each of its decisions.
class ProofWatch : public CoreTap {
 public:
  ProofWatch(const Proof& proof, const Core& core) : proof_(&proof), core_(&core) {}

  void observed(const Observation& /*observation*/) override {}
  void decided(TimePoint at, const Decisions& decisions) override;

  /// Fails the test unless the reaction was as required.
  void check() const;
  /// The required reaction has come.
  [[nodiscard]] bool has_ended() const { return ended_at_.has_value(); }

 private:
  [[nodiscard]] bool is_end(const Decisions& decisions);

  const Proof* proof_;
  const Core* core_;
  bool was_closed_ = false;
  bool was_second_soc_known_ = false;
  TimePoint well_until_{};
  // Time of the reaction; later events, such as the end of the emulated pack, are ignored.
  std::optional<TimePoint> ended_at_;
  bool is_open_ = false;
  OpeningRecord opening_;
};

}  // namespace bmu::test
