#include "config/checks/bus_checks.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "config/checks/bus_budget.hpp"
#include "config/checks/device_rates.hpp"
#include "config/fields/pack_fields.hpp"

namespace bmu {
namespace {

constexpr std::string_view rate_key = "internal_kbit_per_s";

std::int64_t ms_up(Duration duration) {
  return to_ms(duration + 1ms - 1ns);
}

std::int64_t percent_up(std::int64_t permille) {
  return (permille + 9) / 10;
}

/// A key with a poll period, and the maximum of that period.
struct PaceRow {
  std::string_view key;
  Duration PollConfig::*period;
  Duration (*period_max)(const PollConfig&);
};
constexpr PaceRow pace_rows[] = {
    {"period_ms", &PollConfig::period, [](const PollConfig&) { return Duration{poll_period_max}; }},
    {"fast_period_ms", &PollConfig::fast_period, [](const PollConfig& poll) { return poll.period; }},
    {"parked_period_ms", &PollConfig::parked_period, [](const PollConfig&) { return Duration{parked_period_max}; }},
};
constexpr const PaceRow& normal_pace = pace_rows[0];

/// Whether a bit rate suffices for a poll period of the pack file.
using Suffices = bool (*)(const PackConfig&, const PaceRow&, std::int32_t rate_kbit_per_s);

bool fits(const PackConfig& pack, const PaceRow& row, std::int32_t rate_kbit_per_s) {
  const std::optional<Duration> least = period_min(pack.core, rate_kbit_per_s);
  return least && *least <= pack.core.poll.*row.period;
}
std::int64_t load_permille(const PackConfig& pack, const PaceRow& row, std::int32_t rate_kbit_per_s) {
  return bus_load_permille(pack.core, pack.core.poll.*row.period, rate_kbit_per_s);
}
bool leaves_room(const PackConfig& pack, const PaceRow& row, std::int32_t rate_kbit_per_s) {
  return load_permille(pack, row, rate_kbit_per_s) <= bus_load_max_permille;
}

/// The first period that suffices, from that of the file upwards in steps.
std::optional<Duration> period_that(Suffices suffices, const PackConfig& of, const PaceRow& row, Duration step) {
  PackConfig pack = of;
  const Duration period_max = row.period_max(pack.core.poll);
  Duration& period = pack.core.poll.*row.period;
  while (period <= period_max && !suffices(pack, row, pack.buses.internal_kbit_per_s)) period += step;
  return period <= period_max ? std::optional{period} : std::nullopt;
}

/// "at least 87 at 250 kbit/s, or buses/internal_kbit_per_s 500": the remedies, each sufficient by itself.
std::string ways_out(const PackConfig& pack, const PaceRow& row, Suffices suffices) {
  const auto at_rate = [&](std::int32_t rate) { return suffices(pack, row, rate); };
  const auto* const faster = std::find_if(std::begin(bus_rates_kbit_per_s), std::end(bus_rates_kbit_per_s), at_rate);
  std::string ways;
  if (const std::optional<Duration> period = period_that(suffices, pack, row, 1ms)) {
    ways = "at least " + std::to_string(to_ms(*period)) + " at " + std::to_string(pack.buses.internal_kbit_per_s) +
           " kbit/s";
  }
  if (faster != std::end(bus_rates_kbit_per_s)) {
    ways +=
        (ways.empty() ? "" : ", or ") + std::string("buses/") + std::string(rate_key) + " " + std::to_string(*faster);
  }
  return ways.empty() ? "fewer modules: no period and no bit rate will do" : ways;
}

std::string takes_text(const std::optional<Duration>& time) {
  return time ? "up to " + std::to_string(ms_up(*time)) + " ms" : "too long";
}

void check_pace(const PackConfig& pack, const Place& place, const PaceRow& row, ProblemList& problems) {
  const std::int32_t rate_kbit_per_s = pack.buses.internal_kbit_per_s;
  const Duration period = pack.core.poll.*row.period;
  const Place key = place.at("poll").at(row.key);
  if (!problems.is_good(key) || period == 0ns || fits(pack, row, rate_kbit_per_s)) return;
  problems.add(key, std::to_string(to_ms(period)),
               ways_out(pack, row, fits) + ": all answers of " + std::to_string(pack.core.modules.size()) +
                   " modules take " + takes_text(cycle_time_max(pack.core, all_wants, rate_kbit_per_s)) + " at " +
                   std::to_string(rate_kbit_per_s) + " kbit/s, with single polls of modules " +
                   takes_text(period_min(pack.core, rate_kbit_per_s)));
}

// --- buses without modules ------------------------------------------------------------------------------------------

struct OwnBus {
  Port port;
  std::string_view rate_key;
};
constexpr OwnBus own_buses[] = {{Port::vehicle, "vehicle_kbit_per_s"},
                                {Port::charger, "charger_kbit_per_s"},
                                {Port::second_pack, "second_pack_kbit_per_s"},
                                {Port::inverter, "inverter_kbit_per_s"}};

/// Adds a problem for each bus without modules with a higher load than this: the load, and what would suffice.
void say_fuller_than(std::int64_t most_permille, const PackConfig& pack, const Place& interfaces,
                     ProblemList& problems) {
  for (const OwnBus& bus : own_buses) {
    const std::int32_t rate_kbit_per_s = bit_rate_kbit_per_s(pack, bus.port);
    const Place key = interfaces.at(bus.rate_key);
    if (rate_kbit_per_s == 0 || !problems.is_good(key)) continue;
    const std::int64_t load_permille = guest_load_permille(pack.core, bus.port, rate_kbit_per_s);
    if (load_permille <= most_permille) continue;
    const auto fits = [&](std::int32_t rate) {
      return guest_load_permille(pack.core, bus.port, rate) <= bus_load_max_permille;
    };
    const auto* const faster = std::find_if(std::begin(bus_rates_kbit_per_s), std::end(bus_rates_kbit_per_s), fits);
    const std::string rate =
        faster != std::end(bus_rates_kbit_per_s) ? "at least " + std::to_string(*faster) + ", or " : std::string();
    problems.add(key,
                 std::to_string(rate_kbit_per_s) + ", at which " + pack.buses.name(bus.port) + " is filled to up to " +
                     std::to_string(percent_up(load_permille)) + " %",
                 rate + "fewer on that bus, for at most " + std::to_string(bus_load_max_permille / 10) + " %");
  }
}

}  // namespace

void check_own_buses(const PackConfig& pack, const Place& place, ProblemList& problems) {
  constexpr std::int64_t full_permille = 1'000;
  for (const std::string_view section :
       {"buses", "vehicle", "charger", "inverter", "second_pack", "sensor", "insulation"}) {
    if (!problems.is_good_throughout(place.at(section))) return;
  }
  say_fuller_than(full_permille, pack, place.at("interfaces"), problems);
}

void check_cycle(const PackConfig& pack, const Place& place, ProblemList& problems) {
  const bool are_known =
      problems.is_good(place.at("poll").at(normal_pace.key)) && problems.is_good_throughout(place.at("modules")) &&
      problems.is_good(place.at("buses").at(rate_key)) && problems.is_good(place.at("contactors").at("pdu"));
  if (!are_known) return;
  for (const PaceRow& row : pace_rows) check_pace(pack, place, row, problems);
}

Duration answer_margin(const PackConfig& pack, Duration at_least) {
  const std::optional<Duration> cycle = cycle_time_max(pack.core, all_wants, pack.buses.internal_kbit_per_s);
  const bool is_meant = cycle && *cycle <= pack.core.poll.period;  // otherwise the cycle itself is rejected
  const Duration older = are_modules_ours(pack.core) ? Duration{} : pack.core.foreign.driver->sample_age_max;
  return is_meant ? std::max(at_least, Duration{std::chrono::milliseconds{ms_up(*cycle + older)}}) : at_least;
}

Duration fast_period_left_out(const PackConfig& pack) {
  constexpr Duration step = 5ms;
  constexpr auto suffices = [](const PackConfig& tried, const PaceRow& row, std::int32_t rate_kbit_per_s) {
    return fits(tried, row, rate_kbit_per_s) && leaves_room(tried, row, rate_kbit_per_s);
  };
  const PaceRow& fast = pace_rows[1];
  PackConfig tried = pack;
  tried.core.poll.fast_period = std::max<Duration>(pack.core.poll.period / 2, poll_period_min);
  if (suffices(tried, fast, pack.buses.internal_kbit_per_s)) return tried.core.poll.fast_period;
  tried.core.poll.fast_period = (tried.core.poll.fast_period / step + 1) * step;
  return period_that(suffices, tried, fast, step).value_or(pack.core.poll.period);
}

std::string bus_use_text(const PackConfig& pack) {
  const std::int32_t rate_kbit_per_s = pack.buses.internal_kbit_per_s;
  return "internal bus at " + std::to_string(rate_kbit_per_s) + " kbit/s: in use for up to " +
         std::to_string(percent_up(load_permille(pack, normal_pace, rate_kbit_per_s))) +
         " % of the time, a poll cycle takes " + takes_text(cycle_time_max(pack.core, all_wants, rate_kbit_per_s));
}

ConfigProblems bus_warnings(const PackConfig& pack, std::string_view file_name) {
  const std::int32_t rate_kbit_per_s = pack.buses.internal_kbit_per_s;
  ProblemList warnings;
  for (const PaceRow& row : pace_rows) {
    const Duration period = pack.core.poll.*row.period;
    const bool is_said = &row != &normal_pace && period == pack.core.poll.period;
    if (is_said || leaves_room(pack, row, rate_kbit_per_s)) continue;
    warnings.add(
        Place{std::string(file_name), ""}.at("poll").at(row.key),
        std::to_string(to_ms(period)) + ", which fills the internal bus to up to " +
            std::to_string(percent_up(load_permille(pack, row, rate_kbit_per_s))) + " %",
        ways_out(pack, row, leaves_room) + ", for at most " + std::to_string(bus_load_max_permille / 10) + " %");
  }
  say_fuller_than(bus_load_max_permille, pack, Place{std::string(file_name), ""}.at("interfaces"), warnings);
  return warnings.take();
}

}  // namespace bmu
