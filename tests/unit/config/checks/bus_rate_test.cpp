// Check of the actual bit rate of an interface against a pack file: matching, tolerated and rejected differences.
#include "config/checks/bus_rate.hpp"

#include <string>

#include "config/checks/bus_checks.hpp"
#include "config/pack_config.hpp"
#include "daemon/shell/can/rate_watch.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"
#include "tests/support/quiet_port.hpp"

namespace bmu {
namespace {

const std::string packs = test::in_source("config/packs/");

PackConfig pack_at(const std::string& file, const std::string& bus = "can0") {
  auto pack = load_pack_config(packs + file);
  REQUIRE(pack);
  pack->buses.internal = bus;
  return *pack;
}
PackConfig small() {
  return pack_at("demo-48s.json");  // 4 modules, every 100 ms: 47.4 ms at 125 kbit/s, and 71.1 with two single polls
}
PackConfig large() {
  return pack_at("traction-16x12.json");  // 16 modules, every 50 ms: 47.9 ms at 500 kbit/s, and more at 480
}

RateVerdict verdict(const PackConfig& pack, std::int64_t bit_per_s) {
  return judge_rate(pack, "pack.json", bit_per_s).verdict;
}

/// Port that provides a bit rate only.
class RatedPort final : public test::QuietPort {
 public:
  [[nodiscard]] std::uint32_t rate_bit_per_s() const override { return rate; }
  std::uint32_t rate = 0;
};

}  // namespace

TEST_CASE("a bus without a bit rate has nothing to compare, and nothing is said", "[unit][config][bus_rate]") {
  const RateFinding finding = judge_rate(small(), "pack.json", 0);
  CHECK(finding.verdict == RateVerdict::unknown);
  CHECK(finding.text.empty());
}

TEST_CASE("half a percent is no difference", "[unit][config][bus_rate]") {
  CHECK(verdict(small(), 500'000) == RateVerdict::as_wanted);
  CHECK(verdict(small(), 497'500) == RateVerdict::as_wanted);
  CHECK(verdict(small(), 497'499) == RateVerdict::differs);
  CHECK(verdict(small(), 502'500) == RateVerdict::as_wanted);
  CHECK(verdict(small(), 502'501) == RateVerdict::differs);
  CHECK(judge_rate(small(), "pack.json", 498'753).text == "can0: bitrate 498.753 kbit/s as configured");
}

TEST_CASE("a difference that fits is told with interface, found, wanted and what follows", "[unit][config][bus_rate]") {
  const RateFinding finding = judge_rate(small(), "pack.json", 125'000);
  CHECK(finding.verdict == RateVerdict::differs);
  CHECK(finding.found_bit_per_s == 125'000);
  CHECK(finding.wanted_bit_per_s == 500'000);
  CHECK(finding.text ==
        "pack.json: /buses/internal_kbit_per_s: found can0 at 125 kbit/s, expected 500 kbit/s; internal bus at 125 "
        "kbit/s: in use for up to 49 % of the time, a poll cycle takes up to 48 ms, which is sufficient, but nodes at "
        "500 kbit/s cannot communicate");
  CHECK(verdict(large(), 1'000'000) == RateVerdict::differs);
}

TEST_CASE("a bit rate that the cycle does not fit at is too slow, and says for what", "[unit][config][bus_rate]") {
  const RateFinding finding = judge_rate(large(), "pack.json", 250'000);
  CHECK(finding.verdict == RateVerdict::too_slow);
  CHECK(finding.text.find("pack.json: /buses/internal_kbit_per_s: found can0 at 250 kbit/s, expected 500 kbit/s; ") ==
        0);
  CHECK(finding.text.find("a poll cycle takes up to 85 ms, bus load too high for /poll/period_ms 50") !=
        std::string::npos);
  CHECK(verdict(small(), 999) == RateVerdict::too_slow);
  CHECK(verdict(small(), 1) == RateVerdict::too_slow);
}

TEST_CASE("the limit is where the answers stop to fit", "[unit][config][bus_rate]") {
  // 2 ms, and 2 + 144 + 20 + 4 frames of 135 bits in 50 ms: 478.1 kbit/s.
  CHECK(verdict(large(), 479'000) == RateVerdict::differs);
  CHECK(verdict(large(), 478'000) == RateVerdict::too_slow);
}

TEST_CASE("an age that has no room for a lost answer at the real rate is too slow, too", "[unit][config][bus_rate]") {
  // 2 ms, and 2 + 36 + 4 frames of 135 bits: with 47.4 ms at 125 kbit/s the age of 250 ms is just long enough.
  PackConfig pack = small();
  CHECK(verdict(pack, 119'000) == RateVerdict::differs);   // 49.6 ms
  CHECK(verdict(pack, 118'000) == RateVerdict::too_slow);  // 52.3 ms: another period of commands has begun
  CHECK(judge_rate(pack, "pack.json", 118'000).text.find("bus load too high for /ages/cell_voltage_ms 250") !=
        std::string::npos);
}

TEST_CASE("a fast pace that the file names must fit, one that it leaves out follows", "[unit][config][bus_rate]") {
  PackConfig pack = small();
  CHECK(pack.core.poll.fast_period == 50ms);
  CHECK(at_rate(pack, 125'000).core.poll.fast_period == 75ms);  // 71.1 ms with two single polls
  CHECK(at_rate(pack, 125'000).buses.internal_kbit_per_s == 125);
  CHECK(at_rate(pack, 1'000'000).core.poll.fast_period == 50ms);
  pack.poll_in_file.fast_period = pack.core.poll.fast_period;
  CHECK(verdict(pack, 125'000) == RateVerdict::too_slow);
  CHECK(judge_rate(pack, "pack.json", 125'000).text.find("bus load too high for /poll/fast_period_ms 50") !=
        std::string::npos);
  CHECK(verdict(pack, 250'000) == RateVerdict::differs);
}

TEST_CASE("each bit rate that is found is told once", "[unit][shell][bus_rate]") {
  const PackConfig pack = small();
  RateWatch watch(pack, "pack.json");
  RatedPort port;
  CHECK_FALSE(watch.update(port));
  port.rate = 500'000;
  CHECK(watch.update(port));
  CHECK(watch.severity(true) == Severity::info);
  CHECK_FALSE(watch.update(port));
  // The bit rate becomes unknown, and is then the same as before.
  port.rate = 0;
  CHECK_FALSE(watch.update(port));
  CHECK(watch.finding().verdict == RateVerdict::unknown);
  port.rate = 500'000;
  CHECK(watch.update(port));
  port.rate = 250'000;
  CHECK(watch.update(port));
  CHECK(watch.finding().verdict == RateVerdict::differs);
  CHECK(watch.severity(true) == Severity::warning);
  CHECK(watch.severity(false) == Severity::error);
  port.rate = 20'000;
  CHECK(watch.update(port));
  CHECK(watch.finding().verdict == RateVerdict::too_slow);
  CHECK(watch.severity(true) == Severity::error);
  CHECK(watch.severity(false) == Severity::error);
}

}  // namespace bmu
