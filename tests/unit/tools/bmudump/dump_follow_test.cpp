// Table of --follow in windows of all widths: values first, and no column runs into its neighbour.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "protocol/tables/internal_bus.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/worked_frames.hpp"
#include "tools/bmudump/dump.hpp"
#include "tools/bmudump/follow_columns.hpp"

namespace {

using namespace bmu;
using namespace bmu::dump;
using namespace bmu::test;

/// Table in a window, with the frames shown so far.
class Table {
 public:
  explicit Table(const std::vector<std::string>& buses) {
    options_.output = Output::follow;
    dump_ = std::make_unique<Dump>(options_, catalogues_, filter_, std::span<const BusChoice>(), -1);
    for (const std::string& bus : buses) {
      for (int turn = 0; turn < 3; ++turn) {
        for (const WorkedFrame& worked : internal_worked_frames()) show(bus, worked, turn);
      }
    }
  }
  [[nodiscard]] std::vector<std::string> draw(int width, int height = 40, const Follow::Place& place = {}) {
    Canvas canvas(width, height, "~");
    dump_->follow()->draw(now_us_, place, canvas);
    std::vector<std::string> rows;
    for (int row = 0; row < height; ++row) rows.push_back(canvas.row_text(row, false));
    return rows;
  }
  [[nodiscard]] std::string row(const std::string& id, int width, const Follow::Place& place = {}) {
    for (const std::string& text : draw(width, 40, place)) {
      if (text.starts_with(id)) return text;
    }
    return "";
  }
  [[nodiscard]] std::size_t value_max() const { return dump_->follow()->value_max(); }
  /// Shows a frame with an unknown identifier at this time.
  void show_unknown(std::uint32_t id, std::int64_t time_us) {
    now_us_ = std::max(now_us_, time_us);
    CHECK(dump_->show({.kind = LogLineKind::frame, .time_us = time_us, .bus = "can0", .frame = data_frame(id, 0)}));
  }

 private:
  void show(const std::string& bus, const WorkedFrame& worked, int turn) {
    CanFrame frame = worked.frame();
    seal(*worked.message, static_cast<std::uint8_t>(worked.counter + turn), frame);
    now_us_ += 10'000;
    CHECK(dump_->show({.kind = LogLineKind::frame, .time_us = now_us_, .bus = bus, .frame = frame}));
  }

  Options options_;
  Catalogues catalogues_{{}, dialect_table, "auto"};
  Filter filter_;
  std::unique_ptr<Dump> dump_;
  std::int64_t now_us_ = 1'000'000;
};

int sum_of(const FollowColumns& fit) {
  return fit.bus + fit.id + fit.name + fit.frames + fit.rate + fit.gap + fit.age;
}

}  // namespace

TEST_CASE("the values have half of any window, nearly, and the columns never more than all of it",
          "[unit][bmudump][follow]") {
  for (const int bus : {0, 5, 30}) {
    for (const int id : {3, 8}) {
      for (const int name : {7, 17, 30}) {
        for (int width = 40; width <= 300; ++width) {
          const FollowColumns fit = fit_columns({.bus = bus, .id = id, .name = name}, width);
          CAPTURE(bus, id, name, width);
          CHECK(sum_of(fit) + fit.values_space + fit.values == width);
          // Only identifiers that are required to distinguish rows may take more, in the narrowest.
          const bool has_numbers = fit.rate > 0;
          CHECK(fit.values >= (has_numbers ? std::max(width / 2, 46) : width / 5));
          CHECK((fit.bus > 0) == (bus > 0));
          CHECK(fit.name >= 8);
        }
      }
    }
  }
}

TEST_CASE("numbers go one by one as the window narrows, and come back", "[unit][bmudump][follow]") {
  const auto shown = [](int width) {
    const FollowColumns fit = fit_columns({.bus = 0, .id = 3, .name = 17}, width);
    return std::array{fit.rate > 0, fit.age > 0, fit.gap > 0, fit.frames > 0};
  };
  CHECK(shown(40) == std::array{false, false, false, false});
  CHECK(shown(60) == std::array{false, false, false, false});
  CHECK(shown(80) == std::array{true, false, false, false});
  CHECK(shown(90) == std::array{true, true, false, false});
  CHECK(shown(100) == std::array{true, true, true, false});
  CHECK(shown(120) == std::array{true, true, true, true});
  for (int width = 40; width < 200; ++width) {
    for (std::size_t column = 0; column < 4; ++column) CHECK(shown(width)[column] <= shown(width + 1)[column]);
  }
}

TEST_CASE("in 80 columns a row has its values, with short names and a mark where they are cut",
          "[unit][bmudump][follow]") {
  Table table({"can0"});
  CHECK(table.draw(80)[1] == "id  message               rate  values");
  CHECK(table.row("143", 80) == "143 CELLS_1 node 3       7.1/s  cell_voltage_1 3.6512 V  _2 3.6498  _3 3.6530");
  CHECK(table.row("143", 120) ==
        "143 CELLS_1 node 3             3   7.1/s  0.14 s  0.11 s  cell_voltage_1 3.6512 V  _2 3.6498  _3 3.6530");
  CHECK(table.row("143", 60) == "143 CELLS_1 node 3    cell_voltage_1 3.6512 V  _2 3.6498  _~");
  CHECK(table.row("143", 40) == "143 CELLS_1 node 3 cell_voltage_1 3.651~");
  CHECK(table.row("040", 40).starts_with("040 CONTACTOR_COM~ "));
  CHECK(table.row("040", 80).starts_with("040 CONTACTOR_COMMAND "));
}

TEST_CASE("numbers of any size stay apart from their neighbours", "[unit][bmudump][follow]") {
  constexpr std::int64_t year_us = 31'557'600'000'000;
  Table table({});
  table.show_unknown(0x7A1, 0);
  table.show_unknown(0x7A1, 1'700'000'000'000'000);  // the clock was set
  table.show_unknown(0x7A2, 1'700'000'000'000'000);
  CHECK(table.row("7A1", 120) == "7A1 unknown          2   0.0/s 19676 d  0.00 s  [0]");
  for (int count = 0; count < 1'000'000; ++count) table.show_unknown(0x7A3, 31'000 * year_us + count / 1'000);
  CHECK(table.row("7A1", 120) == "7A1 unknown          2   0.0/s 19676 d 30946 y  [0]");
  CHECK(table.row("7A3", 120) == "7A3 unknown    1000000 1001M/s  0.00 s  0.00 s  [0]");
  // In the narrowest window with numbers their column begins right after the name.
  CHECK(table.row("7A3", 68).starts_with("7A3 unknown  1001M/s  "));
}

TEST_CASE("flags that are set are told by their names alone", "[unit][bmudump][follow]") {
  Table table({"can0"});
  CHECK(table.row("080", 200).ends_with("  target_node 0  sync  want_module  want_temp  want_cells  want_status"));
}

TEST_CASE("values that are cut can be moved to", "[unit][bmudump][follow]") {
  Table table({"can0"});
  const std::string whole = table.row("143", 200);
  const std::string values = whole.substr(whole.find("cell_voltage_1"));
  CHECK(table.row("143", 60).find(values) == std::string::npos);
  CHECK(table.row("143", 60, {.value = 1}) == "143 CELLS_1 node 3    _2 3.6498  _3 3.6530");
  CHECK(table.row("143", 60, {.value = 2}) == "143 CELLS_1 node 3    _3 3.6530");
  CHECK(table.draw(60, 40, {.value = 1})[1].ends_with("  <- values"));
  CHECK(table.row("143", 80, {.value = 1'000}) == "143 CELLS_1 node 3       7.1/s");
  // From there on no row is cut.
  const std::size_t end = table.value_max();
  CHECK(end > 2);
  for (const std::string& row : table.draw(60, 40, {.value = end})) CHECK(row.find('~') == std::string::npos);
  const std::vector<std::string> before_end = table.draw(60, 40, {.value = end - 1});
  CHECK(std::any_of(before_end.begin(), before_end.end(), [](const std::string& row) { return row.ends_with('~'); }));
  static_cast<void>(table.draw(400));
  CHECK(table.value_max() == 0);
}

TEST_CASE("buses have a column only if there are several, and are told apart by their ends",
          "[unit][bmudump][follow]") {
  Table one({"unix:demo-internal"});
  CHECK(one.draw(80)[1].starts_with("id "));
  Table two({"unix:demo-internal", "unix:demo-vehicle"});
  CHECK(two.draw(80)[2].starts_with("bus        id  message "));
  CHECK(two.row("o-internal 143", 80).find("cell_voltage_1 3.65") != std::string::npos);
  CHECK(two.row("mo-vehicle 143", 80).find("cell_voltage_1 3.65") != std::string::npos);
  CHECK(two.row("unix:demo-internal 143", 200).find("_3 3.6530") != std::string::npos);
}

TEST_CASE("heads and foot fit narrow windows, too", "[unit][bmudump][follow]") {
  Table table({"can0"});
  CHECK(table.draw(80, 8)[0].starts_with("can0   42 frames   100/s   load "));
  CHECK(table.draw(40, 8)[0].starts_with("can0  100/s  load "));
  CHECK(table.draw(80, 8)[7] == "rows 1 to 5 of 13   arrows, page up, page down: scroll   q: quit");
  CHECK(table.draw(40, 8)[7] == "rows 1 to 5 of 13   q: quit");
  CHECK(table.draw(80, 40)[39] == "arrows: more values   q: quit");
}
