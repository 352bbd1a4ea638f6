// Requests of the status socket to a core that drives: each is answered by one line of JSON with its result, a refused
// one has no effect, and a command that needs authority fails without it. No request closes a contactor.
//
// Input: lines. Those that start with '@' set conditions, the others are requests:
//
//   @user 1000    user of the following requests; initially root
//   @group 901    group of that user: 901 may read, 902 may command
//   @run 50       milliseconds, 200 at most
//   @key off, @key on
//   @silent 2     a module stops sending
#include <charconv>
#include <string>

#include <nlohmann/json.hpp>

#include "daemon/shell/status/status_requests.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/told_core.hpp"

using namespace bmu;

namespace {

/// The pack with which every input starts: closed, with a close request.
const test::CoreBench& driving() {
  static const test::CoreBench bench = [] {
    test::CoreBench made(test::small_pack());
    FUZZ_CHECK(made.close());
    made.run(200ms);
    return made;
  }();
  return bench;
}

class Daemon {
 public:
  void take(std::string_view line) {
    if (line.starts_with('@')) return change_world(fuzz::pieces_of(line, " "));
    ask(line);
  }

 private:
  static constexpr std::uint32_t own_user_id = 990;
  static constexpr std::uint32_t readers = 901;
  static constexpr std::uint32_t admins = 902;

  void change_world(const std::vector<std::string_view>& words) {
    std::uint32_t number = 0;
    const std::string_view word = words.size() > 1 ? words[1] : std::string_view{};
    std::from_chars(word.data(), word.data() + word.size(), number);
    if (words[0] == "@user") peer_.user_id = number;
    if (words[0] == "@group") peer_.group_id = number;
    if (words[0] == "@run") bench_.run(std::chrono::milliseconds(std::min(number, 200U)));
    if (words[0] == "@key") bench_.inputs.vehicle_on = word == "on";
    if (words[0] == "@silent") bench_.modules[number % bench_.modules.size()].talks = false;
  }

  [[nodiscard]] StatusView view() const { return told_.view(access_.users()); }

  [[nodiscard]] bool may_command() const {
    return peer_.user_id == 0 || peer_.user_id == own_user_id || peer_.group_id == admins;
  }

  void carry_out(const CommandGiven& command) {
    ++carried_out_;
    FUZZ_CHECK(command.user_id == peer_.user_id && command.command != Command::shut_down);
    FUZZ_CHECK(may_command());
    const ContactorOutputs before = bench_.core().outputs();
    bench_.observe(command);
    bench_.run(10ms);
    FUZZ_CHECK(!bench_.core().outputs().any_contactor() || before.any_contactor());
  }

  void ask(std::string_view request) {
    const int carried_out_before = carried_out_;
    const StatusReply reply = requests_.answer(request, peer_);
    if (reply.picture_period) {
      FUZZ_CHECK(reply.line.empty() && *reply.picture_period >= 50ms && *reply.picture_period <= 60s);
      check_line(requests_.picture());
      return;
    }
    const nlohmann::json json = check_line(reply.line);
    if (json["ok"] == true) {
      FUZZ_CHECK(json["cmd"].is_string());
      return;
    }
    FUZZ_CHECK(json["error"]["code"].is_string() && json["error"]["message"].is_string());
    // "refused" comes from the core, which was called.
    FUZZ_CHECK(json["error"]["code"] != "internal");
    if (json["error"]["code"] != "refused") FUZZ_CHECK(carried_out_ == carried_out_before);
  }

  static nlohmann::json check_line(const std::string& line) {
    FUZZ_CHECK(std::none_of(line.begin(), line.end(), [](char one) { return one >= 0 && one < ' '; }));
    nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
    FUZZ_CHECK(!json.is_discarded() && json.is_object() && json.contains("ok") && json["ok"].is_boolean());
    return json;
  }

  test::ToldCore told_{.bench = driving(), .pack_name = "small \xFF pack"};
  test::CoreBench& bench_ = told_.bench;
  Peer peer_{.user_id = 0};
  int carried_out_ = 0;
  Access access_{{.own_user_id = own_user_id, .groups = {.readers = readers, .admins = admins}},
                 UserNames("/dev/null"),
                 [](std::string_view line) { FUZZ_CHECK(!line.empty()); }};
  StatusRequests requests_{{.make_view = [this] { return view(); },
                            .carry_out = [this](const CommandGiven& command) { carry_out(command); },
                            .log = [](std::string_view line) { FUZZ_CHECK(!line.empty()); },
                            .access = access_,
                            .reload =
                                [this](const Peer&) {
                                  FUZZ_CHECK(may_command());
                                  return refusal("refused", "nothing is reloaded here");
                                }}};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t lines_max = 24;
  Daemon daemon;
  for (const std::string_view line : fuzz::lines_of(fuzz::text_of(data, size), lines_max)) daemon.take(line);
  return 0;
}
