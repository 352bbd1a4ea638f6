#!/usr/bin/env python3
"""Every data member of a class that has BMU_FIELDS stands in it, in the order of the class.

The compiler refuses a list whose members do not fill their class (image_names_all_fields), but a member that hides in
padding, as one bool behind another, it does not see. This looks for it in the text: classes here name their members
before their list, one a line, and nothing nested behind it.

    tests/meta/fields.py              all headers of protocol and daemon/core
    tests/meta/fields.py --self-test  that it finds what it should
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NO_MEMBER = re.compile(r"\s*(using|static|friend|enum|struct|class|template|public|private|protected|constexpr|\[\[)")


def without_comments(text):
    text = re.sub(r"//[^\n]*", "", text)
    return re.sub(r"^\s*#[^\n]*(\\\n[^\n]*)*", "", text, flags=re.MULTILINE)


def bodies(text):
    """The text of each innermost and outer class body, without what is nested in it."""
    stack = [""]
    for letter in text:
        if letter == "{":
            stack.append("")
        elif letter == "}" and len(stack) > 1:
            inner = stack.pop()
            yield inner
            stack[-1] += "{};" if re.search(r"\)[^;=]*$|(struct|class|enum)[^;]*$", stack[-1].split(";")[-1]) else "{}"
        else:
            stack[-1] += letter
    yield stack[0]


def named(body):
    match = re.search(r"BMU_FIELDS\(((?:[^()]|\([^()]*\))*)\)", body)
    return None if match is None else re.findall(r"(?:skipped\()?\s*([a-z]\w*)\s*\)?\s*(?:,|$)", match.group(1))


def members(body):
    before = body[: body.index("BMU_FIELDS(")]
    for statement in before.split(";"):
        statement = re.sub(r"\b(public|private|protected):", "", statement).strip()
        declared = re.split(r"[={]", statement)[0].strip()
        if not declared or NO_MEMBER.match(statement) or "operator" in declared or "(" in re.sub(r"<.*>", "", declared):
            continue
        yield re.search(r"(\w+)$", declared).group(1)


def complaints(text, name):
    for body in bodies(without_comments(text)):
        found = named(body)
        if found is None:
            continue
        wanted = list(members(body))
        if found != wanted:
            yield (f"{name}: BMU_FIELDS({', '.join(found)}): found without {sorted(set(wanted) - set(found))}, "
                   f"wanted {', '.join(wanted)}")


def self_test():
    good = """
    class A {
     public:
      void f() { int x = 1; }
      [[nodiscard]] bool g() const { return a_ > 0; }
     private:
      struct Slot {
        int inside = 0;
        BMU_FIELDS(inside)
      };
      static constexpr int most = 3;
      std::array<Slot, 4> a_{};  // b_;
      std::optional<int> b_{};
      bool c_ = false;
      std::array<std::array<int, 2>, 3> d_{};
      void after_reading_fields() { c_ = false; }
      BMU_FIELDS(a_, skipped(b_), c_,
                 d_)
    };"""
    assert not list(complaints(good, "good")), list(complaints(good, "good"))
    for old, new in [(", c_,\n", ",\n"), ("inside)", ")"), ("a_, skipped(b_)", "skipped(b_), a_")]:
        assert old in good and list(complaints(good.replace(old, new), "bad")), new


def main():
    self_test()
    if sys.argv[1:] == ["--self-test"]:
        return 0
    headers = [*ROOT.glob("protocol/**/*.hpp"), *ROOT.glob("daemon/core/**/*.hpp")]
    found, lists = [], 0
    for header in sorted(headers):
        if header.name == "fields.hpp":
            continue
        text = header.read_text()
        lists += text.count("BMU_FIELDS(") - len(re.findall(r"//[^\n]*BMU_FIELDS\(", text))
        found += complaints(text, str(header.relative_to(ROOT)))
    seen = sum(named(body) is not None for header in headers if header.name != "fields.hpp"
               for body in bodies(without_comments(header.read_text())))
    if seen != lists:
        found.append(f"found {seen} classes with BMU_FIELDS, wanted {lists}")
    print("\n".join(found), file=sys.stderr, end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
