// Access rights on the status socket: every kind of peer against every command, with and without the groups.
#include "daemon/shell/status/access.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/shell/status/status_requests.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/told_core.hpp"

using namespace bmu;

namespace {

constexpr std::uint32_t own_user = 900;
constexpr std::uint32_t readers = 901;
constexpr std::uint32_t admins = 902;

const AccessRules with_groups{.own_user_id = own_user, .groups = {.readers = readers, .admins = admins}};
const AccessRules without_groups{.own_user_id = own_user};
const AccessRules only_admins{.own_user_id = own_user, .groups = {.admins = admins}};
const AccessRules only_readers{.own_user_id = own_user, .groups = {.readers = readers}};

struct Kind {
  std::string name;
  Peer peer;
  bool may_read;  // if both groups exist
  bool may_control;
};

std::vector<Kind> kinds() {
  return {
      {"root", {.user_id = 0, .group_id = 0}, true, true},
      {"the daemon's own user", {.user_id = own_user, .group_id = own_user}, true, true},
      {"an administrator by his first group", {.user_id = 1'000, .group_id = admins}, true, true},
      {"an administrator", {.user_id = 1'000, .group_id = 100, .more_groups = {4, admins, 27}}, true, true},
      {"one of both groups", {.user_id = 1'000, .group_id = readers, .more_groups = {admins}}, true, true},
      {"a reader by his first group", {.user_id = 1'001, .group_id = readers}, true, false},
      {"a reader", {.user_id = 1'001, .group_id = 100, .more_groups = {readers}}, true, false},
      {"somebody else", {.user_id = 1'002, .group_id = 100, .more_groups = {4, 27}}, false, false},
      {"a user whose number is a group's", {.user_id = admins, .group_id = 100}, false, false},
      {"root's group, and not root", {.user_id = 1'002, .group_id = 0, .more_groups = {0}}, false, false},
      {"somebody of whom the kernel says nothing", {}, false, false},
  };
}

/// Commands of the status socket with a core on its bench.
struct Desk {
  test::ToldCore told{test::CoreBench(test::small_pack())};
  test::CoreBench& bench = told.bench;
  std::vector<std::string> refusals;
  Access access;
  std::vector<CommandGiven> carried_out;
  std::vector<std::string> log;
  std::vector<Peer> reloads;
  StatusRequests requests{{.make_view = [this] { return view(); },
                           .carry_out =
                               [this](const CommandGiven& command) {
                                 carried_out.push_back(command);
                                 bench.observe(command);
                                 bench.run(2ms);
                               },
                           .log = [this](std::string_view line) { log.emplace_back(line); },
                           .access = access,
                           .reload =
                               [this](const Peer& peer) {
                                 reloads.push_back(peer);
                                 return StatusReply{.line = R"({"ok":true})"};
                               }}};

  explicit Desk(const AccessRules& rules)
      : access(rules, UserNames("/nowhere"), [this](std::string_view line) { refusals.emplace_back(line); }) {
    bench.run(2s);
  }
  Desk(const Desk&) = delete;
  Desk& operator=(const Desk&) = delete;
  ~Desk() = default;

  StatusView view() { return told.view(access.users()); }
  Json ask(const Json& request, const Peer& peer) {
    const StatusReply reply = requests.answer(request.dump(), peer);
    return reply.line.empty() ? Json{{"ok", true}} : Json::parse(reply.line);
  }
};

/// Required right of each command, specified independently: a new or changed row must be considered twice.
struct Expected {
  Json request;
  bool is_control;
};
std::vector<Expected> expected() {
  return {{{{"cmd", "status"}}, false},
          {{{"cmd", "cells"}}, false},
          {{{"cmd", "faults"}}, false},
          {{{"cmd", "why"}}, false},
          {{{"cmd", "modules"}}, false},
          {{{"cmd", "health"}}, false},
          {{{"cmd", "version"}}, false},
          {{{"cmd", "watch"}}, false},
          {{{"cmd", "balance"}}, false},
          {{{"cmd", "balance"}, {"switch", "on"}}, true},
          {{{"cmd", "balance"}, {"switch", "off"}}, true},
          {{{"cmd", "clear"}}, true},
          {{{"cmd", "clear"}, {"authorised", true}}, true},
          {{{"cmd", "wake"}}, true},
          {{{"cmd", "reload"}}, true},
          {{{"cmd", "accept_modules"}}, true},
          {{{"cmd", "accept_modules"}, {"node", 1}}, true},
          {{{"cmd", "assign_module"}, {"serial_number", 1}, {"node", 9}, {"unheard", true}}, true}};
}

bool is_refused(const Json& reply) {
  return reply.at("ok") == false && reply.at("error").at("code") == "not_allowed";
}

}  // namespace

TEST_CASE("who may read and who may control is decided by user and groups alone", "[unit][access]") {
  for (const Kind& kind : kinds()) {
    INFO(kind.name);
    CHECK(may(with_groups, kind.peer, Right::read) == kind.may_read);
    CHECK(may(with_groups, kind.peer, Right::control) == kind.may_control);
  }
}

TEST_CASE("a group that is not there gives nobody a right", "[unit][access]") {
  for (const Kind& kind : kinds()) {
    INFO(kind.name);
    const bool is_owner = kind.peer.user_id == 0 || kind.peer.user_id == own_user;
    CHECK(may(without_groups, kind.peer, Right::control) == is_owner);
    CHECK(may(only_readers, kind.peer, Right::control) == is_owner);
    CHECK(may(only_admins, kind.peer, Right::control) == kind.may_control);
    CHECK(may(only_admins, kind.peer, Right::read) == kind.may_control);
    // The file mode of the socket has admitted them.
    CHECK(may(without_groups, kind.peer, Right::read));
  }
  const Peer reader{.user_id = 1'001, .group_id = readers};
  CHECK(may(only_readers, reader, Right::read));
  const Peer administrator{.user_id = 1'000, .group_id = admins};
  CHECK_FALSE(may(only_readers, administrator, Right::read));
}

TEST_CASE("every command is answered to whom it is for, and to nobody else, and every change says who",
          "[unit][access]") {
  for (const Expected& command : expected()) {
    for (const Kind& kind : kinds()) {
      INFO(command.request.dump() << " by " << kind.name);
      Desk desk(with_groups);
      const Json reply = desk.ask(command.request, kind.peer);
      const bool may_do = command.is_control ? kind.may_control : kind.may_read;
      CHECK(is_refused(reply) == !may_do);
      CHECK(desk.carried_out.size() + desk.reloads.size() == (may_do && command.is_control ? 1U : 0U));
      CHECK(desk.refusals.empty() == may_do);
      CHECK(desk.log.size() == desk.carried_out.size());
      for (const std::string& line : desk.log) {
        CHECK(line.find("user " + std::to_string(kind.peer.user_id) + ", process ") != std::string::npos);
      }
      for (const CommandGiven& given : desk.carried_out) CHECK(given.user_id == kind.peer.user_id);
    }
  }
}

TEST_CASE("no command is forgotten in the list of what each takes", "[unit][access]") {
  const std::vector<Expected> all = expected();
  for (const CommandRight& row : command_rights()) {
    INFO(row.name);
    const auto is_it = [&](const Expected& one) { return one.request.at("cmd") == row.name; };
    CHECK(std::any_of(all.begin(), all.end(), is_it));
  }
  CHECK(command_rights().size() == 14);
}

TEST_CASE("who may not read is told nothing of what there is", "[unit][access]") {
  Desk desk(with_groups);
  const Peer stranger{.user_id = 1'002, .group_id = 100, .process_id = 4'711};
  for (const char* request : {"nonsense", "{}", R"({"cmd":"fly"})", R"({"cmd":"clear","x":1})", ""}) {
    INFO(request);
    CHECK(is_refused(Json::parse(desk.requests.answer(request, stranger).line)));
  }
  REQUIRE(!desk.refusals.empty());
  CHECK(desk.refusals.front() == "access denied: user 1002, process 4711: read");
}

TEST_CASE("a refusal says who may", "[unit][access]") {
  const Peer reader{.user_id = 1'001, .group_id = readers, .process_id = 12};
  Desk desk(with_groups);
  const Json reply = desk.ask({{"cmd", "balance"}, {"switch", "off"}}, reader);
  CHECK(reply.at("error").at("message") ==
        "user 1001 is not permitted to \"balance with switch\"; permitted: root, members of bmud-admin, and the user "
        "of the daemon, user 900");
  CHECK(desk.refusals == std::vector<std::string>{"access denied: user 1001, process 12: \"balance with switch\""});
  Desk plain({.own_user_id = 0});
  CHECK(plain.ask({{"cmd", "wake"}}, reader).at("error").at("message") ==
        "user 1001 is not permitted to \"wake\"; permitted: root");
}

TEST_CASE("what is refused for another reason is logged with who asked for it", "[unit][access]") {
  Desk desk(with_groups);
  REQUIRE(desk.bench.close());
  const Peer administrator{.user_id = 1'000, .group_id = admins, .process_id = 12};
  CHECK(desk.ask({{"cmd", "accept_modules"}}, administrator).at("error").at("code") == "refused");
  CHECK(desk.ask({{"cmd", "assign_module"}, {"serial_number", 1001}, {"node", 9}}, administrator).at("ok") == false);
  CHECK(desk.ask({{"cmd", "balance"}, {"switch", 1}}, administrator).at("error").at("code") == "bad_argument");
  REQUIRE(desk.refusals.size() == 3);
  CHECK(desk.refusals[0] ==
        "refused: \"accept_modules\" by user 1000, process 12: contactors not open, or close request active");
  CHECK(desk.refusals[1].starts_with("refused: \"assign_module\" by user 1000, process 12: "));
  CHECK(desk.refusals[2].starts_with("refused: \"balance with switch\" by user 1000, process 12: "));
}

TEST_CASE("groups are those of the file, the first of each name", "[unit][access]") {
  const TemporaryFolder folder;
  std::ofstream(folder / "group")
      << "root:x:0:\n# bmud:x:1:\nbmudx:x:5:\nbmud:x:998:anna\nbmud:x:999:\nbmud-admin:x:997:\n";
  const AccessGroups both = access_groups(folder / "group");
  CHECK(both.readers == 998U);
  CHECK(both.admins == 997U);
  std::ofstream(folder / "plain") << "root:x:0:\nxbmud:x:5:\n";
  CHECK_FALSE(access_groups(folder / "plain").has_any());
  CHECK_FALSE(access_groups(folder / "missing").has_any());
}

TEST_CASE("rules that are replaced hold for the next request", "[unit][access]") {
  Desk desk(with_groups);
  const Peer reader{.user_id = 1'001, .group_id = readers};
  CHECK(desk.ask({{"cmd", "version"}}, reader).at("ok") == true);
  desk.access.replace({.admins = admins}, UserNames("/nowhere"));
  CHECK(is_refused(desk.ask({{"cmd", "version"}}, reader)));
  CHECK(desk.access.is_by_group());
  desk.access.replace({}, UserNames("/nowhere"));
  CHECK_FALSE(desk.access.is_by_group());
  CHECK(desk.access.text() ==
        "status socket: control: root, and the user of the daemon, user 900; read: every user that can connect "
        "(neither group bmud nor bmud-admin exists)");
}

TEST_CASE("what others cause is logged ten times a minute, and then how often it was not", "[unit][access]") {
  std::vector<std::string> lines;
  SparingLog log([&](std::string_view line) { lines.emplace_back(line); });
  const TimePoint start{100s};
  for (int i = 0; i < 1'000; ++i) log.log(start + i * 10ms, "line");
  CHECK(lines.size() == SparingLog::lines_max);
  log.tell_left_out(start + 1min - 1us);
  CHECK(lines.size() == SparingLog::lines_max);
  log.tell_left_out(start + 1min);
  REQUIRE(lines.size() == SparingLog::lines_max + 1);
  CHECK(lines.back() == "990 similar lines suppressed within one minute");
  log.tell_left_out(start + 5min);
  CHECK(lines.size() == SparingLog::lines_max + 1);
  // A new minute begins with the next line, independent of requests.
  log.log(start + 10min, "again");
  CHECK(lines.back() == "again");
}
