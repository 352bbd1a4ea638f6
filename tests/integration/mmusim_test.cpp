// mmusim as a user runs it: what it says about scripts and packs.
#include <algorithm>
#include <fstream>
#include <string>

#include "tests/support/process.hpp"

namespace bmu {

namespace {

const std::string pack_file = BMUD_SOURCE_DIR "/config/packs/demo-48s.json";

}  // namespace

TEST_CASE("a check tells what is wrong with the script and what the pack does not have, by line",
          "[integration][mmusim]") {
  const TemporaryFolder folder;
  const std::string script = folder / "my.scn";
  std::ofstream(script) << "1 vehicle on\n2 cell 9.1 voltage_mV 2700\n# so far so good\n3 vehcle off\n"
                        << "4 cell 1.12 leak_Ohm 5\n5 module 7 silent\n6 load current_A";
  const Finished finished = run_program({program("mmusim"), "--check", "--scenario", script, "--pack", pack_file});
  CHECK(finished.status == 65);
  const std::string start = "mmusim: " + script + ":";
  std::size_t at = 0;
  for (const std::string place : {"2:3: ", "4:3: ", "6:3: ", "7:"}) {
    CAPTURE(place, finished.err);
    at = finished.err.find(start + place, at);
    CHECK(at != std::string::npos);
  }
  CHECK(std::count(finished.err.begin(), finished.err.end(), '\n') == 4);
}

TEST_CASE("a check without a pack says what it could not check", "[integration][mmusim]") {
  const std::string script = BMUD_SOURCE_DIR "/vcan-fixtures/demo.scn";
  const Finished alone = run_program({program("mmusim"), "--check", "--scenario", script});
  CHECK(alone.status == 0);
  CHECK(alone.out.find("without --pack") != std::string::npos);
  const Finished both = run_program({program("mmusim"), "--check", "--scenario", script, "--pack", pack_file});
  CHECK(both.status == 0);
  CHECK(both.out.find("events for demo 48s") != std::string::npos);
}

TEST_CASE("a script that cannot be read is told with the reason", "[integration][mmusim]") {
  const Finished finished = run_program({program("mmusim"), "--check", "--scenario", "/nowhere/my.scn"});
  CHECK(finished.status == 65);
  CHECK(finished.err == "mmusim: /nowhere/my.scn: cannot be read: No such file or directory\n");
}

}  // namespace bmu
