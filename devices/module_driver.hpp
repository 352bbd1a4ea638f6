// Questions to third-party modules and their answers, independent of their protocol, and the driver that a device has
// for its protocol.
//
//   const ModuleDriver& driver = *find_device("i3_csc")->modules;
//   send(driver.ask({.node = 3, .bleed_above_uV = 4'034'000}, round, options));   // each module, or all, once a round
//   const ModuleReport report = driver.take(frame, options);                      // each frame that passed its checks
//
// Nodes count from 1 here, like those of MMUs; a driver converts to the numbers of its manufacturer. Rounds count from
// 0 after a start: the first ones may need other contents (`start_rounds`), which modules do not answer in full.
//
// Such a module selects the cells to bleed by itself: those above a voltage that it is sent. Every question has this
// voltage, or none; there is no other command for it.
//
// The two inverse functions, `question_of` and `answers`, are for the output gate and for emulated modules; a test
// checks each pair against each other. Checksums, counters and lengths are checked by the rows
// (protocol/receive_check.hpp), not by `take`.
//
// Pure; about 100 ns per frame.
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

/// Settings on which sources disagree: the pack file gives those of its modules, otherwise the defaults apply.
struct ModuleOptions {
  std::int32_t temperature_offset_dC = -500;  // of raw 0 (Outlander)
  bool swaps_cell_frames = false;             // cells 5 to 8 come first (Outlander)
  /// Idle commands as from other masters (b4 = 00h, target 4.2 V), not as from the car (20h, 4.295 V) (i3).
  bool idle_as_others = false;
};

struct ModuleQuestion {
  std::uint8_t node = 0;  // 0: all
  bool wants_voltages = true;
  bool wants_temperatures = true;
  bool is_start = false;                         // a question of a start round, which no module answers in full
  std::optional<std::int32_t> bleed_above_uV{};  // none: no cell is bled
  std::optional<std::int32_t> idle_target_uV{};  // the lowest cell, sent with balancing off in protocols that do so

  friend constexpr bool operator==(const ModuleQuestion&, const ModuleQuestion&) = default;
};

/// Frames of an answer, by content. The number is the bit in a set of them.
enum class ModulePart : std::uint8_t { status, cells_1, cells_2, cells_3, cells_4, temperatures, voltage };

using ModuleParts = std::uint8_t;
[[nodiscard]] constexpr ModuleParts bit_of(ModulePart part) {
  return static_cast<ModuleParts>(1U << static_cast<unsigned>(part));
}

/// Content of one frame. A frame may have several parts in one.
struct ModuleReport {
  std::uint8_t node = 0;  // 0: not from a module
  ModuleParts parts = 0;
  std::uint16_t bleeding_cells = 0;  // with `status`; cell 1 lowest
  std::uint32_t errors = 0;          // with `status`: the module's own error bits; 0: no error
  std::uint8_t first_cell = 0;       // of the voltages, from 0
  FixedVector<SignalValue, foreign_cells_per_frame_max> cell_voltage_uV;
  FixedVector<SignalValue, foreign_temperatures_max> cell_temperature_dC;  // with `temperatures`
  std::optional<SignalValue> board_temperature_dC;                         // likewise
  SignalValue stack_voltage_mV;                                            // with `voltage`
};

/// Number of values out of range, in a module with this number of cells and cell sensors: values of further ones are
/// not counted.
[[nodiscard]] std::size_t values_out_of_range(const ModuleReport& report, std::size_t cell_count,
                                              std::size_t temperature_count);

/// Measurements of an emulated module.
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
  std::uint8_t node_max = 0;    // nodes are 1 to this
  std::uint8_t maker_less = 0;  // subtracted from a node to get the manufacturer's number
  std::uint8_t cell_count_max = 0;
  std::uint8_t temperature_count_max = 0;
  bool has_board_temperature = false;
  bool asks_each = false;  // one question for each module; otherwise one for all
  std::uint8_t start_rounds = 0;
  std::uint8_t frames_per_answer = 0;
  Duration round_min{};      // questions are never more frequent
  Duration round_max{};      // nor less frequent: the effect on the bleeding would be unknown
  Duration answer_after{};   // an answer earlier than this belongs to the previous question
  Duration answer_within{};  // an answer has started by then
  /// Maximum age of a voltage when the question is sent that it answers: the round of the car, because modules measure
  /// by themselves and do not report when.
  Duration sample_age_max{};
  bool has_checksum = false;
  bool tells_stack_voltage = false;
  bool tells_errors = false;

  /// Parts of the answer of a module with `cell_count` cells to a question for everything.
  ModuleParts (*parts_of)(std::uint8_t cell_count) = nullptr;
  CanFrame (*ask)(const ModuleQuestion& question, std::uint32_t round, const ModuleOptions& options) = nullptr;
  ModuleReport (*take)(const CanFrame& frame, const ModuleOptions& options) = nullptr;

  /// Inverse of `ask`: the content of a question, if the frame is one.
  std::optional<ModuleQuestion> (*question_of)(const CanFrame& frame) = nullptr;
  /// Inverse of `take`: the answer of a module to a question; `counter` if the protocol has one.
  ModuleFrames (*answers)(std::uint8_t node, const ModuleQuestion& question, const ModuleMeasurements& measured,
                          std::uint8_t counter, const ModuleOptions& options) = nullptr;
};

}  // namespace bmu
