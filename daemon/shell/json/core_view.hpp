// All that can be reported about a core at one instant: enough for every explanation, whether the core controls a pack
// or follows a recording.
#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "daemon/core/core.hpp"
#include "daemon/shell/json/json_text.hpp"

/// In a tree, too, an unknown value is null.
template <class T>
struct nlohmann::adl_serializer<std::optional<T>> {
  static void to_json(ordered_json& tree, const std::optional<T>& value) {
    tree = value ? ordered_json(*value) : ordered_json(nullptr);
  }
};

namespace bmu {

class LineFeeder;

/// Keys keep the order in which they are written: people read these lines too.
using Json = nlohmann::ordered_json;

struct CoreView {
  const Core& core;
  TimePoint now{};
  const LineFeeder* lines = nullptr;  // names of the GPIO lines of this machine; null: it has none
};

/// Time since `at`, in whole milliseconds; no value for "never".
[[nodiscard]] inline std::optional<std::int64_t> ago_ms(const CoreView& view, TimePoint at) {
  return if_known(at != TimePoint{}, to_ms(view.now - at));
}

/// "cell 2.7 (no. 19)", "module 3", "" for the pack. A temperature comes from a sensor, which has a number of its own.
[[nodiscard]] inline std::string element_text(const Element& element, Unit unit) {
  if (unit == Unit::dC && element.number != 0) {
    return "temperature sensor " + std::to_string(element.module_node) + "." + std::to_string(element.number);
  }
  return to_text(element);
}

/// {"module":2,"number":7,"pack_number":19,"text":"cell 2.7 (no. 19)"}; null for the pack itself.
[[nodiscard]] inline Json element_json(const Element& element, Unit unit) {
  if (element == Element{}) return nullptr;
  return {{"module", element.module_node},
          {"number", element.number},
          {"pack_number", element.pack_number},
          {"text", element_text(element, unit)}};
}

/// The same as a member, with `text` for the place.
inline void put_element(JsonText& to, std::string_view name, const Element& element, std::string_view text) {
  if (element == Element{}) return to.put(name, nullptr);
  to.object(name, [&] {
    to.put("module", element.module_node);
    to.put("number", element.number);
    to.put("pack_number", element.pack_number);
    to.put("text", text);
  });
}
inline void put_element(JsonText& to, std::string_view name, const Element& element, Unit unit) {
  put_element(to, name, element, element_text(element, unit));
}

/// "03F": an identifier as on a candump line.
[[nodiscard]] inline std::string id_text(std::uint32_t id) {
  std::array<char, 12> hex{};
  std::snprintf(hex.data(), hex.size(), "%03X", id);
  return hex.data();
}

/// "value" and "uV" make "value_uV": one grep finds a quantity from the code to the screen.
[[nodiscard]] inline std::string key_with_unit(std::string_view stem, Unit unit) {
  const std::string_view token = spec_of(unit).token;
  return std::string(stem) + (token.empty() ? "" : "_") + std::string(token);
}

}  // namespace bmu
