// CSV as cell testers, spreadsheets and R write it: accepted files, and files rejected because their meaning is
// ambiguous.
#include "tools/bmucell/data/csv_table.hpp"

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/catch.hpp"
#include "tools/bmucell/data/csv_text.hpp"

using namespace bmu::cell;
using namespace std::string_literals;

namespace {

const CsvSpec spec{.names = {"a", "b", "c"}, .required = 2, .never_empty = 1, .head = "a first line with a, b"};

std::vector<double> values_of(const std::string& text) {
  const auto table = parse_csv(text, spec);
  INFO((table ? "" : table.error()));
  REQUIRE(table);
  REQUIRE(table->values.size() == 3 * table->row_count());
  std::vector<double> required;
  for (std::size_t at = 0; at < table->row_count(); ++at) {
    required.push_back(table->row(at)[0]);
    required.push_back(table->row(at)[1]);
  }
  return required;
}

std::string problem_of(const std::string& text) {
  const auto table = parse_csv(text, spec);
  REQUIRE_FALSE(table);
  return table.error();
}

using Values = std::vector<double>;

}  // namespace

TEST_CASE("fields are read with each separator that gives the names of the columns", "[unit][bmucell]") {
  const Values expected{1.0, 2.5, -3.0, 4e-3};
  CHECK(values_of("a,b\n1,2.5\n-3,4e-3\n") == expected);
  CHECK(values_of("b;x;a\n2.5;9;1\n4e-3;9;-3\n") == expected);
  CHECK(values_of("a\tb\n1\t2.5\n-3\t4e-3\n") == expected);
  CHECK(values_of("  a   b\n  1   2.5\n -3 4e-3 \n") == expected);
  CHECK(values_of("a , b\t\n 1,\t2.5 \n-3 ,4e-3\n") == expected);
  CHECK(values_of("sep=;\n\na;b\n1;2.5\n-3;4e-3\n") == expected);
}

TEST_CASE("heads and values may be in quotes, which may hold separators and line ends", "[unit][bmucell]") {
  CHECK(values_of("\"a\",\"b\"\n\"1\",\"2\"\n") == Values{1.0, 2.0});
  CHECK(values_of("\"a\" , \"b\"\n 1 , \" 2\"\n").size() == 2);
  CHECK(values_of("x,a,b\n\"say \"\"1,2\"\"\nand 3\",1,2\n,3,4\n") == Values{1.0, 2.0, 3.0, 4.0});
  const auto table = parse_csv("x,a,b\n\"two\nlines\",1,2\n,3,4\n", spec);
  REQUIRE(table);
  CHECK(table->lines == std::vector<std::size_t>{2, 4});
  CHECK(problem_of("a,b\n1,\"2\n3,4\n") ==
        ":2: found a quote that does not end, or text behind its end; expected \"...\" as a field");
  CHECK(problem_of("a,b\n1,\"2\"3\n").find(":2: found a quote that does not end, or text behind its end") == 0);
}

TEST_CASE("lines without any text are passed over and keep their numbers", "[unit][bmucell]") {
  const auto table = parse_csv("\n a,b\r\n1,2\r\n\r\n,\r\n3,4\r\n\r\n", spec);
  REQUIRE(table);
  CHECK(table->lines == std::vector<std::size_t>{3, 6});
  CHECK(values_of("a,b\r1,2\r3,4\r") == Values{1.0, 2.0, 3.0, 4.0});
  CHECK(problem_of("a,b\n\n1,x\n") == ":3: b: found 'x', expected a number");
}

TEST_CASE("a number may have a plus sign, and may be missing as testers and R write it", "[unit][bmucell]") {
  CHECK(values_of("a,b\n+1,+.5\n") == Values{1.0, 0.5});
  CHECK(problem_of("a,b\n1,+-2\n") == ":2: b: found '+-2', expected a number");
  CHECK(problem_of("a,b\n1,+\n") == ":2: b: found '+', expected a number");
  for (const std::string missing : {"", "nan", "NaN", "NA", "\"NA\""}) {
    INFO(missing);
    CHECK(std::isnan(values_of("a,b\n1," + missing + "\n")[1]));
    CHECK(problem_of("a,b\n" + missing + ",1\n").find(":2: a: found '") == 0);
  }
  CHECK(std::isnan(parse_csv("a,b\n1,2\n", spec)->row(0)[2]));
}

TEST_CASE("a decimal comma is one where it cannot be anything else", "[unit][bmucell]") {
  CHECK(values_of("a;b\n1,5;-0,25\n") == Values{1.5, -0.25});
  CHECK(values_of("a\tb\n0,184\t3,371\n") == Values{0.184, 3.371});  // no number of thousands begins with 0
  CHECK(values_of("a;b\n1;1234,567\n") == Values{1.0, 1234.567});
  CHECK(values_of("a;b\n1;,567\n") == Values{1.0, 0.567});
  CHECK(values_of("a;b\n1;1,5e3\n") == Values{1.0, 1500.0});
  CHECK(values_of("a,b\n\"1,5\",\"2\"\n") == Values{1.5, 2.0});
  CHECK(problem_of("a;b\n0;1,234\n7;2,345\n") ==
        ":2: b: found '1,234', thousands or a decimal comma; expected a decimal point");
  CHECK(problem_of("a;b\n1.5;0\n2;2,5\n") ==
        ":3: b: found '2,5' with a comma and in line 2 '1.5' with a point, expected one decimal mark and no other");
  CHECK(problem_of("a;b\n1;1,234,567\n") == ":2: b: found '1,234,567', expected a number");
  CHECK(problem_of("a;b\n1;1.234,5\n") == ":2: b: found '1.234,5', expected a number");
  CHECK(problem_of("a,b\n1,5,2,5\n") ==
        ":2: found 4 fields, expected 2 as in the first line; values with a decimal comma need quotes, or another "
        "separator");
}

TEST_CASE("names of rows as R writes them, and separators at the ends of lines, are no values", "[unit][bmucell]") {
  CHECK(values_of("\"\",\"a\",\"b\"\n\"1\",5,6\n\"2\",7,8\n") == Values{5.0, 6.0, 7.0, 8.0});
  CHECK(values_of("\"a\" \"b\"\n\"1\" 5 6\n\"2\" 7 8\n") == Values{5.0, 6.0, 7.0, 8.0});
  CHECK(values_of("a,b\n5,6,\n") == Values{5.0, 6.0});
  CHECK(values_of("a,b,\n5,6\n7,8,\n") == Values{5.0, 6.0, 7.0, 8.0});
  CHECK(problem_of("\"a\",\"b\"\n\"1\",\"5\",\"6\"\n").find(":2: found 3 fields, expected 2") == 0);
  CHECK(problem_of("a;b\n1;5;6\n") == ":2: found 3 fields, expected 2 as in the first line");
}

TEST_CASE("a last line without a line end may be cut off: it is left out, and is named", "[unit][bmucell]") {
  const auto torn = parse_csv("a,b\n1,2\n3", spec);
  REQUIRE(torn);
  CHECK(torn->row_count() == 1);
  CHECK(torn->torn_line == 3);
  // "7" of "79.840" is a number, too; a number with as many digits as those above it is not certain either.
  for (const char* const cut : {"3,7", "3,79.84", "3,", "3", "3,2.0", "\"3\",7", "3,x", "3,4,5"}) {
    CAPTURE(cut);
    const auto one = parse_csv("a,b\n1,2.0\n" + std::string(cut), spec);
    REQUIRE(one);
    CHECK(one->row_count() == 1);
    CHECK(one->torn_line == 3);
  }
  const auto whole = parse_csv("a,b\n1,2\n3,\"4\"", spec);
  REQUIRE(whole);
  CHECK(whole->row_count() == 2);
  CHECK(whole->torn_line == 0);
  CHECK(parse_csv("a,b\n1,2\n3,4\n", spec)->torn_line == 0);
  CHECK(problem_of("a,b\n1,2\n3\n") == ":3: found 1 fields, expected 2 as in the first line");
  CHECK(problem_of("a,b\n1") == ":2: the only row has no line end and may be cut off");
  CHECK(problem_of("a,b\n") == ": no rows after the first line");
}

TEST_CASE("a first line without the names is shown with what to do about it", "[unit][bmucell]") {
  const std::string end = "; expected a first line with a, b";
  CHECK(problem_of("time;b\n1;2\n") == ": no column 'a' in line 1, 'time;b': rename its columns" + end);
  CHECK(problem_of("1,2\n3,4\n") ==
        ": no column 'a' in line 1, '1,2': it has values, not names: add a line of names" + end);
  CHECK(problem_of("Tester\na;b\n1;2\n") ==
        ": no column 'a' in line 1, 'Tester': line 2 has them: remove line 1" + end);
  CHECK(problem_of("Tester\n\nunits\na,b\n1,2\n") ==
        ": no column 'a' in line 1, 'Tester': line 4 has them: remove lines 1 to 3" + end);
  CHECK(problem_of("A\x01\xb0,B\n") == ": no column 'a' in line 1, 'A??,B': rename its columns" + end);
  CHECK(problem_of(std::string(200, 'x') + "\n").find("'" + std::string(60, 'x') + "...': ") != std::string::npos);
  CHECK(problem_of("a,b,a\n1,2,3\n") == ":1: found column 'a' twice, expected it once");
}

TEST_CASE("text is read in UTF-8 and UTF-16, with a byte-order mark or without", "[unit][bmucell]") {
  CHECK(utf8_text("a,b").value() == "a,b");
  CHECK(utf8_text("\xef\xbb\xbf"
                  "a,\xc2\xb0")
            .value() == "a,\xc2\xb0");
  CHECK(utf8_text("\xff\xfe"
                  "a\0,\0\xb0\0\x3d\x26"s)
            .value() == "a,??");
  CHECK(utf8_text("\xfe\xff"
                  "\0a\0,\0b"s)
            .value() == "a,b");
  CHECK(utf8_text("a\0,\0b\0"s).value() == "a,b");
  CHECK(utf8_text("\0a\0,"s).value() == "a,");
  CHECK(utf8_text("").value().empty());
  CHECK(utf8_text("\xff\xfe"
                  "a\0,"s)
            .error() == ": ends within a character of UTF-16; the file is not complete");
  CHECK(utf8_text("a,b\0c"s).error() == ": found a zero byte, expected CSV, which is text");
  CHECK(utf8_text("PK\x03\x04whatever").error() ==
        ": found a ZIP archive, as spreadsheets are saved in, expected CSV; export the table as CSV");
}
