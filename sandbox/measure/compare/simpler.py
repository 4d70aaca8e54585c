"""Simpler: documents that say a little less than another, most daring first."""

import math
from collections.abc import Collection, Iterator
from typing import Any

from sandbox.measure.compare.spelled import Document, Place

Key = tuple[str, int, str]
"""A key of a table of a document; of a table that there is once, the number is −1."""

DISPENSABLE = (
    "angular_velocity", "velocity", "angle", "colour", "colours", "collides", "friction", "restitution", "material",
    "density", "mass", "jitter", "velocity_jitter", "lifetime", "lifetime_jitter", "thickness", "closed",
    "restitution_falloff", "kick", "one_way", "solid",
)  # fmt: skip
"""Keys of bodies and fixed things that have a default."""

COUNTS = ("links", "columns", "rows", "count")
"""Keys that say how many parts a generator has."""

DIGITS = (1, 2, 3, 4, 6)
"""Digits that figures are rounded to, fewest first."""

WORTH = 0.9
"""The share of a duration that another is less than to be worth a try."""

ROUGH = ("title", "about", "name", "solver", "material", "pair", "play")
"""What is not rounded."""


def optional(document: Document) -> list[Key]:
    """Return the keys that a document can do without, and still be a scene."""
    keys: list[Key] = [("world", -1, key) for key in document.get("world", {}) if key != "duration"]
    for kind, tables in document.items():
        if isinstance(tables, list) and kind not in ("material", "pair", "joint", "attraction", "thrust", "drive"):
            keys += [(kind, k, key) for k, table in enumerate(tables) for key in DISPENSABLE if key in table]
    return keys


def without_keys(document: Document, gone: Collection[Key]) -> Document:
    """Return a document without some keys."""
    changed: Document = {}
    for kind, value in document.items():
        if isinstance(value, list):
            changed[kind] = [
                {key: each for key, each in table.items() if (kind, k, key) not in gone}
                for k, table in enumerate(value)
            ]
        elif isinstance(value, dict):
            changed[kind] = {key: each for key, each in value.items() if (kind, -1, key) not in gone}
        else:
            changed[kind] = value
    return {key: value for key, value in changed.items() if value not in ({}, [])}


def unused(document: Document) -> list[Place]:
    """Return the materials that nothing is made of, and the pairs that need one of them."""
    used = {table["material"] for _, table in _tables(document) if "material" in table}
    materials = enumerate(document.get("material", ()))
    pairs = enumerate(document.get("pair", ()))
    return [
        *(("material", k) for k, each in materials if each["name"] not in used),
        *(("pair", k) for k, each in pairs if not used.issuperset(each["between"])),
    ]


def fewer(table: Document) -> list[tuple[str, list[int]]]:
    """Return for each count of a generator the smaller ones to try, which are powers of 2."""
    return [
        (key, [2**n for n in range(20) if 2**n < table[key]])
        for key in COUNTS
        if isinstance(table.get(key), int) and table[key] > 1
    ]


def shorter(document: Document, parting: float) -> Iterator[Document]:
    """Yield documents that end soon after a time, s: at a figure of one or two digits, where that is worth it."""
    world = document.get("world", {})
    now = world.get("duration", 10.0)
    for digits in (1, 2):
        for spare in (1.0, 1.05, 1.5):
            end = _up(parting * spare, digits)
            if 0.0 < end < WORTH * now:
                yield {**document, "world": {**world, "duration": end}}


def rounded(document: Document, place: Place | None) -> Iterator[Document]:
    """Yield documents whose figures have ever more digits: of all tables, or of one."""
    for digits in DIGITS:
        changed: Document = {}
        for kind, value in document.items():
            if kind in ROUGH:
                changed[kind] = value
            elif isinstance(value, list):
                changed[kind] = [
                    _rounded(table, digits) if place in (None, (kind, k)) else table for k, table in enumerate(value)
                ]
            else:
                changed[kind] = value
        yield changed


def _rounded(value: Any, digits: int) -> Any:
    """Return a value with all the floats in it rounded to so many digits."""
    if isinstance(value, float):
        return float(f"{value:.{digits}g}")
    if isinstance(value, list):
        return [_rounded(each, digits) for each in value]
    if isinstance(value, dict):
        return {key: each if key == "name" else _rounded(each, digits) for key, each in value.items()}
    return value


def _up(value: float, digits: int) -> float:
    """Return the least figure of so many digits that is not below a value."""
    if value <= 0.0:
        return 0.0
    exponent = int(f"{value:e}".partition("e")[2]) - digits + 1
    steps = math.ceil(value / 10.0**exponent * (1.0 - 1e-12))  # a quotient may be rounded up past a whole number
    return float(f"{steps:.0f}e{exponent}")


def _tables(document: Document) -> Iterator[tuple[str, Document]]:
    """Yield the tables of what can be touched, and the parts of bodies."""
    for kind, tables in document.items():
        if not isinstance(tables, list) or kind in ("material", "pair", "joint", "attraction", "thrust", "drive"):
            continue
        for table in tables:
            yield kind, table
            for part in ("ball", "box", "capsule", "polygon"):
                for each in table.get(part, ()) if kind == "body" else ():
                    yield part, each
