// The embedded bus between real processes, some of which are killed or stopped at random points.
//
// A randomised test prints its seed; BMUD_TEST_SEED=N repeats it, as far as the scheduler permits.
#include "daemon/shell/can/embedded_bus.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "daemon/shell/can/bus_port.hpp"
#include "daemon/shell/can/embedded_ring.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"

namespace bmu {
namespace {

// Ends a hanging test, and has no other effect: on a busy machine a process may get no processor for seconds.
constexpr int patience_ms = 60'000;

const PortOptions with_echo{.receive_ids = {}, .receive_own = true};
const PortOptions with_errors{.receive_ids = {}, .receive_errors = true};

/// A bus for this test alone; its file is removed with the object.
class TestBus {
 public:
  TestBus() {
    static int count = 0;
    bus_ = "test-" + std::to_string(getpid()) + "-" + std::to_string(++count);
  }
  TestBus(const TestBus&) = delete;
  TestBus& operator=(const TestBus&) = delete;
  ~TestBus() { unlink(path().c_str()); }

  [[nodiscard]] std::string path() const { return embedded_bus_path(bus_); }
  [[nodiscard]] std::string name() const { return "unix:" + bus_; }

  /// Null if it cannot be opened, so that children may use it too: Catch's assertions belong to the parent.
  [[nodiscard]] std::unique_ptr<BusPort> try_open(const PortOptions& options = {}) const {
    Result<std::unique_ptr<BusPort>, OsError> port = open_bus(name(), options);
    return port ? std::move(*port) : nullptr;
  }
  [[nodiscard]] std::unique_ptr<BusPort> open(const PortOptions& options = {}) const {
    Result<std::unique_ptr<BusPort>, OsError> port = open_bus(name(), options);
    INFO((port ? "" : to_text(port.error())));
    REQUIRE(port);
    return std::move(*port);
  }
  [[nodiscard]] std::string refusal(const PortOptions& options = {}) const {
    const Result<std::unique_ptr<BusPort>, OsError> port = open_bus(name(), options);
    return port ? "" : to_text(port.error());
  }

 private:
  std::string bus_;
};

[[nodiscard]] bool is_readable(int fd, int timeout_ms) {
  pollfd entry{.fd = fd, .events = POLLIN, .revents = 0};
  return poll(&entry, 1, timeout_ms) == 1;
}

/// One end of a channel between parent and child that carries the message "go on" only.
class Line {
 public:
  explicit Line(OwnedFd fd) : fd_(std::move(fd)) {}
  [[nodiscard]] bool tell() const { return ::send(fd_.get(), "", 1, MSG_NOSIGNAL) == 1; }
  [[nodiscard]] bool wait() const {
    char byte = 0;
    return is_readable(fd_.get(), patience_ms) && recv(fd_.get(), &byte, 1, 0) == 1;
  }

 private:
  OwnedFd fd_;
};

/// A process that runs `body` and exits with its result; killed at the latest when this object is destroyed.
class Child {
 public:
  explicit Child(const std::function<int(const Line&)>& body) : line_(OwnedFd()) {
    int fds[2] = {-1, -1};
    REQUIRE(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, fds) == 0);
    OwnedFd ours(fds[0]);
    OwnedFd theirs(fds[1]);
    pid_ = fork();
    REQUIRE(pid_ >= 0);
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);  // if the test itself is killed
      ours = OwnedFd();
      _exit(body(Line(std::move(theirs))));
    }
    line_ = Line(std::move(ours));
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() { kill(); }

  [[nodiscard]] const Line& line() const { return line_; }
  void kill() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }
  void stop() const {
    int status = 0;
    ::kill(pid_, SIGSTOP);
    REQUIRE(waitpid(pid_, &status, WUNTRACED) == pid_);
    REQUIRE(WIFSTOPPED(status));
  }
  void resume() const { ::kill(pid_, SIGCONT); }
  [[nodiscard]] int exit_code() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  Line line_;
  pid_t pid_ = 0;
};

/// An own integer generator (splitmix64), so that a seed gives the same sequence on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  [[nodiscard]] std::uint64_t below(std::uint64_t limit) {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
    return (z ^ (z >> 31)) % limit;
  }

 private:
  std::uint64_t state_;
};

[[nodiscard]] std::uint64_t test_seed() {
  const char* wanted = std::getenv("BMUD_TEST_SEED");
  if (wanted != nullptr) return std::strtoull(wanted, nullptr, 10);
  return static_cast<std::uint64_t>(monotonic_now().time_since_epoch().count());
}

/// A frame that is identified by all its bytes together, so that a mixture of two frames is detected.
[[nodiscard]] CanFrame numbered(std::uint32_t sender, std::uint32_t number) {
  CanFrame frame = data_frame(sender, 8);
  const std::uint32_t check = (number * 2654435761U) ^ sender;
  std::memcpy(frame.data.data(), &number, 4);
  std::memcpy(frame.data.data() + 4, &check, 4);
  return frame;
}

[[nodiscard]] std::uint32_t number_of(const CanFrame& frame) {
  std::uint32_t number = 0;
  std::memcpy(&number, frame.data.data(), 4);
  return number;
}

[[nodiscard]] bool is_intact(const CanFrame& frame) {
  return frame == numbered(frame.id, number_of(frame));
}

/// A frame and its position on the bus, counted from the start of the record.
struct Sighting {
  std::uint64_t position = 0;
  std::uint64_t word = 0;  // identifier and number of the frame, never 0
};

/// The frames that one receiver saw. Positions agree with those of others only if it counts its losses exactly. Nothing
/// else of the losses is kept: a reader without a processor would get more of them while it allocated memory.
class Record {
 public:
  explicit Record(BusPort& port) : port_(&port), lost_before_(port.frames_lost()) {}

  /// Reads one frame; false if there is none.
  bool read_one() {
    ReceivedFrame received;
    if (port_->read(received) != ReadStatus::frame) return false;
    are_intact_ = are_intact_ && is_intact(received.frame);
    seen_.push_back(
        {.position = position(), .word = std::uint64_t{received.frame.id} << 32 | (number_of(received.frame) + 1)});
    return true;
  }
  /// Reads one frame, waiting for it; false if none comes.
  [[nodiscard]] bool wait_for_one() {
    while (!read_one()) {
      if (!is_readable(port_->fd(), patience_ms)) return false;
    }
    return true;
  }
  /// Reads until the descriptor is no longer readable.
  void read_all() {
    while (is_readable(port_->fd(), 0)) {
      while (read_one()) continue;
    }
  }
  [[nodiscard]] std::uint64_t received() const { return seen_.size(); }
  /// Position of the next frame, unless more are lost.
  [[nodiscard]] std::uint64_t position() const { return received() + port_->frames_lost() - lost_before_; }
  [[nodiscard]] bool are_intact() const { return are_intact_; }
  /// In the order of their positions.
  [[nodiscard]] const std::vector<Sighting>& seen() const { return seen_; }

 private:
  BusPort* port_;
  std::uint64_t lost_before_;
  std::vector<Sighting> seen_;
  bool are_intact_ = true;
};

/// True if both saw the same frame at each position that both have.
[[nodiscard]] bool is_same_order(std::span<const Sighting> a, std::span<const Sighting> b) {
  std::size_t i = 0;
  for (const Sighting& one : a) {
    while (i < b.size() && b[i].position < one.position) ++i;
    if (i == b.size()) break;
    if (b[i].position == one.position && b[i].word != one.word) return false;
  }
  return true;
}

/// True if each sender's frames are in the order in which it sent them.
[[nodiscard]] bool is_each_sender_in_order(std::span<const Sighting> seen) {
  std::vector<std::uint64_t> last(0x800, 0);
  for (const Sighting& sighting : seen) {
    std::uint64_t& before = last[sighting.word >> 32];
    if (sighting.word <= before) return false;
    before = sighting.word;
  }
  return true;
}

/// Reads until this position of the bus is reached, waiting for frames; false if they do not come.
[[nodiscard]] bool read_up_to(Record& record, const BusPort& port, std::uint64_t position) {
  while (record.position() < position) {
    if (!record.read_one() && !is_readable(port.fd(), patience_ms)) return false;
  }
  return record.position() == position;
}

/// Sends `count` frames, reading the pending frames between them, and then the remaining traffic of the bus.
[[nodiscard]] bool send_and_read(BusPort& port, Record& record, std::uint32_t id, std::uint32_t count,
                                 std::uint64_t total) {
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!port.send(numbered(id, i))) return false;
    while (record.read_one()) continue;
  }
  return read_up_to(record, port, total);
}

/// The memory of a bus as its ports see it, to leave it in the state of a writer that died at a certain point.
class RawMemory {
 public:
  explicit RawMemory(const TestBus& bus) : file_(::open(bus.path().c_str(), O_RDWR | O_CLOEXEC)) {
    memory_ = mmap(nullptr, sizeof(EmbeddedRing), PROT_READ | PROT_WRITE, MAP_SHARED, file_.get(), 0);
    REQUIRE(memory_ != MAP_FAILED);
  }
  RawMemory(const RawMemory&) = delete;
  RawMemory& operator=(const RawMemory&) = delete;
  ~RawMemory() { munmap(memory_, sizeof(EmbeddedRing)); }
  [[nodiscard]] EmbeddedRing& ring() const { return *static_cast<EmbeddedRing*>(memory_); }

 private:
  OwnedFd file_;
  void* memory_;
};

TEST_CASE("the embedded bus carries every kind of frame unchanged", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto sender = bus.open();
  const auto receiver = bus.open(with_errors);
  const CanFrame standard{.id = 0x7FF, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 255}};
  const CanFrame extended{.id = 0x1FFFFFFF, .is_extended = true, .length = 3, .data = {9, 8, 7}};
  const CanFrame remote{.id = 0, .is_remote = true, .length = 8};
  const CanFrame error{.id = 0x40, .is_error = true, .length = 8, .data = {0, 0x10}};
  const CanFrame empty = data_frame(0x123, 0);
  for (const CanFrame& frame : {standard, extended, remote, error, empty}) {
    REQUIRE(sender->send(frame));
    ReceivedFrame received;
    const TimePoint before = monotonic_now();
    REQUIRE(receiver->read(received) == ReadStatus::frame);
    CHECK(received.frame == frame);
    CHECK_FALSE(received.is_own);
    CHECK(received.received_at >= before);
    CHECK(receiver->read(received) == ReadStatus::empty);
  }
  CHECK(sender->state() == BusState::up);
  CHECK(sender->name() == bus.name());
  CHECK(sender->last_error().empty());
}

TEST_CASE("the embedded bus refuses what no CAN frame can be", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto port = bus.open(with_echo);
  for (const CanFrame& frame :
       {data_frame(1, 9), data_frame(0x800, 1), CanFrame{.id = 0x20000000, .is_extended = true}}) {
    const auto sent = port->send(frame);
    REQUIRE_FALSE(sent);
    CHECK(sent.error() == SendError::refused);
  }
  CHECK(port->last_error().find("3 frames refused") != std::string::npos);
  ReceivedFrame received;
  CHECK(port->read(received) == ReadStatus::empty);
}

TEST_CASE("an own frame comes back only where it is asked for, and is marked", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto echoing = bus.open(with_echo);
  const auto quiet = bus.open();
  REQUIRE(echoing->send(numbered(1, 1)));
  REQUIRE(quiet->send(numbered(2, 2)));
  ReceivedFrame received;
  REQUIRE(echoing->read(received) == ReadStatus::frame);
  CHECK(received.frame.id == 1);
  CHECK(received.is_own);
  REQUIRE(echoing->read(received) == ReadStatus::frame);
  CHECK(received.frame.id == 2);
  CHECK_FALSE(received.is_own);
  REQUIRE(quiet->read(received) == ReadStatus::frame);
  CHECK(received.frame.id == 1);
  CHECK_FALSE(received.is_own);
  CHECK(quiet->read(received) == ReadStatus::empty);
}

TEST_CASE("a filter on identifiers passes these data frames and nothing else", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto sender = bus.open();
  const auto filtered = bus.open({.receive_ids = {0x123, 0x7FF}});
  REQUIRE(sender->send(data_frame(0x122, 1)));
  REQUIRE(sender->send(CanFrame{.id = 0x123, .is_extended = true}));
  REQUIRE(sender->send(CanFrame{.id = 0x123, .is_remote = true}));
  REQUIRE(sender->send(CanFrame{.id = 0x123, .is_error = true}));
  REQUIRE(sender->send(data_frame(0x7FF, 2)));
  REQUIRE(sender->send(data_frame(0x123, 3)));
  ReceivedFrame received;
  REQUIRE(filtered->read(received) == ReadStatus::frame);
  CHECK(received.frame == data_frame(0x7FF, 2));
  REQUIRE(filtered->read(received) == ReadStatus::frame);
  CHECK(received.frame == data_frame(0x123, 3));
  CHECK(filtered->read(received) == ReadStatus::empty);
  CHECK_FALSE(is_readable(filtered->fd(), 0));
  CHECK(filtered->frames_lost() == 0);
}

TEST_CASE("a flood of frames that do not pass the filter gives the caller his turn",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto sender = bus.open();
  const auto filtered = bus.open({.receive_ids = {0x123}});
  for (std::uint32_t i = 0; i < 3000; ++i) REQUIRE(sender->send(numbered(1, i)));
  REQUIRE(sender->send(data_frame(0x123, 0)));
  ReceivedFrame received;
  int returns = 0;
  while (filtered->read(received) != ReadStatus::frame) {
    ++returns;
    REQUIRE(is_readable(filtered->fd(), 0));
  }
  CHECK(returns == 2);
}

TEST_CASE("a name that no bus can have is refused with what is wanted", "[integration][embedded_bus]") {
  for (const std::string name : {"", "a/b", "..//x", "a b", "\xC3\xA4", "a:b", "abcdefghijklmnopqrstuvwxyz0123456"}) {
    const auto port = open_bus("unix:" + name, {});
    REQUIRE_FALSE(port);
    CHECK(to_text(port.error()).find("expected a bus name") != std::string::npos);
  }
  const auto port = open_bus("unix:x", {.receive_ids = {0x800}});
  REQUIRE_FALSE(port);
  CHECK(to_text(port.error()).find("11 bits") != std::string::npos);
}

TEST_CASE("a file that is no bus of this version, or not a plain file, is refused",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  SECTION("other contents") {
    const OwnedFd file(::open(bus.path().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    REQUIRE(::write(file.get(), "something", 9) == 9);
    CHECK(bus.refusal().find("another version") != std::string::npos);
  }
  SECTION("a symbolic link") {
    REQUIRE(symlink("/dev/zero", bus.path().c_str()) == 0);
    CHECK(bus.refusal().find(bus.path()) != std::string::npos);
  }
  SECTION("a pipe") {
    REQUIRE(mkfifo(bus.path().c_str(), 0600) == 0);
    CHECK(bus.refusal().find("not a plain file") != std::string::npos);
  }
}

TEST_CASE("a file of another user is refused", "[integration][embedded_bus]") {
  const TestBus bus;
  const OwnedFd file(::open(bus.path().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (fchown(file.get(), 65534, 65534) != 0) {
    WARN("skipped: giving a file away needs privileges");
    return;
  }
  CHECK(bus.refusal().find("one user") != std::string::npos);
}

TEST_CASE("a participant in another network namespace is refused, unless it is alone",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  // Forked first: a copy of this process's port in the child would count as a participant.
  Child elsewhere([&](const Line& line) {
    if (unshare(CLONE_NEWNET) != 0 || !line.tell()) return 77;
    if (!line.wait() || bus.refusal().find("another network namespace") == std::string::npos) return 1;
    if (!line.tell() || !line.wait()) return 2;
    return bus.try_open() != nullptr ? 0 : 3;
  });
  if (!elsewhere.line().wait()) {
    REQUIRE(elsewhere.exit_code() == 77);
    WARN("skipped: a network namespace needs privileges");
    return;
  }
  auto here = bus.open();
  REQUIRE(elsewhere.line().tell());
  REQUIRE(elsewhere.line().wait());
  here = nullptr;
  REQUIRE(elsewhere.line().tell());
  CHECK(elsewhere.exit_code() == 0);
  here = bus.open();  // and back
}

TEST_CASE("the 33rd participant is refused and gets in when one has left", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  std::vector<std::unique_ptr<BusPort>> ports;
  for (unsigned i = 0; i < EmbeddedRing::participant_count; ++i) ports.push_back(bus.open());
  CHECK(bus.refusal().find("is full") != std::string::npos);
  ports.erase(ports.begin() + 7);
  ports.push_back(bus.open());
  REQUIRE(ports.back()->send(numbered(1, 1)));
  ReceivedFrame received;
  for (std::size_t i = 0; i + 1 < ports.size(); ++i) CHECK(ports[i]->read(received) == ReadStatus::frame);
}

TEST_CASE("the numbers of killed participants are free at once", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  Child crowd([&](const Line& line) {
    std::vector<std::unique_ptr<BusPort>> ports(EmbeddedRing::participant_count);
    for (auto& port : ports) port = bus.try_open();
    if (ports.back() == nullptr || !line.tell()) return 1;
    return line.wait() ? 0 : 1;
  });
  REQUIRE(crowd.line().wait());
  CHECK(bus.refusal().find("is full") != std::string::npos);
  crowd.kill();
  std::vector<std::unique_ptr<BusPort>> ports;
  for (unsigned i = 0; i < EmbeddedRing::participant_count; ++i) ports.push_back(bus.open());
}

TEST_CASE("the descriptor is readable exactly while there is something to read", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto sender = bus.open();
  const auto receiver = bus.open();
  CHECK_FALSE(is_readable(receiver->fd(), 0));
  for (std::uint32_t i = 0; i < 3; ++i) REQUIRE(sender->send(numbered(1, i)));
  ReceivedFrame received;
  for (int i = 0; i < 3; ++i) {
    CHECK(is_readable(receiver->fd(), 0));  // before the first read, and after a partial one
    CHECK(receiver->read(received) == ReadStatus::frame);
  }
  CHECK(receiver->read(received) == ReadStatus::empty);
  CHECK_FALSE(is_readable(receiver->fd(), 0));
  CHECK(receiver->read(received) == ReadStatus::empty);
  CHECK_FALSE(is_readable(receiver->fd(), 0));
  REQUIRE(sender->send(numbered(1, 4)));
  CHECK(is_readable(receiver->fd(), 0));
}

TEST_CASE("who joins late gets what is sent from then on", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto sender = bus.open();
  for (std::uint32_t i = 0; i < 5000; ++i) REQUIRE(sender->send(numbered(1, i)));
  const auto late = bus.open();
  ReceivedFrame received;
  CHECK(late->read(received) == ReadStatus::empty);
  REQUIRE(sender->send(numbered(1, 5000)));
  REQUIRE(late->read(received) == ReadStatus::frame);
  CHECK(received.frame == numbered(1, 5000));
  CHECK(late->frames_lost() == 0);
}

TEST_CASE("a reader that is too slow goes on near the end and counts exactly what it lost",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto sender = bus.open();
  const auto slow = bus.open();
  Record record(*slow);
  std::uint32_t sent = 0;
  const auto send = [&](std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) REQUIRE(sender->send(numbered(1, sent++)));
  };
  send(EmbeddedRing::slot_count);
  record.read_all();
  CHECK(slow->frames_lost() == 0);  // a full ring is within the limit
  CHECK(record.position() == sent);
  for (const std::uint64_t burst : {std::uint64_t{1}, std::uint64_t{2}, 3 * EmbeddedRing::slot_count + 17}) {
    const std::uint64_t lost_before = slow->frames_lost();
    send(EmbeddedRing::slot_count + burst);
    record.read_all();
    CHECK(slow->frames_lost() == lost_before + EmbeddedRing::slot_count / 2 + burst);
    CHECK(record.position() == sent);
  }
  CHECK(record.are_intact());
  CHECK(record.seen().back().position + 1 == sent);
  for (const Sighting& sighting : record.seen()) {
    REQUIRE(sighting.word == (std::uint64_t{1} << 32 | (sighting.position + 1)));
  }
}

TEST_CASE("a frame whose writer died before it woke anybody comes with the next frame or with maintain",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto receiver = bus.open();
  const RawMemory memory(bus);
  RingWriter dead(memory.ring(), 31);
  dead.publish(numbered(31, 1));
  CHECK_FALSE(is_readable(receiver->fd(), 0));
  SECTION("maintain") {
    receiver->maintain();
  }
  SECTION("another sender") {
    REQUIRE(bus.open()->send(numbered(1, 1)));
  }
  REQUIRE(is_readable(receiver->fd(), 0));
  ReceivedFrame received;
  REQUIRE(receiver->read(received) == ReadStatus::frame);
  CHECK(received.frame == numbered(31, 1));
}

TEST_CASE("a writer that died before it moved the head blocks nobody, and its frame is not news to newcomers",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto sender = bus.open();
  const auto receiver = bus.open();
  const RawMemory memory(bus);
  RingWriter(memory.ring(), 31).publish(numbered(31, 1));
  --memory.ring().head;
  const auto newcomer = bus.open();
  REQUIRE(sender->send(numbered(1, 1)));
  ReceivedFrame received;
  REQUIRE(receiver->read(received) == ReadStatus::frame);
  CHECK(received.frame == numbered(31, 1));
  REQUIRE(receiver->read(received) == ReadStatus::frame);
  CHECK(received.frame == numbered(1, 1));
  REQUIRE(newcomer->read(received) == ReadStatus::frame);
  CHECK(received.frame == numbered(1, 1));
}

TEST_CASE("a number's new owner leaves alone what its predecessors published last",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto receiver = bus.open();
  const RawMemory memory(bus);
  Record record(*receiver);
  // Each owner publishes a few frames, so that the owners share the ring's entries in varying combinations.
  std::uint32_t sent = 0;
  for (int owner = 0; owner < 5000; ++owner) {
    RingWriter writer(memory.ring(), 31);
    for (int i = 0; i < owner % 4; ++i) writer.publish(numbered(31, sent++));
    if (owner % 1000 != 999) continue;
    receiver->maintain();
    record.read_all();
  }
  CHECK(record.received() == sent);
  CHECK(record.are_intact());
  CHECK(is_each_sender_in_order(record.seen()));
}

TEST_CASE("the last participant that leaves takes the file away, and nobody else does",
          "[integration][embedded_bus][bus]") {
  const TestBus bus;
  auto first = bus.open();
  auto second = bus.open();
  first = nullptr;
  CHECK(access(bus.path().c_str(), F_OK) == 0);
  first = bus.open();
  REQUIRE(second->send(numbered(1, 1)));
  ReceivedFrame received;
  CHECK(first->read(received) == ReadStatus::frame);
  second = nullptr;
  first = nullptr;
  CHECK(access(bus.path().c_str(), F_OK) != 0);
}

TEST_CASE("a file of the same name that others made since is left to them", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  auto old = bus.open();
  REQUIRE(unlink(bus.path().c_str()) == 0);
  const auto other = bus.open();
  old = nullptr;
  other->maintain();
  CHECK(other->last_error().empty());
}

TEST_CASE("whoever joins while others leave meets those who stay", "[integration][embedded_bus][bus][slow]") {
  constexpr int turns = 1'500;
  const TestBus bus;
  std::vector<std::thread> threads;
  std::vector<int> unmet(3, 0);
  for (std::uint32_t thread = 0; thread < unmet.size(); ++thread) {
    threads.emplace_back([&, thread] {
      for (std::uint32_t turn = 0; turn < turns; ++turn) {
        const auto stays = bus.try_open({.receive_ids = {thread + 1}});
        const auto joins = bus.try_open();
        const bool is_sent = stays != nullptr && joins != nullptr && joins->send(numbered(thread + 1, turn));
        ReceivedFrame received;
        if (!is_sent || stays->read(received) != ReadStatus::frame) ++unmet[thread];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(unmet == std::vector<int>{0, 0, 0});
  CHECK(bus.open() != nullptr);
}

TEST_CASE("a bus whose file was removed says so", "[integration][embedded_bus][bus]") {
  const TestBus bus;
  const auto port = bus.open();
  port->maintain();
  CHECK(port->last_error().empty());
  REQUIRE(unlink(bus.path().c_str()) == 0);
  port->maintain();
  CHECK(port->last_error().find("was removed") != std::string::npos);
}

TEST_CASE("three processes sending at once are heard by all in one order", "[integration][embedded_bus][bus]") {
  constexpr std::uint32_t frames_each = 20000;
  constexpr std::uint64_t total = std::uint64_t{3} * frames_each;
  const TestBus bus;
  void* memory = mmap(nullptr, 3 * total * sizeof(Sighting), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  REQUIRE(memory != MAP_FAILED);
  const std::span<Sighting> shared(static_cast<Sighting*>(memory), 3 * total);

  const auto listener = bus.open();
  std::vector<std::unique_ptr<Child>> senders;
  for (std::uint32_t sender = 0; sender < 3; ++sender) {
    senders.push_back(std::make_unique<Child>([&, sender](const Line& line) {
      const auto port = bus.try_open(with_echo);
      if (port == nullptr || !line.tell() || !line.wait()) return 1;
      Record record(*port);
      if (!send_and_read(*port, record, sender + 1, frames_each, total)) return 2;
      std::copy(record.seen().begin(), record.seen().end(), shared.subspan(sender * total, total).begin());
      return record.are_intact() ? 0 : 3;
    }));
    REQUIRE(senders.back()->line().wait());
  }
  for (const auto& sender : senders) REQUIRE(sender->line().tell());
  Record record(*listener);
  CHECK(read_up_to(record, *listener, total));
  for (const auto& sender : senders) CHECK(sender->exit_code() == 0);

  CHECK(record.are_intact());
  CHECK(is_each_sender_in_order(record.seen()));
  for (std::uint32_t sender = 0; sender < 3; ++sender) {
    const std::span<const Sighting> place = shared.subspan(sender * total, total);
    const auto end = std::find_if(place.begin(), place.end(), [](const Sighting& one) { return one.word == 0; });
    const std::span<const Sighting> seen(place.begin(), end);
    CHECK_FALSE(seen.empty());
    CHECK(is_same_order(record.seen(), seen));
    CHECK(is_each_sender_in_order(seen));
  }
  munmap(memory, shared.size_bytes());
}

TEST_CASE("threads with ports of their own are participants like processes", "[integration][embedded_bus][bus]") {
  constexpr std::uint32_t frames_each = 5000;
  constexpr std::uint64_t total = std::uint64_t{3} * frames_each;
  const TestBus bus;
  std::vector<std::unique_ptr<BusPort>> ports;
  std::vector<Record> records;
  ports.reserve(4);
  records.reserve(4);
  for (int i = 0; i < 4; ++i) {
    ports.push_back(bus.open(with_echo));
    records.emplace_back(*ports.back());
  }
  std::vector<char> is_done(ports.size(), 0);
  std::vector<std::thread> threads;
  for (std::uint32_t i = 0; i < 4; ++i) {
    threads.emplace_back([&, i] {
      is_done[i] = i == 3 ? read_up_to(records[i], *ports[i], total)
                          : send_and_read(*ports[i], records[i], i + 1, frames_each, total);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < ports.size(); ++i) {
    CHECK(is_done[i]);
    CHECK(records[i].are_intact());
    CHECK(is_same_order(records[3].seen(), records[i].seen()));
    CHECK(is_each_sender_in_order(records[i].seen()));
  }
}

/// Sends at the maximum rate until it is killed.
[[nodiscard]] int babble(const TestBus& bus, const Line& line, std::uint32_t first_number) {
  const auto port = bus.try_open();
  if (port == nullptr || !line.tell()) return 1;
  for (std::uint32_t number = first_number;; ++number) {
    if (!port->send(numbered(0x100, number))) return 2;
  }
}

TEST_CASE("participants killed in the middle of sending leave a working bus in one order",
          "[integration][embedded_bus][bus]") {
  const std::uint64_t seed = test_seed();
  INFO("repeat with BMUD_TEST_SEED=" << seed);
  Random random(seed);
  const TestBus bus;
  const auto one = bus.open(with_echo);
  const auto other = bus.open(with_echo);
  std::uint64_t wanted = 0;
  std::uint64_t heard = 0;
  for (std::uint32_t round = 0; round < 200; ++round) {
    Record first(*one);
    Record second(*other);
    Child victim([&](const Line& line) { return babble(bus, line, 0); });
    REQUIRE(victim.line().wait());
    const std::uint64_t reads = random.below(600);
    for (std::uint64_t i = 0; i < reads; ++i) {
      REQUIRE(first.wait_for_one());
      if (i % 16 == 0) REQUIRE(one->send(numbered(0x200, static_cast<std::uint32_t>(i))));
    }
    victim.kill();
    REQUIRE(one->send(numbered(0x300, round)));
    first.read_all();
    second.read_all();

    REQUIRE(first.position() == second.position());
    REQUIRE(is_same_order(first.seen(), second.seen()));
    REQUIRE(is_each_sender_in_order(first.seen()));
    for (const Record* record : {&first, &second}) {
      REQUIRE(record->seen().back().word == (std::uint64_t{0x300} << 32 | (round + 1)));
      REQUIRE(record->seen().back().position + 1 == record->position());
    }
    REQUIRE(first.are_intact());
    REQUIRE(second.are_intact());
    wanted += reads;
    heard += first.received();
  }
  CHECK(heard > wanted);
}

TEST_CASE("a participant stopped in the middle of sending holds up nobody", "[integration][embedded_bus][bus]") {
  const std::uint64_t seed = test_seed();
  INFO("repeat with BMUD_TEST_SEED=" << seed);
  Random random(seed);
  const TestBus bus;
  const auto one = bus.open();
  const auto other = bus.open();
  Child stopped([&](const Line& line) { return babble(bus, line, 0); });
  REQUIRE(stopped.line().wait());
  for (std::uint32_t round = 0; round < 100; ++round) {
    ReceivedFrame received;
    for (std::uint64_t i = random.below(300); i > 0; --i) static_cast<void>(other->read(received));
    stopped.stop();
    other->maintain();
    while (other->read(received) != ReadStatus::empty) continue;
    for (std::uint32_t i = 0; i < 20; ++i) {
      REQUIRE(one->send(numbered(0x200, i)));
      REQUIRE(is_readable(other->fd(), 0));
      REQUIRE(other->read(received) == ReadStatus::frame);
      REQUIRE(received.frame == numbered(0x200, i));
      REQUIRE(other->read(received) == ReadStatus::empty);
    }
    stopped.resume();
  }
}

/// Waits for a frame like a loop around poll(); false if it is not woken.
[[nodiscard]] bool await_frame(BusPort& port, ReceivedFrame& received) {
  while (port.read(received) != ReadStatus::frame) {
    if (!is_readable(port.fd(), patience_ms)) return false;
  }
  return true;
}

TEST_CASE("no wake-up is lost in a game of ping-pong", "[integration][embedded_bus][bus]") {
  constexpr std::uint32_t rounds = 20000;
  const TestBus bus;
  const auto ping = bus.open();
  Child pong([&](const Line& line) {
    const auto port = bus.try_open();
    if (port == nullptr || !line.tell()) return 1;
    ReceivedFrame received;
    for (std::uint32_t i = 0; i < rounds; ++i) {
      if (!await_frame(*port, received)) return 2;
      if (!port->send(numbered(2, number_of(received.frame)))) return 3;
    }
    return 0;
  });
  REQUIRE(pong.line().wait());
  ReceivedFrame received;
  for (std::uint32_t i = 0; i < rounds; ++i) {
    REQUIRE(ping->send(numbered(1, i)));
    REQUIRE(await_frame(*ping, received));
    REQUIRE(received.frame == numbered(2, i));
  }
  CHECK(pong.exit_code() == 0);
}

/// Waits actively: so short a sleep is not possible.
void linger(std::uint64_t time_ns) {
  const TimePoint until = monotonic_now() + std::chrono::nanoseconds(time_ns);
  while (monotonic_now() < until) continue;
}

TEST_CASE("no wake-up is lost where one frame is read for each", "[integration][embedded_bus][bus]") {
  constexpr std::uint32_t rounds = 15000;
  constexpr std::uint32_t burst = 2;
  const std::uint64_t seed = test_seed();
  INFO("repeat with BMUD_TEST_SEED=" << seed);
  Random random(seed);
  const TestBus bus;
  const auto sender = bus.open();
  Child frugal([&](const Line& line) {
    const auto port = bus.try_open();
    if (port == nullptr || !line.tell()) return 1;
    ReceivedFrame received;
    for (std::uint32_t number = 0; number < rounds * burst;) {
      if (!is_readable(port->fd(), patience_ms)) return 2;
      if (port->read(received) != ReadStatus::frame) continue;
      if (received.frame != numbered(1, number++)) return 3;
      if (number % burst == 0 && !port->send(numbered(2, number))) return 4;
    }
    return 0;
  });
  REQUIRE(frugal.line().wait());
  ReceivedFrame received;
  for (std::uint32_t number = 0; number < rounds * burst;) {
    // A wake-up is most likely to be lost at the moment when the other side goes to sleep.
    linger(random.below(2'000));
    for (const CanFrame& frame : {numbered(1, number), numbered(1, number + 1)}) static_cast<void>(sender->send(frame));
    number += burst;
    const TimePoint deadline = monotonic_now() + std::chrono::milliseconds(patience_ms);
    while (sender->read(received) != ReadStatus::frame) {
      if (monotonic_now() > deadline) FAIL("the reader sleeps on");
    }
  }
  CHECK(frugal.exit_code() == 0);
}

TEST_CASE("a reader stopped in the middle of a frame notices that it was overtaken",
          "[integration][embedded_bus][bus]") {
  const std::uint64_t seed = test_seed();
  INFO("repeat with BMUD_TEST_SEED=" << seed);
  Random random(seed);
  const TestBus bus;
  const auto sender = bus.open();
  const RawMemory memory(bus);
  Child reader([&](const Line& line) {
    RingReader ring_reader(memory.ring());  // without a port around it, so that it spends most time on copying frames
    if (!line.tell()) return 1;
    RingReader::Item item;
    for (std::uint64_t read = 0; item.frame.id != 2;) {
      if (!ring_reader.next(item)) continue;
      if (number_of(item.frame) != read++ + ring_reader.frames_lost() || !is_intact(item.frame)) return 3;
    }
    return 0;
  });
  REQUIRE(reader.line().wait());
  std::uint32_t sent = 0;
  const auto send = [&](std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) static_cast<void>(sender->send(numbered(1, sent++)));
  };
  for (int round = 0; round < 1000; ++round) {
    reader.stop();
    send(EmbeddedRing::slot_count - 1);
    reader.resume();
    linger(random.below(200'000));
    reader.stop();
    send(EmbeddedRing::entry_count + 1);  // so that every entry it may be reading belongs to another frame by then
    reader.resume();
  }
  REQUIRE(sender->send(numbered(2, sent)));
  CHECK(reader.exit_code() == 0);
}

}  // namespace
}  // namespace bmu
