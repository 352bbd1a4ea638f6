#include "tests/simulation/life.hpp"

#include <algorithm>
#include <cstdio>
#include <ostream>

#include "protocol/fnv.hpp"

namespace bmu::test {

namespace {

constexpr Duration put_right_after = 1s;  // after the end of the last fault
constexpr Duration recovers_in = 25s;     // causes clear in up to 10 s, waits are 10 s, links discharge
constexpr Duration closes_in = 5s;
constexpr Duration charges_in = 12s;               // one that is commanded, by a ramp, and takes its time to follow
constexpr Duration opens_without_mains_in = 4s;    // 2.6 s of silence
constexpr Duration goes_on_in = 12s + charges_in;  // 10 s of waiting, which include the 5 s to confirm that it is back
constexpr Duration allows_in = 5s;
// Three times bus-off within a minute is a fault until that is a minute ago.
constexpr std::ptrdiff_t storm = 3;
constexpr Duration cools_in = 120s;  // an overload; seed 3023 takes nearly as long
constexpr Duration recovers_from_storm_in = 65s;

Duration recovery_time(const Plan& plan) {
  const auto is_bus_off = [](const FaultEvent& fault) { return fault.kind->name == "bus_off"; };
  const std::ptrdiff_t times = std::count_if(plan.faults.begin(), plan.faults.end(), is_bus_off);
  return times >= storm ? recovers_from_storm_in : recovers_in;
}

class Life {
 public:
  Life(const Plan& plan, const LifeOptions& options)
      : plan_(plan),
        options_(options),
        stage_(*plan.config, plan.seed, plan.devices_ahead, options.starts_at),
        oracle_(*plan.config, options.starts_at) {
    wall_clock_at_ = options.starts_at;
    connect();
    act("pack soc_permille 700");
  }

  Outcome run() {
    live_until(options_.starts_at + plan_.length + put_right_after);
    put_right();
    live_until(stage_.pack.now() + recovery_time(plan_));
    live_until_it(cools_in, [this] { return !is_overloaded(); });
    check_recovery();
    return {.violation = oracle_.violation(),
            .hash = hash_,
            .reactions = oracle_.reactions(),
            .faults = faults_,
            .lived = since_start(),
            .times_closed = oracle_.times_closed(),
            .times_opened = oracle_.times_opened()};
  }

 private:
  [[nodiscard]] Duration since_start() const { return stage_.pack.now() - options_.starts_at; }
  [[nodiscard]] bool is_over() const { return oracle_.violation().has_value(); }

  void connect() {
    stage_.pack.on_sent = [this](CanFrame& frame, const WiredPack& pack) {
      const Fate fate = stage_.wire.carry(frame);
      oracle_.note_sent(frame, pack.now());
      return fate;
    };
    stage_.pack.devices_miss = [this](const CanFrame&) { return stage_.wire.loses(); };
    stage_.pack.each_ms = [this](WiredPack& pack) {
      if (stage_.outer.is_there()) stage_.outer.tick(pack);
      oracle_.note_millisecond(stage_);
    };
    stage_.outer.on_carried = [this](const CanFrame& frame, bool is_taken_in) {
      oracle_.note_carried(frame, is_taken_in, stage_.pack.now());
    };
    stage_.pack.on_told = [this](ObservedThing& what, const WiredPack& pack) {
      oracle_.note_told(what, pack.now());
      if (options_.mutant != nullptr && options_.mutant->told) options_.mutant->told(what, pack.now());
      return true;
    };
    stage_.pack.on_decided = [this](Decisions& decisions, const WiredPack&) { note_decided(decisions); };
  }

  void note_decided(Decisions& decisions) {
    const WiredPack& pack = stage_.pack;
    View view = view_of(pack.core());
    if (options_.mutant != nullptr && options_.mutant->decided) options_.mutant->decided(decisions, stage_);
    if (options_.mutant != nullptr && options_.mutant->published) options_.mutant->published(view, pack.now());
    oracle_.note_decided(decisions, view, stage_);
    if (options_.mutant != nullptr && options_.mutant->sent) options_.mutant->sent(decisions, pack.now());
    if (stage_.outer.is_there()) stage_.outer.take_decided(decisions, stage_.pack);
    stage_.store.follow(pack.core(), pack.now());
    hash_decisions(decisions);
    if (options_.trace != nullptr) trace_events(decisions);
  }

  void hash_number(std::uint64_t number) {
    std::array<char, 8> bytes{};
    for (char& byte : bytes) {
      byte = static_cast<char>(number & 0xFFU);
      number >>= 8U;
    }
    hash_ = continue_fnv(hash_, {bytes.data(), bytes.size()});
  }

  void hash_decisions(const Decisions& decisions) {
    hash_number(static_cast<std::uint64_t>(since_start().count()));
    for (const OutgoingFrame& out : decisions.frames) {
      hash_number(out.frame.id);
      hash_ = continue_fnv(hash_, {reinterpret_cast<const char*>(out.frame.data.data()), out.frame.length});
    }
    for (const Event& event : decisions.events) hash_number(static_cast<std::uint64_t>(event.id));
  }

  void say(const std::string& text) {
    if (options_.trace == nullptr) return;
    char time[24];
    std::snprintf(time, sizeof(time), "%9.3f s  ", to_s(since_start()));
    *options_.trace << time << text << '\n';
  }
  void trace_events(const Decisions& decisions) {
    for (const Event& event : decisions.events) {
      if (row_of(event.id).severity >= Severity::info) say("  core: " + to_text(event));
    }
  }

  void act(const std::string& text) {
    if (text.empty()) return;
    stage_.pack.apply(text);
    say(text);
  }

  // --- the plan ---------------------------------------------------------------------------------------------------

  /// Executes the plan until then. A core that is stopped receives no observations: they wait for its return.
  void live_until(TimePoint end) {
    while (stage_.pack.now() < end && !is_over()) {
      take_due();
      stage_.pack.run(std::min(end, next_at()) - stage_.pack.now());
    }
  }

  [[nodiscard]] TimePoint next_at() const {
    TimePoint next = wall_clock_at_;
    if (next_drive_ < plan_.drive.size()) next = std::min(next, options_.starts_at + plan_.drive[next_drive_].at);
    if (next_fault_ < plan_.faults.size())
      next = std::min(next, options_.starts_at + plan_.faults[next_fault_].begins_at);
    for (const FaultEvent* fault : present_) next = std::min(next, options_.starts_at + fault->ends_at);
    return std::max(next, stage_.pack.now() + 1ms);
  }

  void take_due() {
    const Duration now = since_start();
    const bool is_stalled = stage_.pack.is_stalled();
    while (next_drive_ < plan_.drive.size() && plan_.drive[next_drive_].at <= now) act(plan_.drive[next_drive_++].text);
    if (is_stalled) return;
    if (stage_.pack.now() >= wall_clock_at_) {
      stage_.tell_wall_clock();
      wall_clock_at_ += 1s;
    }
    std::erase_if(present_, [this, now](const FaultEvent* fault) {
      if (fault->ends_at > now) return false;
      end(*fault);
      return true;
    });
    while (next_fault_ < plan_.faults.size() && plan_.faults[next_fault_].begins_at <= now) {
      begin(plan_.faults[next_fault_++]);
    }
  }

  void begin(const FaultEvent& fault) {
    say("fault " + std::to_string(fault.number) + " begins: " + std::string(fault.kind->name));
    oracle_.note_begin(fault, stage_);
    if (fault.kind->begin != nullptr) fault.kind->begin(stage_, fault);
    act(fault.begin_text);
    faults_.push_back(fault.kind);
    present_.push_back(&fault);
  }

  void end(const FaultEvent& fault) {
    say("fault " + std::to_string(fault.number) + " ends: " + std::string(fault.kind->name));
    const bool had_power = stage_.pack.has_power();
    if (!had_power && fault.kind->name == "power_cut") boot_noted();
    if (fault.kind->end != nullptr) fault.kind->end(stage_, fault);
    act(fault.end_text);
    oracle_.note_end(fault, stage_.pack.now());
  }

  void boot_noted() { oracle_.note_boot(stage_.store.kept(), stage_.pack.now()); }

  // --- afterwards -------------------------------------------------------------------------------------------------

  void put_right() {
    if (is_over()) return;
    if (plan_.guest == Guest::inverter) act("inverter current_A 0");
    act("vehicle off; charger disconnected; load current_A 0; charger current_A 0");
  }

  void check_recovery() {
    if (is_over()) return;
    stage_.pack.observe(CommandGiven{Command::wake});
    stage_.pack.observe(CommandGiven{Command::clear_faults, Authority::service});
    live_until(stage_.pack.now() + 2s);
    act(plan_.guest == Guest::charger ? charger_at_the_end() + "; charger connected" : "vehicle on");
    live_until_it(closes_in, [this] { return stage_.pack.phase() == Phase::closed; });
    if (!is_over() && stage_.pack.phase() != Phase::closed) oracle_.note_no_recovery(why_open(), stage_.pack.now());
    if (plan_.guest == Guest::charger) check_charge();
    if (plan_.guest == Guest::inverter) check_inverter();
  }

  [[nodiscard]] bool is_overloaded() const {
    const FaultMemory& faults = stage_.pack.core().faults();
    return faults.state(FaultId::charge_overload).stage == FaultStage::active ||
           faults.state(FaultId::discharge_overload).stage == FaultStage::active;
  }

  template <class Holds>
  void live_until_it(Duration at_most, Holds holds) {
    const TimePoint end = stage_.pack.now() + at_most;
    while (stage_.pack.now() < end && !is_over() && !holds()) live_until(std::min(end, stage_.pack.now() + 50ms));
  }

  // --- guests -----------------------------------------------------------------------------------------------------

  [[nodiscard]] std::string charger_at_the_end() const {
    return "charger current_A " + std::to_string(std::max(plan_.config->current.charge_continuous_mA / 1'000, 1));
  }

  /// Whether the charger really gives most of what the pack may take, or a good part of it.
  [[nodiscard]] bool is_charging() const {
    constexpr double most = 0.6;
    constexpr double soon_A = 10.0;  // more comes by the ramp, later
    const double rating_A = std::max(plan_.config->current.charge_continuous_mA / 1'000, 1);
    const double asked_A = std::min(plan_.config->charger.current_max_mA, view_of(stage_.pack.core()).charge_mA) * 1e-3;
    const double flows_A = stage_.pack.simulator().plant().charger_A();
    return flows_A > 0.05 && flows_A >= most * std::min({rating_A, asked_A, soon_A});
  }

  void check_charge() {
    live_until_it(charges_in, [this] { return is_charging(); });
    if (is_over()) return;
    if (!is_charging()) return oracle_.note_no_recovery("does not charge: " + charge_text(), stage_.pack.now());
    if (!plan_.ends_with_mains_cut) return;
    act("charger mains off");
    live_until_it(opens_without_mains_in, [this] { return stage_.pack.phase() == Phase::open; });
    if (is_over()) return;
    if (stage_.pack.phase() != Phase::open) {
      return oracle_.note_no_recovery("does not open for a charger without mains", stage_.pack.now());
    }
    act("charger mains on");
    live_until_it(goes_on_in, [this] { return is_charging(); });
    if (is_over() || is_charging()) return;
    oracle_.note_no_recovery("does not charge on after a power cut: " + charge_text() + "; " + why_open(),
                             stage_.pack.now());
  }

  [[nodiscard]] std::string charge_text() const {
    const Core& core = stage_.pack.core();
    return std::string(to_text(core.charge_control().stage())) + ", asked for " +
           std::to_string(core.charge_control().current_mA()) + " mA of " + std::to_string(view_of(core).charge_mA) +
           " mA (" + std::string(to_text(core.limits().charge.cause)) + "), " +
           std::to_string(stage_.pack.simulator().plant().charger_A()) + " A flow";
  }

  void check_inverter() {
    const auto is_allowed = [this] {
      const BatteryReport& told = stage_.pack.simulator().world().inverter.told();
      const View view = view_of(stage_.pack.core());
      constexpr std::int32_t told_mA = 1'000;  // less may be zero in the steps of its messages
      return (told.charge_limit_mA > 0 || view.charge_mA < told_mA) &&
             (told.discharge_limit_mA > 0 || view.discharge_mA < told_mA);
    };
    live_until_it(allows_in, is_allowed);
    if (!is_over() && !is_allowed()) {
      oracle_.note_no_recovery("the inverter is not allowed anything", stage_.pack.now());
    }
  }

  [[nodiscard]] std::string why_open() const {
    std::string text = "does not close again:";
    for (const Blocker blocker : stage_.pack.core().permission().blockers)
      text += " " + std::string(to_text(blocker)) + ";";
    for (const FaultRow& row : fault_table()) {
      if (row.reaction != Reaction::warn && stage_.pack.core().faults().state(row.id).is_present()) {
        text += " " + std::string(row.name);
      }
    }
    const RefusalRecord& refusal = stage_.pack.core().last_refusal();
    if (refusal.has_happened) text += "; refused: " + std::string(to_text(refusal.blocker));
    return text;
  }

  const Plan& plan_;
  const LifeOptions& options_;
  Stage stage_;
  Oracle oracle_;
  std::uint64_t hash_ = fnv_start;
  TimePoint wall_clock_at_;
  std::size_t next_drive_ = 0;
  std::size_t next_fault_ = 0;
  std::vector<const FaultEvent*> present_;
  std::vector<const FaultKind*> faults_;
};

}  // namespace

Outcome live(const Plan& plan, const LifeOptions& options) {
  return Life(plan, options).run();
}

Plan minimise(const Plan& plan, Rule rule, const LifeOptions& options) {
  Plan least = plan;
  for (const FaultEvent& fault : plan.faults) {
    Plan fewer = least;
    std::erase_if(fewer.faults, [&fault](const FaultEvent& other) { return other.number == fault.number; });
    const Outcome outcome = live(fewer, options);
    if (outcome.violation && outcome.violation->rule == rule) least = fewer;
  }
  return least;
}

}  // namespace bmu::test
