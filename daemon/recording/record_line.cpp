#include "daemon/recording/record_line.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>

#include "protocol/assert.hpp"
#include "protocol/image.hpp"

namespace bmu {

namespace {

// --- words ----------------------------------------------------------------------------------------------------------

struct CommandRow {
  Command command;
  std::string_view word;
};
constexpr std::array commands{
    CommandRow{Command::clear_faults, "clear_faults"},   CommandRow{Command::wake, "wake"},
    CommandRow{Command::balancing_off, "balancing_off"}, CommandRow{Command::balancing_on, "balancing_on"},
    CommandRow{Command::shut_down, "shut_down"},         CommandRow{Command::accept_modules, "accept_modules"},
    CommandRow{Command::assign_node, "assign_node"}};

template <class Struct>
struct FlagRow {
  bool Struct::*flag;
  std::string_view word;
};
constexpr std::array health_flags{FlagRow<OwnHealth>{&OwnHealth::store_unreadable, "store_unreadable"},
                                  FlagRow<OwnHealth>{&OwnHealth::store_write_failed, "store_write_failed"},
                                  FlagRow<OwnHealth>{&OwnHealth::history_write_failed, "history_write_failed"},
                                  FlagRow<OwnHealth>{&OwnHealth::memory_low, "memory_low"},
                                  FlagRow<OwnHealth>{&OwnHealth::disk_low, "disk_low"}};
constexpr std::array line_flags{FlagRow<LineImage>{&LineImage::is_failed, "failed"},
                                FlagRow<LineImage>{&LineImage::vehicle_on, "vehicle_on"},
                                FlagRow<LineImage>{&LineImage::charger_connected, "charger_connected"},
                                FlagRow<LineImage>{&LineImage::resume_button, "resume_button"},
                                FlagRow<LineImage>{&LineImage::insulation_ok, "insulation_ok"},
                                FlagRow<LineImage>{&LineImage::supply_ok, "supply_ok"}};
constexpr std::array output_flags{FlagRow<ContactorOutputs>{&ContactorOutputs::main_negative, "main_negative"},
                                  FlagRow<ContactorOutputs>{&ContactorOutputs::precharge, "precharge"},
                                  FlagRow<ContactorOutputs>{&ContactorOutputs::main_positive, "main_positive"},
                                  FlagRow<ContactorOutputs>{&ContactorOutputs::charge, "charge"},
                                  FlagRow<ContactorOutputs>{&ContactorOutputs::auxiliary, "auxiliary"},
                                  FlagRow<ContactorOutputs>{&ContactorOutputs::fan, "fan"},
                                  FlagRow<ContactorOutputs>{&ContactorOutputs::heater, "heater"}};

constexpr std::uint32_t error_class_max = 0x1FFF'FFFF;

// --- out ------------------------------------------------------------------------------------------------------------

class Out {
 public:
  explicit Out(std::span<char, record_line_max> to) : to_(to) {}

  Out& text(std::string_view text) {
    BMU_ASSERT(text.size() <= to_.size() - size_);
    std::memcpy(to_.data() + size_, text.data(), text.size());
    size_ += text.size();
    return *this;
  }
  template <class Number>
  Out& number(Number value) {
    const auto done = std::to_chars(to_.data() + size_, to_.data() + to_.size(), value);
    BMU_ASSERT(done.ec == std::errc{});
    size_ = static_cast<std::size_t>(done.ptr - to_.data());
    return *this;
  }
  Out& hex(std::uint64_t value, int digits) {
    for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) text({&"0123456789abcdef"[(value >> shift) & 0xfU], 1});
    return *this;
  }
  /// "(1700000000.123456)"
  Out& time(std::int64_t log_us) {
    constexpr std::int64_t us_per_s = 1'000'000;
    text("(").number(log_us / us_per_s).text(".");
    for (std::int64_t unit = us_per_s / 10; unit > 0; unit /= 10) number(log_us / unit % 10);
    return text(")");
  }
  Out& frame(std::int64_t log_us, const std::string& bus, const CanFrame& frame, Direction direction) {
    std::array<char, log_line_length_max> line{};
    const LogLine logged{
        .kind = LogLineKind::frame, .direction = direction, .time_us = log_us, .bus = bus, .frame = frame};
    return text({line.data(), print_log_line(logged, line)});
  }
  /// The same without time and direction: "vcan0 040#0300"
  Out& frame(const std::string& bus, const CanFrame& frame) {
    std::array<char, log_line_length_max> line{};
    const LogLine logged{.kind = LogLineKind::frame, .bus = bus, .frame = frame};
    const std::string_view all(line.data(), print_log_line(logged, line));
    return text(all.substr(all.find(' ') + 1));
  }
  template <class Struct, std::size_t Count>
  Out& flags(const Struct& value, const std::array<FlagRow<Struct>, Count>& rows) {
    for (const FlagRow<Struct>& row : rows) {
      if (value.*row.flag) text(" ").text(row.word);
    }
    return *this;
  }
  Out& word_and_number(std::string_view word, std::uint64_t value) {
    return value == 0 ? *this : text(" ").text(word).text(" ").number(value);
  }
  [[nodiscard]] std::size_t end_line() {
    text("\n");
    return size_;
  }

 private:
  std::span<char, record_line_max> to_;
  std::size_t size_ = 0;
};

struct Printer {
  Out& out;
  std::int64_t log_us;
  const RecordBuses& buses;

  Out& comment(std::string_view word) const { return out.text("# ").time(log_us).text(" ").text(word); }

  void operator()(const FrameReceived& what) const {
    out.frame(log_us, buses.name(what.port), what.frame, Direction::received);
  }
  void operator()(const FrameEchoed& what) const {
    out.frame(log_us, buses.name(what.port), what.frame, Direction::sent);
  }
  void operator()(const BusErrorSeen& what) const {
    CanFrame frame{.id = what.classes & error_class_max, .is_error = true, .length = 8};
    frame.data[1] = what.controller;
    out.frame(log_us, buses.name(what.port), frame, Direction::unknown);
  }
  void operator()(const SendFailed& what) const {
    comment("failed ").text(to_text(what.port)).text(" ").frame(buses.name(what.port), what.frame);
  }
  void operator()(const PortChanged& what) const {
    comment("port ").text(to_text(what.port)).text(what.is_up ? " up" : " down");
  }
  void operator()(const FramesLost& what) const {
    comment("lost ").text(to_text(what.port)).text(" ").number(what.count);
  }
  void operator()(const CommandGiven& what) const {
    const auto* const row = std::find_if(commands.begin(), commands.end(),
                                         [&](const CommandRow& one) { return one.command == what.command; });
    BMU_ASSERT(row != commands.end());
    comment("command ").text(row->word).text(" ").text(to_text(what.authority)).text(" by ").number(what.user_id);
    out.word_and_number("node", what.node).word_and_number("serial_number", what.serial_number);
    if (what.is_unheard_allowed) out.text(" unheard");
  }
  void operator()(const WallClockSeen& what) const { comment("clock ").number(what.unix_time_ms); }
  void operator()(const HealthSeen& what) const { comment("health").flags(what.health, health_flags); }
  void operator()(const LinesSeen& what) const {
    comment("lines").flags(what.image, line_flags);
    out.word_and_number("contacts", what.image.closed_contacts).word_and_number("estops", what.image.estops_pressed);
    out.word_and_number("interlocks", what.image.interlocks_open);
  }
  void operator()(const PulsesSeen& what) const {
    comment("pulses ").number(what.pwm.frequency_mHz).text(" mHz ").number(what.pwm.duty_permille);
    out.text(" permille ").number(what.pwm.since_edge / 1us).text(what.pwm.is_high ? " us high" : " us low");
  }
  void operator()(const ClaimBegins& what) const {
    comment("claim ").number(what.length / 1us).text(what.is_kept ? " us kept" : " us");
  }
  void operator()(const IntakeAirSeen& what) const { comment("air ").number(what.temperature_dC).text(" dC"); }
};

// --- in -------------------------------------------------------------------------------------------------------------

constexpr const char* wanted_bus = "the name of a bus of the recording's head";

/// Parses a comment word by word. The first error is kept.
class In {
 public:
  In(std::string_view line, const RecordBuses& buses) : line_(line), buses_(buses) {}

  /// Up to the next space; empty at the end.
  std::string_view word() {
    while (at_ < line_.size() && line_[at_] == ' ') ++at_;
    const std::size_t first = at_;
    at_ = std::min(line_.find(' ', at_), line_.size());
    word_at_ = first;
    return line_.substr(first, at_ - first);
  }
  [[nodiscard]] bool is_at_end() const { return line_.find_first_not_of(' ', at_) == std::string_view::npos; }
  [[nodiscard]] std::string_view rest() const {
    const std::size_t first = line_.find_first_not_of(' ', at_);
    return first == std::string_view::npos ? std::string_view{} : line_.substr(first);
  }
  void expect(bool holds, std::string_view wanted) {
    if (holds || damage_) return;
    damage_ = RecordDamage{std::string(wanted), word_at_};
  }
  template <class Number>
  Number number(std::string_view wanted, int base = 10) {
    const std::string_view text = word();
    Number value{};
    const auto done = std::from_chars(text.data(), text.data() + text.size(), value, base);
    expect(!text.empty() && done.ec == std::errc{} && done.ptr == text.data() + text.size(), wanted);
    return value;
  }
  Port port() {
    const std::string_view text = word();
    const std::optional<Port> port = port_of_text(text);
    expect(port.has_value(), "internal, vehicle, charger, second_pack or inverter");
    return port.value_or(Port::internal);
  }
  /// The port that has the next word as its bus.
  Port port_of_bus() {
    const std::optional<Port> port = buses_.port_of(word());
    expect(port.has_value(), wanted_bus);
    return port.value_or(Port::internal);
  }
  /// Expects the bus of this port as the next word: a port without one in the head has no frames in a recording.
  void bus_of(Port port) {
    const std::string_view name = word();
    expect(!name.empty() && name == buses_.name(port), "the name of this port's bus, as in the recording's head");
  }
  /// The remaining text, which must be like "040#0300".
  CanFrame frame() {
    word_at_ = line_.size() - rest().size();
    const std::string line = "(0.000000) x " + std::string(rest());
    at_ = line_.size();
    const auto parsed = parse_log_line(line);
    expect(parsed && parsed->kind == LogLineKind::frame, "a frame as in a candump log");
    return parsed ? parsed->frame : CanFrame{};
  }
  template <class Struct, std::size_t Count>
  bool flag(std::string_view word, Struct& value, const std::array<FlagRow<Struct>, Count>& rows) {
    for (const FlagRow<Struct>& row : rows) {
      if (word != row.word) continue;
      value.*row.flag = true;
      return true;
    }
    return false;
  }
  void end() {
    const std::string_view more = word();
    expect(more.empty(), "the end of the line");
  }
  [[nodiscard]] const std::optional<RecordDamage>& damage() const { return damage_; }

 private:
  std::string_view line_;
  const RecordBuses& buses_;
  std::size_t at_ = 0;
  std::size_t word_at_ = 0;
  std::optional<RecordDamage> damage_;
};

ObservedThing parse_port(In& in) {
  PortChanged what{.port = in.port()};
  const std::string_view state = in.word();
  in.expect(state == "up" || state == "down", "up or down");
  what.is_up = state == "up";
  return what;
}

ObservedThing parse_lost(In& in) {
  const Port port = in.port();
  return FramesLost{.port = port, .count = in.number<std::uint64_t>("a number of frames")};
}

ObservedThing parse_failed(In& in) {
  const Port port = in.port();
  in.bus_of(port);
  return SendFailed{.port = port, .frame = in.frame()};
}

ObservedThing parse_command(In& in) {
  CommandGiven what;
  const std::string_view name = in.word();
  const auto* const row =
      std::find_if(commands.begin(), commands.end(), [&](const CommandRow& one) { return one.word == name; });
  in.expect(row != commands.end(), "the name of a command");
  if (row != commands.end()) what.command = row->command;
  const std::string_view authority = in.word();
  const bool is_service = authority == to_text(Authority::service);
  in.expect(is_service || authority == to_text(Authority::user), "user or service");
  what.authority = is_service ? Authority::service : Authority::user;
  in.expect(in.word() == "by", "by");
  what.user_id = in.number<std::uint32_t>("a user's number");
  while (!in.is_at_end() && !in.damage()) {
    const std::string_view word = in.word();
    if (word == "unheard") {
      what.is_unheard_allowed = true;
    } else if (word == "node") {
      what.node = in.number<std::uint8_t>("a node number");
    } else if (word == "serial_number") {
      what.serial_number = in.number<std::uint32_t>("a serial number");
    } else {
      in.expect(false, "node, serial_number or unheard");
    }
  }
  return what;
}

ObservedThing parse_clock(In& in) {
  return WallClockSeen{.unix_time_ms = in.number<std::int64_t>("milliseconds since 1970")};
}

ObservedThing parse_health(In& in) {
  HealthSeen what;
  while (!in.is_at_end() && !in.damage()) {
    in.expect(in.flag(in.word(), what.health, health_flags), "a condition of store, memory or disk");
  }
  return what;
}

ObservedThing parse_lines(In& in) {
  LinesSeen what;
  while (!in.is_at_end() && !in.damage()) {
    const std::string_view word = in.word();
    if (in.flag(word, what.image, line_flags)) continue;
    if (word == "contacts") {
      what.image.closed_contacts = in.number<std::uint8_t>("contacts, bit by bit");
    } else if (word == "estops") {
      what.image.estops_pressed = in.number<std::uint16_t>("emergency stops, bit by bit");
    } else if (word == "interlocks") {
      what.image.interlocks_open = in.number<std::uint16_t>("interlocks, bit by bit");
    } else {
      in.expect(false, "levels of GPIO lines");
    }
  }
  return what;
}

ObservedThing parse_pulses(In& in) {
  PulsesSeen what;
  what.pwm.frequency_mHz = in.number<std::int32_t>("a frequency");
  in.expect(in.word() == "mHz", "mHz");
  what.pwm.duty_permille = in.number<std::int32_t>("a duty cycle");
  in.expect(in.word() == "permille", "permille");
  const auto since_us = in.number<std::int64_t>("the time since the last period");
  in.expect(since_us >= 0 && since_us <= record_time_max_us && in.word() == "us", "a time in us");
  const std::string_view level = in.word();
  in.expect(level == "high" || level == "low", "high or low");
  what.pwm.is_high = level == "high";
  if (!in.damage()) what.pwm.since_edge = std::chrono::microseconds{since_us};
  return what;
}

ObservedThing parse_claim(In& in) {
  ClaimBegins what;
  const auto length_us = in.number<std::int64_t>("the receive time before the claim");
  in.expect(length_us >= 0 && length_us <= record_time_max_us && in.word() == "us", "a time in us");
  what.is_kept = !in.is_at_end();
  if (what.is_kept) in.expect(in.word() == "kept", "kept");
  if (!in.damage()) what.length = std::chrono::microseconds{length_us};
  return what;
}

ObservedThing parse_air(In& in) {
  IntakeAirSeen what;
  what.temperature_dC = in.number<std::int32_t>("a temperature");
  in.expect(in.word() == "dC", "dC");
  return what;
}

struct ObservationRow {
  std::string_view word;
  ObservedThing (*parse)(In& in);
};
constexpr std::array observation_rows{ObservationRow{"port", parse_port},     ObservationRow{"lost", parse_lost},
                                      ObservationRow{"failed", parse_failed}, ObservationRow{"command", parse_command},
                                      ObservationRow{"clock", parse_clock},   ObservationRow{"health", parse_health},
                                      ObservationRow{"lines", parse_lines},   ObservationRow{"pulses", parse_pulses},
                                      ObservationRow{"claim", parse_claim},   ObservationRow{"air", parse_air}};

/// "(1700000000.123456)" as candump writes it.
std::optional<std::int64_t> parse_time(std::string_view text) {
  const std::string line = std::string(text) + " x 000#";
  const auto parsed = parse_log_line(line);
  return parsed ? std::optional(parsed->time_us) : std::nullopt;
}

RecordLine parse_timed(In& in, std::string_view time, const RecordClock& clock) {
  const std::optional<std::int64_t> log_us = parse_time(time);
  in.expect(log_us.has_value(), "a time as in a candump log");
  const TimePoint at = clock.to_core(log_us.value_or(0));
  const std::string_view word = in.word();
  if (word == "tick") {
    const auto fingerprint = in.number<std::uint64_t>("16 hexadecimal digits", 16);
    const auto lines_sum = in.number<std::uint32_t>("8 hexadecimal digits", 16);
    return RecordTick{.at = at, .fingerprint = fingerprint, .lines_sum = lines_sum};
  }
  const auto* const row = std::find_if(observation_rows.begin(), observation_rows.end(),
                                       [word](const ObservationRow& one) { return one.word == word; });
  in.expect(row != observation_rows.end(), "tick, or an observation");
  if (row == observation_rows.end()) return RecordNothing{};
  return Observation{.at = at, .what = row->parse(in)};
}

RecordLine parse_sent(In& in) {
  const Port port = in.port_of_bus();
  return RecordSent{.sent = {.port = port, .frame = in.frame()}};
}

RecordLine parse_outputs(In& in) {
  RecordOutputs what;
  while (!in.is_at_end() && !in.damage()) {
    in.expect(in.flag(in.word(), what.outputs, output_flags), "driven outputs");
  }
  return what;
}

/// The text after "# ".
RecordLine parse_comment(In& in, const RecordClock& clock) {
  const std::string_view word = in.word();
  if (word == ">") return parse_sent(in);
  if (word == "=") return parse_outputs(in);
  if (word == "!") return RecordEvent{.text = in.rest()};
  if (!word.starts_with('(')) return RecordNote{.word = word, .rest = in.rest()};
  const RecordLine line = parse_timed(in, word, clock);
  in.end();
  return line;
}

Result<RecordLine, RecordDamage> parse_frame(std::string_view line, const RecordClock& clock,
                                             const RecordBuses& buses) {
  const auto parsed = parse_log_line(line);
  if (!parsed) return failure(RecordDamage{std::string(to_text(parsed.error().wanted)), parsed.error().column});
  if (parsed->kind != LogLineKind::frame) return RecordNothing{};
  const auto column = static_cast<std::size_t>(parsed->bus.data() - line.data());
  const std::optional<Port> found = buses.port_of(parsed->bus);
  if (!found) return failure(RecordDamage{wanted_bus, column});
  const Port port = *found;
  const TimePoint at = clock.to_core(parsed->time_us);
  const CanFrame& frame = parsed->frame;
  if (frame.is_error) {
    return Observation{at, BusErrorSeen{.port = port, .classes = frame.id, .controller = frame.data[1]}};
  }
  if (parsed->direction == Direction::sent) return Observation{at, FrameEchoed{.port = port, .frame = frame}};
  return Observation{at, FrameReceived{.port = port, .frame = frame}};
}

}  // namespace

std::uint64_t fingerprint_of(const Decisions& decisions) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  const auto put = [&hash](auto number) {
    for (const std::uint8_t byte : image::to_bytes(number)) hash = (hash ^ byte) * 0x100000001b3ULL;
  };
  image::each_number(decisions, put);
  return hash;
}

const std::string& RecordBuses::name(Port port) const {
  switch (port) {
    case Port::internal: return internal;
    case Port::vehicle: return vehicle;
    case Port::charger: return charger;
    case Port::second_pack: return second_pack;
    case Port::inverter: break;
  }
  return inverter;
}

void RecordBuses::set_name(Port port, std::string_view name) {
  switch (port) {
    case Port::internal: internal = name; return;
    case Port::vehicle: vehicle = name; return;
    case Port::charger: charger = name; return;
    case Port::second_pack: second_pack = name; return;
    case Port::inverter: inverter = name; return;
  }
}

std::optional<Port> RecordBuses::port_of(std::string_view wanted) const {
  const auto* const found =
      std::find_if(all_ports.begin(), all_ports.end(), [&](Port port) { return name(port) == wanted; });
  return wanted.empty() || found == all_ports.end() ? std::nullopt : std::optional(*found);
}

std::size_t print_observation(const Observation& observation, const RecordClock& clock, const RecordBuses& buses,
                              std::span<char, record_line_max> out) {
  Out line(out);
  std::visit(Printer{line, clock.to_log_us(observation.at), buses}, observation.what);
  return line.end_line();
}

void append_decisions(std::string& to, TimePoint at, const Decisions& decisions, const ContactorOutputs& outputs_before,
                      std::uint32_t lines_sum, const RecordClock& clock, const RecordBuses& buses) {
  std::array<char, record_line_max> room{};
  const auto append = [&](auto&& print) {
    Out line(room);
    print(line);
    to.append(room.data(), line.end_line());
  };
  append([&](Out& line) {
    line.text("# ").time(clock.to_log_us(at)).text(" tick ").hex(fingerprint_of(decisions), 16);
    line.text(" ").hex(lines_sum, 8);
  });
  for (const OutgoingFrame& sent : decisions.frames) {
    append([&](Out& line) { line.text("# > ").frame(buses.name(sent.port), sent.frame); });
  }
  if (decisions.outputs != outputs_before) {
    append([&](Out& line) { line.text("# =").flags(decisions.outputs, output_flags); });
  }
  for (const Event& event : decisions.events) {
    append([&](Out& line) { line.text("# ! ").text(to_text(event).substr(0, record_line_max - 5)); });
  }
}

Result<RecordLine, RecordDamage> parse_record_line(std::string_view line, const RecordClock& clock,
                                                   const RecordBuses& buses) {
  // Logs that went through other systems have a CR here; in a line of a quoted file it belongs to the file.
  const bool is_quoted = line.starts_with("# pack ") || line.starts_with("# cell ");
  if (line.ends_with('\r') && !is_quoted) line.remove_suffix(1);
  if (line.empty()) return RecordNothing{};
  if (line.front() == '(') return parse_frame(line, clock, buses);
  if (!line.starts_with("# ")) return failure(RecordDamage{"a frame, or a comment of a recording", 0});
  In in(line.substr(2), buses);
  RecordLine parsed = parse_comment(in, clock);
  if (!in.damage()) return parsed;
  return failure(RecordDamage{in.damage()->wanted, in.damage()->column + 2});
}

}  // namespace bmu
