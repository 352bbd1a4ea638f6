// One module management unit (MMU): up to 12 series cells, their temperatures, their balancing switches, and the
// communication with the master. It implements the module's side of the bus protocol, from the protocol alone, and is
// small enough for a microcontroller: no I/O, clock, heap, thread or exception (about 1.5 kB of state).
//
//   observe(frame, now)          at once, for every frame on the bus. Asleep, any frame wakes it; it then sends IDENT,
//                                stays awake, and sleeps again when the bus has been silent for 1 s, unless a valid
//                                POLL or COMMAND shows that a master is present.
//   wants(now)                   scope of the next tick's transfer from the front end; nothing in most ticks
//   tick(now, transfer)          every 1 ms or so. A second holds 100 transfers of the cells and supplies, 10 checks of
//                                limits and imbalance, 2 samples of temperatures, 1 balancing setting. Returns the
//                                frames to be sent now, in order. `transfer` is read only if wants() requested it.
//
// An answer starts with the first tick after its POLL and continues at one frame per `frame_spacing`; the voltages in
// it are one snapshot taken when the POLL arrived, the age in STATUS is that at transmission, of the oldest of them.
// The next POLL for this module cancels the frames that have not been sent, even if it requests nothing.
//
// Front-end data has a checksum for each group (front_end.hpp). A damaged group is dropped and indicated in STATUS, and
// the values that it would have renewed age: voltages up to the largest age that STATUS can carry, thermistors, which
// are read again with the next transfer, up to three of their periods. Then they are unknown, and a sensor that cannot
// be read is sent as open. Diagnosis and supplies, including the stack's voltage, age like voltages: the stack's is
// then sent as unknown, a front end without data has failed its self-test, and an external supply without data is low.
//
// Faults that the front end reports of itself, undervoltage of its supply and thermal shutdown, are latched until
// COMMAND clear faults, so that neither is missed between two POLLs; MODULE carries them, and whether the front end
// reports such faults at all. The alarm output (alarm.hpp) is no frame: is_alarm_given().
//
// Supplies, modes, protection, imbalance and balancing have a header each; this class combines them. Only measured
// cells are bled: a cell without a voltage (an open wire, missing data) is switched off, all are when the self-test
// fails, and minutes for such a cell are answered with "hardware fault". Balancing pauses while a board sensor is above
// its limit (from there to 5 K below it), and also while any fitted one is open, shorted or unknown, because burning
// resistors would not be detected; then new minutes are a hardware fault, too. A board that was hot remains so until
// its sensors are measured. An autonomous module waits at most 10 minutes for a hot board to cool, and stops bleeding a
// cell that bleeding does not bring down (bleeding_progress.hpp). A cell that has failed is not balanced, not even
// above its limit: its measurement may be the failure, and only the master ends an overcharge. A module with an
// undervoltage cell is not balanced autonomously at all: it would be discharged to that cell.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "mmu/devices/alarm.hpp"
#include "mmu/devices/balancing.hpp"
#include "mmu/devices/bleeding_progress.hpp"
#include "mmu/devices/front_end.hpp"
#include "mmu/devices/imbalance.hpp"
#include "mmu/devices/mode.hpp"
#include "mmu/devices/periodic.hpp"
#include "mmu/devices/protection.hpp"
#include "mmu/devices/round_bound.hpp"
#include "mmu/devices/sampling.hpp"
#include "mmu/devices/supply.hpp"
#include "mmu/devices/thermistor.hpp"
#include "protocol/fixed_vector.hpp"
#include "protocol/request_check.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu {

struct MmuConfig {
  std::uint8_t node = 1;  // 1 to 63; the master can change it (set node number), then it stays changed
  std::uint8_t cell_count = 12;
  std::uint8_t temperature_sensor_count = 4;
  std::uint8_t board_sensor_count = 4;  // 0: its resistors cannot overheat, by their design
  ThermistorCurve thermistor_curve = ThermistorCurve::table;
  std::uint32_t serial_number = 0;
  std::int32_t alarm_temperature_dC = 800;  // of a cell sensor at which the alarm output opens
  Duration frame_spacing = 250us;           // one frame of 8 bytes at 500 kbit/s
};

/// Capacity for everything one tick can send: an answer of nine frames, one IDENT, the queued responses.
using MmuFrames = FixedVector<CanFrame, 16>;

struct MmuCounts {
  std::uint64_t polls_answered = 0;
  std::uint64_t answers_cut_short = 0;  // by a new POLL
  std::uint64_t commands_done = 0;
  std::uint64_t commands_refused = 0;  // with a RESPONSE, or silently when they were for all
  std::uint64_t commands_lost = 0;     // no room for a RESPONSE: ignored, as if the bus had lost them
  std::uint64_t damaged_groups = 0;    // of the front end
};

class Mmu {
 public:
  /// Switched on at `powered_at`.
  Mmu(const MmuConfig& config, TimePoint powered_at);

  void observe(const CanFrame& frame, TimePoint now);
  [[nodiscard]] TransferWanted wants(TimePoint now) const;
  [[nodiscard]] MmuFrames tick(TimePoint now, const FrontEndTransfer& transfer);

  /// Restart after a loss of power: keeps only counts and permanent data (node and serial number).
  void restart(TimePoint now);

  /// Sets the thermistor curve that the module assumes from the next sample on, as another firmware would.
  void set_thermistor_curve(ThermistorCurve curve) { config_.thermistor_curve = curve; }

  /// Whether it was polled or commanded and has not sent all of its answer yet.
  [[nodiscard]] bool is_answering() const { return answer_.left != 0 || !responses_.empty(); }
  [[nodiscard]] bool is_asleep() const { return mode_ == UnitMode::asleep; }
  /// Whether frames of any sender affect it: they wake it, or keep it awake. Otherwise only those of a master do.
  [[nodiscard]] bool hears_traffic() const { return is_asleep() || is_listening_; }
  [[nodiscard]] UnitMode mode() const { return mode_; }
  [[nodiscard]] SupplyInUse supply() const { return supply_.in_use(); }
  [[nodiscard]] std::uint8_t node() const { return config_.node; }
  /// Switches that are on now: the actual load of the cells.
  [[nodiscard]] CellMask balancing_cells() const { return balancing_.switches(); }
  /// Whether the contact of the alarm output is open (alarm.hpp).
  [[nodiscard]] bool is_alarm_given(TimePoint now) const;
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
  static constexpr std::size_t responses_max = 4;  // in one tick; a bus of 500 kbit/s brings as many COMMANDs in 1 ms
  static_assert(parts_max + 1 + responses_max <= MmuFrames::capacity());

  void wake(TimePoint now);
  void observe_poll(const CanFrame& frame, TimePoint now);
  void observe_command(const CanFrame& frame, std::uint8_t node, TimePoint now);
  [[nodiscard]] std::uint16_t parts_wanted(const CanFrame& poll) const;
  [[nodiscard]] CellReading snapshot(bool is_sync, TimePoint now) const;

  // The operations of COMMAND, by their code. Each is executed completely or not at all.
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

  struct Sensors {
    std::array<SignalValue, 4> temperature_dC{};
    TimePoint taken_at{};
    bool is_missing = false;  // was requested and arrived damaged: requested again
  };

  void measure(TimePoint now, const FrontEndTransfer& transfer);
  void note_diagnosis(TimePoint now, const DiagnosisReading& diagnosis);
  void note_cells(TimePoint now, const FrontEndReading& reading);
  void note_sensors(TimePoint now, const std::optional<ThermistorReadings>& readings, std::size_t fitted,
                    Sensors& sensors) const;
  void judge_board(TimePoint now);
  void wait_for_power(TimePoint now, const FrontEndTransfer& transfer);
  [[nodiscard]] bool is_master_alive(TimePoint now) const;
  [[nodiscard]] bool is_supply_known(TimePoint now) const;
  [[nodiscard]] bool is_diagnosis_known(TimePoint now) const;
  [[nodiscard]] bool is_self_test_passed(TimePoint now) const;
  [[nodiscard]] CellMask measured_cells(TimePoint now) const;
  [[nodiscard]] CellMask bleedable_cells(TimePoint now) const;
  [[nodiscard]] bool may_balance_alone(TimePoint now) const;
  [[nodiscard]] CellMask worth_a_round(TimePoint now) const;
  [[nodiscard]] bool has_balancing_to_do(TimePoint now) const;
  void balance_alone(TimePoint now);
  void update_balancing(TimePoint now);
  void update_mode(TimePoint now);
  void enter(UnitMode mode, TimePoint now);

  void send_responses(MmuFrames& out);
  void send_announcement(TimePoint now, MmuFrames& out);
  void send_answer(TimePoint now, MmuFrames& out);
  [[nodiscard]] CanFrame make_part(std::uint8_t part, TimePoint now);
  [[nodiscard]] CanFrame make_status(TimePoint now);
  [[nodiscard]] CanFrame make_cells(std::size_t frame_index) const;
  [[nodiscard]] CanFrame make_temp_1() const;
  [[nodiscard]] CanFrame make_temp_2() const;
  [[nodiscard]] CanFrame make_module(TimePoint now) const;
  [[nodiscard]] CanFrame make_ident() const;

  MmuConfig config_;
  RequestCheck check_;
  MmuCounts counts_;

  UnitMode mode_ = UnitMode::starting;
  bool has_voltages_ = false;  // since it started or woke
  bool is_listening_ = false;  // woken by traffic, no master received yet
  bool is_sleep_ordered_ = false;
  TimePoint listens_until_{};
  bool autonomous_balancing_allowed_ = false;
  TimePoint answers_from_;  // after waking, POLLs are answered from here on
  TimePoint sleeps_at_{};   // while going to sleep
  TimePoint polled_at_;     // the latest valid POLL, to any module: a master is present

  Periodic sampling_;
  Periodic temperatures_;
  CellSampler sampler_;
  CellProtection protection_;
  CellHeatWatch heat_;
  SupplyMonitor supply_;
  ImbalanceWatch imbalance_;
  BleedingProgress progress_;  // while autonomous
  Balancing balancing_;
  RoundBound round_bound_;  // of an autonomous round
  Sensors cell_sensors_;
  Sensors board_sensors_;
  std::int32_t board_temperature_limit_dC_ = 850;
  std::int32_t module_mV_ = 0;
  std::optional<TimePoint> module_taken_at_{};  // and the supplies; none: not measured since it started or woke
  CellMask open_wires_ = 0;
  std::optional<TimePoint> diagnosis_read_at_{};
  bool reports_front_end_faults_ = false;
  ChipFaults front_end_faults_;  // since the last clear faults

  bool is_board_too_hot_ = false;
  bool is_board_known_ = false;
  TimePoint board_hot_since_{};
  bool is_self_test_ok_ = false;
  bool has_crc_errors_ = false;  // since the last STATUS
  bool is_restarted_ = true;     // since the last STATUS
  bool are_limits_set_ = false;

  Answer answer_;
  FixedVector<Response, responses_max> responses_;
  bool is_announcement_due_ = true;
  TimePoint announces_at_;
};

}  // namespace bmu
