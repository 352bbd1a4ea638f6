// The page itself: the rows' own tests compare its lines, and these the text around them and their order.
#include "tests/catalogue/page.hpp"

#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "tests/catalogue/catalogue.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folders.hpp"

namespace bmu::test {

namespace {

const std::string page_file = test::in_source("docs/reaction-times.md");
const std::string begin_mark = "<!-- begin of the rows: written by BMUD_REWRITE=1 test_catalogue \"[docs]\" -->\n";
const std::string end_mark = "<!-- end of the rows -->\n";

std::string committed_page() {
  std::ifstream stream(page_file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string table_head() {
  std::string names = "| no. | fault | reaction | longest allowed, ms |";
  std::string rule = "|---|---|---|---|";
  for (const Pack& pack : packs()) {
    names += " " + std::string(pack.name) + ": configured, ms | measured worst, ms |";
    rule += "---|---|";
  }
  return names + "\n" + rule + "\n";
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

}  // namespace

std::string page_line_begin(int number, std::string_view what) {
  return "| " + std::to_string(number) + " | " + std::string(what) + " | ";
}

std::string committed_line(int number, std::string_view what) {
  const std::string begin = page_line_begin(number, what);
  for (const std::string& line : lines_of(committed_page())) {
    if (line.starts_with(begin)) return line;
  }
  return "";
}

bool is_rewriting() {
  return std::getenv("BMUD_REWRITE") != nullptr;
}

TEST_CASE("docs/reaction-times.md has a line for every case of the catalogue, in order", "[catalogue][docs]") {
  const std::string page = committed_page();
  const std::size_t first = page.find(begin_mark);
  const std::size_t last = page.find(end_mark);
  REQUIRE(first != std::string::npos);
  REQUIRE(last != std::string::npos);
  const std::size_t start = first + begin_mark.size();
  if (is_rewriting()) {
    std::string rows = "\n" + table_head();
    for (const Row* row : all_rows()) {
      for (const std::string& line : measured_lines(*row)) rows += line + "\n";
    }
    std::ofstream(page_file, std::ios::binary) << page.substr(0, start) + rows + "\n" + page.substr(last);
    return;
  }
  const std::vector<std::string> lines = lines_of(page.substr(start, last - start));
  std::vector<std::string> wanted = lines_of("\n" + table_head());
  for (const Row* row : all_rows()) {
    for (const Case& one : row->cases) wanted.push_back(page_line_begin(row->number, one.what));
  }
  INFO("to write it anew: BMUD_REWRITE=1 test_catalogue \"[docs]\"");
  REQUIRE(lines.size() == wanted.size() + 1);
  for (std::size_t index = 0; index < wanted.size(); ++index) CHECK(lines[index].starts_with(wanted[index]));
}

TEST_CASE("no two cases of the catalogue have the same line", "[catalogue]") {
  std::set<std::string> begins;
  for (const Row* row : all_rows()) {
    for (const Case& one : row->cases) {
      INFO(page_line_begin(row->number, one.what));
      CHECK(begins.insert(page_line_begin(row->number, one.what)).second);
    }
  }
  CHECK(begins.size() > 100);
}

}  // namespace bmu::test
