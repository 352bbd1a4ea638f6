// bmureplay as a user runs it: what it says of files that are not whole, and the exit codes.
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/process.hpp"
#include "tests/support/recorded_run.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {

namespace {

/// Two parts.
const std::string& drive() {
  static const std::string text =
      test::recorded_run("0 pack soc_permille 800\n1 vehicle on\n", test::RecordedRun{.length = 6s, .part_length = 3s});
  return text;
}

Finished replay(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {program("bmureplay")};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_program(command);
}

}  // namespace

TEST_CASE("a pack file with other modules is the one that is wrong", "[integration][recording]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("drive.log", drive());
  const std::string other = BMUD_SOURCE_DIR "/config/packs/lipo-6s-24v.json";
  const Finished finished = replay({"--config", other, file});
  CHECK(finished.status == 78);
  CHECK(finished.out == "");
  CHECK(finished.err == "bmureplay: " + other + ": does not fit " + file + ": it has 1 module, the recorded pack 4\n");
}

}  // namespace bmu
