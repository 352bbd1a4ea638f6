#!/usr/bin/env python3
"""only_comments.py [FOLDER...]: in the C++ sources that differ from HEAD (under these folders), nothing but comments has changed, and
those that tools read (NOLINT, clang-format, cppcheck, requirement ids, numbers of rows and decisions) are still there.
Exit status 1 if not. Prints banned words left in the comments of the folders, with file and line."""
import re, subprocess, sys
from collections import Counter

TOKEN = re.compile(r'R"(?P<d>[^()\\ ]{0,16})\(.*?\)(?P=d)"|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/', re.S)
SPECIAL = re.compile(r"NOLINT\w*|clang-format o\w+|cppcheck-suppress\w*|IWYU|\b(?:BMS|BMU|MMU|PB|CHG|PDU|SF|NF|HW|SW)_[A-Z0-9_.]*\d\b|docs/decisions/\d+|\brow \d+|https?://\S+")
BANNED = re.compile(r"\b(told|tell|tells|say|says|said|nobody|somebody|anybody|whoever|anew|stranger|strangers|wish|wishes|former|life|lives|believed|hear|hears|heard)\b", re.I)

def split(text):
    code, comments, last = [], [], 0
    for m in TOKEN.finditer(text):
        code.append(text[last:m.start()])
        if m[0].startswith(("//", "/*")):
            comments.append((text.count("\n", 0, m.start()) + 1, m[0]))
        else:
            code.append(m[0])
        last = m.end()
    code.append(text[last:])
    return re.sub(r"\s+", "", "".join(code)), comments

def main():
    folders = sys.argv[1:] or ["."]
    changed = subprocess.run(["git", "diff", "--name-only", "HEAD", "--", *folders], capture_output=True, text=True, check=True).stdout.split()
    wrong = 0
    for name in changed:
        if not name.endswith((".cpp", ".hpp", ".h", ".c")):
            print(f"{name}: changed, and is no C++ source"); wrong += 1; continue
        old = subprocess.run(["git", "show", f"HEAD:{name}"], capture_output=True, text=True, check=True).stdout
        new = open(name).read()
        (a, ca), (b, cb) = split(old), split(new)
        if a != b:
            at = next((i for i, (x, y) in enumerate(zip(a, b)) if x != y), min(len(a), len(b)))
            print(f"{name}: code changed: ...{a[max(0,at-40):at+40]!r} -> {b[max(0,at-40):at+40]!r}"); wrong += 1
        sa = Counter(w for _, c in ca for w in SPECIAL.findall(c)); sb = Counter(w for _, c in cb for w in SPECIAL.findall(c))
        if set(sa) - set(sb):
            print(f"{name}: lost from comments: {sorted(set(sa) - set(sb))}"); wrong += 1
    left = 0
    for name in subprocess.run(["git", "ls-files", "--", *folders], capture_output=True, text=True, check=True).stdout.split():
        if not name.endswith((".cpp", ".hpp", ".h", ".c")): continue
        for line, comment in split(open(name).read())[1]:
            for word in BANNED.findall(comment):
                left += 1
                if left <= 400: print(f"{name}:{line}: {word}")
    print(f"{len(changed)} files changed, {wrong} wrong, {left} banned words left in comments")
    sys.exit(1 if wrong else 0)
main()
