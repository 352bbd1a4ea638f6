// The catalogue of failures as tests: the fault, the required reaction, the time allowed for it, and the time measured.
//
// A row has the catalogue's number and one or more cases. Each case is run on two packs, one small and one of 16
// modules of 12 cells, at every few milliseconds of more than a poll period, with three offsets of the devices' periods
// to those of the master; and the worst of these is its time: from the fault at the module or the input until the
// command "open" is through on a bus of 500 kbit/s. A case that opens is then followed on its way back: nothing clears
// it while its cause is present, nothing closes before it was cleared and the key turned again, and after that the pack
// closes.
//
// The results are in docs/reaction-times.md. A test fails if its lines there differ from its measurement.
// BMUD_REWRITE=1 test_catalogue "[docs]" rewrites the page.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/faults/fault_table.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu::test {

enum class Outcome : std::uint8_t {
  opens,
  stays_closed,
  never_closes,  // the fault is present from the start
};

/// End of the measured time.
enum class Until : std::uint8_t {
  command,   // CONTACTOR_COMMAND with all contactors open is through on the bus
  decision,  // of the core; for faults after which the bus carries nothing
  coils,     // the PDU has released them by itself
  charge,    // CONTACTOR_COMMAND with the charge contactor open is through on the bus
  told,      // the fault is confirmed; for packs that are open already, and faults that open nothing
};

using Act = std::function<void(WiredPack&)>;
/// Changes of the configuration of the two packs that a case needs.
using Fitting = void (*)(CoreConfig&);
/// The longest reaction that the configuration allows: time in which the fault is not visible yet, and all delays after
/// it.
using Configured = Duration (*)(const CoreConfig&, const FaultRow&);

/// Events of the script language as an act.
[[nodiscard]] Act script(std::string_view events);

struct Case {
  std::string_view what;
  Act inject;
  Act repair{};            // none: the fault ends by itself
  std::string_view fault;  // row of the fault table that must be present afterwards; empty: no opening fault may be
  std::string_view or_fault{};     // equivalent: which of the two is first depends on the time of the fault
  bool or_any_silence = false;     // equivalent: which node is lost first depends on the time of the fault
  bool is_kept_by_module = false;  // the module continues its report until it is cleared, without a latch in the core
  Configured configured = nullptr;
  Outcome outcome = Outcome::opens;
  Until until = Until::command;
  Phase in_phase = Phase::closed;  // phase of the sequence at the fault
  Act prepare{};                   // before it is switched on
  Fitting fit = nullptr;
  std::string_view switch_on = "vehicle on";  // request for a closed pack
  std::string_view switch_off = "vehicle off";
  Duration span = 150ms;  // over which the time of the fault is varied
  Duration step = 7ms;
  bool is_seen_open = true;  // an open pack still shows the cause; else it may be cleared and tried again
  bool has_way_back = true;  // tested for this case; false: another case's is the same
  std::function<bool(const WiredPack&)> holds{};  // further condition, some time after the fault
};

struct Row {
  int number = 0;
  std::string_view title;
  Duration allowed{};
  std::vector<Case> cases;
  std::string_view state{};  // empty: held; else where it is tested, as printed on the page
};

struct Pack {
  std::string_view name;
  CoreConfig config;
};

/// Tests every case of the row on every pack, and compares its lines on the page.
void check_row(const Row& row);

/// Longest reaction of a case on one pack; all of its trials must be as the case requires. None if it never opens.
[[nodiscard]] std::optional<Duration> worst_time(const Case& one, const Pack& pack);

/// Rows in the order of their numbers, those not run included.
[[nodiscard]] const std::vector<const Row*>& all_rows();
/// Lines of a row, as measured now.
[[nodiscard]] std::vector<std::string> measured_lines(const Row& row);

struct Registered {
  explicit Registered(Row wanted);
  Row row;
};

/// The small pack and the large one.
[[nodiscard]] const std::vector<Pack>& packs();
/// A pack half a second after its closing; it starts as a copy of one that is ready to close.
[[nodiscard]] WiredPack closed_pack(const Pack& pack);

/// The pack at the point at which the case injects its fault, before it; none if the pack does not reach that point.
[[nodiscard]] std::optional<WiredPack> pack_in(const Case& one, const Pack& pack);

[[nodiscard]] const FaultRow* find_fault(std::string_view name);
[[nodiscard]] bool is_present(const WiredPack& pack, std::string_view fault);
[[nodiscard]] bool is_open(const WiredPack& pack, Until until);
/// The pack's configuration with the changes of the case.
[[nodiscard]] CoreConfig config_for(const Case& one, const Pack& pack);
/// Milliseconds, rounded up.
[[nodiscard]] std::string ms_text(Duration duration);

// Longest reaction for each kind of detection: the periods on the way, the age at which a value counts as lost, its
// confirm time, a tick, and the command after a frame that has just started on the wire.
namespace seen {
Duration in_cells(const CoreConfig& config, const FaultRow& row);
Duration in_temperatures(const CoreConfig& config, const FaultRow& row);
Duration in_a_jump(const CoreConfig& config, const FaultRow& row);
Duration in_temperature_trend(const CoreConfig& config, const FaultRow& row);
Duration in_module_status(const CoreConfig& config, const FaultRow& row);
Duration in_module_limits(const CoreConfig& config, const FaultRow& row);
Duration in_current(const CoreConfig& config, const FaultRow& row);
Duration in_pack_voltage(const CoreConfig& config, const FaultRow& row);
Duration in_a_line(const CoreConfig& config, const FaultRow& row);
Duration in_a_frame_behind_all(const CoreConfig& config, const FaultRow& row);
Duration in_the_next_word(const CoreConfig& config, const FaultRow& row);
Duration in_a_contact(const CoreConfig& config, const FaultRow& row);
Duration in_module_silence(const CoreConfig& config, const FaultRow& row);
Duration in_temperature_silence(const CoreConfig& config, const FaultRow& row);
Duration in_damaged_frames(const CoreConfig& config, const FaultRow& row);
Duration in_current_silence(const CoreConfig& config, const FaultRow& row);
Duration in_voltage_silence(const CoreConfig& config, const FaultRow& row);
Duration in_pdu_silence(const CoreConfig& config, const FaultRow& row);
Duration in_missing_echoes(const CoreConfig& config, const FaultRow& row);
Duration in_an_identity(const CoreConfig& config, const FaultRow& row);
Duration in_limits_not_taken(const CoreConfig& config, const FaultRow& row);
Duration in_a_balancing_switch(const CoreConfig& config, const FaultRow& row);
Duration in_two_answers(const CoreConfig& config, const FaultRow& row);
Duration in_the_next_tick(const CoreConfig& config, const FaultRow& row);
Duration in_a_contact_that_stays(const CoreConfig& config, const FaultRow& row);
Duration in_the_precharge_time_out(const CoreConfig& config, const FaultRow& row);
Duration in_the_unit_alone(const CoreConfig& config, const FaultRow& row);
Duration in_the_charge(const CoreConfig& config, const FaultRow& row);
Duration in_monitor_silence(const CoreConfig& config, const FaultRow& row);
Duration in_a_test_that_does_not_end(const CoreConfig& config, const FaultRow& row);
Duration in_charger_silence(const CoreConfig& config, const FaultRow& row);
Duration in_a_charge_that_goes_on(const CoreConfig& config, const FaultRow& row);
}  // namespace seen

}  // namespace bmu::test

#define BMUD_JOIN_AGAIN(one, other) one##other
#define BMUD_JOIN(one, other) BMUD_JOIN_AGAIN(one, other)
#define BMUD_FAULT(number, title, tags, ...)                                                              \
  static const ::bmu::test::Registered BMUD_JOIN(row_in_line_,                                            \
                                                 __LINE__){::bmu::test::Row{number, title, __VA_ARGS__}}; \
  TEST_CASE("F" #number ": " title, "[catalogue][F" #number "]" tags) {                                   \
    ::bmu::test::check_row(BMUD_JOIN(row_in_line_, __LINE__).row);                                        \
  }
/// A row of the catalogue, as a test.
#define FAULT(number, title, ...) BMUD_FAULT(number, title, "", __VA_ARGS__)
/// A row with a test that takes seconds of processor time: `tools/test --fast` skips it.
#define SLOW_FAULT(number, title, ...) BMUD_FAULT(number, title, "[slow]", __VA_ARGS__)
/// A row with a test of another form; only a line on the page.
#define FAULT_TESTED_IN(number, where, ...)                    \
  static const ::bmu::test::Registered BMUD_JOIN(row_in_line_, \
                                                 __LINE__){::bmu::test::Row{number, {}, {}, {__VA_ARGS__}, where}};
