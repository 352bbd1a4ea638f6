// Lines of a recording: a log that the tools of candump's family read, with the other observations of a core, and its
// decisions, in lines that these tools treat as comments.
//
//   (1700000000.123456) vcan0 143#8EA08E928EB22AB2 R         a frame of another node; T: of this node, echoed
//   (1700000000.123456) vcan0 20000004#0010000000000000      an error frame of the controller
//   # (1700000000.130000) lines contacts 3 vehicle_on supply_ok
//   # (1700000000.130000) command clear_faults service by 1000
//   # (1700000000.130000) claim 273481 us                   start of a session: length of its listening
//   # (1700000000.130000) tick 5d1f0ce2a1b39e77 3c90f1a2      a decision: its fingerprint, the sum of the lines before
//   # > vcan0 040#0300000000000000                            a frame that it sent ...
//   # = main_negative main_positive                           ... its outputs, if they have changed ...
//   # ! fault: a cell's voltage is too low: ...               ... and an event
//
// Times are those of the wall clock, as in other logs; the core receives monotonic times, to the microsecond. They
// differ by RecordClock, which the recording contains in its head and after each jump of the wall clock. A `tick` line
// and the lines after it that begin with >, = and ! belong together.
//
// No line is longer than record_line_max: can-utils' canplayer and log2asc fail on longer ones, comments included.
//
// Pure. Printing allocates for the text of events only, once `to` has room. A printed line parses to the same again.
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
/// Limit of a core's time, and of the offset of a clock: some 120 years, which in nanoseconds still fit in 64 bits.
inline constexpr std::int64_t record_time_max_us = 4'000'000'000'000'000;

/// Offset of the log's clock from the core's.
struct RecordClock {
  std::int64_t ahead_us = 0;

  [[nodiscard]] constexpr std::int64_t to_log_us(TimePoint at) const {
    return std::chrono::floor<std::chrono::microseconds>(at.time_since_epoch()).count() + ahead_us;
  }
  /// A time that no core can have had (record_time_max_us) becomes the next such time: the reader of a file has to
  /// check.
  [[nodiscard]] constexpr TimePoint to_core(std::int64_t log_us) const {
    const std::int64_t core_us = std::clamp(log_us - ahead_us, -record_time_max_us - 1, record_time_max_us + 1);
    return TimePoint{std::chrono::microseconds{core_us}};
  }
};

/// Names of the CAN interfaces; one that serves several ports appears for each.
struct RecordBuses {
  std::string internal;
  std::string vehicle;
  std::string charger;      // empty: none, as in recordings from before there was such a bus
  std::string second_pack;  // likewise
  std::string inverter;     // likewise

  [[nodiscard]] const std::string& name(Port port) const;
  void set_name(Port port, std::string_view name);
  /// The first port with this name, to which its frames are attributed.
  [[nodiscard]] std::optional<Port> port_of(std::string_view wanted) const;
};
/// From anything that has name(Port).
template <class Names>
[[nodiscard]] RecordBuses record_buses(const Names& names) {
  RecordBuses buses;
  for (const Port port : all_ports) buses.set_name(port, names.name(port));
  return buses;
}

struct RecordTick {
  TimePoint at;
  std::uint64_t fingerprint = 0;  // of the decisions: fingerprint_of()
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
/// Any other comment: `word` and the text after it, which only the reader of a whole recording can interpret.
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

/// FNV-1a over the serialised decisions: frames, outputs, events, wake-up time, end of the shutdown. The same for every
/// compiler and machine.
[[nodiscard]] std::uint64_t fingerprint_of(const Decisions& decisions);

/// Prints one line with its line feed. Returns its length.
[[nodiscard]] std::size_t print_observation(const Observation& observation, const RecordClock& clock,
                                            const RecordBuses& buses, std::span<char, record_line_max> out);
/// Appends the tick and all its lines; `outputs_before`: of the tick before; `lines_sum`: of the lines since.
void append_decisions(std::string& to, TimePoint at, const Decisions& decisions, const ContactorOutputs& outputs_before,
                      std::uint32_t lines_sum, const RecordClock& clock, const RecordBuses& buses);

/// Parses one line without its line feed.
[[nodiscard]] Result<RecordLine, RecordDamage> parse_record_line(std::string_view line, const RecordClock& clock,
                                                                 const RecordBuses& buses);

}  // namespace bmu
