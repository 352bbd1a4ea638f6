// Waking. The descriptor of a port must be readable while there are frames, and a writer should not make a system call
// per frame and reader. So a reader that has found nothing writes an odd number that it never used before into its
// `armed` word and checks again; a writer that has published sends a byte to every participant with an odd word, and
// then tries to change exactly the number that it saw to the even one below.
//
// In that order, because a writer may be stopped between the two: the reader is then already awake, others send it a
// byte or two too many until it arms with a new number, and the late change of the stopped one fails. If a writer dies
// after publishing and before the byte, the next writer wakes the reader; without one, its own maintain() does.
#include "daemon/shell/can/embedded_bus.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "daemon/shell/can/embedded_ring.hpp"
#include "daemon/shell/can/port_rules.hpp"
#include "daemon/shell/system/owned_fd.hpp"

namespace bmu {

namespace {

constexpr std::size_t bus_name_max = 32;
// "bmudbus" and the version of the layout in the last byte: change it with anything in EmbeddedRing or in how it is
// used.
constexpr std::uint64_t layout_magic = 0x626D'7564'6275'7301;
// Frames that do not pass the filter and are skipped by one read(), so that a flood of them cannot hold the caller.
constexpr int skipped_per_read_max = 1024;

OsError system_error(std::string what) {
  return {.code = errno, .what = std::move(what)};
}

bool is_bus_name(std::string_view name) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
           c == '-';
  };
  return !name.empty() && name.size() <= bus_name_max && std::all_of(name.begin(), name.end(), is_allowed);
}

class RingMapping {
 public:
  explicit RingMapping(EmbeddedRing* ring) : ring_(ring) {}
  RingMapping(const RingMapping&) = delete;
  RingMapping& operator=(const RingMapping&) = delete;
  RingMapping(RingMapping&& other) noexcept : ring_(std::exchange(other.ring_, nullptr)) {}
  RingMapping& operator=(RingMapping&&) = delete;
  ~RingMapping() {
    if (ring_ != nullptr) munmap(ring_, sizeof(EmbeddedRing));
  }

  [[nodiscard]] EmbeddedRing& ring() const { return *ring_; }

 private:
  EmbeddedRing* ring_;
};

/// Opens or creates the file of the bus. All users may write to /dev/shm, so the file must be a plain one of this user.
Result<OwnedFd, OsError> open_file(const std::string& path) {
  OwnedFd file(::open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR));
  if (!file.is_open()) {
    const bool is_foreign = errno == EACCES || errno == EPERM;
    return failure(system_error("open " + path + (is_foreign ? " (all participants must run as one user)" : "")));
  }
  struct stat status {};
  if (fstat(file.get(), &status) != 0) return failure(system_error("fstat " + path));
  if (!S_ISREG(status.st_mode)) return failure(OsError{.code = 0, .what = path + " is not a plain file"});
  if (status.st_uid != geteuid()) {
    const std::string owner = std::to_string(status.st_uid);
    return failure(
        OsError{.code = 0, .what = path + " belongs to user " + owner + ": participants must run as one user"});
  }
  return file;
}

/// Gives the file its size and maps it. Allocating grows and never shrinks, so it does no harm to a bus in use, and a
/// full /dev/shm is an error here instead of a SIGBUS at the first frame.
Result<RingMapping, OsError> map_file(const OwnedFd& file, const std::string& path) {
  while (fallocate(file.get(), 0, 0, sizeof(EmbeddedRing)) != 0) {
    if (errno != EINTR) return failure(system_error("allocate " + path));
  }
  void* memory = mmap(nullptr, sizeof(EmbeddedRing), PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0);
  if (memory == MAP_FAILED) return failure(system_error("map " + path));
  RingMapping mapping(static_cast<EmbeddedRing*>(memory));
  std::uint64_t found = 0;
  if (!mapping.ring().magic.compare_exchange_strong(found, layout_magic) && found != layout_magic) {
    return failure(OsError{.code = 0, .what = path + " is of another version or no bus; end its users and remove it"});
  }
  return mapping;
}

Result<std::uint64_t, OsError> network_namespace() {
  constexpr const char* path = "/proc/thread-self/ns/net";
  struct stat status {};
  if (stat(path, &status) != 0) return failure(system_error(std::string("stat ") + path));
  return status.st_ino;
}

/// Holds the shared lock of the file until it is closed, and ensures that all holders are in one network namespace:
/// from another one their sockets cannot be reached, and their numbers appear free. A participant that gets the
/// exclusive lock is alone on the bus, and may move it to its own namespace.
Result<void, OsError> share_file(const OwnedFd& file, EmbeddedRing& ring, const std::string& path) {
  const Result<std::uint64_t, OsError> here = network_namespace();
  if (!here) return failure(here.error());
  // The locks of participants that come or go at the same time are held for microseconds only.
  constexpr int turns_max = 200;
  for (int turn = 0; turn < turns_max; ++turn) {
    std::uint64_t found = 0;
    if (ring.network_namespace.compare_exchange_strong(found, *here) || found == *here) {
      if (flock(file.get(), LOCK_SH | LOCK_NB) == 0 && ring.network_namespace.load() == *here) return {};
      flock(file.get(), LOCK_UN);  // the bus was moved between the two lines above
    } else if (flock(file.get(), LOCK_EX | LOCK_NB) == 0) {
      ring.network_namespace.store(*here);
      continue;  // changing to the shared lock is not atomic, so it is done with the check above
    }
    std::this_thread::sleep_for(1ms);
  }
  if (ring.network_namespace.load() == *here) return failure(OsError{.code = EWOULDBLOCK, .what = "lock " + path});
  return failure(OsError{.code = 0, .what = path + " has participants in another network namespace"});
}

/// Whether new participants find this very file.
bool is_named(const OwnedFd& file, const std::string& path) {
  struct stat ours {};
  struct stat named {};
  return fstat(file.get(), &ours) == 0 && stat(path.c_str(), &named) == 0 && named.st_dev == ours.st_dev &&
         named.st_ino == ours.st_ino;
}

struct SharedFile {
  OwnedFd file;
  RingMapping mapping;
};

/// The file, mapped and locked. One that its last participant removed between opening and locking it is not the bus any
/// more: once it is locked, no participant can remove it, so checking then is enough.
Result<SharedFile, OsError> join(const std::string& path) {
  constexpr int turns_max = 100;  // each time another participant was the last, in the same microseconds
  for (int turn = 0; turn < turns_max; ++turn) {
    Result<OwnedFd, OsError> file = open_file(path);
    if (!file) return failure(file.error());
    Result<RingMapping, OsError> mapping = map_file(*file, path);
    if (!mapping) return failure(mapping.error());
    const Result<void, OsError> shared = share_file(*file, mapping->ring(), path);
    if (!shared) return failure(shared.error());
    if (is_named(*file, path)) return SharedFile{std::move(*file), std::move(*mapping)};
  }
  return failure(OsError{.code = EWOULDBLOCK, .what = "join " + path});
}

/// Removes the file if no other participant is on the bus: then the exclusive lock succeeds. Trying for it releases the
/// own lock, so this is the last use of the file; of two that leave at once, one may find the other still there, and
/// the file stays for the next participant.
void leave(const OwnedFd& file, const std::string& path) {
  if (flock(file.get(), LOCK_EX | LOCK_NB) == 0 && is_named(file, path)) unlink(path.c_str());
}

/// Address on which participant number K of a bus listens: an abstract name, which exists as long as its socket.
class WakeAddress {
 public:
  WakeAddress(std::string_view bus, unsigned participant) {
    const std::string name = "bmud-bus/" + std::string(bus) + "/" + std::to_string(participant);
    address_.sun_family = AF_UNIX;
    static_assert(sizeof("bmud-bus//31") + bus_name_max < sizeof(address_.sun_path));
    std::copy(name.begin(), name.end(), address_.sun_path + 1);
    length_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  }

  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&address_); }
  [[nodiscard]] socklen_t length() const { return length_; }

 private:
  sockaddr_un address_{};
  socklen_t length_;
};

struct Seat {
  OwnedFd socket;
  unsigned participant = 0;
};

Result<Seat, OsError> take_seat(std::string_view bus) {
  OwnedFd socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket.is_open()) return failure(system_error("socket for unix:" + std::string(bus)));
  for (unsigned participant = 0; participant < EmbeddedRing::participant_count; ++participant) {
    const WakeAddress address(bus, participant);
    if (bind(socket.get(), address.get(), address.length()) == 0) return Seat{std::move(socket), participant};
    if (errno != EADDRINUSE) return failure(system_error("bind for unix:" + std::string(bus)));
  }
  const std::string count = std::to_string(EmbeddedRing::participant_count);
  return failure(
      OsError{.code = 0, .what = "unix:" + std::string(bus) + " is full: it has " + count + " participants"});
}

class EmbeddedBusPort final : public BusPort {
 public:
  EmbeddedBusPort(std::string_view bus, const PortOptions& options, OwnedFd file, RingMapping mapping, Seat seat)
      : name_("unix:" + std::string(bus)),
        path_(embedded_bus_path(bus)),
        filter_(options),
        receives_own_(options.receive_own),
        file_(std::move(file)),
        mapping_(std::move(mapping)),
        seat_(std::move(seat)),
        writer_(mapping_.ring(), seat_.participant),
        reader_(mapping_.ring()) {
    addresses_.reserve(EmbeddedRing::participant_count);
    for (unsigned i = 0; i < EmbeddedRing::participant_count; ++i) addresses_.emplace_back(bus, i);
    // The descriptor must show frames before the first read, too.
    if (!rest()) wake(seat_.participant);
  }
  EmbeddedBusPort(const EmbeddedBusPort&) = delete;
  EmbeddedBusPort& operator=(const EmbeddedBusPort&) = delete;
  ~EmbeddedBusPort() override { leave(file_, path_); }

  [[nodiscard]] int fd() const override { return seat_.socket.get(); }
  [[nodiscard]] ReadStatus read(ReceivedFrame& out) override;
  [[nodiscard]] Result<void, SendError> send(const CanFrame& frame) override;
  void maintain() override;

  [[nodiscard]] BusState state() const override { return BusState::up; }
  [[nodiscard]] std::uint64_t frames_lost() const override { return reader_.frames_lost(); }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string last_error() const override { return last_error_; }

 private:
  [[nodiscard]] bool rest();
  void drain();
  bool wake(unsigned participant);
  void wake_sleepers();

  std::string name_;
  std::string path_;
  ReceiveFilter filter_;
  bool receives_own_;
  OwnedFd file_;  // holds the lock, and is therefore released after the seat
  RingMapping mapping_;
  Seat seat_;
  std::vector<WakeAddress> addresses_;
  RingWriter writer_;
  RingReader reader_;
  std::uint64_t refused_ = 0;
  std::string last_error_;
};

ReadStatus EmbeddedBusPort::read(ReceivedFrame& out) {
  RingReader::Item item;
  for (int skipped = 0; skipped < skipped_per_read_max; ++skipped) {
    if (!reader_.next(item)) {
      if (rest()) return ReadStatus::empty;
      // A frame came just now. Its writer may have checked before this reader was armed, so no other participant is
      // sure to make the descriptor readable again for the frames after this one.
      wake(seat_.participant);
      continue;
    }
    const bool is_own = item.participant == seat_.participant;
    if ((is_own && !receives_own_) || !filter_.passes(item.frame) || !is_sendable(item.frame)) continue;
    out = {.frame = item.frame, .received_at = monotonic_now(), .is_own = is_own};
    return ReadStatus::frame;
  }
  return ReadStatus::empty;  // only for now: the bytes of the wake-up are still there, so the caller is woken again
}

/// Makes the descriptor unreadable and arms the wake-up; false if there is something to read after all. The bytes are
/// drained first: one that comes after arming belongs to a frame that has not been read.
bool EmbeddedBusPort::rest() {
  drain();
  EmbeddedRing::Word& armed = mapping_.ring().armed[seat_.participant];
  // Odd and new. Only this participant makes it larger, so this also continues where a dead predecessor stopped.
  armed.store((armed.load(std::memory_order_relaxed) | 1) + 2, std::memory_order_seq_cst);
  return reader_.is_at_end();
}

void EmbeddedBusPort::drain() {
  std::array<char, 16> bytes{};
  // More than these cannot be queued unless a participant keeps sending, and then another wake-up is right.
  for (int i = 0; i < 64; ++i) {
    if (recv(seat_.socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT) < 0 && errno != EINTR) return;
  }
}

/// False if the byte may be missing although the participant waits for it.
bool EmbeddedBusPort::wake(unsigned participant) {
  const WakeAddress& address = addresses_[participant];
  const char byte = 0;
  const ssize_t sent =
      sendto(seat_.socket.get(), &byte, 1, MSG_DONTWAIT | MSG_NOSIGNAL, address.get(), address.length());
  // A full queue wakes as well as one more byte; and where no participant listens, none sleeps.
  return sent == 1 || errno == EAGAIN || errno == ECONNREFUSED;
}

void EmbeddedBusPort::wake_sleepers() {
  for (unsigned i = 0; i < EmbeddedRing::participant_count; ++i) {
    EmbeddedRing::Word& armed = mapping_.ring().armed[i];
    std::uint64_t seen = armed.load(std::memory_order_seq_cst);
    if (seen % 2 == 1 && wake(i)) armed.compare_exchange_strong(seen, seen - 1, std::memory_order_seq_cst);
  }
}

Result<void, SendError> EmbeddedBusPort::send(const CanFrame& frame) {
  if (!is_sendable(frame)) {
    last_error_ = "send " + name_ + ": " + std::to_string(++refused_) + " frames refused that CAN does not know";
    return failure(SendError::refused);
  }
  writer_.publish(frame);
  wake_sleepers();
  return {};
}

void EmbeddedBusPort::maintain() {
  if (!reader_.is_at_end()) wake(seat_.participant);
  if (!is_named(file_, path_)) {
    last_error_ = path_ + " was removed while in use: newcomers do not meet us";
  }
}

}  // namespace

std::string embedded_bus_path(std::string_view bus) {
  return "/dev/shm/bmud-bus." + std::string(bus);
}

Result<std::unique_ptr<BusPort>, OsError> open_embedded_bus(std::string_view bus, const PortOptions& options) {
  if (!is_bus_name(bus)) {
    const std::string expected = "', expected a bus name of 1 to 32 letters, digits, '_', '.' or '-'";
    return failure(OsError{.code = 0, .what = "found 'unix:" + std::string(bus) + expected});
  }
  const std::string path = embedded_bus_path(bus);
  Result<SharedFile, OsError> shared = join(path);
  if (!shared) return failure(shared.error());
  Result<Seat, OsError> seat = take_seat(bus);
  if (!seat) return failure(seat.error());
  return std::make_unique<EmbeddedBusPort>(bus, options, std::move(shared->file), std::move(shared->mapping),
                                           std::move(*seat));
}

}  // namespace bmu
