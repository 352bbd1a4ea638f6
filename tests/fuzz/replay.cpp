// Runs a fuzz target on files, and on all files of folders, once each: the replacement of libFuzzer for other
// compilers. The first input that breaks a promise, crashes or takes too long ends the run and is named.
//
//   fuzz_candump tests/fuzz/corpora/candump
#include <array>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <sys/time.h>
#include <unistd.h>

#include "tests/fuzz/fuzz.hpp"

namespace {

/// Processor time, independent of the load of the machine. The slowest input takes a hundredth of it under the
/// sanitizers.
constexpr itimerval input_max{.it_interval = {}, .it_value = {.tv_sec = 60, .tv_usec = 0}};

std::array<char, 1024> input_name{};  // for the handler, which may not allocate

extern "C" void tell_input(int signal) {
  constexpr std::string_view lead = "the input was ";
  // The result of write() is not needed, because the process ends anyway.
  if (::write(STDERR_FILENO, lead.data(), lead.size()) > 0 &&
      ::write(STDERR_FILENO, input_name.data(), std::strlen(input_name.data())) > 0) {
    static_cast<void>(::write(STDERR_FILENO, "\n", 1) > 0);
  }
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

void try_bytes(const std::string& name, const std::string& bytes) {
  std::snprintf(input_name.data(), input_name.size(), "%s", name.c_str());
  ::setitimer(ITIMER_PROF, &input_max, nullptr);
  // A copy of exactly this size: the sanitizers detect reads beyond its end.
  const std::vector<std::uint8_t> input(bytes.begin(), bytes.end());
  static_cast<void>(LLVMFuzzerTestOneInput(input.data(), input.size()));
}

bool try_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!in.is_open() || in.bad()) {
    std::fprintf(stderr, "cannot read %s\n", file.c_str());
    return false;
  }
  try_bytes(file.string(), bytes);
  return true;
}

/// A file, or all files of a folder sorted by name.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return {path};
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGPROF}) ::signal(signal, tell_input);
  try_bytes("nothing at all", "");
  std::size_t count = 0;
  for (int index = 1; index < argc; ++index) {
    for (const std::filesystem::path& file : files_of(argv[index])) {
      if (!try_file(file)) return 1;
      ++count;
    }
  }
  if (count == 0) std::fprintf(stderr, "no input: name files, or folders of them\n");
  std::printf("%zu inputs\n", count);
  return count == 0 ? 1 : 0;
}
