#include "tools/bmudump/words.hpp"

namespace bmu::dump {
namespace {

/// Node numbers never do.
bool counts_from_0(const MessageSpec& message) {
  return message.has_node() && message.node_min == 0 && !message.node_0_is_all;
}

}  // namespace

std::string name_text(const MessageSpec* message, std::uint8_t node) {
  if (message == nullptr) return "unknown";
  std::string name(message->name);
  if (!message->has_node()) return name;
  return name + (counts_from_0(*message) ? " number " : " node ") + std::to_string(node);
}

std::string failures_text(const IdStatistics& row) {
  std::string text;
  for (std::size_t reason = 0; reason < row.failed.size(); ++reason) {
    if (row.failed[reason] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(to_text(static_cast<RejectReason>(reason))) + " " +
            std::to_string(row.failed[reason]);
  }
  if (row.message == nullptr || row.unknown() == 0) return text;
  return text + (text.empty() ? "" : ", ") + "unknown " + std::to_string(row.unknown());
}

}  // namespace bmu::dump
