// JSON written straight into one text, for replies that are long and often requested.
//
//   JsonText to;
//   to.object([&] {
//     to.put("node", 3);
//     to.put("current_mA", if_known(false, 0));
//     to.array("ages_ms", [&] { to.add(5); });
//   });
//   to.take()  ->  {"node":3,"current_mA":null,"ages_ms":[5]}
//
// A member of an object has a name: put(), object(name, ...), array(name, ...), raw(). An element of an array has none:
// add(), object(...), array(...). Commas are added automatically. Nothing is checked: a key that is put twice is there
// twice. Texts are escaped as by a tree's dump(), and bytes that are not UTF-8 become U+FFFD: a reply always is UTF-8.
//
// Cost: about that of copying the bytes. Memory is allocated only as the whole text grows, where a tree allocates for
// each member of each object. Replies are made by the control loop, which decides nothing meanwhile.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <nlohmann/json_fwd.hpp>

namespace bmu {

/// `value`, or no value (null) if it is unknown.
template <class T>
[[nodiscard]] std::optional<T> if_known(bool is_known, T value) {
  return is_known ? std::optional<T>(std::move(value)) : std::nullopt;
}

class JsonText {
 public:
  /// `put_members` puts the members.
  template <class PutMembers>
  void object(PutMembers&& put_members) {
    open('{');
    put_members();
    text_.push_back('}');
  }
  template <class PutMembers>
  void object(std::string_view name, PutMembers&& put_members) {
    key(name);
    object(std::forward<PutMembers>(put_members));
  }
  /// `add_elements` adds the elements.
  template <class AddElements>
  void array(AddElements&& add_elements) {
    open('[');
    add_elements();
    text_.push_back(']');
  }
  template <class AddElements>
  void array(std::string_view name, AddElements&& add_elements) {
    key(name);
    array(std::forward<AddElements>(add_elements));
  }

  /// A boolean, a whole number, a text, nullptr (null), an optional value, or a tree.
  template <class T>
  void put(std::string_view name, const T& value) {
    key(name);
    add(value);
  }

  void add(std::nullptr_t) { add_word("null"); }
  template <std::same_as<bool> T>
  void add(T value) {
    add_word(value ? "true" : "false");
  }
  template <std::signed_integral T>
  void add(T value) {
    add_signed(value);
  }
  template <std::unsigned_integral T>
  requires(!std::same_as<T, bool>) void add(T value) { add_unsigned(value); }
  void add(std::string_view value);
  template <class T>
  void add(const std::optional<T>& value) {
    value ? add(*value) : add(nullptr);
  }
  /// A tree has the cost of its dump().
  template <std::same_as<nlohmann::ordered_json> T>
  void add(const T& tree) {
    add_tree(tree);
  }

  /// Members that were written before, as they are, with the commas between them.
  void raw(std::string_view members) { add_word(members); }

  [[nodiscard]] std::string take() { return std::exchange(text_, {}); }

 private:
  void open(char bracket);
  void key(std::string_view name);
  void separate();
  void quote(std::string_view text);
  void add_word(std::string_view word);
  void add_signed(std::int64_t value);
  void add_unsigned(std::uint64_t value);
  void add_tree(const nlohmann::ordered_json& tree);

  std::string text_;
};

}  // namespace bmu
