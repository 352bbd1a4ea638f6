// The page of a reload: changed values.
#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

std::string shown_value(const Reply& value) {
  return value.is_known() ? value.text() : "not there";
}

}  // namespace

Page reload_page(const Reply& reply) {
  Page page;
  for (std::size_t i = 0; i < reply["warnings"].size(); ++i) {
    page.add({{"Warning: " + reply["warnings"].at(i).text(), Style::warning}});
  }
  const std::string hash = reply["config_hash"].text();
  if (!reply["is_new_life"].is_true()) {
    page.add({plain("Nothing to change: configuration " + hash + " is in force already.")});
    return page;
  }
  page.add({plain("Configuration " + hash + " is in force, it was " + reply["config_hash_before"].text() + ".")});
  const Reply changes = reply["changes"];
  if (changes.size() == 0) page.add({plain("No value is another one.")});
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const Reply change = changes.at(i);
    page.add(
        {plain(change["path"].text() + ": " + shown_value(change["before"]) + ", now " + shown_value(change["now"]))});
  }
  if (const std::int64_t more = reply["changes_left_out"].number_or(0); more > 0) {
    page.add({plain("And " + std::to_string(more) + " more.")});
  }
  return page;
}

}  // namespace bmu
