#include "daemon/shell/gpio/gpio_lines.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "protocol/assert.hpp"

namespace bmu {

using detail::GpioFd;
using detail::GpioWanted;

namespace {

constexpr const char* consumer = "bmud";  // owner of the lines as shown by gpioinfo
constexpr std::size_t edges_per_read = 32;
// An IR155 has 100 edges a second at the most: room for 0.6 s without a read. A loss beyond that is detected.
constexpr std::uint32_t pulse_edges_kept = 64;
// More than the queue of the kernel ever holds: bounds the time spent on a chattering line.
constexpr std::size_t edge_reads_max = GPIO_V2_LINES_MAX * 16 / edges_per_read;

class KernelGpioSystem final : public GpioSystem {
 public:
  int open_chip(const std::string& file) override { return checked(::open(file.c_str(), O_RDWR | O_CLOEXEC)); }
  int chip_info(int chip, gpiochip_info& out) override { return checked(::ioctl(chip, GPIO_GET_CHIPINFO_IOCTL, &out)); }
  int line_info(int chip, gpio_v2_line_info& in_out) override {
    return checked(::ioctl(chip, GPIO_V2_GET_LINEINFO_IOCTL, &in_out));
  }
  int request_lines(int chip, gpio_v2_line_request& request) override {
    const int result = checked(::ioctl(chip, GPIO_V2_GET_LINE_IOCTL, &request));
    if (result < 0) return result;
    const int flagged = checked(::fcntl(request.fd, F_SETFL, O_NONBLOCK));
    if (flagged < 0) ::close(request.fd);
    return flagged < 0 ? flagged : request.fd;
  }
  int get_values(int lines, gpio_v2_line_values& in_out) override {
    return checked(::ioctl(lines, GPIO_V2_LINE_GET_VALUES_IOCTL, &in_out));
  }
  int set_values(int lines, const gpio_v2_line_values& values) override {
    gpio_v2_line_values copy = values;
    return checked(::ioctl(lines, GPIO_V2_LINE_SET_VALUES_IOCTL, &copy));
  }
  int read_edges(int lines, std::span<gpio_v2_line_event> out) override {
    const int bytes = checked(static_cast<int>(::read(lines, out.data(), out.size_bytes())));
    return bytes < 0 ? bytes : bytes / static_cast<int>(sizeof(gpio_v2_line_event));
  }
  void close_fd(int fd) override { ::close(fd); }

 private:
  static int checked(int result) { return result < 0 ? -errno : result; }
};

// --- roles of the lines ---------------------------------------------------------------------------------------------

/// By number of the output; the watchdog is not commanded.
constexpr std::array<bool ContactorOutputs::*, gpio_feedback_count> commanded{
    &ContactorOutputs::main_positive, &ContactorOutputs::main_negative, &ContactorOutputs::precharge,
    &ContactorOutputs::charge,        &ContactorOutputs::auxiliary,     &ContactorOutputs::fan,
    &ContactorOutputs::heater};

constexpr std::uint64_t bit_of(std::size_t index) {
  return std::uint64_t{1} << index;
}
constexpr std::uint64_t all_bits(std::size_t count) {
  return bit_of(count) - 1;
}
static_assert(gpio_feedback_count + gpio_inputs_max < GPIO_V2_LINES_MAX);
static_assert(gpio_debounce_times_max + 1 == GPIO_V2_LINE_NUM_ATTRS_MAX);

/// The watchdog is the last: a chip that sets one line at a time has switched the contactors before its edge.
static_assert(static_cast<std::size_t>(GpioOutput::watchdog) + 1 == gpio_output_count);
std::vector<GpioOutput> outputs_of(const GpioConfig& config) {
  std::vector<GpioOutput> outputs;
  for (std::size_t i = 0; i < gpio_output_count; ++i) {
    if (config.outputs.at(i)) outputs.push_back(static_cast<GpioOutput>(i));
  }
  return outputs;
}

std::vector<GpioWanted> output_lines_of(const GpioConfig& config) {
  std::vector<GpioWanted> lines;
  for (const GpioOutput output : outputs_of(config)) {
    lines.push_back({.name = std::string(to_text(output)), .at = *config.outputs.at(static_cast<std::size_t>(output))});
  }
  return lines;
}

std::string line_text(const GpioWanted& line) {
  return std::to_string(line.at.line) + " (" + line.name + ")";
}

/// "/dev/gpiochip0 line 3 (fan)", "/dev/gpiochip0 lines 3 (fan), 4 (heater)"
std::string place_text(const std::string& chip, std::span<const GpioWanted> lines) {
  std::string text = chip + (lines.size() == 1 ? " line " : " lines ");
  for (const GpioWanted& line : lines) text += (&line == lines.data() ? "" : ", ") + line_text(line);
  return text;
}

OsError refusal(int code, const std::string& where, const std::string& found, const std::string& wanted) {
  return {.code = code, .what = where + ": " + found + ", expected " + wanted};
}

// --- requests -------------------------------------------------------------------------------------------------------

constexpr std::uint64_t output_flags = GPIO_V2_LINE_FLAG_OUTPUT;
constexpr std::uint64_t input_flags = GPIO_V2_LINE_FLAG_INPUT;
constexpr std::uint64_t edge_flags = input_flags | GPIO_V2_LINE_FLAG_EDGE_RISING | GPIO_V2_LINE_FLAG_EDGE_FALLING;

gpio_v2_line_config_attribute& add_attribute(gpio_v2_line_config& config, std::uint32_t id) {
  BMU_ASSERT(config.num_attrs < GPIO_V2_LINE_NUM_ATTRS_MAX);
  gpio_v2_line_config_attribute& attribute = config.attrs[config.num_attrs++];
  attribute.attr.id = id;
  return attribute;
}

void add_polarity(gpio_v2_line_config& config, std::span<const GpioWanted> lines) {
  std::uint64_t mask = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) mask |= lines[i].at.active_low ? bit_of(i) : 0;
  if (mask == 0) return;
  gpio_v2_line_config_attribute& attribute = add_attribute(config, GPIO_V2_LINE_ATTR_ID_FLAGS);
  attribute.attr.flags = config.flags | GPIO_V2_LINE_FLAG_ACTIVE_LOW;
  attribute.mask = mask;
}

/// One attribute for each debounce time; the lines that share it are in its mask.
void add_debounce(gpio_v2_line_config& config, std::span<const GpioWanted> lines) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto period_us = static_cast<std::uint32_t>(lines[i].debounce / 1us);
    if (period_us == 0) continue;
    const auto has_period = [period_us](const gpio_v2_line_config_attribute& attribute) {
      return attribute.attr.id == GPIO_V2_LINE_ATTR_ID_DEBOUNCE && attribute.attr.debounce_period_us == period_us;
    };
    auto* const end = std::begin(config.attrs) + config.num_attrs;
    auto* found = std::find_if(std::begin(config.attrs), end, has_period);
    if (found == end) {
      found = &add_attribute(config, GPIO_V2_LINE_ATTR_ID_DEBOUNCE);
      found->attr.debounce_period_us = period_us;
    }
    found->mask |= bit_of(i);
  }
}

gpio_v2_line_request request_of(std::span<const GpioWanted> lines, std::uint64_t flags) {
  gpio_v2_line_request request{};
  std::strncpy(request.consumer, consumer, sizeof(request.consumer) - 1);
  request.num_lines = static_cast<std::uint32_t>(lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) request.offsets[i] = lines[i].at.line;
  request.config.flags = flags;
  add_polarity(request.config, lines);
  return request;
}

/// Levels are logical: 0 is open, whatever the level of the wire, and applies before the line becomes an output.
gpio_v2_line_request output_request(std::span<const GpioWanted> lines) {
  gpio_v2_line_request request = request_of(lines, output_flags);
  gpio_v2_line_config_attribute& attribute = add_attribute(request.config, GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES);
  attribute.attr.values = 0;
  attribute.mask = all_bits(lines.size());
  return request;
}

/// Not debounced: that would move the edges. Without a flag for another clock the kernel's times are monotonic.
gpio_v2_line_request pulse_request(std::span<const GpioWanted> lines) {
  gpio_v2_line_request request = request_of(lines, edge_flags);
  request.event_buffer_size = pulse_edges_kept;
  return request;
}

gpio_v2_line_request edge_request(std::span<const GpioWanted> lines) {
  gpio_v2_line_request request = request_of(lines, edge_flags);
  add_debounce(request.config, lines);
  return request;
}

// --- the chip -------------------------------------------------------------------------------------------------------

/// Text of the kernel or of another program, of at most the size of the array.
template <std::size_t Size>
std::string text_of(const char (&text)[Size]) {
  return {text, strnlen(text, Size)};
}

/// Open while lines are being requested; the requests persist without it.
class Chip {
 public:
  Chip(GpioSystem& system, std::string file) : system_(system), file_(std::move(file)), fd_(system) {}

  [[nodiscard]] Result<void, OsError> open() {
    const int fd = system_.open_chip(file_);
    if (fd < 0) {
      return failure(refusal(-fd, file_, "cannot be opened",
                             "a GPIO chip that this user may open (a service: see systemd/gpio.conf)"));
    }
    fd_ = GpioFd(system_, fd);
    if (const int result = system_.chip_info(fd, info_); result < 0) {
      return failure(refusal(-result, file_, "not a GPIO chip", "one listed by gpiodetect"));
    }
    return {};
  }

  [[nodiscard]] Result<GpioFd, OsError> request_outputs(std::span<const GpioWanted> lines) {
    return request(lines, output_request(lines), [&](int error) {
      return refusal(error, place_text(file_, lines), "refused as outputs", "outputs that start open");
    });
  }

  [[nodiscard]] Result<GpioFd, OsError> request_inputs(std::span<const GpioWanted> lines) {
    return request(lines, edge_request(lines), [&](int error) { return find_refused_part(lines, error); });
  }

  [[nodiscard]] Result<GpioFd, OsError> request_pulses(std::span<const GpioWanted> lines) {
    return request(lines, pulse_request(lines), [&](int error) {
      return refusal(error, place_text(file_, lines), "edges refused", "a line that can interrupt");
    });
  }

 private:
  /// `refused` makes the error for a request that the kernel does not support.
  template <class Refused>
  [[nodiscard]] Result<GpioFd, OsError> request(std::span<const GpioWanted> lines, gpio_v2_line_request wanted,
                                                Refused refused) {
    if (const auto there = check_numbers(lines); !there) return failure(there.error());
    const int fd = system_.request_lines(fd_.get(), wanted);
    if (fd >= 0) return GpioFd(system_, fd);
    if (const auto owner = find_owner(lines, -fd)) return failure(*owner);
    return failure(refused(-fd));
  }

  [[nodiscard]] Result<void, OsError> check_numbers(std::span<const GpioWanted> lines) const {
    for (const GpioWanted& line : lines) {
      if (line.at.line < info_.lines) continue;
      return failure(refusal(0, place_text(file_, {&line, 1}),
                             "chip has " + std::to_string(info_.lines) + " lines, " + text_of(info_.label),
                             "a chip with this line"));
    }
    return {};
  }

  /// The kernel reports that a line is busy, but neither which one nor its owner.
  [[nodiscard]] std::optional<OsError> find_owner(std::span<const GpioWanted> lines, int code) {
    for (const GpioWanted& line : lines) {
      gpio_v2_line_info info{};
      info.offset = line.at.line;
      if (system_.line_info(fd_.get(), info) < 0 || (info.flags & GPIO_V2_LINE_FLAG_USED) == 0) continue;
      return refusal(code, place_text(file_, {&line, 1}), "in use by \"" + text_of(info.consumer) + "\"",
                     "a free line");
    }
    return std::nullopt;
  }

  /// Nor does the kernel report which part of a request it does not support: the request is repeated with less.
  [[nodiscard]] OsError find_refused_part(std::span<const GpioWanted> lines, int code) {
    const auto without_debounce = request_of(lines, edge_flags);
    const auto without_edges = request_of(lines, input_flags);
    const std::string where = place_text(file_, lines);
    if (is_granted(without_debounce)) {
      return refusal(code, where, "debouncing refused by driver or kernel", "a supported debounce_ms, or 0");
    }
    if (is_granted(without_edges)) return refusal(code, where, "edges refused", "a line that can interrupt");
    return refusal(code, where, "refused as inputs", "inputs");
  }

  [[nodiscard]] bool is_granted(gpio_v2_line_request request) {
    const GpioFd granted(system_, system_.request_lines(fd_.get(), request));
    return granted.is_open();
  }

  GpioSystem& system_;
  std::string file_;
  GpioFd fd_;
  gpiochip_info info_{};
};

}  // namespace

GpioSystem& kernel_gpio_system() {
  static KernelGpioSystem system;
  return system;
}

// --- descriptors ----------------------------------------------------------------------------------------------------

namespace detail {

GpioFd::GpioFd(GpioFd&& other) noexcept : system_(other.system_), fd_(std::exchange(other.fd_, -1)) {}

GpioFd& GpioFd::operator=(GpioFd&& other) noexcept {
  std::swap(system_, other.system_);
  std::swap(fd_, other.fd_);
  return *this;
}

void GpioFd::close() {
  if (fd_ >= 0) system_->close_fd(std::exchange(fd_, -1));
}

}  // namespace detail

// --- the lines ------------------------------------------------------------------------------------------------------

std::string_view to_text(GpioState state) {
  switch (state) {
    case GpioState::failed: return "failed";
    case GpioState::held_open: return "held open";
    case GpioState::driving: return "driving";
  }
  return "?";
}

GpioLines::GpioLines(const GpioConfig& config, GpioSystem& system)
    : system_(system),
      chip_(config.chip),
      outputs_(outputs_of(config)),
      output_lines_(output_lines_of(config)),
      poll_(::epoll_create1(EPOLL_CLOEXEC)),
      output_fd_(system),
      read_fd_(system),
      pulse_fd_(system) {
  if (!poll_.is_open()) last_failure_ = {.code = errno, .what = "epoll for " + chip_};
  for (std::size_t i = 0; i < gpio_feedback_count; ++i) {
    const auto& feedback = config.feedback.at(i);
    if (!feedback) continue;
    const auto output = static_cast<GpioOutput>(i);
    read_lines_.push_back(
        {.name = "feedback of " + std::string(to_text(output)), .at = feedback->at, .debounce = feedback->debounce});
    levels_.push_back({.name = to_text(output), .feedback_of = output});
  }
  for (const GpioInput& input : config.inputs) {
    read_lines_.push_back({.name = input.name, .at = input.at, .debounce = input.debounce});
    levels_.push_back({.name = {}, .feedback_of = {}, .kind = input.kind});
  }
  // Only now, because a vector that grows moves its texts.
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    if (!levels_[i].feedback_of) levels_[i].name = read_lines_[i].name;
  }
  if (config.insulation_pulses) pulse_lines_.push_back({.name = "insulation_pulses", .at = *config.insulation_pulses});
}

GpioLines::~GpioLines() {
  // A failure cannot be reported any more; the watchdog line that stands still makes the contactors open.
  if (output_fd_.is_open()) static_cast<void>(open_contactors());
}

Result<void, OsError> GpioLines::open() {
  if (state_ != GpioState::failed) return {};
  if (!poll_.is_open()) return failure(last_failure_);
  Chip chip(system_, chip_);
  if (const auto opened = chip.open(); !opened) return fail(opened.error());
  if (!output_lines_.empty()) {
    auto outputs = chip.request_outputs(output_lines_);
    if (!outputs) return fail(outputs.error());
    output_fd_ = std::move(*outputs);
  }
  if (!read_lines_.empty()) {
    auto inputs = chip.request_inputs(read_lines_);
    if (!inputs) return fail(inputs.error());
    read_fd_ = std::move(*inputs);
    if (const auto watched = watch(read_fd_.get()); !watched) return fail(watched.error());
  }
  if (!pulse_lines_.empty()) {
    auto pulses = chip.request_pulses(pulse_lines_);
    if (!pulses) return fail(pulses.error());
    if (auto opened = open_pulses(std::move(*pulses)); !opened) return opened;
  }
  is_watchdog_high_ = false;
  state_ = GpioState::held_open;
  return {};
}

/// Also reads the level: a line without edges has one, too.
Result<void, OsError> GpioLines::open_pulses(GpioFd request) {
  pulse_fd_ = std::move(request);
  gpio_v2_line_values level{.bits = 0, .mask = 1};
  if (const int result = system_.get_values(pulse_fd_.get(), level); result < 0) {
    return fail(refusal(-result, place_text(chip_, pulse_lines_), "cannot be read", "its level"));
  }
  capture_.begin(level.bits != 0);
  pulse_edges_ = 0;
  are_pulses_news_ = true;
  return {};
}

Result<void, OsError> GpioLines::watch(int lines) {
  epoll_event event{.events = EPOLLIN, .data = {}};
  if (::epoll_ctl(poll_.get(), EPOLL_CTL_ADD, lines, &event) == 0) return {};
  return failure(OsError{.code = errno, .what = "watch the lines of " + chip_});
}

Result<void, OsError> GpioLines::drive(const ContactorOutputs& outputs) {
  if (state_ == GpioState::failed) return failure(last_failure_);
  if (!outputs.any_contactor()) state_ = GpioState::driving;
  if (outputs_.empty()) return {};
  is_watchdog_high_ = !is_watchdog_high_;
  return set_levels(state_ == GpioState::driving ? outputs : ContactorOutputs{});
}

/// The watchdog is set in a call of its own: the kernel sets the lines of one call in the order of their numbers.
Result<void, OsError> GpioLines::set_levels(const ContactorOutputs& outputs) {
  gpio_v2_line_values levels{.bits = 0, .mask = 0};
  gpio_v2_line_values watchdog{.bits = 0, .mask = 0};
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    const bool is_watchdog = outputs_[i] == GpioOutput::watchdog;
    const bool level = is_watchdog ? is_watchdog_high_ : outputs.*commanded.at(static_cast<std::size_t>(outputs_[i]));
    gpio_v2_line_values& values = is_watchdog ? watchdog : levels;
    values.mask |= bit_of(i);
    if (level) values.bits |= bit_of(i);
  }
  for (gpio_v2_line_values* values : {&levels, &watchdog}) {
    const int result = values->mask == 0 ? 0 : system_.set_values(output_fd_.get(), *values);
    if (result < 0) {
      return fail(refusal(-result, place_text(chip_, output_lines_), "cannot be set", driven_text(outputs)));
    }
  }
  return {};
}

/// "all open", or the outputs to be driven: the expected state in an error.
std::string GpioLines::driven_text(const ContactorOutputs& outputs) const {
  std::string text;
  for (const GpioOutput output : outputs_) {
    if (output == GpioOutput::watchdog || !(outputs.*commanded.at(static_cast<std::size_t>(output)))) continue;
    text += (text.empty() ? "these driven and the others open: " : ", ") + std::string(to_text(output));
  }
  return text.empty() ? "all open" : text;
}

Result<std::span<const GpioLevel>, OsError> GpioLines::read() {
  if (state_ == GpioState::failed) return failure(last_failure_);
  if (const auto taken = take_pulses(); !taken) return failure(taken.error());
  if (read_lines_.empty()) return std::span<const GpioLevel>{};
  for (GpioLevel& level : levels_) level.was_inactive = false;
  if (const auto taken = take_edges(); !taken) return failure(taken.error());
  gpio_v2_line_values values{.bits = 0, .mask = all_bits(levels_.size())};
  if (const int result = system_.get_values(read_fd_.get(), values); result < 0) {
    return fail(refusal(-result, place_text(chip_, read_lines_), "cannot be read", "a level of each"));
  }
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    levels_[i].is_active = (values.bits & bit_of(i)) != 0;
    levels_[i].was_inactive = levels_[i].was_inactive || !levels_[i].is_active;
  }
  return std::span<const GpioLevel>(levels_);
}

template <class Take>
Result<void, OsError> GpioLines::each_edge(const GpioFd& request, std::span<const GpioWanted> lines, Take take) {
  std::array<gpio_v2_line_event, edges_per_read> edges{};
  for (std::size_t reads = 0; reads < edge_reads_max; ++reads) {
    const int count = system_.read_edges(request.get(), edges);
    if (count == -EAGAIN) return {};
    if (count < 0) {
      return fail(refusal(-count, place_text(chip_, lines), "edges cannot be read", "the edges since the last read"));
    }
    for (const gpio_v2_line_event& edge : std::span(edges).first(static_cast<std::size_t>(count))) take(edge);
    if (static_cast<std::size_t>(count) < edges.size()) return {};
  }
  return {};  // for now: the descriptor is still readable
}

Result<void, OsError> GpioLines::take_edges() {
  return each_edge(read_fd_, read_lines_, [this](const gpio_v2_line_event& edge) {
    if (edge.id != GPIO_V2_LINE_EVENT_FALLING_EDGE) return;  // falling: to inactive, whatever the polarity
    for (std::size_t i = 0; i < levels_.size(); ++i) {
      if (read_lines_[i].at.line == edge.offset) levels_[i].was_inactive = true;
    }
  });
}

/// The kernel numbers a line's edges; where it had no room for one, a number is missing.
Result<void, OsError> GpioLines::take_pulses() {
  if (pulse_lines_.empty()) return {};
  return each_edge(pulse_fd_, pulse_lines_, [this](const gpio_v2_line_event& edge) {
    capture_.observe({.at = TimePoint{std::chrono::nanoseconds{static_cast<std::int64_t>(edge.timestamp_ns)}},
                      .is_rising = edge.id == GPIO_V2_LINE_EVENT_RISING_EDGE,
                      .is_after_loss = edge.line_seqno != pulse_edges_ + 1});
    pulse_edges_ = edge.line_seqno;
    are_pulses_news_ = true;
  });
}

std::optional<ir155::Pwm> GpioLines::pulses(TimePoint now) {
  if (!std::exchange(are_pulses_news_, false)) return std::nullopt;
  return capture_.pwm(now);
}

void GpioLines::maintain() {
  if (state_ == GpioState::failed) static_cast<void>(open());  // the error is in last_error()
}

std::vector<std::string> GpioLines::names() const {
  std::vector<std::string> names;
  for (const auto* lines : {&output_lines_, &read_lines_, &pulse_lines_}) {
    for (const GpioWanted& line : *lines) names.push_back(line.name);
  }
  return names;
}

std::vector<std::string_view> GpioLines::names_of(GpioInputKind kind) const {
  std::vector<std::string_view> names;
  for (const GpioLevel& level : levels_) {
    if (!level.feedback_of && level.kind == kind) names.push_back(level.name);
  }
  return names;
}

std::string GpioLines::last_error() const {
  return last_failure_.what.empty() ? "" : to_text(last_failure_);
}

/// Opens all outputs; the watchdog line stands still.
int GpioLines::open_contactors() {
  gpio_v2_line_values values{.bits = 0, .mask = 0};
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    if (outputs_[i] != GpioOutput::watchdog) values.mask |= bit_of(i);
  }
  return values.mask == 0 ? 0 : system_.set_values(output_fd_.get(), values);
}

tl::unexpected<OsError> GpioLines::fail(OsError error) {
  if (output_fd_.is_open() && open_contactors() < 0) error.what += ", and the outputs cannot be opened";
  close();
  last_failure_ = std::move(error);
  return failure(OsError(last_failure_));
}

void GpioLines::close() {
  output_fd_.close();
  read_fd_.close();  // that also takes it out of the epoll instance
  pulse_fd_.close();
  are_pulses_news_ = false;
  state_ = GpioState::failed;
}

std::vector<OsError> open_gpio_outputs(const GpioConfig& config, GpioSystem& system) {
  const std::vector<GpioWanted> lines = output_lines_of(config);
  if (lines.empty()) return {};
  Chip chip(system, config.chip);
  if (const auto opened = chip.open(); !opened) return {opened.error()};
  if (chip.request_outputs(lines)) return {};
  // A busy line must not keep the others closed.
  std::vector<OsError> errors;
  for (const GpioWanted& line : lines) {
    const auto requested = chip.request_outputs({&line, 1});
    if (!requested) errors.push_back(requested.error());
  }
  return errors;
}

}  // namespace bmu
