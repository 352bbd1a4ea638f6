"""Finds what can be changed in a C++ source: places, and for each place the mutants.

Where an operator stands is told by the tokens, how far its operands reach by libclang: the innermost expression around
an operator is its own. Binary operators are those with white space on both sides, which clang-format sees to.

Compile-time-only code (consteval functions, static_assert, template arguments, types) is left out: it is checked by being
compiled. So are assertions, which say what cannot be.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import clang.cindex as cindex
from clang.cindex import Cursor, CursorKind, TokenKind

RELATIONAL = {
    "<": ("less", ["<=", ">="]),
    "<=": ("less_equal", ["<", ">"]),
    ">": ("greater", [">=", "<="]),
    ">=": ("greater_equal", [">", "<"]),
    "==": ("equal", ["!="]),
    "!=": ("not_equal", ["=="]),
}
ARITHMETIC = {"+": ("plus", "-"), "-": ("minus", "+"), "+=": ("plus_assign", "-="), "-=": ("minus_assign", "+=")}
FUNCTIONS = {
    CursorKind.FUNCTION_DECL,
    CursorKind.CXX_METHOD,
    CursorKind.CONSTRUCTOR,
    CursorKind.FUNCTION_TEMPLATE,
    CursorKind.CONVERSION_FUNCTION,
}
LEAVING = {CursorKind.RETURN_STMT, CursorKind.CONTINUE_STMT, CursorKind.BREAK_STMT}
ASSERTION = "BMU_ASSERT"
DURATION = re.compile(r"(\d[\d']*)(ns|us|ms|s|min|h)")
INTEGER = re.compile(r"(0[xX][0-9a-fA-F']+|\d[\d']*)([uU]?[lL]{0,2})")
FINER = {"h": (60, "min"), "min": (60, "s"), "s": (1000, "ms"), "ms": (1000, "us"), "us": (1000, "ns")}


@dataclass(frozen=True)
class Mutant:
    """One change. `change` names it for people and in survivors.txt, together with the line's text."""

    id: int
    file: str
    line: int
    column: int
    source: str
    change: str


@dataclass
class Place:
    """An expression that can be changed, by one mutant for each of `changes`, and the operator or literal in it."""

    start: int
    end: int
    kind: str
    token_start: int
    token_end: int
    changes: list[str]
    first_id: int = 0
    name: str = ""  # of the function in mutant.hpp
    others: list[str] = field(default_factory=list)  # literals in place of the original one


@dataclass(frozen=True, order=True)
class Use:
    """Where a constant's name stands in code that may run."""

    file: str
    start: int
    end: int
    may_be_constant: bool  # in a constexpr function


@dataclass(eq=False)
class Constant:
    """A constexpr variable with literals in it. At run time a second self, its twin, stands for it."""

    file: str
    name: str
    start: int
    end: int
    name_start: int
    places: list[Place]
    is_local: bool
    is_member: bool
    uses: list[Use] = field(default_factory=list)
    parts: list[tuple[int, int, Constant]] = field(default_factory=list)  # other constants by name in the initialiser
    wholes: list[Constant] = field(default_factory=list)  # constants with this one in theirs

    def ranges(self) -> list[tuple[int, int]]:
        """First and last number of the mutants that a use of this constant reaches, those of its parts, too."""
        own = [(place.first_id, place.first_id + len(place.changes) - 1) for place in self.places]
        return own + [reached for _, _, part in self.parts for reached in part.ranges()]

    def can_change(self) -> bool:
        return bool(self.places) or any(part.can_change() for _, _, part in self.parts)

    def is_used(self) -> bool:
        return bool(self.uses) or any(whole.is_used() for whole in self.wholes)


@dataclass
class Source:
    file: str
    text: bytes
    places: list[Place] = field(default_factory=list)
    constants: list[Constant] = field(default_factory=list)

    def line_text(self, offset: int) -> str:
        start = self.text.rfind(b"\n", 0, offset) + 1
        end = self.text.find(b"\n", offset)
        return self.text[start:end].decode().strip()


class CannotRead(Exception):
    """A source that libclang does not understand, or an operator it does not place."""


def parse(root: Path, file: str) -> cindex.TranslationUnit:
    unit = cindex.Index.create().parse(str(root / file), ["-x", "c++", "-std=c++20", f"-I{root}"])
    errors = [str(each) for each in unit.diagnostics if each.severity >= cindex.Diagnostic.Error]
    if errors:
        raise CannotRead(f"{file}: libclang finds errors:\n  " + "\n  ".join(errors))
    return unit


def reach_of(cursor: Cursor) -> tuple[int, int]:
    return cursor.extent.start.offset, cursor.extent.end.offset


class _Finder:
    def __init__(self, root: Path, file: str) -> None:
        self.unit = parse(root, file)
        self.path = str(root / file)
        self.source = Source(file, (root / file).read_bytes())
        self.expressions: list[tuple[int, int]] = []
        self.bodies: list[tuple[int, int]] = []
        self.initialisers: list[tuple[int, int]] = []
        self.excluded: list[tuple[int, int]] = []
        self.subscripts: list[tuple[int, int]] = []
        self.loop_heads: list[tuple[int, int]] = []
        self.constexpr_functions: list[tuple[int, int]] = []
        self.constants_at: dict[tuple[str, int], Constant] = {}
        self.references: list[tuple[Cursor, int, int]] = []
        self.tokens = [
            token
            for token in self.unit.get_tokens(extent=self.unit.cursor.extent)
            if token.kind != TokenKind.COMMENT
        ]

    # --- what the tree tells

    def walk(self) -> None:
        for cursor in self.unit.cursor.get_children():
            if cursor.location.file is not None and cursor.location.file.name == self.path:
                self._visit(cursor, in_function=False)

    def _visit(self, cursor: Cursor, in_function: bool) -> None:
        start, end = reach_of(cursor)
        kind = cursor.kind
        if kind.is_expression() or kind == CursorKind.UNEXPOSED_EXPR:
            self.expressions.append((start, end))
        if kind == CursorKind.STATIC_ASSERT:
            self.excluded.append((start, end))
        if kind in FUNCTIONS or kind == CursorKind.LAMBDA_EXPR:
            specifiers = self.source.text[start:end].split(b"(", 1)[0].split()
            if b"consteval" in specifiers:
                self.excluded.append((start, end))
            if b"constexpr" in specifiers:
                self.constexpr_functions.append((start, end))
            for child in cursor.get_children():
                if child.kind == CursorKind.COMPOUND_STMT:
                    self.bodies.append(reach_of(child))
            in_function = True
        if kind == CursorKind.FIELD_DECL:
            self.initialisers.append((cursor.location.offset + len(cursor.spelling), end))
        if kind == CursorKind.VAR_DECL:
            self._note_variable(cursor, in_function)
        if kind == CursorKind.ARRAY_SUBSCRIPT_EXPR or cursor.spelling == "operator[]":
            self.subscripts.append((start, end))
        if kind == CursorKind.FOR_STMT:
            body = list(cursor.get_children())[-1]
            self.loop_heads.append((start, body.extent.start.offset))
        if kind == CursorKind.IF_STMT:
            self._note_guard(cursor)
        if kind in (CursorKind.IF_STMT, CursorKind.CONDITIONAL_OPERATOR):
            self._note_plain_condition(cursor)
        if kind == CursorKind.DECL_REF_EXPR and cursor.referenced is not None:
            self.references.append((cursor.referenced, start, end))
        for child in cursor.get_children():
            self._visit(child, in_function)

    def _note_variable(self, cursor: Cursor, in_function: bool) -> None:
        start, end = reach_of(cursor)
        name_start = cursor.location.offset
        if b"constexpr" not in self.source.text[start:name_start].split():
            return
        self.excluded.append((start, end))
        # The extent of a variable declared behind its type begins with the specifiers.
        constant = Constant(
            self.source.file,
            cursor.spelling,
            start,
            end,
            name_start,
            [],
            is_local=in_function,
            is_member=cursor.semantic_parent.kind in (CursorKind.CLASS_DECL, CursorKind.STRUCT_DECL),
        )
        self.constants_at[self.path, name_start] = constant
        self.source.constants.append(constant)

    def _condition_of(self, cursor: Cursor) -> tuple[int, int] | None:
        """The condition, unless it declares something."""
        children = list(cursor.get_children())
        if not children or not (children[0].kind.is_expression()):
            return None
        return reach_of(children[0])

    def _note_guard(self, cursor: Cursor) -> None:
        children = list(cursor.get_children())
        condition = self._condition_of(cursor)
        if condition is None or len(children) != 2:
            return
        then = children[1]
        if then.kind == CursorKind.COMPOUND_STMT:
            inner = list(then.get_children())
            if not inner or inner[-1].kind not in LEAVING:
                return
        elif then.kind not in LEAVING:
            return
        start, end = condition
        self.source.places.append(Place(start, end, "guard", start, end, ["if (...) -> if (false)"]))

    def _note_plain_condition(self, cursor: Cursor) -> None:
        condition = self._condition_of(cursor)
        if condition is None:
            return
        start, end = condition
        text = self.source.text[start:end].decode()
        if re.search(r" (<|<=|>|>=|==|!=|&&|\|\|) |^!", text):
            return
        self.source.places.append(Place(start, end, "flip", start, end, [f"{text} -> !({text})"]))

    # --- what the tokens tell

    def exclude_assertions(self) -> None:
        for index, token in enumerate(self.tokens):
            if token.spelling != ASSERTION:
                continue
            depth = 0
            for behind in self.tokens[index + 1 :]:
                depth += {"(": 1, ")": -1}.get(behind.spelling, 0)
                if depth == 0:
                    self.excluded.append((token.extent.start.offset, behind.extent.end.offset))
                    break

    def find_places(self) -> None:
        for index, token in enumerate(self.tokens):
            start, end = token.extent.start.offset, token.extent.end.offset
            text = token.spelling
            if self._is_at_compile_time(start):
                continue
            if token.kind == TokenKind.PUNCTUATION:
                self._punctuation(text, start, end)
            else:
                self._literal(text, start, end, self.source.places)
        self._literals_of_constants()

    def _is_at_compile_time(self, offset: int) -> bool:
        if any(start <= offset < end for start, end in self.excluded):
            return True
        return not any(start <= offset < end for start, end in self.bodies + self.initialisers)

    def is_at_run_time(self, start: int, end: int) -> bool:
        """A name: not in what is computed while compiling, and no template argument either."""
        is_argument = self.source.text[start - 1 : start] == b"<" or self.source.text[end : end + 1] == b">"
        return not is_argument and not self._is_at_compile_time(start)

    def _is_spaced(self, start: int, end: int) -> bool:
        return self.source.text[start - 1 : start].isspace() and self.source.text[end : end + 1].isspace()

    def _expression_around(self, start: int, end: int) -> tuple[int, int]:
        around = [(last - first, first, last) for first, last in self.expressions if first < start and end < last]
        if not around:
            raise CannotRead(f"{self.source.file}: no expression around {self.source.line_text(start)!r}")
        _, first, last = min(around)
        return first, last

    def _punctuation(self, text: str, start: int, end: int) -> None:
        add = self.source.places.append
        if text in ("&&", "||") and self._is_spaced(start, end):
            first, last = self._expression_around(start, end)
            add(self._combination(text, first, last, start, end))
        elif text in RELATIONAL and self._is_spaced(start, end):
            first, last = self._expression_around(start, end)
            name, others = RELATIONAL[text]
            add(Place(first, last, "binary", start, end, [f"{text} -> {other}" for other in others], name=name))
        elif text in ARITHMETIC and self._is_spaced(start, end):
            first, last = self._expression_around(start, end)
            name, other = ARITHMETIC[text]
            add(Place(first, last, "binary", start, end, [f"{text} -> {other}"], name=name))
        elif text in ("!", "-", "++", "--"):
            self._unary(text, start, end)

    def _combination(self, text: str, first: int, last: int, start: int, end: int) -> Place:
        """&& or ||: exchanged, and each side left out. Of a chain the left side is left out part by part."""
        other = "||" if text == "&&" else "&&"
        kind = "and" if text == "&&" else "or"
        is_chain = any(place.kind == kind and place.start == first for place in self.source.places)
        left, right = (self._words(*reach) for reach in ((first, start), (end, last)))
        changes = [f"{text} -> {other}", f"{right} dropped"] + ([] if is_chain else [f"{left} dropped"])
        return Place(first, last, kind, start, end, changes)

    def _words(self, start: int, end: int) -> str:
        return " ".join(self.source.text[start:end].decode().split())

    def _unary(self, text: str, start: int, end: int) -> None:
        if text in ("++", "--") and any(first <= start < last for first, last in self.loop_heads):
            return  # a loop that runs the wrong way is no mutant worth its time
        reaches = [last for first, last in self.expressions if first == start and last > end]
        if not reaches:
            raise CannotRead(f"{self.source.file}: no operand of {text} in {self.source.line_text(start)!r}")
        last = min(reaches)
        if text == "!":
            self.source.places.append(Place(start, last, "not", start, end, ["! dropped"]))
            return
        name, change = {
            "-": ("negative", "- dropped"),
            "++": ("increment", "++ -> --"),
            "--": ("decrement", "-- -> ++"),
        }[text]
        self.source.places.append(Place(start, last, "unary", start, end, [change], name=name))

    def _literal(self, text: str, start: int, end: int, places: list[Place]) -> None:
        if text in ("true", "false"):
            other = "false" if text == "true" else "true"
            places.append(Place(start, end, "value", start, end, [f"{text} -> {other}"], others=[other]))
            return
        is_subscript = any(first <= start < last for first, last in self.subscripts) and self.source.text[
            start - 1 : start
        ] in (b"[", b" ")
        others = other_literals(text, is_subscript)
        if others:
            changes = [f"{text} -> {other}" for other in others]
            places.append(Place(start, end, "value", start, end, changes, others=others))

    def _literals_of_constants(self) -> None:
        for constant in self.source.constants:
            for token in self.tokens:
                start, end = token.extent.start.offset, token.extent.end.offset
                if constant.name_start + len(constant.name) <= start < constant.end:
                    if token.kind != TokenKind.PUNCTUATION:
                        self._literal(token.spelling, start, end, constant.places)


def other_literals(text: str, is_subscript: bool) -> list[str]:
    """What a literal may be exchanged for: neighbours of a number, something clearly different for a time."""
    if match := DURATION.fullmatch(text):
        count, unit = int(match[1].replace("'", "")), match[2]
        if count == 0:
            return ["1ms"]
        if count % 2 == 0:
            return [f"{2 * count}{unit}", f"{count // 2}{unit}"]
        if unit not in FINER:
            return [f"{2 * count}{unit}"]
        factor, finer = FINER[unit]
        return [f"{2 * count}{unit}", f"{count * factor // 2}{finer}"]
    if match := INTEGER.fullmatch(text):
        count, suffix = int(match[1].replace("'", ""), 0), match[2]
        if is_subscript:  # within the array, where the neighbour above might be none
            return [f"{count - 1 if count > 0 else 1}{suffix}"]
        if count >= 10_000:
            return [f"{2 * count}{suffix}", f"{count // 2}{suffix}"]
        return [f"{count + 1}{suffix}"] + ([f"{count - 1}{suffix}"] if count > 0 else [])
    return []


def _note_uses(finders: list[_Finder]) -> None:
    """Where a constant is used at run time, in any of the sources: there its twin can stand."""
    constants = {key: constant for finder in finders for key, constant in finder.constants_at.items()}
    for finder in finders:
        for declared, start, end in finder.references:
            place = declared.location
            constant = constants.get((place.file.name, place.offset)) if place.file is not None else None
            if constant is None:
                continue
            for whole in finder.source.constants:
                if whole.name_start + len(whole.name) <= start < whole.end and (start, end, constant) not in whole.parts:
                    whole.parts.append((start, end, constant))
                    constant.wholes.append(whole)
            if finder.is_at_run_time(start, end):
                may_be_constant = any(first <= start < last for first, last in finder.constexpr_functions)
                constant.uses.append(Use(finder.source.file, start, end, may_be_constant))


def find(root: Path, files: list[str]) -> tuple[list[Source], list[Mutant]]:
    """All sources with their places numbered, and all mutants in that order."""
    finders = [_Finder(root, file) for file in files]
    for finder in finders:
        finder.exclude_assertions()
        finder.walk()
        finder.find_places()
    _note_uses(finders)
    mutants: list[Mutant] = []
    for finder in finders:
        source = finder.source
        # A template is seen once for itself; a place must be there once.
        source.places = list({(p.kind, p.start, p.end, p.token_start): p for p in source.places}.values())
        source.places = [p for p in source.places if not finder._is_at_compile_time(p.start)]
        source.constants = [each for each in source.constants if each.can_change() and each.is_used()]
        for constant in source.constants:
            constant.uses = sorted(set(constant.uses))
        all_places = source.places + [place for constant in source.constants for place in constant.places]
        for place in sorted(all_places, key=lambda each: (each.token_start, each.start, each.kind)):
            place.first_id = len(mutants) + 1
            for change in place.changes:
                mutants.append(_mutant(len(mutants) + 1, source, place, change))
    return [finder.source for finder in finders], _numbered_on_their_lines(mutants)


def _mutant(id: int, source: Source, place: Place, change: str) -> Mutant:
    line = source.text.count(b"\n", 0, place.token_start) + 1
    column = place.token_start - source.text.rfind(b"\n", 0, place.token_start)
    return Mutant(id, source.file, line, column, source.line_text(place.token_start), change)


def _numbered_on_their_lines(mutants: list[Mutant]) -> list[Mutant]:
    """The second `< -> <=` of a line is called so, that each can be listed by itself."""
    seen: dict[tuple[str, int, str], int] = {}
    result = []
    for mutant in mutants:
        key = (mutant.file, mutant.line, mutant.change)
        seen[key] = seen.get(key, 0) + 1
        change = mutant.change if seen[key] == 1 else f"{mutant.change} (number {seen[key]})"
        result.append(Mutant(mutant.id, mutant.file, mutant.line, mutant.column, mutant.source, change))
    return result
