#include "tools/bmuctl/history_file.hpp"

#include <chrono>

#include <nlohmann/json.hpp>

#include "tools/bmuctl/client.hpp"
#include "tools/bmuctl/reply.hpp"

namespace bmu {

namespace {

constexpr const char* file_of_service = "/var/lib/bmud/history.sqlite";
constexpr std::chrono::milliseconds answer_max{500};

/// The path that the daemon reports, if one runs.
std::string file_of_daemon(const std::string& socket) {
  auto client = Client::connect(socket);
  if (!client || !client->send_line(R"({"cmd":"status"})")) return "";
  const auto line = client->read_line(answer_max);
  if (!line) return "";
  const nlohmann::json json = nlohmann::json::parse(*line, nullptr, false);
  return Reply(json)["history"]["path"].text();
}

}  // namespace

std::string history_file(const std::string& socket) {
  std::string file = file_of_daemon(socket);
  return file.empty() ? file_of_service : file;
}

}  // namespace bmu
