"""Writes sources in which every mutant is there at once and selected at run time; see mutant.hpp."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace

from mutants import Constant, Place, Source


def narrowed(sources: Sequence[Source], ids: Set[int]) -> list[Source]:
    """The sources that hold these mutants, with no other place to ask whether its mutant is the selected one: what is asked in every
    expression takes a program several times its own time. A twin stands for its constant in every source and in other constants:
    if one mutant lies in a constant, all is left as it is."""

    def is_wanted(place: Place) -> bool:
        return any(place.first_id + change in ids for change in range(len(place.changes)))

    if any(is_wanted(place) for source in sources for constant in source.constants for place in constant.places):
        return list(sources)
    result = [replace(source, places=[each for each in source.places if is_wanted(each)], constants=[]) for source in sources]
    return [each for each in result if each.places]


# Text to write at an offset instead of what stands until `end`. At one offset endings come before beginnings, the inner
# ending before the outer and the outer beginning before the inner: `rank` says which is which.
Edit = tuple[int, int, tuple[int, int], str]


def _edits_of(place: Place, value: str = "value") -> list[Edit]:
    ident = place.first_id
    start, end, token_start, token_end = place.start, place.end, place.token_start, place.token_end
    length = end - start

    def around(before: str, after: str) -> list[Edit]:
        return [(start, start, (1, -length), before), (end, end, (0, length), after)]

    def instead(text: str) -> Edit:
        return (token_start, token_end, (2, 0), text)

    on = f"bmu_mutant::on({ident})"
    match place.kind:
        case "binary":
            return around(f"bmu_mutant::{place.name}({ident}, ", ")") + [instead(",")]
        case "unary":
            # The operator itself begins the expression.
            return [instead(f"bmu_mutant::{place.name}({ident}, "), (end, end, (0, length), ")")]
        case "not":
            return [instead(f"({on} == bool("), (end, end, (0, length), "))")]
        case "and" | "or":
            without_right = f"bmu_mutant::on({ident + 1})"
            without_left = f"bmu_mutant::on({ident + 2})" if len(place.changes) > 2 else "false"
            if place.kind == "and":
                middle = f") || {without_left}) != {on} ? (bool("
                return around("((bool(", f") || {without_right}) : {on})") + [instead(middle)]
            middle = f") && !{without_left}) != {on} ? !{on} : (bool("
            return around("((bool(", f") && !{without_right}))") + [instead(middle)]
        case "guard":
            # Around whatever else has the same reach.
            return [(start, start, (1, -length - 1), f"!{on} && bool("), (end, end, (0, length + 1), ")")]
        case "flip":
            return around("(bool(", f") != {on})")
        case "value":
            original = "{original}"
            others = ", ".join(place.others)
            return [(token_start, token_end, (2, 0), f"bmu_mutant::{value}({ident}, {original}, {others})")]
    raise AssertionError(place.kind)


def _apply(text: bytes, edits: list[Edit], start: int = 0, end: int | None = None) -> bytes:
    """`text[start:end]` with the edits that lie in it."""
    end = len(text) if end is None else end
    result = []
    at = start
    for first, last, _, new in sorted(edits, key=lambda edit: (edit[0], edit[2])):
        result.append(text[at:first])
        result.append(new.replace("{original}", text[first:last].decode()).encode())
        at = last
    result.append(text[at:end])
    return b"".join(result)


def twin_name(name: str) -> str:
    return f"{name}_twin"


def _twin_of(source: Source, constant: Constant) -> str:
    """The declaration again, with another name, not constexpr, and with literals that can be exchanged."""
    value = "value" if constant.is_local else "twin_value"
    edits = [edit for place in constant.places for edit in _edits_of(place, value)]
    for start, end, part in constant.parts:
        if part.can_change():
            edits.append((start, end, (2, 0), twin_name(source.text[start:end].decode())))
    name_end = constant.name_start + len(constant.name)
    specifiers = source.text[constant.start : constant.name_start].decode().split()
    type_text = " ".join(word for word in specifiers if word not in ("constexpr", "inline", "static", "const"))
    if type_text == "std::array":  # with arguments deduced; the twin's would be, too
        type_text = "auto"
    initialiser = _apply(source.text, edits, name_end, constant.end).decode()
    if type_text == "auto" and initialiser.startswith("{"):
        initialiser = f" = std::array{initialiser}"
    kept = "[[maybe_unused]] " if constant.is_local else "inline static const " if constant.is_member else "static const "
    return f" {kept}{type_text} {twin_name(constant.name)}{initialiser};"


def instrumented(source: Source, constants: list[Constant]) -> bytes:
    """The source's new text; `constants` are those of all sources."""
    edits = [edit for place in source.places for edit in _edits_of(place)]
    for constant in constants:
        reached = ", ".join(f"bmu_mutant::use({first}, {last})" for first, last in sorted(set(constant.ranges())))
        for use in constant.uses:
            if use.file != source.file:
                continue
            name = source.text[use.start : use.end].decode()
            text = f"({reached}, {twin_name(name)})"
            if use.may_be_constant:
                text = f"(std::is_constant_evaluated() ? {name} : {text})"
            edits.append((use.start, use.end, (2, 0), text))
    for constant in source.constants:
        behind = source.text.index(b";", constant.end) + 1
        edits.append((behind, behind, (3, 0), _twin_of(source, constant)))
    text = _apply(source.text, edits)
    head = b'#include "tests/mutation/mutant.hpp"\n'
    pragma = b"#pragma once\n"
    return text.replace(pragma, pragma + head, 1) if pragma in text else head + text
