// Functions called by instrumented sources: each site checks whether its mutant is the selected one. Compile-time
// evaluation always gets the original, so that constant tables and static_asserts hold.
//
//   BMU_MUTANT=17          selects mutant 17; without it the program is the original
//   BMU_MUTANT_RECORD=FILE writes the mutants that each test case reaches
//
// Not part of the project's build: tests/mutation/instrument.py writes the calls into a copy of the sources.
#pragma once

#include <cstdlib>
#include <type_traits>
#include <vector>

namespace bmu_mutant {

inline int read_selected() {
  const char* const id = std::getenv("BMU_MUTANT");
  return id != nullptr ? std::atoi(id) : 0;
}
inline const int selected = read_selected();
inline const bool is_recording = std::getenv("BMU_MUTANT_RECORD") != nullptr;

/// By mutant: reached since the last test case started.
inline std::vector<bool>& reached() {
  static std::vector<bool> ids;
  return ids;
}

inline void note_reached(int id) {
  const auto index = static_cast<std::size_t>(id);
  if (index >= reached().size()) reached().resize(index + 1);
  reached()[index] = true;
}

inline bool is_selected(int id) {
  if (is_recording) note_reached(id);
  return id == selected;
}

constexpr bool on(int id) {
  if (std::is_constant_evaluated()) return false;
  return is_selected(id);
}

/// Called when a constant with mutants first to last is used at run time.
inline void use(int first, int last) {
  if (!is_recording) return;
  for (int id = first; id <= last; ++id) note_reached(id);
}

/// A literal and the replacements by mutants first, first + 1, ...
template <class Original, class... Others>
constexpr std::common_type_t<Original, Others...> value(int first, Original original, Others... others) {
  std::common_type_t<Original, Others...> result = original;
  ((on(first) ? void(result = others) : void(), ++first), ...);
  return result;
}

/// The same for the run-time copy of a constant, which must not be computed at compile time, because it could not
/// differ then, and which counts as reached only when it is used. Called before main, possibly before `selected` is
/// initialised.
template <class Original, class... Others>
std::common_type_t<Original, Others...> twin_value(int first, Original original, Others... others) {
  std::common_type_t<Original, Others...> result = original;
  ((first == read_selected() ? void(result = others) : void(), ++first), ...);
  return result;
}

template <class L, class R>
constexpr bool less(int first, const L& l, const R& r) {
  if (on(first)) return l <= r;
  return on(first + 1) ? l >= r : l < r;
}
template <class L, class R>
constexpr bool less_equal(int first, const L& l, const R& r) {
  if (on(first)) return l < r;
  return on(first + 1) ? l > r : l <= r;
}
template <class L, class R>
constexpr bool greater(int first, const L& l, const R& r) {
  if (on(first)) return l >= r;
  return on(first + 1) ? l <= r : l > r;
}
template <class L, class R>
constexpr bool greater_equal(int first, const L& l, const R& r) {
  if (on(first)) return l > r;
  return on(first + 1) ? l < r : l >= r;
}
template <class L, class R>
constexpr bool equal(int first, const L& l, const R& r) {
  return on(first) ? l != r : l == r;
}
template <class L, class R>
constexpr bool not_equal(int first, const L& l, const R& r) {
  return on(first) ? l == r : l != r;
}

template <class L, class R>
constexpr auto plus(int id, const L& l, const R& r) {
  return on(id) ? l - r : l + r;
}
/// The sum of two points in time does not exist: there the operands are swapped.
template <class L, class R>
constexpr auto minus(int id, const L& l, const R& r) {
  if constexpr (requires { l + r; }) {
    return on(id) ? l + r : l - r;
  } else {
    return on(id) ? r - l : l - r;
  }
}
template <class L, class R>
constexpr L& plus_assign(int id, L& l, const R& r) {
  if (on(id)) return l -= r;
  return l += r;
}
template <class L, class R>
constexpr L& minus_assign(int id, L& l, const R& r) {
  if (on(id)) return l += r;
  return l -= r;
}
template <class T>
constexpr T& increment(int id, T& t) {
  if (on(id)) return --t;
  return ++t;
}
template <class T>
constexpr T& decrement(int id, T& t) {
  if (on(id)) return ++t;
  return --t;
}
template <class T>
constexpr auto negative(int id, const T& t) {
  return on(id) ? +t : -t;
}

}  // namespace bmu_mutant
