#include "tests/bench/latency/emulated_pack.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <unistd.h>

#include "daemon/core/contactors/output_gate.hpp"
#include "daemon/shell/can/embedded_bus.hpp"
#include "protocol/tables/internal_bus.hpp"

namespace bmu::latency {

namespace {

constexpr Duration starts_within = 20s;  // allows for a busy machine
constexpr Duration key_after = 1s;       // by then all modules are known and configured
constexpr Duration closed_within = 10s;
constexpr Duration drive_min = 300ms;
constexpr Duration drive_spread = 500ms;  // drawn by lot, to cover every phase of ticks and polls
constexpr Duration answer_within = 1s;
constexpr Duration catch_up_max = 50ms;

Scenario small_link() {
  const auto scenario = parse_scenario("0 pack soc_permille 800\n0 link capacitance_uF 600\n");
  if (!scenario) throw std::logic_error("the script of the emulated pack is wrong");
  return *scenario;
}

bool is_closed_by(const CanFrame& command) {
  const ContactorOutputs outputs = outputs_of(command);
  return outputs.main_positive && outputs.main_negative && !outputs.precharge;
}

}  // namespace

EmulatedPack::EmulatedPack(std::size_t number, const PackConfig& pack, FaultChoice fault, CommandFor command,
                           const std::filesystem::path& folder, Ear& ear)
    : bus_("unix:latency-" + std::to_string(::getpid()) + "-" + std::to_string(number)),
      pack_(pack.core),
      fault_(fault),
      config_(simulator_config(pack.core)),
      command_(std::move(command)),
      folder_(folder / std::to_string(number)),
      ear_(ear),
      place_(ear.add(bus_)),
      random_(number) {
  auto port = open_bus(bus_, {});
  if (!port) throw std::runtime_error(to_text(port.error()));
  port_ = std::move(*port);
}

EmulatedPack::~EmulatedPack() {
  std::error_code ignored;
  std::filesystem::remove(embedded_bus_path(bus_.substr(5)), ignored);
}

void EmulatedPack::begin() {
  daemon_ = {};
  outcome_ = Outcome::none;
  const Ear::State ear = ear_.state(place_);
  if (ear != Ear::State::deaf && ear != Ear::State::heard) return;  // it has not been released yet
  // The persistent state of the previous session would lock this one out, too.
  std::filesystem::remove_all(folder_);
  std::filesystem::create_directories(folder_ / "black-box");
  const TimePoint now = monotonic_now();
  simulator_ = std::make_unique<Simulator>(config_, small_link(), now);
  is_commanded_ = is_closed_ = false;
  injected_.reset();
  completed_at_ = {};
  is_completed_by_time_ = false;
  daemon_ = Child(command_(bus_, folder_), log());
  enter(Stage::starting, now + starts_within);
}

void EmulatedPack::enter(Stage stage, TimePoint due) {
  due_ = due;
  stage_.store(stage, std::memory_order_release);
}

void EmulatedPack::end(Outcome outcome) {
  outcome_ = outcome;
  const Ear::State ear = ear_.state(place_);
  if (ear == Ear::State::asked || ear == Ear::State::listening) ear_.release(place_);
  enter(Stage::waiting, {});
}

void EmulatedPack::step(TimePoint now) {
  const bool is_living = !is_waiting();
  read_frames(is_living);
  if (!is_living) return;
  advance(now);
  follow(now);
}

void EmulatedPack::read_frames(bool is_living) {
  ReceivedFrame received;
  while (port_->read(received) == ReadStatus::frame) {
    if (!is_living) continue;
    if (received.frame.id == internal_bus::contactor_command.base_id) {
      is_commanded_ = true;
      is_closed_ = is_closed_by(received.frame);
    }
    simulator_->observe(received.frame, std::max(received.received_at, simulator_->now()));
  }
}

void EmulatedPack::advance(TimePoint now) {
  // Time in which this thread was held up is not emulated; the next frames are later by that time.
  const TimePoint until = std::max(simulator_->now(), std::min(now, simulator_->now() + catch_up_max));
  for (const SentFrame& sent : simulator_->advance(until)) {
    if (injected_) {
      const TimePoint written_at = exact_now();
      const InjectedFault::Effect effect = injected_->effect_of(sent.frame, written_at);
      if (effect == InjectedFault::Effect::completes) completed_at_ = written_at;
      if (effect == InjectedFault::Effect::completes_too_soon) is_completed_by_time_ = true;
    }
    static_cast<void>(port_->send(sent.frame));
  }
}

void EmulatedPack::follow(TimePoint now) {
  switch (stage_.load(std::memory_order_relaxed)) {
    case Stage::waiting: break;
    case Stage::starting:
      if (is_commanded_) {
        enter(Stage::settling, now + key_after);
      } else if (now > due_) {
        end(Outcome::never_closed);
      }
      break;
    case Stage::settling:
      if (now < due_) break;
      apply("vehicle on");
      enter(Stage::closing, now + closed_within);
      break;
    case Stage::closing:
      if (is_closed_) {
        const auto by_lot = Duration{static_cast<std::int64_t>(random_.next() % std::uint64_t{drive_spread.count()})};
        enter(Stage::closed, now + drive_min + by_lot);
      } else if (now > due_) {
        end(Outcome::never_closed);
      }
      break;
    case Stage::closed:
    case Stage::asking: inject_when_due(now); break;
    case Stage::injected: look_for_answer(now); break;
  }
}

void EmulatedPack::inject_when_due(TimePoint now) {
  if (!is_closed_) return end(Outcome::opened_by_itself);
  if (now < due_) return;
  if (stage_ == Stage::closed) {
    ear_.listen(place_);
    enter(Stage::asking, now);
  } else if (ear_.state(place_) == Ear::State::listening) {
    injected_.emplace(fault_, pack_, random_);
    apply(injected_->event().c_str());
    enter(Stage::injected, now + answer_within);
  }
}

void EmulatedPack::look_for_answer(TimePoint now) {
  if (ear_.state(place_) == Ear::State::heard) {
    if (is_completed_by_time_) return end(Outcome::completed_by_time);
    const bool is_answer = completed_at_ != TimePoint{} && ear_.heard_at(place_) > completed_at_;
    took_ = ear_.heard_at(place_) - completed_at_;
    return end(is_answer ? Outcome::measured : Outcome::opened_by_itself);
  }
  if (now > due_) end(Outcome::no_answer);
}

void EmulatedPack::apply(const char* event) {
  if (!simulator_->apply(event)) throw std::logic_error(std::string("the emulated pack does not know: ") + event);
}

}  // namespace bmu::latency
