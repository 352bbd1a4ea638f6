// The golden logs of the proof: recordings of bmud on vcan in each scenario (tests/rig/proof.sh), replayed.
// NAME.log.zst is the recording, NAME.expected has the initial state of its core and its decisions.
//
//   tests/rig/make-proof.sh                        new recordings, from the rig
//   BMUD_REWRITE=1 test_golden                     writes this build's decisions for the existing recordings
//   BMUD_PROOF_RECORDINGS=FOLDER test_golden       recordings that were not reviewed yet, as the rig writes them
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/golden/rerun.hpp"
#include "tests/support/catch.hpp"
#include "tools/bmureplay/part.hpp"

using namespace bmu;
using namespace bmu::test;

namespace {

std::string fresh_folder() {
  const char* const folder = std::getenv("BMUD_PROOF_RECORDINGS");
  return folder == nullptr ? "" : folder;
}

bool has_recordings(const std::string& folder) {
  const std::filesystem::directory_iterator files(folder);
  return std::any_of(begin(files), end(files), [](const auto& file) { return file.path().extension() == ".zst"; });
}

/// A recording as decompressed text.
std::string recording(const std::string& file) {
  replay::PartReader reader(std::vector<std::string>{file});
  std::string text;
  while (auto part = reader.next()) text += part->text;
  INFO(file);
  CHECK(reader.damages().empty());
  REQUIRE_FALSE(text.empty());
  return text;
}

std::string content(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string page_of(const Birth& birth, const RerunOutcome& outcome) {
  std::array<char, 160> counts{};
  (void)std::snprintf(counts.data(), counts.size(),
                      "decisions %llu, as the daemon decided on vcan %llu, all of them together %016llx\n",
                      static_cast<unsigned long long>(outcome.ticks),
                      static_cast<unsigned long long>(outcome.ticks_as_recorded),
                      static_cast<unsigned long long>(outcome.fingerprint));
  return to_text(birth) + "\n" + counts.data() + outcome.told;
}

/// Checks the golden log of a scenario with this build's core.
void check_golden(const Proof& proof) {
  const std::string base = proof_folder() + "/" + std::string(proof.name);
  const std::string text = recording(base + ".log.zst");
  const std::string expected = content(base + ".expected");
  std::optional<Birth> birth = birth_of_text(expected.substr(0, expected.find('\n')));
  const bool is_rewriting = std::getenv("BMUD_REWRITE") != nullptr;
  if (is_rewriting) {
    if (const auto recorded = birth_of_recording(text)) birth = recorded;
  }
  INFO(base << ".expected: its first line says how the recorded core began");
  REQUIRE(birth);
  const std::string page = page_of(*birth, rerun(text, *birth, proof));
  if (is_rewriting) {
    std::ofstream(base + ".expected", std::ios::binary) << page;
    return;
  }
  INFO("to write it anew: BMUD_REWRITE=1 test_golden; look at the difference before you commit it, and say why");
  CHECK(page == expected);
}

/// Checks a recording of this build's daemon: all decisions must be the same.
void check_fresh(const Proof& proof) {
  const std::string file = fresh_folder() + "/" + std::string(proof.name) + ".log.zst";
  INFO(file);
  REQUIRE(std::filesystem::exists(file));
  const std::string text = recording(file);
  const auto birth = birth_of_recording(text);
  REQUIRE(birth);
  const RerunOutcome outcome = rerun(text, *birth, proof);
  CHECK(outcome.ticks > 500);
  CHECK(outcome.ticks_as_recorded == outcome.ticks);
}

}  // namespace

TEST_CASE("what was recorded on vcan is decided again, and goes as it has to", "[golden][proof]") {
  REQUIRE(has_recordings(fresh_folder().empty() ? proof_folder() : fresh_folder()));
  for (const Proof& proof : proofs()) {
    DYNAMIC_SECTION(proof.name) {
      fresh_folder().empty() ? check_golden(proof) : check_fresh(proof);
    }
  }
}

TEST_CASE("each scenario of the proof has its script and its golden log, and there are no others", "[golden][proof]") {
  std::set<std::string> wanted;
  for (const Proof& proof : proofs()) {
    for (const char* const end : {".scn", ".log.zst", ".expected"}) wanted.insert(std::string(proof.name) + end);
  }
  std::set<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(proof_folder())) {
    if (entry.path().extension() != ".json") found.insert(entry.path().filename().string());
  }
  CHECK(found == wanted);
}
