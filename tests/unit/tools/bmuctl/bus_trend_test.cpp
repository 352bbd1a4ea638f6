// Load and errors of the buses, from one update to the next.
#include "tools/bmuctl/bus_trend.hpp"

#include <cstdint>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/support/catch.hpp"

namespace bmu {

namespace {

using Json = nlohmann::json;

/// 25 % of 500 kbit/s at 125 bits a millisecond.
Json status_at(int uptime_ms, int late = 0) {
  const Json internal{{"port", "internal"},
                      {"bus", "can0"},
                      {"state", "up"},
                      {"bits_seen", uptime_ms * 125},
                      {"error_frames", 0},
                      {"frames_lost", 0},
                      {"rate_bit_per_s", nullptr},
                      {"rate_planned_bit_per_s", 500'000}};
  const Json vehicle{{"port", "vehicle"},         {"bus", "can1"},    {"state", "down"}, {"bits_seen", uptime_ms * 10},
                     {"rate_bit_per_s", nullptr}, {"sends_failed", 3}};
  return {{"daemon", {{"uptime_ms", uptime_ms}}},
          {"ports", {internal, vehicle}},
          {"modules", {{{"answers_missed", 2}}, {{"answers_missed", 5}}}},
          {"receive", {{"rejected", late}, {"rejected_by_reason", {{"late", late}, {"wrong crc", 0}}}}}};
}

std::string text_of(const Line& line) {
  std::string text;
  for (const Span& span : line) text += span.text;
  return text;
}

}  // namespace

TEST_CASE("the load is told against the bit rate, and without one in bits", "[unit][bmuctl]") {
  BusTrend trend;
  Json status = status_at(1'000);
  trend.take(Reply(status));
  CHECK_FALSE(trend.bit_per_s(0));
  CHECK(text_of(trend.lines(Reply(status))[0]) == " can0 up  load --  errors 0  lost 0  late 0  missed 7  bad CRC 0");
  status = status_at(2'000, 4);
  trend.take(Reply(status));
  CHECK(trend.bit_per_s(0) == 125'000);
  CHECK(text_of(trend.lines(Reply(status))[0]) ==
        " can0 up  load 25 %  errors 0  lost 0  late 4  missed 7  bad CRC 0  refused 4");
  CHECK(text_of(trend.lines(Reply(status))[1]) == " can1 down  load 10 kbit/s  errors 0  lost 0  unsent 3");
}

TEST_CASE("a number that no daemon counts to is not known", "[unit][bmuctl]") {
  constexpr std::int64_t most = Reply::number_max;
  for (const std::int64_t number : {std::int64_t{0}, most, -most}) CHECK(Reply(Json(number)).number() == number);
  for (const Json& number : {Json(most + 1), Json(-most - 1), Json(INT64_MAX), Json(INT64_MIN), Json(UINT64_MAX)}) {
    CHECK_FALSE(Reply(number).number());
  }
  Json status = status_at(1'000);
  for (Json& module : status["modules"]) module["answers_missed"] = INT64_MAX;
  BusTrend trend;
  trend.take(Reply(status));
  CHECK(text_of(trend.lines(Reply(status))[0]).find("missed 0") != std::string::npos);
}

TEST_CASE("the load is that of the last two seconds", "[unit][bmuctl]") {
  BusTrend trend;
  for (int uptime_ms = 0; uptime_ms <= 8'000; uptime_ms += 500) {
    Json status = status_at(uptime_ms);
    status["ports"][0]["bits_seen"] = uptime_ms <= 6'000 ? 0 : (uptime_ms - 6'000) * 100;
    trend.take(Reply(status));
  }
  CHECK(trend.bit_per_s(0) == 100'000);
}

TEST_CASE("a counter that has grown lately stands out, one that stands still does not", "[unit][bmuctl]") {
  BusTrend trend;
  for (int uptime_ms = 0; uptime_ms <= 20'000; uptime_ms += 1'000) {
    const Json status = status_at(uptime_ms, uptime_ms >= 5'000 ? 1 : 0);
    trend.take(Reply(status));
    CHECK(trend.has_grown(0, "late") == (uptime_ms >= 5'000 && uptime_ms < 15'000));
    CHECK_FALSE(trend.has_grown(0, "missed"));
    CHECK_FALSE(trend.has_grown(1, "unsent"));
  }
}

TEST_CASE("a daemon that has started anew begins a new trend", "[unit][bmuctl]") {
  BusTrend trend;
  for (const int uptime_ms : {10'000, 11'000, 500}) {
    const Json status = status_at(uptime_ms);
    trend.take(Reply(status));
  }
  CHECK_FALSE(trend.bit_per_s(0));
}

}  // namespace bmu
