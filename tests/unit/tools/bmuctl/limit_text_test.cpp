// Limit in the status and in bmuctl's text: every cause with its details.
#include "tools/bmuctl/limit_text.hpp"

#include "daemon/shell/status/why_limits.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/core_bench.hpp"

namespace bmu {

namespace {

constexpr Element cell{.module_node = 2, .number = 7, .pack_number = 19};
constexpr Element sensor{.module_node = 3, .number = 1, .pack_number = 9, .is_temperature_sensor = true};

CoreConfig config_with_fuse() {
  CoreConfig config = test::small_pack();
  PartConfig fuse;
  fuse.name.fill(' ');
  const std::string_view name = "main fuse";
  std::copy(name.begin(), name.end(), fuse.name.begin());
  config.component_limits.push_back({});
  config.component_limits.push_back(fuse);
  return config;
}

std::string reason(const CurrentLimit& limit) {
  return limit_reason(Reply(limit_json(limit, config_with_fuse())));
}

}  // namespace

TEST_CASE("a line is told with where it is zero", "[unit][limits][bmuctl]") {
  const CurrentLimit limit{.limit_mA = 40'000,
                           .cause = LimitCause::cell_voltage_low,
                           .value = 2'900'000,
                           .derates_from = 3'000'000,
                           .threshold = 2'800'000,
                           .element = cell,
                           .unhindered_mA = 80'000};
  CHECK(reason(limit) == "cell voltage low: cell 2.7 (no. 19) at 2.9000 V, zero at 2.8000 V");
  const Json json = limit_json(limit, config_with_fuse());
  CHECK(json.at("limit_mA") == 40'000);
  CHECK(json.at("value_uV") == 2'900'000);
  CHECK(json.at("derates_from_uV") == 3'000'000);
  CHECK(json.at("threshold_uV") == 2'800'000);
  CHECK(json.at("unhindered_mA") == 80'000);
  CHECK(json.at("input") == "lowest cell voltage");
}

TEST_CASE("a share is told with the state of charge that leaves it", "[unit][limits][bmuctl]") {
  const CurrentLimit limit{
      .limit_mA = 24'550, .cause = LimitCause::full, .value = 805, .derates_from = 985, .unhindered_mA = 25'000};
  CHECK(reason(limit) == "full: at 80.5 %, 98.5 % are left");
  const Json json = limit_json(limit, config_with_fuse());
  CHECK(limit_reason(Reply(json), 32) == "full: at 80.5 %, 98.5 % are left");
  CHECK(limit_reason(Reply(json), 31) == "full: at 80.5 %");
}

TEST_CASE("a voltage to come is told with where it is held", "[unit][limits][bmuctl]") {
  const CurrentLimit limit{.limit_mA = 4'000,
                           .cause = LimitCause::voltage_would_rise,
                           .value = 4'190'000,
                           .threshold = 4'222'500,
                           .element = cell,
                           .unhindered_mA = 20'000};
  CHECK(reason(limit) == "cell voltage would rise too high: cell 2.7 (no. 19) at 4.1900 V, held at 4.2225 V");
  const Json json = limit_json(limit, config_with_fuse());
  CHECK(json.at("holds_uV") == 4'222'500);
  CHECK_FALSE(json.contains("threshold_uV"));
  CHECK_FALSE(json.contains("derates_from_uV"));
}

TEST_CASE("a table is told with the share that it leaves", "[unit][limits][bmuctl]") {
  const CurrentLimit limit{.limit_mA = 5'000,
                           .cause = LimitCause::cold,
                           .value = 50,
                           .derates_from = 250,
                           .element = sensor,
                           .unhindered_mA = 20'000};
  CHECK(reason(limit) == "cold: temperature sensor 3.1 at 5.0 C, 25.0 % are left");
  const Json json = limit_json(limit, config_with_fuse());
  CHECK(json.at("share_permille") == 250);
  CHECK_FALSE(json.contains("derates_from_dC"));
  CHECK_FALSE(json.contains("threshold_dC"));
  const Json soc = limit_json({.cause = LimitCause::empty, .value = 50, .derates_from = 600}, config_with_fuse());
  CHECK(soc.at("value_permille") == 50);
  CHECK(soc.at("share_permille") == 600);
}

TEST_CASE("a part is told with its name, a rise with where it goes", "[unit][limits][bmuctl]") {
  CHECK(reason({.limit_mA = 1, .cause = LimitCause::component, .part = 1}) == "component: main fuse");
  CHECK(reason({.limit_mA = 1, .cause = LimitCause::rising, .unhindered_mA = 20'000}) == "rising slowly to 20.000 A");
  CHECK(reason({.limit_mA = 1, .cause = LimitCause::user}) == "user");
  CHECK(reason({.limit_mA = 1, .cause = LimitCause::limp_home}) == "limp home");
  CHECK(reason({.limit_mA = 1, .cause = LimitCause::continuous}) == "continuous limit");
}

TEST_CASE("a power of the pack is told with the voltage that makes a current of it", "[unit][limits][bmuctl][POW_1]") {
  const CurrentLimit limit{
      .limit_mA = 133'333, .cause = LimitCause::power, .value = 600'000, .threshold = 80'000, .unhindered_mA = 200'000};
  CHECK(reason(limit) == "pack power: 80000 W at 600.000 V");
  const Json json = limit_json(limit, config_with_fuse());
  CHECK(json.at("power_max_W") == 80'000);
  CHECK(json.at("pack_voltage_mV") == 600'000);
  const CurrentLimit unknown{.cause = LimitCause::not_sensed, .threshold = 80'000};
  CHECK(reason(unknown) == "pack voltage or current not measured");
  CHECK_FALSE(limit_json(unknown, config_with_fuse()).contains("pack_voltage_mV"));
}

}  // namespace bmu
