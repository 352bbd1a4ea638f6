#include "daemon/shell/can/can_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "daemon/shell/can/link_details.hpp"
#include "daemon/shell/can/port_rules.hpp"
#include "daemon/shell/system/owned_fd.hpp"

namespace bmu {

namespace {

// A 4 MiB buffer holds about a second of a full 1 Mbit/s bus; the kernel doubles the number for its own book-keeping.
constexpr int receive_buffer_bytes = 4 * 1024 * 1024;
// The kernel raises this to its minimum, which is some ten frames: a frame that does not fit is dropped and reported
// (EAGAIN), rather than sent when it is no longer valid.
constexpr int send_buffer_bytes = 0;
constexpr std::size_t kernel_filters_max = CAN_RAW_FILTER_MAX;
// Reads without a frame for the caller in one read(), so that a flood cannot hold the caller.
constexpr int tries_per_read = 64;

class KernelCanSystem final : public CanSystem {
 public:
  int open_socket() override { return checked(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW)); }
  void close_socket(int fd) override { ::close(fd); }
  int set_option(int fd, int level, int option, const void* value, socklen_t length) override {
    return checked(::setsockopt(fd, level, option, value, length));
  }
  int bind_to(int fd, int interface_index) override {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = interface_index;
    return checked(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)));
  }
  int take_error(int fd) override {
    int error = 0;
    socklen_t length = sizeof(error);
    return ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &length) == 0 ? error : errno;
  }
  int receive(int fd, msghdr& message) override { return checked(::recvmsg(fd, &message, MSG_DONTWAIT)); }
  int send(int fd, const can_frame& frame) override {
    return checked(::send(fd, &frame, sizeof(frame), MSG_DONTWAIT | MSG_NOSIGNAL));
  }
  int look_up(const std::string& name, int known_index, CanInterface& out) override {
    FoundLink found;
    int result = known_index > 0 ? look_again(name, known_index, found) : -ENODEV;
    if (result == -ENODEV) result = find_link(name, found);
    out = {.index = found.index, .is_running = found.is_running};
    return result;
  }
  int bit_rate(int interface_index, std::uint32_t& out_bit_per_s) override {
    return ask_bit_rate(interface_index, out_bit_per_s);
  }

 private:
  template <class Number>
  static int checked(Number result) {
    return result < 0 ? -errno : static_cast<int>(result);
  }
};

/// One socket, which may be closed and replaced.
class RawSocket {
 public:
  explicit RawSocket(CanSystem& system) : system_(&system) {}
  RawSocket(CanSystem& system, int fd) : system_(&system), fd_(fd) {}
  RawSocket(const RawSocket&) = delete;
  RawSocket& operator=(const RawSocket&) = delete;
  RawSocket(RawSocket&& other) noexcept : system_(other.system_) { swap(other); }
  RawSocket& operator=(RawSocket&& other) noexcept {
    swap(other);
    return *this;
  }
  ~RawSocket() { close(); }

  void close() {
    if (fd_ >= 0) system_->close_socket(std::exchange(fd_, -1));
  }
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  template <class Value>
  [[nodiscard]] int set(int level, int option, const Value& value) {
    return system_->set_option(fd_, level, option, &value, sizeof(value));
  }
  /// Number of frames dropped since the last call, from the kernel's count since the socket was opened, which wraps.
  [[nodiscard]] std::uint32_t newly_dropped(std::uint32_t total) { return total - std::exchange(dropped_, total); }

 private:
  void swap(RawSocket& other) noexcept {
    std::swap(system_, other.system_);
    std::swap(fd_, other.fd_);
    std::swap(dropped_, other.dropped_);
  }

  CanSystem* system_;
  int fd_ = -1;
  std::uint32_t dropped_ = 0;
};

constexpr canid_t data_frames_only = CAN_EFF_FLAG | CAN_RTR_FLAG;

/// The largest block from `first` on, aligned to its own size (a power of two), of identifiers to receive only.
std::uint32_t block_size(const ReceiveFilter& wanted, std::uint32_t first) {
  const auto is_wanted = [&](std::uint32_t size) {
    for (std::uint32_t id = first; id < first + size; ++id) {
      if (id > standard_id_max || !wanted.has_id(id)) return false;
    }
    return true;
  };
  std::uint32_t size = 1;
  while (first % (size * 2) == 0 && is_wanted(size * 2)) size *= 2;
  return size;
}

/// One filter per identifier while the kernel accepts that many: it finds those by table. Beyond, one per block, which
/// passes exactly the same.
std::vector<can_filter> id_filters(const ReceiveFilter& wanted) {
  const bool one_each = wanted.id_count() <= kernel_filters_max;
  std::vector<can_filter> filters;
  for (std::uint32_t id = 0; id <= standard_id_max;) {
    const std::uint32_t size = one_each || !wanted.has_id(id) ? 1 : block_size(wanted, id);
    if (wanted.has_id(id)) {
      filters.push_back({.can_id = id, .can_mask = (CAN_SFF_MASK & ~(size - 1)) | data_frames_only});
    }
    id += size;
  }
  return filters;
}

/// Exact: neither other identifiers nor remote or extended frames. If the identifiers are so scattered that even the
/// blocks are too many for the kernel, the port's own check does it.
int set_id_filters(RawSocket& socket, CanSystem& system, const ReceiveFilter& wanted) {
  if (wanted.passes_everything()) return 0;
  std::vector<can_filter> filters = id_filters(wanted);
  if (filters.size() + wanted.extended_ids().size() > kernel_filters_max) {
    filters = {{.can_id = 0, .can_mask = data_frames_only}};
  }
  for (const std::uint32_t id : wanted.extended_ids()) {
    filters.push_back({.can_id = id | CAN_EFF_FLAG, .can_mask = CAN_EFF_MASK | data_frames_only});
  }
  const auto length = static_cast<socklen_t>(filters.size() * sizeof(can_filter));
  return system.set_option(socket.fd(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), length);
}

int configure_data_socket(RawSocket& socket, CanSystem& system, const ReceiveFilter& wanted, bool receive_own) {
  if (const int result = set_id_filters(socket, system, wanted); result < 0) return result;
  const int own = receive_own ? 1 : 0;
  if (const int result = socket.set(SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, own); result < 0) return result;
  if (const int result = socket.set(SOL_SOCKET, SO_RXQ_OVFL, 1); result < 0) return result;
  // The first needs a capability that the daemon does not have by itself. If the second gets less than requested, the
  // kernel's default applies, and overruns are counted either way.
  if (socket.set(SOL_SOCKET, SO_RCVBUFFORCE, receive_buffer_bytes) < 0) {
    static_cast<void>(socket.set(SOL_SOCKET, SO_RCVBUF, receive_buffer_bytes));
  }
  return socket.set(SOL_SOCKET, SO_SNDBUF, send_buffer_bytes);
}

/// Error frames have a queue of their own: a controller that floods it must not displace data.
int configure_error_socket(RawSocket& socket, CanSystem& system) {
  const int result = system.set_option(socket.fd(), SOL_CAN_RAW, CAN_RAW_FILTER, nullptr, 0);
  if (result < 0) return result;
  return socket.set(SOL_CAN_RAW, CAN_RAW_ERR_FILTER, can_err_mask_t{CAN_ERR_MASK});
}

CanFrame from_wire(const can_frame& wire) {
  CanFrame frame;
  frame.is_error = (wire.can_id & CAN_ERR_FLAG) != 0;
  frame.is_extended = (wire.can_id & CAN_EFF_FLAG) != 0;
  frame.is_remote = (wire.can_id & CAN_RTR_FLAG) != 0;
  frame.id = wire.can_id & (frame.is_extended || frame.is_error ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.length = wire.can_dlc;
  std::copy_n(wire.data, frame.length, frame.data.begin());
  return frame;
}

can_frame to_wire(const CanFrame& frame) {
  can_frame wire{};
  wire.can_id = frame.id | (frame.is_error ? CAN_ERR_FLAG : 0) | (frame.is_extended ? CAN_EFF_FLAG : 0) |
                (frame.is_remote ? CAN_RTR_FLAG : 0);
  wire.can_dlc = frame.length;
  std::copy_n(frame.data.begin(), frame.length, wire.data);
  return wire;
}

class CanSocketPort final : public BusPort {
 public:
  CanSocketPort(std::string_view interface_name, const PortOptions& options, CanSystem& system, OwnedFd poll,
                OwnedFd news)
      : name_(interface_name),
        filter_(options),
        receives_own_(options.receive_own),
        receives_errors_(options.receive_errors),
        system_(system),
        poll_(std::move(poll)),
        news_(std::move(news)),
        data_socket_(system),
        error_socket_(system) {}

  [[nodiscard]] int fd() const override { return poll_.get(); }
  [[nodiscard]] ReadStatus read(ReceivedFrame& out) override;
  [[nodiscard]] Result<void, SendError> send(const CanFrame& frame) override;
  void maintain() override;

  [[nodiscard]] BusState state() const override { return state_; }
  [[nodiscard]] std::uint64_t frames_lost() const override { return frames_lost_; }
  [[nodiscard]] std::uint32_t rate_bit_per_s() const override { return rate_bit_per_s_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string last_error() const override;
  [[nodiscard]] const OsError& last_failure() const { return last_failure_; }

 private:
  enum class Taken : std::uint8_t { frame, nothing, other };

  [[nodiscard]] Taken take(RawSocket& socket, ReceivedFrame& out);
  void count_dropped(RawSocket& socket, msghdr& message);
  [[nodiscard]] ReadStatus tell_loss();

  [[nodiscard]] bool look_up(CanInterface& out);
  [[nodiscard]] bool open_sockets(int interface_index);
  [[nodiscard]] bool open_one(RawSocket& out, int interface_index, bool is_for_errors);
  [[nodiscard]] bool discard_socket_errors();
  void come_up();
  void leave_up(BusState state);
  void observe_error(int code, const char* doing);
  bool fail(int code, const char* doing);

  std::string name_;
  ReceiveFilter filter_;
  bool receives_own_;
  bool receives_errors_;
  CanSystem& system_;
  OwnedFd poll_;  // an epoll instance: itself pollable, and it stays while the sockets in it change
  OwnedFd news_;  // an eventfd in it, readable while a loss is unreported
  RawSocket data_socket_;
  RawSocket error_socket_;
  int interface_index_ = 0;
  BusState state_ = BusState::absent;
  std::uint32_t rate_bit_per_s_ = 0;
  bool is_loss_untold_ = false;
  bool is_error_turn_ = false;
  std::uint64_t frames_lost_ = 0;
  std::uint64_t sends_refused_ = 0;
  OsError last_failure_;
};

ReadStatus CanSocketPort::read(ReceivedFrame& out) {
  for (int i = 0; i < tries_per_read; ++i) {
    if (is_loss_untold_) return tell_loss();
    // In turns, so that neither kind of frame can starve the other.
    is_error_turn_ = !is_error_turn_;
    Taken taken = take(is_error_turn_ ? error_socket_ : data_socket_, out);
    if (taken == Taken::nothing) taken = take(is_error_turn_ ? data_socket_ : error_socket_, out);
    if (taken == Taken::frame) return ReadStatus::frame;
    if (taken == Taken::nothing) return ReadStatus::empty;
  }
  return ReadStatus::empty;  // only for now: the descriptor is still readable
}

CanSocketPort::Taken CanSocketPort::take(RawSocket& socket, ReceivedFrame& out) {
  if (!socket.is_open()) return Taken::nothing;
  can_frame wire{};
  iovec buffer{.iov_base = &wire, .iov_len = sizeof(wire)};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(std::uint32_t))> control{};
  msghdr message{};
  message.msg_iov = &buffer;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();

  const int result = system_.receive(socket.fd(), message);
  if (result == -EAGAIN) return Taken::nothing;
  if (result < 0) {
    observe_error(-result, "receive from");
    return Taken::other;
  }
  count_dropped(socket, message);
  const bool is_whole = result == CAN_MTU && (message.msg_flags & MSG_TRUNC) == 0 && wire.can_dlc <= CAN_MAX_DLEN;
  if (!is_whole) return Taken::other;
  out = {.frame = from_wire(wire), .received_at = monotonic_now(), .is_own = (message.msg_flags & MSG_CONFIRM) != 0};
  return filter_.passes(out.frame) ? Taken::frame : Taken::other;
}

void CanSocketPort::count_dropped(RawSocket& socket, msghdr& message) {
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET || header->cmsg_type != SO_RXQ_OVFL) continue;
    std::uint32_t total = 0;
    std::memcpy(&total, CMSG_DATA(header), sizeof(total));
    frames_lost_ += socket.newly_dropped(total);
  }
}

ReadStatus CanSocketPort::tell_loss() {
  is_loss_untold_ = false;
  eventfd_t count = 0;
  eventfd_read(news_.get(), &count);
  return ReadStatus::down;
}

Result<void, SendError> CanSocketPort::send(const CanFrame& frame) {
  if (!is_sendable(frame)) {
    ++sends_refused_;
    fail(EINVAL, "send to");
    return failure(SendError::refused);
  }
  // Even where the kernel would accept the frame: without a carrier it accepts all, and transmits none.
  if (state_ != BusState::up) return failure(SendError::down);
  const int result = system_.send(data_socket_.fd(), to_wire(frame));
  if (result == CAN_MTU) return {};
  if (result == -EAGAIN || result == -ENOBUFS) return failure(SendError::queue_full);
  observe_error(result < 0 ? -result : EIO, "send to");
  if (state_ != BusState::up) return failure(SendError::down);
  ++sends_refused_;
  return failure(SendError::refused);
}

void CanSocketPort::maintain() {
  CanInterface found;
  if (!look_up(found)) return;
  // Gone and back between two calls: perhaps without any notification, and the old socket will never receive again.
  if (data_socket_.is_open() && found.index != interface_index_) leave_up(BusState::absent);
  if (!data_socket_.is_open() && !open_sockets(found.index)) return;
  if (state_ == BusState::up) {
    if (!found.is_running) leave_up(BusState::down);
    return;
  }
  // An error left over from the outage would fail the first frame after it. One that is raised from here on is new, so
  // only a check after this line may find that the interface is up.
  if (!discard_socket_errors() || !look_up(found)) return;
  if (found.index != interface_index_) return observe_error(ENODEV, "keep");
  state_ = BusState::down;
  if (found.is_running) come_up();
}

/// False if there is no such interface, or its state cannot be read at the moment; then all stays as it is.
bool CanSocketPort::look_up(CanInterface& out) {
  const int result = system_.look_up(name_, interface_index_, out);
  if (result == -ENODEV) leave_up(BusState::absent);
  return result == 0 || fail(-result, "find");
}

bool CanSocketPort::open_sockets(int interface_index) {
  RawSocket data(system_);
  RawSocket errors(system_);
  if (!open_one(data, interface_index, false)) return false;
  if (receives_errors_ && !open_one(errors, interface_index, true)) return false;
  data_socket_ = std::move(data);
  error_socket_ = std::move(errors);
  interface_index_ = interface_index;
  return true;
}

bool CanSocketPort::open_one(RawSocket& out, int interface_index, bool is_for_errors) {
  const int fd = system_.open_socket();
  if (fd < 0) return fail(-fd, "open a socket for");
  RawSocket socket(system_, fd);
  // Before bind, so that no other frame is ever in the queue.
  const int configured = is_for_errors ? configure_error_socket(socket, system_)
                                       : configure_data_socket(socket, system_, filter_, receives_own_);
  if (configured < 0) return fail(-configured, "configure a socket for");
  if (const int bound = system_.bind_to(fd, interface_index); bound < 0) return fail(-bound, "bind a CAN socket to");
  epoll_event event{.events = EPOLLIN, .data = {}};
  if (epoll_ctl(poll_.get(), EPOLL_CTL_ADD, fd, &event) != 0) return fail(errno, "watch");
  out = std::move(socket);
  return true;
}

/// False if one of them reports that the interface is gone.
bool CanSocketPort::discard_socket_errors() {
  for (const RawSocket* socket : {&data_socket_, &error_socket_}) {
    if (socket->is_open() && system_.take_error(socket->fd()) == ENODEV) {
      leave_up(BusState::absent);
      return fail(ENODEV, "receive from");
    }
  }
  return true;
}

void CanSocketPort::come_up() {
  const int result = system_.bit_rate(interface_index_, rate_bit_per_s_);
  if (result < 0) fail(-result, "ask for the bit rate of");
  state_ = BusState::up;
}

void CanSocketPort::leave_up(BusState state) {
  if (state_ == BusState::up) {
    is_loss_untold_ = true;
    eventfd_write(news_.get(), 1);
  }
  state_ = state;
  if (state == BusState::absent) {  // closing also takes them out of the epoll instance
    data_socket_.close();
    error_socket_.close();
    rate_bit_per_s_ = 0;
  }
}

void CanSocketPort::observe_error(int code, const char* doing) {
  fail(code, doing);
  if (code == ENETDOWN) leave_up(BusState::down);
  // send() returns ENXIO on a socket of an interface that was removed.
  if (code == ENODEV || code == ENXIO) leave_up(BusState::absent);
}

/// Always false, for the caller to return.
bool CanSocketPort::fail(int code, const char* doing) {
  last_failure_ = {.code = code, .what = std::string(doing) + " " + name_};
  return false;
}

std::string CanSocketPort::last_error() const {
  std::string text = last_failure_.what.empty() ? "" : to_text(last_failure_);
  if (sends_refused_ > 0) text += " (" + std::to_string(sends_refused_) + " sends refused so far)";
  return text;
}

/// Whether the kernel has CAN at all: waiting for an interface would not help without it.
Result<void, OsError> probe(CanSystem& system, const std::string& name) {
  const int fd = system.open_socket();
  if (fd >= 0) {
    system.close_socket(fd);
    return {};
  }
  std::string what = "open a CAN socket for " + name;
  if (fd == -EAFNOSUPPORT || fd == -EPROTONOSUPPORT) what += " (no CAN in this kernel? unix:NAME is a bus without it)";
  return failure(OsError{.code = -fd, .what = std::move(what)});
}

bool is_interface_name(std::string_view name) {
  const auto is_wrong = [](char c) { return c == '/' || c == ':' || c <= ' ' || c == '\x7f'; };
  return !name.empty() && name.size() < IFNAMSIZ && std::none_of(name.begin(), name.end(), is_wrong);
}

}  // namespace

CanSystem& kernel_can_system() {
  static KernelCanSystem system;
  return system;
}

Result<std::unique_ptr<BusPort>, OsError> open_can_socket(std::string_view interface_name, const PortOptions& options,
                                                          CanSystem& system) {
  const std::string name(interface_name);
  if (!is_interface_name(name)) {
    return failure(OsError{.code = 0, .what = "'" + name + "' is neither an interface such as can0 nor unix:NAME"});
  }
  if (const Result<void, OsError> probed = probe(system, name); !probed) return failure(probed.error());

  OwnedFd poll(epoll_create1(EPOLL_CLOEXEC));
  if (!poll.is_open()) return failure(OsError{.code = errno, .what = "epoll for " + name});
  OwnedFd news(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  if (!news.is_open()) return failure(OsError{.code = errno, .what = "eventfd for " + name});
  epoll_event event{.events = EPOLLIN, .data = {}};
  if (epoll_ctl(poll.get(), EPOLL_CTL_ADD, news.get(), &event) != 0) {
    return failure(OsError{.code = errno, .what = "watch eventfd for " + name});
  }

  auto port = std::make_unique<CanSocketPort>(name, options, system, std::move(poll), std::move(news));
  port->maintain();
  const bool is_awaited = !options.must_exist && port->last_failure().code == ENODEV;
  if (port->state() == BusState::absent && !is_awaited) return failure(port->last_failure());
  return port;
}

}  // namespace bmu
