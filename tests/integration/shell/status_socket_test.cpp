// The status socket against misbehaving clients, in this process: no daemon, no threads, no sleeping.
#include "daemon/shell/status/status_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <grp.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/ask_as.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/process.hpp"
#include "tests/support/sanitized.hpp"

namespace bmu {

namespace {

OwnedFd connect_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  OwnedFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  REQUIRE(::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
  return fd;
}

/// The socket, and an answering function that returns the request.
struct Bench {
  TemporaryFolder folder;
  std::string path = folder / "bmud.sock";
  std::vector<std::string> asked;
  std::vector<Peer> peers;  // senders of the requests
  std::unique_ptr<StatusSocket> socket;

  explicit Bench(StatusSocketOptions options = {}) {
    options.path = path;
    auto opened = StatusSocket::open(options);
    REQUIRE(opened);
    socket = std::move(*opened);
  }
  [[nodiscard]] bool is_busy() const {
    pollfd wait{.fd = socket->fd(), .events = POLLIN, .revents = 0};
    return socket->has_waiting_requests() || ::poll(&wait, 1, 0) > 0;
  }
  /// As the loop does, until no work is left.
  void serve() {
    for (int i = 0; i < 10'000 && is_busy(); ++i) {
      socket->serve([this](std::string_view request, const Peer& peer) {
        peers.push_back(peer);
        asked.emplace_back(request);
        return StatusReply{.line = "said " + std::string(request)};
      });
    }
  }
};

void say(const OwnedFd& client, const std::string& text) {
  REQUIRE(::send(client.get(), text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size()));
}

/// The received bytes; "<end>" at the end of the connection.
std::string hear(const OwnedFd& client) {
  std::string text;
  std::array<char, 65536> buffer{};
  while (true) {
    const ssize_t count = ::recv(client.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (count == 0 || (count < 0 && errno != EAGAIN)) return text + "<end>";
    if (count < 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

TEST_CASE("each request line is answered by one line, in order", "[integration][status]") {
  Bench bench;
  const OwnedFd client = connect_to(bench.path);
  say(client, "one\ntwo\nthr");
  bench.serve();
  CHECK(hear(client) == "said one\nsaid two\n");
  say(client, "ee\n");
  bench.serve();
  CHECK(hear(client) == "said three\n");
}

TEST_CASE("who asks is what the kernel says of the other end", "[integration][status]") {
  Bench bench;
  const OwnedFd client = connect_to(bench.path);
  say(client, "one\ntwo\n");
  bench.serve();
  REQUIRE(bench.peers.size() == 2);
  CHECK(bench.peers.back().user_id == ::geteuid());
  CHECK(bench.peers.back().group_id == ::getegid());
  CHECK(bench.peers.back().process_id == ::getpid());
  std::vector<std::uint32_t> groups(NGROUPS_MAX);
  groups.resize(static_cast<std::size_t>(::getgroups(NGROUPS_MAX, groups.data())));
  std::sort(groups.begin(), groups.end());
  std::vector<std::uint32_t> told = bench.peers.back().more_groups;
  std::sort(told.begin(), told.end());
  CHECK(told == groups);
}

TEST_CASE("all groups of a peer are known, be they ever so many", "[integration][status]") {
  if (::geteuid() != 0) {
    WARN("skipped: only root can be in other groups");
    return;
  }
  std::vector<gid_t> groups;
  for (gid_t group = 70'000; group < 70'500; ++group) groups.push_back(group);
  std::array<int, 2> ends{};
  REQUIRE(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) == 0);
  const OwnedFd one(ends[0]);
  const OwnedFd other(ends[1]);
  CHECK(peer_of(one.get()).process_id == ::getpid());

  Bench bench;
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    if (::setgroups(groups.size(), groups.data()) != 0) ::_exit(1);
    const OwnedFd client = connect_to(bench.path);
    ::_exit(::send(client.get(), "x\n", 2, MSG_NOSIGNAL) == 2 ? 0 : 2);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(status == 0);
  bench.serve();
  REQUIRE(bench.peers.size() == 1);
  CHECK(bench.peers.front().more_groups == std::vector<std::uint32_t>(groups.begin(), groups.end()));
}

TEST_CASE("whom the door refuses is told so and takes nobody's place", "[integration][status]") {
  Bench bench({.clients_max = 2});
  bool is_closed = true;
  const auto door = [&](const Peer& peer) {
    CHECK(peer.user_id == ::geteuid());
    return std::string(is_closed ? "go away" : "");
  };
  bench.socket->set_door(door);
  for (int i = 0; i < 5; ++i) {
    const OwnedFd client = connect_to(bench.path);
    say(client, "status\n");
    bench.serve();
    CHECK(hear(client) == "go away\n<end>");
    CHECK(bench.socket->client_count() == 0);
  }
  CHECK(bench.asked.empty());
  is_closed = false;
  const OwnedFd client = connect_to(bench.path);
  say(client, "one\n");
  bench.serve();
  CHECK(hear(client) == "said one\n");
  // Changed rules apply to connected clients.
  bench.socket->set_door(door);
  say(client, "two\n");
  bench.serve();
  CHECK(hear(client) == "said two\n");
  is_closed = true;
  bench.socket->set_door(door);
  CHECK(bench.socket->client_count() == 0);
  CHECK(hear(client) == "go away\n<end>");
}

TEST_CASE("one call answers one request, so that a busy client cannot hold the loop", "[integration][status]") {
  Bench bench;
  const OwnedFd client = connect_to(bench.path);
  const auto answer = [](std::string_view, const Peer&) { return StatusReply{.line = "x"}; };
  bench.socket->serve(answer);
  say(client, "1\n2\n3\n");
  bench.socket->serve(answer);
  CHECK(hear(client) == "x\n");
  CHECK(bench.socket->has_waiting_requests());
  bench.socket->serve(answer);
  CHECK(hear(client) == "x\n");
}

TEST_CASE("a request without an end is answered with an error and cut off", "[integration][status]") {
  Bench bench({.request_bytes_max = 100});
  const OwnedFd client = connect_to(bench.path);
  say(client, std::string(5000, 'x'));
  bench.serve();
  const std::string answer = hear(client);
  CHECK(answer.find("\"too_long\"") != std::string::npos);
  CHECK(answer.substr(answer.size() - 5) == "<end>");
  CHECK(bench.asked.empty());
  CHECK(bench.socket->client_count() == 0);
}

TEST_CASE("the longest request allowed is answered, one byte more is not", "[integration][status]") {
  Bench bench({.request_bytes_max = 100});
  const OwnedFd client = connect_to(bench.path);
  say(client, std::string(100, 'a') + "\n");
  bench.serve();
  CHECK(bench.asked.size() == 1);
  say(client, std::string(101, 'a') + "\n");
  bench.serve();
  CHECK(bench.asked.size() == 1);
}

TEST_CASE("a client that asks and does not read is dropped, others are served", "[integration][status]") {
  Bench bench({.unread_bytes_max = std::size_t{64} * 1024});
  const OwnedFd deaf = connect_to(bench.path);
  const OwnedFd good = connect_to(bench.path);
  const std::string answer(std::size_t{32} * 1024, 'a');
  // The system's own buffer fills first; it has some hundreds of kilobytes.
  for (int i = 0; i < 1000 && bench.socket->clients_dropped() == 0; ++i) {
    say(deaf, "?\n");
    do {
      bench.socket->serve([&](std::string_view, const Peer&) { return StatusReply{.line = answer}; });
    } while (bench.is_busy());
  }
  CHECK(bench.socket->client_count() == 1);
  CHECK(bench.socket->clients_dropped() == 1);
  say(good, "there?\n");
  bench.serve();
  CHECK(hear(good) == "said there?\n");
}

TEST_CASE("one answer may be larger than what a client may leave unread", "[integration][status]") {
  Bench bench({.unread_bytes_max = std::size_t{64} * 1024});
  const OwnedFd client = connect_to(bench.path);
  const std::string answer(std::size_t{2048} * 1024, 'a');
  say(client, "?\n");
  std::string heard;
  for (int i = 0; i < 10'000 && heard.size() <= answer.size(); ++i) {
    bench.socket->serve([&](std::string_view, const Peer&) { return StatusReply{.line = answer}; });
    heard += hear(client);
  }
  CHECK(heard.size() == answer.size() + 1);
  CHECK(bench.socket->clients_dropped() == 0);
}

TEST_CASE("a watching client gets a picture each period, made once for all", "[integration][status]") {
  Bench bench;
  const OwnedFd one = connect_to(bench.path);
  const OwnedFd two = connect_to(bench.path);
  const auto watch = [](std::string_view, const Peer&) { return StatusReply{.line = "", .picture_period = 100ms}; };
  say(one, "watch\n");
  say(two, "watch\n");
  while (bench.is_busy()) bench.socket->serve(watch);
  int made = 0;
  const auto picture = [&] { return "picture " + std::to_string(++made); };
  for (int tick = 0; tick < 25; ++tick) bench.socket->publish(TimePoint{1s + tick * 10ms}, picture);
  CHECK(made == 3);
  CHECK(hear(one) == "picture 1\npicture 2\npicture 3\n");
  CHECK(hear(two) == "picture 1\npicture 2\npicture 3\n");
}

namespace {

/// A client that watches with a period of 100 ms, and updates so large that the system accepts only the first of them.
struct WatchBench : Bench {
  explicit WatchBench(StatusSocketOptions options = {}) : Bench(std::move(options)) {
    say(watcher, "watch\n");
    while (is_busy()) {
      socket->serve([](std::string_view, const Peer&) { return StatusReply{.line = "", .picture_period = 100ms}; });
    }
  }
  /// One tick of the loop.
  void publish(TimePoint now) {
    socket->publish(now, [this] { return std::to_string(++made) + std::string(std::size_t{1024} * 1024, 'p'); });
    while (is_busy()) socket->serve({});
  }
  /// Reads, and lets further bytes arrive, up to the end of a line.
  [[nodiscard]] std::string next_line() {
    std::string line;
    for (int i = 0; i < 10'000 && line.find('\n') == std::string::npos; ++i) {
      line += hear(watcher);
      while (is_busy()) socket->serve({});
    }
    return line;
  }
  int made = 0;
  OwnedFd watcher = connect_to(path);
};

}  // namespace

TEST_CASE("who watches and is not running for a while misses pictures, and then gets the newest",
          "[integration][status]") {
  WatchBench bench;
  TimePoint now{1s};
  for (int tick = 0; tick < 3'000; ++tick) bench.publish(now += 10ms);
  CHECK(bench.made == 1);
  CHECK(bench.socket->client_count() == 1);
  CHECK(bench.next_line().starts_with("1p"));
  bench.publish(now += 10ms);
  CHECK(bench.made == 2);
  CHECK(bench.next_line().starts_with("2p"));
  CHECK(bench.socket->clients_dropped() == 0);
}

TEST_CASE("who watches and takes nothing for a minute is dropped, who takes a little is not", "[integration][status]") {
  WatchBench bench;
  const bool takes = GENERATE(false, true);
  CAPTURE(takes);
  TimePoint now{1s};
  bench.publish(now);
  for (int second = 0; second < 65; ++second) {
    // More than the free space that the system requires before the other end may write again.
    std::array<char, 256 * 1024> little{};
    if (takes && second == 50) REQUIRE(::recv(bench.watcher.get(), little.data(), little.size(), MSG_DONTWAIT) > 0);
    for (int tick = 0; tick < 100; ++tick) bench.publish(now += 10ms);
  }
  CHECK(bench.socket->client_count() == (takes ? 1 : 0));
  CHECK(bench.socket->clients_dropped() == (takes ? 0 : 1));
}

TEST_CASE("no picture is made when nobody watches", "[integration][status]") {
  Bench bench;
  const OwnedFd client = connect_to(bench.path);
  bench.serve();
  bench.socket->publish(TimePoint{1s}, []() -> std::string {
    FAIL("nobody watches");
    return "";
  });
}

TEST_CASE("one client too many is told so, and may come back when there is room", "[integration][status]") {
  Bench bench({.clients_max = 3});
  std::vector<OwnedFd> clients;
  clients.reserve(4);
  for (int i = 0; i < 4; ++i) clients.push_back(connect_to(bench.path));
  bench.serve();
  CHECK(bench.socket->client_count() == 3);
  const std::string refusal = hear(clients[3]);
  CHECK(refusal.find("\"too_many_clients\"") != std::string::npos);
  CHECK(refusal.substr(refusal.size() - 5) == "<end>");
  clients.erase(clients.begin());
  bench.serve();
  const OwnedFd again = connect_to(bench.path);
  say(again, "room?\n");
  bench.serve();
  CHECK(hear(again) == "said room?\n");
}

TEST_CASE("where all connections are taken, who has more of them than another gives up the most silent one",
          "[integration][status]") {
  if (::geteuid() != 0) {
    WARN("skipped: only root can connect as somebody else");
    return;
  }
  Bench bench({.clients_max = 4});
  REQUIRE(::chmod((bench.folder / "").c_str(), 0755) == 0);
  REQUIRE(bench.socket->set_for_all(true));
  const OwnedFd watching = connect_to(bench.path);
  const OwnedFd early = connect_to(bench.path);
  const OwnedFd silent = connect_to(bench.path);
  const OwnedFd late = connect_to(bench.path);
  say(watching, "watch\n");
  const auto watch = [](std::string_view, const Peer&) { return StatusReply{.line = "", .picture_period = 1h}; };
  while (bench.is_busy()) bench.socket->serve(watch);
  for (const OwnedFd* client : {&early, &late}) {
    say(*client, "one\n");
    bench.serve();
    CHECK(hear(*client) == "said one\n");
  }
  // Not detected by the end of the connection, because the children have copies of it.
  const auto is_out = [](const OwnedFd& client) {
    return hear(client).find("\"too_many_clients\"") != std::string::npos;
  };
  const auto comes = [&](std::uint32_t user_id) {
    auto one = std::make_unique<test::SilentConnections>(test::Asker{.user_id = user_id}, bench.path, 1);
    bench.serve();
    CHECK(bench.socket->client_count() == 4);
    return one;
  };
  const auto first = comes(test::nobody);
  CHECK(is_out(silent));
  CHECK_FALSE(is_out(early));
  const auto second = comes(test::nobody - 1);
  CHECK(is_out(early));
  // This user has two now, and the newcomer has one already: no more than the newcomer would have.
  const auto again = comes(test::nobody);
  CHECK_FALSE(is_out(late));
  const auto third = comes(test::nobody - 2);
  CHECK(is_out(late));
  // Each user has one.
  const auto fourth = comes(test::nobody - 3);
  CHECK_FALSE(is_out(watching));
}

TEST_CASE("who waits for an answer gives his connection up to nobody", "[integration][status]") {
  if (::geteuid() != 0) {
    WARN("skipped: only root can connect as somebody else");
    return;
  }
  Bench bench({.clients_max = 2});
  REQUIRE(::chmod((bench.folder / "").c_str(), 0755) == 0);
  REQUIRE(bench.socket->set_for_all(true));
  const auto serve = [&] {
    while (bench.is_busy()) {
      bench.socket->serve([](std::string_view request, const Peer&) {
        const bool is_later = request == "reload";
        return StatusReply{.line = is_later ? "" : "done", .is_later = is_later};
      });
    }
  };
  const OwnedFd waiting = connect_to(bench.path);
  say(waiting, "reload\n");
  serve();
  // The waiting client sent its request first: it would be dropped if it did not wait.
  {
    const OwnedFd answered = connect_to(bench.path);
    say(answered, "one\n");
    serve();
    const test::SilentConnections newcomer({.user_id = test::nobody}, bench.path, 1);
    serve();
    CHECK(hear(answered).find("\"too_many_clients\"") != std::string::npos);
    CHECK(hear(waiting).empty());
  }
  serve();
  const OwnedFd also_waiting = connect_to(bench.path);
  say(also_waiting, "reload\n");
  serve();
  const test::SilentConnections newcomer({.user_id = test::nobody}, bench.path, 1);
  serve();
  for (const OwnedFd* client : {&waiting, &also_waiting}) CHECK(hear(*client).empty());
  CHECK(bench.socket->client_count() == 2);
}

TEST_CASE("a client that says all and hangs up its sending side still gets its answers", "[integration][status]") {
  Bench bench;
  const OwnedFd client = connect_to(bench.path);
  say(client, "one\ntwo\n");
  REQUIRE(::shutdown(client.get(), SHUT_WR) == 0);
  bench.serve();
  CHECK(hear(client) == "said one\nsaid two\n<end>");
  CHECK(bench.socket->client_count() == 0);
}

namespace {

/// Defers the answer to "later", and answers all other requests at once.
struct LateBench : Bench {
  std::uint64_t connection = 0;  // of the last "later" request

  void serve_late() {
    for (int i = 0; i < 10'000 && is_busy(); ++i) {
      socket->serve([this](std::string_view request, const Peer& peer) {
        if (request != "later") return StatusReply{.line = "said " + std::string(request)};
        connection = peer.connection;
        return StatusReply{.line = "", .is_later = true};
      });
    }
  }
};

}  // namespace

TEST_CASE("what is answered later is answered in its turn, and nobody else waits for it", "[integration][status]") {
  LateBench bench;
  const OwnedFd waiting = connect_to(bench.path);
  const OwnedFd other = connect_to(bench.path);
  say(waiting, "one\nlater\ntwo\n");
  say(other, "three\n");
  bench.serve_late();
  CHECK(hear(waiting) == "said one\n");
  CHECK(hear(other) == "said three\n");
  CHECK_FALSE(bench.is_busy());
  bench.socket->answer_later(bench.connection + 1, "not for you");
  CHECK(hear(waiting).empty());
  CHECK(hear(other).empty());
  bench.socket->answer_later(bench.connection, "at last");
  bench.serve_late();
  CHECK(hear(waiting) == "at last\nsaid two\n");
  bench.socket->answer_later(bench.connection, "twice");  // no client waits any more
  CHECK(hear(waiting).empty());
}

TEST_CASE("who has said all still gets the answer that comes later", "[integration][status]") {
  LateBench bench;
  const OwnedFd client = connect_to(bench.path);
  say(client, "later\n");
  REQUIRE(::shutdown(client.get(), SHUT_WR) == 0);
  bench.serve_late();
  CHECK_FALSE(bench.is_busy());
  CHECK(bench.socket->client_count() == 1);
  bench.socket->answer_later(bench.connection, "at last");
  bench.serve_late();
  CHECK(hear(client) == "at last\n<end>");
  CHECK(bench.socket->client_count() == 0);
}

TEST_CASE("who has gone before the answer came leaves nothing to do", "[integration][status]") {
  LateBench bench;
  {
    const OwnedFd client = connect_to(bench.path);
    say(client, "later\n");
    bench.serve_late();
  }
  bench.serve_late();
  CHECK(bench.socket->client_count() == 0);
  CHECK_FALSE(bench.is_busy());
  bench.socket->answer_later(bench.connection, "at last");
  // A number is never used twice: the next client gets no answer of another.
  const OwnedFd next = connect_to(bench.path);
  say(next, "later\n");
  const std::uint64_t before = bench.connection;
  bench.serve_late();
  CHECK(bench.connection != before);
}

TEST_CASE("clients that vanish leave nothing to do", "[integration][status]") {
  Bench bench;
  // No more at once than the system's backlog.
  for (int round = 0; round < 4; ++round) {
    for (int i = 0; i < 5; ++i) say(connect_to(bench.path), "and gone\n");
    bench.serve();
  }
  CHECK(bench.socket->client_count() == 0);
  CHECK_FALSE(bench.is_busy());
}

TEST_CASE("the socket file of a dead daemon is replaced, a living one's is not", "[integration][status]") {
  const TemporaryFolder folder;
  const std::string path = folder / "bmud.sock";
  {
    // As left by a killed daemon: bound, without a listener.
    const OwnedFd dead(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    REQUIRE(::bind(dead.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
  }
  REQUIRE(std::filesystem::exists(path));
  const auto first = StatusSocket::open({.path = path});
  REQUIRE(first);
  const auto second = StatusSocket::open({.path = path});
  REQUIRE_FALSE(second);
  CHECK(to_text(second.error()).find("another bmud is running") != std::string::npos);
  connect_to(path);
}

TEST_CASE("a file that is no socket is never removed", "[integration][status]") {
  const TemporaryFolder folder;
  const std::string path = folder / "precious.txt";
  std::ofstream(path) << "text";
  CHECK_FALSE(StatusSocket::open({.path = path}));
  CHECK(std::filesystem::file_size(path) == 4);
}

TEST_CASE("the socket is for owner and group, or for all, its own folder is made, and it is gone in the end",
          "[integration][status]") {
  const TemporaryFolder folder;
  const std::string path = folder / "run/bmud.sock";
  {
    const auto socket = StatusSocket::open({.path = path, .own_directory = folder / "run"});
    REQUIRE(socket);
    struct stat status {};
    REQUIRE(::stat(path.c_str(), &status) == 0);
    CHECK((status.st_mode & 07777) == 0660);
    REQUIRE((*socket)->set_for_all(true));
    REQUIRE(::stat(path.c_str(), &status) == 0);
    CHECK((status.st_mode & 07777) == 0666);
    REQUIRE((*socket)->set_for_all(false));
    REQUIRE(::stat(path.c_str(), &status) == 0);
    CHECK((status.st_mode & 07777) == 0660);
  }
  {
    const auto socket = StatusSocket::open({.path = path, .is_for_all = true});
    REQUIRE(socket);
    struct stat status {};
    REQUIRE(::stat(path.c_str(), &status) == 0);
    CHECK((status.st_mode & 07777) == 0666);
  }
  CHECK_FALSE(std::filesystem::exists(path));
}

TEST_CASE("no folder but its own is made", "[integration][status]") {
  const TemporaryFolder folder;
  const auto socket = StatusSocket::open({.path = folder / "slip/bmud.sock", .own_directory = folder / "run"});
  REQUIRE_FALSE(socket);
  const std::string text = to_text(socket.error());
  INFO(text);
  CHECK(text.find("directory " + (folder / "slip") + " does not exist") != std::string::npos);
  CHECK(std::count(text.begin(), text.end(), '\n') == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "slip"));
}

TEST_CASE("a path too long for a socket is refused with a reason", "[integration][status]") {
  const auto socket = StatusSocket::open({.path = "/tmp/" + std::string(200, 'x')});
  REQUIRE_FALSE(socket);
  CHECK(to_text(socket.error()).find("107 bytes") != std::string::npos);
}

/// While this object exists, no descriptor can be allocated.
class NoDescriptors {
 public:
  NoDescriptors() {
    REQUIRE(::getrlimit(RLIMIT_NOFILE, &usual_) == 0);
    // The lowest free one is the first that must not be allocated.
    const int free = ::dup(STDIN_FILENO);
    REQUIRE(free > 0);
    ::close(free);
    const rlimit less{.rlim_cur = static_cast<rlim_t>(free), .rlim_max = usual_.rlim_max};
    REQUIRE(::setrlimit(RLIMIT_NOFILE, &less) == 0);
  }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;
  ~NoDescriptors() { ::setrlimit(RLIMIT_NOFILE, &usual_); }

 private:
  rlimit usual_{};
};

TEST_CASE("a client for whom there is no descriptor waits, and keeps nobody awake", "[integration][status][F70]") {
  if (test::is_sanitized) {
    WARN("skipped: a sanitizer needs descriptors to look at objects");
    return;
  }
  Bench bench;
  const OwnedFd client = connect_to(bench.path);
  say(client, "one\n");
  {
    const NoDescriptors none;
    bench.serve();
    CHECK_FALSE(bench.is_busy());
    // Accepting is retried once per tick.
    bench.socket->publish(TimePoint{}, [] { return std::string(); });
    CHECK(bench.is_busy());
    bench.serve();
    CHECK_FALSE(bench.is_busy());
    CHECK(bench.asked.empty());
  }
  bench.socket->publish(TimePoint{}, [] { return std::string(); });
  bench.serve();
  CHECK(hear(client) == "said one\n");
}

}  // namespace bmu
