// Contactors, their auxiliary contacts and inputs on GPIO lines, as configured (config/types/gpio_config.hpp).
//
// Uses the kernel's own calls (<linux/gpio.h>, version 2, Linux 5.10 and newer): one request for all outputs, which are
// open from the moment of the request, and one for all lines that are read. No call here waits.
//
// A level may stay on its wire when the process that set it is gone. So each drive() toggles the watchdog line, and if
// that stops, be it for a stuck loop, a kill or a chip that fails, an external monostable releases the contactors.
//
// The pulse output of an insulation monitor is a request of its own, and no epoll waits for it: the kernel records each
// edge with its time on the monotonic clock, and read() collects them. So an output that chatters neither wakes a loop
// nor takes the room of an emergency stop's edge in the queue.
//
// A chip that vanishes, a line that is busy, a call that fails: the first of them leads to state `failed`. All outputs
// are then commanded open, all lines released, and the watchdog stands still until maintain() has them again. They come
// back held open: contactors move only after one decision that commands all of them open, since those that were closed
// before no longer are, and closing has to begin with precharge.
//
// Use in a loop:
//   at start             open(); maintain() retries it after a failure. fd() is added to the epoll once and for all.
//   fd() readable        read(): the present levels, to be observed, and decided on at once where an edge is urgent
//   once a tick          read() too, before the decision: levels have an age, and no edge reports that a chip is gone
//   after each decision  drive(decisions.outputs), in the same place as the frames are sent, changed or not
//   after read()         pulses(), if those of the insulation monitor are captured: their changes
//   each 100 ms          maintain(), together with that of the bus ports; state() is then the one to report
// A failure of read() or drive() is an observation, too: contactors that were closed by these lines are not any more.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <linux/gpio.h>

#include "config/types/gpio_config.hpp"
#include "daemon/core/contactors/contactor_sequence.hpp"
#include "daemon/shell/system/os_error.hpp"
#include "daemon/shell/system/owned_fd.hpp"
#include "protocol/ir155_capture.hpp"
#include "protocol/result.hpp"

namespace bmu {

/// The system calls of GPIO lines; tests replace them, to have chips that vanish and busy lines on machines without
/// any. A negative result is an errno value. Descriptors must be real enough for epoll.
class GpioSystem {
 public:
  virtual ~GpioSystem() = default;

  [[nodiscard]] virtual int open_chip(const std::string& file) = 0;
  [[nodiscard]] virtual int chip_info(int chip, gpiochip_info& out) = 0;
  [[nodiscard]] virtual int line_info(int chip, gpio_v2_line_info& in_out) = 0;
  /// The descriptor of the lines, non-blocking.
  [[nodiscard]] virtual int request_lines(int chip, gpio_v2_line_request& request) = 0;
  [[nodiscard]] virtual int get_values(int lines, gpio_v2_line_values& in_out) = 0;
  [[nodiscard]] virtual int set_values(int lines, const gpio_v2_line_values& values) = 0;
  /// Number of edges, or -EAGAIN.
  [[nodiscard]] virtual int read_edges(int lines, std::span<gpio_v2_line_event> out) = 0;
  virtual void close_fd(int fd) = 0;
};

/// The running kernel.
[[nodiscard]] GpioSystem& kernel_gpio_system();

enum class GpioState : std::uint8_t {
  failed,     // no line is requested; last_error() has the reason
  held_open,  // requested, but no contactor closes before all have been commanded open
  driving,    // as commanded
};

[[nodiscard]] std::string_view to_text(GpioState state);

/// Level of one line.
struct GpioLevel {
  std::string_view name;                  // of the input; of a feedback the name of its output
  std::optional<GpioOutput> feedback_of;  // empty for an input
  GpioInputKind kind{};                   // of an input
  bool is_active = false;                 // closed, healthy or present
  /// Inactive at some time since the last read, now included: e.g. a stop that was pressed and released between two
  /// reads. Limited by the kernel's queue of edges, which holds 16 for each line.
  bool was_inactive = false;
};

namespace detail {

/// A line to be requested.
struct GpioWanted {
  std::string name;  // for messages: "main_positive", "feedback of charge"; for an input its own name
  GpioLine at;
  Duration debounce{};
};

/// A descriptor of a GpioSystem: closed when its owner is destroyed.
class GpioFd {
 public:
  explicit GpioFd(GpioSystem& system, int fd = -1) : system_(&system), fd_(fd) {}
  GpioFd(const GpioFd&) = delete;
  GpioFd& operator=(const GpioFd&) = delete;
  GpioFd(GpioFd&& other) noexcept;
  GpioFd& operator=(GpioFd&& other) noexcept;
  ~GpioFd() { close(); }

  void close();
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }

 private:
  GpioSystem* system_;
  int fd_;
};

}  // namespace detail

class GpioLines {
 public:
  /// In state `failed` until open() succeeds.
  explicit GpioLines(const GpioConfig& config, GpioSystem& system = kernel_gpio_system());
  GpioLines(const GpioLines&) = delete;
  GpioLines& operator=(const GpioLines&) = delete;
  /// Leaves the outputs open.
  ~GpioLines();

  /// Opens all lines, or none. The error names chip, line, found and wanted.
  [[nodiscard]] Result<void, OsError> open();
  /// Sets all outputs in one call, and only then toggles the watchdog in another. In state `held_open` all outputs stay
  /// open, which is not a failure.
  [[nodiscard]] Result<void, OsError> drive(const ContactorOutputs& outputs);
  /// All levels, read in one call: first the feedbacks, then the inputs in the order of the pack file. Takes the edges
  /// out of the descriptor. Valid until the next read(); `name` as long as this object.
  [[nodiscard]] Result<std::span<const GpioLevel>, OsError> read();
  /// The insulation monitor's pulses as of `now`, if the last read() had an edge, or the line has just been requested;
  /// returned once. `now` is on the monotonic clock, and after that read().
  [[nodiscard]] std::optional<ir155::Pwm> pulses(TimePoint now);
  /// To be called about every 100 ms: reopens failed lines.
  void maintain();

  /// Watch for EPOLLIN: a line that is read has changed, or the chip is gone. Stable for the lifetime of the object.
  [[nodiscard]] int fd() const { return poll_.get(); }
  [[nodiscard]] GpioState state() const { return state_; }
  [[nodiscard]] std::string last_error() const;
  [[nodiscard]] const std::string& chip() const { return chip_; }
  /// Names of all lines, outputs first: "main_positive", "feedback of main_positive", "insulation_ok".
  [[nodiscard]] std::vector<std::string> names() const;
  /// Names of the inputs of a kind, in the order of the pack file. Valid as long as this object.
  [[nodiscard]] std::vector<std::string_view> names_of(GpioInputKind kind) const;

 private:
  [[nodiscard]] Result<void, OsError> watch(int lines);
  [[nodiscard]] Result<void, OsError> open_pulses(detail::GpioFd request);
  [[nodiscard]] Result<void, OsError> take_edges();
  [[nodiscard]] Result<void, OsError> take_pulses();
  /// Calls take(edge) for each edge that has arrived.
  template <class Take>
  [[nodiscard]] Result<void, OsError> each_edge(const detail::GpioFd& request,
                                                std::span<const detail::GpioWanted> lines, Take take);
  [[nodiscard]] Result<void, OsError> set_levels(const ContactorOutputs& outputs);
  [[nodiscard]] std::string driven_text(const ContactorOutputs& outputs) const;
  [[nodiscard]] tl::unexpected<OsError> fail(OsError error);
  [[nodiscard]] int open_contactors();
  void close();

  GpioSystem& system_;
  std::string chip_;
  std::vector<GpioOutput> outputs_;               // in the order of the request
  std::vector<detail::GpioWanted> output_lines_;  // in the same order
  std::vector<detail::GpioWanted> read_lines_;
  std::vector<GpioLevel> levels_;  // of read_lines_
  OwnedFd poll_;                   // an epoll instance: itself pollable, and it stays while the requests in it change
  detail::GpioFd output_fd_;
  detail::GpioFd read_fd_;
  std::vector<detail::GpioWanted> pulse_lines_;  // one at the most
  detail::GpioFd pulse_fd_;
  ir155::Capture capture_;
  std::uint32_t pulse_edges_ = 0;  // number of the last edge
  bool are_pulses_news_ = false;
  GpioState state_ = GpioState::failed;
  bool is_watchdog_high_ = false;
  OsError last_failure_;
};

/// Drives all outputs open and releases the lines, for use after a daemon that ended without doing so. One error for
/// each line that could not be opened; the others are open then nevertheless.
[[nodiscard]] std::vector<OsError> open_gpio_outputs(const GpioConfig& config,
                                                     GpioSystem& system = kernel_gpio_system());

}  // namespace bmu
