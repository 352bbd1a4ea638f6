// An emulated GPIO chip: for tests on machines without one, with calls that fail, lines that are busy and chips that
// disappear.
#pragma once

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <deque>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <sys/eventfd.h>

#include "daemon/shell/gpio/gpio_lines.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "tests/support/catch.hpp"

namespace bmu {

/// A kernel with one chip. Levels of wires are electrical, those of requests logical, as in the kernel.
class FakeChip final : public GpioSystem {
 public:
  struct Wire {
    bool is_high = false;
    bool is_output = false;
    std::string owner;             // empty: free
    std::vector<bool> was_driven;  // every level since the start
  };
  struct Request {
    OwnedFd fd;
    gpio_v2_line_request asked{};
    std::deque<gpio_v2_line_event> edges;
    std::array<std::uint32_t, GPIO_V2_LINES_MAX> edges_seen{};  // of each line
  };

  // State of the chip.

  static constexpr std::uint32_t line_count = 32;
  bool is_there = true;
  bool debounces = true;
  bool interrupts = true;
  std::array<Wire, line_count> wires{};
  std::uint64_t monotonic_ns = 1;  // timestamp of its edges
  int edges_to_lose = 0;           // so many of the next edges find no room in a queue

  void set_wire(std::uint32_t line, bool is_high) {
    wires.at(line).is_high = is_high;
    for (auto& [fd, request] : requests_) {
      for (std::uint32_t i = 0; i < request.asked.num_lines; ++i) {
        if (request.asked.offsets[i] == line) queue_edge(request, i);
      }
    }
  }

  // Failures of the calls.

  /// The nth call from now on (0 is the next) fails with this error instead of doing anything.
  void fail_call(int n, int error) {
    calls_until_failure_ = n;
    failure_ = error;
  }
  [[nodiscard]] bool is_failure_pending() const { return calls_until_failure_ >= 0; }
  int set_error = 0;  // of every set_values

  // Observations for tests.

  int set_calls = 0;
  std::vector<std::uint32_t> driven_lines;  // one after the other
  std::vector<gpio_v2_line_request> asked;  // every request, granted or not
  [[nodiscard]] std::size_t open_descriptors() const { return requests_.size() + chips_.size(); }

  // The calls.

  int open_chip(const std::string& file) override {
    if (const int error = failing(); error != 0) return -error;
    if (!is_there || file != "/dev/gpiochip0") return -ENOENT;
    OwnedFd fd(::eventfd(0, EFD_CLOEXEC));
    const int number = fd.get();
    chips_.emplace(number, std::move(fd));
    return number;
  }
  int chip_info(int chip, gpiochip_info& out) override {
    if (const int error = failing(); error != 0) return -error;
    REQUIRE(chips_.count(chip) == 1);
    out.lines = line_count;
    std::strncpy(out.label, "fake", sizeof(out.label));
    return 0;
  }
  int line_info(int chip, gpio_v2_line_info& in_out) override {
    if (const int error = failing(); error != 0) return -error;
    REQUIRE(chips_.count(chip) == 1);
    const Wire& wire = wires.at(in_out.offset);
    in_out.flags = wire.owner.empty() ? 0 : static_cast<std::uint64_t>(GPIO_V2_LINE_FLAG_USED);
    std::strncpy(in_out.consumer, wire.owner.c_str(), sizeof(in_out.consumer) - 1);
    return 0;
  }
  int request_lines(int chip, gpio_v2_line_request& request) override {
    if (const int error = failing(); error != 0) return -error;
    REQUIRE(chips_.count(chip) == 1);
    asked.push_back(request);
    if (const int error = refusal_of(request); error != 0) return -error;
    OwnedFd fd(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    const int number = fd.get();
    requests_[number] = {.fd = std::move(fd), .asked = request, .edges = {}};
    for (std::uint32_t i = 0; i < request.num_lines; ++i) {
      Wire& wire = wires.at(request.offsets[i]);
      wire.owner = request.consumer;
      wire.is_output = (flags_of(request, i) & GPIO_V2_LINE_FLAG_OUTPUT) != 0;
      if (wire.is_output) drive_wire(request, i, (initial_values_of(request) & (std::uint64_t{1} << i)) != 0);
    }
    return number;
  }
  int get_values(int lines, gpio_v2_line_values& in_out) override {
    if (const int error = failing(); error != 0) return -error;
    const Request& request = requests_.at(lines);
    if (!is_there) return -ENODEV;
    in_out.bits = 0;
    for (std::uint32_t i = 0; i < request.asked.num_lines; ++i) {
      if (is_active(request.asked, i)) in_out.bits |= std::uint64_t{1} << i;
    }
    in_out.bits &= in_out.mask;
    return 0;
  }
  int set_values(int lines, const gpio_v2_line_values& values) override {
    ++set_calls;
    if (const int error = failing(); error != 0) return -error;
    const Request& request = requests_.at(lines);
    if (!is_there) return -ENODEV;
    if (set_error != 0) return -set_error;
    // The kernel sets lines in the order of their numbers, whatever their order in the request.
    for (std::uint32_t line = 0; line < line_count; ++line) {
      for (std::uint32_t i = 0; i < request.asked.num_lines; ++i) {
        const std::uint64_t bit = std::uint64_t{1} << i;
        const bool is_meant = request.asked.offsets[i] == line && (values.mask & bit) != 0;
        if (is_meant) drive_wire(request.asked, i, (values.bits & bit) != 0);
      }
    }
    return 0;
  }
  int read_edges(int lines, std::span<gpio_v2_line_event> out) override {
    if (const int error = failing(); error != 0) return -error;
    Request& request = requests_.at(lines);
    if (!is_there) return -ENODEV;
    if (request.edges.empty()) return -EAGAIN;
    std::size_t count = 0;
    for (; count < out.size() && !request.edges.empty(); ++count) {
      out[count] = request.edges.front();
      request.edges.pop_front();
    }
    if (request.edges.empty()) {
      eventfd_t ignored = 0;
      ::eventfd_read(lines, &ignored);
    }
    return static_cast<int>(count);
  }
  /// Levels stay, as on some boards.
  void close_fd(int fd) override {
    if (const auto found = requests_.find(fd); found != requests_.end()) {
      const gpio_v2_line_request& request = found->second.asked;
      for (std::uint32_t i = 0; i < request.num_lines; ++i) wires.at(request.offsets[i]).owner.clear();
      requests_.erase(found);
      return;
    }
    REQUIRE(chips_.erase(fd) == 1);
  }

 private:
  [[nodiscard]] static std::uint64_t flags_of(const gpio_v2_line_request& request, std::uint32_t index) {
    for (std::uint32_t i = 0; i < request.config.num_attrs; ++i) {
      const auto& attribute = request.config.attrs[i];
      const bool is_its = (attribute.mask & (std::uint64_t{1} << index)) != 0;
      if (is_its && attribute.attr.id == GPIO_V2_LINE_ATTR_ID_FLAGS) return attribute.attr.flags;
    }
    return request.config.flags;
  }
  [[nodiscard]] static bool has_attribute(const gpio_v2_line_request& request, std::uint32_t id) {
    const auto* const end = std::begin(request.config.attrs) + request.config.num_attrs;
    return std::any_of(std::begin(request.config.attrs), end, [id](const auto& a) { return a.attr.id == id; });
  }
  [[nodiscard]] static std::uint64_t initial_values_of(const gpio_v2_line_request& request) {
    for (std::uint32_t i = 0; i < request.config.num_attrs; ++i) {
      const auto& attribute = request.config.attrs[i];
      if (attribute.attr.id == GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES) return attribute.attr.values & attribute.mask;
    }
    return 0;
  }
  [[nodiscard]] static bool is_active_low(const gpio_v2_line_request& request, std::uint32_t index) {
    return (flags_of(request, index) & GPIO_V2_LINE_FLAG_ACTIVE_LOW) != 0;
  }
  [[nodiscard]] bool is_active(const gpio_v2_line_request& request, std::uint32_t index) const {
    return wires.at(request.offsets[index]).is_high != is_active_low(request, index);
  }
  void drive_wire(const gpio_v2_line_request& request, std::uint32_t index, bool is_active) {
    Wire& wire = wires.at(request.offsets[index]);
    REQUIRE(wire.is_output);
    wire.is_high = is_active != is_active_low(request, index);
    wire.was_driven.push_back(wire.is_high);
    driven_lines.push_back(request.offsets[index]);
  }
  [[nodiscard]] int refusal_of(const gpio_v2_line_request& request) const {
    if (!is_there) return ENODEV;
    const bool wants_edges = (request.config.flags & GPIO_V2_LINE_FLAG_EDGE_RISING) != 0;
    if (wants_edges && !interrupts) return ENXIO;
    if (has_attribute(request, GPIO_V2_LINE_ATTR_ID_DEBOUNCE) && !debounces) return 524;  // the kernel's ENOTSUPP
    for (std::uint32_t i = 0; i < request.num_lines; ++i) {
      if (request.offsets[i] >= line_count) return EINVAL;
      if (!wires.at(request.offsets[i]).owner.empty()) return EBUSY;
    }
    return 0;
  }
  void queue_edge(Request& request, std::uint32_t index) {
    if ((flags_of(request.asked, index) & GPIO_V2_LINE_FLAG_EDGE_RISING) == 0) return;
    gpio_v2_line_event edge{};
    edge.offset = request.asked.offsets[index];
    edge.timestamp_ns = monotonic_ns;
    edge.line_seqno = ++request.edges_seen.at(index);
    edge.id = is_active(request.asked, index) ? GPIO_V2_LINE_EVENT_RISING_EDGE : GPIO_V2_LINE_EVENT_FALLING_EDGE;
    if (edges_to_lose > 0) {
      --edges_to_lose;
      return;
    }
    // If the queue is full the oldest edge is dropped, as in the kernel.
    const std::size_t kept = request.asked.event_buffer_size;
    if (kept > 0 && request.edges.size() == kept) request.edges.pop_front();
    request.edges.push_back(edge);
    ::eventfd_write(request.fd.get(), 1);
  }
  [[nodiscard]] int failing() {
    if (calls_until_failure_ < 0 || calls_until_failure_-- > 0) return 0;
    return failure_;
  }

  std::map<int, OwnedFd> chips_;
  std::map<int, Request> requests_;
  int calls_until_failure_ = -1;
  int failure_ = 0;
};

}  // namespace bmu
