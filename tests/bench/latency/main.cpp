// daemon_latency: latency of the daemon from the frame that completes a fault's confirmation to the contactor command
// that opens, on a machine under full processor load (docs/performance.md). injected_fault.hpp: the faults, and which
// frame completes their confirmation.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "daemon/shell/cli/command_line.hpp"
#include "tests/bench/latency/emulated_pack.hpp"
#include "tests/bench/latency/injected_fault.hpp"
#include "tests/bench/latency/reference.hpp"
#include "tests/bench/latency/report.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/temporary_folder.hpp"

namespace bmu::latency {
namespace {

// Above the daemons' priority: a delay here would be attributed to them.
constexpr int ear_priority = 90;
constexpr int emulator_priority = 80;
constexpr int daemon_priority = 50;
constexpr int exit_no_right = 77;  // missing right to the priorities: ctest then skips
constexpr Duration look_every = 10ms;

struct Options {
  std::string program = test::in_build("bin/bmud");
  std::string pack = "demo-48s";
  std::vector<FaultChoice> faults;  // empty: all
  std::size_t openings = 2000;
  unsigned packs = 12;
  unsigned busy_per_core = 2;
  double seconds = 3600.0;
  int nice = -15;  // as in the service's unit
  bool is_real_time = false;
  bool is_reference = false;
  std::string answer_on;  // this process is the reference, on this bus
  RealTimeWishes wishes;  // of the reference
  bool is_json = false;
};

/// Steps one pack after the other, so that each is stepped once a millisecond and none waits for all others.
class Emulator {
 public:
  explicit Emulator(std::vector<std::unique_ptr<EmulatedPack>>& packs) : packs_(packs) {
    thread_ = std::thread([this] {
      take_priority(emulator_priority);
      run();
    });
  }
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;
  ~Emulator() {
    is_over_ = true;
    thread_.join();
  }

 private:
  void run() {
    const OwnedFd timer(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC));
    const auto period_ns = static_cast<long>(1'000'000 / packs_.size());
    const itimerspec period{.it_interval = {.tv_nsec = period_ns}, .it_value = {.tv_nsec = period_ns}};
    ::timerfd_settime(timer.get(), 0, &period, nullptr);
    for (std::size_t next = 0; !is_over_;) {
      std::uint64_t expired = 0;
      if (::read(timer.get(), &expired, sizeof expired) != sizeof expired) continue;
      for (std::uint64_t turn = 0; turn < std::min<std::uint64_t>(expired, packs_.size()); ++turn) {
        packs_[next]->step(monotonic_now());
        next = (next + 1) % packs_.size();
      }
    }
  }

  std::vector<std::unique_ptr<EmulatedPack>>& packs_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// Checked in this thread, which can report a failure; the measuring threads cannot.
void check_right() {
  take_priority(ear_priority);
  const sched_param ordinary{};
  ::sched_setscheduler(0, SCHED_OTHER, &ordinary);
}

void tell_progress(const Measured& measured, std::size_t wanted) {
  static std::size_t told = 0;
  if (measured.latencies.empty()) told = 0;
  const bool is_terminal = ::isatty(STDERR_FILENO) != 0;
  const std::size_t step = is_terminal ? 1 : std::max<std::size_t>(wanted / 10, 1);
  if (measured.latencies.size() / step == told) return;
  told = measured.latencies.size() / step;
  std::fprintf(stderr, "%s%zu of %zu openings%s", is_terminal ? "\r" : "", measured.latencies.size(), wanted,
               is_terminal ? "" : "\n");
}

void count(const EmulatedPack& pack, Measured& measured) {
  switch (pack.outcome()) {
    case Outcome::none: return;
    case Outcome::measured: return measured.latencies.push_back(pack.took());
    case Outcome::never_closed: ++measured.never_closed; break;
    case Outcome::opened_by_itself: ++measured.opened_by_itself; break;
    case Outcome::completed_by_time: ++measured.completed_by_time; break;
    case Outcome::no_answer: ++measured.no_answer; break;
  }
}

/// A daemon that cannot start never yields a measurement.
void check_worth(const Measured& measured, const EmulatedPack& pack) {
  constexpr std::uint64_t vain_max = 30;
  const std::uint64_t vain =
      measured.never_closed + measured.opened_by_itself + measured.completed_by_time + measured.no_answer;
  if (vain < vain_max || vain < 2 * measured.latencies.size()) return;
  throw std::runtime_error(measured.fault + ": no measurement in " + std::to_string(vain) +
                           " sessions: " + std::to_string(measured.never_closed) + " never closed, " +
                           std::to_string(measured.opened_by_itself) + " opened before, " +
                           std::to_string(measured.completed_by_time) + " confirmed by time, " +
                           std::to_string(measured.no_answer) + " without an answer; last log: " + pack.log());
}

/// An interrupt must also end the processes on the buses.
std::atomic<bool> is_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void measure_packs(const Options& options, std::vector<std::unique_ptr<EmulatedPack>>& packs, Measured& measured) {
  const TimePoint began_at = monotonic_now();
  const auto is_over = [&] {
    return is_interrupted || measured.latencies.size() >= options.openings ||
           to_s(monotonic_now() - began_at) >= options.seconds;
  };
  while (!is_over()) {
    for (const auto& pack : packs) {
      if (!pack->is_waiting()) continue;
      count(*pack, measured);
      check_worth(measured, *pack);
      tell_progress(measured, options.openings);
      pack->begin();
    }
    std::this_thread::sleep_for(look_every);
  }
  measured.ran_s = to_s(monotonic_now() - began_at);
}

std::string condition_of(const Options& options) {
  const std::string who = options.is_reference ? "reference" : "bmud";
  return who + (options.is_real_time ? ", real-time priority, memory locked"
                                     : ", ordinary priority, nice " + std::to_string(options.nice));
}

CommandFor command_of(const Options& options, const std::string& pack) {
  return [options, pack](const std::string& bus, const std::filesystem::path& folder) {
    const auto in = [&folder](const char* name) { return (folder / name).string(); };
    // As in the service's unit: the value is of the first thread, the loop; threads that it starts have nice 0.
    std::vector<std::string> words{
        "/usr/bin/chrt", "--reset-on-fork", "--other", "0", "/usr/bin/nice", "-n", std::to_string(options.nice)};
    if (options.is_reference) {
      words.insert(words.end(), {std::filesystem::read_symlink("/proc/self/exe"), "--answer-on", bus});
    } else {
      words.insert(words.end(), {options.program, "--config", pack, "--bus-internal", bus, "--bus-vehicle", bus,
                                 "--socket", in("bmud.sock"), "--state", in("state.json"), "--history",
                                 in("history.sqlite"), "--black-box", in("black-box")});
    }
    if (options.is_real_time) {
      const std::string priority = std::to_string(daemon_priority);
      words.insert(words.end(), {"--realtime-priority", priority, "--lock-memory"});
    }
    return words;
  };
}

/// A pack file, or the name of one in config/packs.
std::string pack_file(const std::string& pack) {
  const std::string shipped = test::in_source("config/packs/" + pack + ".json");
  return !std::filesystem::exists(pack) && std::filesystem::exists(shipped) ? shipped : pack;
}

Measured measure(const Options& options, FaultChoice fault) {
  const TemporaryFolder folder;
  const std::string file = pack_for(fault, pack_file(options.pack), folder.path());
  const auto pack_config = load_pack_config(file);
  if (!pack_config) throw std::runtime_error(to_text(pack_config.error().front()));
  const unsigned cores = std::max(std::thread::hardware_concurrency(), 1U);
  Measured measured{.condition = condition_of(options),
                    .pack = pack_config->name,
                    .fault = std::string(to_text(fault)),
                    .packs = options.packs,
                    .busy_loops = cores * options.busy_per_core};
  const BusyLoops load(measured.busy_loops);  // before any thread is started
  Ear ear;
  std::vector<std::unique_ptr<EmulatedPack>> packs;
  for (std::size_t i = 0; i < options.packs; ++i) {
    packs.push_back(
        std::make_unique<EmulatedPack>(i, *pack_config, fault, command_of(options, file), folder.path(), ear));
  }
  ear.start(ear_priority);
  const Emulator emulator(packs);
  measure_packs(options, packs, measured);
  return measured;
}

std::map<std::string, FaultChoice> fault_names() {
  std::map<std::string, FaultChoice> names;
  for (const FaultChoice fault : all_faults) names.emplace(to_text(fault), fault);
  return names;
}

/// For the reference, which does not poll, only faults that a PDU_STATUS confirms.
std::vector<FaultChoice> faults_of(const Options& options) {
  if (!options.is_reference) {
    return options.faults.empty() ? std::vector(all_faults.begin(), all_faults.end()) : options.faults;
  }
  for (const FaultChoice fault : options.faults) {
    if (fault == FaultChoice::emergency_stop) continue;
    throw std::runtime_error("--reference: does not poll, expected --fault emergency_stop");
  }
  return {FaultChoice::emergency_stop};
}

int measure_faults(const Options& options) {
  int exit_code = exit_codes::exit_ok;
  for (const FaultChoice fault : faults_of(options)) {
    if (is_interrupted) break;
    const Measured measured = measure(options, fault);
    std::fputs((options.is_json ? to_json(measured) : to_text(measured)).c_str(), stdout);
    std::fflush(stdout);
    if (measured.latencies.empty()) exit_code = 1;
  }
  return exit_code;
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Latency from the frame that completes a fault's confirmation to the contactor command that opens: packs on "
      "buses of their own, one opening for each session of a daemon, beside processes that use up the processors. "
      "Needs the "
      "right to real-time priorities above 50.");
  app.add_option("--bmud", options.program, "The daemon's program")->capture_default_str();
  app.add_option("--pack", options.pack, "Pack file, or the name of one in config/packs; its buses are not used")
      ->capture_default_str();
  app.add_option("--fault", options.faults, "What opens; may be given more than once. Default: each of them")
      ->transform(CLI::CheckedTransformer(fault_names(), CLI::ignore_case));
  app.add_option("--openings", options.openings, "How many are measured of each fault")->capture_default_str();
  app.add_option("--packs", options.packs, "How many at a time")
      ->check(command_line::whole_number(1, 64))
      ->capture_default_str();
  app.add_option("--busy", options.busy_per_core, "Busy loops for each processor; 0: none")
      ->check(command_line::whole_number(0, 64))
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "End after this time with what there is, each fault")
      ->check(command_line::number(1, 1e6))
      ->capture_default_str();
  app.add_option("--nice", options.nice, "Of ordinary daemons; this is what the service's unit gives")
      ->check(CLI::Range(-20, 19))
      ->capture_default_str();
  app.add_flag("--real-time", options.is_real_time, "Daemons with --realtime-priority 50 --lock-memory");
  app.add_flag("--reference", options.is_reference,
               "Instead of the daemon the least program that can answer: the machine's share of it. It does not poll: "
               "emergency_stop only");
  // Options with which this program starts the reference.
  app.add_option("--answer-on", options.answer_on)->group("");
  app.add_option("--realtime-priority", options.wishes.priority)->group("");
  app.add_flag("--lock-memory", options.wishes.lock_memory)->group("");
  app.add_flag("--json", options.is_json, "The result as a line of JSON");
  try {
    app.parse(argc, argv);
    if (!options.answer_on.empty()) return answer_on(options.answer_on, options.wishes);
    check_right();
    for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { is_interrupted = true; });
    return measure_faults(options);
  } catch (const CLI::ParseError& error) {
    return command_line::report(app, error);
  } catch (const std::system_error& error) {
    std::fprintf(stderr, "daemon_latency: %s\n", error.what());
    return error.code() == std::errc::operation_not_permitted ? exit_no_right : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "daemon_latency: %s\n", error.what());
    return 1;
  }
}

}  // namespace
}  // namespace bmu::latency

int main(int argc, char** argv) {
  return bmu::latency::run(argc, argv);
}
