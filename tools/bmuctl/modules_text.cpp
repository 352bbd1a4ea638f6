// The pages of "bmuctl modules": the present and the configured modules, and how each answers.
#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

/// "3.4 ms" of microseconds; "--" if it is not known.
std::string shown_us(const Reply& us) {
  const auto value = us.number();
  if (!value) return "--";
  const std::int64_t tenths = (*value + 50) / 100;
  return std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " ms";
}

Line heading(std::initializer_list<const char*> names) {
  Line line;
  for (const char* name : names) line.push_back({name, Style::dim});
  return line;
}

std::string serial_cell(const Reply& module) {
  const std::string found = shown(module["serial_number"], Unit::none);
  const Reply expected = module["serial_number_expected"];
  const bool differs = expected.is_known() && expected.number() != module["serial_number"].number();
  return differs ? found + " (expected " + shown(expected, Unit::none) + ")" : found;
}

std::string state_cell(const Reply& module) {
  if (!module["is_answering"].is_true()) return "silent";
  return module["mode"].text() + (module["is_balancing"].is_true() ? ", balancing" : "");
}

std::string supply_cell(const Reply& module) {
  const Reply own = module["on_module_supply"];
  return own.is_known() ? own.is_true() ? "module" : "external" : "--";
}

void add_identities(Page& page, const Reply& modules) {
  std::vector<Line> rows{
      heading({"Module", "serial", "identity", "mode", "supply", "cells", "temperatures", "limits"})};
  for (std::size_t i = 0; i < modules.size(); ++i) {
    const Reply module = modules.at(i);
    const bool is_good = module["problems"].size() == 0;
    const Style style = module["is_answering"].is_true() ? Style::good : Style::bad;
    const bool is_set = module["limits"].text() != "not set" && module["limits"].text() != "refused";
    rows.push_back({plain(shown(module["node"], Unit::none)),
                    {serial_cell(module), is_good ? Style::normal : Style::bad},
                    {module["place"].text(), is_good ? Style::dim : Style::bad},
                    {state_cell(module), style},
                    plain(supply_cell(module)),
                    plain(shown(module["cell_count"], Unit::none)),
                    plain(shown(module["temperature_sensor_count"], Unit::none)),
                    {module["limits"].text(), is_set ? Style::normal : Style::warning}});
  }
  page.add_table(rows, {0, 5, 6});
}

void add_answers(Page& page, const Reply& modules) {
  std::vector<Line> rows{
      heading({"Module", "last", "mean", "p95", "max", "jitter", "complete", "missed", "missed permille",
               "single polls", "crc", "length", "counter", "range", "late", "restarts"})};
  for (std::size_t i = 0; i < modules.size(); ++i) {
    const Reply times = modules.at(i)["answer_times"];
    const Reply losses = modules.at(i)["losses"];
    Line row{plain(shown(modules.at(i)["node"], Unit::none))};
    for (const auto* key : {"last_us", "mean_us", "within_95_percent_us", "worst_us", "jitter_us"}) {
      row.push_back(plain(shown_us(times[key])));
    }
    for (const auto* key :
         {"answers_complete", "answers_missed", "missed_permille", "asked_alone", "wrong_crc", "wrong_length"}) {
      row.push_back(plain(shown(losses[key], Unit::none)));
    }
    const std::int64_t counter = losses["wrong_counter"].number_or(0) + losses["repeated_counter"].number_or(0) +
                                 losses["conflicting"].number_or(0);
    row.push_back(plain(std::to_string(counter)));
    for (const auto* key : {"values_out_of_range", "late", "restarts"}) {
      row.push_back(plain(shown(losses[key], Unit::none)));
    }
    rows.push_back(std::move(row));
  }
  page.add_table(rows, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15});
}

std::string capitalised(std::string sentence) {
  if (!sentence.empty() && sentence[0] >= 'a' && sentence[0] <= 'z') sentence[0] = static_cast<char>(sentence[0] - 32);
  return sentence;
}

void add_stranger(Page& page, const Reply& stranger) {
  const std::string who = stranger["serial_number"].is_known()
                              ? "serial number " + shown(stranger["serial_number"], Unit::none) + ", " +
                                    shown(stranger["cell_count"], Unit::none) + " cells"
                              : "not identified";
  page.add({{"Unknown module at node " + shown(stranger["node"], Unit::none) + ": " + who + ".", Style::bad}});
}

/// The origin of the modules, and the substitutes for the functions that they lack.
void add_foreign(Page& page, const Reply& foreign) {
  page.add_field("Protocol", {plain(foreign["title"].text())});
  for (std::size_t i = 0; i < foreign["cannot"].size(); ++i) {
    page.add({{capitalised(foreign["cannot"].at(i).text()) + ".", Style::dim}});
  }
}

}  // namespace

Page modules_page(const Reply& reply) {
  Page page;
  const Reply modules = reply["modules"];
  page.add_field("Poll rate", {plain(reply["poll"]["pace"].text() + ", " + shown(reply["poll"]["period_ms"], Unit::ms) +
                                     "   " + shown(reply["modules_answering"], Unit::none) + " of " +
                                     shown(reply["modules_expected"], Unit::none) + " answering")});
  if (reply["foreign"].is_known()) add_foreign(page, reply["foreign"]);
  add_identities(page, modules);
  add_answers(page, modules);
  for (std::size_t i = 0; i < modules.size(); ++i) {
    const Reply problems = modules.at(i)["problems"];
    for (std::size_t p = 0; p < problems.size(); ++p)
      page.add({{capitalised(problems.at(p).text()) + ".", Style::bad}});
  }
  for (std::size_t i = 0; i < reply["strangers"].size(); ++i) add_stranger(page, reply["strangers"].at(i));
  if (reply["assignment"].is_known()) {
    page.add({plain("Last node assignment: " + reply["assignment"]["text"].text() + ".")});
  }
  return page;
}

Page accept_page(const Reply& reply) {
  Page page;
  const Reply accepted = reply["accepted"];
  for (std::size_t i = 0; i < accepted.size(); ++i) {
    const Reply one = accepted.at(i);
    const Reply before = one["serial_number_before"];
    page.add(
        {{"Module " + shown(one["node"], Unit::none) + ": serial number " + shown(one["serial_number"], Unit::none) +
              " registered" + (before.is_known() ? ", previously " + shown(before, Unit::none) : "") + ".",
          Style::good}});
  }
  const std::size_t already = reply["already"].size();
  if (accepted.size() == 0 && already > 0) {
    page.add({plain("Nothing to accept: " + (already == 1
                                                 ? std::string("the module is registered.")
                                                 : "all " + std::to_string(already) + " modules are registered."))});
  }
  for (std::size_t i = 0; i < reply["not_accepted"].size(); ++i) {
    page.add({{"Not accepted: " + reply["not_accepted"].at(i)["text"].text() + ".", Style::bad}});
  }
  for (std::size_t i = 0; i < reply["problems"].size(); ++i) {
    page.add({{"Remaining problem: " + reply["problems"].at(i).text() + ".", Style::warning}});
  }
  return page;
}

bool leaves_unaccepted(const Reply& reply) {
  const Reply refused = reply["not_accepted"];
  for (std::size_t i = 0; i < refused.size(); ++i) {
    if (reply["node"].is_known() || refused.at(i)["reason"].text() != "unheard") return true;
  }
  return false;
}

Page assignment_page(const Reply& assignment) {
  Page page;
  page.add(
      {{capitalised(assignment["text"].text()) + ".", assignment["is_done"].is_true() ? Style::good : Style::bad}});
  return page;
}

}  // namespace bmu
