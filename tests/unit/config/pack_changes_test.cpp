// Reported changes between two versions of a pack file.
#include "config/pack_changes.hpp"

#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

std::vector<std::string> changes(const std::string& before, const std::string& now) {
  std::vector<std::string> texts;
  for (const PackChange& change :
       pack_changes({.pack_name = "old.json", .pack_text = before}, {.pack_name = "pack.json", .pack_text = now})) {
    texts.push_back(to_text(change));
  }
  return texts;
}

using Texts = std::vector<std::string>;

}  // namespace

TEST_CASE("a change is told with its path, what was there and what is", "[unit][config][reload]") {
  CHECK(changes(R"({"a": 1, "b": {"c": 2, "d": [1, 2]}})", R"({"a": 1, "b": {"c": 3, "d": [1, 4]}})") ==
        Texts{"pack.json: /b/c: 2 -> 3", "pack.json: /b/d/1: 2 -> 4"});
  CHECK(changes(R"({"a": 1})", R"({"b": "x"})") ==
        Texts{"pack.json: /a: 1 -> absent", "pack.json: /b: absent -> \"x\""});
  CHECK(changes(R"({"a": [1]})", R"({"a": [1, 2]})") == Texts{"pack.json: /a/1: absent -> 2"});
  CHECK(changes(R"({"a": [1, 2]})", R"({"a": [1]})") == Texts{"pack.json: /a/1: 2 -> absent"});
  CHECK(changes(R"({"a": [1]})", R"({"a": {"b": 1}})") == Texts{"pack.json: /a: [1] -> {\"b\":1}"});
  CHECK(changes(R"({"a": {}})", R"({"a": null})") == Texts{"pack.json: /a: {} -> null"});
}

TEST_CASE("comments, blanks and the order of keys are no change", "[unit][config][reload]") {
  CHECK(changes(R"({"a": 1, "b": 2})", "{ // what it is for\n \"b\": 2,\n\"a\":1 }").empty());
  CHECK(changes(R"({"a": 1})", R"({"a": 1.0})").empty());
}

TEST_CASE("keys with a slash stay one key of the path", "[unit][config][reload]") {
  CHECK(changes(R"({"a/b": 1, "c~d": 1})", R"({"a/b": 2, "c~d": 2})") ==
        Texts{"pack.json: /a~1b: 1, now 2", "pack.json: /c~0d: 1, now 2"});
}

TEST_CASE("the cell's file is compared by its own name", "[unit][config][reload]") {
  PackSources before{.pack_name = "p", .pack_text = "{}", .cell_name = "cell.json", .cell_text = R"({"capacity": 1})"};
  PackSources now = before;
  CHECK(pack_changes(before, now).empty());
  now.cell_text = R"({"capacity": 2})";
  REQUIRE(pack_changes(before, now).size() == 1);
  CHECK(to_text(pack_changes(before, now).front()) == "cell.json: /capacity: 1 -> 2");
  // A cell moved from the pack file into its own file is reported in the pack file.
  before.cell_name = "";
  before.cell_text = "";
  before.pack_text = R"({"cell": {"capacity": 1}})";
  now.pack_text = R"({"cell": "cell.json"})";
  REQUIRE(pack_changes(before, now).size() == 1);
  CHECK(pack_changes(before, now).front().path == "/cell");
}
