"""Steps of a reduction: scene documents with one element fewer, or with simpler values."""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

from sandbox.jsonable import JsonObject
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import GROUND, BodySource
from sandbox.scene.description.discs import Emitter, Grid, Scatter
from sandbox.scene.description.generators import Stack
from sandbox.scene.files.document import to_document

TableKey = tuple[str, int]
"""Table of a document: its heading and its index."""

FIXED_KINDS = ("plane", "wall", "post")
WITHOUT_SHAPE = ("material", "pair", "joint", "attraction", "thrust", "tyre", "drive")
"""Table headings of elements that are neither bodies nor static objects"""
CONNECTIONS = ("joint", "attraction", "thrust", "tyre", "drive", "sensor")
SURFACE_KEYS = (
    "material", "restitution", "restitution_falloff", "friction", "colour", "mass", "density", "collides", "layer",
)  # fmt: skip

MAX_EXPLICIT_BODIES = 20_000
"""Largest number of bodies that are written as single bodies; with more, generators are kept."""


@dataclass(frozen=True)
class ExplicitDocument:
    """Document of a scene, with the bodies of each of its tables."""

    document: JsonObject
    names: dict[TableKey, frozenset[str]]
    """names of the bodies of each table"""

    @property
    def body_tables(self) -> list[TableKey]:
        """Tables that have bodies."""
        return list(self.names)

    def tables_of(self, kinds: Collection[str]) -> list[TableKey]:
        """Return the tables with some headings."""
        return [(kind, k) for kind in kinds for k in range(len(self.document.get(kind, ())))]

    def without(self, gone: Collection[TableKey]) -> "ExplicitDocument":
        """Return the document without some tables, nor references to their bodies by joints, forces and ropes."""
        lost = frozenset[str]().union(*(self.names.get(key, ()) for key in gone))
        document: JsonObject = {}
        names: dict[TableKey, frozenset[str]] = {}
        for kind, tables in self.document.items():
            if not isinstance(tables, list):
                document[kind] = tables
                continue
            kept = [k for k in range(len(tables)) if (kind, k) not in gone]
            if kind in CONNECTIONS:
                kept = [k for k in kept if not lost.intersection(_referenced_bodies(tables[k]))]
            if kept:
                document[kind] = [_without_ties(tables[k], lost) for k in kept]
            names |= {(kind, new): self.names[kind, old] for new, old in enumerate(kept) if (kind, old) in self.names}
        return ExplicitDocument(document, names)

    def with_document(self, document: JsonObject) -> "ExplicitDocument":
        """Return another document with the same tables of bodies."""
        return ExplicitDocument(document, self.names)


def expand_generators(scene: Scene, whole: bool = False) -> ExplicitDocument:
    """Return the document of a scene in which everything has a name, and generators are expanded to single bodies.

    Grids, scatters, stacks and emitters are expanded. Ropes, cloth and ragdolls are not, because only they can express
    their joints, nor are emitters whose particles have a lifetime. With too many bodies no generator is expanded. The
    `[play]` table is left out.

    Args:
        scene: the scene.
        whole: keep every generator.
    """
    source = to_document(scene)
    document: JsonObject = {key: value for key, value in source.items() if key not in {"play", *scene.kinds}}
    for kind, k, name in _fixed_names(scene):
        document[kind][k] = {"name": name, **document[kind][k]}
    bodies_of = _bodies_of_sources(scene)
    bodies = scene.bodies
    names: dict[TableKey, frozenset[str]] = {}
    source_index = 0
    whole = whole or len(bodies) > MAX_EXPLICIT_BODIES
    for kind, movers in scene.kinds.items():
        for k, mover in enumerate(movers):
            members = bodies_of[source_index]
            source_index += 1
            if whole or not _is_single_bodies(mover):
                table = dict(source[kind][k])
                single = len(members) == 1 and bodies.names[members[0]]
                tables = [(kind, {"name": single, **table} if single and hasattr(mover, "fixed") else table)]
                groups = [members]
            else:
                tables = [_body(scene, mover, number) for number in members]
                groups = [[number] for number in members]
            for (heading, table), group in zip(tables, groups, strict=True):
                listed = document.setdefault(heading, [])
                names[heading, len(listed)] = frozenset(bodies.names[number] for number in group)
                listed.append(table)
    return ExplicitDocument(document, names)


def _bodies_of_sources(scene: Scene) -> list[list[int]]:
    """Return the indices of the bodies of each source."""
    found: list[list[int]] = [[] for _ in scene.body_sources]
    mover = [scene.source_index(element) for element in range(len(scene.elements))]
    for number, element in enumerate(scene.bodies.element.tolist()):
        found[mover[element]].append(number)
    return found


def _fixed_names(scene: Scene) -> list[tuple[str, int, str]]:
    tables = [(kind, k) for kind in FIXED_KINDS for k in range(len(getattr(scene, f"{kind}s")))]
    return [(kind, k, name) for (kind, k), name in zip(tables, scene.fixed_names, strict=False)]


def _is_single_bodies(mover: BodySource) -> bool:
    return isinstance(mover, Grid | Scatter | Stack) or (isinstance(mover, Emitter) and mover.lifetime is None)


def _body(scene: Scene, generator: BodySource, number: int) -> tuple[str, JsonObject]:
    """Return the heading and the table of one body of a generator."""
    bodies = scene.bodies
    table: JsonObject = {"name": bodies.names[number]}
    table |= {key: value for key in SURFACE_KEYS if (value := getattr(generator, key)) is not None}
    if table["collides"] == "all":
        del table["collides"]
    if table["layer"] == GROUND:
        del table["layer"]
    table |= {"position": bodies.position[number].tolist(), "velocity": bodies.velocity[number].tolist()}
    table |= {"angle": float(bodies.angle[number]), "angular_velocity": float(bodies.angular_velocity[number])}
    table = {key: value for key, value in table.items() if value not in (0.0, [0.0, 0.0])}
    table.setdefault("position", [0.0, 0.0])
    if isinstance(generator, Stack):
        return "box", {**table, "size": list(generator.size), **({"fixed": True} if generator.fixed else {})}
    assert isinstance(generator, Grid | Scatter | Emitter)
    return "ball", {**table, "radius": generator.radius}


def _referenced_bodies(table: JsonObject) -> list[str]:
    """Return the names of the bodies of a joint or force."""
    single = [table[key] for key in ("body", "toward") if isinstance(table.get(key), str)]
    return [*table.get("between", ()), *single]


def _without_ties(table: JsonObject, lost: frozenset[str]) -> JsonObject:
    """Return the table of a rope without ties to bodies that are left out; other tables unchanged."""
    if not lost or not isinstance(table.get("tie"), dict):
        return table
    tie = {end: name for end, name in table["tie"].items() if name not in lost}
    return {key: tie if key == "tie" else value for key, value in table.items() if tie or key != "tie"}


ValueKey = tuple[str, int, str]
"""Key of a table of a document; the index is −1 for a table that exists once."""

OPTIONAL_KEYS = (
    "angular_velocity", "velocity", "angle", "colour", "colours", "collides", "friction", "restitution", "material",
    "density", "mass", "jitter", "velocity_jitter", "lifetime", "lifetime_jitter", "thickness", "closed",
    "restitution_falloff", "kick", "one_way", "solid", "path",
)  # fmt: skip
"""Keys of bodies and static objects that have a default."""

COUNT_KEYS = ("links", "columns", "rows", "count")
"""Keys of generators that are counts."""

DIGITS = (1, 2, 3, 4, 6)
"""Numbers of digits to which values are rounded, fewest first."""

MIN_SHORTENING = 0.9
"""A shorter duration is tried if it is below this fraction of the present one."""

NOT_ROUNDED = ("title", "about", "name", "solver", "material", "pair", "play")
"""Keys whose values are not rounded."""


def optional_keys(document: JsonObject) -> list[ValueKey]:
    """Return the keys of a document that are optional."""
    keys: list[ValueKey] = [("world", -1, key) for key in document.get("world", {}) if key != "duration"]
    for kind, tables in document.items():
        if isinstance(tables, list) and kind not in WITHOUT_SHAPE:
            keys += [(kind, k, key) for k, table in enumerate(tables) for key in OPTIONAL_KEYS if key in table]
    return keys


def without_keys(document: JsonObject, gone: Collection[ValueKey]) -> JsonObject:
    """Return a document without some keys."""
    changed: JsonObject = {}
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


def unused_materials(document: JsonObject) -> list[TableKey]:
    """Return the tables of unused materials, and of the pairs that need one of them."""
    used = {table["material"] for _, table in _tables(document) if "material" in table}
    materials = enumerate(document.get("material", ()))
    pairs = enumerate(document.get("pair", ()))
    return [
        *(("material", k) for k, each in materials if each["name"] not in used),
        *(("pair", k) for k, each in pairs if not used.issuperset(each["between"])),
    ]


def smaller_counts(table: JsonObject) -> list[tuple[str, list[int]]]:
    """Return the smaller values to be tried for each count of a generator, which are powers of 2."""
    return [
        (key, [2**n for n in range(20) if 2**n < table[key]])
        for key in COUNT_KEYS
        if isinstance(table.get(key), int) and table[key] > 1
    ]


def shorter_durations(document: JsonObject, until: float) -> Iterator[JsonObject]:
    """Yield documents with shorter durations of one or two digits that end soon after a time, s."""
    world = document.get("world", {})
    present = world.get("duration", 10.0)
    for digits in (1, 2):
        for spare in (1.0, 1.05, 1.5):
            end = _round_up(until * spare, digits)
            if 0.0 < end < MIN_SHORTENING * present:
                yield {**document, "world": {**world, "duration": end}}


def rounded_documents(document: JsonObject, only: TableKey | None) -> Iterator[JsonObject]:
    """Yield documents whose values have more and more digits: in all tables, or in one."""
    for digits in DIGITS:
        changed: JsonObject = {}
        for kind, value in document.items():
            if kind in NOT_ROUNDED:
                changed[kind] = value
            elif isinstance(value, list):
                changed[kind] = [
                    _rounded(table, digits) if only in (None, (kind, k)) else table for k, table in enumerate(value)
                ]
            else:
                changed[kind] = value
        yield changed


def _rounded(value: Any, digits: int) -> Any:
    """Return a value with all its floats rounded to a number of digits."""
    if isinstance(value, float):
        return float(f"{value:.{digits}g}")
    if isinstance(value, list):
        return [_rounded(each, digits) for each in value]
    if isinstance(value, dict):
        return {key: each if key == "name" else _rounded(each, digits) for key, each in value.items()}
    return value


def _round_up(value: float, digits: int) -> float:
    """Return the smallest number with some digits that is not below a value."""
    if value <= 0.0:
        return 0.0
    exponent = int(f"{value:e}".partition("e")[2]) - digits + 1
    steps = math.ceil(value / 10.0**exponent * (1.0 - 1e-12))  # rounding can raise a quotient above a whole number
    return float(f"{steps:.0f}e{exponent}")


def _tables(document: JsonObject) -> Iterator[tuple[str, JsonObject]]:
    """Yield the tables of bodies and static objects, and of the parts of bodies."""
    for kind, tables in document.items():
        if not isinstance(tables, list) or kind in WITHOUT_SHAPE:
            continue
        for table in tables:
            yield kind, table
            for part in ("ball", "box", "capsule", "polygon"):
                for each in table.get(part, ()) if kind == "body" else ():
                    yield part, each
