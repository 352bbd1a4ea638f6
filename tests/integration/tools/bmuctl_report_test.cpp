// bmuctl report as run by a user: the page, the error messages and the exit codes.
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include <sys/wait.h>

#include "tests/support/catch.hpp"
#include "tests/support/process.hpp"
#include "tests/support/recorded_run.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

std::string content_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

struct Run {
  int exit_code = -1;
  std::string out, err;
};

Run run(const TemporaryFolder& folder, const std::string& arguments) {
  const std::string command =
      "{ " + test::in_build("bin/bmuctl") + " report " + arguments + "; } >" + folder / "out" + " 2>" + folder / "err";
  const int status = std::system(command.c_str());  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "out"), content_of(folder / "err")};
}

const std::string& recording() {
  static const std::string text = recorded_run("0 pack soc_permille 800\n1 vehicle on\n", 5s);
  return text;
}

}  // namespace

TEST_CASE("a recording becomes a page beside it", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const Run made = run(folder, folder.file("drive.log", recording()));
  CHECK(made.exit_code == 0);
  CHECK(made.err == "");
  CHECK(made.out.find(folder / "drive.html" + ": 5.") == 0);
  const std::string page = content_of(folder / "drive.html");
  CHECK(page.find("<h1>demo 48s</h1>") != std::string::npos);
  CHECK(page.find("from the recording drive.log by bmud") != std::string::npos);
  CHECK(page.find("2023-11-14 22:13:20 to 2023-11-14 22:13:25 UTC") != std::string::npos);
  CHECK(page.substr(page.size() - 8) == "</html>\n");
}

TEST_CASE("a page goes where it is told to, of the time that is told", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("drive.log", recording());
  const Run out = run(folder, file + " --out - --from '2023-11-14 22:13:22Z' --to '2023-11-14T23:13:24+01:00'");
  CHECK(out.exit_code == 0);
  CHECK(out.err == "");
  CHECK(out.out.find("<!DOCTYPE html>") == 0);
  CHECK(out.out.find("2023-11-14 22:13:22 to 2023-11-14 22:13:24 UTC") != std::string::npos);
  CHECK(run(folder, file + " --out " + folder / "other.html").exit_code == 0);
  CHECK(content_of(folder / "other.html").size() > 10'000);
}

TEST_CASE("a page is made between two pipes", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const Run piped = run(folder, "- --out - <" + folder.file("drive.log", recording()));
  CHECK(piped.err == "");
  CHECK(piped.exit_code == 0);
  CHECK(piped.out.find("<!DOCTYPE html>") == 0);
}

TEST_CASE("a damaged recording becomes a page that says so", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const Run torn = run(folder, folder.file("torn.log", recording().substr(0, recording().size() - 20)));
  CHECK(torn.exit_code == 3);
  CHECK(torn.err.find("bmuctl: no data after ") == 0);
  CHECK(torn.err.find(": torn.log, its last line, ") != std::string::npos);
  CHECK(content_of(folder / "torn.html").find("<b class=\"fault\">damaged</b> torn.log, its last line, ") !=
        std::string::npos);
}

TEST_CASE("behind a place that is damaged a page goes on with the next part", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const std::string text = recorded_run("0 pack soc_permille 800\n1 vehicle on\n", {.length = 6s, .part_length = 2s});
  // Frame after frame, as the daemon writes them; a byte in the middle one, at the end of the second part, is modified.
  const std::size_t second = text.find("# bmud-recording", 1);
  const std::size_t third = text.find("# bmud-recording", second + 1);
  const std::size_t cuts[] = {0, text.rfind('\n', third - 20'000) + 1, third, text.size()};
  std::string packed;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string file = folder.file("piece.log", text.substr(cuts[i], cuts[i + 1] - cuts[i]));
    REQUIRE(run_program({"/usr/bin/env", "zstd", "-q", "-f", file}).status == 0);
    const std::size_t begin = packed.size();
    packed += content_of(file + ".zst");
    char& middle = packed[(begin + packed.size()) / 2];
    if (i == 1) middle = static_cast<char>(middle ^ 0x10);
  }
  const Run torn = run(folder, folder.file("drive.log.zst", packed));
  CHECK(torn.exit_code == 3);
  CHECK(torn.out.find(folder / "drive.html" + ": 6.") == 0);
  CHECK(torn.out.find(" s are missing") != std::string::npos);
  CHECK(torn.err.find("no data from ") != std::string::npos);
  CHECK(torn.err.find(": drive.log.zst, ") != std::string::npos);
  CHECK(torn.err.find("; reading goes on at line ") != std::string::npos);
  const std::string page = content_of(folder / "drive.html");
  CHECK(page.find("<h2>Gaps</h2>") != std::string::npos);
  CHECK(page.find("<rect class=\"hole\"") != std::string::npos);
}

TEST_CASE("a recording without some of its lines becomes a page that says so", "[integration][bmuctl][report][F106]") {
  const TemporaryFolder folder;
  std::string text = recorded_run("0 pack soc_permille 800\n1 vehicle on\n", {.length = 6s, .part_length = 2s});
  const std::size_t from = text.find("\n(1700000003.") + 1;
  text.erase(from, text.find("\n(1700000003.5") + 1 - from);
  const Run cut = run(folder, folder.file("cut.log", text));
  CHECK(cut.exit_code == 3);
  CHECK(cut.err.find(": cut.log, line ") != std::string::npos);
  CHECK(cut.err.find(" the lines were modified: ") != std::string::npos);
  CHECK(cut.out.find(" s are missing") != std::string::npos);
  CHECK(content_of(folder / "cut.html").find("<b class=\"fault\">damaged</b> cut.log, line ") != std::string::npos);
}

TEST_CASE("a page that cannot be written is no success", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("drive.log", recording());
  // A full disk, as standard output and under a name.
  const Run full = run(folder, file + " --out - >/dev/full");
  CHECK(full.exit_code == 1);
  CHECK(full.err == "bmuctl: cannot write: No space left on device\n");
  CHECK(run(folder, file + " --out /dev/full").exit_code == 1);
  CHECK(run(folder, file + " >/dev/full").exit_code == 1);  // the summary of its output
  CHECK(run(folder, "--help >/dev/full").exit_code == 1);
  // A reader that closes the pipe early is no failure.
  const Run head = run(folder, file + " --out - | head -c 100");
  CHECK(head.exit_code == 0);
  CHECK(head.err == "");
  CHECK(head.out.size() == 100);
}

TEST_CASE("several recordings become one page, whatever else is in their folder", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  static_cast<void>(folder.file("a.log", recorded_run("", {.length = 2s, .from_us = recorded_from_us + 60'000'000})));
  static_cast<void>(folder.file("b.log", recorded_run("", 2s)));
  const Run both = run(folder, folder / "*.log");
  CHECK(both.exit_code == 0);
  CHECK(both.out.find(folder / "b.html" + ": 1 min 2 s, ") == 0);
  CHECK(both.err.find(": nothing between b.log and a.log") != std::string::npos);
  const Run again = run(folder, folder / "?.*" + " --out " + folder / "all.html");
  CHECK(again.exit_code == 3);  // the page of the first run is not a recording
  CHECK(again.err.find("bmuctl: b.html is left out: no recording is in it.") == 0);
  CHECK(run(folder, folder / "*.log" + " --out " + folder / "b.log").exit_code == 2);
  CHECK(run(folder, folder / "a.log" + " -").exit_code == 2);
}

TEST_CASE("times on the terminal are those of this place, and say so", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("drive.log", recording());
  const std::string command = "TZ=Asia/Kolkata " + test::in_build("bin/bmuctl") + " report " + file +
                              " --from '2023-11-15 03:43:22' --to '2023-11-14T22:13:24Z' >" + folder / "out";
  REQUIRE(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  CHECK(content_of(folder / "out").find(": 2.0 s, 2023-11-15 03:43:22+05:30 to 2023-11-15 03:43:24+05:30\n") !=
        std::string::npos);
  CHECK(content_of(folder / "drive.html").find("2023-11-14 22:13:22 to 2023-11-14 22:13:24 UTC") != std::string::npos);
}

TEST_CASE("a packed recording becomes a page as well, a torn one as far as it is good",
          "[integration][bmuctl][report][F106]") {
  const TemporaryFolder folder;
  const auto packed = [&](const std::string& text) {
    const std::string file = folder.file("piece.log", text);
    REQUIRE(run_program({"/usr/bin/env", "zstd", "-q", "-f", file}).status == 0);
    return content_of(file + ".zst");
  };
  // As the daemon writes them: frame after frame.
  const std::size_t middle = recording().find('\n', recording().size() * 9 / 10) + 1;
  const std::string first = packed(recording().substr(0, middle));
  const std::string second = packed(recording().substr(middle));
  const Run whole = run(folder, folder.file("drive.log.zst", first + second));
  CHECK(whole.exit_code == 0);
  CHECK(whole.out.find(folder / "drive.html" + ": 5.") == 0);
  const Run torn = run(folder, folder.file("torn.log.zst", first + second.substr(0, second.size() - 20)));
  CHECK(torn.exit_code == 3);
  CHECK(torn.err.find(", from byte " + std::to_string(first.size()) + " to byte ") != std::string::npos);
}

TEST_CASE("what cannot become a page is told, with an exit code of its kind", "[integration][bmuctl][report]") {
  const TemporaryFolder folder;
  const std::string file = folder.file("drive.log", recording());
  const Run missing = run(folder, folder / "none.log");
  CHECK(missing.exit_code == 1);
  CHECK(missing.err == "bmuctl: cannot read '" + folder / "none.log" + "': No such file or directory\n");
  const Run frames = run(folder, folder.file("frames.log", "(1700000000.000000) vcan0 143#11 R\n"));
  CHECK(frames.exit_code == 1);
  CHECK(frames.err.find("frames.log, line 1: header incomplete") != std::string::npos);
  CHECK(run(folder, folder.file("empty.log", "")).exit_code == 1);
  CHECK(run(folder, file + " --from 2024-01-01").exit_code == 1);
  CHECK(run(folder, file + " --out " + folder / "nowhere/page.html").exit_code == 1);
  CHECK(run(folder, file + " --from yesterday").exit_code == 1);  // there is no recording of that time
  const Run whenever = run(folder, file + " --from whenever");
  CHECK(whenever.exit_code == 2);
  CHECK(whenever.err.find("bmuctl: report: --from: found 'whenever', expected 2026-03-01 17:05") == 0);
  CHECK(run(folder, file + " --from now --to -1h").exit_code == 2);
  CHECK(run(folder, file + " --from begin").exit_code == 0);
  CHECK(run(folder, file + " --out " + file).exit_code == 2);
  CHECK(content_of(file) == recording());
  const Run no_history = run(folder, "--socket " + folder / "none.sock");
  CHECK(no_history.exit_code == 1);
  CHECK(no_history.err.find("history.sqlite") != std::string::npos);
}
