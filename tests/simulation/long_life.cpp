#include "tests/simulation/long_life.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>

#include <unistd.h>

#include "daemon/core/estimation/pack_estimate.hpp"
#include "mmu/devices/mmu.hpp"
#include "mmu/scenario/simulator.hpp"
#include "protocol/tables/vehicle_bus.hpp"
#include "tests/simulation/soc_watch.hpp"
#include "tests/support/allocation_count.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu::test {

namespace {

constexpr Duration fine_step = 1ms;
constexpr Duration coarse_step = 50ms;
constexpr Duration day = 24h;
constexpr std::int64_t days_between_nights_asleep = 7;
constexpr Duration around_wrap = 1min;
constexpr double drive_A = 30.0;
constexpr double charge_A = 20.0;
constexpr double soc_error_most = 0.05;
constexpr std::size_t wrong_most = 20;

/// Overflows of the types and units in which time may be counted.
constexpr Duration wraps[] = {std::chrono::milliseconds{1LL << 31}, std::chrono::milliseconds{1LL << 32},
                              std::chrono::microseconds{1LL << 31}, std::chrono::microseconds{1LL << 32},
                              std::chrono::seconds{65'536},         std::chrono::nanoseconds{1LL << 53}};

CoreConfig one_module() {
  CoreConfig config = small_pack();
  config.modules.clear();
  config.modules.push_back({.node = 1, .cell_count = 4, .temperature_sensor_count = 2});
  config.poll.parked_period = 1s;
  config.cell.voltage_max_uV = 4'200'000;  // where the emulated charger ends
  return config;
}

SimulatorConfig emulated(const CoreConfig& config) {
  SimulatorConfig emulation = simulator_config(config);
  emulation.cell_noise_uV = 300;
  emulation.plant.initial_soc = 0.7;
  emulation.modules[0].frame_spacing = 0us;
  return emulation;
}

std::int64_t resident_kB() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t all = 0;
  std::int64_t resident = 0;
  statm >> all >> resident;
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

class LongLife {
 public:
  explicit LongLife(const LongOptions& options)
      : options_(options),
        config_(one_module()),
        emulation_(emulated(config_)),
        now_(options.starts_at),
        wake_at_(now_),
        core_(std::make_unique<Core>(config_, now_)),
        world_(std::make_unique<World>(emulation_, now_)),
        mmu_(emulation_.modules[0], now_),
        pdu_(now_),
        sensor_(emulation_.sensor, now_),
        soc_(config_) {
    core_->restore({});
    observe(PortChanged{Port::internal, true});
    observe(PortChanged{Port::vehicle, true});
  }

  LongResult run() {
    result_.wrong.reserve(wrong_most);
    for (std::int64_t number = 0; lived() < options_.length; ++number) live_day(number);
    result_.lived = lived();
    result_.ticks = core_->ticks();
    result_.allocations = allocation_count() - allocations_first_;
    result_.memory_last_kB = resident_kB();
    return result_;
  }

 private:
  [[nodiscard]] Duration lived() const { return now_ - options_.starts_at; }
  [[nodiscard]] bool is_done() const { return lived() >= options_.length; }

  void blame(const char* text) {
    if (result_.wrong.size() >= wrong_most) return;
    char line[160];
    std::snprintf(line, sizeof(line), "after %.3f h: %s", to_s(lived()) / 3'600, text);
    result_.wrong.emplace_back(line);
  }

  // --- a day ------------------------------------------------------------------------------------------------------

  void live_day(std::int64_t number) {
    const TimePoint ends_at = options_.starts_at + (number + 1) * day;
    live_for(10s, true);
    use(world_->inputs.vehicle_on, world_->load_A, drive_A, 4min);
    live_for(30s, true);
    use(world_->inputs.charger_connected, world_->charger_A, charge_A, 6min);
    live_for(30s, true);
    const bool is_asleep_tonight = number % days_between_nights_asleep == days_between_nights_asleep - 1;
    if (is_asleep_tonight) sleep_until(ends_at - 10min);
    live_for(ends_at - now_, false);
    if (!is_asleep_tonight) check_estimate();  // a night with an emulated empty cell leaves a wrong estimate
  }

  /// Requests a closed pack, lets a current flow, and opens it again.
  void use(bool& line, double& current_A, double wanted_A, Duration length) {
    line = true;
    live_for(4s, true);
    if (is_done()) return;
    if (core_->sequence().phase != Phase::closed) blame("does not close");
    ++result_.times_closed;
    current_A = wanted_A;
    live_for(length, true);
    current_A = 0.0;
    used_at_ = now_;
    live_for(1s, true);
    line = false;
    live_for(1s, true);
    if (core_->outputs().any_contactor()) blame("does not open");
  }

  void sleep_until(TimePoint ends_at) {
    world_->cell_senses[0].voltage_mV = 2'500.0;
    live_for(2min, true);
    if (!is_done() && !core_->rest().is_resting()) blame("does not go to sleep");
    ++result_.times_asleep;
    live_for(ends_at - now_, false);
    world_->cell_senses[0].voltage_mV.reset();
    observe(CommandGiven{Command::wake});
    live_for(20s, true);
    observe(CommandGiven{Command::clear_faults, Authority::service});
    live_for(5s, true);
  }

  /// Compares with the real charge of the cells; the published value may lag behind.
  void check_estimate() {
    const std::optional<std::int32_t> told = told_soc();
    const double real = world_->plant.cell(0).soc;
    if (!told || std::abs(*told * 1e-3 - real) > soc_error_most) blame("the state of charge is off");
  }

  [[nodiscard]] std::optional<std::int32_t> told_soc() const {
    std::optional<std::int32_t> told = core_->soc_permille();
    if (told && options_.told) told = options_.told(*told, lived());
    return told;
  }

  /// It may jump at the start, and after a rest that is long enough for an estimate better than the published value.
  void check_steps_of_soc() {
    constexpr Duration around_rest = 1min;
    const std::optional<std::int32_t> told = told_soc();
    const Duration rested = now_ - used_at_;
    const bool has_rested_long = rested > long_rest - around_rest && rested < long_rest + around_rest;
    if (!told || has_rested_long) soc_.begin_anew();
    if (told && !soc_.follow(*told, now_)) blame("the state of charge steps");
  }

  // --- time ---------------------------------------------------------------------------------------------------------

  [[nodiscard]] bool is_near_wrap() const {
    return std::any_of(std::begin(wraps), std::end(wraps), [this](Duration wrap) {
      const auto is_near = [wrap](Duration time) { return time > wrap - around_wrap && time < wrap + around_wrap; };
      return is_near(now_.time_since_epoch()) || is_near(lived());
    });
  }

  void live_for(Duration length, bool is_fine) {
    const TimePoint end = std::min(now_ + length, options_.starts_at + options_.length);
    bool is_near = is_near_wrap();
    for (std::uint64_t steps = 0; now_ < end; ++steps) {
      constexpr std::uint64_t look_every = 100;
      if (steps % look_every == 0) is_near = is_near_wrap();
      const bool is_fine_now = is_fine || is_near;
      step(is_fine_now ? fine_step : options_.ticks_fully ? tick_period : coarse_step);
      if (is_fine_now) result_.finely += fine_step;
    }
  }

  void step(Duration length) {
    now_ += length;
    for (std::size_t index = 0; index < echo_count_; ++index) observe(FrameEchoed{Port::internal, echoes_[index]});
    echo_count_ = 0;
    world_->step(now_);
    for (const CanFrame& frame : pdu_.tick(now_, world_->measure_pdu())) deliver(frame);
    world_->plant.drive(pdu_.outputs().contactors);
    for (const CanFrame& frame : mmu_.tick(now_, world_->measure_module(0, mmu_.wants(now_)))) deliver(frame);
    world_->plant.set_balancing(0, mmu_.balancing_cells());
    for (const CanFrame& frame : sensor_.tick(now_, world_->measure_sensor())) deliver(frame);
    if (now_ >= wake_at_) decide();
    if (now_ >= next_hour_) note_hour();
  }

  void note_hour() {
    if (next_hour_ == TimePoint{}) {
      next_hour_ = options_.starts_at;
    } else if (result_.memory_first_kB == 0) {
      result_.memory_first_kB = resident_kB();
      allocations_first_ = allocation_count();
    } else {
      const std::uint64_t before = allocation_count();
      if (options_.progress) options_.progress(lived());
      allocations_first_ += allocation_count() - before;  // those of the callback do not count
    }
    next_hour_ += 1h;
  }

  // --- the core -----------------------------------------------------------------------------------------------------

  void deliver(const CanFrame& frame) {
    ++result_.frames;
    observe(FrameReceived{Port::internal, frame});
  }
  void observe(const ObservedThing& what) {
    if (core_->observe({now_, what}) == Urgency::decide_now) decide();
  }

  void decide() {
    const Decisions decisions = core_->decide(now_);
    wake_at_ = decisions.wake_at;
    if (wake_at_ <= now_ || wake_at_ > now_ + tick_period) blame("the next tick is not asked for within one");
    for (const OutgoingFrame& out : decisions.frames) {
      ++result_.frames;
      if (out.port == Port::internal) {
        send(out.frame);
      } else {
        world_->charger.observe(out.frame, now_);
        check_uptime(out.frame);
      }
    }
    for (const Event& event : decisions.events) check_event(event);
    check_totals();
    check_steps_of_soc();
  }

  void send(const CanFrame& frame) {
    pdu_.observe(frame, now_);
    mmu_.observe(frame, now_);
    if (echo_count_ < echoes_.size()) echoes_[echo_count_++] = frame;
    if (frame.id != internal_bus::contactor_command.base_id) return;
    const std::uint8_t counter = frame.data[6];
    if (has_commanded_ && counter != static_cast<std::uint8_t>(command_counter_ + 1))
      blame("a command's counter jumps");
    has_commanded_ = true;
    command_counter_ = counter;
  }

  void check_uptime(const CanFrame& frame) {
    using vehicle_bus::pack_status;
    if (frame.id - config_.vehicle.base_id + vehicle_bus::default_base_id != pack_status.base_id) return;
    constexpr std::int64_t room = 65'536;
    const std::int64_t wanted_s = std::chrono::duration_cast<std::chrono::seconds>(lived()).count() % room;
    if (read<pack_status, "uptime_s">(frame).value != wanted_s) blame("the time since the start is wrong");
  }

  /// The only fault of these days is the cell that is too low, for the core and for its module.
  void check_event(const Event& event) {
    if (event.id != EventId::fault_confirmed || bmu::row_of(event.fault).reaction == Reaction::warn) return;
    const bool is_wanted =
        event.fault == FaultId::module_reports_undervoltage || world_->cell_senses[0].voltage_mV.has_value();
    if (!is_wanted) blame(bmu::row_of(event.fault).name.data());
  }

  void check_totals() {
    const PackTotals totals = core_->totals().value_or(PackTotals{});
    const bool is_back = totals.charge_in_uAs < totals_.charge_in_uAs ||
                         totals.charge_out_uAs < totals_.charge_out_uAs ||
                         totals.energy_in_mWh < totals_.energy_in_mWh || totals.energy_out_mWh < totals_.energy_out_mWh;
    if (is_back) blame("charge or energy went back");
    totals_ = totals;
  }

  LongOptions options_;
  CoreConfig config_;
  SimulatorConfig emulation_;
  TimePoint now_;
  TimePoint wake_at_;
  TimePoint next_hour_{};
  std::unique_ptr<Core> core_;  // large, as is world_
  std::unique_ptr<World> world_;
  Mmu mmu_;
  Pdu pdu_;
  CurrentSensor sensor_;
  std::array<CanFrame, 64> echoes_{};
  std::size_t echo_count_ = 0;
  bool has_commanded_ = false;
  std::uint8_t command_counter_ = 0;
  PackTotals totals_;
  SocWatch soc_;
  TimePoint used_at_{};
  std::uint64_t allocations_first_ = 0;
  LongResult result_;
};

}  // namespace

LongResult live_long(const LongOptions& options) {
  return LongLife(options).run();
}

std::string to_text(const LongResult& result) {
  char text[400];
  std::snprintf(
      text, sizeof(text),
      "%.2f days, %.2f h of them at 1 ms; %llu ticks of the core, %llu frames; closed %llu times, asleep %llu "
      "nights\nafter the first hour: %llu allocations, %lld kB resident then, %lld kB at the end\n",
      to_s(result.lived) / 86'400, to_s(result.finely) / 3'600, static_cast<unsigned long long>(result.ticks),
      static_cast<unsigned long long>(result.frames), static_cast<unsigned long long>(result.times_closed),
      static_cast<unsigned long long>(result.times_asleep), static_cast<unsigned long long>(result.allocations),
      static_cast<long long>(result.memory_first_kB), static_cast<long long>(result.memory_last_kB));
  std::string all = text;
  for (const std::string& line : result.wrong) all += "WRONG " + line + "\n";
  return all;
}

}  // namespace bmu::test
