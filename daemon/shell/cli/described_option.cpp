#include "daemon/shell/cli/described_option.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace bmu::command_line {
namespace {

struct KindRow {
  std::string_view end;  // end of the value's name
  ValueKind kind;
};

// The first match counts. The programs choose the names of their values; a name that is not here can be anything.
constexpr std::array kind_table{
    KindRow{"FILE", ValueKind::file},        KindRow{"FILE...", ValueKind::file},  KindRow{"PATH", ValueKind::file},
    KindRow{".json", ValueKind::file},       KindRow{".sqlite", ValueKind::file},  KindRow{".csv", ValueKind::file},
    KindRow{".svg", ValueKind::file},        KindRow{"CSV", ValueKind::file},      KindRow{"CSV...", ValueKind::file},
    KindRow{"DEVICE", ValueKind::file},      KindRow{"FOLDER", ValueKind::folder}, KindRow{"BUS", ValueKind::bus},
    KindRow{"BUS[,FILTER]", ValueKind::bus},
};

constexpr std::array<std::string_view, 5> plain_names{"", "TEXT", "UINT", "INT", "FLOAT"};

ValueKind kind_of(const std::string& name) {
  for (const KindRow& row : kind_table) {
    if (name.ends_with(row.end)) return row.kind;
  }
  return ValueKind::anything;
}

std::vector<std::string> split(std::string_view text, char by) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = text.find(by);
    parts.emplace_back(text.substr(0, end));
    text = end == std::string_view::npos ? "" : text.substr(end + 1);
  }
  return parts;
}

/// "TEXT:{auto,always,never}": form in which the library shows a check on words.
void take_value(const CLI::Option& option, DescribedOption& out) {
  const std::string shown = option.get_type_name();
  const std::size_t braces = shown.find('{');
  out.value_name = shown.substr(0, shown.find(':'));
  if (braces != std::string::npos && shown.ends_with('}')) {
    const std::string_view words = std::string_view(shown).substr(braces + 1, shown.size() - braces - 2);
    out.words = split(words, ',');
    out.kind = ValueKind::words;
    out.value_name = words;
    std::replace(out.value_name.begin(), out.value_name.end(), ',', '|');
    return;
  }
  // Default name of the library for a value without one; the name of the positional is better.
  const bool is_plain = std::find(plain_names.begin(), plain_names.end(), out.value_name) != plain_names.end();
  const std::string positional = option.get_name(true);
  if (is_plain && !option.nonpositional()) out.value_name = positional;
  out.kind = kind_of(out.value_name);
}

DescribedOption describe(const CLI::Option& option) {
  DescribedOption out{.names = {},
                      .value_name = "",
                      .description = option.get_description(),
                      .default_text = option.get_default_str(),
                      .kind = ValueKind::none,
                      .words = {},
                      .is_repeated = option.get_expected_max() > 1};
  for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  if (option.get_type_size_max() > 0 && option.get_expected_max() > 0) take_value(option, out);
  return out;
}

}  // namespace

std::vector<DescribedOption> described_options(const CLI::App& app, bool positionals) {
  std::vector<DescribedOption> all;
  for (const CLI::Option* option : app.get_options(nullptr)) {
    const bool is_hidden = option->get_group().empty();
    if (!is_hidden && (positionals ? option->get_positional() : option->nonpositional()))
      all.push_back(describe(*option));
  }
  return all;
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::string full_name(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  return parent == nullptr ? app.get_name() : full_name(*parent) + " " + app.get_name();
}

}  // namespace bmu::command_line
