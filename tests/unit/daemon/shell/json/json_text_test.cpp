// JSON written without a tree equals the JSON written from the tree.
#include "daemon/shell/json/json_text.hpp"

#include <array>
#include <limits>

#include <nlohmann/json.hpp>

#include "tests/support/allocation_count.hpp"
#include "tests/support/catch.hpp"

using namespace bmu;

namespace {

using Json = nlohmann::ordered_json;

std::string dumped(const Json& tree) {
  return tree.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <class T>
std::string written(const T& value) {
  JsonText to;
  to.add(value);
  return to.take();
}

}  // namespace

TEST_CASE("numbers, truths, texts and nothing are written as a tree writes them", "[unit][json]") {
  CHECK(written(true) == "true");
  CHECK(written(false) == "false");
  CHECK(written(nullptr) == "null");
  CHECK(written(0) == "0");
  CHECK(written(std::uint8_t{200}) == "200");
  CHECK(written(std::int16_t{-12}) == "-12");
  CHECK(written(std::numeric_limits<std::int64_t>::min()) == "-9223372036854775808");
  CHECK(written(std::numeric_limits<std::uint64_t>::max()) == "18446744073709551615");
  CHECK(written("text") == "\"text\"");
  CHECK(written(std::string()) == "\"\"");
}

TEST_CASE("what is not known is null", "[unit][json]") {
  CHECK(written(if_known(true, -5)) == "-5");
  CHECK(written(if_known(false, -5)) == "null");
  CHECK(written(if_known(true, std::string("a \"b\""))) == R"("a \"b\"")");
}

TEST_CASE("whatever bytes a text has, it is escaped as in a tree", "[unit][json]") {
  for (int byte = 0; byte < 256; ++byte) {
    const std::string text = std::string("a") + static_cast<char>(byte) + "z";
    CAPTURE(byte);
    CHECK(written(text) == dumped(text));
  }
  for (const char* text : {"\"", "\\", "C:\\n", "Käthe \"K\" Müller", "電池", "\xF0\x9F\x94\x8B", "\x7F",
                           "cut \xE2\x82", "\xC3\x28", "\xED\xA0\x80 half a surrogate", "\xFF\xFE", "{,[:"}) {
    CAPTURE(text);
    CHECK(written(text) == dumped(text));
    JsonText to;
    to.object([&] { to.put(text, text); });
    CHECK(to.take() == dumped(Json{{text, text}}));
  }
}

TEST_CASE("containers hold each other, and commas stand between what they hold", "[unit][json]") {
  JsonText to;
  to.object([&] {
    to.object("empty", [] {});
    to.array("none", [] {});
    to.put("text", "ends with a bracket [");
    to.put("brace", "{");
    to.put("colon", ":");
    to.array("rows", [&] {
      to.array([&] {
        to.add(1);
        to.add(-2);
      });
      to.array([] {});
      to.object([&] { to.object("inner", [&] { to.put("is_deep", true); }); });
      to.add("last");
    });
    to.put("tree", Json{{"a", {1, 2}}, {"b", nullptr}});
    to.raw(R"("x":1,"y":{})");
    to.put("after", nullptr);
  });
  CHECK(
      to.take() ==
      R"({"empty":{},"none":[],"text":"ends with a bracket [","brace":"{","colon":":",)"
      R"("rows":[[1,-2],[],{"inner":{"is_deep":true}},"last"],"tree":{"a":[1,2],"b":null},"x":1,"y":{},"after":null})");
  CHECK(to.take().empty());
}

TEST_CASE("memory is asked for as the text grows, not for each member", "[unit][json][allocation]") {
  const std::uint64_t before = test::allocation_count();
  JsonText to;
  to.object([&] {
    for (int i = 0; i < 1'000; ++i) to.put("a key that is longer than a short string", i);
  });
  CHECK(test::allocation_count() - before < 20);
}
