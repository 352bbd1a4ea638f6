#include "daemon/shell/system/journal.hpp"

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <string>
#include <utility>

#include <pthread.h>
#include <spdlog/async.h>
#include <spdlog/async_logger.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/systemd_sink.h>
#include <sys/stat.h>
#include <unistd.h>

namespace bmu {

namespace {

struct LevelRow {
  Severity severity;
  std::string_view name;
  spdlog::level::level_enum level;
};

constexpr std::array<LevelRow, 4> level_table{{
    {Severity::debug, "debug", spdlog::level::debug},
    {Severity::info, "info", spdlog::level::info},
    {Severity::warning, "warning", spdlog::level::warn},
    {Severity::error, "error", spdlog::level::err},
}};

spdlog::level::level_enum level_of(Severity severity) {
  return level_table[static_cast<std::size_t>(severity)].level;
}

/// The service manager names the journal's stream as device:inode; stderr may have been redirected since.
bool stderr_is_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");  // NOLINT(concurrency-mt-unsafe): no thread sets it
  struct stat status {};
  if (stream == nullptr || ::fstat(STDERR_FILENO, &status) != 0) return false;
  return std::string(stream) == std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino);
}

std::shared_ptr<spdlog::sinks::sink> make_sink() {
  if (stderr_is_journal()) return std::make_shared<spdlog::sinks::systemd_sink_st>("bmud");
  auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_st>();  // colour on terminals only
  sink->set_pattern("%Y-%m-%d %H:%M:%S.%e %^%-7l%$ %v");
  return sink;
}

/// Sink that counts the lines written, so that flush() can wait for them.
class CountingSink final : public spdlog::sinks::sink {
 public:
  explicit CountingSink(std::shared_ptr<spdlog::sinks::sink> inner) : inner_(std::move(inner)) {}

  void log(const spdlog::details::log_msg& message) override {
    try {
      inner_->log(message);
    } catch (const std::exception&) {
      // A journal that refuses a line cannot log the refusal; it is only counted.
      ++refused_;
    }
    const std::lock_guard lock(mutex_);
    ++written_;
    changed_.notify_all();
  }
  void flush() override { inner_->flush(); }
  void set_pattern(const std::string& pattern) override { inner_->set_pattern(pattern); }
  void set_formatter(std::unique_ptr<spdlog::formatter> formatter) override {
    inner_->set_formatter(std::move(formatter));
  }

  [[nodiscard]] bool wait_for(std::uint64_t lines, Duration at_most) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, at_most, [&] { return written_ >= lines; });
  }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }

 private:
  std::shared_ptr<spdlog::sinks::sink> inner_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t written_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;
};

}  // namespace

std::optional<Severity> severity_from_text(std::string_view text) {
  for (const LevelRow& row : level_table) {
    if (row.name == text) return row.severity;
  }
  return std::nullopt;
}

struct Journal::Parts {
  Severity least = Severity::info;
  std::size_t queue_lines = default_queue_lines;
  std::shared_ptr<CountingSink> sink = std::make_shared<CountingSink>(make_sink());
  std::shared_ptr<spdlog::details::thread_pool> pool;
  std::shared_ptr<spdlog::async_logger> logger;
  std::atomic<std::uint64_t> posted = 0;
  std::uint64_t lost_told = 0;
};

Journal::Journal(Severity least, std::size_t queue_lines) : parts_(std::make_unique<Parts>()) {
  parts_->least = least;
  parts_->queue_lines = queue_lines;
  parts_->pool = std::make_shared<spdlog::details::thread_pool>(
      queue_lines, 1, [] { static_cast<void>(::pthread_setname_np(::pthread_self(), "bmud-log")); });
  parts_->logger = std::make_shared<spdlog::async_logger>("bmud", parts_->sink, parts_->pool,
                                                          spdlog::async_overflow_policy::overrun_oldest);
  parts_->logger->set_level(level_of(least));
  parts_->logger->set_error_handler([](const std::string&) {});
}

Journal::~Journal() {
  if (flush(100ms)) return;
  // The thread hangs in the sink and its pool would wait for it: both stay until the process ends.
  static_cast<void>(parts_.release());
}

void Journal::log(Severity severity, std::string_view line) {
  if (severity < parts_->least) return;
  ++parts_->posted;
  parts_->logger->log(level_of(severity), spdlog::string_view_t(line.data(), line.size()));
}

std::uint64_t Journal::lines_lost() const {
  return parts_->pool->overrun_counter() + parts_->sink->refused();
}

void Journal::tell_lost() {
  const std::uint64_t lost = lines_lost();
  if (lost == parts_->lost_told || parts_->pool->queue_size() > parts_->queue_lines / 2) return;
  const std::uint64_t news = lost - std::exchange(parts_->lost_told, lost);
  log(Severity::warning, std::to_string(news) + " log lines lost: log sink too slow");
}

bool Journal::flush(Duration at_most) {
  const auto wait = [&] { return parts_->sink->wait_for(parts_->posted - parts_->pool->overrun_counter(), at_most); };
  if (!wait()) return false;
  tell_lost();
  return wait();
}

}  // namespace bmu
