// One module management unit: up to 12 series cells, their temperatures, their balancing switches, and the conversation
// with the master. It is the other side of the bus protocol, written from it alone, and small enough for a
// microcontroller: no I/O, clock, heap, thread or exception (about 13 kB of state, nearly all of it the receive check).
//
//   observe(frame, now)          at once, for every frame on the bus. Asleep, any frame wakes; it then listens for 1 s,
//                                silently, and sleeps again unless a valid POLL or COMMAND shows that a master is
//                                there.
//   tick(now, measurements)      every 1 ms or so. A second holds 100 samples of the cells, 10 protection checks,
//                                2 samples of temperatures, 1 balancing setting. Returns what is to be sent now, in
//                                order. Measurements are looked at only when `is_sample_due(now)`.
//
// An answer starts with the first tick after its POLL and goes on at one frame per `frame_spacing`; the voltages in it
// are one snapshot taken when the POLL arrived, the age in STATUS is that at transmission. The next POLL for this
// module cancels what has not been sent, even if it wants nothing.
//
// Here now: answering, commands, limits, commanded balancing, normal and sleep mode on external supply.
// Not here yet: the change to module supply, autonomous mode, counting imbalance (each has its place: STATUS says
// `supply` external and the mode never becomes autonomous).
#pragma once

#include <array>
#include <cstdint>

#include "mmu/balancing.hpp"
#include "mmu/periodic.hpp"
#include "mmu/protection.hpp"
#include "mmu/sampling.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/receive_check.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

struct MmuConfig {
  std::uint8_t node = 1;  // 1 to 63; the master can change it (set node number), then it stays changed
  std::uint8_t cell_count = 12;
  std::uint8_t temperature_sensor_count = 4;
  std::uint32_t serial_number = 0;
  Duration frame_spacing = 250us;  // one frame of 8 bytes at 500 kbit/s
};

inline constexpr std::size_t mmu_cell_temperatures = internal_bus::cell_temperatures_per_module_max;
inline constexpr std::size_t mmu_board_temperatures = internal_bus::board_temperatures_per_module;

/// What the front end and the thermistors say at this moment.
struct MmuMeasurements {
  CellVoltages cell_voltage_uV{};
  CellMask measured_cells = 0;
  CellMask open_wires = 0;
  std::int32_t module_mV = 0;  // over the whole stack, measured on its own
  std::array<SignalValue, mmu_cell_temperatures> cell_temperature_dC{};
  std::array<SignalValue, mmu_board_temperatures> board_temperature_dC{};
  bool front_end_crc_ok = true;  // false: this transfer was damaged, the voltages above are not looked at
  bool self_test_ok = true;
};

/// Room for everything one tick can send: an answer of nine frames, one IDENT, the queued responses.
using MmuFrames = FixedVector<CanFrame, 16>;

struct MmuCounts {
  std::uint64_t polls_answered = 0;
  std::uint64_t answers_cut_short = 0;  // by a new POLL
  std::uint64_t commands_done = 0;
  std::uint64_t commands_refused = 0;  // with a RESPONSE, or silently when they were for all
};

class Mmu {
 public:
  /// Switched on at `powered_at`.
  Mmu(const MmuConfig& config, TimePoint powered_at);

  void observe(const CanFrame& frame, TimePoint now);
  [[nodiscard]] MmuFrames tick(TimePoint now, const MmuMeasurements& measured);

  /// Power lost and back: everything forgotten except what a module keeps for good (node and serial number).
  void restart(TimePoint now);

  [[nodiscard]] bool is_sample_due(TimePoint now) const { return !is_asleep_ && sampling_.is_due(now); }
  [[nodiscard]] bool is_asleep() const { return is_asleep_; }
  [[nodiscard]] internal_bus::Mode mode() const { return mode_; }
  [[nodiscard]] std::uint8_t node() const { return config_.node; }
  /// Switches that are on now: what the cells really feel.
  [[nodiscard]] CellMask balancing_cells() const { return balancing_.switches(); }
  [[nodiscard]] const CellLimits& limits() const { return protection_.limits(); }
  [[nodiscard]] bool is_autonomous_balancing_allowed() const { return autonomous_balancing_allowed_; }
  [[nodiscard]] const MmuCounts& counts() const { return counts_; }
  [[nodiscard]] const ReceiveCounts& receive_counts() const { return check_.counts(); }

 private:
  // The parts of an answer, in the order they are sent; one bit each in Answer::left.
  enum Part : std::uint8_t { status, cells_1, cells_2, cells_3, cells_4, temp_1, temp_2, module, ident };
  static constexpr std::size_t parts_max = 9;

  struct Answer {
    std::uint16_t left = 0;
    std::uint8_t counter = 0;
    bool is_started = false;
    TimePoint next_frame_at{};
    CellReading cells;
  };
  struct Response {
    std::uint8_t operation = 0;
    std::uint8_t counter = 0;
    internal_bus::CommandResult result = internal_bus::CommandResult::done;
  };
  static constexpr std::size_t responses_max = 4;

  void wake(TimePoint now);
  void note_master(TimePoint now);
  void observe_poll(const CanFrame& frame, TimePoint now);
  void observe_command(const CanFrame& frame, std::uint8_t node, TimePoint now);
  [[nodiscard]] std::uint16_t parts_wanted(const CanFrame& poll) const;
  [[nodiscard]] CellReading snapshot(bool is_sync, TimePoint now) const;

  // The operations of COMMAND; `row` of the table in mmu.cpp. Each does all of it or nothing.
  using Operation = internal_bus::CommandResult (Mmu::*)(const CanFrame&, TimePoint);
  static const std::array<Operation, 8> operations;
  internal_bus::CommandResult execute(const CanFrame& frame, std::uint8_t node, TimePoint now);
  internal_bus::CommandResult set_mode(const CanFrame& frame, TimePoint now);
  internal_bus::CommandResult set_limits(const CanFrame& frame, TimePoint now);
  internal_bus::CommandResult balance(const CanFrame& frame, TimePoint now);
  internal_bus::CommandResult stop_balancing(const CanFrame& frame, TimePoint now);
  internal_bus::CommandResult clear_faults(const CanFrame& frame, TimePoint now);
  internal_bus::CommandResult set_node(const CanFrame& frame, TimePoint now);
  internal_bus::CommandResult set_board_temperature_limit(const CanFrame& frame, TimePoint now);

  void measure(TimePoint now, const MmuMeasurements& measured);
  void measure_temperatures(const MmuMeasurements& measured);
  void update_balancing(TimePoint now);
  void fall_asleep_if_due(TimePoint now);

  void send_responses(MmuFrames& out);
  void send_announcement(TimePoint now, MmuFrames& out);
  void send_answer(TimePoint now, MmuFrames& out);
  [[nodiscard]] CanFrame make_part(std::uint8_t part, TimePoint now);
  [[nodiscard]] CanFrame make_status(TimePoint now);
  [[nodiscard]] CanFrame make_cells(std::size_t frame_index) const;
  [[nodiscard]] CanFrame make_temp_1() const;
  [[nodiscard]] CanFrame make_temp_2() const;
  [[nodiscard]] CanFrame make_module() const;
  [[nodiscard]] CanFrame make_ident() const;

  MmuConfig config_;
  ReceiveCheck check_{internal_bus::catalogue, ReceiveCheck::Role::listener};
  MmuCounts counts_;

  internal_bus::Mode mode_ = internal_bus::Mode::starting;
  bool is_asleep_ = false;
  bool is_listening_ = false;  // woken by traffic, no master heard yet
  TimePoint listens_until_{};
  bool autonomous_balancing_allowed_ = false;  // kept for the autonomous mode
  TimePoint answers_from_;                     // after waking, POLLs are answered from here on
  TimePoint sleeps_at_{};                      // while going to sleep
  TimePoint polled_at_;                        // the latest valid POLL, to whomever: the master lives

  Periodic sampling_;
  Periodic temperatures_;
  CellSampler sampler_;
  CellProtection protection_;
  CommandedBalancing balancing_;
  std::array<SignalValue, mmu_cell_temperatures> cell_temperature_dC_{};
  std::array<SignalValue, mmu_board_temperatures> board_temperature_dC_{};
  std::int32_t board_temperature_limit_dC_ = 850;
  std::int32_t module_mV_ = 0;
  CellMask open_wires_ = 0;

  bool is_board_too_hot_ = false;
  bool is_self_test_ok_ = true;
  bool has_crc_errors_ = false;  // since the last STATUS
  bool is_restarted_ = true;     // since the last STATUS
  bool are_limits_set_ = false;

  Answer answer_;
  FixedVector<Response, responses_max> responses_;
  bool is_announcement_due_ = true;
  TimePoint announces_at_;
};

}  // namespace bmu
