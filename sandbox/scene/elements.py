"""Elements: what the bodies of a scene's movers look like and are made of, which for some is no table of the file."""

import math
from functools import lru_cache
from typing import Any

from sandbox.scene.discs import Ball
from sandbox.scene.model import Scene
from sandbox.scene.ragdoll import DEFAULT_MASS, FAR, NEAR, Ragdoll, segments
from sandbox.scene.solids import Capsule
from sandbox.scene.surfaced import Mover
from sandbox.scene.weaves import Cloth, Rope

SURFACE = ("material", "restitution", "restitution_falloff", "friction", "colour", "collides", "layer")


def elements_of(mover: Mover) -> tuple[Mover, ...]:
    """Return what a mover's bodies are: itself, or a rope's node or plank, a cloth's node, a ragdoll's segments."""
    match mover:
        case Rope(kind="planks"):
            plank = Capsule(position=(0.0, 0.0), length=pitch(mover), radius=mover.radius, **_matter(mover))
            return (plank,)
        case Rope() | Cloth():
            return (Ball(position=(0.0, 0.0), radius=mover.radius, **_matter(mover)),)
        case Ragdoll():
            return _figure(mover)
        case _:
            return (mover,)


def mover_of(scene: Scene, element: int) -> int:
    """Return the place among a scene's movers of the one that an element is of; of what was added since, beyond all."""
    if len(scene.elements) == len(scene.movers):
        return element
    for place, mover in enumerate(scene.movers):
        element -= len(elements_of(mover))
        if element < 0:
            return place
    return len(scene.movers) + element


def pitch(rope: Rope) -> float:
    """Return the length of each link of a rope at rest, m."""
    return (math.dist(rope.start, rope.end) if rope.length is None else rope.length) / rope.links


def _surface(mover: Mover) -> dict[str, Any]:
    return {key: getattr(mover, key) for key in SURFACE}


def _matter(mover: Mover) -> dict[str, Any]:
    return {"mass": mover.mass, "density": mover.density, **_surface(mover)}


@lru_cache(maxsize=256)
def _figure(ragdoll: Ragdoll) -> tuple[Mover, ...]:
    """Return the segments of a ragdoll as capsules and, its head, a ball."""
    made: list[Mover] = []
    parts, height = segments(ragdoll), ragdoll.height
    behind = next(iter(parts)).partition("-")[0]
    whole = DEFAULT_MASS if ragdoll.mass is None else ragdoll.mass
    for name, segment in parts.items():
        more: dict[str, Any] = {
            "position": (0.0, 0.0),
            "radius": segment.radius * height,
            "mass": segment.share * 0.01 * whole,
        }
        more |= _surface(ragdoll)
        if ragdoll.colour is None:
            more["colour"] = FAR if name.startswith(behind) else NEAR
        if len(segment.ends) == 1:
            made.append(Ball(**more))
        else:
            made.append(Capsule(length=math.dist(*segment.ends) * height, **more))
    return tuple(made)
