#include "tools/bmudump/words.hpp"

namespace bmu::dump {

std::string name_text(const MessageSpec* message, std::uint8_t node) {
  if (message == nullptr) return "unknown";
  std::string name(message->name);
  return message->has_node() ? name + " node " + std::to_string(node) : name;
}

std::string failures_text(const IdStatistics& row) {
  std::string text;
  for (std::size_t reason = 0; reason < row.failed.size(); ++reason) {
    if (row.failed[reason] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(to_text(static_cast<RejectReason>(reason))) + " " +
            std::to_string(row.failed[reason]);
  }
  return text;
}

}  // namespace bmu::dump
