// What the modules of another maker are asked and say, whatever language they speak, and what a device says of that
// language.
//
//   const ModuleDriver& driver = *find_device("i3_csc")->modules;
//   send(driver.ask({.node = 3, .bleed_above_uV = 4'034'000}, round, options));   // each module, or all, once a round
//   const ModuleReport report = driver.take(frame, options);                      // each frame that passed its checks
//
// Nodes count from 1 here, as our own modules do; a driver knows how its maker counts. Rounds count from 0 after a
// start: the first few may have to say something else (`start_rounds`), and modules answer nothing then.
//
// Whose cells are bled such a module decides by itself: those above a voltage it is told. It is told so with every
// question, or not; there is no other word for it.
//
// The two functions that look from the other side, `question_of` and `answers`, are for what is sent through a gate and
// for emulated modules; a test holds each pair against each other. Checksums, counters and lengths are the business of
// the rows (protocol/receive_check.hpp), not of `take`.
//
// Pure; some 100 ns a frame.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/fixed_vector.hpp"
#include "protocol/frame.hpp"
#include "protocol/message.hpp"
#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu {

inline constexpr std::size_t foreign_cells_max = 12;
inline constexpr std::size_t foreign_cells_per_frame_max = 4;
inline constexpr std::size_t foreign_temperatures_max = 5;

/// What sources do not agree on: a pack file says how it is of its modules, else the default holds.
struct ModuleOptions {
  std::int32_t temperature_offset_dC = -500;  // of raw 0 (Outlander)
  bool swaps_cell_frames = false;             // cells 5 to 8 come first (Outlander)
  bool idle_as_others = false;                // an idle command says 0 and not what the car says (i3)
};

struct ModuleQuestion {
  std::uint8_t node = 0;  // 0: all
  bool wants_voltages = true;
  bool wants_temperatures = true;
  bool is_start = false;                         // one of those a start begins with, which nobody answers in full
  std::optional<std::int32_t> bleed_above_uV{};  // nothing: no cell is to be bled
  std::optional<std::int32_t> idle_target_uV{};  // the lowest cell, sent with balancing off by a maker that does so

  friend constexpr bool operator==(const ModuleQuestion&, const ModuleQuestion&) = default;
};

/// The frames of an answer, by what they say. The number is the bit in a set of them.
enum class ModulePart : std::uint8_t { status, cells_1, cells_2, cells_3, cells_4, temperatures, voltage };

using ModuleParts = std::uint8_t;
[[nodiscard]] constexpr ModuleParts bit_of(ModulePart part) {
  return static_cast<ModuleParts>(1U << static_cast<unsigned>(part));
}

/// What one frame says. A frame may have several parts in one.
struct ModuleReport {
  std::uint8_t node = 0;  // 0: not a word of a module
  ModuleParts parts = 0;
  std::uint16_t bleeding_cells = 0;  // with `status`; cell 1 lowest
  std::uint32_t errors = 0;          // with `status`: the module's own word for what is wrong; 0: nothing
  std::uint8_t first_cell = 0;       // of the voltages, from 0
  FixedVector<SignalValue, foreign_cells_per_frame_max> cell_voltage_uV;
  FixedVector<SignalValue, foreign_temperatures_max> cell_temperature_dC;  // with `temperatures`
  std::optional<SignalValue> board_temperature_dC;                         // likewise
  SignalValue stack_voltage_mV;                                            // with `voltage`
};

/// Numbers that the field must not hold, of a module with so many cells and sensors at them: what it says of others is
/// nobody's.
[[nodiscard]] std::size_t values_out_of_range(const ModuleReport& report, std::size_t cell_count,
                                              std::size_t temperature_count);

/// What an emulated module has measured.
struct ModuleMeasurements {
  std::array<SignalValue, foreign_cells_max> cell_voltage_uV{};
  std::array<SignalValue, foreign_temperatures_max> cell_temperature_dC{};
  SignalValue board_temperature_dC;
  std::int32_t stack_voltage_mV = 0;
  std::uint16_t bleeding_cells = 0;
  std::uint32_t errors = 0;
};

using ModuleFrames = FixedVector<CanFrame, 12>;

struct ModuleDriver {
  std::string_view name;  // of the device
  const Catalogue* catalogue = nullptr;
  std::uint8_t node_max = 0;    // 1 to this
  std::uint8_t maker_less = 0;  // the maker's number of a node is this much lower
  std::uint8_t cell_count_max = 0;
  std::uint8_t temperature_count_max = 0;
  bool has_board_temperature = false;
  bool asks_each = false;  // a question for each module; else one for all
  std::uint8_t start_rounds = 0;
  std::uint8_t frames_per_answer = 0;
  Duration round_min{};      // never asked more often
  Duration round_max{};      // nor more seldom: nobody knows what it does with the bleeding then
  Duration answer_after{};   // an answer sooner than this is one to the question before
  Duration answer_within{};  // it has begun by then
  /// A voltage may be so much older than the question that brought it: the round of the car, as modules measure by
  /// themselves and say nothing of when.
  Duration sample_age_max{};
  bool has_checksum = false;
  bool tells_stack_voltage = false;
  bool tells_errors = false;

  /// What a module of so many cells answers to a question for everything.
  ModuleParts (*parts_of)(std::uint8_t cell_count) = nullptr;
  CanFrame (*ask)(const ModuleQuestion& question, std::uint32_t round, const ModuleOptions& options) = nullptr;
  ModuleReport (*take)(const CanFrame& frame, const ModuleOptions& options) = nullptr;

  /// The other way: what a question asks, if the frame is one.
  std::optional<ModuleQuestion> (*question_of)(const CanFrame& frame) = nullptr;
  /// And what a module answers to it; `counter` where there is one.
  ModuleFrames (*answers)(std::uint8_t node, const ModuleQuestion& question, const ModuleMeasurements& measured,
                          std::uint8_t counter, const ModuleOptions& options) = nullptr;
};

}  // namespace bmu
