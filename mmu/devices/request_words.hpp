// Requests of the emulated display, as the script's keywords (mmu/devices/can_requester.hpp): every parameter of the
// manufacturer's table, and as the last one the command to clear the stored fault.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

#include "devices/lithiumate_requests/lithiumate_requests.hpp"

namespace bmu {

namespace detail {

inline constexpr std::size_t request_parameter_count = std::size(lithiumate_requests::parameter_names);
inline constexpr std::size_t request_word_length_max = 32;

/// The manufacturer's names as keywords.
consteval auto request_letters() {
  std::array<std::array<char, request_word_length_max>, request_parameter_count> letters{};
  for (std::size_t index = 0; index < request_parameter_count; ++index) {
    const std::string_view name = lithiumate_requests::parameter_names[index].name;
    std::transform(name.begin(), name.end(), letters[index].begin(), [](char c) { return c == ' ' ? '_' : c; });
  }
  return letters;
}
inline constexpr auto letters_of_requests = request_letters();

consteval auto all_request_words() {
  std::array<std::string_view, request_parameter_count + 1> words;
  for (std::size_t index = 0; index < request_parameter_count; ++index) {
    words[index] = {letters_of_requests[index].data(), lithiumate_requests::parameter_names[index].name.size()};
  }
  words.back() = "clear_faults";
  return words;
}

}  // namespace detail

inline constexpr auto request_words = detail::all_request_words();

}  // namespace bmu
