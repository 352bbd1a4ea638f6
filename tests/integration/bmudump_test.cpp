// bmudump as a user runs it: the program, its output, its complaints and its exit codes.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/shell/bus_port.hpp"
#include "daemon/shell/embedded_bus.hpp"
#include "devices/device_list.hpp"
#include "protocol/candump.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/process.hpp"
#include "tests/support/sanitized.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/worked_frames.hpp"

namespace {

using namespace bmu;
using namespace bmu::test;

const std::string bmudump = test::in_build("bin/bmudump");
const std::string fixture = test::in_source("vcan-fixtures/worked-frames.log");

std::string content_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// An embedded bus of this test alone, whose file is removed with it.
class TestBus {
 public:
  explicit TestBus(const std::string& word) : bus_("bmudump-" + word + "-" + std::to_string(::getpid())) {}
  TestBus(const TestBus&) = delete;
  TestBus& operator=(const TestBus&) = delete;
  ~TestBus() { ::unlink(embedded_bus_path(bus_).c_str()); }
  [[nodiscard]] std::string name() const { return "unix:" + bus_; }

 private:
  std::string bus_;
};

/// Waits until so many have joined an embedded bus: each has a socket of the bus's name (embedded_bus.cpp).
bool has_participants(const std::string& bus, std::size_t count) {
  const std::string socket = "@bmud-bus/" + bus.substr(std::string("unix:").size()) + "/";
  for (const auto begin = std::chrono::steady_clock::now();
       std::chrono::steady_clock::now() - begin < test::hang_max;) {
    const std::string sockets = content_of("/proc/net/unix");
    std::size_t found = 0;
    for (std::size_t at = sockets.find(socket); at != std::string::npos; at = sockets.find(socket, at + 1)) ++found;
    if (found >= count) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

struct Run {
  int exit_code = -1;
  std::string out, err;
};

/// Runs bmudump with shell words as arguments, `input` at its standard input.
Run run(const std::string& arguments, std::string_view input = "") {
  const TemporaryFolder folder;
  const std::string command =
      bmudump + " " + arguments + " <" + folder.file("in", input) + " >" + folder / "out" + " 2>" + folder / "err";
  const int status = std::system(command.c_str());  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(folder / "out"), content_of(folder / "err")};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

constexpr std::string_view good_line = "(1700000000.123456) vcan0 143#8EA08E928EB22AB2\n";
constexpr std::string_view good_text =
    "(1700000000.123456) vcan0 143 CELLS_1 node 3     cell_voltage_1 3.6512 V  cell_voltage_2 3.6498 V  "
    "cell_voltage_3 3.6530 V  counter 42\n";

/// The span in "PREFIX2.5 s", which a busy machine makes longer but never shorter; -1 if the text has no such span.
double seconds_after(const std::string& text, const std::string& prefix) {
  const std::size_t at = text.find(prefix);
  if (at == std::string::npos) return -1.0;
  double seconds = -1.0;
  std::string unit;
  std::istringstream(text.substr(at + prefix.size())) >> seconds >> unit;
  return unit.starts_with("s") ? seconds : -1.0;
}

std::string times(int count, std::string_view text) {
  std::string all;
  while (count-- > 0) all += text;
  return all;
}

/// CELLS_1 of node 3 that answers a POLL.
std::string good_with_counter(std::uint8_t counter, std::int64_t time_us = 1'000'000) {
  CanFrame frame = internal_worked_frames()[2].frame();
  seal(internal_bus::cells_1, counter, frame);
  std::array<char, log_line_length_max> text{};
  const LogLine line{.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0", .frame = frame};
  return std::string(text.data(), print_log_line(line, text)) + "\n";
}

/// What the second frame of a log makes of a millisecond, in kbit/s and so in bits. The first was over when the time
/// began.
std::string load_of(const std::string& frame) {
  const Run result = run("-r - --summary", "(1.000000) vcan0 080#008F000000002A1F\n(1.001000) vcan0 " + frame + "\n");
  const std::string before = ", load at least ";
  const auto at = result.out.find(before);
  REQUIRE(at != std::string::npos);
  return result.out.substr(at + before.size(), result.out.find('\n') - at - before.size());
}

}  // namespace

TEST_CASE("the load counts each frame's own bits", "[integration][bmudump]") {
  // Start, identifier, three bits, length, data, CRC, a stuff bit in brackets behind each five that are equal:
  //   0 00100100011 000 00[1]10 01010101 10101010 001000010010101
  // 50 bits and one, 10 behind the CRC, 3 between frames.
  CHECK(load_of("123#55AA") == "64.0 kbit/s (12.8 % of 500 kbit/s)");
  // Of the recordings, whose loads are in their .expected files: CELLS_1, with one stuff bit,
  //   0 00101000011 000 1000 10001110 10100000 [1]10001110 10010010 10001110 10110010 00101010 10110010 CRC
  CHECK(load_of("143#8EA08E928EB22AB2") == "112.0 kbit/s (22.4 % of 500 kbit/s)");
  // PDU_STATUS, with nine,
  //   0 0000[1]1000001 000[1] 1000 00[1]000110 00111101 00000[1]100 10110000 0[1]0000 0[1]001 11111[0]111 ...
  CHECK(load_of("041#063D04B001FF052E") == "120.0 kbit/s (24.0 % of 500 kbit/s)");
  // and PACK_NAME, with three.
  CHECK(load_of("620#49484120424D5331") == "114.0 kbit/s (22.8 % of 500 kbit/s)");
}

TEST_CASE("the load has nothing of frames whose bits a log does not have", "[integration][bmudump]") {
  CHECK(load_of("123##155AA") == "0.0 kbit/s (0.0 % of 500 kbit/s)");                 // CAN FD
  CHECK(load_of("20000004#0000000000000000") == "0.0 kbit/s (0.0 % of 500 kbit/s)");  // an error frame
}

TEST_CASE("bmudump names and scales every signal of the worked frames", "[integration][bmudump]") {
  const Run result = run("-r " + fixture);
  CHECK(result.exit_code == 0);
  CHECK(result.err.empty());
  const std::string expected = content_of(test::in_source("tests/integration/bmudump_worked_frames.txt"));
  CHECK(result.out == expected);
}

TEST_CASE("bmudump's JSON has exactly the documented shape", "[integration][bmudump]") {
  const Run cells = run("-r - --json", good_line);
  CHECK(cells.out ==
        R"({"time_s":1700000000.123456,"bus":"vcan0","id":"143","message":"CELLS_1","node":3,"ok":true,)"
        R"("signals":{"cell_voltage_1_uV":3651200,"cell_voltage_2_uV":3649800,"cell_voltage_3_uV":3653000,)"
        R"("counter":42}})"
        "\n");
  CHECK(run("-r - --json --device vcan0=internal", "(1.000000) vcan0 143#8EA08E928EB22AB3\n").out ==
        R"({"time_s":1.000000,"bus":"vcan0","id":"143","message":"CELLS_1","node":3,"ok":false,)"
        R"("reason":"wrong crc","data":"8EA08E928EB22AB3"})"
        "\n");
  CHECK(run("-r - --json", "(1.000000) vcan0 7FF#0102\n").out ==
        R"({"time_s":1.000000,"bus":"vcan0","id":"7FF","message":null,"node":null,"ok":null,"data":"0102"})"
        "\n");
  CHECK(run("-r - --json", "(1.000000) v\"\\\xFF 18FF50E5#R2\n").out ==
        R"({"time_s":1.000000,"bus":"v\"\\\u00FF","id":"18FF50E5","message":null,"node":null,"ok":null,)"
        R"("remote":true,"length":2,"data":""})"
        "\n");
  CHECK(run("-r - --json", "(1.000000) vcan0 143#R R\n").out ==
        R"({"time_s":1.000000,"bus":"vcan0","id":"143","direction":"received","message":null,"node":null,"ok":null,)"
        R"("remote":true,"length":0,"data":""})"
        "\n");
  CHECK(run("-r - --json", "(1.000000) vcan0 7FF#1122334455667788_C T\n").out ==
        R"({"time_s":1.000000,"bus":"vcan0","id":"7FF","direction":"sent","length_code":12,"message":null,"node":null,)"
        R"("ok":null,"data":"1122334455667788"})"
        "\n");
}

TEST_CASE("every JSON line parses and holds the values the rows decode", "[integration][bmudump]") {
  std::vector<WorkedFrame> frames = internal_worked_frames();
  for (WorkedFrame& one : vehicle_worked_frames()) frames.push_back(one);
  std::vector<nlohmann::json> seen;
  for (const std::string& line : lines_of(run("-r " + fixture + " --json").out)) {
    seen.push_back(nlohmann::json::parse(line));
  }
  REQUIRE(seen.size() == frames.size());
  for (const nlohmann::json& one : seen) CHECK(one.at("ok") == true);
  for (const WorkedFrame& worked : frames) {
    const bool is_found = std::any_of(seen.begin(), seen.end(), [&worked](const nlohmann::json& one) {
      if (one.at("message") != worked.message->name) return false;
      if (one.at("node").is_null() == worked.message->has_node()) return false;
      return std::all_of(worked.meaning.begin(), worked.meaning.end(), [&](const auto& pair) {
        const nlohmann::json& value = one.at("signals").value(std::string(pair.first), nlohmann::json("missing"));
        if (value.is_string()) return value != "missing";
        return pair.second.is_valid() ? value == pair.second.value : value.is_null();
      });
    });
    INFO(worked.message->name);
    CHECK(is_found);
  }
}

TEST_CASE("frames that fail their check are marked and are no error", "[integration][bmudump]") {
  const Run result = run("-r - --device vcan0=internal",
                         "(1.000000) vcan0 143#8EA08E928EB22AB3\n"
                         "(1.000000) vcan0 143#8EA0\n"
                         "(1.000000) vcan0 143#R8\n"
                         "(1.000000) vcan0 143##18EA0\n"
                         "(1.000000) vcan0 20000040#0000000000000000\n"
                         "(1.000000) vcan0 18FF50E5#01\n"
                         "(1.000000) vcan0 7FF#\n");
  CHECK(result.exit_code == 0);
  CHECK(result.out ==
        "(1.000000) vcan0 143 CELLS_1 node 3     !! wrong crc  [8] 8E A0 8E 92 8E B2 2A B3\n"
        "(1.000000) vcan0 143 CELLS_1 node 3     !! wrong length  [2] 8E A0\n"
        "(1.000000) vcan0 143 CELLS_1 node 3     remote frame, asks for 8 bytes\n"
        "(1.000000) vcan0 143 CAN FD             [02] 8E A0\n"
        "(1.000000) vcan0 00000040 unknown       error frame: bus off  [8] 00 00 00 00 00 00 00 00\n"
        "(1.000000) vcan0 18FF50E5 unknown       [1] 01\n"
        "(1.000000) vcan0 7FF unknown            [0]\n");
  CHECK(run("-r - --strict", good_line).exit_code == 0);
  CHECK(run("-r - --strict", "(1.000000) vcan0 7FF#\n").exit_code == 4);
  CHECK(run("-r - --strict", "(1.000000) vcan0 143#8EA0\n").exit_code == 4);
}

TEST_CASE("each bus of a log has counters of its own", "[integration][bmudump]") {
  const std::string one = "(1.000000) can0 143#8EA08E928EB22AB2\n";
  const std::string other = "(1.000000) can1 143#8EA08E928EB22AB2\n";
  const Run result = run("-r - --json", one + other + one + other);
  const std::vector<std::string> lines = lines_of(result.out);
  REQUIRE(lines.size() == 4);
  for (std::size_t index = 0; index < 4; ++index) {
    CHECK((lines[index].find("repeated counter") != std::string::npos) == (index >= 2));
  }
}

TEST_CASE("a seventeenth bus is refused line by line, the others go on", "[integration][bmudump]") {
  std::string log;
  for (int bus = 0; bus < 17; ++bus) log += "(1.000000) can" + std::to_string(bus) + " 7FF#\n";
  const Run result = run("-r -", log + "(1.000000) can3 7FF#\n");
  CHECK(result.exit_code == 3);
  CHECK(lines_of(result.out).size() == 17);
  CHECK(result.err ==
        "bmudump: standard input:17:12: found one more bus name, wanted at most 16 buses in all; line skipped\n");
}

TEST_CASE("damaged lines are reported with place, found and wanted, and the run goes on",
          "[integration][bmudump][F106]") {
  const TemporaryFolder folder;
  const std::string log = folder.file("drive.log", std::string(good_line) + "vcan0  143  [8]  8E\n\n# comment\n" +
                                                       "(1700000000.123) vcan0 143#\n" +
                                                       "(1700000000.123456) vcan0 143#112233445566778899\n" +
                                                       std::string("(17\0", 4) + "\n" + "(1700000001.12");
  const Run result = run("-r " + log);
  CHECK(result.exit_code == 3);
  CHECK(result.out == good_text);
  CHECK(result.err ==
        "bmudump: " + log +
            ":2:20: found the end of the line, wanted as many bytes, each behind a space, as the brackets have; line "
            "skipped\n" +
            "bmudump: " + log + ":5:16: found ')', wanted 6 (or 9) digits of a second; line skipped\n" +
            "bmudump: " + log + ":6:47: found '9', wanted at most 8 data bytes (64 after '##'); line skipped\n" +
            "bmudump: " + log + ":7:4: found byte 00h, wanted '.' between seconds and fraction; line skipped\n" +
            "bmudump: " + log + ":8: last line without a line end, torn; line skipped\n");
}

TEST_CASE("of endless damage the first thousand lines are told and all are counted", "[integration][bmudump][F106]") {
  const Run result = run("-r -", times(5'000, "garbage\n"));
  CHECK(result.exit_code == 3);
  const std::vector<std::string> lines = lines_of(result.err);
  REQUIRE(lines.size() == 1'001);
  CHECK(lines.back() == "bmudump: standard input: 5000 damaged lines in all, the first 1000 told");
}

TEST_CASE("CRLF, time going back and a whole last line without newline are fine", "[integration][bmudump][F106]") {
  const Run result = run("-r -",
                         "(9.000000) vcan0 7FF#01\r\n"
                         "\r\n"
                         "(1.000000) vcan0 7FF#0203040506070809");
  CHECK(result.exit_code == 0);
  CHECK(result.err.empty());
  CHECK(lines_of(result.out).size() == 2);
}

TEST_CASE("where the clock of a log was set is reported once, and left out of rates, gaps and loads",
          "[integration][bmudump][clock]") {
  // A computer without a battery clock: set 2 s after its start, and an hour back 2 s later.
  std::string log;
  for (const std::int64_t from_s : {12, 1'700'000'000, 1'699'996'400}) {
    for (int i = 0; i < 100; ++i) {
      const std::string time =
          std::to_string(from_s + i / 50) + "." + std::to_string(100 + i % 50 * 2).substr(1) + "0000";
      log += "(" + time + ") can0 7A1#0000000000000000\n";
    }
  }
  const Run text = run("-r - --summary", log);
  CHECK(text.exit_code == 0);
  CHECK(text.err ==
        "bmudump: standard input:101: the clock goes forward by 1699999986.020000 s here; left out of rates, gaps and "
        "loads\n"
        "bmudump: standard input:201: the clock goes back by 3601.980000 s here; left out of rates, gaps and loads\n");
  CHECK(text.out.find("can0: 300 frames, 5.940000 s, load at least ") == 0);
  CHECK(text.out.find(", clock jumps 2\n") != std::string::npos);
  CHECK(text.out.find("7A1       unknown                           300         0     50.00/s    0.020000 s ") !=
        std::string::npos);
  CHECK(text.out.find("silent") == std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(run("-r - --summary --json", log).out);
  CHECK(json.at("span_s") == 5.94);
  CHECK(json.at("clock_jumps") == 2);
  CHECK(json.at("load_bit_per_s").get<double>() > 5'000);
  CHECK(json.at("ids")[0].at("rate_per_s") == 50.0);
  CHECK(json.at("ids")[0].at("silent_s").is_null());
  // Also while lines are shown, of buses that are not, and in the table.
  CHECK(run("-r - -t z", log).err == text.err);
  CHECK(lines_of(run("-r - -t z", log).out).back().starts_with("(5.940000) "));
  const std::string table = run("-r - --follow", log).out;
  CHECK(table.find("can0   300 frames   50.0/s   ") == 0);
  CHECK(table.find(" 50.0/s ", table.find("7A1")) != std::string::npos);
  // Once for each place, not for each file.
  const Run none = run("-r - --summary", "(1.000000) can0 7A1#\n(2.000000) can0 7A1#\n");
  CHECK(none.err.empty());
  CHECK(nlohmann::json::parse(run("-r - --summary --json", "(1.000000) can0 7A1#\n").out).at("clock_jumps") == 0);
}

TEST_CASE("what no bus had a frame for may be a setting of the clock, and is reported as either",
          "[integration][bmudump][clock]") {
  std::string log;
  for (const int from_s : {1'700'000'000, 1'700'003'600}) {
    for (int i = 0; i < 50; ++i) {
      log += "(" + std::to_string(from_s) + "." + std::to_string(100 + i * 2).substr(1) + "0000) can0 7A1#\n";
    }
  }
  const Run text = run("-r - --summary", log);
  CHECK(text.err ==
        "bmudump: standard input:51: the clock goes forward by 3599.020000 s here, or no bus had a frame for so long; "
        "left out of rates, gaps and loads\n");
  CHECK(text.out.find("can0: 100 frames, 1.960000 s, ") == 0);
  // A bus that falls silent beside one that goes on is no clock.
  std::string beside;
  for (int i = 0; i < 60; ++i) beside += "(" + std::to_string(1'700'000'000 + i) + ".000000) can0 7A1#\n";
  for (int i = 0; i < 30; ++i) beside += "(" + std::to_string(1'700'000'060 + i) + ".000000) can1 7A2#\n";
  CHECK(run("-r - --summary", beside).err.empty());
}

// A sanitizer keeps what was freed for a while, and more around everything.
constexpr long resident_max_kB = test::is_sanitized ? 524'288 : 32'768;

/// Runs bmudump with its output in the folder's files "out" and "err"; the most memory it had, in kB.
long resident_kB_of(std::vector<std::string> arguments, const TemporaryFolder& folder, int& exit_code) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open((folder / "out").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600), STDOUT_FILENO);
    ::dup2(::open((folder / "err").c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600), STDERR_FILENO);
    std::vector<char*> words{const_cast<char*>(bmudump.c_str())};
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    ::execv(bmudump.c_str(), words.data());
    ::_exit(127);
  }
  int status = 0;
  rusage usage{};
  REQUIRE(::wait4(child, &status, 0, &usage) == child);
  exit_code = WEXITSTATUS(status);
  return usage.ru_maxrss;
}

TEST_CASE("a byte-order mark costs no line", "[integration][bmudump]") {
  const std::string mark = "\xEF\xBB\xBF";
  const auto check = [&mark](const std::string& first) {
    INFO(first);
    const Run result = run("-r -", mark + first + std::string(good_line) + mark + first);
    CHECK(result.exit_code == 0);
    CHECK(result.err.empty());
    return lines_of(result.out).size();
  };
  CHECK(check("(1700000000.000000) can0 7FF#01\n") == 3);
  CHECK(check("(1700000000.000000)  can0  7FF   [1]  01\n") == 3);
  CHECK(check("# comment\n") == 1);
  CHECK(check("\r\n") == 1);
  CHECK(check("") == 1);
  CHECK(run("-r -", mark + "DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 1)\n").exit_code == 0);
  CHECK(run("-r -", mark + "garbage\n").err ==
        "bmudump: standard input:1:1: found 'g', wanted '(' before the time; line skipped\n");
  CHECK(run("-r -", times(80'000, mark) + std::string(good_line)).out == good_text);
  // A mark may be no more than a part of the line.
  CHECK(run("-r -", mark + mark.substr(0, 1) + "\n").exit_code == 3);
  CHECK(run("-r -", mark + "(1.000000) can0 620#4948").exit_code == 3);
}

TEST_CASE("a torn last line is named, and is no shorter frame", "[integration][bmudump][F106]") {
  const std::string start = "(1.000000) can0 ";
  const auto last_of = [](const std::string& last) { return run("-r - -t none", "(1.000000) can0 7FF#\n" + last); };
  const auto is_torn = [&](const std::string& last) {
    const Run result = last_of(last);
    const bool is_named = result.err == "bmudump: standard input:2: last line without a line end, torn; line skipped\n";
    return is_named && result.exit_code == 3 && lines_of(result.out).size() == 1;
  };
  const auto is_whole = [&](const std::string& last) {
    const Run result = last_of(last);
    return result.exit_code == 0 && lines_of(result.out).size() == 2;
  };
  // Wherever it is cut, in its bytes and before them.
  const std::string name = start + "620#49484120424D5331";
  for (std::size_t length = 1; length < name.size(); ++length) {
    INFO(name.substr(0, length));
    CHECK(is_torn(name.substr(0, length)));
  }
  CHECK(is_whole(name));
  // The row of PACK_STATUS has six bytes; 7FFh has no row.
  CHECK(is_whole(start + "622#020E8D040000"));
  CHECK(is_torn(start + "622#020E8D0400"));
  CHECK(is_torn(start + "7FF#01"));
  CHECK(is_torn(start + "7FF#"));
  CHECK(is_torn("can0 7FF#01"));  // without a time
  CHECK(is_torn(start + "20000004#00"));
  CHECK(is_torn(start + "7FF#R"));
  CHECK(is_torn(start + "7FF##1AABB"));
  CHECK(is_torn("  can0  7FF   [2]  41"));
  CHECK(is_torn("  can0  7FF   [2]  41 4"));
  CHECK(is_torn("  can0  7FF   [2"));
  CHECK(is_torn("  can0  7FF   [0]  remo"));
  CHECK(is_torn("  can0  7"));
  CHECK(is_torn("DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 1"));
  CHECK(is_torn("DROPCOUNT: dro"));
  CHECK(is_whole(start + "7FF#R4"));
  CHECK(is_whole(start + "7FF#01 R"));
  CHECK(is_whole(start + "7FF#01\r"));
  CHECK(is_whole(start + "7FF##1" + times(64, "AA")));
  CHECK(is_whole("  can0  7FF   [2]  41 42"));
  CHECK(is_whole("  can0  7FF   [1]  23   '#'"));
  CHECK(is_whole("can0 7FF#01 T"));
  // Other damage has its place, and a comment says nothing.
  CHECK(last_of(start + "7FF#0G00").err ==
        "bmudump: standard input:2:21: found '0', wanted data bytes of two hexadecimal digits; line skipped\n");
  CHECK(last_of("# commen").exit_code == 0);
  // The row's length is that of the device which is read.
  CHECK(run("-r - --device can0=elcon_tc", start + "18FF50E5#0C1C00640000").exit_code == 3);
}

TEST_CASE("names of buses that are filled with spaces cost no bus", "[integration][bmudump]") {
  const Run result = run("-r - -L",
                         "(1700000000.000000)   can0 080#008F000000002A1F\n"
                         "(1700000000.001000)   can0 103#5C000000100C2AA1 R\n"
                         "(1700000000.100000) vcan10 620#49484120424D5331\n");
  CHECK(result.exit_code == 0);
  CHECK(result.err.empty());
  CHECK(result.out ==
        "(1700000000.000000) can0 080#008F000000002A1F\n"
        "(1700000000.001000) can0 103#5C000000100C2AA1 R\n"
        "(1700000000.100000) vcan10 620#49484120424D5331\n");
}

TEST_CASE("a screen without times is read, and its frames are numbered", "[integration][bmudump]") {
  const std::string log =
      "  can0  080   [8]  00 8F 00 00 00 00 2A 1F\n"
      "  can0  143   [8]  8E A0 8E 92 8E B2 2A B2\n"
      "  can0  20000004   [8]  00 08 00 00 00 00 60 00   ERRORFRAME\n"
      "\tcontroller-problem{tx-error-warning}\n"
      "\terror-counter-tx-rx{{96}{0}}\n"
      "  can1  7FF   [2]  01 02\n";
  const Run text = run("-r - --brief --filter 143,7FF,#4", log);
  CHECK(text.exit_code == 0);
  CHECK(text.err == "bmudump: standard input:1: no time; frames without a time have a number in its place\n");
  CHECK(text.out ==
        "(2) can0 143 CELLS_1 node 3     cell_voltage_1 3.6512 V  cell_voltage_2 3.6498 V  cell_voltage_3 3.6530 V\n"
        "(3) can0 00000004 unknown       error frame: controller: send errors at warning level, counters: send 96, "
        "receive 0  [8] 00 08 00 00 00 00 60 00\n"
        "(4) can1 7FF unknown            [2] 01 02\n");
  CHECK(lines_of(run("-r - --json", log).out).back() ==
        R"({"time_s":null,"number":4,"bus":"can1","id":"7FF","message":null,"node":null,"ok":null,"data":"0102"})");
  const Run summary = run("-r - --summary", log);
  CHECK(summary.out.find("can0: 3 frames, 0.000000 s\n") != std::string::npos);
  CHECK(summary.out.find("can1: 1 frames, 0.000000 s\n") != std::string::npos);
  CHECK(lines_of(run("-r - --follow", log).out).back().ends_with("  1       -       -       -  [2] 01 02"));
}

TEST_CASE("the explanation of an error frame belongs to it, elsewhere it is damage", "[integration][bmudump]") {
  const std::string error = "  can0  20000040   [8]  00 00 00 00 00 00 00 00   ERRORFRAME\n\tbus-off\n";
  CHECK(run("-r -", error).exit_code == 0);
  const Run result =
      run("-r -", "(1700000000.000000) can0 20000040#0000000000000000\n\tbus-off\n" + std::string(good_line) +
                      "\tbus-off\n  can0  20000040   [9]  ERRORFRAME\n\tbus-off\n");
  CHECK(result.exit_code == 3);
  CHECK(result.err ==
        "bmudump: standard input:4:1: found byte 09h, wanted '(' before the time; line skipped\n"
        "bmudump: standard input:5:20: found '[', wanted the number of bytes in brackets, 0 to 8 or 00 to 64; line "
        "skipped\n");
}

TEST_CASE("frames that candump -d did not receive are counted as lost, and are no damage", "[integration][bmudump]") {
  const std::string lost_3 = "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n";
  const std::string lost_1 = "DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 4)\n";
  const std::string log = std::string("(1.000000) can0 143#8EA08E928EB22AB2\n") + lost_3 +
                          "(2.000000) can0 143#8EA08E928EB22AB2\n" + lost_1 + "(2.000000) can1 7FF#\n";
  const Run text = run("-r - --strict --filter CELLS_1", log);  // a counter seen before the loss is not repeated
  CHECK(text.exit_code == 0);
  CHECK(text.err ==
        "bmudump: standard input:2: can0: 3 frames lost when this was recorded\n"
        "bmudump: standard input:4: can0: 1 frames lost when this was recorded\n");
  CHECK(lines_of(text.out).size() == 2);
  const Run summary = run("-r - --summary", log);
  CHECK(summary.exit_code == 0);
  CHECK(summary.out.find("error frames 0, not classic CAN 0, lost 4\n") != std::string::npos);
  CHECK(summary.out.find("error frames 0, not classic CAN 0\n") != std::string::npos);
  const std::vector<std::string> json = lines_of(run("-r - --summary --json", log).out);
  REQUIRE(json.size() == 2);
  CHECK(nlohmann::json::parse(json[0]).at("lost") == 4);
  CHECK(nlohmann::json::parse(json[0]).at("frames") == 2);
  CHECK(nlohmann::json::parse(json[1]).at("lost") == 0);
  const std::vector<std::string> frames = lines_of(run("-r - --json", log).out);
  REQUIRE(frames.size() == 5);
  CHECK(frames[1] == R"({"time_s":null,"bus":"can0","lost":3})");
  CHECK(run("-r - -L", log).out == log);
  CHECK(lines_of(run("-r - --follow", log).out).front().ends_with("   4 lost"));
  // A bus of which nothing else is known; one that is not shown.
  CHECK(run("-r - --summary", lost_3).out.starts_with("can0: 0 frames, "));
  CHECK(lines_of(run("can1 -r - --json", log).out).size() == 1);
  CHECK(run("can1 -r - --summary", log).out.find("lost") == std::string::npos);
  // On a screen without times, too.
  CHECK(run("-r - --summary", "  can0  7FF   [0]\n" + lost_1).out.find(", lost 1\n") != std::string::npos);
  const std::vector<std::string> told = lines_of(run("-r -", times(1'001, lost_1)).err);
  REQUIRE(told.size() == 1'001);
  CHECK(told.back() == "bmudump: standard input: frames lost at 1001 places in all, the first 1000 told");
  for (const char* damaged : {"DROPCOUNT: dropped", "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3",
                              "DROPCOUNT: dropped x CAN frames on 'can0' socket (total drops 3)",
                              "DROPCOUNT: dropped 3 CAN frames on '' socket (total drops 3)",
                              "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3) "}) {
    INFO(damaged);
    CHECK(run("-r -", std::string(damaged) + "\n").exit_code == 3);
  }
}

TEST_CASE("times as candump -t writes them are read as absolute ones", "[integration][bmudump]") {
  const auto times_of = [](const std::string& log, const std::string& told = "") {
    const Run result = run("-r - --json", log);
    CHECK(result.exit_code == 0);
    CHECK(result.err == told);
    std::vector<double> times_s;
    for (const std::string& line : lines_of(result.out)) {
      times_s.push_back(nlohmann::json::parse(line).at("time_s").get<double>());
    }
    return times_s;
  };
  using Times = std::vector<double>;
  const std::string frame = "  can0  7FF   [0]\n";
  const std::string other = "  can1  7FF   [0]\n";
  const std::string told = "bmudump: standard input:1: times since the line before (candump -t d); added up\n";
  CHECK(times_of("(1700000000.500000)" + frame) == Times{1700000000.5});
  CHECK(times_of("(000.000000)" + frame + "(000.500000)" + other + "(001.250000)" + frame) == Times{0, 0.5, 1.25});
  CHECK(times_of("(000.000000)" + frame + "(000.500000)" + frame + "(000.250000)" + frame, told) ==
        Times{0, 0.5, 0.75});
  // All the same, as of a steady bus.
  CHECK(times_of("(000.000000)" + frame + times(3, "(000.250000)" + frame), told) == Times{0, 0.25, 0.5, 0.75});
  CHECK(times_of("(000.000000) can0 7FF#\n" + times(3, "(000.250000) can0 7FF#\n"), told) == Times{0, 0.25, 0.5, 0.75});
  // Two buses, of which one is read a bit later, and two logs behind each other.
  CHECK(times_of("(000.000000)" + frame + "(000.000500)" + frame + "(000.000400)" + other) == Times{0, 0.0005, 0.0004});
  CHECK(times_of(
            times(2, "(000.000000)" + frame + "(000.500000)" + frame),
            "bmudump: standard input:3: the clock goes back by 0.500000 s here; left out of rates, gaps and loads\n") ==
        Times{0, 0.5, 0, 0.5});
  // A log whose times are not of candump's form has them as they are.
  CHECK(times_of("(2.000000) can0 7FF#\n(1.000000) can0 7FF#\n") == Times{2, 1});
  ::setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3", 1);  // NOLINT(concurrency-mt-unsafe): one thread
  CHECK(times_of("(2023-11-14 23:13:20.500000)" + frame + "(2023-07-14 23:13:20.500000) can0 7FF#\n") ==
        Times{1700000000.5, 1689369200.5});
  ::setenv("TZ", "UTC", 1);  // NOLINT(concurrency-mt-unsafe): one thread
}

TEST_CASE("a line of 100 MB is skipped in little memory", "[integration][bmudump][F106]") {
  const TemporaryFolder folder;
  const std::string path = folder / "huge.log";
  {
    std::ofstream huge(path, std::ios::binary);
    huge << good_line;
    const std::string megabyte(1'000'000, 'A');
    for (int count = 0; count < 100; ++count) huge << megabyte;
    huge << "\n" << times(1, "(1700000000.123456) vcan1 143#8EA08E928EB22AB2\n");
  }
  int exit_code = -1;
  CHECK(resident_kB_of({"-r", path}, folder, exit_code) < resident_max_kB);
  CHECK(exit_code == 3);
  CHECK(lines_of(content_of(folder / "out")).size() == 2);
  CHECK(content_of(folder / "err") ==
        "bmudump: " + path + ":2:262145: found more than 262144 characters, wanted a newline; line skipped\n");
}

TEST_CASE("a log of ever new identifiers on all buses, and a packed one, take little memory",
          "[integration][bmudump]") {
  const TemporaryFolder folder;
  std::string log;
  for (int id = 0; id < 100'000; ++id) {
    std::array<char, 64> line{};
    std::snprintf(line.data(), line.size(), "(%d.000000) can%d %08X#%02X\n", 1'700'000'000 + id, id % 16,
                  static_cast<unsigned>(id) * 5'003U, static_cast<unsigned>(id) % 256);
    log += line.data();
  }
  const std::string path = folder.file("many.log", log);
  int exit_code = -1;
  for (const char* form : {"--summary", "--follow", "--json"}) {
    INFO(form);
    CHECK(resident_kB_of({"-r", path, form}, folder, exit_code) < resident_max_kB);
    CHECK(exit_code == 0);
  }
  const std::string packed = folder / "many.zst";
  // NOLINTNEXTLINE(cert-env33-c,concurrency-mt-unsafe): our own words
  REQUIRE(std::system(("zstd -q --long=24 " + path + " -o " + packed).c_str()) == 0);
  CHECK(resident_kB_of({"-r", packed, "--summary"}, folder, exit_code) < resident_max_kB);
  CHECK(exit_code == 0);
}

TEST_CASE("a reader that goes away ends bmudump without complaint", "[integration][bmudump][F107]") {
  const TemporaryFolder folder;
  const std::string log = folder.file("long.log", times(200'000, good_line));
  const std::string command = "bash -c '" + bmudump + " -r " + log + " 2>" + folder / "err" + " | head -n 1 >" +
                              folder / "out" + "; exit ${PIPESTATUS[0]}'";
  const int status = std::system(command.c_str());  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  CHECK(WEXITSTATUS(status) == 0);
  CHECK(content_of(folder / "out") == good_text);
  CHECK(content_of(folder / "err").empty());
}

TEST_CASE("tables are printed like frames: a reader may go away, a full disk is told", "[integration][bmudump][F107]") {
  const TemporaryFolder folder;
  const std::string to_true =
      "bash -c '" + bmudump + " --protocol-doc 2>" + folder / "err" + " | true; exit ${PIPESTATUS[0]}'";
  CHECK(WEXITSTATUS(std::system(to_true.c_str())) == 0);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  CHECK(content_of(folder / "err").empty());
  const std::string to_full = bmudump + " --dbc internal >/dev/full 2>" + folder / "err";
  CHECK(WEXITSTATUS(std::system(to_full.c_str())) == 1);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  CHECK(content_of(folder / "err") == "bmudump: cannot write: No space left on device\n");
}

TEST_CASE("output that cannot be written and files that cannot be read exit with 1", "[integration][bmudump]") {
  const Run missing = run("-r /nowhere/drive.log");
  CHECK(missing.exit_code == 1);
  CHECK(missing.err == "bmudump: cannot open /nowhere/drive.log: No such file or directory\n");
  CHECK(run("-r /tmp").exit_code == 1);
  const int status = std::system((bmudump + " -r " + fixture + " >/dev/full 2>/dev/null").c_str());  // NOLINT
  CHECK(WEXITSTATUS(status) == 1);
}

TEST_CASE("a wrong command line exits with 2 and says what is wrong", "[integration][bmudump]") {
  for (const char* arguments : {"",
                                "--no-such-option can0",
                                "can0 --dbc internal",
                                "-r - --json --log",
                                "-r - --json --follow",
                                "-r - -L --summary",
                                "-r - -t x",
                                "-r - -t d --json",
                                "-r - -T 5",
                                "-r - --dialect klingon",
                                "can0,XYZ -r -",
                                "-r - --filter 123:",
                                "-r - --filter NO_SUCH_MESSAGE",
                                "-r - --vehicle-base 800",
                                "-r - --vehicle-base 0FF",
                                "--dbc toaster",
                                "-r - --device toaster",
                                "-r - --device =sma",
                                "-r - --device internal",
                                "can0 --devices",
                                "--dbc internal --nodes 0",
                                "--dbc internal --nodes 5-2",
                                "-r - --seconds 3",
                                "-r - --color sometimes",
                                "-r - --count 0"}) {
    INFO(arguments);
    const Run result = run(arguments);
    CHECK(result.exit_code == 2);
    CHECK_FALSE(result.err.empty());
    CHECK(result.out.empty());
  }
}

TEST_CASE("help and version are answers, not errors", "[integration][bmudump]") {
  CHECK(run("--help").exit_code == 0);
  CHECK(run("--help").out.find("Exit codes:") != std::string::npos);
  CHECK(run("--version").out == "bmudump " BMUD_VERSION "\n");
}

TEST_CASE("filter takes identifiers, names and beginnings of names", "[integration][bmudump]") {
  CHECK(lines_of(run("-r " + fixture + " --filter 143").out).size() == 1);
  CHECK(lines_of(run("-r " + fixture + " --filter 'CELLS_*',POLL").out).size() == 3);
  CHECK(lines_of(run("-r " + fixture + " --filter PACK_STATUS --count 1").out).size() == 1);
  CHECK(lines_of(run("--filter POLL -r " + fixture).out).size() == 1);
  CHECK(lines_of(run("--filter 'cells_*',Poll -r " + fixture).out).size() == 3);
}

TEST_CASE("filters of candump's form hide frames of a log, not from the check", "[integration][bmudump]") {
  const std::string poll_and_late_answer =
      "(1.000000) can0 080#008F000000002A1F\n(1.000000) can0 383#0300000000001107\n"
      "(1.000000) can1 143#8EA08E928EB22AB2\n(1.000000) can0 18FF50E5#01\n";
  CHECK(lines_of(run("can0,383:7FF -r -", poll_and_late_answer).out).size() == 1);
  CHECK(lines_of(run("can0,80:80000780 can1,0~0 -r -", poll_and_late_answer).out).size() == 1);
  CHECK(lines_of(run("any,18FF50E5:DFFFFFFF -r -", poll_and_late_answer).out).size() == 1);
  CHECK(lines_of(run("can1 -r -", poll_and_late_answer).out).size() == 1);
  CHECK(lines_of(run("-r - --filter '100:700'", poll_and_late_answer).out).size() == 1);
  // An answer to an older POLL than the hidden one is late all the same.
  const std::string late = "(1.000000) can0 080#008F000000002A1F\n" + good_with_counter(17);
  CHECK(run("-r - --filter CELLS_1", late).out.find("!! late") != std::string::npos);
  CHECK(lines_of(run("-r - --filter CELLS_1", late).out).size() == 1);
}

TEST_CASE("times are told as candump's -t has them", "[integration][bmudump]") {
  const std::string log =
      "(1700000000.500000) can0 7FF#\n(1700000001.750000) can0 7FF#\n(1700000003.000000) can0 7FF#\n";
  const auto times = [&log](const std::string& form) {
    std::vector<std::string> starts;
    for (const std::string& line : lines_of(run("-r - " + form, log).out))
      starts.push_back(line.substr(0, line.find(" can0")));
    return starts;
  };
  using Times = std::vector<std::string>;
  CHECK(times("-t a") == Times{"(1700000000.500000)", "(1700000001.750000)", "(1700000003.000000)"});
  CHECK(times("-td") == Times{"(0.000000)", "(1.250000)", "(1.250000)"});
  CHECK(times("-tz") == Times{"(0.000000)", "(1.250000)", "(2.500000)"});
  ::setenv("TZ", "UTC", 1);  // NOLINT(concurrency-mt-unsafe): one thread
  CHECK(times("-tA").front() == "(2023-11-14 22:13:20.500000)");
  CHECK(run("-r - -t none", log).out.starts_with("can0 7FF"));
}

TEST_CASE("directions and letters are shown when asked for", "[integration][bmudump]") {
  const std::string log = "(1.000000) can0 7FF#41427F R\n(1.000000) can0 7FF#43 T\n(1.000000) can0 7FF#44\n";
  CHECK(run("-r - -x -a -t none", log).out ==
        "can0 RX 7FF unknown            [3] 41 42 7F  'AB.'\n"
        "can0 TX 7FF unknown            [1] 43  'C'\n"
        "can0  - 7FF unknown            [1] 44  'D'\n");
  const std::vector<std::string> lines = lines_of(run("-r - --json", log).out);  // there without -x, too
  REQUIRE(lines.size() == 3);
  CHECK(nlohmann::json::parse(lines[0]).at("direction") == "received");
  CHECK(nlohmann::json::parse(lines[1]).at("direction") == "sent");
  CHECK_FALSE(nlohmann::json::parse(lines[2]).contains("direction"));
}

TEST_CASE("a log goes into a file with -f, and into one with the date with -l", "[integration][bmudump]") {
  const TemporaryFolder folder;
  const std::string line = "(1.000000) can0 18FF50E5#0102 T\n";
  CHECK(run("-r - -f " + folder / "out.log", line).out.empty());
  CHECK(content_of(folder / "out.log") == line);
  const std::string log = folder.file("in.log", line);
  const std::string command = "cd " + (folder / ".") + " && " + bmudump + " -l -r " + log + " 2>err";
  REQUIRE(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  const std::string told = content_of(folder / "err");
  REQUIRE(told.starts_with("bmudump: writing candump-"));
  const std::string name = told.substr(told.find("candump-"), told.size() - told.find("candump-") - 1);
  CHECK(content_of(folder / name) == line);
  CHECK(run("-r - -f /nowhere/out.log", line).exit_code == 1);
}

TEST_CASE("a log that is read is not written over, by whatever name", "[integration][bmudump]") {
  const TemporaryFolder folder;
  const std::string line = "(1.000000) can0 18FF50E5#0102 T\n";
  const std::string log = folder.file("in.log", line);
  std::filesystem::create_symlink(log, folder / "link.log");
  std::filesystem::create_hard_link(log, folder / "hard.log");
  for (const char* name : {"in.log", "link.log", "hard.log"}) {
    CAPTURE(name);
    CHECK(run("-r " + log + " -f " + folder / name).exit_code == 1);
    CHECK(content_of(log) == line);
  }
  // A longer one that is not read is written anew.
  const std::string other = folder.file("other.log", line + line);
  CHECK(run("-r " + log + " -f " + other).exit_code == 0);
  CHECK(content_of(other) == line);
}

TEST_CASE("the summary has a line for each identifier, 29-bit ones too, and the same as JSON",
          "[integration][bmudump]") {
  const std::string log =
      "(1.000000) can0 143#8EA08E928EB22AB2\n(1.500000) can0 143#8EA08E928EB22AB3\n(2.000000) can0 18FF50E5#01\n"
      "(2.250000) can0 18FF50E5#01\n(3.250000) can0 18FF50E5#01\n(3.500000) can0 7FF#\n(3.750000) can0 "
      "20000040#0000000000000000\n";
  const Run text = run("-r - --summary", log);
  CHECK(text.out.find("143       CELLS_1 node 3                      2         1      2.00/s") != std::string::npos);
  CHECK(text.out.find("wrong crc 1\n") != std::string::npos);
  CHECK(text.out.find(
            "18FF50E5  unknown                             3         0      1.60/s    1.000000 s           3.250000") !=
        std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(run("-r - --summary --json", log).out);
  CHECK(json.at("bus") == "can0");
  CHECK(json.at("frames") == 7);
  CHECK(json.at("ok") == 1);
  CHECK(json.at("failed") == 1);
  CHECK(json.at("error_frames") == 1);
  REQUIRE(json.at("ids").size() == 3);
  CHECK(json.at("ids")[0].at("failed").at("wrong crc") == 1);
  CHECK(json.at("ids")[2].at("id") == "18FF50E5");
  CHECK(json.at("ids")[2].at("gap_max_s") == 1.0);
  CHECK(json.at("ids")[2].at("gap_end_s") == 3.25);
  std::int64_t bits = 0;
  for (const nlohmann::json& id : json.at("ids")) bits += id.at("bits").get<std::int64_t>();
  // All but the first frame in 2.75 s.
  CHECK(json.at("load_bit_per_s") == std::llround(static_cast<double>(bits - 112) / 2.75));
}

TEST_CASE("the summary says which identifier has fallen silent", "[integration][bmudump]") {
  std::string log;
  for (const char* time : {"0.400000", "0.500000", "0.600000", "0.700000"}) {  // too few to have a period
    log += "(" + std::string(time) + ") can0 7F4#\n";
  }
  for (const char* time : {"0.700000", "0.800000", "0.900000", "1.000000", "1.500000"}) {
    log += "(" + std::string(time) + ") can0 7F0#\n";
  }
  for (const char* time : {"1.700000", "1.800000", "2.000000", "2.100000", "2.400000"}) {
    log += "(" + std::string(time) + ") can0 7F1#\n(" + std::string(time) + ") can0 7F2#\n";
  }
  CHECK(run("-r - --summary", log).out.find("silent") == std::string::npos);
  log += "(2.500000) can0 7F2#\n";
  const std::string text = run("-r - --summary", log).out;
  const std::size_t silent = text.find("silent for the last 1.000000 s\n");
  REQUIRE(silent != std::string::npos);
  CHECK(text.find("7F0") < silent);
  CHECK(text.find("7F1") > silent);
  CHECK(text.find("silent", silent + 1) == std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(run("-r - --summary --json", log).out);
  REQUIRE(json.at("ids").size() == 4);
  CHECK(json.at("ids")[0].at("silent_s") == 1.0);
  CHECK(json.at("ids")[1].at("silent_s").is_null());
}

TEST_CASE("a bus that falls silent does so beside one that goes on, and frames that fail are no silence",
          "[integration][bmudump]") {
  std::string log;
  for (std::uint8_t i = 0; i < 5; ++i) {
    log += good_with_counter(i, 1'000'000 + 100'000 * i);
    log += "(1." + std::to_string(i) + "00000) can1 7F0#\n";
  }
  log += "(2.400000) can0 143#8EA08E928EB22AB3\n(2.400000) can0 7F1#\n";
  const std::string text = run("-r - --summary", log).out;
  CHECK(text.find("wrong crc 1, none passed for the last 1.000000 s\n") != std::string::npos);
  const std::size_t silent = text.find("silent for the last 1.000000 s\n");
  REQUIRE(silent != std::string::npos);
  CHECK(text.rfind("7F0", silent) != std::string::npos);
}

TEST_CASE("on a live bus silence lasts until the end of listening", "[integration][bmudump][bus]") {
  const TestBus bus("silence");
  auto port = open_bus(bus.name(), {});
  REQUIRE(port);
  const auto speak = [&port, &bus] {
    CanFrame frame;
    frame.id = 0x7F0;
    // Who listens later hears later.
    if (!has_participants(bus.name(), 2)) return;
    for (int i = 0; i < 60; ++i) {
      static_cast<void>((*port)->send(frame));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  };
  // A speaker that gets no processor has no period of which its silence would be a break.
  const std::string words = "silent for the last ";
  constexpr int listens_max = 5;
  Run result;
  for (int listens = 0; listens < listens_max && result.out.find(words) == std::string::npos; ++listens) {
    std::thread speaker(speak);
    result = run(bus.name() + " --summary -T 2000 --seconds 60");
    speaker.join();
  }
  CHECK(result.exit_code == 0);
  CHECK(seconds_after(result.out, words) >= 2.0);
}

TEST_CASE("Elithion's messages are read as such when 620h or 622h tell, and with --dialect", "[integration][bmudump]") {
  const std::string status = "(1.000000) can0 622#0A0E8D0A050001\n";
  const std::string name = "(1.000000) can0 620#456C697468696F6E\n";
  const std::string charge = "(1.000000) can0 626#48001C00640062\n";
  const std::string status_text =
      "can0 622 PACK_STATUS        k1_on yes  k3_on yes  uptime 3725 s  load_power yes  wired_request yes  "
      "stored_fault discharge overcurrent  warning_bits low voltage\n";
  const std::string charge_text =
      "can0 626 PACK_CHARGE        soc 72.0 %  depth_of_discharge 28.0000 Ah  capacity 100.0000 Ah  soh 98.0 %\n";
  const std::string options = "-r - -t none --brief ";
  for (const std::string& arguments : {options, options + "--dialect elithion"}) {
    const Run result = run(arguments, name + status + charge);
    CHECK(result.err.empty());
    CHECK(result.out.ends_with(status_text + charge_text));
  }
  CHECK(run(options + "--dialect elithion", status + charge).out == status_text + charge_text);
  // A length says how to read them, not that there is a pack: that another message says.
  CHECK(run(options, status + charge + status).out ==
        "can0 622 unknown            [7] 0A 0E 8D 0A 05 00 01\n" + charge_text + status_text);
  const std::vector<std::string> lines = lines_of(run("-r - --json --strict", name + charge + status).out);
  REQUIRE(lines.size() == 3);
  for (const std::string& line : lines) CHECK(nlohmann::json::parse(line).at("dialect") == "elithion");
  const nlohmann::json signals = nlohmann::json::parse(lines[2]).at("signals");
  CHECK(signals.size() == 17);
  CHECK(signals.at("fault_bits") == 0);
  CHECK(signals.at("warning_bits") == 1);
  CHECK(signals.at("stored_fault") == 5);
  CHECK(signals.at("k1_on") == 1);
  CHECK(run("-r - --summary", name + status).out.find("vehicle messages: 620h says \"Elithion\", dialect elithion\n") !=
        std::string::npos);
}

TEST_CASE("a pack that speaks another dialect than the one chosen is told, JSON says what it was read as",
          "[integration][bmudump]") {
  const std::string log = "(1.000000) can0 620#456C697468696F6E\n(1.000000) can0 622#0A0E8D0A000001\n";
  const Run result = run("-r - --summary --dialect iha", log);
  CHECK(result.exit_code == 0);
  CHECK(result.err ==
        "bmudump: can0: 620h says \"Elithion\": that is the dialect elithion, and it is read here as iha; do not "
        "believe what stands in 622h, 625h, 626h and 627h\n");
  CHECK(run("-r - --dialect elithion", "(1.000000) can0 620#49484120424D5331\n").err.find("read here as elithion") !=
        std::string::npos);
  const std::string iha = "(1.000000) can0 620#49484120424D5331\n(1.000000) can0 143#8EA08E928EB22AB2\n";
  CHECK(run("-r - --dialect iha", iha).err.empty());
  const std::vector<std::string> lines = lines_of(run("-r - --json", iha).out);
  REQUIRE(lines.size() == 2);
  CHECK(nlohmann::json::parse(lines[0]).at("dialect") == "iha");
  CHECK_FALSE(nlohmann::json::parse(lines[1]).contains("dialect"));
}

// --- foreign devices ------------------------------------------------------------------------------------------------

TEST_CASE("a device that was asked for is read on every bus, beside our own messages",
          "[integration][bmudump][devices]") {
  const std::string log =
      "(1.000000) can0 1806E5F4#03D400A000000000\n"
      "(1.000000) can0 143#8EA08E928EB22AB2\n"
      "(1.000000) can1 18FF50E5#0BC2006400000000\n";
  const Run result = run("-r - -t none --brief --strict --device elcon_tc", log);
  CHECK(result.exit_code == 0);
  CHECK(result.err.empty());
  CHECK(
      result.out ==
      "can0 1806E5F4 ELCON_COMMAND_E5  voltage_limit 98.000 V  current_limit 16.000 A  control charge  mode charging\n"
      "can0 143 CELLS_1 node 3     cell_voltage_1 3.6512 V  cell_voltage_2 3.6498 V  cell_voltage_3 3.6530 V\n"
      "can1 18FF50E5 ELCON_STATUS_E5  output_voltage 301.000 V  output_current 10.000 A  possible_temperature not "
      "fitted\n");
  CHECK(run("-r - --strict", log).exit_code == 4);
  CHECK(lines_of(run("-r - --device elcon_tc --filter 'ELCON_*'", log).out).size() == 2);
  CHECK(lines_of(run("-r - --device elcon_tc --filter ELCON_STATUS_E5", log).out).size() == 1);
  const std::vector<std::string> lines = lines_of(run("-r - --device elcon_tc --json", log).out);
  REQUIRE(lines.size() == 3);
  const nlohmann::json command = nlohmann::json::parse(lines[0]);
  CHECK(command.at("id") == "1806E5F4");
  CHECK(command.at("message") == "ELCON_COMMAND_E5");
  CHECK(command.at("ok") == true);
  CHECK(command.at("signals").at("voltage_limit_mV") == 98'000);
}

TEST_CASE("a frame of a device that fails its check is told as one of ours is", "[integration][bmudump][devices]") {
  const std::string log = "(1.000000) can0 1806E5F4#03D4\n(1.000000) can0 080#C20F00500800E0FE\n";
  CHECK(run("-r - -t none --device can0=elcon_tc,can0=i3_csc", log).out ==
        "can0 1806E5F4 ELCON_COMMAND_E5  !! wrong length  [2] 03 D4\n"
        "can0 080 CSC_COMMAND number 0  !! wrong crc  [8] C2 0F 00 50 08 00 E0 FE\n");
}

TEST_CASE("without a bus a device's message is shown only where length and ranges fit, else the frame stays unknown",
          "[integration][bmudump][devices]") {
  const std::string log =
      "(1.000000) can0 18FF50E5#0BC2006400000000\n"  // 301 V, 10 A
      "(1.000000) can0 18FF50E5#3A99FFFF00000000\n"  // 1,500.1 V and 6,553.5 A
      "(1.000000) can0 1806E5F4#03D4\n"              // too short
      "(1.000000) can0 3C2#800186A0C8CAB516\n"       // 100 A
      "(1.000000) can0 3C2#0012345600000000\n"       // -2,146 A and nothing that marks it
      "(1.000000) can0 411#0012000000000000\n"       // no command that there is
      "(1.000000) can0 411#3400010000000000\n";      // stop
  const std::string words = "elcon_tc,lem_cab,ivt_s";
  const std::string unknown = run("-r - -t none --brief --device " + words, log).out;
  CHECK(unknown ==
        "can0 18FF50E5 ELCON_STATUS_E5  output_voltage 301.000 V  output_current 10.000 A  possible_temperature not "
        "fitted\n"
        "can0 18FF50E5 unknown       [8] 3A 99 FF FF 00 00 00 00\n"
        "can0 1806E5F4 unknown       [2] 03 D4\n"
        "can0 3C2 LEM_CURRENT        sensor_current 100.000 A  error_information none\n"
        "can0 3C2 unknown            [8] 00 12 34 56 00 00 00 00\n"
        "can0 411 unknown            [8] 00 12 00 00 00 00 00 00\n"
        "can0 411 IVT_COMMAND        command set mode  mode stop  mode_at_start run  code_level 0\n");
  const std::vector<std::string> lines = lines_of(run("-r - --json --device " + words, log).out);
  REQUIRE(lines.size() == 7);
  CHECK(nlohmann::json::parse(lines[1]).at("message").is_null());
  CHECK(nlohmann::json::parse(run("-r - --summary --json --device " + words, log).out).at("unknown") == 4);
  // On a bus that was named for it every frame is the device's.
  const std::string named = run("-r - -t none --device can0=elcon_tc,can0=lem_cab,can0=ivt_s", log).out;
  CHECK(named.find("unknown            ") == std::string::npos);
  CHECK(named.find("ELCON_STATUS_E5  output_voltage out of range") != std::string::npos);
  CHECK(named.find("ELCON_COMMAND_E5  !! wrong length  [2] 03 D4") != std::string::npos);
  CHECK(named.find("3C2 LEM_CURRENT        sensor_current out of range") != std::string::npos);
}

TEST_CASE("a checksum that fails is a device's only where others of the identifier have passed",
          "[integration][bmudump][devices]") {
  const std::string good = "(1.000000) can0 123#D88FDB8FDB8FA088\n";
  const std::string bad = "(1.000000) can0 123#D88FDB8FDB8FB088\n";
  CHECK(run("-r - -t none --device i3_csc", bad).out == "can0 123 unknown            [8] D8 8F DB 8F DB 8F B0 88\n");
  CHECK(lines_of(run("-r - -t none --device i3_csc", good + bad).out).back() ==
        "can0 123 CSC_CELLS_1 number 3  !! wrong crc  [8] D8 8F DB 8F DB 8F B0 88");
}

TEST_CASE("what cars have under the traction pack's identifiers stays unknown until a pack names itself",
          "[integration][bmudump][devices]") {
  // Of other lengths, as 622h to 628h of cars are, and a state that there is none of.
  const std::string car =
      "(1.000000) can0 622#0102030405060708\n(1.000000) can0 624#0055002800C80000\n(1.000000) can0 626#48001C\n"
      "(1.000000) can0 622#7F0E8D040000\n";
  for (const std::string& line : lines_of(run("-r - -t none", car).out)) {
    CHECK(line.find(" unknown            [") != std::string::npos);
  }
  const std::string pack = "(1.000000) can0 620#49484120424D5331\n";
  CHECK(run("-r - -t none", pack + car).out.find("can0 624 PACK_CURRENT       !! wrong length  [8]") !=
        std::string::npos);
  CHECK(run("-r - -t none --device can0=vehicle", car).out.find("unknown") == std::string::npos);
  CHECK(run("-r - -t none --dialect iha", car).out.find("unknown") == std::string::npos);
  CHECK(
      run("-r - -t none", "(1.000000) can0 624#0055002800C8\n").out.find("PACK_CURRENT       pack_current 85.000 A") !=
      std::string::npos);
}

TEST_CASE("neither a 622h of seven bytes nor a 620h without text is a traction pack's",
          "[integration][bmudump][devices]") {
  const std::string length =
      "(1.000000) can0 622#01020304050607\n(1.000000) can0 624#0102030405060708\n(1.000000) can0 626#0102030405\n";
  const std::string name =
      "(1.000000) can0 620#0102030405060708\n(1.000000) can0 622#0102030405060708\n(1.000000) can0 "
      "620#3000000000000000\n"
      "(1.000000) can0 622#0102030405060708\n";
  for (const std::string& log : {length, name}) {
    for (const std::string& line : lines_of(run("-r - -t none", log).out)) {
      CHECK(line.find(" unknown            [") != std::string::npos);
    }
    for (const std::string& line : lines_of(run("-r - --json", log).out)) {
      const nlohmann::json frame = nlohmann::json::parse(line);
      CHECK(frame.at("message").is_null());
      CHECK_FALSE(frame.contains("dialect"));
    }
    for (const char* words : {"--summary", "--follow"}) {
      const std::string table = run("-r - " + std::string(words), log).out;
      CAPTURE(table);
      CHECK(table.find("unknown") != std::string::npos);
      CHECK(table.find("PACK_") == std::string::npos);
      CHECK(table.find("vehicle messages") == std::string::npos);
    }
    CHECK(nlohmann::json::parse(run("-r - --summary --json", log).out).at("dialect").is_null());
    // A torn line has no whole message of a pack either.
    CHECK(run("-r -", log + "(1.000000) can0 624#7FFF00280030").exit_code == 3);
  }
  // Our own pack, from the middle of its round: without its name what has nothing to show stays unknown at first.
  const std::string own =
      "(1.000000) can0 625#0012D687000F4240\n(1.000000) can0 626#48001C00640062\n(1.000000) can0 "
      "625#0012D687000F4240\n";
  const std::vector<std::string> lines = lines_of(run("-r - -t none", own).out);
  REQUIRE(lines.size() == 3);
  CHECK(lines[0] == "can0 625 unknown            [8] 00 12 D6 87 00 0F 42 40");
  CHECK(lines[1].starts_with("can0 626 PACK_CHARGE        soc 72.0 %"));
  CHECK(lines[2].starts_with("can0 625 PACK_ENERGY        energy_in 1234.567 kWh"));
  CHECK(run("-r - --summary", own).out.find("unknown 1") != std::string::npos);
  for (const char* words : {"--device can0=vehicle", "--dialect iha"}) {
    CHECK(run("-r - -t none " + std::string(words), own).out.find("unknown") == std::string::npos);
  }
}

TEST_CASE("what nothing can contradict is a device's once another of its frames has shown that it is there",
          "[integration][bmudump][devices]") {
  const std::string type = "(1.000000) can0 1D0#DEADBEEF12345678\n";
  const std::string cells = "(1.000000) can0 123#D88FDB8FDB8FA088\n";
  const auto first_words = [](const std::string& arguments, const std::string& log) {
    std::string words;
    for (const std::string& line : lines_of(run("-r - -t none --device " + arguments, log).out)) {
      words += line.substr(5, line.find(' ', 9) - 5) + ",";
    }
    return words;
  };
  const Run alone = run("-r - -t none --device i3_csc", type + "(1.000000) can0 0F0#DEADBEEF12345678\n");
  CHECK(alone.out ==
        "can0 1D0 unknown            [8] DE AD BE EF 12 34 56 78\n"
        "can0 0F0 unknown            [8] DE AD BE EF 12 34 56 78\n");
  CHECK(alone.err ==
        "bmudump: can0: 2 frames that could be of i3_csc left unknown, as nothing but identifiers says so; if this is "
        "its bus: --device can0=i3_csc,can0=internal,can0=vehicle\n");
  CHECK(run("-r - --device can0=i3_csc", type).err.empty());
  CHECK(run("-r - --device i3_csc", type + cells).err.empty());
  CHECK(run("-r - --log --device i3_csc", type).err.empty());
  CHECK(first_words("i3_csc", type + cells + type) == "1D0 unknown,123 CSC_CELLS_1,1D0 CSC_TYPE_3,");
  CHECK(first_words("any=i3_csc", type + cells + type) == "1D0 unknown,123 CSC_CELLS_1,1D0 CSC_TYPE_3,");
  CHECK(first_words("can0=i3_csc", type) == "1D0 CSC_TYPE_3,");
  // Of another bus, and of another device, it says nothing.
  const std::string other_bus = "(1.000000) can1 123#D88FDB8FDB8FA088\n";
  CHECK(first_words("i3_csc", other_bus + type) == "123 CSC_CELLS_1,1D0 unknown,");
  CHECK(
      first_words("i3_csc,elcon_tc", "(1.000000) can0 18FF50E5#0BC2006400000000\n" + type).ends_with(",1D0 unknown,"));
  // A sensor's results are of the internal bus, and show the sensor.
  CHECK(first_words("ivt_s", "(1.000000) can0 521#000200003039\n(1.000000) can0 510#DEADBEEF12345678\n") ==
        "521 SENSOR_CURRENT,510 IVT_DEBUG,");
}

TEST_CASE("what cars have under the identifiers of the internal bus stays unknown", "[integration][bmudump][devices]") {
  const std::string car =
      "(1.000000) can0 080#0000000000000000\n(1.000000) can0 040#1122334455667788\n"
      "(1.000000) can0 042#1122\n(1.000000) can0 103#DEADBEEF12345678\n"
      "(1.000000) can0 521#0012345678AB\n(1.000000) can0 521#00123456789A0000\n"
      "(1.000000) can0 527#061234567890\n(1.000000) can0 531#001234567890\n"
      "(1.000000) can0 355#0000000000000000\n(1.000000) can0 356#0000000000000000\n"
      "(1.000000) can0 359#0000000000000000\n(1.000000) can0 35C#0000000000000000\n"
      "(1.000000) can0 372#0000000000000000\n(1.000000) can0 1D0#0000000000000000\n"
      "(1.000000) can0 522#000000000000\n(1.000000) can0 624#000000000000\n"
      "(1.000000) can0 622#000000000000\n";
  for (const char* words : {"", " --device any=internal,any=vehicle"}) {
    CAPTURE(words);
    for (const std::string& line : lines_of(run("-r - -t none" + std::string(words), car).out)) {
      CAPTURE(line);
      CHECK(line.find(" unknown            [") != std::string::npos);
    }
    for (const std::string& line : lines_of(run("-r - --json" + std::string(words), car).out)) {
      CHECK(nlohmann::json::parse(line).at("message").is_null());
    }
    CHECK(nlohmann::json::parse(run("-r - --summary --json" + std::string(words), car).out).at("unknown") == 17);
    const std::string table = run("-r - --follow" + std::string(words), car).out;
    CAPTURE(table);
    for (const char* name : {"COMMAND", "CELLS_", "POLL", "STATUS", "SENSOR_", "PACK_"}) {
      CHECK(table.find(name) == std::string::npos);
    }
  }
  // Where the bus is declared all of it is what its identifiers say.
  const std::string declared = run("-r - -t none --device can0=internal,can0=vehicle", car).out;
  CHECK(declared.find("unknown") == std::string::npos);
  CHECK(declared.find("can0 1D0 CELLS_3 node 16    !! wrong crc") != std::string::npos);
  CHECK(declared.find("can0 521 SENSOR_CURRENT     !! wrong length") != std::string::npos);
}

TEST_CASE("a seal of the internal bus shows it, and what is damaged there is damage", "[integration][bmudump]") {
  const std::string bad = "(1.000000) can0 143#8EA08E928EB22AB3\n";
  const std::string cut = "(1.000000) can0 143#8EA0\n";
  const std::string good = "(1.000000) can0 143#8EA08E928EB22AB2\n";
  const auto first_words = [](const std::string& log) {
    std::string words;
    for (const std::string& line : lines_of(run("-r - -t none", log).out)) words += line.substr(9, 21) + "|";
    return words;
  };
  CHECK(first_words(bad) == "unknown            [8|");
  CHECK(first_words(bad + good + bad + cut) ==
        "unknown            [8|CELLS_1 node 3     ce|CELLS_1 node 3     !!|CELLS_1 node 3     !!|");
  // Of this bus, not of another.
  CHECK(first_words("(1.000000) can1 143#8EA08E928EB22AB2\n" + bad) == "CELLS_1 node 3     ce|unknown            [8|");
  // A right seal among many wrong ones may be chance.
  CHECK(first_words(bad + bad + good).ends_with("|unknown            [8|"));
  // The sensor has no seal: what fits is shown before one, and all of it behind one.
  const std::string zero = "(1.000000) can0 521#000000000000\n";
  const std::string result = "(1.000000) can0 521#000200003039\n";
  const std::string other = "(1.000000) can0 521#010300003039\n";
  CHECK(first_words(zero + result + "(1.000000) can0 523#020000000000\n") ==
        "unknown            [6|SENSOR_CURRENT     pa|SENSOR_U2          li|");
  CHECK(first_words(result + other) == "SENSOR_CURRENT     pa|unknown            [6|");
  CHECK(first_words(good + zero + other) == "CELLS_1 node 3     ce|SENSOR_CURRENT     pa|SENSOR_CURRENT     !!|");
}

TEST_CASE("any names no bus, and declares none", "[integration][bmudump][devices]") {
  const std::string car =
      "(1.000000) can0 356#10270000003E0000\n"  // 1587.2 C
      "(1.000000) can0 372#FFFF000000000000\n"
      "(1.000000) can0 35A#FFFFFFFFFFFFFFFF\n"
      "(1.000000) can0 622#0102030405060708\n"
      "(1.000000) can0 625#0102030405060708\n";
  const std::string options = "-r - -t none --device ";
  for (const char* words : {"any=victron,any=vehicle", "any=sma,any=vehicle"}) {
    for (const std::string& line : lines_of(run(options + words, car).out)) {
      CAPTURE(line);
      CHECK(line.find(" unknown            [") != std::string::npos);
    }
  }
  const std::string declared = run(options + "can0=victron,can0=vehicle", car).out;
  CHECK(declared.find("unknown  ") == std::string::npos);
  CHECK(declared.find("battery_temperature 1587.2 C") != std::string::npos);
  CHECK(declared.find("module_count 65535") != std::string::npos);
  // A pack that says its name declares itself, there as well.
  CHECK(run(options + "any=sma,any=vehicle", "(1.000000) can0 620#49484120424D5331\n" + car)
            .out.find("622 PACK_STATUS        !! wrong length") != std::string::npos);
}

TEST_CASE("on a bus that is named for a device nothing else is read", "[integration][bmudump][devices]") {
  const std::string log =
      "(1.000000) can0 080#008F000000002A1F\n"
      "(1.000000) can1 080#C20F00500800E0FF\n"
      "(1.000000) can1 143#DC8FDE8FDC8FA0F0\n"
      "(1.000000) can1 620#49484120424D5331\n";
  const Run result = run("-r - -t none --brief --device can1=i3_csc", log);
  CHECK(
      result.out ==
      "can0 080 POLL               target_node 0  sync yes  want_module yes  want_temp yes  want_cells yes  "
      "want_status yes\n"
      "can1 080 CSC_COMMAND number 0  target_voltage 4.0340 V  want_temperatures yes  want_voltages yes  mode balance  "
      "start_code 0\n"
      "can1 143 CSC_CELLS_3 number 3  cell_voltage_7 4.0600 V  cell_voltage_8 4.0620 V  cell_voltage_9 4.0600 V  "
      "flags_7 module balances  flags_8 module balances  flags_9 module balances\n"
      "can1 620 unknown            [8] 49 48 41 20 42 4D 53 31\n");
}

TEST_CASE("modules of another maker are read in the place of ours, beside the unit, the sensor and the vehicle",
          "[integration][bmudump][devices]") {
  const std::string log =
      "(1.000000) can0 080#C20F00500800E0FF\n"
      "(1.000000) can0 143#DC8FDE8FDC8FA0F0\n"
      "(1.000000) can0 343#0000000000000000\n"
      "(1.000000) can0 624#0055002800C8\n" +
      lines_of(content_of(fixture))[0] + "\n";
  for (const char* words : {"i3_csc", "any=i3_csc,any=internal,any=vehicle"}) {
    const Run result = run("-r - -t none --brief --device " + std::string(words), log);
    CAPTURE(words, result.out, result.err);
    CHECK(result.exit_code == 0);
    CHECK(result.out.find("can0 080 CSC_COMMAND number 0  target_voltage 4.0340 V") != std::string::npos);
    CHECK(result.out.find("can0 143 CSC_CELLS_3 number 3  cell_voltage_7 4.0600 V") != std::string::npos);
    CHECK(result.out.find("can0 343 unknown ") != std::string::npos);
    CHECK(result.out.find("can0 624 PACK_CURRENT ") != std::string::npos);
  }
  std::string all = content_of(fixture);
  const Run ours = run("-r - -t none", all);
  const Run theirs = run("-r - -t none --device i3_csc", all);
  for (const std::string& line : lines_of(ours.out)) {
    const bool is_of_unit_or_sensor = line.find(" CONTACTOR_COMMAND ") != std::string::npos ||
                                      line.find(" PDU_STATUS ") != std::string::npos ||
                                      line.find(" SENSOR_") != std::string::npos;
    if (is_of_unit_or_sensor) CHECK(theirs.out.find(line + "\n") != std::string::npos);
  }
}

TEST_CASE("tables are printed of whatever is named, and of nothing else", "[integration][bmudump][devices]") {
  for (const char* words : {"sma", "can1=sma", "victron", "pylontech", "outlander_cmu", "i3_csc", "sma,victron"}) {
    const Run result = run("--protocol-doc --device " + std::string(words));
    CAPTURE(words, result.err);
    CHECK(result.exit_code == 0);
    CHECK(result.out.starts_with("### "));
    CHECK(result.out.find("of the internal bus") == std::string::npos);
  }
  CHECK(run("--protocol-doc --device can1=vehicle,can1=sma").out.starts_with("### Messages of the vehicle bus\n"));
  CHECK(run("--protocol-doc --device ivt_s").out.find("u32 LE") == std::string::npos);
  CHECK(run("--protocol-doc --device ivt_s --sensor-little-endian").out.find("s32 LE") != std::string::npos);
}

TEST_CASE("what numbers a maker's modules have is said where they are told", "[integration][bmudump][devices]") {
  const std::string note = "number n is node n + 1 of a pack file and of bmuctl";
  CHECK(run("--protocol-doc --device i3_csc").out.find(note) != std::string::npos);
  CHECK(run("--protocol-doc --device outlander_cmu").out.find(note) == std::string::npos);
  CHECK(run("--devices").out.find(note) != std::string::npos);
}

TEST_CASE("the nodes of a device's DBC are counted as in a pack file", "[integration][bmudump][devices]") {
  const std::string third = run("--dbc i3_csc --nodes 3").out;
  CHECK(third.find("BO_ 258 CSC_STATUS_N02: ") != std::string::npos);
  CHECK(third.find("CSC_STATUS_N00") == std::string::npos);
  CHECK(run("--dbc i3_csc").out == run("--dbc i3_csc --nodes 1-8").out);
  CHECK(run("--dbc outlander_cmu").out == run("--dbc outlander_cmu --nodes 1-11").out);
  CHECK(run("--dbc sma").exit_code == 0);
}

TEST_CASE("a bus with frames that nothing explains is told whose they could be", "[integration][bmudump][devices]") {
  const std::string cells =
      "(1.000000) can0 621#0000000000000000\n"
      "(1.000000) can0 622#0F100F100F100F10\n"
      "(1.000000) can0 623#0F100F100F100F10\n"
      "(1.000000) can0 612#0F100F100F100F10\n"
      "(1.000000) can0 613#0F100F100F100F10\n";
  const Run result = run("-r -", cells);
  CAPTURE(result.err);
  CHECK(result.exit_code == 0);
  const std::string words = "--device can0=outlander_cmu,can0=internal";
  CHECK(result.err ==
        "bmudump: can0: 5 of 5 identifiers that are not explained here could be read with " + words + "\n");
  CHECK(run("-r - " + words, cells).err.empty());
  CHECK(run("-r - --log", cells).err.empty());
  CHECK(run("-r - --filter 612", cells).err.empty());  // too few to tell
  CHECK(run("-r -", "(1.000000) can0 1806E5F4#03D400A000000000\n").err.find(" read with --device elcon_tc\n") !=
        std::string::npos);
  CHECK(run("-r - --device elcon_tc", "(1.000000) can0 1806E5F4#03D400A000000000\n").err.empty());
  // Frames of ours that are damaged now and then are ours.
  const std::string damaged =
      "(1700000000.000000) vcan0 080#C7100000200010E8\n(1700000000.000000) vcan0 103#00000000FF0FB031\n"
      "(1700000000.000000) vcan0 143#DC8FDE8FDC8FA0F0\n";
  CHECK(run("-r -", damaged).err.find("--device i3_csc") != std::string::npos);
  CHECK(run("-r -", damaged + content_of(fixture)).err.empty());
  // A car that has these identifiers, and other things behind them: no checksum, and numbers that no cell has.
  CHECK(run("-r -",
            "(1.000000) vcan0 080#0000000000000000\n(1.000000) vcan0 103#0000000000000000\n"
            "(1.000000) vcan0 143#0000000000000000\n(1.000000) vcan0 173#0000000000000000\n")
            .err.empty());
  CHECK(run("-r -",
            "(1.000000) can0 631#20000000FFFFFFFF\n(1.000000) can0 632#A0B1C2D3E4F50617\n"
            "(1.000000) can0 633#A0B1C2D3E4F50617\n(1.000000) can0 634#A0B1C2D3E4F50617\n")
            .err.empty());
  // Nothing but identifiers and lengths.
  CHECK(run("-r -",
            "(1.000000) can0 35A#DEADBEEF12345678\n(1.000000) can0 35F#DEADBEEF12345678\n"
            "(1.000000) can0 372#DEADBEEF12345678\n(1.000000) can0 35C#DEADBEEF12345678\n")
            .err.empty());
  // Others have most of what is there.
  CHECK(run("-r -", cells + "(1.000000) can0 700#\n(1.000000) can0 701#\n(1.000000) can0 702#\n(1.000000) can0 "
                            "703#\n(1.000000) can0 704#\n")
            .err.empty());
}

TEST_CASE("bytes that are no text are no name of a product", "[integration][bmudump]") {
  // The temperatures of an Outlander's module 2: as text "0BCBBB".
  const std::string log = "(1.000000) can0 621#00304243424242FF\n";
  CHECK(run("-r - -t none --device can0=vehicle", log).out ==
        "can0 621 PACK_VERSION       version no text: 00 30 42 43 42 42 42 FF\n");
  CHECK(run("-r - --json --device can0=vehicle", log).out.find("\"version\":null") != std::string::npos);
  CHECK(run("-r - -t none", log).out == "can0 621 unknown            [8] 00 30 42 43 42 42 42 FF\n");
  CHECK(run("-r - -t none", "(1.000000) can0 621#302E310000000000\n").out.find("version \"0.1\\u0000") !=
        std::string::npos);
}

TEST_CASE("a device may share a bus with the vehicle messages", "[integration][bmudump][devices]") {
  const std::string log = "(1.000000) can1 351#3002F401E803C001\n(1.000000) can1 624#0055002800C8\n";
  CHECK(run("-r - -t none --strict --device can1=vehicle,can1=sma", log).out ==
        "can1 351 SMA_LIMITS         charge_voltage_limit 56.000 V  charge_current_limit 50.000 A  "
        "discharge_current_limit 100.000 A  discharge_voltage_limit 44.800 V\n"
        "can1 624 PACK_CURRENT       pack_current 85.000 A  charge_limit 40.000 A  discharge_limit 200.000 A\n");
}

TEST_CASE("who has an identifier in common is not read together, and is told what to do",
          "[integration][bmudump][devices]") {
  const auto complaint = [](const std::string& arguments) {
    const Run result = run("-r - " + arguments);
    CHECK(result.exit_code == 2);
    return result.err;
  };
  CHECK(complaint("--device outlander_cmu") ==
        "bmudump: --device: outlander_cmu and the vehicle messages both have identifier 621; name its bus, and what "
        "else is read there: --device BUS=outlander_cmu,BUS=internal\n");
  CHECK(run("-r - --device any=outlander_cmu,any=internal").exit_code == 0);
  CHECK(complaint("--device sma").find(": --device BUS=sma,BUS=vehicle\n") != std::string::npos);
  CHECK(run("-r - --device any=sma,any=vehicle").exit_code == 0);
  const Run live = run("no-such-can --device outlander_cmu");
  CHECK(live.err.find(": --device no-such-can=outlander_cmu,no-such-can=internal\n") != std::string::npos);
  CHECK(
      complaint("--device can1=sma,can1=victron") ==
      "bmudump: --device: victron and sma both have identifier 351 on can1; leave one of them out, or give it another "
      "bus\n");
  // The same row is no other message: the sensor's results, and the current sensor of a car.
  CHECK(run("-r - --device ivt_s").exit_code == 0);
  CHECK(run("-r - --device ivt_s --sensor-little-endian").exit_code == 0);
  CHECK(run("-r - --device any=outlander_cmu,any=lem_cab").exit_code == 0);
}

TEST_CASE("the bus that is named in advice is one of the log", "[integration][bmudump][devices]") {
  const TemporaryFolder folder;
  const std::string internal = "(1.000000) can3 143#8EA08E928EB22AB2\n";
  const std::string sma = "(1.000000) can7 351#3002F401E803C001\n";
  const std::string log = folder.file("drive.log", "# nothing\nno line of a log\n" + internal + sma);
  const std::string other = folder.file("other.log", internal);
  const std::string screen = folder.file("screen.txt", "  can5  351   [8]  30 02 F4 01 E8 03 C0 01");
  const std::string empty = folder.file("empty.log", "");
  const auto advice = [](const std::string& arguments) {
    const Run result = run(arguments + " --device sma");
    CHECK(result.exit_code == 2);
    const std::string before = "what else is read there: --device ";
    const std::size_t at = result.err.find(before);
    return at == std::string::npos ? result.err : result.err.substr(at + before.size());
  };
  CHECK(advice("-r " + log) == "can7=sma,can7=vehicle\n");
  CHECK(advice("-r " + other) == "can3=sma,can3=vehicle\n");
  CHECK(advice("-r " + other + " " + log) == "can7=sma,can7=vehicle\n");
  CHECK(advice("-r " + screen) == "can5=sma,can5=vehicle\n");
  CHECK(advice("can9 -r " + log) == "can9=sma,can9=vehicle\n");
  CHECK(advice("any -r " + log) == "can7=sma,can7=vehicle\n");
  CHECK(advice("any") == "BUS=sma,BUS=vehicle\n");
  CHECK(advice("-r " + empty + " no-such-file.log") == "BUS=sma,BUS=vehicle\n");
  CHECK(run("-r " + log + " -t none --device can7=sma,can7=vehicle").out.find("can7 351 SMA_LIMITS") !=
        std::string::npos);
}

TEST_CASE("the results of a sensor are read in the order of bytes that was asked for",
          "[integration][bmudump][devices]") {
  const std::string options = "-r - -t none --brief --device ivt_s ";
  CHECK(run(options, "(1.000000) can0 524#030200003039\n").out.find("voltage_3 12.345 V") != std::string::npos);
  CHECK(run(options + "--sensor-little-endian", "(1.000000) can0 524#030239300000\n").out.find("voltage_3 12.345 V") !=
        std::string::npos);
}

TEST_CASE("all devices are listed, and each has a DBC and tables", "[integration][bmudump][devices]") {
  const Run list = run("--devices");
  CHECK(list.exit_code == 0);
  for (const Device* device : all_devices()) {
    const std::string name(device->name);
    INFO(name);
    CHECK(list.out.find(name + " ") != std::string::npos);
    CHECK(list.out.find(device->title) != std::string::npos);
    const Run dbc = run("--dbc " + name);
    CHECK(dbc.exit_code == 0);
    CHECK(dbc.out.find("CM_ \"bmud " + name + " bus") != std::string::npos);
    CHECK(run("--protocol-doc --device any=" + name).out.find("### " + std::string(device->title)) !=
          std::string::npos);
  }
  const std::string chargers = run("--dbc charger").out;
  CHECK(chargers.find("BO_ 2550588916 ELCON_COMMAND_E5: 8 BMU\n") != std::string::npos);
  CHECK(chargers.find("BO_ 1560 BRUSA_CONTROL: 7 BMU\n") != std::string::npos);
  CHECK(chargers.find("SMA_") == std::string::npos);
}

TEST_CASE("packed logs are read by what they are, from files and from standard input", "[integration][bmudump]") {
  const TemporaryFolder folder;
  const std::string packed = folder / "not-named-so";
  const std::string command =
      "zstd -q " + fixture + " -o " + packed + " && zstd -q -c " + folder.file("more", good_line) + " >>" + packed;
  REQUIRE(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  const std::string expected = content_of(test::in_source("tests/integration/bmudump_worked_frames.txt"));
  const Run result = run("-r " + packed);
  CHECK(result.exit_code == 0);
  CHECK(result.out.starts_with(expected));
  CHECK(lines_of(result.out).size() == lines_of(expected).size() + 1);
  CHECK(run("-r -", content_of(packed)).out == result.out);
}

TEST_CASE("a packed log that is cut off is read to there, and the place is named", "[integration][bmudump]") {
  const TemporaryFolder folder;
  const std::string command = "zstd -q " + fixture + " -o " + folder / "whole";
  REQUIRE(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  const std::string whole = content_of(folder / "whole");
  const std::string cut = folder.file("cut", whole.substr(0, whole.size() - 1));
  const Run result = run("-r " + cut);
  CHECK(result.exit_code == 3);
  CHECK(lines_of(result.out).size() == 26);
  CHECK(result.err == "bmudump: " + cut + ": bytes 0 to " + std::to_string(whole.size() - 1) + ", behind line " +
                          std::to_string(lines_of(content_of(fixture)).size()) +
                          ": this zstd frame has no end; skipped\n");
  const std::string more = folder.file("more", whole + "garbage");
  CHECK(run("-r " + more)
            .err.find(": bytes " + std::to_string(whole.size()) + " to " + std::to_string(whole.size() + 7) + ", ") !=
        std::string::npos);
}

TEST_CASE("a log packed with gzip is read as far as it is good, xz and bzip2 are named", "[integration][bmudump]") {
  const TemporaryFolder folder;
  const std::string command = "gzip -c " + fixture + " >" + folder / "whole";
  REQUIRE(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): our own words
  const std::string whole = content_of(folder / "whole");
  const std::string expected = content_of(test::in_source("tests/integration/bmudump_worked_frames.txt"));
  CHECK(run("-r " + folder / "whole").out == expected);
  CHECK(run("-r -", whole).out == expected);
  const std::string cut = folder.file("cut", whole.substr(0, whole.size() - 1));
  const Run result = run("-r " + cut);
  CHECK(result.exit_code == 3);
  CHECK(result.out == expected);
  CHECK(result.err == "bmudump: " + cut + ": bytes 0 to " + std::to_string(whole.size() - 1) + ", behind line " +
                          std::to_string(lines_of(content_of(fixture)).size()) +
                          ": this gzip stream has no end; skipped\n");
  const Run bzip2 = run("-r -", "BZh91AY&SY");
  CHECK(bzip2.exit_code == 3);
  CHECK(bzip2.err ==
        "bmudump: standard input: bytes 0 to 10, behind line 0: this is packed with bzip2, which is not read here; "
        "unpack it with bzip2 -d; skipped\n");
}

TEST_CASE("lines of a recording that are not frames are comments", "[integration][bmudump]") {
  const Run result = run("-r -",
                         "# bmud recording\n(1.000000) can0 7FF#01 R\n# (1.000000) tick 5d1f\n# > can0 040#\n"
                         "(1.000000) can0 7FF#02 T\n");
  CHECK(result.exit_code == 0);
  CHECK(result.err.empty());
  CHECK(lines_of(result.out).size() == 2);
}

TEST_CASE("followed without a terminal, the last state of all is printed at the end", "[integration][bmudump]") {
  const Run result = run("-r " + fixture + " --follow");
  CHECK(result.exit_code == 0);
  CHECK(result.err.empty());
  CHECK(result.out.find('\x1b') == std::string::npos);
  const std::vector<std::string> lines = lines_of(result.out);
  REQUIRE(lines.size() == 2 + 1 + 22);
  CHECK(lines[0] == "vcan0   14 frames   406/s   load 9.6 % of 500 kbit/s");
  CHECK(lines[2].starts_with("bus   id  message "));
  CHECK(lines[8].starts_with("vcan0 143 CELLS_1 node 3 "));
  CHECK(lines.back().starts_with("vcan1 628 PACK_RESISTANCE "));
  CHECK(lines[8].ends_with("  cell_voltage_1 3.6512 V  _2 3.6498  _3 3.6530"));
}

TEST_CASE("brief leaves out what is not set", "[integration][bmudump]") {
  const Run result = run("-r " + fixture + " --brief --filter STATUS");
  CHECK(result.out ==
        "(1700000000.001000) vcan0 103 STATUS node 3      mode normal  supply external  balancing yes  cell_count 12  "
        "overvoltage_cells 5  cell_voltage_age 12 ms\n");
}

TEST_CASE("colours come only when asked for", "[integration][bmudump]") {
  CHECK(run("-r " + fixture).out.find('\x1b') == std::string::npos);
  CHECK(run("-r " + fixture + " --color never").out.find('\x1b') == std::string::npos);
  CHECK(run("-r " + fixture + " --color always").out.find("\x1b[1mCELLS_1 node 3") != std::string::npos);
}

TEST_CASE("vehicle messages can have another base, sensors another byte order", "[integration][bmudump]") {
  CHECK(run("-r - --vehicle-base 6A0 --json", "(1.000000) can0 6A3#013C20072217\n").out.find("PACK_VOLTAGE") !=
        std::string::npos);
  const std::string sensor = "(1.000000) can0 521#0000C01DFEFF\n";
  CHECK(run("-r - --sensor-little-endian", sensor).out.find("pack_current -123.456 A") != std::string::npos);
}

TEST_CASE("as a log, what was read comes out again", "[integration][bmudump]") {
  const Run result = run("-r " + fixture + " --log");
  std::string frames;
  for (const std::string& line : lines_of(content_of(fixture))) {
    if (line.front() == '(') frames += line + "\n";
  }
  CHECK(result.out == frames);
}

TEST_CASE("CAN FD, CAN XL and length codes above 8 come out of -L, -f and -l as they went in",
          "[integration][bmudump]") {
  std::string log =
      "(1.000000) can0 123##3AABB\n(1.000001) can0 18FF50E5##0\n(1.000002) can0 123#1122334455667788_9 R\n"
      "(1.000003) can0 123#R8_F\n(1.000004) can0 123#R3\n(1.000005) can0 20000040#0000000000000000 T\n"
      "(1.000006) can0 45123#81:00:12345678#11.22 T\n";
  log += "(1.000007) can0 7FF##1" + times(64, "5A") + " R\n";
  const TemporaryFolder folder;
  CHECK(run("-r - -L", log).out == log);
  CHECK(run("-r - -f " + folder / "out.log", log).exit_code == 0);
  CHECK(content_of(folder / "out.log") == log);
  const std::string in = folder.file("in.log", log);
  const std::string command = "mkdir " + folder / "l" + " && cd " + folder / "l" + " && " + bmudump + " -l -r " + in;
  REQUIRE(std::system((command + " 2>../err").c_str()) == 0);  // NOLINT(cert-env33-c,concurrency-mt-unsafe): ours
  for (const auto& entry : std::filesystem::directory_iterator(folder / "l")) {
    CHECK(content_of(entry.path().string()) == log);
  }
}

TEST_CASE("frames of CAN FD and XL are shown with their bytes, and flags with -x", "[integration][bmudump][F106]") {
  const std::string log =
      "(1.000000) can0 143#8EA08E928EB22AB2 R\n(1.000000) can0 143##38EA0 R\n(1.000000) can0 18FF50E5##1" +
      times(12, "41") + " T\n(1.000000) can0 7FF#43 T\n(1.000000) can0 45123#81:00:12345678#11.22\n";
  CHECK(run("-r - -x -a -t none --brief", log).out ==
        "can0 RX 143 CELLS_1 node 3     cell_voltage_1 3.6512 V  cell_voltage_2 3.6498 V  cell_voltage_3 3.6530 V\n"
        "can0 RX B E 143 CAN FD             [02] 8E A0  '..'\n"
        "can0 TX B - 18FF50E5 CAN FD        [12] 41 41 41 41 41 41 41 41 41 41 41 41  'AAAAAAAAAAAA'\n"
        "can0 TX - - 7FF unknown            [1] 43  'C'\n"
        "can0  - - - 123 CAN XL             [02] 11 22  '.\"'\n");
  const std::vector<std::string> lines = lines_of(run("-r - --json", log).out);
  REQUIRE(lines.size() == 5);
  CHECK(lines[1] == R"({"time_s":1.000000,"bus":"can0","id":"143","direction":"received","message":null,"node":null,)"
                    R"("ok":null,"fd":true,"fd_flags":3,"data":"8EA0"})");
  CHECK(nlohmann::json::parse(lines[2]).at("data") == times(12, "41"));
  CHECK(lines[4].ends_with(R"("ok":null,"xl":true,"data":"1122"})"));
  // The table keeps what it shows.
  CHECK(lines_of(run("-r - --follow", log).out).back().ends_with("[02] 11 22"));
  const std::string longest = "(1.000000) can0 7FF07#01:AB:00000000#" + times(2'048, "7F") + "\n";
  CHECK(run("-r - -a -t none", longest).out ==
        "can0 707 CAN XL             [2048]" + times(2'048, " 7F") + "  '" + times(2'048, ".") + "'\n");
}

TEST_CASE("the generated part of the protocol's documentation is current", "[integration][bmudump][meta]") {
  const std::string document = content_of(test::in_source("docs/bus-protocol.md"));
  CHECK(document.find(run("--protocol-doc").out) != std::string::npos);
  const std::string elithion = run("--protocol-doc --dialect elithion").out;
  CHECK(elithion.find("| b4 | u8 | `stored_fault` |  | 0 none, 1 driven while plugged in, ") != std::string::npos);
  CHECK(elithion.find("| b5 | u8 | `fault_bits` |  | .0 driven while plugged in, .1 interlock, ") != std::string::npos);
}

TEST_CASE("live, frames are shown as they come and an interrupt ends in order", "[integration][bmudump][bus]") {
  const TemporaryFolder folder;
  const TestBus test_bus("live");
  const std::string bus = test_bus.name();
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open((folder / "out").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600), STDOUT_FILENO);
    ::execl(bmudump.c_str(), bmudump.c_str(), "--json", bus.c_str(), nullptr);
    ::_exit(127);
  }
  auto port = open_bus(bus, {});
  REQUIRE(port.has_value());
  const CanFrame frame = internal_worked_frames()[2].frame();
  std::string out;
  // Who listens later hears later: send until the first frame was heard.
  for (const auto begin = std::chrono::steady_clock::now();
       lines_of(out).empty() && std::chrono::steady_clock::now() - begin < test::hang_max;) {
    REQUIRE((*port)->send(frame).has_value());
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    out = content_of(folder / "out");
  }
  ::kill(child, SIGINT);
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  const std::vector<std::string> lines = lines_of(content_of(folder / "out"));
  REQUIRE_FALSE(lines.empty());
  const nlohmann::json first = nlohmann::json::parse(lines.front());
  CHECK(first.at("bus") == bus);
  CHECK(first.at("signals").at("cell_voltage_1_uV") == 3'651'200);
  for (const std::string& line : lines) CHECK_FALSE(nlohmann::json::parse(line).is_discarded());
}

TEST_CASE("live, a bus that does not exist is an error of the system", "[integration][bmudump]") {
  CHECK(run("no-such-can").exit_code == 1);
  CHECK(run("no-such-can").err.rfind("bmudump: ", 0) == 0);
}

TEST_CASE("live, the run ends after the seconds asked for", "[integration][bmudump][bus]") {
  const TestBus bus("idle");
  const Run result = run("--seconds 0.05 " + bus.name());
  CHECK(result.exit_code == 0);
  CHECK(lines_of(result.err).size() == 1);
  CHECK(seconds_after(result.err, "bmudump: " + bus.name() + ": nobody was heard in ") >= 0.05);
}

TEST_CASE("live, the run ends after so long without a frame", "[integration][bmudump][bus]") {
  const TestBus bus("silent");
  const auto start = std::chrono::steady_clock::now();
  CHECK(run("-T 100 --seconds 60 " + bus.name()).exit_code == 0);
  const auto took = std::chrono::steady_clock::now() - start;
  CHECK(took >= std::chrono::milliseconds(100));
  CHECK(took < std::chrono::seconds(60));  // that it was not the other end
}

namespace {

/// bmudump on two buses, of which this one speaks on one until it has been told of the other.
struct SilenceRun {
  TestBus quiet{"quiet"};
  TestBus busy{"busy"};
  /// Whether a frame had been shown before anything was said.
  bool was_heard_in_time = false;
  int exit_code = -1;
  std::vector<std::string> told;

  SilenceRun() {
    const TemporaryFolder folder;
    auto port = open_bus(busy.name(), {});
    REQUIRE(port.has_value());
    Process listening({bmudump, quiet.name(), busy.name()}, {.out_file = folder / "out", .err_file = folder / "err"});
    const auto is_told = [&] { return !content_of(folder / "err").empty(); };
    const auto begin = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - begin < test::hang_max && !(was_heard_in_time && is_told())) {
      REQUIRE((*port)->send(internal_worked_frames()[2].frame()).has_value());
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (was_heard_in_time || content_of(folder / "out").empty()) continue;
      was_heard_in_time = !is_told();
      if (!was_heard_in_time) break;
    }
    listening.signal(SIGINT);
    exit_code = listening.wait(test::hang_max);
    told = lines_of(content_of(folder / "err"));
  }
};

}  // namespace

TEST_CASE("live, a bus on which nobody speaks is told once, one with traffic is not", "[integration][bmudump][bus]") {
  // A machine that holds up who speaks, or who listens, for two seconds makes the other bus a silent one, too.
  constexpr int runs_max = 5;
  std::unique_ptr<SilenceRun> result;
  for (int runs = 0; runs < runs_max && !(result && result->was_heard_in_time); ++runs) {
    result.reset();  // and its buses, before they are there again
    result = std::make_unique<SilenceRun>();
  }
  REQUIRE(result->was_heard_in_time);
  CHECK(result->exit_code == 0);
  const std::vector<std::string>& told = result->told;
  REQUIRE(told.size() == 2);
  CHECK(told[0] == "bmudump: no frame on " + result->quiet.name() + " yet; is another program on this bus?");
  CHECK(seconds_after(told[1], "bmudump: " + result->quiet.name() + ": nobody was heard in ") >= 2.0);
}
