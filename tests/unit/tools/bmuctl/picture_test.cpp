// Live view of bmuctl in windows of every size: nothing is cut without a mark.
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

/// Watch update of the daemon, shortened to the content that fills a window.
Json watch_reply(int module_count) {
  Json modules = Json::array();
  for (int node = 1; node <= module_count; ++node) modules.push_back(module_of(node, true));
  const std::string text =
      "Opened 6.0 s ago: cell voltage too low: cell 2.7 (no. 19): 2.7352 V, limit 2.8000 V, exceeded for 158 ms; "
      "sample 61 ms before opening.";
  return {{"status", {{"modules", modules}, {"last_opening", {{"text", text}}}, {"drive", {{"lasted_ms", 11'000}}}}},
          {"cells", {{"modules", modules}}},
          {"faults", {{"faults", {module_lost()}}}}};
}

std::vector<std::string> rows_of(const Json& json, int width, int height, const PictureView& view = {}) {
  Canvas canvas(width, height, plain_glyphs.cut);
  draw_picture(Reply(json), view, {}, "", plain_glyphs, canvas);
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
  // Nine rows of head, two of cells, six below them, the keys.
  const std::vector<std::string> full = rows_of(watch_reply(4), 60, 18);
  CHECK(full[16].find("before opening") != std::string::npos);
  for (const int height : {17, 14}) {
    const std::vector<std::string> small = rows_of(watch_reply(4), 60, height);
    CHECK(small[static_cast<std::size_t>(height) - 2] ==
          " + " + std::to_string(19 - height) + " more lines: keys f, l and u, or a larger window");
    CHECK(small[10] == full[10]);
    CHECK(small.back().find(" q quit") == 0);
  }
}

TEST_CASE("a window without room for all modules says which are there, and scrolls to the others", "[unit][bmuctl]") {
  const Json json = watch_reply(20);
  CHECK(rows_of(json, 60, 16).back().find("modules 1 to 4 of 20") != std::string::npos);
  const std::vector<std::string> second = rows_of(json, 60, 16, {.first = 1});
  CHECK(second.back().find("modules 3 to 6 of 20") != std::string::npos);
  CHECK(second[9].find("M3 ") == 0);
  // Scrolling beyond the end stops at the last row.
  const std::vector<std::string> last = rows_of(json, 60, 16, {.first = 99});
  CHECK(last.back().find("modules 17 to 20 of 20") != std::string::npos);
  CHECK(last[10].find("M19") == 0);
}

TEST_CASE("the lowest, the highest and bled cells are marked in every form", "[unit][bmuctl]") {
  Json json = watch_reply(4);
  Json& cells = json["cells"];
  cells["cell_voltage_limits"] = {{"low_open_uV", 3'000'000}, {"high_open_uV", 4'000'000}};
  cells["cell_voltage"] = {{"min_at", {{"module", 2}, {"number", 1}}}, {"max_at", {{"module", 1}, {"number", 3}}}};
  cells["modules"][0]["balancing"] = {false, true, true};
  cells["modules"][1]["cell_voltage_uV"][0] = 3'100'000;
  // Bars of 7/8, and one of 1/8.
  CHECK(rows_of(json, 60, 18)[9].find("M1  8 8b8B8 8 ") == 0);
  CHECK(rows_of(json, 60, 18)[9].find("M2  1v8 8 ") != std::string::npos);
  const std::vector<std::string> large = rows_of(json, 80, 25);
  CHECK(large[9].find("M1   8888  8888b 8888b 8888  ") == 0);
  CHECK(large[10].find("     3.98  3.98  3.98^ 3.98  ") == 0);
  CHECK(large[12].find("     3.10v 3.98  ") == 0);
  const std::vector<std::string> numbers = rows_of(json, 100, 25, {.form = CellsForm::numbers});
  CHECK(numbers[9].find("M1   3.980  3.980b 3.980B 3.980  ") == 0);
}

TEST_CASE("where a charge is stands in the picture and in the line, while somebody is plugged in", "[unit][bmuctl]") {
  Json json = watch_reply(2);
  json["status"]["charger"] = {{"stage", "balancing"}};
  json["status"]["balancing"] = {{"cells_on", 2}};
  CHECK(rows_of(json, 60, 20)[5].find(" charge: balancing, bleeding 2") == 0);
  CHECK(compact_line(Reply(json)).find("charge: balancing") != std::string::npos);
  json["status"]["charger"]["stage"] = "off";
  CHECK(rows_of(json, 60, 20)[5].find(" bleeding 2 cells") == 0);
  CHECK(compact_line(Reply(json)).find("charge: ") == std::string::npos);
}

TEST_CASE("bars go from limit to limit, or from the lowest cell to the highest", "[unit][bmuctl]") {
  Json json = watch_reply(1);
  Json& cells = json["cells"];
  cells["cell_voltage_limits"] = {{"low_open_uV", 3'000'000}, {"high_open_uV", 4'600'000}};
  cells["cell_voltage"] = {{"min_uV", 3'900'000}, {"max_uV", 3'980'000}};
  cells["modules"][0]["cell_voltage_uV"] = {3'900'000, 3'940'000, 3'980'000, nullptr, 2'000'000, 9'000'000};
  CHECK(rows_of(json, 60, 12)[9].find("M1   55555  55555  55555  ?????  11111  88888") == 0);
  CHECK(rows_of(json, 60, 12, {.bars_span_cells = true})[9].find("M1   11111  55555  88888  ?????  11111  88888") == 0);
}

TEST_CASE("a page is scrolled from its first line to its last", "[unit][bmuctl]") {
  const Json json = watch_reply(4);
  const std::vector<std::string> first = rows_of(json, 80, 10, {.topic = PictureTopic::help});
  CHECK(first[2] == " Help");
  CHECK(first[3] == " Keys");
  CHECK(first.back().find("lines 1 to 6 of ") != std::string::npos);
  const std::vector<std::string> last = rows_of(json, 80, 10, {.topic = PictureTopic::help, .first = 999});
  CHECK(last[8].find("feedback mismatch") != std::string::npos);
}

TEST_CASE("pictures of any size can be drawn", "[unit][bmuctl]") {
  for (const int width : {1, 2, 20, 40, 61, 79, 200}) {
    for (const int height : {1, 2, 9, 10, 17, 50}) {
      for (const PictureTopic topic : {PictureTopic::overview, PictureTopic::faults, PictureTopic::limits,
                                       PictureTopic::buses, PictureTopic::help}) {
        for (const CellsForm form : {CellsForm::fitting, CellsForm::bars, CellsForm::numbers}) {
          const PictureView view{.topic = topic, .form = form, .first = 3};
          CHECK(rows_of(watch_reply(63), width, height, view).size() == static_cast<std::size_t>(height));
        }
      }
    }
  }
}

TEST_CASE("a lost module is named, and how many others are silent too", "[unit][bmuctl]") {
  const Json fault = module_lost();
  CHECK(fault_details(Reply(fault), Reply(lost_modules())) == "module 3 and 2 more, 1.5 s ago");
  CHECK(fault_details(Reply(fault), Reply()) == "module 3, 1.5 s ago");
}

}  // namespace bmu
