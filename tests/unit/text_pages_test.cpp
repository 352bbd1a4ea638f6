// bmuctl's pages of text: what the daemon answered, in words.
#include "tools/bmuctl/text_pages.hpp"

#include <string>

#include "tests/support/catch.hpp"

namespace bmu {

namespace {

using Json = nlohmann::json;

const Json stop_stays{{"name", "emergency_stop"},
                      {"reason", "its cause is still there"},
                      {"text", "The emergency stop is pressed: its cause is still there."}};
const Json hot_stays{{"name", "cell_overtemperature"},
                     {"reason", "its cause has been gone for 2 s, wanted 5 s"},
                     {"text", "A cell is too hot: its cause has been gone for 2 s, wanted 5 s."}};

std::string clear_text(const Json& cleared, const Json& still_present, const Json& reasons) {
  const Json reply{{"cleared", cleared}, {"still_present", still_present}, {"reasons", reasons}};
  return clear_page(Reply(reply)).text(false);
}

}  // namespace

TEST_CASE("clear without a fault says that there was nothing to clear", "[unit][bmuctl]") {
  CHECK(clear_text(Json::array(), Json::array(), Json::array()) == "There was nothing to clear.\n");
}

TEST_CASE("clear names the faults that went", "[unit][bmuctl]") {
  CHECK(clear_text({"module_lost", "overcurrent"}, Json::array(), Json::array()) ==
        "Cleared: module_lost, overcurrent.\n");
}

TEST_CASE("clear names each fault that stays, with its own reason", "[unit][bmuctl]") {
  const std::string both =
      "Still present: emergency_stop. The emergency stop is pressed: its cause is still there.\n"
      "Still present: cell_overtemperature. A cell is too hot: its cause has been gone for 2 s, wanted 5 s.\n";
  const Json still = {"emergency_stop", "cell_overtemperature"};
  CHECK(clear_text(Json::array(), still, Json::array({stop_stays, hot_stays})) == both);
  CHECK(clear_text(Json::array({"module_lost"}), still, Json::array({hot_stays, stop_stays})) ==
        "Cleared: module_lost.\n" + both);
}

TEST_CASE("a clear falls short while a fault stays that does more than warn", "[unit][bmuctl]") {
  const auto falls_short = [](const Json& still_present, const Json& reasons) {
    const Json reply{{"cleared", {"module_lost"}}, {"still_present", still_present}, {"reasons", reasons}};
    return leaves_faults(Reply(reply));
  };
  Json disk_stays{{"name", "disk_low"}, {"only_warns", true}};
  Json stop{{"name", "emergency_stop"}, {"only_warns", false}};
  CHECK_FALSE(falls_short(Json::array(), Json::array()));
  CHECK(falls_short({"emergency_stop"}, Json::array({stop})));
  CHECK(falls_short({"emergency_stop"}, nullptr));
  CHECK_FALSE(falls_short({"disk_low"}, Json::array({disk_stays})));
  CHECK(falls_short({"disk_low", "emergency_stop"}, Json::array({disk_stays, stop})));
}

TEST_CASE("a fault that stays is named even if the daemon gives no reason", "[unit][bmuctl]") {
  CHECK(clear_text(Json::array(), Json::array({"emergency_stop"}), nullptr) == "Still present: emergency_stop.\n");
}

}  // namespace bmu
