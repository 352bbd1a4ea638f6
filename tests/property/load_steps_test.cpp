// A load that is switched moves the values of cells, pack and current between two samples of them, whatever their
// offset to the step: a healthy pack warns of nothing and stays closed, and a wrong voltage opens it nevertheless.
//
// Swept: the load and its direction, the offset of the devices' periods to the core's ticks, the time of the step
// between two POLLs, the delay of the sensor's frames, and the rate at which the load is switched: every 30 ms or more
// rarely, because a load that is switched every 20 ms, in step with the averages of the sensor, looks constant to it,
// and the response of the cells is unexplained. Each combination is tried (whole_range.hpp).
#include <array>
#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/pack_config.hpp"
#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/whole_range.hpp"
#include "tests/support/wired_pack.hpp"

namespace bmu {
namespace {

using test::Fate;
using test::WholeRange;
using test::WiredPack;

constexpr const char* shipped[] = {"charger-48s", "demo-48s",      "fs-20s3p-84v", "i3-96s",          "lfp-96s",
                                   "lipo-6s-24v", "outlander-80s", "shell-eco-6s", "storage-16s-48v", "traction-16x12"};

CoreConfig config_of(const std::string& name) {
  const auto read = load_pack_config(test::in_source("config/packs/" + name + ".json"));
  REQUIRE(read);
  return read->core;
}

CoreConfig with_second_sensor(const std::string& name) {
  CoreConfig config = config_of(name);
  config.sensor.has_second_current = true;
  config.limits.current_sensors_disagree = {
      .warn = 2'000, .open = 5'000, .hysteresis = 1'000, .confirm = 500ms, .clear = 2s};
  return config;
}

std::string load_A(double current_A) {
  return "load current_A " + std::to_string(current_A);
}

/// Adds the names of all faults that warn or are present.
void add_faults(const WiredPack& pack, std::set<std::string>& names) {
  for (std::size_t fault = 0; fault < fault_count; ++fault) {
    const FaultState& state = pack.core().faults().states()[fault];
    if (state.is_warning || state.is_present()) names.insert(std::string(row_of(static_cast<FaultId>(fault)).name));
  }
}

/// Runs and adds all faults that warn or are present at any millisecond.
void watch(WiredPack& pack, Duration duration, std::set<std::string>& names) {
  for (Duration passed{}; passed < duration; passed += 1ms) {
    pack.run(1ms);
    add_faults(pack, names);
  }
}

/// A pack that has closed and warned of nothing since its key was turned. `late`: a message that comes 25 ms later.
WiredPack closed_pack(const CoreConfig& config, int ahead_ms, const MessageSpec* late = nullptr) {
  WiredPack pack(config, std::chrono::milliseconds(ahead_ms));
  pack.on_sent = [late](CanFrame& frame, const WiredPack&) {
    return late != nullptr && frame.id == late->base_id ? Fate{.delay = 25ms} : Fate{};
  };
  pack.apply("pack soc_permille 600");
  pack.run(3s);
  pack.apply("vehicle on");
  std::set<std::string> found;
  watch(pack, 5s, found);
  REQUIRE(pack.phase() == Phase::closed);
  CHECK(found == std::set<std::string>{});
  return pack;
}

struct Step {
  double before_A;
  double after_A;
};

/// Faults that warn or are present within a second after the step.
std::set<std::string> faults_of(WiredPack pack, const Step& step, int between_ms) {
  std::set<std::string> found;
  pack.apply(load_A(step.before_A));
  pack.run(1500ms + std::chrono::milliseconds(between_ms));
  add_faults(pack, found);
  pack.apply(load_A(step.after_A));
  watch(pack, 1s, found);
  return found;
}

std::string list_of(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string ahead_text(int ahead_ms) {
  return "devices " + std::to_string(ahead_ms) + " ms ahead";
}

void try_steps(WholeRange& range, const std::string& name, const CoreConfig& config,
               const std::vector<const MessageSpec*>& late) {
  const double full_A = config.current.discharge_continuous_mA * 0.9e-3;
  const double back_A = config.current.charge_continuous_mA * -0.5e-3;
  const std::array steps{Step{0, full_A}, Step{full_A, 0}, Step{full_A / 2, back_A}};
  for (std::size_t message = 0; message < late.size(); ++message) {
    for (std::size_t ahead = 0; ahead < 5; ++ahead) {
      const int ahead_ms = static_cast<int>(ahead) * 13;
      std::optional<WiredPack> closed;
      for (std::size_t step = 0; step < steps.size(); ++step) {
        for (std::size_t between = 0; between < 5; ++between) {
          const int between_ms = static_cast<int>(between) * 11;
          const std::string text =
              name + ", " + load_A(steps[step].before_A) + ", then " + load_A(steps[step].after_A) + ", " +
              ahead_text(ahead_ms) + ", " + std::to_string(between_ms) + " ms more, " +
              (late[message] != nullptr ? std::string(late[message]->name) : "no message") + " late";
          range.attempt(text, message + ahead + step + between, [&] {
            if (!closed) closed = closed_pack(config, ahead_ms, late[message]);
            return list_of(faults_of(*closed, steps[step], between_ms));
          });
        }
      }
    }
  }
}

/// Switches the load for `at_most`, or until the contactors are commanded to open. Returns the time that this took.
Duration toggle(WiredPack& pack, double full_A, Duration half_period, Duration at_most, std::set<std::string>& found) {
  const TimePoint began_at = pack.now();
  TimePoint next_at = began_at;
  for (bool is_on = true; pack.now() - began_at < at_most && pack.phase() == Phase::closed;) {
    if (pack.now() >= next_at) {
      pack.apply(load_A(is_on ? full_A : 0));
      next_at += half_period;
      is_on = !is_on;
    }
    watch(pack, 1ms, found);
  }
  return pack.now() - began_at;
}

/// Switches a load and returns the problem of the result; "": none.
using Trial = std::function<std::string(WiredPack pack, Duration half_period)>;

struct Toggling {
  CoreConfig config;
  std::vector<int> ahead_ms;
  std::vector<Duration> half_periods;
  std::vector<std::string> events{""};  // of each trial, before the load is switched

  void check(const Trial& problem_of) const {
    WholeRange range;
    for (std::size_t ahead = 0; ahead < ahead_ms.size(); ++ahead) {
      std::optional<WiredPack> closed;
      for (std::size_t event = 0; event < events.size(); ++event) {
        for (std::size_t period = 0; period < half_periods.size(); ++period) {
          const std::string text = events[event] + (events[event].empty() ? "" : ", ") + ahead_text(ahead_ms[ahead]) +
                                   ", switched every " + std::to_string(to_ms(half_periods[period])) + " ms";
          range.attempt(text, ahead + event + period, [&] {
            if (!closed) closed = closed_pack(config, ahead_ms[ahead]);
            WiredPack pack = *closed;
            if (!events[event].empty()) pack.apply(events[event]);
            return problem_of(std::move(pack), half_periods[period]);
          });
        }
      }
    }
    range.check();
  }
};

template <class Value>
std::vector<Value> each(Value first, Value end, Value step) {
  std::vector<Value> all;
  for (; first < end; first += step) all.push_back(first);
  return all;
}

/// Requires that the pack stays closed and warns of nothing.
Trial stays_closed(double full_A, Duration at_most) {
  return [=](WiredPack pack, Duration half_period) {
    std::set<std::string> found;
    (void)toggle(pack, full_A, half_period, at_most, found);
    return pack.phase() == Phase::closed ? list_of(found) : "it opens: " + list_of(found);
  };
}

/// Requires that it opens for this fault within a second.
Trial opens_for(FaultId fault, double full_A) {
  return [=](WiredPack pack, Duration half_period) -> std::string {
    std::set<std::string> found;
    if (toggle(pack, full_A, half_period, 2s, found) > 1s) return "it does not open within a second";
    const FaultId opened_for = pack.core().last_opening().fault;
    return opened_for == fault ? "" : "it opens for " + std::string(row_of(opened_for).name);
  };
}

TEST_CASE("a load that is switched warns of nothing", "[property][faults]") {
  WholeRange range;
  try_steps(range, "demo-48s", config_of("demo-48s"), {nullptr});
  range.check();
}

TEST_CASE("a load that is switched warns of nothing where frames of the sensor are late", "[property][faults][slow]") {
  WholeRange range;
  try_steps(range, "demo-48s", config_of("demo-48s"), {&internal_bus::sensor_u1, &internal_bus::sensor_current});
  range.check();
}

TEST_CASE("a load that is switched warns of nothing in any pack that is shipped", "[property][faults][slow]") {
  WholeRange range;
  for (const char* const name : shipped) try_steps(range, name, config_of(name), {nullptr});
  range.check();
}

TEST_CASE("two current sensors agree while the load is switched", "[property][faults]") {
  Toggling{.config = with_second_sensor("demo-48s"),
           .ahead_ms = each(0, 20, 7),
           .half_periods = each<Duration>(30ms, 201ms, 10ms)}
      .check(stays_closed(60, 5s));
}

TEST_CASE("a current sensor that is wrong opens the pack within a second, however the load is switched",
          "[property][faults]") {
  Toggling{.config = with_second_sensor("demo-48s"),
           .ahead_ms = each(0, 20, 7),
           .half_periods = each<Duration>(20ms, 301ms, 35ms),
           .events = {"sensor current offset_mA 10000", "sensor current_2 offset_mA -10000"}}
      .check(opens_for(FaultId::current_sensors_disagree, 60));
}

// The bus alone delays the sensor's frames by up to 36 ms.
TEST_CASE("a load that is switched again and again warns of nothing in a pack of 192 cells, and does not open it",
          "[property][faults][slow]") {
  Toggling{.config = config_of("traction-16x12"),
           .ahead_ms = each(0, 90, 30),
           .half_periods = each<Duration>(30ms, 301ms, 10ms)}
      .check(stays_closed(65, 3s));
}

TEST_CASE("a pack voltage that is wrong opens within a second while the load is switched every 230 ms or more rarely",
          "[property][faults][F14][BMU_4][slow]") {
  Toggling{.config = config_of("traction-16x12"),
           .ahead_ms = each(0, 90, 30),
           .half_periods = each<Duration>(230ms, 501ms, 30ms),
           .events = {"sensor pack_voltage offset_mV 20000", "sensor pack_voltage offset_mV -20000"}}
      .check(opens_for(FaultId::pack_voltage_mismatch, 65));
}

TEST_CASE(
    "a current sensor that counts the wrong way round opens a pack whose load is switched, at any pace of polling",
    "[property][faults][F18]") {
  const std::array periods{20ms, 22ms, 40ms, 50ms};
  WholeRange range;
  for (std::size_t period = 0; period < periods.size(); ++period) {
    CoreConfig config = config_of("demo-48s");
    config.poll.period = config.poll.fast_period = periods[period];
    for (std::size_t ahead = 0; ahead < 7; ++ahead) {
      const int ahead_ms = static_cast<int>(ahead) * 3;
      const std::string text =
          "polled every " + std::to_string(to_ms(periods[period])) + " ms, " + ahead_text(ahead_ms);
      range.attempt(text, period + ahead, [&]() -> std::string {
        WiredPack pack = closed_pack(config, ahead_ms);
        pack.apply("sensor current inverted on");
        std::set<std::string> found;
        if (toggle(pack, 20, 1s, 10s, found) > 3s) return "it does not open within three seconds";
        const FaultId opened_for = pack.core().last_opening().fault;
        return opened_for == FaultId::current_contradicts_voltage
                   ? ""
                   : "it opens for " + std::string(row_of(opened_for).name);
      });
    }
  }
  range.check();
}

}  // namespace
}  // namespace bmu
