// bmuctl's picture in windows of every size: nothing is cut without a mark.
#include "tools/bmuctl/picture.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

using Json = nlohmann::json;

Json module_of(int node, bool is_answering) {
  return {{"node", node},
          {"is_answering", is_answering},
          {"cell_voltage_uV", std::vector<int>(12, 3'980'000)},
          {"cell_temperature_dC", std::vector<int>(4, 250)}};
}

Json lost_modules() {
  return {module_of(1, true), module_of(2, false), module_of(3, false), module_of(4, false)};
}

Json module_lost() {
  return {{"name", "module_lost"},
          {"meaning", "a module does not answer"},
          {"stage", "active"},
          {"is_present", true},
          {"confirmed", {{"element", {{"module", 3}, {"text", "module 3"}}}}},
          {"confirmed_ago_ms", 1500}};
}

/// As the daemon sends it to a watcher, shortened to what fills a window.
Json watch_reply(int module_count) {
  Json modules = Json::array();
  for (int node = 1; node <= module_count; ++node) modules.push_back(module_of(node, true));
  const std::string text =
      "Opened 6.0 s ago: a cell's voltage is too low: cell 2.7 (no. 19): 2.7352 V, limit 2.8000 V, beyond it for "
      "158 ms; sample taken 61 ms before.";
  return {{"status", {{"modules", modules}, {"last_opening", {{"text", text}}}, {"drive", {{"lasted_ms", 11'000}}}}},
          {"cells", {{"modules", modules}}},
          {"faults", {{"faults", {module_lost()}}}}};
}

std::vector<std::string> rows_of(const Json& json, int width, int height) {
  Canvas canvas(width, height, plain_glyphs.cut);
  draw_picture(Reply(json), {}, {}, "", plain_glyphs, canvas);
  std::vector<std::string> rows;
  rows.reserve(static_cast<std::size_t>(height));
  for (int row = 0; row < height; ++row) rows.push_back(canvas.row_text(row, false));
  return rows;
}

}  // namespace

TEST_CASE("a row that is cut ends with a mark, one that just fits does not", "[unit][bmuctl]") {
  Canvas canvas(5, 3, "…");
  canvas.put(0, 0, "12345");
  canvas.put(1, 0, "123456");
  canvas.put(2, 0, "12345   ");
  CHECK(canvas.row_text(0, false) == "12345");
  CHECK(canvas.row_text(1, false) == "1234…");
  CHECK(canvas.row_text(2, false) == "12345");
}

TEST_CASE("a window without room for all lines says how many are missing", "[unit][bmuctl]") {
  // Nine rows of head, two of cells, five below them.
  const std::vector<std::string> full = rows_of(watch_reply(4), 60, 16);
  CHECK(full.back().find("61 ms") != std::string::npos);
  for (const int height : {15, 12}) {
    const std::vector<std::string> small = rows_of(watch_reply(4), 60, height);
    CHECK(small.back() == " + " + std::to_string(17 - height) + " more lines (make the window larger)");
    CHECK(small[10] == full[10]);
  }
}

TEST_CASE("a window without room for all cells says how many are missing", "[unit][bmuctl]") {
  const std::vector<std::string> rows = rows_of(watch_reply(20), 60, 16);
  bool is_told = false;
  for (const std::string& row : rows)
    is_told = is_told || row.find(" more cells (make the window") != std::string::npos;
  CHECK(is_told);
}

TEST_CASE("pictures of any size can be drawn", "[unit][bmuctl]") {
  for (const int width : {1, 2, 20, 40, 61, 79, 200}) {
    for (const int height : {1, 2, 9, 10, 17, 50}) CHECK_FALSE(rows_of(watch_reply(63), width, height).empty());
  }
}

TEST_CASE("a lost module is named, and how many others are silent too", "[unit][bmuctl]") {
  const Json fault = module_lost();
  CHECK(fault_details(Reply(fault), Reply(lost_modules())) == "module 3 and 2 more, 1.5 s ago");
  CHECK(fault_details(Reply(fault), Reply()) == "module 3, 1.5 s ago");
}

}  // namespace bmu
