"""Spelled: a scene as a document in which every body is a table of its own, so that each can be left out."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from sandbox.scene.description.base import GROUND, BodySource
from sandbox.scene.description.discs import Emitter, Grid, Scatter
from sandbox.scene.description.generators import Stack
from sandbox.scene.files.document import to_document
from sandbox.scene.scene import Scene

Document = dict[str, Any]
Place = tuple[str, int]
"""A table of a document: its kind, and which of them."""

FIXED = ("plane", "wall", "post")
BONDS = ("joint", "attraction", "thrust", "drive")
SURFACE = (
    "material", "restitution", "restitution_falloff", "friction", "colour", "mass", "density", "collides", "layer",
)  # fmt: skip

MOST_SPELLED = 20_000
"""Bodies that are written out one by one; of more, generators stay whole."""


@dataclass(frozen=True)
class Spelled:
    """A document, and which names belong to which of its tables."""

    document: Document
    names: dict[Place, frozenset[str]]
    """those of the bodies of each table"""

    @property
    def movers(self) -> list[Place]:
        """The tables that have bodies."""
        return list(self.names)

    def places(self, kinds: Collection[str]) -> list[Place]:
        """Return the tables of some kinds."""
        return [(kind, k) for kind in kinds for k in range(len(self.document.get(kind, ())))]

    def without(self, gone: Collection[Place]) -> "Spelled":
        """Return it without some tables, nor what speaks of their bodies: joints, forces, knots of ropes."""
        lost = frozenset[str]().union(*(self.names.get(place, ()) for place in gone))
        document: Document = {}
        names: dict[Place, frozenset[str]] = {}
        for kind, tables in self.document.items():
            if not isinstance(tables, list):
                document[kind] = tables
                continue
            kept = [k for k in range(len(tables)) if (kind, k) not in gone]
            if kind in BONDS:
                kept = [k for k in kept if not lost.intersection(_spoken_of(tables[k]))]
            if kept:
                document[kind] = [_untied(tables[k], lost) for k in kept]
            names |= {(kind, new): self.names[kind, old] for new, old in enumerate(kept) if (kind, old) in self.names}
        return Spelled(document, names)

    def with_document(self, document: Document) -> "Spelled":
        """Return another document with the same tables of bodies."""
        return Spelled(document, self.names)


def spelled(scene: Scene, whole: bool = False) -> Spelled:
    """Write a scene out: everything has a name, and grids, scatters, stacks and emitters are single bodies.

    What stays whole: ropes, cloth and ragdolls, for what holds them together is nobody's but theirs; emitters whose
    particles die, which single bodies do not; and, where there are too many bodies, all generators. The window's part
    of a scene is left out.

    Args:
        scene: what to write out.
        whole: leave every generator as it is.
    """
    source = to_document(scene)
    document: Document = {key: value for key, value in source.items() if key not in {"play", *scene.kinds}}
    for kind, k, name in _fixed_names(scene):
        document[kind][k] = {"name": name, **document[kind][k]}
    numbers = _numbers(scene)
    bodies = scene.bodies
    names: dict[Place, frozenset[str]] = {}
    place = 0
    whole = whole or len(bodies) > MOST_SPELLED
    for kind, movers in scene.kinds.items():
        for k, mover in enumerate(movers):
            own = numbers[place]
            place += 1
            if whole or not _is_single_bodies(mover):
                table = dict(source[kind][k])
                single = len(own) == 1 and bodies.names[own[0]]
                tables = [(kind, {"name": single, **table} if single and hasattr(mover, "fixed") else table)]
                groups = [own]
            else:
                tables = [_body(scene, mover, number) for number in own]
                groups = [[number] for number in own]
            for (heading, table), group in zip(tables, groups, strict=True):
                listed = document.setdefault(heading, [])
                names[heading, len(listed)] = frozenset(bodies.names[number] for number in group)
                listed.append(table)
    return Spelled(document, names)


def _numbers(scene: Scene) -> list[list[int]]:
    """Return the numbers of the bodies of each mover."""
    numbers: list[list[int]] = [[] for _ in scene.body_sources]
    mover = [scene.source_index(element) for element in range(len(scene.elements))]
    for number, element in enumerate(scene.bodies.element.tolist()):
        numbers[mover[element]].append(number)
    return numbers


def _fixed_names(scene: Scene) -> list[tuple[str, int, str]]:
    places = [(kind, k) for kind in FIXED for k in range(len(getattr(scene, f"{kind}s")))]
    return [(kind, k, name) for (kind, k), name in zip(places, scene.fixed_names, strict=False)]


def _is_single_bodies(mover: BodySource) -> bool:
    return isinstance(mover, Grid | Scatter | Stack) or (isinstance(mover, Emitter) and mover.lifetime is None)


def _body(scene: Scene, generator: BodySource, number: int) -> tuple[str, Document]:
    """Return the heading and the table of one body of a generator."""
    bodies = scene.bodies
    table: Document = {"name": bodies.names[number]}
    table |= {key: value for key in SURFACE if (value := getattr(generator, key)) is not None}
    if table["collides"] == "all":
        del table["collides"]
    if table["layer"] == GROUND:
        del table["layer"]
    table |= {"position": bodies.position[number].tolist(), "velocity": bodies.velocity[number].tolist()}
    table |= {"angle": float(bodies.angle[number]), "angular_velocity": float(bodies.angular_velocity[number])}
    table = {key: value for key, value in table.items() if value not in (0.0, [0.0, 0.0])}
    table.setdefault("position", [0.0, 0.0])
    if isinstance(generator, Stack):
        return "box", {**table, "size": list(generator.size)}
    assert isinstance(generator, Grid | Scatter | Emitter)
    return "ball", {**table, "radius": generator.radius}


def _spoken_of(bond: Document) -> list[str]:
    """Return whom a joint or a force speaks of."""
    one = [bond[key] for key in ("body", "toward") if isinstance(bond.get(key), str)]
    return [*bond.get("between", ()), *one]


def _untied(table: Document, lost: frozenset[str]) -> Document:
    """Return a rope's table without knots to who is gone; other tables as they are."""
    if not lost or not isinstance(table.get("tie"), dict):
        return table
    tie = {end: name for end, name in table["tie"].items() if name not in lost}
    return {key: tie if key == "tie" else value for key, value in table.items() if tie or key != "tie"}
