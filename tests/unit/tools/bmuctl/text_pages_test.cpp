// Text pages of bmuctl, from the replies of the daemon.
#include "tools/bmuctl/text_pages.hpp"

#include <string>

#include "tests/support/catch.hpp"

namespace bmu {

namespace {

using Json = nlohmann::json;

const Json stop_stays{{"name", "emergency_stop"},
                      {"reason", "cause still present"},
                      {"text", "Emergency stop pressed: cause still present."}};
const Json hot_stays{{"name", "cell_overtemperature"},
                     {"reason", "cause gone for 2 s, required 5 s"},
                     {"text", "Cell temperature too high: cause gone for 2 s, required 5 s."}};

std::string clear_text(const Json& cleared, const Json& still_present, const Json& reasons) {
  const Json reply{{"cleared", cleared}, {"still_present", still_present}, {"reasons", reasons}};
  return clear_page(Reply(reply)).text(false);
}

}  // namespace

TEST_CASE("clear without a fault says that there was nothing to clear", "[unit][bmuctl]") {
  CHECK(clear_text(Json::array(), Json::array(), Json::array()) == "No faults to clear.\n");
}

TEST_CASE("clear names the faults that went", "[unit][bmuctl]") {
  CHECK(clear_text({"module_lost", "overcurrent"}, Json::array(), Json::array()) ==
        "Cleared: module_lost, overcurrent.\n");
}

TEST_CASE("clear names each fault that stays, with its own reason", "[unit][bmuctl]") {
  const std::string both =
      "Still confirmed: emergency_stop. Emergency stop pressed: cause still present.\n"
      "Still confirmed: cell_overtemperature. Cell temperature too high: cause gone for 2 s, required 5 s.\n";
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
  CHECK(clear_text(Json::array(), Json::array({"emergency_stop"}), nullptr) == "Still confirmed: emergency_stop.\n");
}

TEST_CASE("one fault is explained, whether it was ever seen or not", "[unit][bmuctl]") {
  Json fault{{"name", "open_wire"},
             {"meaning", "sense wire open"},
             {"reaction", "open now"},
             {"concerns", "all"},
             {"latch", "until cleared"},
             {"cause", "a fuse in it"},
             {"remedy", "check the wire"},
             {"stage", "good"},
             {"count", 0}};
  CHECK(fault_page(Reply(fault), Reply(nullptr)).text(false) ==
        "open_wire: sense wire open\n"
        "  occurred  never\n"
        "  reaction  open now; affects all; latched until cleared\n"
        "  cause     a fuse in it\n"
        "  action    check the wire\n");
  fault["stage"] = "active";
  CHECK(fault_page(Reply(fault), Reply(nullptr)).text(false).find("  status    active") != std::string::npos);
}

TEST_CASE("the page of a fault shows the grace of its reaction, and the usual reaction beside a stricter one",
          "[unit][bmuctl][reactions]") {
  Json fault{{"name", "cell_imbalance"},
             {"reaction", "open after grace"},
             {"grace_ms", 250},
             {"concerns", "all"},
             {"latch", "none"},
             {"stage", "good"},
             {"count", 0}};
  const auto does = [&fault] { return fault_page(Reply(fault), Reply(nullptr)).text(false); };
  CHECK(does().find("open after grace of 250 ms; affects all; not latched") != std::string::npos);
  fault["usual_reaction"] = "open after grace";
  fault["usual_grace_ms"] = 250;
  fault["grace_ms"] = 100;
  CHECK(does().find("open after grace of 100 ms by the pack file, usually open after grace of 250 ms;") !=
        std::string::npos);
  fault["reaction"] = "open now";
  fault["grace_ms"] = nullptr;
  CHECK(does().find("open now by the pack file, usually open after grace of 250 ms;") != std::string::npos);
}

TEST_CASE("faults with a reaction of the pack file are listed though none was seen", "[unit][bmuctl][reactions]") {
  const Json usual{{"name", "open_wire"}, {"reaction", "open now"}, {"stage", "good"}, {"count", 0}};
  Json stricter = usual;
  stricter["name"] = "cell_imbalance";
  stricter["usual_reaction"] = "open after grace";
  const Json faults = Json::array({usual, stricter});
  const std::string page = faults_page(Reply(faults), Reply(nullptr)).text(false);
  INFO(page);
  CHECK(page.find("cell_imbalance  good       0  open now, by the pack file") != std::string::npos);
  CHECK(page.find("open_wire") == std::string::npos);
  CHECK(page.find("1 others not recorded") != std::string::npos);
}

namespace {

Json balance_reply() {
  return {{"method", "ocv"},
          {"state", "bleeding"},
          {"state_for_ms", 12'000},
          {"reasons", Json::array()},
          {"plan", "cells above the dead band"},
          {"planned_ago_ms", 12'000},
          {"cells_told", 1},
          {"cells_on", 1},
          {"modules", Json::array({{{"node", 3},
                                    {"first_pack_number", 25},
                                    {"command", "done"},
                                    {"to_go_uAs", {0, 36'000'000}},
                                    {"minutes_told", {0, 5}},
                                    {"is_on", {false, true}},
                                    {"bled_uAs", {0, 3'600'000}},
                                    {"missing_uAs", {nullptr, nullptr}}}})}};
}

}  // namespace

TEST_CASE("balance shows the cells that have a part in it", "[unit][bmuctl][balancing]") {
  const Json reply = balance_reply();
  const std::string text = balance_page(Reply(reply)).text(false);
  CHECK(text.find("bleeding 1 cell, 1 switch on") != std::string::npos);
  CHECK(text.find("cells above the dead band") != std::string::npos);
  CHECK(text.find("0.0100 Ah") != std::string::npos);
  CHECK(text.find("5 min") != std::string::npos);
  CHECK(text.find(" 26 ") != std::string::npos);
  CHECK(text.find(" 25 ") == std::string::npos);  // no value of the other
  CHECK(text.find("Inhibit") == std::string::npos);
}

TEST_CASE("balance says first what speaks against it, and lists it all", "[unit][bmuctl][balancing]") {
  Json reply = balance_reply();
  reply["state"] = "idle";
  reply["modules"] = Json::array();
  reply["reasons"] = Json::array({{{"name", "discharging"}, {"text", "the pack is discharged"}},
                                  {{"name", "cell_too_low"}, {"text", "a cell is too low"}}});
  const std::string text = balance_page(Reply(reply)).text(false);
  CHECK(text.find("idle: the pack is discharged") != std::string::npos);
  CHECK(text.find("a cell is too low") != std::string::npos);
  CHECK(text.find("Module  Cell") == std::string::npos);
}

TEST_CASE("balance names modules that do not take part", "[unit][bmuctl][balancing]") {
  for (const std::string command : {"refused", "no answer"}) {
    Json reply = balance_reply();
    reply["modules"][0]["command"] = command;
    CHECK(balance_page(Reply(reply)).text(false).find(command) != std::string::npos);
  }
}

TEST_CASE("status shows what an interface is set to beside its bus, and what it should be", "[unit][bmuctl]") {
  const auto row_of = [](const Json& rate, const Json& wanted, const char* verdict) {
    const Json port{{"port", "internal"},     {"bus", "can0"},          {"state", "up"},
                    {"times_down", 3},        {"rate_bit_per_s", rate}, {"rate_wanted_bit_per_s", wanted},
                    {"rate_verdict", verdict}};
    const std::string text = status_page(Reply(Json{{"ports", {port}}})).text(false);
    const auto at = text.find("internal");
    REQUIRE(at != std::string::npos);
    const bool has_column = text.find("kbit/s") != std::string::npos;
    const std::string row = text.substr(at, text.find('\n', at) - at);
    return (has_column ? "kbit/s:" : "") + row.substr(row.find('3') + 1);
  };
  CHECK(row_of(500'000, 500'000, "as wanted") == "kbit/s:     500");
  CHECK(row_of(83'333, nullptr, "unknown") == "kbit/s:  83.333");
  CHECK(row_of(250'000, 500'000, "differs") == "kbit/s:  250, expected 500");
  CHECK(row_of(125'000, 500'000, "too slow") == "kbit/s:  125, expected 500");
  CHECK(row_of(nullptr, nullptr, "unknown").empty());
}

namespace {

/// Reply for a module with two cells; all values of the second one are unknown.
Json health_reply() {
  const Json first{{"module", 1}, {"number", 1}, {"pack_number", 1}, {"text", "cell 1.1 (no. 1)"}};
  const Json module{{"node", 1},
                    {"first_pack_number", 1},
                    {"capacity_uAs", {97'200'000'000, nullptr}},
                    {"capacity_sigma_uAs", {1'080'000'000, nullptr}},
                    {"capacity_pairs", {3, 0}},
                    {"capacity_refused", {1, 0}},
                    {"resistance_uOhm", {1'903, nullptr}},
                    {"resistance_sigma_uOhm", {80, nullptr}},
                    {"step_resistance_uOhm", {1'880, nullptr}},
                    {"health_by_capacity_permille", {900, nullptr}},
                    {"health_by_capacity_sigma_permille", {10, nullptr}},
                    {"health_by_resistance_permille", {882, nullptr}},
                    {"health_by_resistance_sigma_permille", {50, nullptr}}};
  return {{"by_capacity_permille", 900},
          {"by_capacity_sigma_permille", 10},
          {"weakest_cell", first},
          {"by_resistance_permille", nullptr},
          {"by_resistance_sigma_permille", nullptr},
          {"worst_cell", nullptr},
          {"pack_resistance_uOhm", 91'450},
          {"pack_resistance_sigma_uOhm", 4'110},
          {"cell_resistance_min_uOhm", 1'903},
          {"cell_resistance_min_at", first},
          {"cell_resistance_max_uOhm", 1'903},
          {"cell_resistance_max_at", first},
          {"cell_resistance_max_permille", 1'038},
          {"rated_capacity_uAs", 108'000'000'000},
          {"totals",
           {{"charge_out_uAs", 133'380'000'000},
            {"charge_in_uAs", 3'600'000'000},
            {"energy_out_mWh", 5'000},
            {"energy_in_mWh", 40},
            {"cycles_permille", 1'235}}},
          {"is_charge_paused", false},
          {"modules", Json::array({module})}};
}

}  // namespace

TEST_CASE("health tells what is known with what it may be off by, and the rest as not known", "[unit][bmuctl][FS_5]") {
  const Json reply = health_reply();
  const std::string text = health_page(Reply(reply)).text(false);
  INFO(text);
  CHECK(text.find("Capacity    90.0 % (+- 2.0) of 30.0000 Ah, cell 1.1 (no. 1)\n") != std::string::npos);
  CHECK(text.find("Resistance  not known\n") != std::string::npos);
  CHECK(text.find("91.45 mOhm (+- 8.22)\nCells       lowest 1.90 mOhm, cell 1.1 (no. 1)") != std::string::npos);
  CHECK(text.find("highest 1.90 mOhm, cell 1.1 (no. 1), 103.8 % of the average\n") != std::string::npos);
  CHECK(text.find("out 37.0500 Ah, 5.0 Wh   in 1.0000 Ah, 0.0 Wh   full cycles 1.24\n") != std::string::npos);
  CHECK(text.find("27.0000 Ah  90.0 % (+- 2.0)  3, rejected 1   1.90 mOhm  88.2 % (+- 10.0)  1.88 mOhm\n") !=
        std::string::npos);
  CHECK(text.find("Paused") == std::string::npos);
}

TEST_CASE("health says so where nobody keeps what flowed, and while a charge is paused", "[unit][bmuctl]") {
  Json reply = health_reply();
  reply["totals"] = nullptr;
  reply["is_charge_paused"] = true;
  const std::string text = health_page(Reply(reply)).text(false);
  INFO(text);
  CHECK(text.find("Throughput  not recorded (no state file)\n") != std::string::npos);
  CHECK(text.find("Paused      charging") != std::string::npos);
}

}  // namespace bmu
