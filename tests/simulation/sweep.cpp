#include "tests/simulation/sweep.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <thread>

#include <nlohmann/json.hpp>

#include "protocol/fnv.hpp"

namespace bmu::test {

namespace {

class Sweep {
 public:
  Sweep(SeedRange seeds, const SweepOptions& options) : seeds_(seeds), options_(options), next_(seeds.first) {}

  SweepResult run() {
    static_cast<void>(draw_plan(seeds_.first));  // reads the packs before the threads need them
    std::vector<std::thread> threads;
    for (unsigned count = 0; count < std::max(options_.threads, 1U); ++count) {
      threads.emplace_back([this] { work(); });
    }
    for (std::thread& thread : threads) thread.join();
    std::sort(result_.failed.begin(), result_.failed.end(),
              [](const FailedSeed& one, const FailedSeed& other) { return one.seed < other.seed; });
    result_.hash = fnv_start;
    result_.had_guests = options_.has_guests;
    for (const auto& [seed, hash] : hashes_) result_.hash = (result_.hash ^ hash) * fnv_prime;
    return result_;
  }

 private:
  void work() {
    for (std::uint64_t seed = next_++; seed <= seeds_.last; seed = next_++) {
      const Plan plan = draw_plan(seed, options_.has_guests);
      const Outcome outcome = live(plan, {});
      FailedSeed failed{.seed = seed};
      if (outcome.violation) {
        failed.violation = *outcome.violation;
        if (options_.minimises) {
          for (const FaultEvent& fault : minimise(plan, outcome.violation->rule, {}).faults) {
            failed.least.push_back(fault.number);
          }
        }
      }
      const std::lock_guard lock(mutex_);
      if (outcome.violation) result_.failed.push_back(failed);
      add(seed, outcome);
    }
  }

  void add(std::uint64_t seed, const Outcome& outcome) {
    ++result_.seeds;
    result_.lived += outcome.lived;
    result_.faults += outcome.faults.size();
    result_.times_closed += outcome.times_closed;
    result_.times_opened += outcome.times_opened;
    for (const FaultKind* kind : outcome.faults) ++result_.kinds[kind->name].faults;
    for (const TimedOpening& reaction : outcome.reactions) {
      result_.kinds[reaction.kind->name].reactions.push_back(reaction.took);
    }
    hashes_[seed] = outcome.hash;
    if (options_.progress) options_.progress(result_.seeds);
  }

  SeedRange seeds_;
  const SweepOptions& options_;
  std::atomic<std::uint64_t> next_;
  std::mutex mutex_;
  SweepResult result_;
  std::map<std::uint64_t, std::uint64_t> hashes_;
};

/// Numbers of those that took at most a quarter, half, three quarters and all of the allowed time, and of those that
/// took longer, hidden by others.
std::string histogram(const FaultKind& kind, const KindCount& count) {
  constexpr std::size_t columns = 5;
  std::array<std::size_t, columns> in{};
  for (const Duration took : count.reactions) {
    const auto quarter = static_cast<std::size_t>(std::max<std::int64_t>(4 * took / kind.allowed, 0));
    ++in[std::min(quarter, columns - 1)];
  }
  std::string text;
  for (const std::size_t number : in) {
    char column[16];
    std::snprintf(column, sizeof(column), " %6zu", number);
    text += column;
  }
  return text;
}

}  // namespace

Duration KindCount::worst() const {
  return reactions.empty() ? Duration{} : *std::max_element(reactions.begin(), reactions.end());
}

SweepResult sweep(SeedRange seeds, const SweepOptions& options) {
  return Sweep(seeds, options).run();
}

std::string reproduction(std::uint64_t seed, const std::vector<std::size_t>& only, bool has_guests) {
  std::string text = "bmud_simulation --seed " + std::to_string(seed);
  for (std::size_t index = 0; index < only.size(); ++index) {
    text += (index == 0 ? " --only " : ",") + std::to_string(only[index]);
  }
  return text + (has_guests ? " --trace" : " --no-guests --trace");
}

std::string to_text(const SweepResult& result) {
  char line[200];
  std::string text;
  std::snprintf(line, sizeof(line), "%-22s %6s %6s %8s %8s   of the time allowed: 1/4    1/2    3/4      1   more\n",
                "fault", "times", "opened", "worst ms", "allowed");
  text += line;
  for (const FaultKind& kind : fault_kinds()) {
    const auto found = result.kinds.find(kind.name);
    if (found == result.kinds.end()) continue;
    const KindCount& count = found->second;
    std::snprintf(line, sizeof(line), "%-22s %6llu %6zu", std::string(kind.name).c_str(),
                  static_cast<unsigned long long>(count.faults), count.reactions.size());
    text += line;
    if (kind.allowed > Duration{} && !count.reactions.empty()) {
      std::snprintf(line, sizeof(line), " %8lld %8lld                    ",
                    static_cast<long long>(to_ms(count.worst())), static_cast<long long>(to_ms(kind.allowed)));
      text += line + histogram(kind, count);
    }
    text += "\n";
  }
  std::snprintf(line, sizeof(line), "%llu seeds, %.1f h simulated, %llu faults, %llu times closed, %llu times opened\n",
                static_cast<unsigned long long>(result.seeds), to_s(result.lived) / 3'600,
                static_cast<unsigned long long>(result.faults), static_cast<unsigned long long>(result.times_closed),
                static_cast<unsigned long long>(result.times_opened));
  text += line;
  for (const FailedSeed& failed : result.failed) {
    std::snprintf(line, sizeof(line), "FAILED at %.3f s: ", to_s(failed.violation.at));
    text += line + std::string(to_text(failed.violation.rule)) + ": " + failed.violation.text + "\n    " +
            reproduction(failed.seed, failed.least, result.had_guests) + "\n";
  }
  return text;
}

std::string to_json(const SweepResult& result) {
  using nlohmann::ordered_json;
  ordered_json kinds = ordered_json::object();
  for (const FaultKind& kind : fault_kinds()) {
    const auto found = result.kinds.find(kind.name);
    if (found == result.kinds.end()) continue;
    ordered_json& row = kinds[std::string(kind.name)];
    row["times"] = found->second.faults;
    row["opened"] = found->second.reactions.size();
    row["worst_ms"] = to_ms(found->second.worst());
    row["allowed_ms"] = to_ms(kind.allowed);
  }
  ordered_json failed = ordered_json::array();
  for (const FailedSeed& one : result.failed) {
    failed.push_back({{"seed", one.seed},
                      {"rule", to_text(one.violation.rule)},
                      {"at_ms", to_ms(one.violation.at)},
                      {"text", one.violation.text},
                      {"command", reproduction(one.seed, one.least, result.had_guests)}});
  }
  const ordered_json all{{"seeds", result.seeds},
                         {"simulated_s", to_ms(result.lived) / 1'000},
                         {"faults", result.faults},
                         {"times_closed", result.times_closed},
                         {"times_opened", result.times_opened},
                         {"decisions_hash", result.hash},
                         {"kinds", kinds},
                         {"failed", failed}};
  return all.dump(2) + "\n";
}

}  // namespace bmu::test
