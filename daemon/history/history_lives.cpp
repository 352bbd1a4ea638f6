#include "daemon/history/history_lives.hpp"

#include <algorithm>
#include <utility>

#include "daemon/history/history_schema.hpp"
#include "daemon/history/minute.hpp"

namespace bmu {

namespace {

// Limit for a forged file; more sessions than a month of starts a minute apart.
constexpr std::size_t lives_max = 50'000;
constexpr std::int64_t default_period_s = 60;
constexpr std::int64_t period_max_s = 86'400;

constexpr const char* select_layouts = "SELECT id, modules FROM layout ORDER BY id";
constexpr std::size_t layout_columns = 2;
constexpr const char* select_lives =
    "SELECT id, token, version, pack_name, config, period_s, layout FROM life ORDER BY id";
constexpr std::size_t life_columns = 7;

std::string words(std::optional<std::string_view> text) {
  return std::string(text.value_or(""));
}

std::string name_of(std::int64_t life) {
  return "life " + std::to_string(life);
}

bool fits(const HistoryLayout& layout, const LifeOfRows& rows) {
  return layout.cell_count() == rows.cells && layout.sensor_count() == rows.sensors;
}

/// Number of entries of each kind ("cell", "sensor", "board") in each module, in the order in which modules appear.
class Counts {
 public:
  void add(const Statement& statement) {
    const std::int64_t node = statement.number(2).value_or(-1);
    auto found = std::find_if(layout_.modules.begin(), layout_.modules.end(),
                              [&](const HistoryModule& module) { return module.node == node; });
    if (found == layout_.modules.end()) {
      if (layout_.modules.size() == modules_max) return;
      found = layout_.modules.insert(found, {.node = node});
    }
    const std::string kind = words(statement.text(1));
    if (kind == "cell") ++found->cells;
    if (kind == "sensor") ++found->cell_sensors;
    if (kind == "board") ++found->board_sensors;
  }
  /// Checked by the rules of the text.
  [[nodiscard]] std::optional<HistoryLayout> layout() const { return layout_from_text(to_text(layout_)); }

 private:
  HistoryLayout layout_;
};

/// Length of most rows: the first and the last of a session are shorter.
std::int64_t period_of(const LifeOfRows& rows) {
  const auto longer = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto most = std::max_element(rows.spans_s.begin(), rows.spans_s.end(), longer);
  return most == rows.spans_s.end() ? default_period_s : std::clamp<std::int64_t>(most->first, 1, period_max_s);
}

}  // namespace

void HistoryLives::read(const Database& database) {
  read_layouts(database);
  if (!problems_.empty()) read_places(database);
  read_table(database);
}

/// `place` has no rowids, by which rows are found page by page; it contains nothing that `layout` does not contain.
void HistoryLives::read(StrayRows& rows) {
  rows.for_each({layout_columns, layout_columns}, 0, history_number_max, [&](const RowValues& row, std::int64_t) {
    take_layout(row);
    return layouts_.size() < lives_max;
  });
  rows.for_each({life_columns, life_columns}, 0, history_number_max, [&](const RowValues& row, std::int64_t id) {
    if (find(id) == nullptr) take_life(id, row);
    return lives_.size() < lives_max;
  });
}

/// Calls `take` for each row of the statement until it returns false: no room for more.
template <class Take>
void HistoryLives::read_rows(const Database& database, const char* statement_text, const std::string& table,
                             Take take) {
  auto statement = database.prepare(statement_text);
  if (!statement) return problem(table + ": " + statement.error().what);
  while (true) {
    const auto has_row = statement->step();
    if (!has_row) return problem(table + ": " + has_row.error().what);
    if (!*has_row || !take(*statement)) return;
  }
}

void HistoryLives::read_layouts(const Database& database) {
  read_rows(database, select_layouts, "table layout", [this](const Statement& row) {
    take_layout(StatementRow(row));
    return layouts_.size() < lives_max;
  });
}

void HistoryLives::take_layout(const RowValues& row) {
  const std::int64_t id = row.number(0).value_or(-1);
  auto layout = layout_from_text(words(row.text(1)));
  if (layout && !layout->modules.empty()) {
    layouts_[id] = std::move(*layout);
  } else {
    problem("layout " + std::to_string(id) + ": makes no sense");
  }
}

/// Adds the layouts that the other table lacks. The last one before a damaged location may be truncated, and is
/// omitted.
void HistoryLives::read_places(const Database& database) {
  auto statement =
      database.prepare("SELECT layout, kind, module FROM place WHERE number >= 1 ORDER BY layout, kind, number");
  if (!statement) return problem("table place: " + statement.error().what);
  std::optional<std::int64_t> id;
  Counts counts;
  while (true) {
    const auto has_row = statement->step();
    if (!has_row) return problem("table place: " + has_row.error().what);
    const HistoryNumber next = *has_row ? statement->number(0) : std::nullopt;
    if (id && next != id) {
      if (auto layout = counts.layout()) layouts_.try_emplace(*id, std::move(*layout));
      counts = {};
    }
    if (!*has_row) return;
    id = next;
    counts.add(*statement);
  }
}

void HistoryLives::read_table(const Database& database) {
  read_rows(database, select_lives, "table life", [this](const Statement& row) {
    const auto id = row.number(0);
    if (!id || (!lives_.empty() && lives_.back().id >= *id)) {
      problem(name_of(id.value_or(-1)) + ": makes no sense");
    } else {
      take_life(*id, StatementRow(row));
    }
    return lives_.size() < lives_max;
  });
}

void HistoryLives::take_life(std::int64_t id, const RowValues& row) {
  HistoryLife life{.id = id,
                   .token = words(row.text(1)),
                   .version = words(row.text(2)),
                   .pack_name = words(row.text(3)),
                   .config = words(row.text(4)),
                   .period_s = row.number(5).value_or(default_period_s)};
  if (life.period_s < 1 || life.period_s > period_max_s) life.period_s = default_period_s;
  const auto layout = layouts_.find(row.number(6).value_or(-1));
  if (layout != layouts_.end()) life.layout = layout->second;
  if (layout == layouts_.end()) problem(name_of(id) + ": its layout cannot be read");
  const auto at = std::lower_bound(lives_.begin(), lives_.end(), id,
                                   [](const HistoryLife& other, std::int64_t wanted) { return other.id < wanted; });
  lives_.insert(at, std::move(life));
}

void HistoryLives::complete(const std::map<std::int64_t, LifeOfRows>& of_rows) {
  for (const auto& [id, rows] : of_rows) {
    const auto at = std::lower_bound(lives_.begin(), lives_.end(), id,
                                     [](const HistoryLife& life, std::int64_t wanted) { return life.id < wanted; });
    if (at != lives_.end() && at->id == id) {
      if (!fits(at->layout, rows)) fill(*at, rows);
      continue;
    }
    if (lives_.size() == lives_max) return;
    const auto made = lives_.insert(at, HistoryLife{.id = id, .version = "?", .period_s = period_of(rows)});
    problem(name_of(id) + ": which pack and which bmud it was cannot be read");
    fill(*made, rows);
  }
}

/// With the only known layout that fits, or a substitute.
void HistoryLives::fill(HistoryLife& life, const LifeOfRows& rows) {
  std::set<std::string> meant;
  for (const auto& [id, layout] : layouts_) {
    if (fits(layout, rows)) meant.insert(to_text(layout));
  }
  if (meant.size() == 1) {
    life.layout = layout_from_text(*meant.begin()).value_or(HistoryLayout{});
    return;
  }
  life.layout.modules = {{.node = 0,
                          .cells = static_cast<std::int64_t>(rows.cells),
                          .cell_sensors = static_cast<std::int64_t>(rows.sensors)}};
  problem(name_of(life.id) + ": which cell sits where cannot be read; they are counted through, 0.1 to 0." +
          std::to_string(rows.cells));
}

const HistoryLife* HistoryLives::find(const HistoryNumber& id) const {
  if (!id) return nullptr;
  const auto found = std::lower_bound(lives_.begin(), lives_.end(), *id,
                                      [](const HistoryLife& life, std::int64_t wanted) { return life.id < wanted; });
  return found != lives_.end() && found->id == *id ? &*found : nullptr;
}

}  // namespace bmu
