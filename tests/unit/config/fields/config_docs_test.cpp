// Comparison of the documentation page and the editor schema with the parser's field tables, which are authoritative.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "config/fields/pack_fields.hpp"
#include "daemon/core/faults/fault_table.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu {
namespace {

const std::string page_file = test::in_source("docs/configuration.md");
const std::string schema_file = test::in_source("config/pack.schema.json");

std::string bytes_of(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  REQUIRE(stream);
  std::ostringstream bytes;
  bytes << stream.rdbuf();
  return bytes.str();
}

std::string last_token(const std::string& path) {
  return path.substr(path.find_last_of("/_") + 1);
}

// --- units ----------------------------------------------------------------------------------------------------------

constexpr std::array<std::string_view, 22> unit_tokens{"W",  "K",  "Bd",       "uV",   "mV",   "V",   "mA", "A",
                                                       "C",  "dC", "uOhm",     "mOhm", "Ohm",  "uAs", "Ah", "mWh",
                                                       "ms", "s",  "permille", "J",    "days", "MB"};

std::string unit_of(const KeyDescription& key) {
  std::string token = last_token(key.path);
  const bool is_pair = key.path.find("_per_") != std::string::npos && !key.path.ends_with("_permille");
  if (!is_pair && std::find(unit_tokens.begin(), unit_tokens.end(), token) != unit_tokens.end()) return token;
  constexpr std::array<std::pair<std::string_view, const char*>, 7> pairs{{{"J_per_K", "J/K"},
                                                                           {"W_per_K", "W/K"},
                                                                           {"mK_per_s", "mK/s"},
                                                                           {"Ohm_per_V", "Ohm/V"},
                                                                           {"kbit_per_s", "kbit/s"},
                                                                           {"A_per_s", "A/s"},
                                                                           {"permille_per_month", "permille/month"}}};
  for (const auto& [ending, unit] : pairs) {
    if (key.path.ends_with(ending)) return unit;
  }
  return "";
}

TEST_CASE("every number carries its unit in its key, unless it counts", "[unit][config]") {
  constexpr std::array<std::string_view, 15> counts{"/charger/units",
                                                    "/intake_air/module",
                                                    "/intake_air/sensor",
                                                    "/serial/modules_max",
                                                    "/modules/*/serial_number",
                                                    "/contactors/precharge_tries",
                                                    "/modules/*/node",
                                                    "/modules/*/cells",
                                                    "/modules/*/temperature_sensors",
                                                    "/poll/temperature_every",
                                                    "/gpio/outputs/*/line",
                                                    "/gpio/feedback/*/line",
                                                    "/gpio/inputs/*/line",
                                                    "/gpio/insulation_pulses/line",
                                                    "/cell/dynamics/charge_efficiency"};
  for (const KeyDescription& key : describe_keys()) {
    CAPTURE(key.path);
    const bool is_number = key.info.type == FieldType::integer || key.info.type == FieldType::real;
    const bool is_count = std::find(counts.begin(), counts.end(), key.path) != counts.end();
    CHECK((is_number && !is_count) == !unit_of(key).empty());
  }
}

TEST_CASE("every default lies in its own range", "[unit][config]") {
  for (const KeyDescription& key : describe_keys()) {
    if (key.fallback.empty()) continue;
    CAPTURE(key.path);
    ProblemList problems;
    CHECK(read_value(JsonValue::parse(key.fallback), key.info, {}, problems));
  }
}

// --- the page -------------------------------------------------------------------------------------------------------

std::string range_of_list(const ListInfo& list, const std::string& range) {
  const std::string numbers = std::to_string(list.number_count) + " numbers";
  const std::string lists = list.list_count == 0 ? numbers : std::to_string(list.list_count) + " lists of " + numbers;
  return lists + ", " + range + (list.is_rising ? ", rising" : "");
}

std::string range_of(const KeyDescription& key) {
  const FieldInfo& info = key.info;
  std::string range = number_text(info.min) + " to " + number_text(info.max);
  if (key.list) return range_of_list(*key.list, range);
  switch (info.type) {
    case FieldType::integer: return range;
    case FieldType::real: return range + ", may have a fraction";
    case FieldType::boolean: return "true, false";
    case FieldType::text: return form_text(info).empty() ? range + " characters" : form_text(info);
  }
  return "?";
}

std::string code(const std::string& text) {
  return text.empty() ? "" : "`" + text + "`";
}

std::string meaning_of(const std::string& section_path) {
  for (const SectionDescription& section : describe_sections()) {
    if (section.path == section_path) return std::string(section.meaning) + "\n\n";
  }
  return "";
}

/// Renders one table per object of the file.
std::string tables() {
  std::string page;
  std::string object = "none yet";
  for (const KeyDescription& key : describe_keys()) {
    const std::string parent = key.path.substr(0, key.path.rfind('/'));
    if (parent != object) {
      object = parent;
      page += "\n### " + (object.empty() ? "At the top" : code(object)) + "\n\n" + meaning_of(object) +
              "| key | unit | range | default | meaning |\n" + "|---|---|---|---|---|\n";
    }
    std::string fallback = code(key.fallback);
    if (key.info.is_required) fallback = "required";
    page += "| " + code(key.path.substr(parent.size() + 1)) + " | " + unit_of(key) + " | " + range_of(key) + " | " +
            fallback + " | " + std::string(key.info.meaning) + " |\n";
  }
  return page + "\n";
}

TEST_CASE("docs/configuration.md lists every key as the parser knows it", "[unit][config][docs]") {
  const std::string begin = "<!-- begin of the keys: written by BMUD_REWRITE=1 test_unit \"[docs]\" -->\n";
  const std::string end = "<!-- end of the keys -->\n";
  const std::string page = bytes_of(page_file);
  const std::size_t first = page.find(begin);
  const std::size_t last = page.find(end);
  REQUIRE(first != std::string::npos);
  REQUIRE(last != std::string::npos);
  const std::size_t start = first + begin.size();
  const std::string wanted = page.substr(0, start) + tables() + page.substr(last);
  if (std::getenv("BMUD_REWRITE") != nullptr) std::ofstream(page_file, std::ios::binary) << wanted;
  INFO("to write it anew: BMUD_REWRITE=1 test_unit \"[docs]\"");
  CHECK(bytes_of(page_file) == wanted);
}

TEST_CASE("docs/configuration.md names the keys that are no plain fields", "[unit][config][docs]") {
  const std::string page = bytes_of(page_file);
  for (const std::string key :
       {"cell", "modules", "limits", "nodes", "serial_numbers", "ocv", "derating", "charge_plateau", "dynamics", "rows",
        "component_limits", "faults", "gpio", "outputs", "feedback", "inputs", "insulation_pulses"}) {
    CAPTURE(key);
    CHECK(page.find("`" + key + "`") != std::string::npos);
  }
}

// --- the schema -----------------------------------------------------------------------------------------------------

/// Schema of a key, and whether its object requires it; by path.
using SchemaKeys = std::map<std::string, std::pair<JsonValue, bool>>;

/// Collects all properties below an object's schema by path; objects themselves only as containers.
void collect(const JsonValue& object, const std::string& path, SchemaKeys& keys) {
  CHECK(object.at("additionalProperties") == false);
  const JsonValue required = object.value("required", JsonValue::array());
  for (const auto& [name, schema] : object.at("properties").items()) {
    std::string place = path;
    place.append("/").append(name);
    if (schema.value("type", "") == "object") {
      collect(schema, place, keys);
    } else {
      keys[place] = {schema, std::find(required.begin(), required.end(), name) != required.end()};
    }
  }
}

/// Removes the names of outputs under an object, after checking that each refers to this definition.
void erase_references(const std::string& object, std::size_t count, const std::string& definition, SchemaKeys& keys) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::string path = object + "/" + std::string(gpio_output_names.at(i));
    CAPTURE(path);
    REQUIRE(keys.count(path) == 1);
    CHECK(keys.at(path).first.at("$ref") == "#/definitions/" + definition);
    keys.erase(path);
  }
}

/// Faults that an editor offers; an entry for any other fault is rejected.
std::vector<std::string> names_that_can_be_stricter() {
  std::vector<std::string> names;
  for (const FaultRow& row : fault_table()) {
    if (row.reaction != Reaction::open_now) names.emplace_back(row.name);
  }
  return names;
}

SchemaKeys schema_keys() {
  const JsonValue schema = JsonValue::parse(bytes_of(schema_file));
  SchemaKeys keys;
  collect(schema, "", keys);
  collect(schema.at("definitions").at("module"), "/modules/*", keys);
  collect(schema.at("definitions").at("cell"), "/cell", keys);
  collect(schema.at("definitions").at("cell_at_temperature"), "/cell/dynamics/rows/*", keys);
  collect(schema.at("definitions").at("component_limit"), "/component_limits/*", keys);
  collect(schema.at("definitions").at("fault_reaction"), "/faults/*", keys);
  collect(schema.at("definitions").at("gpio_line"), "/gpio/outputs/*", keys);
  collect(schema.at("definitions").at("gpio_feedback"), "/gpio/feedback/*", keys);
  collect(schema.at("definitions").at("gpio_input"), "/gpio/inputs/*", keys);
  collect(schema.at("definitions").at("gpio_line"), "/gpio/insulation_pulses", keys);
  for (const char* composite : {"/cell", "/modules", "/modules/*/nodes", "/modules/*/serial_numbers", "/cell/ocv",
                                "/cell/dynamics/rows", "/component_limits", "/gpio/inputs", "/gpio/insulation_pulses",
                                "/cell/derating/charge_over_temperature", "/cell/derating/discharge_over_temperature",
                                "/cell/derating/charge_over_soc", "/cell/derating/discharge_over_soc"}) {
    CAPTURE(composite);
    CHECK(keys.erase(composite) == 1);
  }
  for (const std::string& name : names_that_can_be_stricter()) {
    CAPTURE(name);
    REQUIRE(keys.count("/faults/" + name) == 1);
    CHECK(keys.at("/faults/" + name).first.at("$ref") == "#/definitions/fault_reaction");
    keys.erase("/faults/" + name);
  }
  erase_references("/gpio/outputs", gpio_output_count, "gpio_line", keys);
  erase_references("/gpio/feedback", gpio_feedback_count, "gpio_feedback", keys);
  return keys;
}

using OrderedJson = nlohmann::ordered_json;

/// Permitted values of a text that is one of a list.
std::vector<std::string> choices_of(const FieldInfo& info) {
  const std::vector<std::string_view> words = info.words();
  std::vector<std::string> choices(words.begin(), words.end());
  if (info.min <= 0) choices.emplace_back();
  return choices;
}

/// Writes type and range of one value.
void describe_value(OrderedJson& schema, const FieldInfo& info) {
  constexpr std::array<const char*, 4> types{"integer", "number", "boolean", "string"};
  const bool is_text = info.type == FieldType::text;
  schema["type"] = types.at(static_cast<std::size_t>(info.type));
  if (info.type == FieldType::boolean) return;
  if (info.words != nullptr) {
    schema["enum"] = choices_of(info);
    for (const char* bound : {"minLength", "maxLength"}) schema.erase(bound);
    return;
  }
  schema[is_text ? "minLength" : "minimum"] = info.min;
  schema[is_text ? "maxLength" : "maximum"] = info.max;
  for (const char* bound : {"minimum", "maximum", "minLength", "maxLength"}) {
    if (!schema.contains(bound)) continue;
    const auto value = schema[bound].get<double>();
    if (value == std::floor(value)) schema[bound] = static_cast<std::int64_t>(value);
  }
}

void describe_list(OrderedJson& schema, std::size_t count, const OrderedJson& items) {
  schema["type"] = "array";
  schema["minItems"] = count;
  schema["maxItems"] = count;
  schema["items"] = items;
}

/// Writes the description of one key for editors. Properties that the field tables do not contain, e.g. a pattern,
/// stay.
void describe_in_schema(OrderedJson& schema, const KeyDescription& key) {
  schema["description"] = key.info.meaning;
  if (key.list) {
    OrderedJson items;
    describe_value(items, key.info);
    if (key.list->list_count > 0) {
      OrderedJson numbers;
      describe_list(numbers, key.list->number_count, items);
      items = numbers;
    }
    describe_list(schema, key.list->list_count > 0 ? key.list->list_count : key.list->number_count, items);
  } else {
    describe_value(schema, key.info);
  }
  schema.erase("default");
  if (!key.fallback.empty()) schema["default"] = OrderedJson::parse(key.fallback);
}

/// Object that contains the key; created if it is missing.
OrderedJson& object_of(OrderedJson& schema, const std::string& path) {
  constexpr std::string_view cell = "/cell";
  if (path == "/component_limits/*") return schema["definitions"]["component_limit"];
  if (path == "/faults/*") return schema["definitions"]["fault_reaction"];
  if (path == "/cell/dynamics/rows/*") return schema["definitions"]["cell_at_temperature"];
  const bool is_of_cell = path.starts_with(cell);
  OrderedJson* object = is_of_cell ? &schema["definitions"]["cell"] : &schema;
  std::istringstream parts(path.substr(is_of_cell ? std::min(cell.size() + 1, path.size()) : 1));
  for (std::string part; std::getline(parts, part, '/');) {
    OrderedJson& next = (*object)["properties"][part];
    if (next.is_null())
      next = {{"type", "object"}, {"additionalProperties", false}, {"properties", OrderedJson::object()}};
    object = &next;
  }
  return *object;
}

void rewrite_schema() {
  OrderedJson schema = OrderedJson::parse(bytes_of(schema_file));
  OrderedJson& faults = schema["properties"]["faults"]["properties"];
  faults = OrderedJson::object();
  for (const std::string& name : names_that_can_be_stricter()) {
    faults[name] = {{"$ref", "#/definitions/fault_reaction"}};
  }
  for (const KeyDescription& key : describe_keys()) {
    const std::size_t slash = key.path.rfind('/');
    // Modules and GPIO lines are definitions, written by hand.
    const bool is_elsewhere = slash == 0 || key.path.starts_with("/modules") || key.path.starts_with("/gpio");
    if (is_elsewhere) continue;
    OrderedJson& object = object_of(schema, key.path.substr(0, slash));
    const std::string name = key.path.substr(slash + 1);
    describe_in_schema(object["properties"][name], key);
    OrderedJson required = object.value("required", OrderedJson::array());
    const bool is_listed = std::find(required.begin(), required.end(), name) != required.end();
    if (key.info.is_required && !is_listed) required.push_back(name);
    if (!required.empty()) object["required"] = required;
  }
  std::ofstream(schema_file, std::ios::binary) << schema.dump(2) << "\n";
}

TEST_CASE("the schema knows the keys of the parser, and no others", "[unit][config][docs]") {
  if (std::getenv("BMUD_REWRITE") != nullptr) rewrite_schema();
  INFO("to write it anew: BMUD_REWRITE=1 test_unit \"[docs]\"");
  SchemaKeys keys = schema_keys();
  for (const KeyDescription& key : describe_keys()) {
    CAPTURE(key.path);
    CHECK(keys.erase(key.path) == 1);
  }
  for (const auto& [path, schema] : keys) FAIL_CHECK(path << " is in the schema only");
}

/// Schema of one value. For a list: compares the length, then returns the schema of its numbers.
const JsonValue& value_schema(const JsonValue& schema, const KeyDescription& key) {
  if (!key.list) return schema;
  const JsonValue* list = &schema;
  for (const std::size_t count : {key.list->list_count, key.list->number_count}) {
    if (count == 0) continue;
    CHECK(list->at("type") == "array");
    CHECK(list->at("minItems") == count);
    CHECK(list->at("maxItems") == count);
    list = &list->at("items");
  }
  return *list;
}

TEST_CASE("the schema agrees with the parser on types, ranges and defaults", "[unit][config][docs]") {
  constexpr std::array<const char*, 4> types{"integer", "number", "boolean", "string"};
  const SchemaKeys keys = schema_keys();
  for (const KeyDescription& key : describe_keys()) {
    CAPTURE(key.path);
    REQUIRE(keys.count(key.path) == 1);
    const auto& [key_schema, is_required] = keys.at(key.path);
    const JsonValue& schema = value_schema(key_schema, key);
    CHECK(schema.at("type") == types.at(static_cast<std::size_t>(key.info.type)));
    CHECK(is_required == key.info.is_required);
    const bool is_text = key.info.type == FieldType::text;
    if (key.info.words != nullptr) {
      CHECK(schema.at("enum") == choices_of(key.info));
    } else if (key.info.type != FieldType::boolean) {
      CHECK_FALSE(schema.contains("enum"));
      CHECK(schema.at(is_text ? "minLength" : "minimum").get<double>() == key.info.min);
      CHECK(schema.at(is_text ? "maxLength" : "maximum").get<double>() == key.info.max);
    }
    if (schema.contains("default")) CHECK(schema.at("default") == JsonValue::parse(key.fallback));
  }
}

bool parser_takes(const std::string& text, const FieldInfo& info) {
  ProblemList problems;
  return read_value(JsonValue(text), info, {}, problems).has_value();
}

bool schema_takes(const std::string& text, const JsonValue& schema) {
  const auto is_offered = [&](const JsonValue& words) {
    return std::find(words.begin(), words.end(), text) != words.end();
  };
  if (schema.contains("enum")) return is_offered(schema.at("enum"));
  const std::string pattern = schema.value("pattern", "");
  return text.size() >= schema.at("minLength").get<std::size_t>() &&
         text.size() <= schema.at("maxLength").get<std::size_t>() &&
         std::regex_search(text, std::regex(pattern, std::regex::ECMAScript));
}

TEST_CASE("the schema takes and refuses the texts that the parser does", "[unit][config][docs]") {
  std::vector<std::string> texts{
      "",       "a",    "0",     "7F7",      "7f8", "7FF",      "800",       "-1",       "0x1",      "1234", "can0",
      "a/b",    "a b",  " ",     ".",        "..",  "unix:",    "unix:a",    "unix:a/b", "unix:a b", "a:b",  "/dev/",
      "/dev/x", "/dev", "dev/x", "/dev/a b", "~",   "12345678", "123456789", "a\x7f",    "a\tb",     "\n",   "a_b-c.d"};
  for (const std::size_t length : {15U, 16U, 24U, 25U, 32U, 33U, 64U, 65U, 255U, 256U}) texts.emplace_back(length, 'x');
  for (const std::size_t length : {32U, 33U}) texts.push_back("unix:" + std::string(length, 'x'));
  const SchemaKeys keys = schema_keys();
  for (const KeyDescription& key : describe_keys()) {
    if (key.info.type != FieldType::text || key.info.words == nullptr) continue;
    for (const std::string& word : choices_of(key.info)) texts.push_back(word);
  }
  for (const KeyDescription& key : describe_keys()) {
    if (key.info.type != FieldType::text) continue;
    const JsonValue& schema = value_schema(keys.at(key.path).first, key);
    for (const std::string& text : texts) {
      CAPTURE(key.path, text);
      CHECK(schema_takes(text, schema) == parser_takes(text, key.info));
    }
  }
}

}  // namespace
}  // namespace bmu
