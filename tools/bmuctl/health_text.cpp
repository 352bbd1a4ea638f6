#include <array>
#include <cstdio>
#include <utility>

#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

constexpr int permille_decimals = 1;
constexpr int resistance_decimals = 2;

/// The true value lies within two standard deviations in about 95 of 100 cases.
std::string within(const Reply& sigma, Unit unit, int decimals) {
  const auto one = sigma.number();
  return one ? " (+- " + shown_short(2 * *one, unit, decimals) + ")" : std::string{};
}

std::string share(const Reply& value, const Reply& sigma) {
  if (!value.is_known()) return "not known";
  return shown(value, Unit::permille) + within(sigma, Unit::permille, permille_decimals);
}

std::string resistance(const Reply& value) {
  return value.is_known() ? shown_short(value.number(), Unit::uOhm, resistance_decimals) + " mOhm" : "--";
}

std::string of_cell(const Reply& element) {
  return element.is_known() ? ", " + element["text"].text() : "";
}

std::string of_average(const Reply& permille) {
  return permille.is_known() ? ", " + shown(permille, Unit::permille) + " of the average" : "";
}

Line words(std::string text, Style style = Style::normal) {
  return {{std::move(text), style}};
}

/// "12.35": discharged capacity in multiples of the whole capacity.
std::string cycles_text(const Reply& permille) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f", static_cast<double>(permille.number_or(0)) / 1e3);
  return text.data();
}

void add_flowed(Page& page, const Reply& totals) {
  if (!totals.is_known()) {
    page.add_field("Throughput", words("not recorded (no state file)", Style::dim));
    return;
  }
  page.add_field(
      "Throughput",
      words("out " + shown(totals["charge_out_uAs"], Unit::uAs) + ", " + shown_energy(totals["energy_out_mWh"]) +
            "   in " + shown(totals["charge_in_uAs"], Unit::uAs) + ", " + shown_energy(totals["energy_in_mWh"]) +
            "   full cycles " + cycles_text(totals["cycles_permille"])));
}

void add_cells(std::vector<Line>& rows, const Reply& module) {
  for (std::size_t cell = 0; cell < module["capacity_uAs"].size(); ++cell) {
    const auto at = [&module, cell](std::string_view key) { return module[key].at(cell); };
    const bool is_used = at("capacity_pairs").number_or(0) > 0 || at("capacity_refused").number_or(0) > 0;
    const std::string seen = !is_used ? "" : shown(at("capacity_pairs"), Unit::none);
    const std::string refused = at("capacity_refused").number_or(0) > 0
                                    ? ", rejected " + shown(at("capacity_refused"), Unit::none)
                                    : std::string{};
    rows.push_back({{shown(module["node"], Unit::none)},
                    {std::to_string(cell + 1)},
                    {std::to_string(module["first_pack_number"].number_or(1) + static_cast<std::int64_t>(cell))},
                    {shown(at("capacity_uAs"), Unit::uAs)},
                    {share(at("health_by_capacity_permille"), at("health_by_capacity_sigma_permille"))},
                    {seen + refused, Style::dim},
                    {resistance(at("resistance_uOhm"))},
                    {share(at("health_by_resistance_permille"), at("health_by_resistance_sigma_permille"))},
                    {resistance(at("step_resistance_uOhm")), Style::dim}});
  }
}

}  // namespace

Page health_page(const Reply& reply) {
  Page page;
  page.add_field("Capacity", words(share(reply["by_capacity_permille"], reply["by_capacity_sigma_permille"]) + " of " +
                                   shown(reply["rated_capacity_uAs"], Unit::uAs) + of_cell(reply["weakest_cell"])));
  const std::string soh = share(reply["by_resistance_permille"], reply["by_resistance_sigma_permille"]);
  const bool has_soh = reply["by_resistance_permille"].is_known();
  page.add_field("Resistance", words((has_soh ? "SOH-R " + soh + " (0 % at twice the initial resistance)" : soh) +
                                     of_cell(reply["worst_cell"])));
  page.add_field("Pack", words(resistance(reply["pack_resistance_uOhm"]) +
                               within(reply["pack_resistance_sigma_uOhm"], Unit::uOhm, resistance_decimals)));
  page.add_field(
      "Cells",
      words("lowest " + resistance(reply["cell_resistance_min_uOhm"]) + of_cell(reply["cell_resistance_min_at"]) +
            "   highest " + resistance(reply["cell_resistance_max_uOhm"]) + of_cell(reply["cell_resistance_max_at"]) +
            of_average(reply["cell_resistance_max_permille"])));
  add_flowed(page, reply["totals"]);
  if (reply["is_charge_paused"].is_true()) {
    page.add_field("Paused", words("charging, for a resistance measurement", Style::strong));
  }
  std::vector<Line> rows{{{"Module", Style::dim},
                          {"Cell", Style::dim},
                          {"No.", Style::dim},
                          {"Capacity", Style::dim},
                          {"SOH-C", Style::dim},
                          {"Samples", Style::dim},
                          {"Resistance", Style::dim},
                          {"SOH-R", Style::dim},
                          {"Pulse", Style::dim}}};
  for (std::size_t m = 0; m < reply["modules"].size(); ++m) add_cells(rows, reply["modules"].at(m));
  page.add_table(rows, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  return page;
}

}  // namespace bmu
