"""Notes on values that are valid but probably not meant.

They are pixels, gravity upwards, degrees, restitution that is multiplied, and events after the end.
"""

import json
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.formatting import format_plural
from sandbox.measure.preflight.diagnostic import Details, Diagnostic
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Compound
from sandbox.scene.description.scene import default_name

FULL_TURN = 6.2832
"""rad, rounded up, so that a rounded 2π is not beyond it"""
FREE_RISE = 9.0
"""m/s², upward gravity that gets a note in scenes without static objects too: that of the Earth with the wrong sign"""
MAX_PAIRS = 3
"""Largest number of pairs that a note names"""
PLASTIC = 0.2
"""Restitution up to which a contact barely rebounds, so that a smaller one makes no difference"""
SMALL_CHANGE = 0.05
"""Difference of a product from the smaller restitution below which there is no note"""


def likely_mistakes(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note for each usual mistake of units and signs that a scene seems to have; at most one of each kind."""
    pixels = list(_pixels(scene))
    yield from pixels or _gravity_upwards(scene)
    yield from _degrees(scene)
    yield from _multiplied_restitution(scene)
    yield from _late_events(scene)


def _late_events(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if events are at the end of a run without a window, or later."""
    end = scene.world.duration
    late = [event for event in scene.events if event.time >= end]
    if late:
        many = f"{format_plural(len(late), 'event')}, the first at {min(event.time for event in late):g} s,"
        message = f"{many} would be after the last step of a run, which ends at {end:g} s (world.duration)"
        yield Diagnostic("late_events", message, {"events": len(late)})


def _pixels(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if bodies are metres wide, and gravity points up or is far stronger than on any planet."""
    bodies, (_, upward) = scene.bodies, scene.world.gravity
    pull, moves = math.hypot(*scene.world.gravity), ~bodies.fixed
    if not moves.any() or pull == 0.0:
        return
    width = 2.0 * float(np.median(bodies.thin[moves]))
    if width >= PIXEL_WIDTH and (pull >= PIXEL_GRAVITY or upward > 0.0):
        points = ", and points up, as y does here" if upward > 0.0 else ""
        message = (
            f"bodies are {width:.3g} m wide, and gravity is {pull:.4g} m/s²{points}: are these pixels? Lengths are in "
            "metres and y points up; for 100 pixels per metre, divide lengths, speeds and gravity by 100"
        )
        yield Diagnostic("pixels", message, {"width": width, "gravity": pull})


PIXEL_WIDTH, PIXEL_GRAVITY = 5.0, 100.0
"""Median width of bodies, m, and gravity, m/s², from which on numbers look like pixels."""


def _gravity_upwards(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if gravity points up; smoke and balloons that rise slowly from nothing solid get none."""
    x, y = scene.world.gravity
    if y > 0.0 and (scene.fixed or y >= FREE_RISE) and not scene.bodies.immovable.all():
        message = (
            f"world.gravity points up, because y does: free bodies rise at {y:g} m/s²; they fall with gravity = "
            f"[{x:g}, {-y:g}]"
        )
        yield Diagnostic("gravity_upwards", message, {"gravity": y})


def _degrees(scene: Scene) -> Iterator[Diagnostic]:
    found = [(path, angle) for path, angle in _angles(scene) if abs(angle) > FULL_TURN]
    if found:
        path, angle = found[0]
        more = f"; {len(found) - 1} more angles are beyond a turn" if len(found) > 1 else ""
        message = (
            f"{path}: angle is in radians, and {angle:g} rad is more than one turn: {angle:g}° is "
            f"{math.radians(angle):.4g}{more}"
        )
        yield Diagnostic("degrees", message, {"angle": angle, "count": len(found)})


def _angles(scene: Scene) -> Iterator[tuple[str, float]]:
    """Yield the paths and angles, rad, of elements with bodies and of their parts."""
    for kind, elements in scene.kinds.items():
        for k, element in enumerate(elements):
            path = f"{kind}.{element.name or default_name(kind, k)}"
            yield path, element.angle
            parts = element.parts if isinstance(element, Compound) else ()
            yield from ((f"a part of {path}", float(getattr(part, "angle", 0.0))) for part in parts)


def _multiplied_restitution(scene: Scene) -> Iterator[Diagnostic]:
    """Yield a note if both sides of a possible contact state a restitution, so that the product applies.

    Games, whose coefficients are tuned together, nearly plastic contacts and small differences get none.
    """
    if scene.play.game is not None:
        return
    matrix = contact_matrix(scene)
    surfaces = matrix.surfaces.surfaces
    e: FloatArray = np.asarray([surface.restitution or 0.0 for surface in surfaces], np.float64)
    smaller = np.minimum.outer(e, e)
    is_changed = (smaller > PLASTIC) & (smaller - np.outer(e, e) >= SMALL_CHANGE) & matrix.touching
    stated = {frozenset(pair.between) for pair in scene.pairs if pair.restitution is not None}
    found = [
        (a, b)
        for a, b in np.argwhere(np.triu(is_changed)).tolist()
        if frozenset((surfaces[a].material, surfaces[b].material)) not in stated
    ]
    if not found:
        return
    sides = [_sides(scene, matrix, a, b) for a, b in found[:MAX_PAIRS]]
    texts = [
        f"{e[a] * e[b]:.4g} between {first.name!r} ({e[a]:g}) and {second.name!r} ({e[b]:g})"
        for (first, second), (a, b) in zip(sides, found, strict=False)
    ]
    if len(found) > MAX_PAIRS:
        texts.append(f"and others in {format_plural(len(found) - MAX_PAIRS, 'more pair')}")
    (first, second), (a, b) = sides[0], found[0]
    message = (
        f"restitutions of both sides are multiplied: {', '.join(texts)}; {_pair_lines(first, second, float(e[a]))}"
    )
    details: Details = {
        "body": first.name,
        "other": second.name,
        "restitution": float(e[a] * e[b]),
        "pairs": len(found),
    }
    yield Diagnostic("multiplied_restitution", message, details)


class _Side(NamedTuple):
    """One side of a contact."""

    name: str
    """of the element in the file, such as a ball or a grid of balls, or of a static object"""
    material: str | None


def _pair_lines(first: _Side, second: _Side, restitution: float) -> str:
    """Return which lines of a scene file state the restitution of a pair."""
    sides = dict.fromkeys((first, second))
    stated = [f"material = {json.dumps(side.name)} to {side.name!r}" for side in sides if side.material is None]
    lines = [
        line for side in sides if side.material is None for line in ("[[material]]", f"name = {json.dumps(side.name)}")
    ]
    between = json.dumps([side.material or side.name for side in (first, second)])
    lines += ["[[pair]]", f"between = {between}", f"restitution = {restitution:g}"]
    added = f"add {', '.join(stated)}, and " if stated else "add "
    return f"to state another value, {added}the lines {', '.join(f'`{line}`' for line in lines)}"


def _sides(scene: Scene, matrix: ContactMatrix, a: int, b: int) -> tuple[_Side, _Side]:
    """Return the first bodies or static objects with two surfaces; the first two if the surfaces are the same."""
    first, second = _objects(scene, matrix, a), _objects(scene, matrix, b)
    return first[0], second[-1] if a == b else second[0]


def _objects(scene: Scene, matrix: ContactMatrix, surface: int) -> list[_Side]:
    """Return the elements of the first bodies, or static objects, with a surface, two at most."""
    bodies, table = scene.bodies, matrix.surfaces
    names = {
        id(element): element.name or default_name(kind, k)
        for kind, elements in scene.kinds.items()
        for k, element in enumerate(elements)
    }
    of_piece = np.arange(len(bodies)) if bodies.round.all() else bodies.shapes.body
    found = np.unique(of_piece[table.of_shape == surface])[:2].tolist()
    fixed = np.flatnonzero(table.of_fixed == surface)[:2].tolist()
    sides = [_Side(names[id(each)], each.material) for each in (bodies.elements[bodies.element[k]] for k in found)]
    return [*sides, *(_Side(scene.fixed_names[k], scene.fixed[k].material) for k in fixed)][:2]
