#include "tests/bench/latency/ear.hpp"

#include <array>
#include <stdexcept>
#include <system_error>

#include <sched.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <time.h>

#include "daemon/core/contactors/output_gate.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::latency {

namespace {

constexpr std::uint32_t tag_bell = 0xFFFF'FFFF;

void watch(int epoll, int fd, std::uint32_t tag) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.u32 = tag;
  if (::epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event) != 0) {
    throw std::system_error(errno, std::generic_category(), "epoll_ctl");
  }
}

}  // namespace

TimePoint exact_now() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return TimePoint(std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec));
}

void take_priority(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0) return;
  throw std::system_error(errno, std::generic_category(), "real-time priority for the threads that measure");
}

Ear::Ear() : epoll_(::epoll_create1(EPOLL_CLOEXEC)), bell_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  watch(epoll_.get(), bell_.get(), tag_bell);
}

Ear::~Ear() {
  is_over_ = true;
  ring();
  if (thread_.joinable()) thread_.join();
}

std::size_t Ear::add(const std::string& bus) {
  auto place = std::make_unique<Place>();
  auto port = open_bus(bus, {.receive_ids = {internal_bus::contactor_command.base_id}});
  if (!port) throw std::runtime_error(to_text(port.error()));
  place->port = std::move(*port);
  places_.push_back(std::move(place));
  return places_.size() - 1;
}

void Ear::start(int priority) {
  thread_ = std::thread([this, priority] {
    take_priority(priority);
    run();
  });
}

void Ear::listen(std::size_t bus) {
  places_[bus]->state = State::asked;
  ring();
}

void Ear::release(std::size_t bus) {
  places_[bus]->state = State::released;
  ring();
}

void Ear::ring() {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(bell_.get(), &one, sizeof one));
}

void Ear::run() {
  while (!is_over_) {
    std::array<epoll_event, 16> events{};
    const int count = ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), -1);
    for (int i = 0; i < count; ++i) {
      const std::uint32_t tag = events[static_cast<std::size_t>(i)].data.u32;
      if (tag == tag_bell) {
        look_around();
      } else {
        hear(tag);
      }
    }
  }
}

/// Discards frames from before the request; once none is pending, the embedded bus wakes this thread for the next
/// frame.
void Ear::look_around() {
  std::uint64_t rings = 0;
  static_cast<void>(!::read(bell_.get(), &rings, sizeof rings));
  for (std::size_t bus = 0; bus < places_.size(); ++bus) {
    Place& place = *places_[bus];
    const State state = place.state;
    if (state == State::released) {
      ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, place.port->fd(), nullptr);
      place.state = State::deaf;
    }
    if (state != State::asked) continue;
    ReceivedFrame passed_over;
    while (place.port->read(passed_over) == ReadStatus::frame) {
    }
    watch(epoll_.get(), place.port->fd(), static_cast<std::uint32_t>(bus));
    place.state = State::listening;
  }
}

void Ear::hear(std::size_t bus) {
  Place& place = *places_[bus];
  ReceivedFrame received;
  while (place.port->read(received) == ReadStatus::frame) {
    const TimePoint now = exact_now();
    if (outputs_of(received.frame).any_contactor()) continue;
    ::epoll_ctl(epoll_.get(), EPOLL_CTL_DEL, place.port->fd(), nullptr);
    place.heard_at = now;
    State expected = State::listening;  // unless it was released meanwhile, which look_around() handles
    place.state.compare_exchange_strong(expected, State::heard);
    return;
  }
}

}  // namespace bmu::latency
