#include "tests/catalogue/catalogue.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <utility>

#include "tests/catalogue/page.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu::test {

Act script(std::string_view events) {
  return [events](WiredPack& pack) { pack.apply(events); };
}

// --- rows and packs -------------------------------------------------------------------------------------------------

namespace {

std::vector<const Row*>& registry() {
  static std::vector<const Row*> rows;
  return rows;
}

}  // namespace

Registered::Registered(Row wanted) : row(std::move(wanted)) {
  auto& rows = registry();
  const auto after = std::upper_bound(rows.begin(), rows.end(), row.number,
                                      [](int number, const Row* one) { return number < one->number; });
  rows.insert(after, &row);
}

const std::vector<const Row*>& all_rows() {
  return registry();
}

const std::vector<Pack>& packs() {
  static const std::vector<Pack> both = [] {
    std::vector<Pack> made{{"2 x 4", small_pack()}, {"16 x 12", pack_of(16)}};
    // The emulated charger and insulation monitor use the voltage of the full pack.
    for (Pack& pack : made) pack.config.cell.voltage_max_uV = 4'250'000;
    // An undertemperature lets the current fall first, so it is confirmed a little sooner.
    for (Pack& pack : made) pack.config.limits.cell_undertemperature.confirm = 100ms;
    return made;
  }();
  return both;
}

const FaultRow* find_fault(std::string_view name) {
  const auto& table = fault_table();
  const auto* const row =
      std::find_if(table.begin(), table.end(), [name](const FaultRow& one) { return one.name == name; });
  return row == table.end() ? nullptr : row;
}

bool is_present(const WiredPack& pack, std::string_view fault) {
  const FaultRow* row = find_fault(fault);
  return row != nullptr && pack.core().faults().state(row->id).is_present();
}

bool is_open(const WiredPack& pack, Until until) {
  switch (until) {
    case Until::command: return !pack.commanded().any_contactor();
    case Until::decision: return !pack.core().outputs().any_contactor();
    case Until::coils: return !pack.coils_are_driven();
    case Until::charge: return !pack.commanded().charge;
    case Until::told: break;  // independent of contactors
  }
  return false;
}

CoreConfig config_for(const Case& one, const Pack& pack) {
  CoreConfig config = pack.config;
  if (one.fit != nullptr) one.fit(config);
  return config;
}

std::string ms_text(Duration duration) {
  return std::to_string(std::chrono::ceil<std::chrono::milliseconds>(duration).count());
}

namespace {

/// Time by which the devices are ahead of the master when it starts: they share no clock.
constexpr std::array<Duration, 3> ways_to_stand{0us, 4'300us, 433'700us};

/// A pack ready to close; made once for each name, file, fitting and `devices_ahead`. The insulation monitor needs 2 s
/// to its first value.
const WiredPack& ready_pack(const Pack& pack, Fitting fit, Duration devices_ahead) {
  struct Ready {
    std::string name;
    std::uint64_t hash;  // of the pack's file
    Fitting fit;
    Duration devices_ahead;
    WiredPack world;
  };
  static std::deque<Ready> all;
  for (const Ready& one : all) {
    const bool is_pack = one.name == pack.name && one.hash == pack.config.hash;
    if (is_pack && one.fit == fit && one.devices_ahead == devices_ahead) return one.world;
  }
  WiredPack fresh(config_for({.fit = fit}, pack), devices_ahead);
  fresh.run(2500ms);
  return all.emplace_back(Ready{std::string(pack.name), pack.config.hash, fit, devices_ahead, std::move(fresh)}).world;
}

bool some_contactor_is_commanded(const WiredPack& pack) {
  return pack.commanded().any_contactor();
}

bool reaches(WiredPack& pack, Phase phase) {
  return pack.run_until([phase](const WiredPack& one) { return one.phase() == phase; }, 5s);
}

}  // namespace

WiredPack closed_pack(const Pack& pack) {
  WiredPack closed = ready_pack(pack, nullptr, ways_to_stand[0]);
  closed.apply("vehicle on");
  REQUIRE(reaches(closed, Phase::closed));
  closed.run(500ms);
  return closed;
}

// --- one case on one pack -------------------------------------------------------------------------------------------

namespace {

/// Long enough to see by how much a reaction comes too late.
constexpr Duration patience = 80s;
/// A pack that must stay closed is watched for this long: longer than any age, confirm time and grace together.
constexpr Duration watched_closed = 1500ms;
/// A pack that must not close is watched for this long: a healthy pack would have closed.
constexpr Duration watched_open = 3s;

struct Trial {
  Duration shift{};
  std::optional<Duration> took;
  std::string what_is_wrong;
};

/// The packs of all trials of a case, one after the other: each a little later than the last.
class Moments {
 public:
  Moments(const Case& one, const Pack& pack, Duration devices_ahead)
      : case_(&one), base_(ready_pack(pack, one.fit, devices_ahead)) {
    if (one.prepare) one.prepare(base_);
    if (one.in_phase != Phase::closed) return;
    base_.apply(one.switch_on);
    is_there_ = reaches(base_, Phase::closed);
    base_.run(500ms);
  }

  /// False once the span is over.
  [[nodiscard]] bool has_next() const { return shift_ < case_->span; }
  [[nodiscard]] Duration shift() const { return shift_; }
  /// The pack for the next trial, before its fault; none if it does not reach the phase of the case.
  [[nodiscard]] std::optional<WiredPack> next() {
    WiredPack pack = base_;
    base_.run(case_->step);
    shift_ += case_->step;
    if (case_->in_phase == Phase::closed) return is_there_ ? std::optional(std::move(pack)) : std::nullopt;
    if (case_->in_phase == Phase::open) return pack;
    pack.apply(case_->switch_on);
    const bool is_asked_for = reaches(pack, case_->in_phase) && pack.run_until(some_contactor_is_commanded, 50ms);
    return is_asked_for ? std::optional(std::move(pack)) : std::nullopt;
  }

 private:
  const Case* case_;
  WiredPack base_;
  Duration shift_{};
  bool is_there_ = true;
};

std::string opening_fault(const WiredPack& pack) {
  for (const FaultRow& row : fault_table()) {
    if (row.reaction != bmu::Reaction::warn && is_present(pack, row.name)) return std::string(row.name);
  }
  return "";
}

bool is_as_wanted(const Case& one, const WiredPack& pack) {
  constexpr std::array silences{"module_lost", "pdu_lost", "current_sensor_lost", "voltage_sensor_lost",
                                "command_not_on_bus"};
  const bool is_silence =
      std::any_of(silences.begin(), silences.end(), [&](auto name) { return is_present(pack, name); });
  return is_present(pack, one.fault) || is_present(pack, one.or_fault) || (one.or_any_silence && is_silence);
}

std::string judge(const Case& one, const WiredPack& pack) {
  if (one.fault.empty()) {
    const std::string found = opening_fault(pack);
    if (!found.empty()) return "the fault " + found + " is present";
  } else if (find_fault(one.fault) == nullptr) {
    return "there is no fault " + std::string(one.fault);
  } else if (!is_as_wanted(one, pack)) {
    return "the fault " + std::string(one.fault) + " is not present, but '" + opening_fault(pack) + "'";
  }
  if (one.holds && !one.holds(pack)) return "what else must hold does not";
  return "";
}

/// Whether the measured time has ended.
bool is_over(const Case& one, const WiredPack& pack) {
  return one.until == Until::told ? is_present(pack, one.fault) : is_open(pack, one.until);
}

Trial try_opening(const Case& one, WiredPack& pack) {
  Trial trial;
  const TimePoint broken_at = pack.now();
  if (one.inject) one.inject(pack);
  const bool is_opened = pack.run_until([&one](const WiredPack& now) { return is_over(one, now); }, patience);
  if (is_opened) trial.took = pack.now() - broken_at;
  pack.run(50ms);
  trial.what_is_wrong = is_opened ? judge(one, pack) : "it does not open";
  return trial;
}

Trial try_staying(const Case& one, WiredPack& pack) {
  if (one.inject) one.inject(pack);
  const bool is_opened =
      pack.run_until([](const WiredPack& now) { return is_open(now, Until::decision); }, watched_closed);
  return {.what_is_wrong = is_opened ? "it opens: " + opening_fault(pack) : judge(one, pack)};
}

Trial try_closing(const Case& one, const Pack& config) {
  WiredPack pack(config_for(one, config));
  if (one.inject) one.inject(pack);
  pack.run(2500ms);
  pack.apply(one.switch_on);
  const bool is_closed = pack.run_until([](const WiredPack& now) { return now.coils_are_driven(); }, watched_open);
  return {.what_is_wrong = is_closed ? "it closes" : judge(one, pack)};
}

struct Measured {
  std::optional<Duration> worst;
  std::vector<Trial> wrong;
};

Measured measure(const Case& one, const Pack& config) {
  Measured result;
  const auto note = [&result](Trial trial) {
    if (trial.took) result.worst = std::max(result.worst.value_or(Duration{}), *trial.took);
    if (!trial.what_is_wrong.empty()) result.wrong.push_back(std::move(trial));
  };
  if (one.outcome == Outcome::never_closes) {
    note(try_closing(one, config));
    return result;
  }
  for (const Duration devices_ahead : ways_to_stand) {
    Moments moments(one, config, devices_ahead);
    while (moments.has_next()) {
      const Duration shift = moments.shift();
      std::optional<WiredPack> pack = moments.next();
      Trial trial{.what_is_wrong = "it never gets as far"};
      if (pack) trial = one.outcome == Outcome::opens ? try_opening(one, *pack) : try_staying(one, *pack);
      trial.shift = shift;
      note(std::move(trial));
    }
  }
  return result;
}

// --- the way back ---------------------------------------------------------------------------------------------------

bool closes_within(WiredPack& pack, Duration duration) {
  return pack.run_until([](const WiredPack& now) { return now.phase() == Phase::closed; }, duration);
}

void turn_key(const Case& one, WiredPack& pack) {
  pack.apply(one.switch_off);
  pack.run(200ms);
  pack.apply(one.switch_on);
}

bool stays_open(WiredPack& pack, Duration duration) {
  return !pack.run_until([](const WiredPack& now) { return now.core().outputs().any_contactor(); }, duration);
}

bool any_latching_fault(const WiredPack& pack) {
  const auto& table = fault_table();
  return std::any_of(table.begin(), table.end(), [&](const FaultRow& row) {
    return row.reaction != bmu::Reaction::warn && row.latch != Latch::none && is_present(pack, row.name);
  });
}

/// Clears as an operator who has inspected the pack.
void clear_with_authority(WiredPack& pack) {
  pack.observe(CommandGiven{.command = Command::clear_faults, .authority = Authority::service});
}

/// After an opening. A pack with a latched fault closes only after its cause has ended, a clear, and a new request, in
/// this order.
void check_way_back(const Case& one, const Pack& config) {
  std::optional<WiredPack> trial = pack_in(one, config);
  REQUIRE(trial);
  WiredPack& pack = *trial;
  if (one.inject) one.inject(pack);
  REQUIRE(pack.run_until([&one](const WiredPack& now) { return is_over(one, now); }, patience));
  pack.run(500ms);
  const bool latches = any_latching_fault(pack) || one.is_kept_by_module;
  const Latch latch = find_fault(one.fault)->latch;
  if (one.repair && one.is_seen_open) {
    CHECK(stays_open(pack, 3s));
    pack.give(Command::clear_faults);
    CHECK(stays_open(pack, 11s));
    CHECK(is_present(pack, one.fault));  // clearing has no effect while the cause is present
    turn_key(one, pack);
    CHECK(stays_open(pack, 3s));
  }
  if (one.repair) one.repair(pack);
  CHECK(stays_open(pack, 13s));  // nothing closes without a request
  turn_key(one, pack);
  CHECK(stays_open(pack, 3s) == latches);
  if (!latches) return;
  if (latch != Latch::none) CHECK(is_present(pack, one.fault));
  pack.give(Command::clear_faults);
  CHECK(stays_open(pack, 2s));                                               // the request is older than the clear
  if (latch == Latch::until_authorised) CHECK(is_present(pack, one.fault));  // the pack was not inspected
  clear_with_authority(pack);
  pack.run(500ms);
  CHECK_FALSE(is_present(pack, one.fault));
  turn_key(one, pack);
  const bool is_closed = closes_within(pack, 5s);
  INFO("still there: '" << opening_fault(pack) << "'");
  CHECK(is_closed);
}

// --- lines of the page ----------------------------------------------------------------------------------------------

std::string reaction_text(const Case& one) {
  std::string fault = one.fault.empty() ? "" : "`" + std::string(one.fault) + "`";
  if (!one.or_fault.empty()) fault += " or `" + std::string(one.or_fault) + "`";
  if (one.or_any_silence) fault += " or who else is missed";
  switch (one.outcome) {
    case Outcome::opens:
      if (one.until == Until::decision) return "decides to open: " + fault;
      if (one.until == Until::coils) return "the unit opens by itself; " + fault;
      if (one.until == Until::charge) return "opens the charge contactor: " + fault;
      if (one.until == Until::told) return "is told: " + fault;
      return fault.empty() ? "opens" : "opens: " + fault;
    case Outcome::stays_closed: return fault.empty() ? "stays closed" : "stays closed, warns: " + fault;
    case Outcome::never_closes: return fault.empty() ? "does not close" : "does not close: " + fault;
  }
  return "";
}

std::string line_begin(const Row& row, const Case& one) {
  const std::string allowed = one.outcome == Outcome::opens && row.allowed > Duration{} ? ms_text(row.allowed) : "";
  return page_line_begin(row.number, one.what) + reaction_text(one) + " | " + allowed + " |";
}

std::string configured_text(const Case& one, const Pack& pack) {
  const FaultRow* fault = find_fault(one.fault);
  if (one.configured == nullptr || fault == nullptr) return "";
  return ms_text(one.configured(config_for(one, pack), *fault));
}

std::string line_of(const Row& row, const Case& one, const std::vector<Measured>& measured) {
  std::string line = line_begin(row, one);
  for (std::size_t index = 0; index < packs().size(); ++index) {
    line += " " + configured_text(one, packs()[index]) + " | ";
    line += !row.state.empty() ? row.state : one.outcome != Outcome::opens ? "held" : ms_text(*measured[index].worst);
    line += " |";
  }
  return line;
}

void check_case(const Row& row, const Case& one) {
  INFO("F" << row.number << ", " << one.what);
  std::vector<Measured> measured;
  for (const Pack& pack : packs()) {
    INFO("pack of " << pack.name);
    measured.push_back(measure(one, pack));
    const Measured& found = measured.back();
    for (const Trial& trial : found.wrong) {
      INFO("shifted by " << ms_text(trial.shift) << " ms: " << trial.what_is_wrong);
      CHECK(trial.what_is_wrong.empty());
      break;  // one is enough; the others are alike
    }
    if (one.outcome != Outcome::opens) continue;
    REQUIRE(found.worst);
    INFO("worst " << ms_text(*found.worst) << " ms, allowed " << ms_text(row.allowed) << " ms");
    CHECK(*found.worst <= row.allowed);
    const FaultRow* fault = find_fault(one.fault);
    if (fault == nullptr || one.configured == nullptr) continue;
    INFO("configured " << ms_text(one.configured(config_for(one, pack), *fault)) << " ms");
    CHECK(*found.worst <= one.configured(config_for(one, pack), *fault));
  }
  if (one.outcome == Outcome::opens && one.has_way_back && find_fault(one.fault) != nullptr) {
    check_way_back(one, packs().front());
  }
  if (is_rewriting()) return;
  const std::string line = line_of(row, one, measured);
  INFO("to write docs/reaction-times.md anew: BMUD_REWRITE=1 test_catalogue \"[docs]\"");
  CHECK(committed_line(row.number, one.what) == line);
}

}  // namespace

void check_row(const Row& row) {
  for (const Case& one : row.cases) check_case(row, one);
}

std::optional<Duration> worst_time(const Case& one, const Pack& pack) {
  const Measured found = measure(one, pack);
  for (const Trial& trial : found.wrong) {
    INFO(one.what << ", shifted by " << ms_text(trial.shift) << " ms: " << trial.what_is_wrong);
    CHECK(trial.what_is_wrong.empty());
  }
  return found.worst;
}

std::optional<WiredPack> pack_in(const Case& one, const Pack& pack) {
  return Moments(one, pack, ways_to_stand[0]).next();
}

std::vector<std::string> measured_lines(const Row& row) {
  std::vector<std::string> lines;
  for (const Case& one : row.cases) {
    std::vector<Measured> measured;
    for (const Pack& pack : packs()) {
      measured.push_back(row.state.empty() ? measure(one, pack) : Measured{});
    }
    lines.push_back(line_of(row, one, measured));
  }
  return lines;
}

}  // namespace bmu::test
