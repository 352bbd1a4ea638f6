#include "daemon/shell/recorder/kept_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <system_error>
#include <utility>

#include <unistd.h>

namespace bmu {

namespace {

constexpr std::string_view suffix = ".log.zst";
/// Maximum number of files of one millisecond; more are no coincidence.
constexpr int names_max = 99;
constexpr std::string_view after = "-after-";
/// Length of "20261122T231500.123Z".
constexpr std::size_t utc_size = 20;

std::string utc_text(std::int64_t unix_time_us) {
  const auto seconds = static_cast<std::time_t>(unix_time_us / 1'000'000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 40> date{};
  const std::size_t length = std::strftime(date.data(), date.size(), "%Y%m%dT%H%M%S", &utc);
  std::array<char, 16> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03dZ", static_cast<int>(unix_time_us / 1000 % 1000));
  return std::string(date.data(), length) + fraction.data();
}

/// Whether the text has the form of utc_text().
bool is_utc_text(std::string_view text) {
  constexpr std::string_view form = "ddddddddTdddddd.dddZ";
  return std::equal(text.begin(), text.end(), form.begin(), form.end(), [](char letter, char wanted) {
    return wanted == 'd' ? letter >= '0' && letter <= '9' : letter == wanted;
  });
}

/// Order of a file among the others, the oldest first.
struct Place {
  std::string_view time{};   // its own, or that of the file which it follows; "": the name has another form
  std::uint64_t number = 0;  // count of files after that one; 0: the time is its own

  friend bool operator<(const Place& one, const Place& other) {
    return std::pair(one.time, one.number) < std::pair(other.time, other.number);
  }
};

/// `stem`: the name without the prefix.
Place place_of(std::string_view stem) {
  const std::string_view own = stem.substr(0, utc_size);
  if (!is_utc_text(own)) return {};
  stem.remove_prefix(own.size());
  if (!stem.starts_with(after)) return {.time = own};
  const std::string_view other = stem.substr(after.size(), utc_size);
  if (!is_utc_text(other)) return {.time = own};
  stem.remove_prefix(after.size() + other.size());
  std::uint64_t number = 0;
  if (!stem.starts_with('-')) return {.time = own};
  const auto read = std::from_chars(stem.data() + 1, stem.data() + stem.size(), number);
  return read.ec == std::errc{} ? Place{other, number} : Place{.time = own};
}

char in_file_name(char letter) {
  const auto byte = static_cast<unsigned char>(letter);
  return std::isalnum(byte) != 0 && byte < 128 ? static_cast<char>(std::tolower(byte)) : '-';
}

}  // namespace

std::string KeptFiles::path_of(const std::string& times, std::string_view word) const {
  std::string path = folder_ + "/" + prefix_ + "-" + times;
  if (!word.empty()) path += '-';
  std::transform(word.begin(), word.end(), std::back_inserter(path), in_file_name);
  return path + std::string(suffix);
}

Result<AppendFile, OsError> KeptFiles::create(std::int64_t unix_time_us, std::string_view word) const {
  const auto files = list();
  if (!files) return failure(files.error());
  std::string times = utc_text(std::max<std::int64_t>(unix_time_us, 0));
  const std::string newest = files->empty() ? "" : files->back().name;
  const Place before = place_of(std::string_view(newest).substr(newest.empty() ? 0 : prefix_.size() + 1));
  // Files with the same time as the newest one are numbered instead.
  if (Place{.time = times} < before) {
    times += std::string(after) + std::string(before.time) + "-" + std::to_string(before.number + 1);
  }
  const std::string path = path_of(times, word);
  auto file = AppendFile::create(path);
  for (int number = 2; !file && file.error().code == EEXIST && number <= names_max; ++number) {
    const std::string begin = path.substr(0, path.size() - suffix.size());
    file = AppendFile::create(begin + "-" + std::to_string(number) + std::string(suffix));
  }
  return file;
}

Result<std::vector<KeptFile>, OsError> KeptFiles::list() const {
  std::error_code error;
  std::vector<KeptFile> files;
  const std::string beginning = prefix_ + "-";
  for (std::filesystem::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    const bool is_ours = name.starts_with(beginning) && name.ends_with(suffix);
    std::error_code is_gone;  // removed since the folder was read
    if (!is_ours || !at->is_regular_file(is_gone)) continue;
    const std::uintmax_t size = at->file_size(is_gone);
    if (!is_gone) files.push_back({.name = name, .size_bytes = size});
  }
  if (error) return failure(OsError{.code = error.value(), .what = "read folder " + folder_});
  const auto place = [&](const KeptFile& file) {
    return place_of(std::string_view(file.name).substr(beginning.size()));
  };
  std::sort(files.begin(), files.end(), [&](const KeptFile& a, const KeptFile& b) {
    return std::pair(place(a), std::string_view(a.name)) < std::pair(place(b), std::string_view(b.name));
  });
  return files;
}

Result<void, OsError> KeptFiles::make_room(const KeptFilesLimits& limits, std::uint64_t room_bytes,
                                           std::string_view first) const {
  auto files = list();
  if (!files) return failure(files.error());
  if (files->empty()) return {};
  const std::uint64_t newest_bytes = files->back().size_bytes;
  files->pop_back();
  std::stable_partition(files->begin(), files->end(), [&](const KeptFile& file) {
    return !first.empty() && file.name.find(first) != std::string::npos;
  });
  // The newest file stays, and counts; so does the one that will be created.
  std::size_t count = files->size() + 2;
  std::uint64_t total = newest_bytes + room_bytes;
  for (const KeptFile& file : *files) total += file.size_bytes;
  for (const KeptFile& file : *files) {
    const bool fits = (limits.count_max == 0 || count <= limits.count_max) &&
                      (limits.total_bytes == 0 || total <= limits.total_bytes);
    if (fits) break;
    const std::string path = folder_ + "/" + file.name;
    if (::unlink(path.c_str()) != 0 && errno != ENOENT)
      return failure(OsError{.code = errno, .what = "remove " + path});
    --count;
    total -= file.size_bytes;
  }
  return {};
}

}  // namespace bmu
