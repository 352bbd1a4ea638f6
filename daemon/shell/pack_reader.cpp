#include "daemon/shell/pack_reader.hpp"

#include <cerrno>
#include <mutex>
#include <utility>

#include <sys/eventfd.h>

#include "config/checks/pack_checks.hpp"
#include "daemon/history/helper_thread.hpp"
#include "daemon/shell/system/owned_fd.hpp"

namespace bmu {

struct PackReader::Shared {
  OwnedFd news{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::mutex mutex;
  std::optional<Result<PackRead, ConfigProblems>> read;

  void put(Result<PackRead, ConfigProblems> what) {
    const std::lock_guard lock(mutex);
    read = std::move(what);
    static_cast<void>(::eventfd_write(news.get(), 1));
  }
};

PackRead read_beside(PackConfig file_pack, const std::string& config, const std::string& state_path) {
  PackRead read{.cell_count = std::make_shared<CellCountSetting>(file_pack, state_path),
                .warnings = pack_warnings(file_pack, config),
                .groups = access_groups(),
                .users = UserNames()};
  read.file_pack = std::move(file_pack);
  return read;
}

Result<std::unique_ptr<PackReader>, OsError> PackReader::make() {
  auto shared = std::make_shared<Shared>();
  if (!shared->news.is_open()) return failure(OsError{.code = errno, .what = "eventfd for the pack file"});
  return std::unique_ptr<PackReader>(new PackReader(std::move(shared)));
}

PackReader::~PackReader() {
  if (!thread_.joinable()) return;
  const std::unique_lock lock(shared_->mutex);
  join_or_leave(thread_, shared_->read.has_value());
}

int PackReader::fd() const {
  return shared_->news.get();
}

Result<void, OsError> PackReader::begin(const std::string& config, const std::string& state_path) {
  auto thread = named_thread("bmud-pack", [shared = shared_, config, state_path] {
    auto pack = load_pack_config(config);
    if (!pack) return shared->put(failure(pack.error()));
    shared->put(read_beside(std::move(*pack), config, state_path));
  });
  if (!thread) return failure(OsError{.code = thread.error(), .what = "start the thread that reads " + config});
  thread_ = std::move(*thread);
  return {};
}

std::optional<Result<PackRead, ConfigProblems>> PackReader::take() {
  std::unique_lock lock(shared_->mutex);
  if (!shared_->read) return std::nullopt;
  auto read = std::exchange(shared_->read, std::nullopt);
  eventfd_t count = 0;
  static_cast<void>(::eventfd_read(shared_->news.get(), &count));
  lock.unlock();
  thread_.join();  // it has nothing left to do
  return read;
}

}  // namespace bmu
