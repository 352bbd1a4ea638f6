#include "tests/bench/latency/report.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace bmu::latency {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array bucket_ends{50us, 100us, 200us, 500us, 1000us, 2000us, 5000us, 10'000us, 20'000us, 50'000us};

double to_us(Duration duration) {
  return std::chrono::duration<double, std::micro>(duration).count();
}

std::vector<Duration> sorted(std::vector<Duration> latencies) {
  std::sort(latencies.begin(), latencies.end());
  return latencies;
}

struct Bucket {
  Duration from{};
  Duration to{};  // zero: unbounded
  std::int64_t count = 0;
};

std::vector<Bucket> buckets_of(const std::vector<Duration>& latencies) {
  std::vector<Bucket> buckets;
  Duration from{};
  for (const Duration end : bucket_ends) {
    buckets.push_back({.from = from, .to = end});
    from = end;
  }
  buckets.push_back({.from = from});
  for (const Duration latency : latencies) {
    const auto* const end = std::upper_bound(bucket_ends.begin(), bucket_ends.end(), latency);
    ++buckets[static_cast<std::size_t>(end - bucket_ends.begin())].count;
  }
  return buckets;
}

std::string line(const char* format, double number) {
  std::array<char, 96> text{};
  (void)std::snprintf(text.data(), text.size(), format, number);
  return text.data();
}

}  // namespace

Duration quantile(const std::vector<Duration>& sorted_latencies, unsigned permille) {
  const std::size_t count = sorted_latencies.size();
  const std::size_t rank = (count * permille + 999) / 1000;
  return sorted_latencies[std::clamp<std::size_t>(rank, 1, count) - 1];
}

std::string to_text(const Measured& measured) {
  const std::vector<Duration> all = sorted(measured.latencies);
  std::string text = measured.fault + ", " + measured.condition + ", " + measured.pack + ", " +
                     std::to_string(measured.packs) + " packs at a time, " + std::to_string(measured.busy_loops) +
                     " busy loops: " + std::to_string(all.size()) + " openings in " + line("%.0f s\n", measured.ran_s);
  text += "  no measurement: " + std::to_string(measured.never_closed) + " never closed, " +
          std::to_string(measured.opened_by_itself) + " opened before, " + std::to_string(measured.completed_by_time) +
          " confirmed by time, " + std::to_string(measured.no_answer) + " without an answer\n";
  if (all.empty()) return text;
  text += line("  p50 %.0f us", to_us(quantile(all, 500))) + line(", p99 %.0f us", to_us(quantile(all, 990))) +
          line(", p99.9 %.0f us", to_us(quantile(all, 999))) + line(", max %.0f us\n", to_us(all.back()));
  for (const Bucket& bucket : buckets_of(all)) {
    const std::string end = bucket.to == Duration{} ? "       more" : line("below %5.0f", to_us(bucket.to));
    text += "  " + end + " us " + line("%6.0f\n", static_cast<double>(bucket.count));
  }
  return text;
}

std::string to_json(const Measured& measured) {
  const std::vector<Duration> all = sorted(measured.latencies);
  Json json{{"fault", measured.fault},
            {"condition", measured.condition},
            {"pack", measured.pack},
            {"packs", measured.packs},
            {"busy_loops", measured.busy_loops},
            {"ran_s", measured.ran_s},
            {"openings", all.size()},
            {"never_closed", measured.never_closed},
            {"opened_before", measured.opened_by_itself},
            {"confirmed_by_time", measured.completed_by_time},
            {"no_answer", measured.no_answer}};
  if (!all.empty()) {
    json["p50_us"] = to_us(quantile(all, 500));
    json["p99_us"] = to_us(quantile(all, 990));
    json["p999_us"] = to_us(quantile(all, 999));
    json["max_us"] = to_us(all.back());
  }
  Json buckets = Json::array();
  for (const Bucket& bucket : buckets_of(all)) {
    const Json end = bucket.to == Duration{} ? Json(nullptr) : Json(to_us(bucket.to));
    buckets.push_back({{"from_us", to_us(bucket.from)}, {"below_us", end}, {"count", bucket.count}});
  }
  json["buckets"] = buckets;
  return json.dump() + "\n";
}

}  // namespace bmu::latency
