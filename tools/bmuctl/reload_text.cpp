// The page of a reload: changed values.
#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

std::string shown_value(const Reply& value) {
  return value.is_known() ? value.text() : "absent";
}

}  // namespace

Page reload_page(const Reply& reply) {
  Page page;
  for (std::size_t i = 0; i < reply["warnings"].size(); ++i) {
    page.add({{"Warning: " + reply["warnings"].at(i).text(), Style::warning}});
  }
  const std::string hash = reply["config_hash"].text();
  if (!reply["is_new_life"].is_true()) {
    page.add({plain("Configuration " + hash + " unchanged.")});
    return page;
  }
  page.add({plain("Configuration " + hash + " active, previously " + reply["config_hash_before"].text() + ".")});
  const Reply changes = reply["changes"];
  if (changes.size() == 0) page.add({plain("No value changed.")});
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const Reply change = changes.at(i);
    page.add(
        {plain(change["path"].text() + ": " + shown_value(change["before"]) + " -> " + shown_value(change["now"]))});
  }
  if (const std::int64_t more = reply["changes_left_out"].number_or(0); more > 0) {
    page.add({plain(std::to_string(more) + (more == 1 ? " more change." : " more changes."))});
  }
  return page;
}

}  // namespace bmu
