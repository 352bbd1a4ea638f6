#!/usr/bin/env python3
"""only_prose.py PAGE...: against HEAD, nothing but prose has changed in these Markdown pages: code blocks, HTML comments, pictures, targets of links,
numbers and the set of `code spans` are the same. Headings that changed are listed with who links to their anchor. Prints banned words left.
Exit status 1 if something is wrong."""
import re, subprocess, sys, pathlib
from collections import Counter
BANNED = re.compile(r"\b(told|tell|tells|say|says|said|nobody|somebody|anybody|whoever|anew|stranger|strangers|wish|wishes|former|life|lives|believed|hear|hears|heard)\b", re.I)
FENCE = re.compile(r"^(```|~~~).*?^\1[^\n]*$", re.S | re.M)
def parts(text):
    blocks = [m[0] for m in FENCE.finditer(text)]
    prose = FENCE.sub("", text)
    spans = Counter(re.findall(r"`[^`\n]+`", prose))
    bare = re.sub(r"`[^`\n]+`", "", prose)
    links = Counter(re.findall(r"\]\(([^)]+)\)", bare))
    html = re.findall(r"<!--.*?-->", bare, re.S)
    bare_text = re.sub(r"\]\([^)]+\)|<!--.*?-->", "", bare, flags=re.S)
    numbers = Counter(re.findall(r"(?<![\w.])\d[\d,.]*\d|(?<![\w.])\d(?!\w)", bare_text))
    heads = re.findall(r"^#+ .*$", bare, re.M)
    return blocks, spans, links, html, numbers, heads, bare_text
def anchor(head):
    return re.sub(r"[^\w\- ]", "", re.sub(r"^#+ ", "", head).lower()).replace(" ", "-")
wrong = left = 0
for name in sys.argv[1:]:
    old = subprocess.run(["git", "show", f"HEAD:{name}"], capture_output=True, text=True).stdout
    new = pathlib.Path(name).read_text()
    a, b = parts(old), parts(new)
    def bad(text):
        global wrong
        wrong += 1; print(f"{name}: {text}")
    if a[0] != b[0]: bad("code blocks changed")
    lost = set(a[1]) - set(b[1]); 
    if lost: bad(f"code spans lost: {sorted(lost)[:12]}")
    if set(a[2]) - set(b[2]): bad(f"links lost: {sorted(set(a[2]) - set(b[2]))}")
    if a[3] != b[3]: bad("HTML comments changed")
    n = set(a[4]) - set(b[4])
    if n: bad(f"numbers lost: {sorted(n)[:12]}")
    for h, g in zip(a[5], b[5]):
        if h != g:
            users = subprocess.run(["git", "grep", "-n", "-F", "#" + anchor(h)], capture_output=True, text=True).stdout.strip()
            print(f"{name}: heading {h!r} -> {g!r}; links to its anchor: {users or 'none'}")
            if users: wrong += 1
    if len(a[5]) != len(b[5]): print(f"{name}: {len(a[5])} -> {len(b[5])} headings")
    for i, line in enumerate(FENCE.sub(lambda m: "\n" * m[0].count("\n"), new).split("\n"), 1):
        for w in BANNED.findall(re.sub(r"`[^`\n]+`|\]\([^)]+\)", "", line)):
            left += 1; print(f"{name}:{i}: {w}")
print(f"{len(sys.argv)-1} pages, {wrong} wrong, {left} banned words left")
sys.exit(1 if wrong else 0)
