// Draws the cells of all modules, in the form that fits.
//
//   large    M1   ▅▅▅▅  ▅▅▅▅b ▅▅▅▅     numbers  M1   3.894▼ 3.897b 3.903▲     small  M1  ▅▼▅b▅▲  3.89V 25C
//                 3.89▼ 3.90  3.90▲
#include <algorithm>
#include <array>

#include "tools/bmuctl/picture.hpp"
#include "tools/bmuctl/text_pages.hpp"

namespace bmu {

namespace {

constexpr int label_width = 5;
constexpr int small_label_width = 4;
constexpr int bar_height_max = 4;

/// Voltages of an empty and of a full bar.
struct Scale {
  std::int64_t low_uV = 0;
  std::int64_t high_uV = 1;
};

struct CellsView {
  Reply cells;
  const Glyphs& glyphs;
  Scale scale;
};

Scale scale_of(const Reply& cells, bool spans_cells) {
  const Reply spread = cells["cell_voltage"];
  const auto min_uV = spread["min_uV"].number();
  const auto max_uV = spread["max_uV"].number();
  if (spans_cells && min_uV && max_uV) return {*min_uV, std::max(*max_uV, *min_uV + 1)};
  const Reply limits = cells["cell_voltage_limits"];
  const std::int64_t low_uV = limits["low_open_uV"].number_or(0);
  return {low_uV, std::max(limits["high_open_uV"].number_or(1), low_uV + 1)};
}

// --- one cell -------------------------------------------------------------------------------------------------------

/// The mark of the lowest or highest cell of the pack; "" for neither.
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

bool is_bled(const Reply& module, std::size_t cell) {
  return module["balancing"].at(cell).is_true();
}

/// The mark in the one column beside a small bar.
std::string_view small_mark(const CellsView& view, const Reply& module, std::size_t cell) {
  const std::string_view mark = mark_of(view, module, cell);
  if (!is_bled(module, cell)) return mark.empty() ? " " : mark;
  return mark.empty() ? "b" : "B";
}

Style style_of_cell(const CellsView& view, const Reply& module, std::size_t cell) {
  const Reply value = module["cell_voltage_uV"].at(cell);
  const Style style = style_within(value.number(), view.cells["cell_voltage_limits"], Unit::uV);
  if (style != Style::normal) return style;
  return mark_of(view, module, cell).empty() ? Style::normal : Style::strong;
}

Style style_of_bar(const CellsView& view, const Reply& module, std::size_t cell) {
  const Style style = style_of_cell(view, module, cell);
  return is_bled(module, cell) && style != Style::bad && style != Style::warning ? Style::active : style;
}

/// The glyph in this row of a bar of `rows` rows, 0 the lowest: at least an eighth of the lowest, so that a cell is
/// visible. "" above the bar.
std::string_view level_of(const CellsView& view, const Reply& value, int row, int rows) {
  const auto number = value.number();
  if (!number) return row == 0 ? "?" : "";
  const auto eighths = static_cast<std::int64_t>(view.glyphs.levels.size());
  const std::int64_t span_uV = view.scale.high_uV - view.scale.low_uV;
  const std::int64_t full = eighths * rows;
  const std::int64_t filled = std::clamp<std::int64_t>((*number - view.scale.low_uV) * full / span_uV + 1, 1, full);
  const std::int64_t here = filled - eighths * row;
  if (here <= 0) return "";
  return view.glyphs.levels[static_cast<std::size_t>(std::min(here, eighths) - 1)];
}

// --- one module -----------------------------------------------------------------------------------------------------

std::string module_label(const Reply& module) {
  return "M" + std::to_string(module["node"].number_or(0));
}

Style module_style(const Reply& module) {
  return module["is_answering"].is_true() ? Style::dim : Style::bad;
}

std::optional<std::int64_t> hottest(const Reply& module) {
  std::optional<std::int64_t> highest;
  for (std::size_t i = 0; i < module["cell_temperature_dC"].size(); ++i) {
    const auto value = module["cell_temperature_dC"].at(i).number();
    if (value && (!highest || *value > *highest)) highest = value;
  }
  return highest;
}

std::optional<std::int64_t> lowest_voltage(const Reply& module) {
  std::optional<std::int64_t> lowest;
  for (std::size_t i = 0; i < module["cell_voltage_uV"].size(); ++i) {
    const auto value = module["cell_voltage_uV"].at(i).number();
    if (value && (!lowest || *value < *lowest)) lowest = value;
  }
  return lowest;
}

/// "3.", decimals, mark, space.
constexpr int cell_step(int decimals) {
  return decimals + 4;
}

void draw_large_bars(const CellsView& view, const Reply& module, int decimals, int row, int rows, Canvas& canvas) {
  const Reply voltages = module["cell_voltage_uV"];
  for (std::size_t i = 0; i < voltages.size(); ++i) {
    const int column = label_width + static_cast<int>(i) * cell_step(decimals);
    const Style style = style_of_bar(view, module, i);
    for (int level = 0; level < rows; ++level) {
      const std::string_view sign = level_of(view, voltages.at(i), level, rows);
      for (int k = 0; k < decimals + 2 && !sign.empty(); ++k)
        canvas.put(row + rows - 1 - level, column + k, sign, style);
    }
    if (is_bled(module, i)) canvas.put(row + rows - 1, column + decimals + 2, "b", Style::active);
  }
}

/// Draws the cells `first` to `last` of a module; both marks fit after a number only without the bars above.
void draw_numbers(const CellsView& view, const Reply& module, std::size_t first, std::size_t last, int decimals,
                  int row, bool with_bled, Canvas& canvas) {
  for (std::size_t i = first; i < last; ++i) {
    const std::string value = shown_short(module["cell_voltage_uV"].at(i).number(), Unit::uV, decimals);
    const Style style = style_of_cell(view, module, i);
    const int at = label_width + static_cast<int>(i - first) * cell_step(decimals);
    const int column = canvas.put(row, at, value, style);
    if (with_bled) {
      canvas.put(row, column, small_mark(view, module, i), is_bled(module, i) ? Style::active : style);
    } else {
      canvas.put(row, column, mark_of(view, module, i), style);
    }
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
  const std::string answer = "   last answer " + shown_span(module["last_answer_age_ms"]) + " ago";
  if (column + static_cast<int>(width_of(answer)) <= canvas.width()) {
    canvas.put(row, column, answer, module_style(module));
  }
}

void draw_small(const CellsView& view, const Reply& module, int row, int column, int rows, bool with_values,
                Canvas& canvas) {
  const int lowest_row = row + rows - 1;
  canvas.put(lowest_row, column, module_label(module), module_style(module));
  const Reply voltages = module["cell_voltage_uV"];
  for (std::size_t i = 0; i < voltages.size(); ++i) {
    const int at = column + small_label_width + 2 * static_cast<int>(i);
    const Style style = style_of_bar(view, module, i);
    for (int level = 0; level < rows; ++level) {
      canvas.put(lowest_row - level, at, level_of(view, voltages.at(i), level, rows), style);
    }
    canvas.put(lowest_row, at + 1, small_mark(view, module, i), is_bled(module, i) ? Style::active : style);
  }
  if (!with_values) return;
  const auto lowest = lowest_voltage(module);
  const auto hot = hottest(module);
  int at = column + small_label_width + 24;
  at = canvas.put(lowest_row, at, shown_short(lowest, Unit::uV, 2) + "V",
                  style_within(lowest, view.cells["cell_voltage_limits"], Unit::uV));
  canvas.put(lowest_row, at + 1, shown_short(hot, Unit::dC, 0) + "C",
             style_within(hot, view.cells["cell_temperature_limits"], Unit::dC));
}

// --- which form -----------------------------------------------------------------------------------------------------

enum class Kind : std::uint8_t { large, numbers, small };

struct Form {
  Kind kind = Kind::small;
  int decimals = 2;
  bool with_details = false;  // large bars and numbers: a row of temperatures; small bars: values
  int bar_rows = 1;
  int rows_per_module = 1;
  int modules_per_row = 1;

  /// Rows for all modules.
  [[nodiscard]] int rows_for(int count) const {
    return (count + modules_per_row - 1) / modules_per_row * rows_per_module;
  }
};

constexpr int small_width = small_label_width + 24 + 1;
constexpr int small_width_with_values = small_width + 10;

int cells_max(const Reply& modules) {
  std::size_t most = 1;
  for (std::size_t i = 0; i < modules.size(); ++i) most = std::max(most, modules.at(i)["cell_voltage_uV"].size());
  return static_cast<int>(most);
}

/// The last cell needs no space after it.
bool fits_across(int cells, int decimals, int width) {
  return label_width + cells * cell_step(decimals) - 1 <= width;
}

Form large_form(int decimals, bool with_details) {
  return {
      .kind = Kind::large, .decimals = decimals, .with_details = with_details, .rows_per_module = with_details ? 3 : 2};
}

Form small_form(bool with_values, int width) {
  const int each = with_values ? small_width_with_values : small_width;
  return {.with_details = with_values, .modules_per_row = std::max((width + 1) / each, 1)};
}

Form numbers_form(int cells, int width) {
  constexpr int decimals = 3;
  const int per_row = std::clamp((width - label_width + 1) / cell_step(decimals), 1, cells);
  return {.kind = Kind::numbers, .decimals = decimals, .rows_per_module = (cells + per_row - 1) / per_row};
}

/// With bars as high as the remaining rows permit.
Form with_higher_bars(Form form, int count, int rows) {
  const int lines = std::max(form.rows_for(count) / form.rows_per_module, 1);
  const int more = std::clamp(rows / lines - form.rows_per_module, 0, bar_height_max - 1);
  form.bar_rows += more;
  form.rows_per_module += more;
  return form;
}

/// The most detailed form in which all modules fit; else the smallest.
Form fitting_form(int count, int cells, int rows, int width) {
  for (const bool with_details : {true, false}) {
    for (const int decimals : {3, 2}) {
      const Form form = large_form(decimals, with_details);
      if (fits_across(cells, decimals, width) && form.rows_for(count) <= rows) {
        return with_higher_bars(form, count, rows);
      }
    }
  }
  const Form with_values = small_form(true, width);
  return with_higher_bars(with_values.rows_for(count) <= rows ? with_values : small_form(false, width), count, rows);
}

Form bars_form(int cells, int width) {
  for (const int decimals : {3, 2}) {
    if (fits_across(cells, decimals, width)) return large_form(decimals, true);
  }
  return small_form(true, width);
}

Form form_for(const PictureView& view, const Reply& modules, int rows, int width) {
  const int cells = cells_max(modules);
  switch (view.form) {
    case CellsForm::fitting: break;
    case CellsForm::bars: return bars_form(cells, width);
    case CellsForm::numbers: return numbers_form(cells, width);
  }
  return fitting_form(static_cast<int>(modules.size()), cells, rows, width);
}

void draw_module(const CellsView& view, const Form& form, const Reply& module, int row, int column, Canvas& canvas) {
  const std::size_t cells = module["cell_voltage_uV"].size();
  switch (form.kind) {
    case Kind::small: return draw_small(view, module, row, column, form.bar_rows, form.with_details, canvas);
    case Kind::large: {
      canvas.put(row, 0, module_label(module), module_style(module));
      draw_large_bars(view, module, form.decimals, row, form.bar_rows, canvas);
      draw_numbers(view, module, 0, cells, form.decimals, row + form.bar_rows, false, canvas);
      if (form.with_details) draw_module_details(view, module, row + form.bar_rows + 1, canvas);
      return;
    }
    case Kind::numbers: {
      canvas.put(row, 0, module_label(module), module_style(module));
      const auto per_row =
          (cells + static_cast<std::size_t>(form.rows_per_module) - 1) / static_cast<std::size_t>(form.rows_per_module);
      for (std::size_t first = 0; first < cells; first += per_row) {
        draw_numbers(view, module, first, std::min(first + per_row, cells), form.decimals, row++, true, canvas);
      }
    }
  }
}

std::string modules_text(const Reply& modules, int first, int shown) {
  return "modules " + std::to_string(first + 1) + " to " + std::to_string(first + shown) + " of " +
         std::to_string(modules.size());
}

}  // namespace

CellsDrawn draw_cells(const Reply& cells, const PictureView& view, const Glyphs& glyphs, int first_row, int rows,
                      Canvas& canvas) {
  const CellsView drawn{cells, glyphs, scale_of(cells, view.bars_span_cells)};
  const Reply modules = cells["modules"];
  const int count = static_cast<int>(modules.size());
  Form form = form_for(view, modules, rows, canvas.width());
  if (form.rows_per_module > rows) form = small_form(true, canvas.width());

  const int lines = form.rows_for(count) / form.rows_per_module;
  const int lines_shown = std::min(lines, std::max(rows / form.rows_per_module, 1));
  const int first_line = std::clamp(view.first, 0, lines - lines_shown);
  const int first = first_line * form.modules_per_row;
  const int shown = std::min(lines_shown * form.modules_per_row, count - first);
  const int width = form.with_details ? small_width_with_values : small_width;
  for (int i = 0; i < shown; ++i) {
    const auto module = static_cast<std::size_t>(first) + static_cast<std::size_t>(i);
    draw_module(drawn, form, modules.at(module), first_row + i / form.modules_per_row * form.rows_per_module,
                i % form.modules_per_row * width, canvas);
  }
  return {.rows = lines_shown * form.rows_per_module,
          .extent = {.shown = lines_shown, .total = lines},
          .modules = shown == count ? "" : modules_text(modules, first, shown)};
}

}  // namespace bmu
