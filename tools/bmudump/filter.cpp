#include "tools/bmudump/filter.hpp"

#include <algorithm>

#include "protocol/number_text.hpp"

namespace bmu::dump {
namespace {

// Flags of the kernel's identifiers.
constexpr std::uint32_t extended_flag = 0x8000'0000;
constexpr std::uint32_t remote_flag = 0x4000'0000;
constexpr std::uint32_t extended_id_max = 0x1FFF'FFFF;
constexpr std::size_t extended_digits = 8;

std::uint32_t flagged_id(const CanFrame& frame) {
  return frame.id | (frame.is_extended ? extended_flag : 0) | (frame.is_remote ? remote_flag : 0);
}

std::string upper(std::string_view text) {
  std::string all(text);
  std::transform(all.begin(), all.end(), all.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return all;
}

}  // namespace

std::optional<std::uint32_t> parse_hex(std::string_view word) {
  if (word.starts_with("0x") || word.starts_with("0X")) word.remove_prefix(2);
  return number_of_text<std::uint32_t>(word, 16);
}

bool Filter::add(const std::string& word, const Catalogue& catalogue) {
  is_empty_ = false;
  if (word == "j" || word == "J") return wants_all_ = true;
  if (word.starts_with('#')) {
    const std::optional<std::uint32_t> mask = parse_hex(std::string_view(word).substr(1));
    error_mask_ |= mask.value_or(0);
    return mask.has_value();
  }
  has_data_words_ = true;
  return add_names(word, catalogue) || add_mask(word) || add_id(word);
}

bool Filter::add_names(std::string_view word, const Catalogue& catalogue) {
  const bool is_beginning = word.ends_with('*');
  if (is_beginning) word.remove_suffix(1);
  const std::string name = upper(word);  // all names of messages are in upper case
  bool is_found = false;
  for (const MessageSpec* message : catalogue.messages()) {
    if (is_beginning ? !message->name.starts_with(name) : message->name != name) continue;
    is_found = true;
    for (unsigned node = message->node_min; node <= message->node_max; ++node) add_id_of(*message, node);
  }
  return is_found;
}

void Filter::add_id_of(const MessageSpec& message, unsigned node) {
  const std::uint32_t id = message.id_of(node);
  if (message.is_extended) {
    masks_.push_back({.id = id | extended_flag, .mask = extended_id_max | extended_flag});
  } else {
    ids_.set(id);
    has_ids_ = true;
  }
}

bool Filter::add_mask(std::string_view word) {
  const std::size_t sign = word.find_first_of(":~");
  if (sign == std::string_view::npos) return false;
  const std::optional<std::uint32_t> id = parse_hex(word.substr(0, sign));
  const std::optional<std::uint32_t> mask = parse_hex(word.substr(sign + 1));
  if (!id || !mask) return false;
  const std::uint32_t extended = sign == extended_digits ? extended_flag : 0;
  masks_.push_back({.id = *id | extended, .mask = *mask, .is_inverse = word[sign] == '~'});
  return true;
}

bool Filter::add_id(std::string_view word) {
  const std::optional<std::uint32_t> id = parse_hex(word);
  if (!id || *id > extended_id_max) return false;
  if (*id < ids_.size() && word.size() < extended_digits) {
    ids_.set(*id);
    has_ids_ = true;
  } else {
    masks_.push_back({.id = *id | extended_flag, .mask = extended_id_max | extended_flag});
  }
  return true;
}

bool Filter::passes_words(const CanFrame& frame) const {
  if (frame.is_error) return (frame.id & error_mask_) != 0;
  if (!has_data_words_) return true;
  // The kernel has no bit 29 in identifiers of filters.
  const std::uint32_t id = flagged_id(frame);
  const auto matches = [id](const Mask& one) {
    const std::uint32_t mask = one.mask & (extended_id_max | extended_flag | remote_flag);
    return ((id & mask) == (one.id & mask)) != one.is_inverse;
  };
  const bool has_id = has_ids_ && !frame.is_extended && ids_.test(frame.id);
  if (!wants_all_) return has_id || std::any_of(masks_.begin(), masks_.end(), matches);
  return (has_id || !has_ids_) && std::all_of(masks_.begin(), masks_.end(), matches);
}

}  // namespace bmu::dump
