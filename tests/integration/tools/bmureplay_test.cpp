// bmureplay as run by a user: its reports on incomplete files, and the exit codes.
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"
#include "tests/support/recorded_run.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu {

namespace {

/// A recording of two parts.
const std::string& drive() {
  static const std::string text =
      test::recorded_run("0 pack soc_permille 800\n1 vehicle on\n", test::RecordedRun{.length = 6s, .part_length = 3s});
  return text;
}

/// Compresses each piece of `frame_bytes` bytes as its own frame.
std::string packed(const TemporaryFolder& folder, const std::string& text, std::size_t frame_bytes) {
  std::string all;
  for (std::size_t at = 0; at < text.size(); at += frame_bytes) {
    const std::string piece = folder.file("piece", text.substr(at, frame_bytes));
    REQUIRE(run_program({"/usr/bin/env", "zstd", "-q", "-f", piece}).status == 0);
    all += read_file(piece + ".zst");
  }
  return all;
}

Finished replay(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {program("bmureplay")};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_program(command);
}

}  // namespace

TEST_CASE("a packed recording whose first bytes are wrong is run from the next part on", "[integration][recording]") {
  const TemporaryFolder folder;
  const std::string whole = packed(folder, drive(), 40'000);
  std::string changed = whole;
  changed[0] = static_cast<char>(changed[0] ^ 1);
  for (const std::string& bytes : {changed, "\xFF" + whole, std::string(512, '\0') + whole.substr(512)}) {
    const std::string file = folder.file("drive.log.zst", bytes);
    const Finished direct = replay({file});
    INFO(direct.out << direct.err);
    CHECK(direct.status == 3);
    CHECK(direct.out.find("\nidentical: ") != std::string::npos);
    CHECK(direct.out.find("\ndamaged: " + file + ": bytes 0 to ") != std::string::npos);
    CHECK(direct.out.find("cannot be replayed") == std::string::npos);
    CHECK(run_program({"/bin/sh", "-c", "cat " + file + " | " + program("bmureplay") + " -"}).status == 3);
  }
}

TEST_CASE("a recording without its first head is damaged, one without any head is none", "[integration][recording]") {
  const TemporaryFolder folder;
  const std::string headless = drive().substr(drive().find("\n(17") + 1);
  const Finished from_second = replay({folder.file("drive.log", headless)});
  INFO(from_second.out);
  CHECK(from_second.status == 3);
  CHECK(from_second.out.find("drive.log:1: header incomplete, ") != std::string::npos);
  CHECK(from_second.out.find("; reading goes on at line ") != std::string::npos);
  const Finished none = replay({folder.file("none.log", headless.substr(0, headless.find("# bmud-recording")))});
  CHECK(none.status == 65);
  CHECK(none.out.find("cannot be replayed: ") == 0);
}

TEST_CASE("a pack file with other modules is the one that is wrong", "[integration][recording]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("drive.log", drive());
  const std::string other = test::in_source("config/packs/lipo-6s-24v.json");
  const Finished finished = replay({"--config", other, file});
  CHECK(finished.status == 78);
  CHECK(finished.out == "");
  CHECK(finished.err == "bmureplay: " + other + ": does not fit " + file + ": it has 1 module, the recorded pack 4\n");
}

}  // namespace bmu
