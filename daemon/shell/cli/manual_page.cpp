#include "daemon/shell/cli/manual_page.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <vector>

#include "daemon/shell/cli/described_option.hpp"

namespace bmu::command_line {
namespace {

/// A backslash, and a dot or quote at the start of a line, have a meaning for man; a dash would become a hyphen, which
/// a search for an option does not find. A line may be broken after a bar: there is no space between many alternatives.
std::string escaped(std::string_view text) {
  std::string out;
  bool is_line_start = true;
  for (const char c : text) {
    if (is_line_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '|') {
      out += "|\\:";
    } else {
      out += c;
    }
    is_line_start = c == '\n';
  }
  return out;
}

std::string bold(std::string_view text) {
  return "\\fB" + escaped(text) + "\\fR";
}

std::string italic(std::string_view text) {
  return "\\fI" + escaped(text) + "\\fR";
}

/// "Watches over a pack: ... ." as the one line that man -k searches.
std::string in_short(const std::string& description) {
  std::string text = description.substr(0, description.find(". "));
  std::replace(text.begin(), text.end(), '\n', ' ');
  if (text.ends_with('.')) text.pop_back();
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

/// The blocks of a text, which blank lines separate.
std::vector<std::string> blocks_of(const std::string& text) {
  std::vector<std::string> blocks;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find("\n\n", at), text.size());
    const std::string block = text.substr(at, end - at);
    const std::size_t first = block.find_first_not_of('\n');
    if (first != std::string::npos) blocks.push_back(block.substr(first));
    at = end + 2;
  }
  return blocks;
}

std::string verbatim(std::string_view text) {
  return ".nf\n" + escaped(text) + "\n.fi\n";
}

/// Lines that begin with a space keep their form: they are examples or tables. Others are one running text.
std::string paragraph(std::string_view text) {
  std::string out;
  std::string kept;
  const auto flush = [&] {
    if (!kept.empty()) out += verbatim(kept.substr(0, kept.size() - 1));
    kept.clear();
  };
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    if (line.starts_with(' ')) {
      kept += std::string(line) + "\n";
    } else {
      flush();
      out += escaped(line) + "\n";
    }
    text.remove_prefix(std::min(text.size(), line.size() + 1));
  }
  flush();
  return out;
}

struct HeadedRow {
  std::string_view words;  // beginning of a block of --help
  std::string_view section;
  bool has_the_rest;  // the blocks after it belong to it
};

constexpr std::array headed_table{
    HeadedRow{.words = "Examples:", .section = "EXAMPLES", .has_the_rest = false},
    HeadedRow{.words = "Exit codes", .section = "EXIT STATUS", .has_the_rest = true},
};

/// The text below the options, by section.
struct Foot {
  std::string text;                                       // for the description
  std::array<std::string, headed_table.size()> sections;  // without their titles
};

std::string without_title(const std::string& block) {
  const std::size_t colon = block.find(':');
  const std::size_t begin = colon == std::string::npos ? std::string::npos : block.find_first_not_of(" \n", colon + 1);
  if (begin == std::string::npos) return "";
  // An indentation belongs to the text after it.
  return block[colon + 1] == '\n' ? block.substr(colon + 2) : block.substr(begin);
}

/// The subject in "Exit codes of this: ..." has to stay in the section.
std::string section_text(const HeadedRow& row, const std::string& block) {
  const bool is_plain = row.words.ends_with(':') || block.find(':') == row.words.size();
  return paragraph(is_plain ? without_title(block) : block);
}

Foot foot_of(const CLI::App& app) {
  Foot foot;
  // The library passes the footer of a program on to its commands.
  if (app.get_parent() != nullptr && app.get_footer() == app.get_parent()->get_footer()) return foot;
  std::string* rest = &foot.text;
  for (const std::string& block : blocks_of(app.get_footer())) {
    const auto* row = std::find_if(headed_table.begin(), headed_table.end(),
                                   [&](const HeadedRow& one) { return block.starts_with(one.words); });
    if (row == headed_table.end()) {
      *rest += ".PP\n" + paragraph(block);
      continue;
    }
    std::string& section = foot.sections[static_cast<std::size_t>(row - headed_table.begin())];
    section += section_text(*row, block);
    if (row->has_the_rest) rest = &section;
  }
  return foot;
}

std::string option_text(const DescribedOption& option) {
  std::string head;
  for (const std::string& name : option.names) head += (head.empty() ? "" : ", ") + bold(name);
  if (!option.value_name.empty()) head += (head.empty() ? "" : " ") + italic(option.value_name);
  const std::string told = option.default_text.empty() ? "" : " (default: " + option.default_text + ")";
  return ".TP\n" + head + "\n" + paragraph(option.description + told);
}

std::string options_text(const CLI::App& app) {
  std::string text;
  for (const DescribedOption& option : described_options(app, true)) {
    // One that also has a name is among those below.
    if (option.names.empty()) text += option_text(option);
  }
  for (const DescribedOption& option : described_options(app, false)) text += option_text(option);
  return text;
}

std::string synopsis_of(const CLI::App& app) {
  const bool has_options = described_options(app, false).size() > 1;  // more than --help
  std::string text = bold(full_name(app)) + (has_options ? " [" + italic("OPTIONS") + "]" : "");
  for (const CLI::Option* option : app.get_options(nullptr)) {
    if (option->get_group().empty() || !option->get_positional()) continue;
    const std::string name = italic(option->get_name(true)) + (option->get_expected_max() > 1 ? "..." : "");
    text += option->get_required() ? " " + name : " [" + name + "]";
  }
  if (!commands_of(app).empty()) text += " " + italic("COMMAND") + " ...";
  return text + "\n";
}

std::string section(std::string_view name, const std::string& text) {
  return text.empty() ? "" : ".SH " + std::string(name) + "\n" + text;
}

/// A command and, below it, its own commands. Its -h is not repeated.
std::string command_text(const CLI::App& command) {
  std::string text = ".SS " + synopsis_of(command) + paragraph(command.get_description()) + "\n";
  for (const bool positionals : {true, false}) {
    for (const DescribedOption& option : described_options(command, positionals)) {
      const bool is_help = std::find(option.names.begin(), option.names.end(), "--help") != option.names.end();
      if (!is_help) text += option_text(option);
    }
  }
  const Foot foot = foot_of(command);
  text += foot.text;
  for (const std::string& part : foot.sections) {
    if (!part.empty()) text += ".PP\n" + part;
  }
  for (const CLI::App* each : commands_of(command)) text += command_text(*each);
  return text;
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return static_cast<char>(std::toupper(static_cast<unsigned char>(c))); });
  return text;
}

}  // namespace

std::string manual_page(const CLI::App& app, int section_number) {
  const std::string& name = app.get_name();
  const Foot foot = foot_of(app);
  std::string commands;
  for (const CLI::App* command : commands_of(app)) commands += command_text(*command);
  std::string page = ".TH " + upper(name) + " " + std::to_string(section_number) +
                     " \"\" \"bmud " BMUD_VERSION "\" \"bmud, a battery management master\"\n";
  // Names that follow each other without a space cannot be adjusted to both margins.
  page += ".ad l\n";
  page += section("NAME", escaped(name) + " \\- " + escaped(in_short(app.get_description())) + "\n");
  page += section("SYNOPSIS", synopsis_of(app));
  page += section("DESCRIPTION", paragraph(app.get_description()) + foot.text);
  page += section("OPTIONS", options_text(app));
  page += section("COMMANDS", commands);
  for (std::size_t i = 0; i < headed_table.size(); ++i) page += section(headed_table[i].section, foot.sections[i]);
  return page;
}

}  // namespace bmu::command_line
