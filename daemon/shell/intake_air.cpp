#include "daemon/shell/intake_air.hpp"

#include <array>
#include <charconv>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "daemon/history/helper_thread.hpp"
#include "daemon/shell/owned_fd.hpp"
#include "protocol/units.hpp"

namespace bmu {

namespace {

/// How long the end waits for the kernel.
constexpr Duration end_max = 200ms;
/// The kernel's files hold thousandths of a degree Celsius.
constexpr std::int64_t thousandths_per_dC = 100;
/// Beyond these no sensor measures: the number is something else.
constexpr std::int64_t limit_thousandths = 1'000'000;

/// Text, or why there is none.
Result<std::string, std::string> read_text(const std::string& file) {
  const OwnedFd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  std::array<char, 64> text{};
  const auto count = fd.get() < 0 ? -1 : ::read(fd.get(), text.data(), text.size());
  if (count < 0) return failure(std::system_category().message(errno));
  return std::string(text.data(), static_cast<std::size_t>(count));
}

}  // namespace

std::optional<std::int32_t> air_temperature_dC(std::string_view text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.remove_suffix(1);
  std::int64_t thousandths = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), thousandths);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if (thousandths < -limit_thousandths || thousandths > limit_thousandths) return std::nullopt;
  return static_cast<std::int32_t>(divide_to_nearest(thousandths, thousandths_per_dC));
}

struct IntakeAirReader::Shared {
  Shared(std::string the_file, Log the_log) : file(std::move(the_file)), log(std::move(the_log)) {}

  const std::string file;
  const Log log;
  std::string last_problem;  // the thread's alone; "": it was read

  std::mutex mutex;
  std::condition_variable changed;
  std::optional<std::int32_t> reading_dC;
  bool has_to_end = false;
  bool is_running = false;

  void run();
  void read();
};

void IntakeAirReader::Shared::run() {
  std::unique_lock lock(mutex);
  while (!has_to_end) {
    lock.unlock();
    read();
    lock.lock();
    changed.wait_for(lock, read_every, [this] { return has_to_end; });
  }
  is_running = false;
  changed.notify_all();
}

void IntakeAirReader::Shared::read() {
  const auto text = read_text(file);
  const auto temperature_dC = text ? air_temperature_dC(*text) : std::nullopt;
  std::string problem;
  if (!text) problem = text.error();
  if (text && !temperature_dC) problem = "no number of milli-degrees Celsius";
  const std::lock_guard lock(mutex);
  if (temperature_dC) reading_dC = temperature_dC;
  if (has_to_end || problem == last_problem) return;
  if (problem.empty()) {
    log(Severity::info, "intake air: " + file + " can be read again");
  } else {
    log(Severity::warning, "intake air: " + file + ": " + problem + "; 627h reports an unknown air temperature");
  }
  last_problem = problem;
}

Result<std::unique_ptr<IntakeAirReader>, OsError> IntakeAirReader::start(const std::string& file, Log log) {
  auto shared = std::make_shared<Shared>(file, std::move(log));
  std::unique_ptr<IntakeAirReader> reader(new IntakeAirReader(shared));
  const auto started = start_helper(reader->thread_, "bmud-air", shared);
  if (started) return reader;
  return failure(OsError{.code = started.error(), .what = "start the thread that reads the intake air temperature"});
}

IntakeAirReader::~IntakeAirReader() {
  end_or_leave(thread_, *shared_, end_max);
}

std::optional<std::int32_t> IntakeAirReader::take_dC() {
  const std::unique_lock lock(shared_->mutex, std::try_to_lock);
  if (!lock.owns_lock()) return std::nullopt;
  return std::exchange(shared_->reading_dC, std::nullopt);
}

}  // namespace bmu
