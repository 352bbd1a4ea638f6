#include "daemon/shell/link_watch.hpp"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "daemon/history/helper_thread.hpp"
#include "daemon/shell/bus_port.hpp"

namespace bmu {

namespace {

/// What the end may wait for the kernel's lock.
constexpr Duration end_max = 200ms;

}  // namespace

struct LinkWatch::Shared {
  Shared(const std::vector<LinkWanted>& wanted, Log the_log, LinkSystem& the_system)
      : log(std::move(the_log)), system(the_system) {
    for (const LinkWanted& one : wanted) {
      keepers.emplace_back(one.interface_name, one.set_up);
      reports.emplace_back(one.interface_name, LinkReport{.set_up = keepers.back().set_up()});
    }
  }

  const Log log;
  LinkSystem& system;
  std::vector<LinkKeeper> keepers;  // the thread's alone, once it runs

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::pair<std::string, LinkReport>> reports;
  bool has_to_end = false;
  bool is_running = false;

  void run();
  void look_after(std::size_t index);
};

void LinkWatch::Shared::run() {
  std::unique_lock lock(mutex);
  while (!has_to_end) {
    lock.unlock();
    for (std::size_t index = 0; index < keepers.size(); ++index) look_after(index);
    lock.lock();
    changed.wait_for(lock, look_every, [this] { return has_to_end; });
  }
  is_running = false;
  changed.notify_all();
}

void LinkWatch::Shared::look_after(std::size_t index) {
  LinkKeeper& keeper = keepers[index];
  if (keeper.look(system.look(keeper.name()), monotonic_now())) {
    keeper.tried(system.set_up(keeper.name(), *keeper.wanted()), monotonic_now());
    static_cast<void>(keeper.look(system.look(keeper.name()), monotonic_now()));
  }
  const std::lock_guard lock(mutex);
  reports[index].second = {.details = keeper.details(), .set_up = keeper.set_up()};
  // Nothing is told once whom we tell it to may be gone.
  for (const LinkLine& line : keeper.take_lines()) {
    if (!has_to_end) log(line.severity, line.text);
  }
}

Result<std::unique_ptr<LinkWatch>, OsError> LinkWatch::start(const std::vector<LinkWanted>& wanted, Log log,
                                                             LinkSystem& system) {
  auto shared = std::make_shared<Shared>(wanted, std::move(log), system);
  std::unique_ptr<LinkWatch> watch(new LinkWatch(shared));
  watch->latest_ = shared->reports;
  if (wanted.empty()) return watch;
  const auto started = start_helper(watch->thread_, "bmud-links", shared);
  if (started) return watch;
  return failure(OsError{.code = started.error(), .what = "start the thread that manages CAN interfaces"});
}

LinkWatch::~LinkWatch() {
  end_or_leave(thread_, *shared_, end_max);
}

std::optional<LinkReport> LinkWatch::report(const std::string& interface_name) const {
  if (const std::unique_lock lock(shared_->mutex, std::try_to_lock); lock.owns_lock()) latest_ = shared_->reports;
  const auto found =
      std::find_if(latest_.begin(), latest_.end(), [&](const auto& one) { return one.first == interface_name; });
  return found == latest_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace bmu
