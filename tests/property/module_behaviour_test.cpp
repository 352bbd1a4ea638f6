// Modules with random behaviours, several at once: the pack is never closed with a fault that has lasted for longer
// than its budget, never without a key that was turned since it opened, closes again once all is healed and cleared,
// and never bleeds a cell for long against a balancing blocker.
//
// A course is a list of moves; one that breaks a rule is reported as the shortest that still does
// (tests/support/drawn_cases.hpp).
#include <algorithm>
#include <array>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <rapidcheck.h>

#include "config/pack_config.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/drawn_cases.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/sim_run.hpp"

namespace bmu {
namespace {

using test::SimRun;

constexpr int ms_per_s = 1'000;
constexpr int electrical_ms = 450;
constexpr int temperature_ms = 950;
constexpr int module_samples_ms = 500;  // temperatures, by the module itself
constexpr int contactor_ms = 50;        // to open, after the command
constexpr int key_ms = 300;             // from turning the key off to open contactors: its report, a tick, the contacts
constexpr int stop_ms = 1'500;          // from a balancing blocker to open switches: a lost stop is repeated
constexpr int may_stay_closed = 0;

/// Whether the behaviour of a module hides its other faults from the master.
enum class Hides : std::uint8_t { nothing, values };

/// A behaviour of a module: N is its node, C a cell of it, S a sensor, M another node. At most `open_within_ms` after
/// its start the pack must have opened (the budgets of the catalogue of failures); `may_stay_because`: the reason if it
/// may stay closed.
struct Behaviour {
  std::string_view begins;
  std::string_view ends;
  int open_within_ms = may_stay_closed;
  Hides hides = Hides::nothing;
  std::string_view may_stay_because = "";
  bool is_liar = false;  // in its reports of its switches, or ignores commands for them
};
constexpr std::array behaviours{
    Behaviour{"module N silent", "module N talking", 300, Hides::values},
    Behaviour{"module N restart", "", may_stay_closed, Hides::values, "it is back within the age of its voltages"},
    // First its voltages become stale.
    Behaviour{"module N crc_errors on", "module N crc_errors off", 2 * electrical_ms, Hides::values},
    Behaviour{"module N crc_error_permille 50", "module N crc_error_permille 0", may_stay_closed, Hides::nothing,
              "the next sample comes 10 ms later; a warning"},
    Behaviour{"module N damaged_frames on", "module N damaged_frames off", electrical_ms, Hides::values},
    Behaviour{"module N stuck on", "module N stuck off", may_stay_closed, Hides::values,
              "values that stand still are no proof while no current flows"},
    Behaviour{"module N frozen_counter on", "module N frozen_counter off", electrical_ms, Hides::values},
    Behaviour{"module N replay on", "module N replay off", electrical_ms, Hides::values},
    Behaviour{"module N omits status", "module N omits nothing", electrical_ms, Hides::values},
    Behaviour{"module N omits cells", "module N omits nothing", electrical_ms, Hides::values},
    Behaviour{"module N omits temperatures", "module N omits nothing", temperature_ms, Hides::values},
    Behaviour{"module N omits ident", "module N omits nothing", may_stay_closed, Hides::values,
              "who it is was known, and it goes on measuring"},
    Behaviour{"module N delay_ms 400", "module N delay_ms 0", electrical_ms, Hides::values},
    Behaviour{"module N delay_ms 30", "module N delay_ms 0", may_stay_closed, Hides::nothing,
              "its answers are in time"},
    Behaviour{"module N sends_as_node M", "module N sends_as_node auto", electrical_ms, Hides::values},
    Behaviour{"module N cell_count 11", "module N cell_count auto", electrical_ms},
    Behaviour{"module N serial_number 77", "module N serial_number auto", may_stay_closed, Hides::nothing,
              "asked for every ten seconds, longer than a trial"},
    Behaviour{"module N protocol_version 2", "module N protocol_version auto", may_stay_closed, Hides::nothing,
              "asked for every ten seconds, longer than a trial"},
    Behaviour{"module N commands ignored", "module N commands obeyed", may_stay_closed, Hides::nothing,
              "it measures, and has its limits", true},
    Behaviour{"cell N.C balancing_switch stays_on", "cell N.C balancing_switch auto", may_stay_closed, Hides::nothing,
              "it drains a cell slowly: refused from the next closing on", true},
    Behaviour{"module N self_test failed", "module N self_test ok", electrical_ms},
    // Its CAN side has no power: it completes the minutes that were commanded before.
    Behaviour{"module N external_supply_mV 3000", "module N external_supply_mV 12000", 300, Hides::values, "", true},
    Behaviour{"module N front_end_supply_low on", "module N front_end_supply_low off", electrical_ms},
    Behaviour{"module N front_end_thermal_shutdown on", "module N front_end_thermal_shutdown off", electrical_ms},
    Behaviour{"module N board_temperature_dC 1100", "module N board_temperature_dC auto",
              2 * module_samples_ms + temperature_ms},  // a jump requires a second sample
    Behaviour{"stranger N connected", "stranger N disconnected", electrical_ms, Hides::values},
    Behaviour{"cell N.C voltage_mV 4400", "cell N.C voltage_mV auto", electrical_ms},
    Behaviour{"cell N.C voltage_mV 2500", "cell N.C voltage_mV auto", electrical_ms},
    Behaviour{"cell N.C wire open", "cell N.C wire closed", electrical_ms},
    Behaviour{"thermistor N.S state open", "thermistor N.S state ok", module_samples_ms + temperature_ms},
    Behaviour{"thermistor N.S state shorted", "thermistor N.S state ok", module_samples_ms + temperature_ms},
};
static_assert(std::all_of(behaviours.begin(), behaviours.end(), [](const Behaviour& one) {
  return (one.open_within_ms == may_stay_closed) != one.may_stay_because.empty();
}));

constexpr std::ptrdiff_t behaviours_at_once = 3;  // of one module
constexpr int wait_min_ms = 20;
constexpr int wait_max_ms = 920;
constexpr unsigned parts = 4;  // of a module, that behaviours concern

enum class Act : std::uint8_t { turn_key, end, begin };

/// The next action, and the time until the one after it. Numbers count from 0.
struct Move {
  Act act = Act::begin;
  unsigned which = 0;  // behaviour that starts, or of the active ones the one that ends
  unsigned module = 0;
  unsigned part = 0;  // cell or sensor
  int wait_ms = wait_min_ms;
};
using Course = std::vector<Move>;

std::ostream& operator<<(std::ostream& out, const Move& move) {
  static constexpr std::array acts{"turn_key", "end", "begin"};
  return out << acts[static_cast<std::size_t>(move.act)] << ' ' << move.which << ' ' << move.module << ' ' << move.part
             << ", wait " << move.wait_ms << " ms";
}

/// First without whole parts of it, then with shorter waits.
rc::Seq<Course> shorter(const Course& course) {
  const auto sooner = [](const Move& move) {
    return rc::seq::map(rc::shrink::towards(move.wait_ms, wait_min_ms), [move](int wait_ms) {
      Move changed = move;
      changed.wait_ms = wait_ms;
      return changed;
    });
  };
  return rc::seq::concat(rc::shrink::removeChunks(course), rc::shrink::eachElement(course, sooner));
}

/// Enough moves for `for_ms`, at which a course ends. With a load and a vehicle the key is turned, too.
rc::Gen<Course> courses(int for_ms, bool with_key) {
  using rc::gen::inRange;
  using rc::gen::set;
  const rc::Gen<Move> move = rc::gen::build<Move>(
      set(&Move::act,
          rc::gen::weightedElement<Act>(
              {{with_key ? std::size_t{1} : std::size_t{0}, Act::turn_key}, {2, Act::end}, {3, Act::begin}})),
      set(&Move::which, inRange(0U, static_cast<unsigned>(behaviours.size()))),
      set(&Move::module, inRange(0U, unsigned{internal_bus::node_count_max})), set(&Move::part, inRange(0U, parts)),
      set(&Move::wait_ms, inRange(wait_min_ms, wait_max_ms)));
  return [move, for_ms](const rc::Random& random, int) {
    const rc::Gen<Course> moves = rc::gen::container<Course>(static_cast<std::size_t>(for_ms / wait_min_ms), move);
    Course course = moves(random, rc::kNominalSize).value();
    int until_ms = 0;
    const auto is_late = [&](const Move& one) { return std::exchange(until_ms, until_ms + one.wait_ms) >= for_ms; };
    course.erase(std::find_if(course.begin(), course.end(), is_late), course.end());
    return rc::shrinkable::shrinkRecur(std::move(course), &shorter);
  };
}

/// An active behaviour of one module, with its start.
struct Going {
  std::size_t behaviour = 0;
  unsigned node = 1;
  std::string ends;
  int since_ms = 0;
};

class Trial {
 public:
  explicit Trial(const CoreConfig& config) : run_(config), modules_(static_cast<unsigned>(config.modules.size())) {}

  void close() {
    run_.apply("link capacitance_uF 600");
    step_to(2 * ms_per_s);
    turn_key(true);
    step_to(6 * ms_per_s);
    RC_ASSERT(is_closed());
  }
  /// Open, without a close request; of each module the named cell has more charge than the others.
  void stand(const std::vector<unsigned>& high_cells) {
    for (unsigned node = 1; node <= modules_; ++node) {
      apply(filled("cell N.C soc_permille 560", node, 1 + high_cells[node - 1], 0));
    }
    step_to(5 * ms_per_s);
  }
  /// With a load, and a key that is turned at times.
  void drive(const Course& course) {
    run_.apply("load profile drive");
    misbehave(course);
  }
  /// Starts and ends behaviours of modules.
  void misbehave(const Course& course) {
    for (const Move& move : course) {
      if (move.act == Act::turn_key) {
        turn_key(!is_key_on_);
      } else if (move.act == Act::end && !going_.empty()) {
        end(move.which % going_.size());
      } else {
        begin(move);
      }
      step_to(now_ms_ + move.wait_ms);
    }
  }
  /// Ends all behaviours; then an operator with authority clears latched faults and requests closing again.
  void heal() {
    while (!going_.empty()) end(0);
    for (int attempt = 0; attempt < 4 && !is_closed(); ++attempt) {
      step_to(now_ms_ + 15 * ms_per_s);
      turn_key(false);
      step_to(now_ms_ + 2 * ms_per_s);
      run_.give(Command::clear_faults, Authority::service);
      turn_key(true);
      step_to(now_ms_ + 15 * ms_per_s);
    }
  }
  [[nodiscard]] bool is_closed() const {
    const Plant& plant = run_.simulator().plant();
    return plant.is_closed(ContactorName::main_positive) && plant.is_closed(ContactorName::main_negative);
  }
  [[nodiscard]] const SimRun& run() const { return run_; }
  [[nodiscard]] std::string story() const { return story_; }
  [[nodiscard]] bool has_opened() const { return has_opened_; }
  [[nodiscard]] bool has_bled() const { return has_bled_; }

 private:
  [[nodiscard]] static std::string filled(std::string_view pattern, unsigned node, unsigned part, unsigned other) {
    std::string text;
    for (std::size_t at = 0; at < pattern.size(); ++at) {
      const bool is_place = at > 0 && (pattern[at - 1] == ' ' || pattern[at - 1] == '.');
      const char one = pattern[at];
      if (is_place && one == 'N') {
        text += std::to_string(node);
      } else if (is_place && one == 'M') {
        text += std::to_string(other);
      } else if (is_place && (one == 'C' || one == 'S')) {
        text += std::to_string(part);
      } else {
        text += one;
      }
    }
    return text;
  }
  void begin(const Move& move) {
    const std::size_t behaviour = move.which % behaviours.size();
    const unsigned node = 1 + move.module % modules_;
    const unsigned part = 1 + move.part;
    const unsigned other = node % modules_ + 1;
    const std::string ends = filled(behaviours[behaviour].ends, node, part, other);
    // A second one on the same property would undo the first, or its end would.
    const bool is_taken = std::any_of(going_.begin(), going_.end(),
                                      [&](const Going& one) { return one.ends == ends && one.node == node; });
    if (is_taken || count_of(node) == behaviours_at_once) return;
    apply(filled(behaviours[behaviour].begins, node, part, other));
    going_.push_back({behaviour, node, ends, now_ms_});
  }
  void end(std::size_t index) {
    const Going& one = going_[index];
    if (!one.ends.empty()) apply(one.ends);
    ended_ms_[one.node] = now_ms_;
    if (behaviours[one.behaviour].is_liar) deaf_until_ms_[one.node] = now_ms_;
    going_.erase(going_.begin() + static_cast<std::ptrdiff_t>(index));
  }
  void apply(const std::string& event) {
    story_ += std::to_string(now_ms_) + " ms: " + event + "\n";
    run_.apply(event);
  }
  void step_to(int end_ms) {
    while (now_ms_ < end_ms) {
      ++now_ms_;
      run_.run_to(now_ms_ / static_cast<double>(ms_per_s));
      judge();
    }
  }
  [[nodiscard]] std::ptrdiff_t count_of(unsigned node) const {
    return std::count_if(going_.begin(), going_.end(), [node](const Going& one) { return one.node == node; });
  }
  void turn_key(bool is_on) {
    apply(is_on ? "vehicle on" : "vehicle off");
    is_key_on_ = is_on;
    key_turned_ms_ = now_ms_;
    if (is_on) is_asked_since_opening_ = true;
  }
  /// Time after which the last of a module's behaviours must have opened the pack; 0: perhaps never, as one may hide
  /// the others.
  [[nodiscard]] int due_ms(unsigned node, const Going& what) const {
    int began_ms = what.since_ms;
    int within_ms = behaviours[what.behaviour].open_within_ms;
    for (const Going& one : going_) {
      const Behaviour& other = behaviours[one.behaviour];
      if (one.node != node || &one == &what || other.hides == Hides::nothing) continue;
      if (other.open_within_ms == may_stay_closed) return 0;
      began_ms = std::max(began_ms, one.since_ms);
      within_ms = std::max(within_ms, other.open_within_ms);
    }
    return behaviours[what.behaviour].open_within_ms == may_stay_closed ? 0 : began_ms + within_ms;
  }
  void fail(const std::string& what) const { RC_FAIL(story_ + "at " + std::to_string(now_ms_) + " ms " + what); }
  void judge() {
    judge_wish();
    judge_switches();
    const bool is_open = !is_closed();
    has_opened_ = has_opened_ || is_open;
    for (const Going& one : going_) {
      // A behaviour that has just ended may have hidden the others.
      const int due = due_ms(one.node, one);
      const bool is_over_time =
          due != 0 && now_ms_ > std::max(due, ended_ms_[one.node] + due - one.since_ms) + contactor_ms;
      if (is_open || !is_over_time) continue;
      fail("closed, " + std::to_string(now_ms_ - one.since_ms) + " ms after module " + std::to_string(one.node) +
           " began: " + std::string(behaviours[one.behaviour].begins));
    }
  }
  /// Closed only while the key is on, and only after a turn of it since the last opening.
  void judge_wish() {
    const bool is_closed_now = is_closed();
    if (is_closed_now && !is_key_on_ && now_ms_ - key_turned_ms_ > key_ms) fail("closed with the vehicle off");
    if (is_closed_now && !was_closed_ && !is_asked_since_opening_) fail("closed again, and nobody had asked anew");
    if (!is_closed_now && was_closed_) is_asked_since_opening_ = is_key_on_ && now_ms_ - key_turned_ms_ <= key_ms;
    was_closed_ = is_closed_now;
  }
  /// No switch is on for long while a blocker is active, nor beside a cell without a valid voltage.
  void judge_switches() {
    const Core& core = run_.core();
    blocked_ms_ = core.balancing().blockers() == 0 ? 0 : blocked_ms_ + 1;
    for (unsigned index = 0; index < modules_; ++index) {
      const ModuleRecord& module = core.modules().modules()[index];
      const unsigned on = run_.simulator().mmu(index).balancing_cells();
      has_bled_ = has_bled_ || on != 0;
      bool is_blind = false;
      for (std::size_t cell = 0; cell < module.config.cell_count; ++cell) {
        const bool is_on = ((on >> cell) & 1U) != 0;
        const auto& voltage_uV = module.cell_voltage_uV[cell];
        is_blind = is_blind || (is_on && !voltage_uV.is_usable(core.decided_at(), core.config().ages.cell_voltage));
      }
      blind_ms_[index] = is_blind ? blind_ms_[index] + 1 : 0;
      on_ms_[index] = on != 0 && blocked_ms_ != 0 ? on_ms_[index] + 1 : 0;
      if (is_deaf(index + 1)) continue;
      if (on_ms_[index] > stop_ms) fail("a switch of module " + std::to_string(index + 1) + " on against a reason");
      if (blind_ms_[index] > stop_ms) fail("a cell of module " + std::to_string(index + 1) + " bled unseen");
    }
  }
  /// Whether its switches do not follow commands; a behaviour that has just ended left no time for the command.
  [[nodiscard]] bool is_deaf(unsigned node) const {
    const bool was_deaf = deaf_until_ms_[node] != 0 && now_ms_ - deaf_until_ms_[node] <= stop_ms;
    return was_deaf || std::any_of(going_.begin(), going_.end(), [node](const Going& one) {
             return one.node == node && behaviours[one.behaviour].is_liar;
           });
  }

  SimRun run_;
  unsigned modules_;
  std::vector<Going> going_;
  std::string story_;
  int now_ms_ = 0;
  bool has_opened_ = false;
  bool is_key_on_ = false;
  int key_turned_ms_ = 0;
  bool was_closed_ = false;
  bool is_asked_since_opening_ = false;
  bool has_bled_ = false;
  int blocked_ms_ = 0;
  // By node; and by module.
  std::array<int, internal_bus::node_count_max + 1> ended_ms_{};
  std::array<int, internal_bus::node_count_max + 1> deaf_until_ms_{};
  std::array<int, internal_bus::node_count_max> on_ms_{};
  std::array<int, internal_bus::node_count_max> blind_ms_{};
};

CoreConfig demonstration() {
  const auto pack = load_pack_config(test::in_source("config/packs/demo-48s.json"));
  REQUIRE(pack);
  return pack->core;
}

TEST_CASE("whatever modules do, the pack is open in time, never closed unasked, and closes when all is well again",
          "[property][modules][BMS_F.3][BMU_12][slow]") {
  const CoreConfig config = demonstration();
  int opened = 0;
  const bool is_all = test::holds_for_all(100, [&] {
    const Course course = *courses(5 * ms_per_s, true);
    Trial trial(config);
    trial.close();
    trial.drive(course);
    opened += trial.has_opened() ? 1 : 0;
    trial.heal();
    if (!trial.is_closed()) RC_FAIL(trial.story() + "not closed again");
  });
  if (is_all) CHECK(opened > 0);  // otherwise nothing was tried
}

TEST_CASE("whatever modules do, no cell bleeds for long against a reason or unseen",
          "[property][modules][balancing][BMS_F.4][MMU_CB][slow]") {
  CoreConfig config = demonstration();
  config.balancing.is_enabled = true;
  config.balancing.requires_closed = false;
  config.balancing.settle = 1'000ms;
  int bled = 0;
  const bool is_all = test::holds_for_all(60, [&] {
    const auto high_cells = *rc::gen::container<std::vector<unsigned>>(
        config.modules.size(), rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0U, 12U)));
    const Course course = *courses(8 * ms_per_s, false);
    Trial trial(config);
    trial.stand(high_cells);
    trial.misbehave(course);
    bled += trial.has_bled() ? 1 : 0;
  });
  if (is_all) CHECK(bled > 0);
}

}  // namespace
}  // namespace bmu
