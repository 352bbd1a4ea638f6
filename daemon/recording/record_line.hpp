// The lines of a recording: a log that candump's family reads, with what else a core was told, and what it decided, in
// lines that they take for comments.
//
//   (1700000000.123456) vcan0 143#8EA08E928EB22AB2 R         a frame from somebody else; T: of ours, seen back
//   (1700000000.123456) vcan0 20000004#0010000000000000      an error frame of the controller
//   # (1700000000.130000) lines contacts 3 vehicle_on supply_ok
//   # (1700000000.130000) command clear_faults service by 1000
//   # (1700000000.130000) claim 273481 us                   start of a session: length of its listening
//   # (1700000000.130000) tick 5d1f0ce2a1b39e77               a decision, and what of it is compared first
//   # > vcan0 040#0300000000000000                            what it sent ...
//   # = main_negative main_positive                           ... what it commands, where that has changed ...
//   # ! fault: a cell's voltage is too low: ...               ... and told
//
// Times are those of the wall clock, so that the log is one like others; what the core was told is a monotonic time, to
// the microsecond. They differ by RecordClock, which the recording says at its head and whenever the wall clock jumps.
// A `tick` line and the lines behind it that begin with >, = and ! belong together.
//
// No line is longer than record_line_max: can-utils' canplayer and log2asc give up on longer ones, comments included.
//
// Pure, no allocation but of EventText. What is printed parses to the same again.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "daemon/core/decisions.hpp"
#include "daemon/core/types/observation.hpp"
#include "protocol/candump.hpp"
#include "protocol/result.hpp"

namespace bmu {

inline constexpr std::size_t record_line_max = 390;
/// A core's time, and how far a clock is ahead of it: some 120 years, which in nanoseconds is still a number.
inline constexpr std::int64_t record_time_max_us = 4'000'000'000'000'000;

/// How far the log's clock is ahead of the core's.
struct RecordClock {
  std::int64_t ahead_us = 0;

  [[nodiscard]] constexpr std::int64_t to_log_us(TimePoint at) const {
    return std::chrono::floor<std::chrono::microseconds>(at.time_since_epoch()).count() + ahead_us;
  }
  /// What no core can have had (record_time_max_us) becomes the next such time: whoever reads a file asks.
  [[nodiscard]] constexpr TimePoint to_core(std::int64_t log_us) const {
    const std::int64_t core_us = std::clamp(log_us - ahead_us, -record_time_max_us - 1, record_time_max_us + 1);
    return TimePoint{std::chrono::microseconds{core_us}};
  }
};

/// The interfaces' names; one that serves several has the same.
struct RecordBuses {
  std::string internal;
  std::string vehicle;
  std::string charger;      // empty: none, as in recordings from before there was such a bus
  std::string second_pack;  // likewise
  std::string inverter;     // likewise

  [[nodiscard]] const std::string& name(Port port) const;
  void set_name(Port port, std::string_view name);
  /// The first that has this name: who tells its frames.
  [[nodiscard]] std::optional<Port> port_of(std::string_view wanted) const;
};
/// Of anything that has name(Port).
template <class Names>
[[nodiscard]] RecordBuses record_buses(const Names& names) {
  RecordBuses buses;
  for (const Port port : all_ports) buses.set_name(port, names.name(port));
  return buses;
}

struct RecordTick {
  TimePoint at;
  std::uint64_t fingerprint = 0;  // of all that was decided: fingerprint_of()
  std::uint32_t lines_sum = 0;    // of the lines from the tick before to this one (line_sum.hpp)
};
struct RecordSent {
  OutgoingFrame sent;
};
struct RecordOutputs {
  ContactorOutputs outputs;
};
struct RecordEvent {
  std::string_view text;  // points into the line
};
/// Any other comment: `word` and what follows it, of which only the reader of a whole recording knows what it means.
struct RecordNote {
  std::string_view word;
  std::string_view rest;
};
struct RecordNothing {};

using RecordLine =
    std::variant<RecordNothing, Observation, RecordTick, RecordSent, RecordOutputs, RecordEvent, RecordNote>;

struct RecordDamage {
  std::string wanted;
  std::size_t column = 0;  // from 0
};

/// FNV-1a over the image of what was decided: frames, outputs, events, when to wake, whether all is over. The same for
/// every compiler and machine.
[[nodiscard]] std::uint64_t fingerprint_of(const Decisions& decisions);

/// One line with its line feed. Returns its length.
[[nodiscard]] std::size_t print_observation(const Observation& observation, const RecordClock& clock,
                                            const RecordBuses& buses, std::span<char, record_line_max> out);
/// The tick and all lines that belong to it; `outputs_before`: of the tick before; `lines_sum`: of the lines since.
void append_decisions(std::string& to, TimePoint at, const Decisions& decisions, const ContactorOutputs& outputs_before,
                      std::uint32_t lines_sum, const RecordClock& clock, const RecordBuses& buses);

/// One line without its line feed.
[[nodiscard]] Result<RecordLine, RecordDamage> parse_record_line(std::string_view line, const RecordClock& clock,
                                                                 const RecordBuses& buses);

}  // namespace bmu
