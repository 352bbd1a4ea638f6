// Contactors, their auxiliary contacts and inputs on lines of a GPIO chip (config/types/gpio_config.hpp says which).
//
// By the kernel's own calls (<linux/gpio.h>, version 2, Linux 5.10 and newer): one request for all outputs, which are
// open from the moment they are ours, and one for all lines that are read. No call here waits.
//
// A level may stay on its wire when the process that set it is gone. So with every drive() the watchdog line changes,
// and whatever stops that, be it a stuck loop, a kill or a chip that fails, makes an external monostable let go.
//
// An insulation monitor's pulse output is a request of its own that nobody waits for: the kernel takes each edge down
// with its time on the monotonic clock, and read() collects them. So an output that chatters neither wakes a loop nor
// takes the room of an emergency stop's edge in the queue.
//
// A chip that vanishes, a line that is busy, a call that fails: the first of them ends in state `failed`. All outputs
// are told to open then, all lines given back, and the watchdog stands still until maintain() has them again. They come
// back held open: contactors move only after one decision that wants none of them closed, since what was closed before
// is not, and closing has to begin with precharge.
//
// How a loop uses it:
//   at start             open(); what it refuses maintain() tries again. fd() goes into the loop's epoll, for good.
//   fd() readable        read(): the levels of now, to be observed, and decided on at once where an edge cannot wait
//   once a tick          read() too, before the decision: levels have an age, and no edge tells that a chip is gone
//   after each decision  drive(decisions.outputs), in the same place as the frames are sent, changed or not
//   after read()         pulses(), where the insulation monitor's are captured: what is new of them
//   each 100 ms          maintain(), where the bus ports have theirs; state() is then what there is to tell
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

/// The system calls of GPIO lines, so that tests can have chips that vanish and lines that are busy on machines without
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
  /// How many there were, or -EAGAIN.
  [[nodiscard]] virtual int read_edges(int lines, std::span<gpio_v2_line_event> out) = 0;
  virtual void close_fd(int fd) = 0;
};

/// The running kernel.
[[nodiscard]] GpioSystem& kernel_gpio_system();

enum class GpioState : std::uint8_t {
  failed,     // no line is ours; last_error() says why
  held_open,  // ours, but no contactor closes before all have been wanted open
  driving,    // as wanted
};

[[nodiscard]] std::string_view to_text(GpioState state);

/// What one line tells.
struct GpioLevel {
  std::string_view name;                  // of the input; of a feedback the name of its output
  std::optional<GpioOutput> feedback_of;  // empty for an input
  GpioInputKind kind{};                   // of an input
  bool is_active = false;                 // closed, healthy or present
  /// At some moment since the last read, now included: a stop that was pressed and let go between two reads. As far
  /// as the kernel's queue of edges reaches, which holds 16 for each line.
  bool was_inactive = false;
};

namespace detail {

/// A line as it is to be requested.
struct GpioWanted {
  std::string name;  // for messages: "main_positive", "feedback of charge"; of an input its own
  GpioLine at;
  Duration debounce{};
};

/// A descriptor of the seam: closed when its owner goes.
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

  /// All lines, or none. The error names chip, line, found and wanted.
  [[nodiscard]] Result<void, OsError> open();
  /// Sets all outputs in one call, and only then changes the watchdog's level in another. In state `held_open` they all
  /// stay open, which is no failure.
  [[nodiscard]] Result<void, OsError> drive(const ContactorOutputs& outputs);
  /// All levels, taken in one call: first the feedbacks, then the inputs in the order of the pack file. Takes the edges
  /// out of the descriptor. Valid until the next read(); `name` as long as this object.
  [[nodiscard]] Result<std::span<const GpioLevel>, OsError> read();
  /// The insulation monitor's pulses as of now, if the last read() has seen an edge, or the line has just become ours;
  /// told once. `now` is on the monotonic clock, and after that read().
  [[nodiscard]] std::optional<ir155::Pwm> pulses(TimePoint now);
  /// Call every 100 ms or so: opens what has failed.
  void maintain();

  /// Watch for EPOLLIN: a line that is read has changed, or the chip is gone. Stable for the life of the object.
  [[nodiscard]] int fd() const { return poll_.get(); }
  [[nodiscard]] GpioState state() const { return state_; }
  [[nodiscard]] std::string last_error() const;
  [[nodiscard]] const std::string& chip() const { return chip_; }
  /// What all lines are called, outputs first: "main_positive", "feedback of main_positive", "insulation_ok".
  [[nodiscard]] std::vector<std::string> names() const;
  /// What the inputs of a kind are called, in the order of the pack file. Valid as long as this object.
  [[nodiscard]] std::vector<std::string_view> names_of(GpioInputKind kind) const;

 private:
  [[nodiscard]] Result<void, OsError> watch(int lines);
  [[nodiscard]] Result<void, OsError> open_pulses(detail::GpioFd request);
  [[nodiscard]] Result<void, OsError> take_edges();
  [[nodiscard]] Result<void, OsError> take_pulses();
  /// Calls take(edge) for each that has come.
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
  std::vector<detail::GpioWanted> output_lines_;  // the same
  std::vector<detail::GpioWanted> read_lines_;
  std::vector<GpioLevel> levels_;  // of read_lines_
  OwnedFd poll_;                   // an epoll instance: itself pollable, and it stays while the requests in it change
  detail::GpioFd output_fd_;
  detail::GpioFd read_fd_;
  std::vector<detail::GpioWanted> pulse_lines_;  // one at the most
  detail::GpioFd pulse_fd_;
  ir155::Capture capture_;
  std::uint32_t pulse_edges_ = 0;  // the number of the last one
  bool are_pulses_news_ = false;
  GpioState state_ = GpioState::failed;
  bool is_watchdog_high_ = false;
  OsError last_failure_;
};

/// Drives all outputs open and gives the lines back, for when the daemon has gone without doing so. One error for each
/// line that could not be; the others are open then nevertheless.
[[nodiscard]] std::vector<OsError> open_gpio_outputs(const GpioConfig& config,
                                                     GpioSystem& system = kernel_gpio_system());

}  // namespace bmu
