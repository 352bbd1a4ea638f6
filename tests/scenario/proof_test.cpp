// The proof in virtual time: each script passes, and its pack is opened by the required cause, in time.
#include <algorithm>
#include <iterator>

#include "config/json/read_file.hpp"
#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/proofs.hpp"
#include "tools/common/virtual_run.hpp"

using namespace bmu;

namespace {

/// Report of the second of two packs: 72 % of its charge, sent once a second until it falls silent.
void tell_second_pack(VirtualRun& run) {
  constexpr Duration silent_from = 8s;
  constexpr std::uint8_t charge[] = {72, 0, 28, 0, 100, 255, 98};
  if (run.elapsed() % 1s != Duration{} || run.elapsed() >= silent_from) return;
  CanFrame frame = data_frame(0x646, std::size(charge));
  std::copy(std::begin(charge), std::end(charge), frame.data.begin());
  run.observe(FrameReceived{Port::vehicle, frame});
}

void play(const test::Proof& proof) {
  const std::string script = test::proof_folder() + "/" + std::string(proof.name) + ".scn";
  const auto pack = load_pack_config(test::pack_file_of(script));
  REQUIRE(pack);
  const auto text = read_file(script);
  REQUIRE(text);
  auto scenario = parse_scenario(*text, core_vocabulary());
  REQUIRE(scenario);
  VirtualRun run(pack->core, simulator_config(pack->core), std::move(*scenario));
  test::ProofWatch watch(proof, run.core());
  run.set_tap(&watch);
  const ScenarioPlayer& player = run.simulator().script();
  while (player.verdict() == ScriptVerdict::open && !player.is_over()) {
    if (proof.end == test::ProofEnd::tells_no_second_soc) tell_second_pack(run);
    run.step();
  }
  INFO(player.failure());
  CHECK(player.verdict() == ScriptVerdict::passed);
  watch.check();
  run.set_tap(nullptr);
}

}  // namespace

TEST_CASE("each scenario of the proof goes as its script says, opened by whom it has to be, in time",
          "[scenario][proof]") {
  for (const test::Proof& proof : test::proofs()) {
    DYNAMIC_SECTION(proof.name) {
      play(proof);
    }
  }
}
