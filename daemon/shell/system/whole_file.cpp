#include "daemon/shell/system/whole_file.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace bmu {

namespace {

std::string write_to(const std::string& path, const std::string& text) {
  errno = 0;
  std::ofstream stream(path, std::ios::binary);
  stream << text;
  stream.close();
  return stream ? "" : std::strerror(errno);
}

}  // namespace

Result<void, std::string> write_whole_file(const std::string& path, const std::string& text) {
  std::error_code error;
  const std::filesystem::file_status there = std::filesystem::status(path, error);
  const bool is_special = std::filesystem::exists(there) && !std::filesystem::is_regular_file(there);
  // A link stays a link to the same file.
  const std::string file = std::filesystem::exists(there) ? std::filesystem::canonical(path, error).string() : path;
  const std::string beside = is_special ? path : file + ".part";
  if (std::string why = write_to(beside, text); !why.empty()) {
    if (!is_special) std::filesystem::remove(beside, error);
    return failure(std::move(why));
  }
  if (is_special) return {};
  // The new file has the permissions of the old one.
  if (std::filesystem::exists(there)) std::filesystem::permissions(beside, there.permissions(), error);
  std::filesystem::rename(beside, file, error);
  if (!error) return {};
  std::string why = error.message();
  std::filesystem::remove(beside, error);
  return failure(std::move(why));
}

std::string same_file_among(const std::string& path, const std::vector<std::string>& files) {
  for (const std::string& file : files) {
    std::error_code error;
    if (!path.empty() && !file.empty() && std::filesystem::equivalent(path, file, error)) return file;
  }
  return "";
}

}  // namespace bmu
