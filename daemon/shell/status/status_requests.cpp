#include "daemon/shell/status/status_requests.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <utility>

#include "daemon/shell/status/balance_json.hpp"
#include "daemon/shell/status/health_json.hpp"
#include "daemon/shell/status/modules_json.hpp"
#include "daemon/shell/status/status_json.hpp"
#include "daemon/shell/status/why_json.hpp"

namespace bmu {

namespace {

constexpr std::int64_t period_min_ms = 50;
constexpr std::int64_t period_max_ms = 60'000;
constexpr std::int64_t period_default_ms = 500;

/// {"ok":true,"cmd":COMMAND,...}: `put_members` puts the other members.
template <class PutMembers>
std::string written_line(std::string_view command, PutMembers&& put_members) {
  JsonText line;
  line.object([&] {
    line.put("ok", true);
    line.put("cmd", command);
    put_members(line);
  });
  return line.take();
}

StatusReply answer_version(const StatusRequests&, const Json&, const Peer&) {
  return {.line = reply_line("version", {{"version", BMUD_VERSION}})};
}

template <auto Make>
StatusReply answer_with(const StatusRequests& requests, const Json& request, const Peer&) {
  return {.line = reply_line(request["cmd"].get<std::string>(), Make(requests.view()))};
}

template <auto Put>
StatusReply answer_written(const StatusRequests& requests, const Json& request, const Peer&) {
  return {.line = written_line(request["cmd"].get<std::string>(), [&](JsonText& to) { Put(to, requests.view()); })};
}

struct CommandRow {
  CommandRight takes;
  StatusReply (*answer)(const StatusRequests&, const Json& request, const Peer& peer);
  std::array<std::string_view, 3> keys{};  // besides "cmd"; unused ones are empty
};

/// Answers with a member function.
template <auto Member>
StatusReply answer_by(const StatusRequests& requests, const Json& request, const Peer& peer) {
  return (requests.*Member)(request, peer);
}

constexpr std::array<CommandRow, 14> command_table{{
    {{"status", Right::read, ""}, answer_written<put_status>},
    {{"cells", Right::read, ""}, answer_written<put_cells>},
    {{"faults", Right::read, ""}, answer_written<put_faults>},
    {{"why", Right::read, ""}, answer_with<why_json>},
    {{"clear", Right::control, ""}, answer_by<&StatusRequests::clear>, {"authorised"}},
    {{"wake", Right::control, ""}, answer_by<&StatusRequests::wake>},
    {{"watch", Right::read, ""}, answer_by<&StatusRequests::watch>, {"period_ms"}},
    {{"modules", Right::read, ""}, answer_with<modules_json>},
    {{"accept_modules", Right::control, ""}, answer_by<&StatusRequests::accept_modules>, {"node"}},
    {{"assign_module", Right::control, ""},
     answer_by<&StatusRequests::assign_module>,
     {"serial_number", "node", "unheard"}},
    {{"balance", Right::read, "switch"}, answer_by<&StatusRequests::balance>, {"switch"}},
    {{"health", Right::read, ""}, answer_with<health_json>},
    {{"reload", Right::control, ""}, answer_by<&StatusRequests::reload>},
    {{"version", Right::read, ""}, answer_version},
}};

Right right_for(const CommandRight& takes, const Json& request) {
  const bool changes = !takes.control_key.empty() && request.contains(takes.control_key);
  return changes ? Right::control : takes.right;
}

std::string known_commands() {
  std::string names;
  for (const CommandRow& row : command_table) names += (names.empty() ? "" : ", ") + std::string(row.takes.name);
  return names;
}

/// A received value as short ASCII text, whatever bytes it has.
std::string excerpt(const Json& value) {
  constexpr std::size_t length_max = 40;
  const std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return text.size() <= length_max ? text : text.substr(0, length_max) + "...";
}

/// The keys of a request that are unknown to its command, for people; "" if there are none.
std::string unknown_keys(const Json& request, const CommandRow& row) {
  constexpr std::size_t names_length_max = 100;
  std::string names;
  for (const auto& [key, value] : request.items()) {
    const bool is_known = !key.empty() && std::find(row.keys.begin(), row.keys.end(), key) != row.keys.end();
    if (key == "cmd" || is_known) continue;
    if (names.size() > names_length_max) return names + ", ...";
    names += (names.empty() ? "" : ", ") + excerpt(key);
  }
  return names;
}

StatusReply unknown_key_reply(const std::string& names, const CommandRow& row) {
  std::string known;
  for (const std::string_view key : row.keys) {
    if (!key.empty()) known += (known.empty() ? "\"" : ", \"") + std::string(key) + "\"";
  }
  return {.line = error_line("unknown_key", "unknown keys " + names + "; \"" + std::string(row.takes.name) +
                                                "\" accepts " + (known.empty() ? "none" : known))};
}

Json present_faults(const StatusView& view) {
  Json names = Json::array();
  for (const FaultRow& row : fault_table()) {
    if (view.core.faults().state(row.id).is_present()) names.push_back(row.name);
  }
  return names;
}

/// A whole number within these bounds; no value if it is missing or anything else.
std::optional<std::int64_t> number_of(const Json& request, const char* key, std::int64_t min, std::int64_t max) {
  if (!request.contains(key) || !request[key].is_number_integer()) return std::nullopt;
  if (request[key].is_number_unsigned() && request[key].get<std::uint64_t>() > std::uint64_t{INT64_MAX}) {
    return std::nullopt;
  }
  const auto value = request[key].get<std::int64_t>();
  return value >= min && value <= max ? std::optional(value) : std::nullopt;
}

/// "\"node\": found 64, expected an integer from 1 to 63"
StatusReply bad_argument(const Json& request, const char* key, std::string_view wanted) {
  const std::string found = request.contains(key) ? excerpt(request[key]) : "nothing";
  return refusal("bad_argument", "\"" + std::string(key) + "\": found " + found + ", expected " + std::string(wanted));
}

std::string list_text(const Json& names) {
  std::string text;
  for (const Json& name : names) text += (text.empty() ? "" : ", ") + name.get<std::string>();
  return text.empty() ? "none" : text;
}

}  // namespace

std::string reply_line(std::string_view command, const Json& content) {
  return written_line(command, [&](JsonText& to) {
    for (const auto& [key, value] : content.items()) to.put(key, value);
  });
}

StatusReply refusal(std::string_view code, std::string_view why) {
  return {.line = error_line(code, why), .refusal = std::string(why)};
}

StatusRequests::StatusRequests(StatusActions actions) : actions_(std::move(actions)) {}

std::vector<CommandRight> command_rights() {
  std::vector<CommandRight> rights;
  rights.reserve(command_table.size());
  for (const CommandRow& row : command_table) rights.push_back(row.takes);
  return rights;
}

StatusReply StatusRequests::answer(std::string_view request, const Peer& peer) const {
  try {
    // First: a peer that may not read gets no list of the commands either.
    if (!actions_.access.may(peer, Right::read)) {
      return {.line = actions_.access.refuse(peer, Right::read, "read", view().now)};
    }
    const Json json = Json::parse(request, nullptr, false);
    if (json.is_discarded()) {
      return {.line = error_line("malformed", "found " + excerpt(std::string(request)) +
                                                  ", which is not JSON; expected a line like {\"cmd\":\"status\"}")};
    }
    if (!json.is_object() || !json.contains("cmd") || !json["cmd"].is_string()) {
      return {.line = error_line(
                  "malformed",
                  "found " + excerpt(json) + ", expected an object with a string \"cmd\", one of " + known_commands())};
    }
    return answer_json(json, peer);
  } catch (const Json::exception& error) {
    return {.line = error_line("internal", error.what())};
  }
}

StatusReply StatusRequests::answer_json(const Json& request, const Peer& peer) const {
  const auto name = request["cmd"].get<std::string>();
  const auto* row = std::find_if(command_table.begin(), command_table.end(),
                                 [&](const CommandRow& one) { return one.takes.name == name; });
  if (row == command_table.end()) {
    return {.line = error_line("unknown_command",
                               "unknown command " + excerpt(name) + ", expected one of " + known_commands())};
  }
  const std::string unknown = unknown_keys(request, *row);
  if (!unknown.empty()) return unknown_key_reply(unknown, *row);
  const Right right = right_for(row->takes, request);
  const std::string what = name + (right == row->takes.right ? "" : " with " + std::string(row->takes.control_key));
  if (!actions_.access.may(peer, right)) {
    return {.line = actions_.access.refuse(peer, right, "\"" + what + "\"", view().now)};
  }
  StatusReply reply = row->answer(*this, request, peer);
  if (right == Right::control && !reply.refusal.empty()) {
    actions_.access.note_refused("\"" + what + "\" by " + who(peer) + ": " + reply.refusal, view().now);
  }
  return reply;
}

StatusReply StatusRequests::clear(const Json& request, const Peer& peer) const {
  const bool wants_authority = request.contains("authorised") && request["authorised"] == true;
  if (request.contains("authorised") && !request["authorised"].is_boolean()) {
    return bad_argument(request, "authorised", "true or false");
  }
  const StatusView before_view = view();
  const Authority authority = wants_authority ? Authority::service : Authority::user;
  const Json before = present_faults(before_view);
  actions_.carry_out({.command = Command::clear_faults, .authority = authority, .user_id = peer.user_id});
  const StatusView now = view();
  const Json after = present_faults(now);
  Json cleared = Json::array();
  std::copy_if(before.begin(), before.end(), std::back_inserter(cleared),
               [&](const Json& name) { return std::find(after.begin(), after.end(), name) == after.end(); });
  log_clear(peer, authority, cleared, after);
  return {.line = reply_line("clear", {{"authority", to_text(authority)},
                                       {"present_before", before},
                                       {"cleared", std::move(cleared)},
                                       {"still_present", after},
                                       {"reasons", staying_faults_json(now)}})};
}

void StatusRequests::log_clear(const Peer& peer, Authority authority, const Json& cleared,
                               const Json& still_present) const {
  actions_.log("clear by " + who(peer) + (authority == Authority::service ? " (authorised)" : "") + ": cleared " +
               list_text(cleared) + "; still confirmed " + list_text(still_present));
}

StatusReply StatusRequests::wake(const Json& /*request*/, const Peer& peer) const {
  const std::string_view before = to_text(view().core.rest().phase());
  actions_.carry_out({.command = Command::wake, .user_id = peer.user_id});
  const StatusView now = view();
  actions_.log("wake by " + who(peer) + ": " + std::string(before) + " -> " +
               std::string(to_text(now.core.rest().phase())));
  return {.line = reply_line("wake", {{"rest_before", before}, {"rest", to_text(now.core.rest().phase())}})};
}

StatusReply StatusRequests::accept_modules(const Json& request, const Peer& peer) const {
  const auto node = number_of(request, "node", 1, internal_bus::node_count_max);
  if (request.contains("node") && !node) {
    return bad_argument(request, "node", "an integer from 1 to 63, or no \"node\" for all modules");
  }
  const StatusView before = view();
  if (node && before.core.modules().find(static_cast<std::uint8_t>(*node)) == nullptr) {
    return bad_argument(request, "node", "a node of the pack file");
  }
  if (!before.core.may_change_modules()) {
    return refusal("refused", "contactors not open, or close request active");
  }
  const KnownModules known_before = before.core.watchers().roster.known();
  actions_.carry_out({.command = Command::accept_modules,
                      .authority = Authority::service,
                      .user_id = peer.user_id,
                      .node = static_cast<std::uint8_t>(node.value_or(0))});
  const StatusView now = view();
  const Json outcome = acceptance_json(static_cast<std::uint8_t>(node.value_or(0)), known_before, now);
  actions_.log("modules accepted by " + who(peer) + ": " + outcome["accepted"].dump());
  return {.line = reply_line("accept_modules", outcome)};
}

StatusReply StatusRequests::assign_module(const Json& request, const Peer& peer) const {
  const auto node = number_of(request, "node", 1, internal_bus::node_count_max);
  const auto serial_number = number_of(request, "serial_number", 0, UINT32_MAX);
  if (!serial_number) return bad_argument(request, "serial_number", "an integer from 0 to 4294967295");
  if (!node) return bad_argument(request, "node", "an integer from 1 to 63");
  if (request.contains("unheard") && !request["unheard"].is_boolean()) {
    return bad_argument(request, "unheard", "true or false");
  }
  actions_.carry_out({.command = Command::assign_node,
                      .authority = Authority::service,
                      .user_id = peer.user_id,
                      .node = static_cast<std::uint8_t>(*node),
                      .serial_number = static_cast<std::uint32_t>(*serial_number),
                      .is_unheard_allowed = request.contains("unheard") && request["unheard"] == true});
  const StatusView now = view();
  const ModuleAssignment& assignment = now.core.assignment();
  const std::string what = "node " + std::to_string(*node) + " assigned by " + who(peer) + " to serial number " +
                           std::to_string(*serial_number);
  const bool is_ours = assignment.request().serial_number == *serial_number && assignment.request().node == *node;
  if (!is_ours) return refusal("refused", to_text(AssignmentRefusal::busy));
  if (assignment.refusal() == AssignmentRefusal::already_there) {
    actions_.log(what + " (already assigned)");
    return {.line = reply_line("assign_module", {{"assignment", assignment_json(now)}})};
  }
  if (assignment.stage() == AssignmentStage::refused) {
    return refusal("refused", to_text(assignment.refusal()));
  }
  actions_.log(what);
  return {.line = reply_line("assign_module", {{"assignment", assignment_json(now)}})};
}

StatusReply StatusRequests::balance(const Json& request, const Peer& peer) const {
  const Json wanted = request.contains("switch") ? request["switch"] : Json("as it is");
  const bool is_off = wanted == "off";
  const bool is_on = wanted == "on";
  if (request.contains("switch") && !is_off && !is_on) {
    return bad_argument(request, "switch", "\"on\" or \"off\"");
  }
  if (is_off || is_on) {
    const Command command = is_off ? Command::balancing_off : Command::balancing_on;
    actions_.carry_out({.command = command, .user_id = peer.user_id});
    actions_.log("balancing switched " + wanted.get<std::string>() + " by " + who(peer));
  }
  return {.line = reply_line("balance", balance_json(view()))};
}

StatusReply StatusRequests::reload(const Json& /*request*/, const Peer& peer) const {
  return actions_.reload(peer);
}

StatusReply StatusRequests::watch(const Json& request, const Peer& /*peer*/) const {
  std::int64_t period_ms = period_default_ms;
  if (request.contains("period_ms")) {
    const Json& wanted = request["period_ms"];
    period_ms = wanted.is_number_integer() ? wanted.get<std::int64_t>() : 0;
  }
  if (period_ms < period_min_ms || period_ms > period_max_ms) {
    return bad_argument(request, "period_ms", "an integer from 50 to 60000");
  }
  // The first picture follows with the next tick.
  return {.line = "", .picture_period = std::chrono::milliseconds(period_ms)};
}

std::string StatusRequests::picture() const {
  const StatusView now = view();
  return written_line("watch", [&](JsonText& to) {
    to.object("status", [&] { put_status(to, now); });
    to.object("cells", [&] { put_cells(to, now); });
    to.object("faults", [&] { put_faults(to, now); });
    to.put("why", why_json(now));
  });
}

}  // namespace bmu
