#include "daemon/shell/status_requests.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "daemon/shell/status_json.hpp"
#include "daemon/shell/why_json.hpp"

namespace bmu {

namespace {

constexpr std::int64_t period_min_ms = 50;
constexpr std::int64_t period_max_ms = 60'000;
constexpr std::int64_t period_default_ms = 500;

std::string line_of(std::string_view command, const Json& content) {
  Json line{{"ok", true}, {"cmd", command}};
  line.update(content);
  // What came from outside (a pack's name) need not be UTF-8; a reply always is.
  return line.dump(-1, ' ', false, Json::error_handler_t::replace);
}

StatusReply answer_version(const StatusRequests&, const Json&) {
  return {.line = line_of("version", {{"version", BMUD_VERSION}})};
}

template <Json (*Make)(const StatusView&)>
StatusReply answer_with(const StatusRequests& requests, const Json& request) {
  return {.line = line_of(request["cmd"].get<std::string>(), Make(requests.view()))};
}

struct CommandRow {
  std::string_view name;
  StatusReply (*answer)(const StatusRequests&, const Json& request);
};

constexpr std::array<CommandRow, 7> command_table{{
    {"status", answer_with<status_json>},
    {"cells", answer_with<cells_json>},
    {"faults", answer_with<faults_json>},
    {"why", answer_with<why_json>},
    {"clear", [](const StatusRequests& requests, const Json&) { return requests.clear(); }},
    {"watch", [](const StatusRequests& requests, const Json& request) { return requests.watch(request); }},
    {"version", answer_version},
}};

std::string known_commands() {
  std::string names;
  for (const CommandRow& row : command_table) names += (names.empty() ? "" : ", ") + std::string(row.name);
  return names;
}

Json present_faults(const StatusView& view) {
  Json names = Json::array();
  for (const FaultRow& row : fault_table()) {
    if (view.core.faults().state(row.id).is_present()) names.push_back(row.name);
  }
  return names;
}

}  // namespace

StatusRequests::StatusRequests(MakeView make_view, ClearFaults clear_faults)
    : make_view_(std::move(make_view)), clear_faults_(std::move(clear_faults)) {}

StatusReply StatusRequests::answer(std::string_view request) const {
  try {
    const Json json = Json::parse(request, nullptr, false);
    if (json.is_discarded()) return {.line = error_line("malformed", "not JSON; try {\"cmd\":\"status\"}")};
    if (!json.is_object() || !json.contains("cmd") || !json["cmd"].is_string()) {
      return {.line =
                  error_line("malformed", "a request is an object with a text \"cmd\", one of " + known_commands())};
    }
    const auto name = json["cmd"].get<std::string>();
    const auto* row = std::find_if(command_table.begin(), command_table.end(),
                                   [&](const CommandRow& one) { return one.name == name; });
    if (row != command_table.end()) return row->answer(*this, json);
    return {.line = error_line("unknown_command", "\"" + name + "\" is none of " + known_commands())};
  } catch (const Json::exception& error) {
    return {.line = error_line("internal", error.what())};
  }
}

StatusReply StatusRequests::clear() const {
  const Json before = present_faults(view());
  clear_faults_();
  const StatusView now = view();
  const Json after = present_faults(now);
  Json cleared = Json::array();
  std::copy_if(before.begin(), before.end(), std::back_inserter(cleared),
               [&](const Json& name) { return std::find(after.begin(), after.end(), name) == after.end(); });
  return {.line = line_of("clear", {{"present_before", before},
                                    {"cleared", std::move(cleared)},
                                    {"still_present", after},
                                    {"reasons", staying_faults_json(now)}})};
}

StatusReply StatusRequests::watch(const Json& request) const {
  std::int64_t period_ms = period_default_ms;
  if (request.contains("period_ms")) {
    const Json& wanted = request["period_ms"];
    period_ms = wanted.is_number_integer() ? wanted.get<std::int64_t>() : 0;
  }
  if (period_ms < period_min_ms || period_ms > period_max_ms) {
    return {.line = error_line("bad_argument", "\"period_ms\" is a whole number from 50 to 60000")};
  }
  // The first picture follows with the next tick.
  return {.line = "", .picture_period = std::chrono::milliseconds(period_ms)};
}

std::string StatusRequests::picture() const {
  const StatusView now = view();
  return line_of(
      "watch",
      {{"status", status_json(now)}, {"cells", cells_json(now)}, {"faults", faults_json(now)}, {"why", why_json(now)}});
}

}  // namespace bmu
