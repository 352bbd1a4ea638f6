// The system's files as SQLite uses them, on a disk that can be made to fail: to be full, to refuse writes or syncs
// from the n-th on, or to hang until it is released. A test can inspect the files between any two writes. The files are
// real; a failed write has written nothing.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstring>
#include <functional>
#include <mutex>
#include <utility>

#include <sqlite3.h>

namespace bmu::test {

class FaultyDisk {
 public:
  static constexpr const char* name = "faulty";

  /// Registers it with SQLite, once. Each caller gets it without faults.
  static FaultyDisk& well() {
    static FaultyDisk disk;
    disk.heal();
    disk.let_go();
    disk.look_ = nullptr;
    disk.writes_ = 0;
    disk.syncs_ = 0;
    return disk;
  }

  /// From the `write`-th write from now on (1: the next) all fail with this code: SQLITE_FULL, SQLITE_IOERR_WRITE.
  void fail_writes(int write, int code) {
    write_error_ = code;
    good_writes_ = write - 1;
  }
  void fail_syncs(int sync) {
    good_syncs_ = sync - 1;
    fails_syncs_ = true;
  }
  void heal() {
    write_error_ = SQLITE_OK;
    fails_syncs_ = false;
  }
  /// Every write blocks until let_go.
  void hang() {
    const std::lock_guard lock(mutex_);
    is_hanging_ = true;
  }
  void let_go() {
    const std::lock_guard lock(mutex_);
    is_hanging_ = false;
    let_go_.notify_all();
  }
  /// Called before each write and each sync, in the writing thread: it sees the files as other programs do at that
  /// time.
  void before_each(std::function<void()> look) { look_ = std::move(look); }
  [[nodiscard]] int writes() const { return writes_; }
  [[nodiscard]] int syncs() const { return syncs_; }

 private:
  struct File {
    sqlite3_file base;
    sqlite3_file* real;
  };

  FaultyDisk() {
    real_ = sqlite3_vfs_find(nullptr);
    vfs_ = *real_;
    vfs_.zName = name;
    vfs_.pNext = nullptr;
    vfs_.szOsFile = static_cast<int>(sizeof(File)) + real_->szOsFile;
    vfs_.xOpen = [](sqlite3_vfs*, const char* path, sqlite3_file* file, int flags, int* out_flags) {
      return instance->open(path, file, flags, out_flags);
    };
    instance = this;
    fill_methods();
    sqlite3_vfs_register(&vfs_, 0);
  }

  int open(const char* path, sqlite3_file* file, int flags, int* out_flags) {
    auto* const ours = reinterpret_cast<File*>(file);
    ours->real = reinterpret_cast<sqlite3_file*>(ours + 1);
    std::memset(ours->real, 0, static_cast<std::size_t>(real_->szOsFile));
    const int code = real_->xOpen(real_, path, ours->real, flags, out_flags);
    ours->base.pMethods = ours->real->pMethods == nullptr ? nullptr : &methods_;
    return code;
  }

  int before_write() {
    ++writes_;
    if (look_) look_();
    std::unique_lock lock(mutex_);
    let_go_.wait(lock, [this] { return !is_hanging_; });
    if (write_error_ == SQLITE_OK) return SQLITE_OK;
    return good_writes_-- > 0 ? SQLITE_OK : write_error_.load();
  }
  int before_sync() {
    ++syncs_;
    if (look_) look_();
    if (!fails_syncs_) return SQLITE_OK;
    return good_syncs_-- > 0 ? SQLITE_OK : SQLITE_IOERR_FSYNC;
  }

  static sqlite3_file* real(sqlite3_file* file) { return reinterpret_cast<File*>(file)->real; }
  static const sqlite3_io_methods& of(sqlite3_file* file) { return *real(file)->pMethods; }

  void fill_methods() {
    methods_.iVersion = 2;
    methods_.xClose = [](sqlite3_file* file) { return of(file).xClose(real(file)); };
    methods_.xRead = [](sqlite3_file* file, void* to, int count, sqlite3_int64 at) {
      return of(file).xRead(real(file), to, count, at);
    };
    methods_.xWrite = [](sqlite3_file* file, const void* from, int count, sqlite3_int64 at) {
      const int code = instance->before_write();
      return code == SQLITE_OK ? of(file).xWrite(real(file), from, count, at) : code;
    };
    methods_.xTruncate = [](sqlite3_file* file, sqlite3_int64 size) { return of(file).xTruncate(real(file), size); };
    methods_.xSync = [](sqlite3_file* file, int flags) {
      const int code = instance->before_sync();
      return code == SQLITE_OK ? of(file).xSync(real(file), flags) : code;
    };
    methods_.xFileSize = [](sqlite3_file* file, sqlite3_int64* size) { return of(file).xFileSize(real(file), size); };
    methods_.xLock = [](sqlite3_file* file, int level) { return of(file).xLock(real(file), level); };
    methods_.xUnlock = [](sqlite3_file* file, int level) { return of(file).xUnlock(real(file), level); };
    methods_.xCheckReservedLock = [](sqlite3_file* file, int* is_reserved) {
      return of(file).xCheckReservedLock(real(file), is_reserved);
    };
    methods_.xFileControl = [](sqlite3_file* file, int what, void* with) {
      return of(file).xFileControl(real(file), what, with);
    };
    methods_.xSectorSize = [](sqlite3_file* file) { return of(file).xSectorSize(real(file)); };
    methods_.xDeviceCharacteristics = [](sqlite3_file* file) { return of(file).xDeviceCharacteristics(real(file)); };
    methods_.xShmMap = [](sqlite3_file* file, int page, int size, int extends, void volatile** to) {
      return of(file).xShmMap(real(file), page, size, extends, to);
    };
    methods_.xShmLock = [](sqlite3_file* file, int offset, int count, int flags) {
      return of(file).xShmLock(real(file), offset, count, flags);
    };
    methods_.xShmBarrier = [](sqlite3_file* file) { of(file).xShmBarrier(real(file)); };
    methods_.xShmUnmap = [](sqlite3_file* file, int removes) { return of(file).xShmUnmap(real(file), removes); };
  }

  static inline FaultyDisk* instance = nullptr;
  sqlite3_vfs* real_ = nullptr;
  sqlite3_vfs vfs_{};
  sqlite3_io_methods methods_{};
  std::mutex mutex_;
  std::condition_variable let_go_;
  bool is_hanging_ = false;
  std::function<void()> look_;
  std::atomic<int> write_error_ = SQLITE_OK;
  std::atomic<int> good_writes_ = 0;
  std::atomic<bool> fails_syncs_ = false;
  std::atomic<int> good_syncs_ = 0;
  std::atomic<int> writes_ = 0;
  std::atomic<int> syncs_ = 0;
};

}  // namespace bmu::test
