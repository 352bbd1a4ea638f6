// Pulse-width signal of the insulation monitors Bender IR155-3203 and -3204, output M_HS. The frequency indicates the
// state, the duty cycle (high share of a period) the value.
//
//   frequency   state            duty cycle
//   10 Hz       normal           5 to 95 %: the insulation resistance
//   20 Hz       undervoltage     the same; the battery voltage is below the threshold the monitor was ordered with
//   30 Hz       speed start      5 to 10 % good, 90 to 95 % bad: an estimate in the first 2 s after power-on
//   40 Hz       device error     47.5 to 52.5 %
//   50 Hz       earth fault      47.5 to 52.5 %: the monitor's own connection to the chassis
//   no edges    no signal        low: off, wire open, short to ground; high: short to supply
//
//   resistance = 90 % * 1.2 MOhm / (duty - 5 %) - 1.2 MOhm
//
// Each frequency is accepted 1 Hz around its nominal value, each duty cycle 1 % outside its band, both ends included; a
// signal that matches no row is undefined and must never be treated as healthy. Pure: the caller captures the edges and
// passes the result. The numbers are the vendor's, taken from the drivers of its users.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "protocol/signal.hpp"
#include "protocol/time.hpp"

namespace bmu::ir155 {

enum class State : std::uint8_t {
  no_signal_low,
  no_signal_high,
  normal,
  undervoltage,
  speed_start_good,
  speed_start_bad,
  device_error,
  earth_fault,
  undefined,
};

[[nodiscard]] std::string_view to_text(State state);

/// Measurement of a capture input: the last complete period, and the time since its end.
struct Pwm {
  std::int32_t frequency_mHz = 0;  // 0: no complete period so far
  std::int32_t duty_permille = 0;
  bool is_high = false;   // present level; used only without edges
  Duration since_edge{};  // above `edge_silence_max`: no edges, regardless of the other members
};

struct Reading {
  State state = State::no_signal_low;
  /// Valid below `resistance_limit_Ohm`, above range from there on; unknown in states that do not measure it.
  SignalValue resistance_Ohm{};

  friend constexpr bool operator==(const Reading&, const Reading&) = default;
};

/// Two periods of the slowest signal.
inline constexpr Duration edge_silence_max = 200ms;
/// Near 5 % a step of the duty cycle is tens of megaohms: from here on the value only means "very high".
inline constexpr std::int64_t resistance_limit_Ohm = 50'000'000;
/// Time from power-on to the first measurement of a monitor; until then it is in speed start.
inline constexpr Duration speed_start_time = 2s;

/// Frequency of a state and the duty cycles that are accepted with it.
struct Row {
  State state = State::undefined;
  std::int32_t frequency_mHz = 0;
  std::int32_t duty_min_permille = 0;
  std::int32_t duty_max_permille = 0;
  std::int32_t duty_sent_permille = 0;  // for a monitor that reports only the state
  bool is_measuring = false;
};
inline constexpr std::int32_t frequency_tolerance_mHz = 1'000;
inline constexpr Row rows[] = {
    {State::normal, 10'000, 40, 960, 0, true},      {State::undervoltage, 20'000, 40, 960, 0, true},
    {State::speed_start_good, 30'000, 40, 110, 75}, {State::speed_start_bad, 30'000, 890, 960, 925},
    {State::device_error, 40'000, 465, 535, 500},   {State::earth_fault, 50'000, 465, 535, 500},
};

/// Whether there is a complete period, and it ended at most `edge_silence_max` ago.
[[nodiscard]] constexpr bool has_signal(const Pwm& pwm) {
  return pwm.frequency_mHz > 0 && pwm.since_edge <= edge_silence_max;
}

/// Decodes a signal. Total: every input gives a state. Cost: a few comparisons.
[[nodiscard]] Reading decode(const Pwm& pwm);

/// Quantity of an undefined signal that matches no row.
enum class Misfit : std::uint8_t {
  frequency,   // of no state
  duty_cycle,  // of no state with this frequency
};
inline constexpr std::size_t misfit_count = 2;

[[nodiscard]] std::string_view to_text(Misfit misfit);
/// None for a signal that has a state, and without a signal.
[[nodiscard]] std::optional<Misfit> misfit(const Pwm& pwm);

/// Inverse of `decode`, for emulated monitors. The resistance is used in measuring states only: below 0 counts as 0,
/// any validity other than valid as above range. The duty cycle is rounded to a permille, which limits the accuracy of
/// the decoded resistance: within 0.8 kOhm at 50 kOhm, 2.7 kOhm at 1.2 MOhm. `undefined` gives a signal between the
/// rows.
[[nodiscard]] Pwm encode(const Reading& reading);

namespace detail {

consteval bool rows_are_apart() {
  for (const Row& one : rows) {
    const bool is_slow_enough = 1'000'000ms / (one.frequency_mHz - frequency_tolerance_mHz) < edge_silence_max;
    if (one.duty_min_permille > one.duty_max_permille || !is_slow_enough) return false;
    if (!one.is_measuring &&
        (one.duty_sent_permille < one.duty_min_permille || one.duty_sent_permille > one.duty_max_permille)) {
      return false;
    }
    for (const Row& other : rows) {
      if (&one == &other) continue;
      const std::int32_t apart_mHz = one.frequency_mHz - other.frequency_mHz;
      const bool same_frequency = apart_mHz <= 2 * frequency_tolerance_mHz && -apart_mHz <= 2 * frequency_tolerance_mHz;
      const bool same_duty =
          one.duty_min_permille <= other.duty_max_permille && other.duty_min_permille <= one.duty_max_permille;
      if (same_frequency && same_duty) return false;
    }
  }
  return true;
}

}  // namespace detail
static_assert(detail::rows_are_apart(), "a signal must have one meaning, and none may count as silence");

}  // namespace bmu::ir155
