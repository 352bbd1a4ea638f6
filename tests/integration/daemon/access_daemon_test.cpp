// Access rights, requested from the real daemon by real users of groups: it finds bmud and bmud-admin in its own
// /etc/group, which is mounted over that of the machine for this process only.
#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/shell/system/sparing_log.hpp"
#include "tests/support/ask_as.hpp"
#include "tests/support/daemon_bench.hpp"

namespace bmu {

using test::ask_as;
using test::Asker;
using test::Bench;
using test::milliseconds;

namespace {

constexpr std::uint32_t readers = 71'001;
constexpr std::uint32_t admins = 71'002;
constexpr std::uint32_t anna = 72'001;

const Asker reader{.user_id = anna, .group_id = anna, .more_groups = {4, readers}};
const Asker administrator{.user_id = anna, .group_id = anna, .more_groups = {admins}};
const Asker stranger{.user_id = anna, .group_id = anna, .more_groups = {4}};

constexpr const char* status = R"({"cmd":"version"})";
constexpr const char* off = R"({"cmd":"balance","switch":"off"})";

/// The reason why this machine cannot run the test; "" if it can.
std::string what_is_missing() {
  if (::geteuid() != 0) return "only root can ask as somebody else";
  const Finished tried = run_program({"/usr/bin/unshare", "-m", "true"});
  return tried.status == 0 ? "" : "mounts of one's own are not allowed here: " + tried.err;
}

struct AccessBench : Bench {
  std::string groups = folder / "group";

  AccessBench() {
    REQUIRE(::chmod((folder / "").c_str(), 0755) == 0);
    std::ofstream(groups) << "root:x:0:\nbmud:x:" << readers << ":\nbmud-admin:x:" << admins << ":\n";
  }
  void start() {
    std::vector<std::string> command{
        "/usr/bin/unshare", "-m", "sh", "-c", R"(mount --bind "$0" /etc/group && exec "$@")", groups};
    const std::vector<std::string> words = daemon_command();
    command.insert(command.end(), words.begin(), words.end());
    daemon = std::make_unique<Process>(command, ProcessOptions{.err_file = log});
    REQUIRE(listener.next(test::hang_max));
  }
  [[nodiscard]] std::string error_of(const Asker& asker, const char* question) const {
    const nlohmann::json reply = ask_as(asker, socket, question);
    return reply.at("ok") == true ? "" : reply.at("error").at("code").get<std::string>();
  }
  [[nodiscard]] int end() {
    daemon->signal(SIGTERM);
    return daemon->wait(test::hang_max);
  }
};

}  // namespace

TEST_CASE("members of bmud read, members of bmud-admin control, others are turned away, and the log says who",
          "[integration][daemon][access][bus]") {
  if (const std::string missing = what_is_missing(); !missing.empty()) {
    WARN("skipped: " << missing);
    return;
  }
  AccessBench bench;
  bench.start_emulator("");
  bench.start();
  struct stat file {};
  REQUIRE(::stat(bench.socket.c_str(), &file) == 0);
  CHECK((file.st_mode & 07777) == 0666);

  CHECK(bench.error_of(reader, status).empty());
  CHECK(bench.error_of(reader, off) == "not_allowed");
  CHECK(bench.ask_json("balance").at("is_switched_off") == false);
  CHECK(bench.error_of(stranger, status) == "not_allowed");
  CHECK(bench.error_of(stranger, off) == "not_allowed");
  CHECK(bench.error_of(administrator, status).empty());
  CHECK(bench.error_of(administrator, off).empty());
  CHECK(bench.ask_json("balance").at("is_switched_off") == true);
  CHECK(bench.error_of(administrator, R"({"cmd":"clear","authorised":true})").empty());
  CHECK(bench.ask({"balance", "--on"}).status == 0);  // root

  CHECK(bench.end() == 0);
  const std::string text = read_file(bench.log);
  INFO(text);
  const auto has = [&](const std::string& part) { return text.find(part) != std::string::npos; };
  CHECK(has("access denied: user 72001, process "));
  CHECK(has(": \"balance with switch\""));
  CHECK(has(": read"));
  CHECK(has("balancing switched off by user 72001, process "));
  CHECK(has("clear by user 72001, process "));
  CHECK(has(" (authorised): "));
  CHECK(has("control: root, members of bmud-admin"));
}

TEST_CASE("strangers in any number keep nobody from asking, and do not fill the log",
          "[integration][daemon][access][bus]") {
  if (const std::string missing = what_is_missing(); !missing.empty()) {
    WARN("skipped: " << missing);
    return;
  }
  AccessBench bench;
  const auto began_at = std::chrono::steady_clock::now();
  bench.start();
  for (int i = 0; i < 40; ++i) CHECK(bench.error_of(stranger, status) == "not_allowed");
  CHECK(bench.error_of(reader, status).empty());
  CHECK(bench.end() == 0);
  const std::string text = read_file(bench.log);
  std::size_t count = 0;
  for (std::size_t at = text.find("access denied: "); at != std::string::npos;
       at = text.find("access denied: ", at + 1)) {
    ++count;
  }
  // The permitted number per minute; the first minute starts with the first refusal.
  const auto took = std::chrono::duration_cast<std::chrono::minutes>(std::chrono::steady_clock::now() - began_at);
  CHECK(count >= SparingLog::lines_max);
  CHECK(count <= SparingLog::lines_max * static_cast<std::size_t>(took.count() + 1));
}

TEST_CASE("who takes all connections and says nothing keeps no other user from asking",
          "[integration][daemon][access][bus]") {
  if (const std::string missing = what_is_missing(); !missing.empty()) {
    WARN("skipped: " << missing);
    return;
  }
  AccessBench bench;
  bench.start_emulator("");
  bench.start();
  const test::SilentConnections silent(reader, bench.socket, 40);
  // The user that occupies the connections is refused itself.
  CHECK(bench.error_of(administrator, status) == "too_many_clients");
  const Asker bob{.user_id = anna + 1, .group_id = anna + 1, .more_groups = {admins}};
  for (int i = 0; i < 3; ++i) CHECK(bench.error_of(bob, status).empty());
  CHECK(bench.error_of(bob, off).empty());
  CHECK(bench.end() == 0);
}

}  // namespace bmu
