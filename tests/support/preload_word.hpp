// One number that a test sets while a program runs, and that is read by a library loaded into the program before the C
// library (LD_PRELOAD): eight bytes of a file, mapped. Without Catch2, since the library runs outside of a test.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace bmu::test {

/// The library's side: address of the number, by the environment variable that names the file; the library may change
/// it, too. Aborts the program where there is no such file.
inline volatile std::int64_t* preload_word(const char* variable) {
  const char* file = std::getenv(variable);
  const int fd = file != nullptr ? ::open(file, O_RDWR | O_CLOEXEC) : -1;
  if (fd < 0) std::abort();
  void* mapped = ::mmap(nullptr, sizeof(std::int64_t), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  ::close(fd);
  if (mapped == MAP_FAILED) std::abort();
  return static_cast<volatile std::int64_t*>(mapped);
}

/// The test's side: makes the file with the number in it, or changes the number. False: the file cannot be written.
[[nodiscard]] inline bool set_preload_word(const std::string& file, std::int64_t number) {
  { std::ofstream made(file, std::ios::app); }
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.write(reinterpret_cast<const char*>(&number), sizeof number);
  return static_cast<bool>(stream.flush());
}

/// The number in the file now, set by the test or by the library.
[[nodiscard]] inline std::int64_t read_preload_word(const std::string& file) {
  std::int64_t number = 0;
  std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(&number), sizeof number);
  return number;
}

}  // namespace bmu::test
