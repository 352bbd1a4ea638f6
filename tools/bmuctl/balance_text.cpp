#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

Line words(std::string text, Style style = Style::normal) {
  return {{std::move(text), style}};
}

/// True if the cell takes part in balancing: it has charge left to bleed, bled charge, commanded minutes, or its switch
/// on.
bool has_part(const Reply& module, std::size_t cell) {
  return module["to_go_uAs"].at(cell).number_or(0) > 0 || module["bled_uAs"].at(cell).number_or(0) > 0 ||
         module["minutes_told"].at(cell).number_or(0) > 0 || module["is_on"].at(cell).is_true();
}

void add_cells(std::vector<Line>& rows, const Reply& module) {
  for (std::size_t cell = 0; cell < module["to_go_uAs"].size(); ++cell) {
    if (!has_part(module, cell)) continue;
    const std::int64_t minutes = module["minutes_told"].at(cell).number_or(0);
    const bool is_on = module["is_on"].at(cell).is_true();
    rows.push_back(
        {{shown(module["node"], Unit::none)},
         {std::to_string(cell + 1)},
         {std::to_string(module["first_pack_number"].number_or(1) + static_cast<std::int64_t>(cell))},
         {shown(module["to_go_uAs"].at(cell), Unit::uAs)},
         {minutes > 0 ? std::to_string(minutes) + " min" : "-"},
         {is_on ? "on" : "off", is_on ? Style::strong : Style::dim},
         {shown(module["bled_uAs"].at(cell), Unit::uAs)},
         {module["missing_uAs"].at(cell).is_known() ? shown(module["missing_uAs"].at(cell), Unit::uAs) : "unknown",
          Style::dim}});
  }
}

/// Text for a switch that is on without a command.
std::string untold_text(const Reply& element) {
  const bool is_there = element["pack_number"].number_or(0) > 0;
  return element["text"].text() + (is_there ? "" : ", not present in the module");
}

/// "1 cell", "2 cells".
std::string counted(const Reply& number, const char* one, const char* more) {
  return shown(number, Unit::none) + " " + (number.number_or(0) == 1 ? one : more);
}

}  // namespace

std::string balancing_text(const Reply& balancing) {
  const Reply reasons = balancing["reasons"];
  if (reasons.size() > 0) return balancing["state"].text() + ": " + reasons.at(0)["text"].text();
  if (balancing["on_untold"].size() > 0) {
    return balancing["state"].text() + ": switch on without command: " + untold_text(balancing["on_untold"].at(0));
  }
  if (balancing["state"].text() == "bleeding") {
    return "bleeding " + counted(balancing["cells_told"], "cell", "cells") + ", " +
           counted(balancing["cells_on"], "switch", "switches") + " on";
  }
  return balancing["state"].text() + ", last plan: " + balancing["plan"].text();
}

Page balance_page(const Reply& reply) {
  Page page;
  page.add_field("Balancing", words(balancing_text(reply), Style::strong));
  page.add_field("Method", words(reply["method"].text() + ", " + reply["state"].text() + " for " +
                                 shown_span(reply["state_for_ms"])));
  for (std::size_t i = 0; i < reply["reasons"].size(); ++i) {
    page.add_field("Inhibit", words(reply["reasons"].at(i)["text"].text()));
  }
  for (std::size_t i = 0; i < reply["on_untold"].size(); ++i) {
    page.add_field("Uncommanded", words(untold_text(reply["on_untold"].at(i)), Style::warning));
  }
  if (reply["planned_ago_ms"].is_known()) {
    page.add_field("Plan", words(reply["plan"].text() + ", made " + shown_span(reply["planned_ago_ms"]) + " ago"));
  }
  std::vector<Line> rows{{{"Module", Style::dim},
                          {"Cell", Style::dim},
                          {"No.", Style::dim},
                          {"Remaining", Style::dim},
                          {"Commanded", Style::dim},
                          {"Switch", Style::dim},
                          {"Bled", Style::dim},
                          {"To full", Style::dim}}};
  for (std::size_t m = 0; m < reply["modules"].size(); ++m) {
    const Reply module = reply["modules"].at(m);
    const std::string command = module["command"].text();
    if (command == "refused" || command == "no answer") {
      page.add_field("Module " + shown(module["node"], Unit::none), words(command, Style::warning));
    }
    add_cells(rows, module);
  }
  if (rows.size() > 1) page.add_table(rows, {0, 1, 2, 3, 4, 5, 6, 7});
  return page;
}

}  // namespace bmu
