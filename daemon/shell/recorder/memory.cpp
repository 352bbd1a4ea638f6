#include "daemon/shell/recorder/memory.hpp"

#include <array>
#include <cstdio>
#include <random>

namespace bmu {

namespace {

// Maximum waits for a disk at the end.
constexpr Duration history_flush_max = 200ms;
constexpr Duration recorder_end_max = 500ms;
constexpr std::int64_t bytes_per_MB = 1'000'000;

RecorderOptions recorder_options(const MemoryOptions& options, const PackConfig& pack) {
  RecorderOptions wanted;
  wanted.head = {.version = BMUD_VERSION,
                 .buses = record_buses(pack.buses),
                 .sources = pack.sources,
                 .hash = pack.core.hash,
                 .internal_kbit_per_s = pack.buses.internal_kbit_per_s};
  wanted.files.folder = options.record_folder;
  wanted.files.file_bytes = options.record_file_bytes;
  wanted.files.total_bytes = options.record_total_bytes;
  wanted.black_box.folder = options.black_box_folder;
  return wanted;
}

HistoryStoreOptions history_options(const MemoryOptions& options, const PackConfig& pack) {
  return {.file = {.path = options.history_path,
                   .keep_days = pack.history.keep_days,
                   .size_max_bytes = pack.history.size_max_MB * bytes_per_MB}};
}

HistoryLife history_life(const PackConfig& pack) {
  std::random_device random;
  return {.token = std::to_string(std::uint64_t{random()} << 32U | random()),
          .version = BMUD_VERSION,
          .pack_name = pack.name,
          .config = hash_text(pack),
          .period_s = pack.history.period_s,
          .layout = layout_of(pack.core)};
}

HistoryTap::Log log_to(Journal& journal) {
  return [&journal](Severity severity, std::string_view line) { journal.log(severity, line); };
}

}  // namespace

std::string hash_text(const PackConfig& pack) {
  std::array<char, 20> hash{};
  std::snprintf(hash.data(), hash.size(), "%016llx", static_cast<unsigned long long>(pack.core.hash));
  return hash.data();
}

Memory::Memory(const MemoryOptions& options, const PackConfig& pack, const Core& core, Journal& journal)
    : journal_(journal),
      history_(history_options(options, pack), history_life(pack)),
      history_tap_(core, history_, std::chrono::seconds(pack.history.period_s), log_to(journal)) {}

Result<void, OsError> Memory::make_folders(const MemoryOptions& options) {
  auto made = make_record_folder(options.black_box_folder);
  return made ? make_record_folder(options.record_folder) : made;
}

Result<std::unique_ptr<Memory>, OsError> Memory::open(const MemoryOptions& options, const PackConfig& pack,
                                                      const Core& core, Journal& journal) {
  std::unique_ptr<Memory> memory(new Memory(options, pack, core, journal));
  if (!options.black_box_folder.empty() || !options.record_folder.empty()) {
    auto recorder = Recorder::open(recorder_options(options, pack), core);
    if (!recorder) return failure(recorder.error());
    memory->recorder_ = std::move(*recorder);
    memory->recorder_->feed().begin(core.started_at());
    memory->recorder_->start();
  }
  memory->history_.start();
  return memory;
}

std::vector<CoreTap*> Memory::taps() {
  std::vector<CoreTap*> taps{&history_tap_};
  if (recorder_) taps.push_back(&recorder_->feed());
  return taps;
}

void Memory::tell() {
  if (recorder_) teller_.tell(recorder_->status(), recorder_->pieces_lost(), log_to(journal_));
}

void Memory::end() {
  history_tap_.finish();
  const RecorderEnd recorded = recorder_ ? recorder_->end(recorder_end_max) : RecorderEnd::all_written;
  tell();
  if (recorded == RecorderEnd::some_lost) journal_.log(Severity::warning, "recording: last entries missing");
  if (recorded == RecorderEnd::still_writing) {
    journal_.log(Severity::warning,
                 "shutdown: recorder not finished within the timeout; the recording may be incomplete");
  }
  if (!history_.flush(history_flush_max))
    journal_.log(Severity::warning, "shutdown: history not finished within the timeout");
}

}  // namespace bmu
