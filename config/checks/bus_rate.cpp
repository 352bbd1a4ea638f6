#include "config/checks/bus_rate.hpp"

#include <cstdlib>

#include "config/checks/bus_checks.hpp"
#include "config/checks/pack_checks.hpp"
#include "config/checks/pack_defaults.hpp"

namespace bmu {
namespace {

constexpr std::int64_t kbit = 1'000;
constexpr std::int64_t tolerance_permille = 5;

bool is_near(std::int64_t found, std::int64_t wanted) {
  return std::abs(found - wanted) * 1'000 <= wanted * tolerance_permille;
}

/// "500", "83.333".
std::string kbit_text(std::int64_t bit_per_s) {
  std::string text = std::to_string(bit_per_s / kbit);
  std::string rest = std::to_string(kbit + bit_per_s % kbit).substr(1);
  while (!rest.empty() && rest.back() == '0') rest.pop_back();
  return rest.empty() ? text : text + "." + rest;
}

/// "/poll/period_ms 50, /ages/cell_voltage_ms 250": settings for which the rate is too slow; empty if there are none.
std::string too_slow_for(const PackConfig& pack) {
  ProblemList problems;
  PackConfig as_in_file = pack;
  as_in_file.core.poll = pack.poll_in_file;
  check_bus_times(as_in_file, Place{}, problems);
  std::string text;
  for (const ConfigProblem& problem : problems.take()) {
    text += (text.empty() ? "" : ", ") + problem.path + " " + problem.found;
  }
  return text;
}

}  // namespace

std::string_view to_text(RateVerdict verdict) {
  switch (verdict) {
    case RateVerdict::unknown: return "unknown";
    case RateVerdict::as_wanted: return "as wanted";
    case RateVerdict::differs: return "differs";
    case RateVerdict::too_slow: return "too slow";
  }
  return "?";
}

PackConfig at_rate(const PackConfig& pack, std::int64_t bit_per_s) {
  PackConfig real = pack;
  real.buses.internal_kbit_per_s = static_cast<std::int32_t>(bit_per_s / kbit);
  real.core.poll = pack.poll_in_file;
  complete_paces(real);
  return real;
}

RateFinding judge_rate(const PackConfig& pack, std::string_view file_name, std::int64_t found_bit_per_s) {
  const std::int64_t wanted_bit_per_s = pack.buses.internal_kbit_per_s * kbit;
  RateFinding finding{.found_bit_per_s = found_bit_per_s, .wanted_bit_per_s = wanted_bit_per_s};
  if (found_bit_per_s <= 0) return finding;
  const std::string wanted = kbit_text(wanted_bit_per_s) + " kbit/s";
  if (is_near(found_bit_per_s, wanted_bit_per_s)) {
    finding.verdict = RateVerdict::as_wanted;
    finding.text = pack.buses.internal + ": bitrate " + kbit_text(found_bit_per_s) + " kbit/s as configured";
    return finding;
  }
  finding.text = std::string(file_name) + ": /buses/internal_kbit_per_s: found " + pack.buses.internal + " at " +
                 kbit_text(found_bit_per_s) + " kbit/s, expected " + wanted;
  if (found_bit_per_s < kbit) {  // no controller is this slow; nothing fits
    finding.verdict = RateVerdict::too_slow;
    return finding;
  }
  const PackConfig real = at_rate(pack, found_bit_per_s);
  const std::string slow_for = too_slow_for(real);
  finding.verdict = slow_for.empty() ? RateVerdict::differs : RateVerdict::too_slow;
  finding.text += "; " + bus_use_text(real) +
                  (slow_for.empty() ? ", which is sufficient, but nodes at " + wanted + " cannot communicate"
                                    : ", bus load too high for " + slow_for);
  return finding;
}

}  // namespace bmu
