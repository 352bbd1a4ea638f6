#include "protocol/ir155.hpp"

#include <algorithm>
#include <array>

namespace bmu::ir155 {

namespace {

// The formula in Ohm and permille: resistance + offset = slope / (duty - zero).
constexpr std::int64_t offset_Ohm = 1'200'000;
constexpr std::int64_t slope_permille_Ohm = 900 * offset_Ohm;
constexpr std::int32_t duty_zero_permille = 50;           // unlimited resistance
constexpr std::int32_t duty_full_permille = 950;          // resistance 0
constexpr std::int32_t undefined_frequency_mHz = 25'000;  // between undervoltage and speed start

constexpr std::array<std::string_view, 9> state_names{"no signal, low", "no signal, high",   "normal",
                                                      "undervoltage",   "speed start, good", "speed start, bad",
                                                      "device error",   "earth fault",       "undefined"};

bool has_frequency(const Row& row, const Pwm& pwm) {
  const std::int32_t off_mHz = pwm.frequency_mHz - row.frequency_mHz;
  return off_mHz >= -frequency_tolerance_mHz && off_mHz <= frequency_tolerance_mHz;
}

bool holds(const Row& row, const Pwm& pwm) {
  return has_frequency(row, pwm) && pwm.duty_permille >= row.duty_min_permille &&
         pwm.duty_permille <= row.duty_max_permille;
}

SignalValue resistance_of(std::int32_t duty_permille) {
  if (duty_permille >= duty_full_permille) return known(0);
  if (duty_permille <= duty_zero_permille) return not_known(Validity::above_range);
  const std::int64_t resistance_Ohm =
      divide_to_nearest(slope_permille_Ohm, duty_permille - duty_zero_permille) - offset_Ohm;
  return resistance_Ohm < resistance_limit_Ohm ? known(resistance_Ohm) : not_known(Validity::above_range);
}

std::int32_t duty_for(const SignalValue& resistance_Ohm) {
  if (!resistance_Ohm.is_valid() || resistance_Ohm.value >= resistance_limit_Ohm) return duty_zero_permille;
  const std::int64_t total_Ohm = std::max<std::int64_t>(resistance_Ohm.value, 0) + offset_Ohm;
  return duty_zero_permille + static_cast<std::int32_t>(divide_to_nearest(slope_permille_Ohm, total_Ohm));
}

}  // namespace

std::string_view to_text(State state) {
  return state_names[static_cast<std::size_t>(state)];
}

Reading decode(const Pwm& pwm) {
  if (!has_signal(pwm)) return {pwm.is_high ? State::no_signal_high : State::no_signal_low, not_known()};
  const auto row = std::find_if(std::begin(rows), std::end(rows), [&pwm](const Row& one) { return holds(one, pwm); });
  if (row == std::end(rows)) return {State::undefined, not_known()};
  return {row->state, row->is_measuring ? resistance_of(pwm.duty_permille) : not_known()};
}

std::string_view to_text(Misfit misfit) {
  switch (misfit) {
    case Misfit::frequency: return "frequency";
    case Misfit::duty_cycle: return "duty cycle";
  }
  return "?";
}

std::optional<Misfit> misfit(const Pwm& pwm) {
  if (!has_signal(pwm) || decode(pwm).state != State::undefined) return std::nullopt;
  const bool is_frequency_known =
      std::any_of(std::begin(rows), std::end(rows), [&pwm](const Row& one) { return has_frequency(one, pwm); });
  return is_frequency_known ? Misfit::duty_cycle : Misfit::frequency;
}

Pwm encode(const Reading& reading) {
  const auto row =
      std::find_if(std::begin(rows), std::end(rows), [&](const Row& one) { return one.state == reading.state; });
  if (row == std::end(rows)) {
    const bool has_edges = reading.state == State::undefined;
    return {.frequency_mHz = has_edges ? undefined_frequency_mHz : 0,
            .duty_permille = has_edges ? 500 : 0,
            .is_high = reading.state == State::no_signal_high};
  }
  return {.frequency_mHz = row->frequency_mHz,
          .duty_permille = row->is_measuring ? duty_for(reading.resistance_Ohm) : row->duty_sent_permille};
}

}  // namespace bmu::ir155
