// The SocketCAN port on interfaces that appear and disappear, and with failing system calls: the kernel is emulated
// here, as measured on Linux 6.1, because many build machines have a kernel without CAN.
#include "daemon/shell/can/can_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fcntl.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "daemon/shell/can/bus_port.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"

namespace bmu {
namespace {

/// A kernel with any number of CAN interfaces and sockets. The descriptor of a socket is a real one, and readable when
/// the socket is.
class FakeKernel final : public CanSystem {
 public:
  struct Queued {
    can_frame frame{};
    int flags = 0;
    std::uint32_t dropped = 0;
    int bytes = CAN_MTU;
  };
  struct Socket {
    OwnedFd fd;
    int interface_index = 0;
    bool is_bound = false;
    int error = 0;
    bool receives_own = false;
    std::vector<can_filter> filters{{.can_id = 0, .can_mask = 0}};
    can_err_mask_t error_mask = 0;
    std::deque<Queued> queue;
    std::uint32_t dropped = 0;
    bool tells_dropped = false;
    std::map<int, int> options;  // of SOL_SOCKET
  };

  // Events of interfaces.

  void add(const std::string& name, bool is_running = true) {
    interfaces_[name] = {.index = ++last_index_, .is_running = is_running};
  }
  void set_up(const std::string& name) { interfaces_.at(name).is_running = true; }
  void set_down(const std::string& name) {
    lose_carrier(name);
    raise(interfaces_.at(name).index, ENETDOWN);
  }
  /// No socket is notified of this, and sending continues to succeed.
  void lose_carrier(const std::string& name) { interfaces_.at(name).is_running = false; }
  /// Sockets stay unbound and lose their filters permanently.
  void remove(const std::string& name, int error = ENODEV) {
    const int index = interfaces_.at(name).index;
    interfaces_.erase(name);
    raise(index, error);
    for (auto& [fd, socket] : sockets_) {
      if (socket.interface_index != index) continue;
      socket.interface_index = 0;
      socket.filters.clear();
      socket.error_mask = 0;
    }
  }

  // Events of the bus.

  void frame_arrives(const std::string& name, const can_frame& frame, int flags = 0, int bytes = CAN_MTU) {
    for (auto& [fd, socket] : sockets_) {
      if (socket.interface_index != interfaces_.at(name).index || !wants(socket, frame)) continue;
      if (socket.queue.size() == queue_max) {
        ++socket.dropped;
        continue;
      }
      socket.queue.push_back({.frame = frame, .flags = flags, .dropped = socket.dropped, .bytes = bytes});
      refresh(socket);
    }
  }

  // Failures of calls.

  /// The nth call from now on (0 is the next) fails with this error and has no effect.
  void fail_call(int n, int error) {
    calls_until_failure_ = n;
    failure_ = error;
  }
  [[nodiscard]] bool is_failure_pending() const { return calls_until_failure_ >= 0; }
  std::map<std::string, std::uint32_t> bit_rates;  // by interface; others have none
  std::vector<int> known_indexes;                  // of every look_up
  int open_error = 0;                              // of every open_socket
  int send_error = 0;                              // of every send

  // Observable results.

  [[nodiscard]] std::map<int, Socket>& sockets() { return sockets_; }
  [[nodiscard]] Socket& data_socket() {
    return std::find_if(sockets_.begin(), sockets_.end(), [](auto& s) { return s.second.error_mask == 0; })->second;
  }
  [[nodiscard]] bool is_configured_after_bind() const { return is_configured_after_bind_; }
  std::vector<can_frame> sent;
  static constexpr std::size_t queue_max = 278;

  // The emulated calls.

  int open_socket() override {
    if (const int error = failing(); error != 0) return -error;
    if (open_error != 0) return -open_error;
    OwnedFd fd(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    const int number = fd.get();
    sockets_[number].fd = std::move(fd);
    return number;
  }
  void close_socket(int fd) override { sockets_.erase(fd); }
  int set_option(int fd, int level, int option, const void* value, socklen_t length) override {
    if (const int error = failing(); error != 0) return -error;
    Socket& socket = sockets_.at(fd);
    is_configured_after_bind_ = is_configured_after_bind_ || socket.is_bound;
    int number = 0;
    if (option != CAN_RAW_FILTER) std::memcpy(&number, value, std::min(sizeof(number), std::size_t{length}));
    if (level == SOL_SOCKET) {
      if (option == SO_RCVBUFFORCE) return -EPERM;
      socket.tells_dropped = socket.tells_dropped || option == SO_RXQ_OVFL;
      socket.options[option] = number;
      return 0;
    }
    if (option == CAN_RAW_FILTER) return set_filters(socket, value, length);
    if (option == CAN_RAW_ERR_FILTER) socket.error_mask = static_cast<can_err_mask_t>(number);
    if (option == CAN_RAW_RECV_OWN_MSGS) socket.receives_own = number != 0;
    return 0;
  }
  int bind_to(int fd, int interface_index) override {
    if (const int error = failing(); error != 0) return -error;
    const auto is_it = [&](const auto& entry) { return entry.second.index == interface_index; };
    const auto found = std::find_if(interfaces_.begin(), interfaces_.end(), is_it);
    if (found == interfaces_.end()) return -ENODEV;
    Socket& socket = sockets_.at(fd);
    socket.interface_index = interface_index;
    socket.is_bound = true;
    if (!found->second.is_running) socket.error = ENETDOWN;
    refresh(socket);
    return 0;
  }
  int take_error(int fd) override {
    Socket& socket = sockets_.at(fd);
    const int error = std::exchange(socket.error, 0);
    refresh(socket);
    return error;
  }
  int receive(int fd, msghdr& message) override {
    if (const int error = failing(); error != 0) return -error;
    Socket& socket = sockets_.at(fd);
    if (const int error = take_error(fd); error != 0) return -error;
    if (socket.queue.empty()) return -EAGAIN;
    const Queued next = socket.queue.front();
    socket.queue.pop_front();
    refresh(socket);
    std::memcpy(message.msg_iov[0].iov_base, &next.frame, sizeof(next.frame));
    message.msg_flags = next.flags;
    tell_dropped(message, socket.tells_dropped ? next.dropped : 0);
    return next.bytes;
  }
  int send(int fd, const can_frame& frame) override {
    if (const int error = failing(); error != 0) return -error;
    if (send_error != 0) return -send_error;
    if (const int error = take_error(fd); error != 0) return -error;
    const int index = sockets_.at(fd).interface_index;
    if (index == 0) return -ENXIO;
    sent.push_back(frame);
    for (auto& [other_fd, socket] : sockets_) {
      if (socket.interface_index != index || !wants(socket, frame)) continue;
      if (other_fd == fd && !socket.receives_own) continue;
      const int flags = MSG_DONTROUTE | (other_fd == fd ? MSG_CONFIRM : 0);
      socket.queue.push_back({.frame = frame, .flags = flags, .dropped = socket.dropped});
      refresh(socket);
    }
    return CAN_MTU;
  }
  int look_up(const std::string& name, int known_index, CanInterface& out) override {
    known_indexes.push_back(known_index);
    if (const int error = failing(); error != 0) return -error;
    const auto found = interfaces_.find(name);
    if (found == interfaces_.end()) return -ENODEV;
    out = found->second;
    return 0;
  }
  int bit_rate(int interface_index, std::uint32_t& out_bit_per_s) override {
    out_bit_per_s = 0;
    if (const int error = failing(); error != 0) return -error;
    const auto is_it = [&](const auto& entry) { return entry.second.index == interface_index; };
    const auto found = std::find_if(interfaces_.begin(), interfaces_.end(), is_it);
    if (found == interfaces_.end()) return -ENODEV;
    if (const auto rate = bit_rates.find(found->first); rate != bit_rates.end()) out_bit_per_s = rate->second;
    return 0;
  }

 private:
  [[nodiscard]] static bool wants(const Socket& socket, const can_frame& frame) {
    if ((frame.can_id & CAN_ERR_FLAG) != 0) return (frame.can_id & socket.error_mask) != 0;
    const auto matches = [&](const can_filter& filter) {
      return (frame.can_id & filter.can_mask) == (filter.can_id & filter.can_mask);
    };
    return std::any_of(socket.filters.begin(), socket.filters.end(), matches);
  }
  static void refresh(Socket& socket) {
    eventfd_t count = 0;
    eventfd_read(socket.fd.get(), &count);
    if (!socket.queue.empty() || socket.error != 0) eventfd_write(socket.fd.get(), 1);
  }
  static int set_filters(Socket& socket, const void* value, socklen_t length) {
    const std::size_t count = length / sizeof(can_filter);
    if (count > CAN_RAW_FILTER_MAX) return -EINVAL;
    socket.filters.resize(count);
    if (count > 0) std::memcpy(socket.filters.data(), value, length);
    return 0;
  }
  static void tell_dropped(msghdr& message, std::uint32_t dropped) {
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (dropped == 0 || header == nullptr) {
      message.msg_controllen = 0;
      return;
    }
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SO_RXQ_OVFL;
    header->cmsg_len = CMSG_LEN(sizeof(dropped));
    std::memcpy(CMSG_DATA(header), &dropped, sizeof(dropped));
    message.msg_controllen = CMSG_SPACE(sizeof(dropped));
  }
  void raise(int interface_index, int error) {
    for (auto& [fd, socket] : sockets_) {
      if (socket.interface_index != interface_index) continue;
      socket.error = error;
      refresh(socket);
    }
  }
  [[nodiscard]] int failing() {
    if (calls_until_failure_ < 0 || calls_until_failure_-- > 0) return 0;
    return failure_;
  }

  std::map<std::string, CanInterface> interfaces_;
  std::map<int, Socket> sockets_;
  int last_index_ = 2;
  int calls_until_failure_ = -1;
  int failure_ = 0;
  bool is_configured_after_bind_ = false;
};

const PortOptions everything{.receive_ids = {}, .receive_own = true, .receive_errors = true};
const PortOptions patient{.receive_ids = {}, .receive_errors = true, .must_exist = false};

[[nodiscard]] can_frame wire_frame(std::uint32_t can_id, std::uint8_t length = 8) {
  can_frame frame{};
  frame.can_id = can_id;
  frame.can_dlc = length;
  for (std::uint8_t i = 0; i < CAN_MAX_DLEN && i < length; ++i) frame.data[i] = static_cast<std::uint8_t>(0xA0 + i);
  return frame;
}

[[nodiscard]] std::unique_ptr<BusPort> open_port(FakeKernel& kernel, const PortOptions& options = {}) {
  auto port = open_can_socket("can0", options, kernel);
  INFO((port ? "" : to_text(port.error())));
  REQUIRE(port);
  return std::move(*port);
}

[[nodiscard]] bool is_readable(const BusPort& port) {
  pollfd entry{.fd = port.fd(), .events = POLLIN, .revents = 0};
  return poll(&entry, 1, 0) == 1;
}

[[nodiscard]] ReadStatus read(BusPort& port) {
  ReceivedFrame ignored;
  return port.read(ignored);
}

/// Checks that both directions work.
void check_working(FakeKernel& kernel, BusPort& port) {
  CHECK(port.state() == BusState::up);
  CHECK(read(port) == ReadStatus::empty);
  CHECK_FALSE(is_readable(port));
  kernel.frame_arrives("can0", wire_frame(0x123));
  CHECK(is_readable(port));
  ReceivedFrame received;
  REQUIRE(port.read(received) == ReadStatus::frame);
  CHECK(received.frame.id == 0x123);
  CHECK(port.send(data_frame(0x321, 2)));
}

/// Checks that the loss is reported by a readable descriptor and one status, and only once.
void check_loss_told_once(BusPort& port, BusState state) {
  CHECK(is_readable(port));
  CHECK(read(port) == ReadStatus::down);
  CHECK(port.state() == state);
  CHECK(read(port) == ReadStatus::empty);
  CHECK_FALSE(is_readable(port));
  const auto sent = port.send(data_frame(1, 1));
  REQUIRE_FALSE(sent);
  CHECK(sent.error() == SendError::down);
  port.maintain();
  CHECK(port.state() == state);
  CHECK(read(port) == ReadStatus::empty);
  CHECK_FALSE(is_readable(port));
}

TEST_CASE("a kernel without CAN is told apart and leads to the embedded bus", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.open_error = EAFNOSUPPORT;
  for (const PortOptions& options : {PortOptions{}, patient}) {
    const auto port = open_can_socket("can0", options, kernel);
    REQUIRE_FALSE(port);
    CHECK(port.error().code == EAFNOSUPPORT);
    CHECK(to_text(port.error()).find("can0") != std::string::npos);
    CHECK(to_text(port.error()).find("unix:NAME") != std::string::npos);
  }
}

TEST_CASE("a name that no interface can have is refused", "[integration][can_socket]") {
  FakeKernel kernel;
  for (const std::string name : {"", "a/b", "can 0", "unix", "abcdefghijklmnop", "can0\n", "a:b"}) {
    const auto port = open_can_socket(name, {}, kernel);
    REQUIRE_FALSE(port);
    CHECK(port.error().code == (name == "unix" ? ENODEV : 0));
  }
}

TEST_CASE("a missing interface is an error, or is awaited where the options say so", "[integration][can_socket]") {
  FakeKernel kernel;
  const auto impatient = open_can_socket("can0", {}, kernel);
  REQUIRE_FALSE(impatient);
  CHECK(impatient.error().code == ENODEV);
  CHECK(kernel.sockets().empty());

  const auto port = open_port(kernel, patient);
  CHECK(port->state() == BusState::absent);
  CHECK(read(*port) == ReadStatus::empty);
  CHECK_FALSE(is_readable(*port));
  CHECK(port->send(data_frame(1, 1)).error() == SendError::down);
  kernel.add("can0");
  port->maintain();
  check_working(kernel, *port);
}

TEST_CASE("an interface that is in use is looked at by the index it has", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel);
  REQUIRE(kernel.known_indexes.front() == 0);
  const auto check_asked_by_index = [&] {
    kernel.known_indexes.clear();
    port->maintain();
    CHECK(kernel.known_indexes == std::vector<int>{kernel.sockets().begin()->second.interface_index});
  };
  check_asked_by_index();
  // The interface disappears and returns with another index.
  kernel.remove("can0");
  kernel.add("can0");
  REQUIRE(read(*port) == ReadStatus::down);
  port->maintain();
  REQUIRE(port->state() == BusState::up);
  check_asked_by_index();
}

TEST_CASE("frames of every kind cross the socket unchanged", "[integration][can_socket][MMU_6]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  const CanFrame standard{.id = 0x7FF, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 255}};
  const CanFrame extended{.id = 0x1FFFFFFF, .is_extended = true, .length = 3, .data = {9, 8, 7}};
  const CanFrame remote{.id = 5, .is_remote = true, .length = 4};
  const CanFrame error{.id = CAN_ERR_BUSOFF, .is_error = true, .length = 8};
  for (const CanFrame& frame : {standard, extended, remote, error, data_frame(0, 0)}) {
    REQUIRE(port->send(frame));
    ReceivedFrame received;
    const TimePoint before = monotonic_now();
    REQUIRE(port->read(received) == ReadStatus::frame);
    CHECK(received.frame == frame);
    CHECK(received.received_at >= before);
  }
  CHECK(kernel.sent[1].can_id == (0x1FFFFFFF | CAN_EFF_FLAG));
  CHECK(kernel.sent[2].can_id == (5 | CAN_RTR_FLAG));
  CHECK(port->last_error().empty());
}

TEST_CASE("only what was sent through this very port is own", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto echoing = open_port(kernel, everything);
  const auto quiet = open_port(kernel);
  REQUIRE(echoing->send(data_frame(1, 0)));
  REQUIRE(quiet->send(data_frame(2, 0)));
  ReceivedFrame received;
  REQUIRE(echoing->read(received) == ReadStatus::frame);
  CHECK((received.frame.id == 1 && received.is_own));
  REQUIRE(echoing->read(received) == ReadStatus::frame);
  CHECK((received.frame.id == 2 && !received.is_own));
  REQUIRE(quiet->read(received) == ReadStatus::frame);
  CHECK((received.frame.id == 1 && !received.is_own));
  CHECK(quiet->read(received) == ReadStatus::empty);
}

TEST_CASE("filters are exact, and in the kernel before the socket hears anything", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, {.receive_ids = {0x7FF, 0x123, 0x123}});
  CHECK_FALSE(kernel.is_configured_after_bind());
  CHECK(kernel.data_socket().filters.size() == 2);
  for (const canid_t id : {0x122U, 0x123U | CAN_EFF_FLAG, 0x123U | CAN_RTR_FLAG, 0x7FFU}) {
    kernel.frame_arrives("can0", wire_frame(id));
  }
  CHECK(kernel.data_socket().queue.size() == 1);
  ReceivedFrame received;
  REQUIRE(port->read(received) == ReadStatus::frame);
  CHECK(received.frame.id == 0x7FF);
  CHECK(read(*port) == ReadStatus::empty);
}

TEST_CASE("more identifiers than the kernel takes filters are let through block by block, and nothing else",
          "[integration][can_socket]") {
  constexpr std::uint32_t filters_max = CAN_RAW_FILTER_MAX;
  const std::uint32_t count = GENERATE(512U, 513U);
  FakeKernel kernel;
  kernel.add("can0");
  PortOptions options;
  for (std::uint32_t id = 0; id < count; ++id) options.receive_ids.push_back(id);
  const auto port = open_port(kernel, options);
  CHECK(kernel.data_socket().filters.size() == (count == filters_max ? count : 2));  // 0 to 511, and 512
  for (const canid_t id : {count, 1 | CAN_EFF_FLAG, 1 | CAN_RTR_FLAG, count - 1}) {
    kernel.frame_arrives("can0", wire_frame(id));
  }
  ReceivedFrame received;
  REQUIRE(port->read(received) == ReadStatus::frame);
  CHECK(received.frame.id == count - 1);
  CHECK(read(*port) == ReadStatus::empty);
}

TEST_CASE("identifiers too scattered for the kernel's filters are filtered here", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  PortOptions options;
  for (std::uint32_t id = 0; id < 2 * (CAN_RAW_FILTER_MAX + 1); id += 2) options.receive_ids.push_back(id);
  const auto port = open_port(kernel, options);
  CHECK(kernel.data_socket().filters.size() == 1);
  for (const canid_t id : {3U, 4U}) kernel.frame_arrives("can0", wire_frame(id));
  ReceivedFrame received;
  REQUIRE(port->read(received) == ReadStatus::frame);
  CHECK(received.frame.id == 4);
  CHECK(read(*port) == ReadStatus::empty);
}

TEST_CASE("a flood of error frames neither pushes data out nor keeps it waiting", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  CHECK(kernel.sockets().size() == 2);
  for (int i = 0; i < 1000; ++i) kernel.frame_arrives("can0", wire_frame(CAN_ERR_FLAG | CAN_ERR_BUSERROR));
  kernel.frame_arrives("can0", wire_frame(0x123));
  ReceivedFrame first;
  ReceivedFrame second;
  REQUIRE(port->read(first) == ReadStatus::frame);
  REQUIRE(port->read(second) == ReadStatus::frame);
  CHECK(first.frame.is_error != second.frame.is_error);
  CHECK(port->frames_lost() == 0);  // no data frames were lost

  const auto deaf_to_errors = open_port(kernel);
  CHECK(kernel.sockets().size() == 3);
  kernel.frame_arrives("can0", wire_frame(CAN_ERR_FLAG | CAN_ERR_BUSERROR));
  CHECK(read(*deaf_to_errors) == ReadStatus::empty);
}

TEST_CASE("lost frames are counted over the wrap of the kernel's counter and over sockets",
          "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel);
  const auto receive_after_dropping = [&](std::uint32_t total) {
    kernel.data_socket().dropped = total;
    kernel.frame_arrives("can0", wire_frame(1));
    CHECK(read(*port) == ReadStatus::frame);
  };
  receive_after_dropping(0);
  CHECK(port->frames_lost() == 0);
  receive_after_dropping(5);
  receive_after_dropping(5);
  CHECK(port->frames_lost() == 5);
  receive_after_dropping(0xFFFFFFFF);
  receive_after_dropping(2);
  CHECK(port->frames_lost() == 0x100000002);
  kernel.remove("can0");
  kernel.add("can0");
  CHECK(read(*port) == ReadStatus::down);
  port->maintain();
  receive_after_dropping(3);
  CHECK(port->frames_lost() == 0x100000005);
}

TEST_CASE("buffers are large for what comes and small for what goes", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel);
  CHECK(kernel.data_socket().options.at(SO_RCVBUF) == 4 * 1024 * 1024);
  CHECK(kernel.data_socket().options.at(SO_SNDBUF) == 0);
}

TEST_CASE("what is no classic CAN frame is passed over", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel);
  kernel.frame_arrives("can0", wire_frame(1), 0, CANFD_MTU);
  kernel.frame_arrives("can0", wire_frame(2), MSG_TRUNC);
  kernel.frame_arrives("can0", wire_frame(3), 0, 8);
  kernel.frame_arrives("can0", wire_frame(4, 9));
  kernel.frame_arrives("can0", wire_frame(5));
  ReceivedFrame received;
  REQUIRE(port->read(received) == ReadStatus::frame);
  CHECK(received.frame.id == 5);
}

TEST_CASE("a flood of useless frames gives the caller his turn", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel);
  for (int i = 0; i < 200; ++i) kernel.frame_arrives("can0", wire_frame(1, 9));
  CHECK(read(*port) == ReadStatus::empty);
  CHECK(is_readable(*port));
  CHECK_FALSE(kernel.data_socket().queue.empty());
}

TEST_CASE("a full queue drops the frame and changes nothing else", "[integration][can_socket]") {
  const int error = GENERATE(EAGAIN, ENOBUFS);
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel);
  kernel.send_error = error;
  CHECK(port->send(data_frame(1, 1)).error() == SendError::queue_full);
  kernel.send_error = 0;
  check_working(kernel, *port);
}

TEST_CASE("what the system or we refuse to send is counted and named", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel);
  CHECK(port->send(data_frame(1, 9)).error() == SendError::refused);
  CHECK(port->send(data_frame(0x800, 1)).error() == SendError::refused);
  kernel.send_error = EPERM;
  CHECK(port->send(data_frame(1, 1)).error() == SendError::refused);
  CHECK(port->last_error() == "send to can0: Operation not permitted (3 sends refused so far)");
  kernel.send_error = 0;
  check_working(kernel, *port);
}

// Events of an interface, in the order in which sockets report them.

TEST_CASE("an interface that is down when the port opens is awaited on the same socket", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0", false);
  const auto port = open_port(kernel, everything);
  CHECK(port->state() == BusState::down);
  CHECK_FALSE(is_readable(*port));
  CHECK(read(*port) == ReadStatus::empty);
  CHECK(port->send(data_frame(1, 1)).error() == SendError::down);
  kernel.set_up("can0");
  port->maintain();
  check_working(kernel, *port);
}

TEST_CASE("an interface set down is told once, and works on the same socket once it is up",
          "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  const int fd = port->fd();
  const int socket = kernel.sockets().begin()->first;
  kernel.set_down("can0");
  check_loss_told_once(*port, BusState::down);
  kernel.set_up("can0");
  port->maintain();
  CHECK(kernel.sockets().begin()->first == socket);
  CHECK(port->fd() == fd);
  REQUIRE(port->send(data_frame(1, 0)));
  CHECK(read(*port) == ReadStatus::frame);
  check_working(kernel, *port);
}

TEST_CASE("an error left unread in the outage does not fail the first frame after it", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  kernel.set_down("can0");
  port->maintain();
  CHECK(port->state() == BusState::down);
  kernel.set_down("can0");
  kernel.set_up("can0");
  port->maintain();
  CHECK(port->send(data_frame(1, 0)));
  CHECK(read(*port) == ReadStatus::down);  // still the change since the last read
  CHECK(read(*port) == ReadStatus::frame);
  check_working(kernel, *port);
}

TEST_CASE("an interface that was down for less than a look is told too", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  kernel.set_down("can0");
  kernel.set_up("can0");
  SECTION("by reading") {
    CHECK(is_readable(*port));
  }
  SECTION("by sending") {
    CHECK(port->send(data_frame(1, 1)).error() == SendError::down);
  }
  CHECK(read(*port) == ReadStatus::down);
  CHECK(port->state() == BusState::down);
  port->maintain();
  check_working(kernel, *port);
}

TEST_CASE("an interface that is removed and created again is found by its name", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  const int fd = port->fd();
  SECTION("both errors are seen") {
    kernel.set_down("can0");
    CHECK(read(*port) == ReadStatus::down);
    kernel.remove("can0");
    CHECK(is_readable(*port));
    CHECK(read(*port) == ReadStatus::empty);  // the loss has been reported already
  }
  SECTION("the second error has overwritten the first") {
    kernel.remove("can0");
    check_loss_told_once(*port, BusState::absent);
  }
  SECTION("sending is the first to notice") {
    kernel.remove("can0", 0);
    CHECK(port->send(data_frame(1, 1)).error() == SendError::down);
    check_loss_told_once(*port, BusState::absent);
  }
  SECTION("maintain is the first to notice") {
    kernel.remove("can0", 0);
    port->maintain();
    check_loss_told_once(*port, BusState::absent);
  }
  CHECK(port->state() == BusState::absent);
  CHECK(kernel.sockets().empty());
  kernel.add("other");
  port->maintain();
  CHECK(port->state() == BusState::absent);
  kernel.add("can0");
  port->maintain();
  CHECK(port->fd() == fd);
  CHECK(kernel.sockets().size() == 2);
  check_working(kernel, *port);
}

TEST_CASE("an interface removed and created between two looks is noticed by its new index",
          "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  kernel.remove("can0", 0);  // as if another reader had consumed the error first
  kernel.add("can0");
  CHECK_FALSE(is_readable(*port));
  port->maintain();
  CHECK(is_readable(*port));
  CHECK(read(*port) == ReadStatus::down);
  check_working(kernel, *port);
}

TEST_CASE("a lost carrier, which no socket reports, is noticed by maintain", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  kernel.lose_carrier("can0");
  CHECK(port->send(data_frame(1, 0)));  // the kernel reports success
  CHECK(read(*port) == ReadStatus::frame);
  port->maintain();
  check_loss_told_once(*port, BusState::down);
  kernel.frame_arrives("can0", wire_frame(CAN_ERR_FLAG | CAN_ERR_RESTARTED));
  CHECK(read(*port) == ReadStatus::frame);  // error frames of the controller are received nevertheless
  kernel.set_up("can0");
  port->maintain();
  check_working(kernel, *port);
}

TEST_CASE("the bit rate is asked for whenever the interface has come up", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  kernel.bit_rates["can0"] = 500'000;
  const auto port = open_port(kernel, patient);
  CHECK(port->rate_bit_per_s() == 500'000);
  // It can change while the interface is down.
  kernel.set_down("can0");
  port->maintain();
  CHECK(port->state() == BusState::down);
  CHECK(port->rate_bit_per_s() == 500'000);
  kernel.bit_rates["can0"] = 250'000;
  kernel.set_up("can0");
  port->maintain();
  CHECK(port->rate_bit_per_s() == 250'000);
  // Without the interface there is no bit rate; after its return there is another.
  kernel.remove("can0");
  port->maintain();
  CHECK(port->rate_bit_per_s() == 0);
  kernel.bit_rates["can0"] = 125'000;
  kernel.add("can0", false);
  port->maintain();
  CHECK(port->rate_bit_per_s() == 0);  // only after it is up
  kernel.set_up("can0");
  port->maintain();
  CHECK(port->rate_bit_per_s() == 125'000);
  CHECK(read(*port) == ReadStatus::down);
  check_working(kernel, *port);
}

TEST_CASE("a bus without a bit rate, or of which none can be had, works all the same", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  CHECK(port->rate_bit_per_s() == 0);
  CHECK(port->last_error().empty());
  kernel.bit_rates["can0"] = 500'000;
  kernel.set_down("can0");
  CHECK(read(*port) == ReadStatus::down);
  kernel.set_up("can0");
  kernel.fail_call(2, EAFNOSUPPORT);  // two checks of the interface come first
  port->maintain();
  CHECK_FALSE(kernel.is_failure_pending());
  CHECK(port->rate_bit_per_s() == 0);
  CHECK(port->last_error() == "ask for the bit rate of can0: Address family not supported by protocol");
  check_working(kernel, *port);
}

TEST_CASE("an interface that comes back down is down, not absent", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  kernel.remove("can0");
  CHECK(read(*port) == ReadStatus::down);
  kernel.add("can0", false);
  port->maintain();
  CHECK(port->state() == BusState::down);
  CHECK(read(*port) == ReadStatus::empty);
  kernel.set_up("can0");
  port->maintain();
  check_working(kernel, *port);
}

TEST_CASE("when nobody can tell how the interface is, nothing changes", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  const auto port = open_port(kernel, everything);
  kernel.fail_call(0, EMFILE);
  port->maintain();
  CHECK(port->last_error().find("can0") != std::string::npos);
  check_working(kernel, *port);
}

TEST_CASE("whatever call fails while the port opens, it opens or says why, and keeps nothing",
          "[integration][can_socket]") {
  int refusals = 0;
  for (int n = 0;; ++n) {
    FakeKernel kernel;
    kernel.add("can0");
    kernel.fail_call(n, ENOMEM);
    auto port = open_can_socket("can0", everything, kernel);
    if (kernel.is_failure_pending()) break;
    if (port) {
      check_working(kernel, **port);
    } else {
      ++refusals;
      CHECK(port.error().code == ENOMEM);
      CHECK(port.error().what.find("can0") != std::string::npos);
      CHECK(kernel.sockets().empty());
    }
  }
  CHECK(refusals >= 8);
}

TEST_CASE("whatever call fails while an interface comes back, a later look succeeds", "[integration][can_socket]") {
  const int error = GENERATE(EMFILE, ENETDOWN, ENODEV);
  int failures = 0;
  for (int n = 0;; ++n) {
    FakeKernel kernel;
    kernel.add("can0");
    const auto port = open_port(kernel, everything);
    kernel.remove("can0");
    CHECK(read(*port) == ReadStatus::down);
    kernel.add("can0");
    kernel.fail_call(n, error);
    port->maintain();
    if (kernel.is_failure_pending()) break;
    if (port->state() != BusState::up) {
      ++failures;
      CHECK(port->last_error().find("can0") != std::string::npos);
      CHECK(port->send(data_frame(1, 1)).error() == SendError::down);
      CHECK(kernel.sockets().size() % 2 == 0);  // both sockets or none
      port->maintain();
    }
    CHECK(kernel.sockets().size() == 2);
    check_working(kernel, *port);
  }
  CHECK(failures >= 8);
}

TEST_CASE("a closed port leaves no socket behind", "[integration][can_socket]") {
  FakeKernel kernel;
  kernel.add("can0");
  { const auto port = open_port(kernel, everything); }
  CHECK(kernel.sockets().empty());
}

}  // namespace
}  // namespace bmu
