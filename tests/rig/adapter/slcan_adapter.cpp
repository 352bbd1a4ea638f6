// An emulated serial CAN adapter with faults on command, for a kernel with slcan: one end of a pseudo-terminal is given
// to the kernel, which makes a CAN interface of it; the other end is the adapter, which joins it with another interface
// as a wire does.
//
//   slcan_adapter INTERFACE OTHER     e.g. slcan_adapter slcan0 vcan0; ends when the interface has disappeared, or at
//   the end of its input
//
// Its standard input has its events, one word per line; each is answered with "ok WORD" when it has been applied:
//   busoff passive warning active   the controller's state, with its error counters
//   alone                           no node acknowledges: each frame is sent without success and an error is reported
//                                   for it, the controller becomes error-passive, and nothing is received
//   cut                             the wire is cut, and the controller reports nothing of it
//   joined                          the wire is whole again, with all nodes on it
//   stall, go                       the adapter accepts nothing from the kernel any more; continues
//   unplug                          it is pulled out
//
// From busoff to active it is off the bus: the kernel momentarily still hands frames over, and they reach no node.
//
// The protocol on the terminal is that of Lawicel's adapters, with the additions of the kernel's driver for states and
// errors.
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <linux/tty.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include "daemon/shell/system/owned_fd.hpp"

namespace {

using bmu::OwnedFd;

struct StateRow {
  std::string_view word;
  std::string_view sent;  // to the kernel: state, and the counters of receiving and sending
};

constexpr std::array state_table{
    StateRow{"busoff", "sb000255\r"},
    StateRow{"passive", "sp000128\r"},
    StateRow{"warning", "sw000100\r"},
    StateRow{"active", "sa000000\r"},
};
// Report of a transmission that no node acknowledged. A controller that counts eight for each is error-passive after
// 16, and goes no further.
constexpr std::string_view no_acknowledge = "e1a\r";
constexpr int tries_until_passive = 16;

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "slcan_adapter: %s: %s\n", what, std::strerror(errno));
  std::exit(1);
}

void write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0) fail("write to the kernel");
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// "t1232AABB": identifier, length, bytes. Nothing else of the protocol is used on these buses.
bool from_text(std::string_view text, can_frame& out) {
  const auto hex = [&](std::size_t at, std::size_t digits, auto& value) {
    if (text.size() < at + digits) return false;
    const char* const begin = text.data() + at;
    return std::from_chars(begin, begin + digits, value, 16).ptr == begin + digits;
  };
  out = {};
  unsigned length = 0;
  if (!text.starts_with('t') || !hex(1, 3, out.can_id) || !hex(4, 1, length) || length > CAN_MAX_DLEN) return false;
  out.can_dlc = static_cast<unsigned char>(length);
  for (std::size_t i = 0; i < length; ++i) {
    if (!hex(5 + 2 * i, 2, out.data[i])) return false;
  }
  return true;
}

std::string to_text(const can_frame& frame) {
  std::array<char, 32> text{};
  int at = std::snprintf(text.data(), text.size(), "t%03X%X", frame.can_id & CAN_SFF_MASK, unsigned{frame.can_dlc});
  for (std::size_t i = 0; i < frame.can_dlc; ++i) {
    at += std::snprintf(text.data() + at, text.size() - static_cast<std::size_t>(at), "%02X", frame.data[i]);
  }
  return std::string(text.data(), static_cast<std::size_t>(at)) + '\r';
}

OwnedFd open_socket(const char* interface) {
  OwnedFd socket(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface));
  if (!socket.is_open() || address.can_ifindex == 0 ||
      ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    fail(interface);
  }
  return socket;
}

class Adapter {
 public:
  Adapter(const char* name, const char* other) : other_(open_socket(other)) {
    const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (terminal < 0 || ::grantpt(terminal) != 0 || ::unlockpt(terminal) != 0) fail("pseudo-terminal");
    terminal_ = OwnedFd(terminal);
    kernel_side_ = OwnedFd(::open(::ptsname(terminal), O_RDWR | O_NOCTTY | O_CLOEXEC));
    termios plain{};
    cfmakeraw(&plain);
    const int discipline = N_SLCAN;
    if (!kernel_side_.is_open() || ::tcsetattr(kernel_side_.get(), TCSANOW, &plain) != 0 ||
        ::ioctl(kernel_side_.get(), TIOCSETD, &discipline) != 0) {
      fail("give the terminal to slcan");
    }
    std::array<char, IFNAMSIZ> given{};
    if (::ioctl(kernel_side_.get(), SIOCGIFNAME, given.data()) != 0) fail("ask for the interface's name");
    rename(given.data(), name);
  }

  void run() {
    std::printf("ok ready\n");
    while (is_plugged_) {
      std::array<pollfd, 3> waits{{{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0},
                                   {.fd = is_stalled_ ? -1 : terminal_.get(), .events = POLLIN, .revents = 0},
                                   {.fd = other_.get(), .events = POLLIN, .revents = 0}}};
      std::fflush(stdout);
      if (::poll(waits.data(), waits.size(), -1) < 0) fail("poll");
      if (waits[0].revents != 0 && !obey()) return;
      if (waits[1].revents != 0) take_from_kernel();
      if (waits[2].revents != 0) take_from_wire();
    }
  }

 private:
  static void rename(const char* from, const char* to) {
    const OwnedFd socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    ifreq request{};
    std::snprintf(request.ifr_name, sizeof(request.ifr_name), "%s", from);
    std::snprintf(request.ifr_newname, sizeof(request.ifr_newname), "%s", to);
    if (std::strcmp(from, to) != 0 && ::ioctl(socket.get(), SIOCSIFNAME, &request) != 0) fail("name the interface");
  }

  /// False at the end of the input.
  bool obey() {
    std::array<char, 64> line{};
    if (std::fgets(line.data(), line.size(), stdin) == nullptr) return false;
    const std::string_view word(line.data(), std::strcspn(line.data(), "\n"));
    if (word == "busoff" || word == "active") is_off_bus_ = word == "busoff";
    tell_state(word);
    if (word == "cut" || word == "joined") is_cut_ = word == "cut";
    if (word == "alone" || word == "joined") set_alone(word == "alone");
    if (word == "stall" || word == "go") is_stalled_ = word == "stall";
    if (word == "unplug") is_plugged_ = false;
    std::printf("ok %.*s\n", static_cast<int>(word.size()), word.data());
    return true;
  }

  void set_alone(bool is_alone) {
    // Acknowledged by other nodes again, it counts down.
    if (is_alone_ && !is_alone && tries_alone_ >= tries_until_passive) tell_state("active");
    is_alone_ = is_alone;
    tries_alone_ = 0;
  }

  void tell_state(std::string_view word) {
    for (const StateRow& row : state_table) {
      if (row.word == word) write_all(terminal_.get(), row.sent);
    }
  }

  void try_alone() {
    write_all(terminal_.get(), no_acknowledge);
    if (++tries_alone_ == tries_until_passive) tell_state("passive");
  }

  void take_from_kernel() {
    std::array<char, 4096> bytes{};
    const ssize_t count = ::read(terminal_.get(), bytes.data(), bytes.size());
    if (count <= 0) {
      is_plugged_ = false;
      return;
    }
    for (const char c : std::string_view(bytes.data(), static_cast<std::size_t>(count))) {
      if (c != '\r') {
        line_ += c;
        continue;
      }
      can_frame frame;
      const bool is_frame = from_text(line_, frame);
      if (is_frame && is_alone_) try_alone();
      if (is_frame && !is_apart()) static_cast<void>(::write(other_.get(), &frame, sizeof(frame)));
      line_.clear();
    }
  }

  void take_from_wire() {
    can_frame frame;
    if (::read(other_.get(), &frame, sizeof(frame)) != sizeof(frame) || is_apart()) return;
    write_all(terminal_.get(), to_text(frame));
  }

  [[nodiscard]] bool is_apart() const { return is_cut_ || is_alone_ || is_off_bus_; }

  OwnedFd other_;
  OwnedFd terminal_;
  OwnedFd kernel_side_;
  std::string line_;
  bool is_cut_ = false;
  bool is_alone_ = false;
  int tries_alone_ = 0;
  bool is_off_bus_ = false;
  bool is_stalled_ = false;
  bool is_plugged_ = true;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: slcan_adapter INTERFACE OTHER\n");
    return 2;
  }
  // Each line is read when it comes, and nothing after it.
  std::setvbuf(stdin, nullptr, _IONBF, 0);
  Adapter(argv[1], argv[2]).run();
  return 0;
}
