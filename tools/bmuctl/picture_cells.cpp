#include <algorithm>
#include <array>

#include "tools/bmuctl/picture.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

constexpr int label_width = 5;

struct CellsView {
  Reply cells;
  const Glyphs& glyphs;
};

/// Whether this cell is the lowest or highest of the pack; "" for neither.
std::string_view mark_of(const CellsView& view, const Reply& module, std::size_t cell) {
  const auto is_at = [&](const Reply& element) {
    return element.is_known() && element["module"].number_or(0) == module["node"].number_or(0) &&
           element["number"].number_or(0) == static_cast<std::int64_t>(cell) + 1;
  };
  const Reply spread = view.cells["cell_voltage"];
  if (is_at(spread["min_at"])) return view.glyphs.lowest;
  if (is_at(spread["max_at"])) return view.glyphs.highest;
  return "";
}

Style style_of_cell(const CellsView& view, const Reply& module, std::size_t cell) {
  const Reply value = module["cell_voltage_uV"].at(cell);
  const Style style = style_within(value.number(), view.cells["cell_voltage_limits"], Unit::uV);
  return style == Style::normal && !mark_of(view, module, cell).empty() ? Style::strong : style;
}

std::string module_label(const Reply& module) {
  return "M" + std::to_string(module["node"].number_or(0));
}

Style module_style(const Reply& module) {
  return module["is_answering"].is_true() ? Style::dim : Style::bad;
}

// --- numbers: a module a line, or two -------------------------------------------------------------------------------

void draw_numbers(const CellsView& view, const Reply& module, int decimals, int row, Canvas& canvas) {
  canvas.put(row, 0, module_label(module), module_style(module));
  const int step = decimals + 4;  // "3.", decimals, mark, space
  for (std::size_t i = 0; i < module["cell_voltage_uV"].size(); ++i) {
    const std::string value = shown_short(module["cell_voltage_uV"].at(i).number(), Unit::uV, decimals);
    const std::string_view mark = mark_of(view, module, i);
    const Style style = style_of_cell(view, module, i);
    const int column = canvas.put(row, label_width + static_cast<int>(i) * step, value, style);
    canvas.put(row, column, mark.empty() && module["balancing"].at(i).is_true() ? "b" : mark, style);
  }
}

void draw_module_details(const CellsView& view, const Reply& module, int row, Canvas& canvas) {
  int column = canvas.put(row, label_width, "temperature ", Style::dim);
  for (std::size_t i = 0; i < module["cell_temperature_dC"].size(); ++i) {
    const auto value = module["cell_temperature_dC"].at(i).number();
    column = canvas.put(row, column, shown_short(value, Unit::dC, 1) + " ",
                        style_within(value, view.cells["cell_temperature_limits"], Unit::dC));
  }
  column = canvas.put(row, column, "C", Style::dim);
  column = canvas.put(row, column, "   module " + shown(module["module_voltage_mV"], Unit::mV), Style::dim);
  canvas.put(row, column, "   last answer " + shown_span(module["last_answer_age_ms"]) + " ago", module_style(module));
}

std::optional<std::int64_t> hottest(const Reply& module) {
  std::optional<std::int64_t> highest;
  for (std::size_t i = 0; i < module["cell_temperature_dC"].size(); ++i) {
    const auto value = module["cell_temperature_dC"].at(i).number();
    if (value && (!highest || *value > *highest)) highest = value;
  }
  return highest;
}

// --- bars: a cell a column, several modules a line
// --------------------------------------------------------------------

std::string_view level_of(const CellsView& view, const Reply& value) {
  const Reply limits = view.cells["cell_voltage_limits"];
  const std::int64_t low = limits["low_open_uV"].number_or(0);
  const std::int64_t span = std::max<std::int64_t>(limits["high_open_uV"].number_or(1) - low, 1);
  const auto number = value.number();
  if (!number) return "?";
  const auto count = static_cast<std::int64_t>(view.glyphs.levels.size());
  const std::int64_t level = std::clamp<std::int64_t>((*number - low) * count / span, 0, count - 1);
  return view.glyphs.levels[static_cast<std::size_t>(level)];
}

void draw_bars(const CellsView& view, const Reply& module, int row, int column, bool with_values, Canvas& canvas) {
  canvas.put(row, column, module_label(module), module_style(module));
  int at = column + 4;
  const Reply voltages = module["cell_voltage_uV"];
  std::optional<std::int64_t> lowest;
  for (std::size_t i = 0; i < voltages.size(); ++i) {
    const auto value = voltages.at(i).number();
    if (value && (!lowest || *value < *lowest)) lowest = value;
    const bool is_marked = !mark_of(view, module, i).empty();
    at = canvas.put(row, at, level_of(view, voltages.at(i)), is_marked ? Style::title : style_of_cell(view, module, i));
  }
  if (!with_values) return;
  const auto hot = hottest(module);
  at = canvas.put(row, column + 17, shown_short(lowest, Unit::uV, 2),
                  style_within(lowest, view.cells["cell_voltage_limits"], Unit::uV));
  canvas.put(row, at + 1, shown_short(hot, Unit::dC, 0) + "C",
             style_within(hot, view.cells["cell_temperature_limits"], Unit::dC));
}

int draw_bar_grid(const CellsView& view, const Reply& modules, int width, bool with_values, int first_row, int rows,
                  Canvas& canvas) {
  const int per_line = std::max(canvas.width() / width, 1);
  const int count = static_cast<int>(modules.size());
  const int rows_wanted = (count + per_line - 1) / per_line;
  const bool fits = rows_wanted <= rows;
  const int shown = fits ? count : std::max(rows - 1, 0) * per_line;
  for (int i = 0; i < shown; ++i) {
    draw_bars(view, modules.at(static_cast<std::size_t>(i)), first_row + i / per_line, i % per_line * width,
              with_values, canvas);
  }
  if (fits) return rows_wanted;
  int cells_left = 0;
  for (int i = shown; i < count; ++i) {
    cells_left += static_cast<int>(modules.at(static_cast<std::size_t>(i))["cell_voltage_uV"].size());
  }
  put_more(cells_left, "cells", first_row + rows - 1, canvas);
  return rows;
}

// --- which form
// -------------------------------------------------------------------------------------------------------

struct NumbersForm {
  int lines_per_module;
  int decimals;
  int width;  // for 12 cells
};
constexpr std::array numbers_forms{NumbersForm{2, 3, 88}, NumbersForm{2, 2, 76}, NumbersForm{1, 3, 88},
                                   NumbersForm{1, 2, 76}};

constexpr int grid_width_with_values = 28;
constexpr int grid_width = 17;

}  // namespace

int draw_cells(const Reply& cells, const Glyphs& glyphs, int first_row, int rows, Canvas& canvas) {
  const CellsView view{cells, glyphs};
  const Reply modules = cells["modules"];
  const int count = static_cast<int>(modules.size());
  for (const NumbersForm& form : numbers_forms) {
    if (count * form.lines_per_module > rows || form.width > canvas.width()) continue;
    for (int i = 0; i < count; ++i) {
      const Reply module = modules.at(static_cast<std::size_t>(i));
      const int row = first_row + i * form.lines_per_module;
      draw_numbers(view, module, form.decimals, row, canvas);
      if (form.lines_per_module == 2) {
        draw_module_details(view, module, row + 1, canvas);
      } else {
        const auto hot = hottest(module);
        canvas.put(row, form.width + 2, shown_short(hot, Unit::dC, 1) + " C",
                   style_within(hot, cells["cell_temperature_limits"], Unit::dC));
      }
    }
    return count * form.lines_per_module;
  }
  const int per_line = std::max(canvas.width() / grid_width_with_values, 1);
  const bool with_values = (count + per_line - 1) / per_line <= rows;
  return draw_bar_grid(view, modules, with_values ? grid_width_with_values : grid_width, with_values, first_row, rows,
                       canvas);
}

}  // namespace bmu
