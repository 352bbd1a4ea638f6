// One module management unit: up to 12 series cells, their temperatures, their balancing switches, and the conversation
// with the master. It is the other side of the bus protocol, written from it alone, and small enough for a
// microcontroller: no I/O, clock, heap, thread or exception (about 1.5 kB of state).
//
//   observe(frame, now)          at once, for every frame on the bus. Asleep, any frame wakes; it then says who it is,
//                                listens, and sleeps again when the bus has been silent for 1 s, unless a valid POLL
//                                or COMMAND shows that a master is there.
//   wants(now)                   what the next tick reads from the front end; most ticks nothing
//   tick(now, transfer)          every 1 ms or so. A second holds 100 transfers of the cells and supplies, 10 checks of
//                                limits and imbalance, 2 samples of temperatures, 1 balancing setting. Returns what is
//                                to be sent now, in order. `transfer` is looked at only when it is wanted.
//
// An answer starts with the first tick after its POLL and goes on at one frame per `frame_spacing`; the voltages in it
// are one snapshot taken when the POLL arrived, the age in STATUS is that at transmission, of the oldest of them. The
// next POLL for this module cancels what has not been sent, even if it wants nothing.
//
// Front-end data comes with a checksum for each group (front_end.hpp). A group that was damaged is dropped, STATUS says
// so, and what it would have renewed ages: voltages for as long as their age can be told, thermistors, which are read
// again with the next transfer, for three of their periods. Then they are unknown, and a sensor that cannot be read is
// told as open. Diagnosis and supplies, the stack's voltage among them, age like voltages: the stack's is then sent as
// unknown, a front end that is not heard has failed its self-test, and an external supply that is not seen is low.
//
// What the front end reports of itself, undervoltage of its supply and thermal shutdown, is kept until COMMAND clear
// faults, so that neither is missed between two POLLs; MODULE carries it, beside whether the front end reports such
// faults at all. The alarm output (alarm.hpp) is no frame: is_alarm_given().
//
// Supplies, modes, protection, imbalance and balancing have a header each; here is what joins them. Only what is
// measured is bled: a cell without a voltage (an open wire, data that does not come) is switched off, all are when the
// self-test fails, and minutes for such a cell are answered with "hardware fault". Balancing pauses while a board
// sensor is above its limit (from there to 5 K below it), and also while any fitted one is open, shorted or unknown:
// nobody would see its resistors burn; then new minutes are a hardware fault, too. A board that was hot stays so until
// its sensors are seen. On its own a unit waits at most 10 minutes for a hot board to cool, and gives up on a cell that
// bleeding does not bring down (bleeding_progress.hpp). A cell that has failed is not balanced, above its limit
// neither: its measurement may be what failed, and what is too full is the master's to end. With an undervoltage cell
// in it, a module is not balanced on the unit's own account at all: it would be emptied to that cell.
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
  std::uint8_t board_sensor_count = 4;  // none: its resistors cannot overheat, by their design
  ThermistorCurve thermistor_curve = ThermistorCurve::table;
  std::uint32_t serial_number = 0;
  std::int32_t alarm_temperature_dC = 800;  // of a cell sensor, from which on the alarm output opens
  Duration frame_spacing = 250us;           // one frame of 8 bytes at 500 kbit/s
};

/// Room for everything one tick can send: an answer of nine frames, one IDENT, the queued responses.
using MmuFrames = FixedVector<CanFrame, 16>;

struct MmuCounts {
  std::uint64_t polls_answered = 0;
  std::uint64_t answers_cut_short = 0;  // by a new POLL
  std::uint64_t commands_done = 0;
  std::uint64_t commands_refused = 0;  // with a RESPONSE, or silently when they were for all
  std::uint64_t commands_lost = 0;     // no room for a RESPONSE: not looked at, as if the bus had lost them
  std::uint64_t damaged_groups = 0;    // of the front end
};

class Mmu {
 public:
  /// Switched on at `powered_at`.
  Mmu(const MmuConfig& config, TimePoint powered_at);

  void observe(const CanFrame& frame, TimePoint now);
  [[nodiscard]] TransferWanted wants(TimePoint now) const;
  [[nodiscard]] MmuFrames tick(TimePoint now, const FrontEndTransfer& transfer);

  /// Power lost and back: everything forgotten except what a module keeps for good (node and serial number).
  void restart(TimePoint now);

  /// The thermistors this unit takes its own for, from the next sample on: another firmware.
  void set_thermistor_curve(ThermistorCurve curve) { config_.thermistor_curve = curve; }

  /// It has been asked, and has not yet sent all of its answer.
  [[nodiscard]] bool is_answering() const { return answer_.left != 0 || !responses_.empty(); }
  [[nodiscard]] bool is_asleep() const { return mode_ == UnitMode::asleep; }
  /// Frames of any sender matter to it: they wake it, or keep it awake. Otherwise only those of a master do.
  [[nodiscard]] bool hears_traffic() const { return is_asleep() || is_listening_; }
  [[nodiscard]] UnitMode mode() const { return mode_; }
  [[nodiscard]] SupplyInUse supply() const { return supply_.in_use(); }
  [[nodiscard]] std::uint8_t node() const { return config_.node; }
  /// Switches that are on now: what the cells really feel.
  [[nodiscard]] CellMask balancing_cells() const { return balancing_.switches(); }
  /// The contact of the alarm output is open (alarm.hpp).
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

  struct Sensors {
    std::array<SignalValue, 4> temperature_dC{};
    TimePoint taken_at{};
    bool is_missing = false;  // was wanted and came damaged: wanted again
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
  bool is_listening_ = false;  // woken by traffic, no master heard yet
  bool is_sleep_ordered_ = false;
  TimePoint listens_until_{};
  bool autonomous_balancing_allowed_ = false;
  TimePoint answers_from_;  // after waking, POLLs are answered from here on
  TimePoint sleeps_at_{};   // while going to sleep
  TimePoint polled_at_;     // the latest valid POLL, to whomever: the master lives

  Periodic sampling_;
  Periodic temperatures_;
  CellSampler sampler_;
  CellProtection protection_;
  CellHeatWatch heat_;
  SupplyMonitor supply_;
  ImbalanceWatch imbalance_;
  BleedingProgress progress_;  // while on its own
  Balancing balancing_;
  RoundBound round_bound_;  // of a round on its own account
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
