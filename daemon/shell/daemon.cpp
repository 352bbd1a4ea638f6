#include "daemon/shell/daemon.hpp"

#include <utility>

#include <unistd.h>

#include "daemon/shell/system/real_time.hpp"

namespace bmu {

namespace {

// Limit of the wait for the disk at the end; well below the stop timeout of the service manager.
constexpr Duration state_flush_max = 500ms;

std::string error_with_problems(const std::string& why, const std::vector<std::string>& problems) {
  Json line{{"ok", false}, {"error", {{"code", "refused"}, {"message", why}}}};
  if (!problems.empty()) line["error"]["problems"] = problems;
  return line.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::vector<std::string> texts_of(const ConfigProblems& problems) {
  std::vector<std::string> texts;
  for (const ConfigProblem& problem : problems) texts.push_back(to_text(problem));
  return texts;
}

std::string_view loaded_text(FileFound found) {
  switch (found) {
    case FileFound::nothing: return "missing";
    case FileFound::newest: return "current version loaded";
    case FileFound::previous: return "previous version loaded";
    case FileFound::unreadable: return "unreadable";
  }
  return "?";
}

bool is_same_pack(const PackConfig& one, const PackConfig& other) {
  return one.core.hash == other.core.hash && cell_count(one.core) == cell_count(other.core);
}

}  // namespace

Daemon::Daemon(const Options& options, Journal& journal)
    : options_(options),
      journal_(journal),
      access_({.own_user_id = ::geteuid()}, UserNames(),
              [&journal](std::string_view line) { journal.log(Severity::warning, line); }) {}

int Daemon::run(const PackConfig& pack) {
  if (auto claimed = claim_files(); !claimed) return fail({.text = to_text(claimed.error())});
  PackRead first = read_beside(pack, options_.config, state_path(options_));
  for (const ConfigProblem& warning : first.warnings) journal_.log(Severity::warning, to_text(warning));
  if (auto opened = open(); !opened) return fail({.text = to_text(opened.error())});
  take_accounts(first);
  journal_.log(Severity::info, access_.text());
  auto plan = LifePlan::make(std::move(first), options_, nullptr);
  if (!plan) return fail(plan.error());
  plan_ = std::move(*plan);
  if (auto claimed = claim_folders(); !claimed) return fail({.text = to_text(claimed.error())});
  log_state();
  auto life = DaemonLife::begin(*plan_, world(), {});
  if (!life) return fail({.text = to_text(life.error())});
  life_ = std::move(*life);
  store_->start();
  if (auto entered = enter_real_time(options_.real_time); !entered) return fail({.text = to_text(entered.error())});
  while (true) {
    const auto ended = run_life();
    if (!ended) return fail({.text = to_text(ended.error())});
    if (*ended == LoopEnd::ended) break;
    if (auto begun = begin_next(); !begun) return fail(begun.error());
  }
  if (asker_) refuse_reload(std::string(to_text(ReloadRefusal::ending)));
  journal_.log(Severity::info, "stopped");
  return exit_ok;
}

Result<void, OsError> Daemon::claim_files() {
  auto claimed = sole_use_.add_file(state_path(options_), "--state");
  if (claimed) claimed = sole_use_.add_file(history_path(options_), "--history");
  return claimed ? sole_use_.add_file(options_.driven_lines, "--driven-lines") : claimed;
}

/// Precondition: LifePlan::make() has created the folders.
Result<void, OsError> Daemon::claim_folders() {
  auto record = sole_use_.add_folder(options_.record, "--record");
  return record ? sole_use_.add_folder(black_box_folder(options_), "--black-box") : record;
}

Result<void, OsError> Daemon::open() {
  auto socket = StatusSocket::open({.path = options_.socket});
  if (!socket) return failure(socket.error());
  socket_ = std::move(*socket);
  auto store = StateStore::open({.path = state_path(options_)});
  if (!store) return failure(store.error());
  store_ = std::move(*store);
  auto reader = PackReader::make();
  if (!reader) return failure(reader.error());
  reader_ = std::move(*reader);
  return {};
}

int Daemon::fail(const LifeFailure& failure) {
  journal_.log(Severity::error, failure.text);
  return failure.exit_code;
}

LifeWorld Daemon::world() {
  return {.options = options_,
          .journal = journal_,
          .notify = notify_,
          .socket = *socket_,
          .store = *store_,
          .access = access_,
          .reload = [this](const Peer& peer) { return reload_for(peer); },
          .reload_by_signal = [this](const SignalFrom& from) { reload_by(from); },
          .pack_reader = {.fd = reader_->fd(), .call = [this] { take_read(); }},
          .reloads = reloads_};
}

/// Runs the session to its end, then waits for its history and recordings; if the process ends, for the state file too.
Result<LoopEnd, OsError> Daemon::run_life() {
  auto ended = life_->run();
  left_at_ = monotonic_now();
  // No tick follows in this session, and the writing takes as long as the disk needs. No output is commanded any more,
  // whatever ended the loop: the contactors need no watchdog of this process.
  notify_.away();
  life_->finish();
  const bool is_end = !ended || *ended == LoopEnd::ended;
  if (is_end && !store_->flush(state_flush_max)) {
    journal_.log(Severity::warning, "shutdown: state file write not finished within the timeout");
  }
  return ended;
}

void Daemon::log_state() const {
  const StateFound& found = store_->found();
  if (store_->path().empty()) {
    return journal_.log(
        Severity::warning,
        "state file: none (--state); fault counters, latches and contactor wear will be lost at shutdown");
  }
  if (found.found == FileFound::unreadable) {
    journal_.log(Severity::error, "state file: unreadable: " + found.problems);
  } else if (!found.problems.empty()) {
    journal_.log(Severity::warning, "state file: previous version loaded: " + found.problems);
  }
  if (found.unknown_names > 0) {
    journal_.log(Severity::warning,
                 "state file: " + std::to_string(found.unknown_names) + " unknown faults or contactors ignored");
  }
  if (!found.charges_problem.empty()) {
    journal_.log(Severity::warning, "state file: cell charges ignored: " + found.charges_problem);
  }
  if (!found.soc_problem.empty()) {
    journal_.log(Severity::warning, "state file: SOC ignored: " + found.soc_problem);
  }
  journal_.log(Severity::info, "state file " + store_->path() + ": " + loaded_text(found.found));
}

// --- reload ---------------------------------------------------------------------------------------------------------

StatusReply Daemon::reload_for(const Peer& peer) {
  const std::string why = ask_reload({.who = access_.users().text_of(peer), .connection = peer.connection});
  if (!why.empty()) return refusal("refused", why);
  return {.line = "", .is_later = true};
}

void Daemon::reload_by(const SignalFrom& from) {
  const Peer sender{.user_id = from.user_id, .process_id = from.process_id};
  const std::string who = access_.users().text_of(sender) + " with SIGHUP";
  const std::string why = ask_reload({.who = who});
  if (!why.empty()) journal_.log(Severity::warning, "reload by " + who + " refused: " + why);
}

/// Starts a reload. "": the file is being read; otherwise the reason why not.
std::string Daemon::ask_reload(Asker asker) {
  if (asker_) return std::string(to_text(ReloadRefusal::under_way));
  notify_.reloading();
  std::string why;
  if (const ReloadRefusal refusal = reload_refusal(life_->core(), monotonic_now()); refusal != ReloadRefusal::none) {
    why = to_text(refusal);
  } else if (const auto begun = reader_->begin(options_.config, state_path(options_)); !begun) {
    why = to_text(begun.error());
  }
  if (why.empty()) {
    asker_ = std::move(asker);
  } else {
    notify_.ready();
  }
  return why;
}

/// Handles the file that has been read. Checks again for a refusal: the pack may have been closed meanwhile.
void Daemon::take_read() {
  auto read = reader_->take();
  if (!read || !asker_) return;
  const ReloadRefusal refusal = reload_refusal(life_->core(), monotonic_now());
  if (!*read) {
    refuse_reload(options_.config + " is invalid; running configuration unchanged", texts_of(read->error()));
  } else if (refusal != ReloadRefusal::none) {
    refuse_reload(std::string(to_text(refusal)));
  } else {
    plan_next(std::move(**read));
  }
  if (!asker_) notify_.ready();  // this session continues
}

void Daemon::plan_next(PackRead read) {
  done_ = {.hash_before = hash_text(plan_->wanted),
           .hash_now = hash_text(read.file_pack),
           .changes = pack_changes(plan_->wanted.sources, read.file_pack.sources),
           .warnings = texts_of(read.warnings)};
  if (is_same_pack(read.cell_count->pack(), plan_->wanted)) {
    take_accounts(read);
    return end_reload(done_);
  }
  auto next = LifePlan::make(std::move(read), options_, plan_.get());
  if (!next) return refuse_reload(next.error().text + "; running configuration unchanged");
  next_ = std::move(*next);
  done_.is_new_life = true;
  journal_.log(Severity::info,
               "reload by " + asker_->who + ": starting a new session with configuration " + done_.hash_now);
  life_->leave();
}

/// Replaces the ended session by the planned one. If that cannot start, starts a session with the previous plan again.
Result<void, LifeFailure> Daemon::begin_next() {
  Legacy legacy = life_->legacy(*next_, left_at_);
  store_->carry_over(life_->core().persistent());
  life_.reset();
  auto life = DaemonLife::begin(*next_, world(), legacy);
  if (life) {
    plan_ = std::move(next_);
    life_ = std::move(*life);
    take_accounts(plan_->read);
    ++reloads_;
    done_.away = monotonic_now() - left_at_;
    end_reload(done_);
    return {};
  }
  const std::string why = to_text(life.error());
  next_.reset();
  legacy.claim_held_until = {};  // the failed begin() took an unknown time
  auto again = DaemonLife::begin(*plan_, world(), legacy);
  if (!again) {
    return failure(
        LifeFailure{.text = why + "; restoring the previous configuration failed: " + to_text(again.error())});
  }
  life_ = std::move(*again);
  refuse_reload(why + "; previous configuration restored");
  return {};
}

void Daemon::take_accounts(const PackRead& read) {
  access_.replace(read.groups, read.users);
  if (auto set = socket_->set_for_all(access_.is_by_group()); !set) {
    journal_.log(Severity::warning, to_text(set.error()));
  }
  socket_->set_door([this](const Peer& peer) {
    return access_.may(peer, Right::read) ? "" : access_.refuse(peer, Right::read, "read", monotonic_now());
  });
}

void Daemon::refuse_reload(const std::string& why, const std::vector<std::string>& problems) {
  const Asker asker = *std::exchange(asker_, std::nullopt);
  journal_.log(Severity::warning, "reload by " + asker.who + " refused: " + why);
  for (const std::string& problem : problems) journal_.log(Severity::warning, problem);
  if (asker.connection != 0) socket_->answer_later(asker.connection, error_with_problems(why, problems));
}

void Daemon::end_reload(const ReloadDone& done) {
  const Asker asker = *std::exchange(asker_, std::nullopt);
  for (const std::string& line : reload_lines(done)) {
    journal_.log(Severity::info, "reload by " + asker.who + ": " + line);
  }
  for (const std::string& warning : done.warnings) journal_.log(Severity::warning, warning);
  if (asker.connection != 0) socket_->answer_later(asker.connection, reply_line("reload", reload_json(done)));
}

}  // namespace bmu
