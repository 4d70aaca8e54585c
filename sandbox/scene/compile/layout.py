"""Start state of the bodies of one element."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.description.base import BodySource, Point
from sandbox.scene.description.bodies import Capsule
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.generators import DEFAULT_MASS, FAR, NEAR, Cloth, Ragdoll, Rope, segments
from sandbox.scene.description.scene import SceneDescription


@dataclass(frozen=True, eq=False)
class Layout:
    """Start state of n bodies."""

    position: FloatArray
    """(n, 2) m, centres of mass"""
    velocity: FloatArray
    """(n, 2) m/s"""
    angle: FloatArray
    """(n,) rad"""
    angular_velocity: FloatArray
    """(n,) rad/s"""
    fixed: BoolArray
    """(n,) never moves"""
    element: IntArray
    """(n,) index of each body's prototype within the element"""
    endings: tuple[str, ...] | None = None
    """suffix of each body's name; None if they are numbered from 1"""
    alone: bool = False
    """whether they do not collide with each other"""
    elements: int = 1
    """number of prototypes of the element"""
    roll: FloatArray | None = None
    """(n, 2) rad/s, angular velocity of spheres on a surface about x and y; None without rolling"""
    lifetime: FloatArray | None = None
    """(n,) s, lifetime of each; None if unlimited"""

    def __len__(self) -> int:
        return len(self.position)


NO_LAYOUT = Layout(
    position=np.empty((0, 2)),
    velocity=np.empty((0, 2)),
    angle=np.empty(0),
    angular_velocity=np.empty(0),
    fixed=np.empty(0, np.bool_),
    element=np.empty(0, np.int64),
    elements=0,
)
"""Start state of no bodies."""


def alike(
    position: FloatArray,
    velocity: FloatArray | Point,
    angle: FloatArray | float,
    spin: FloatArray | float,
    fixed: BoolArray | None = None,
) -> Layout:
    """Return the start state of n bodies of one prototype; fixed ones are at rest."""
    count = len(position)
    still = np.zeros(count, np.bool_) if fixed is None else fixed
    return Layout(
        position=position,
        velocity=np.where(still[:, None], 0.0, np.asarray(velocity, dtype=np.float64)),
        angle=np.broadcast_to(np.asarray(angle, dtype=np.float64), (count,)).copy(),
        angular_velocity=np.where(still, 0.0, np.asarray(spin, dtype=np.float64)),
        fixed=still,
        element=np.zeros(count, np.int64),
    )


def turned(offset: FloatArray, angle: float) -> FloatArray:
    """Return offsets (n, 2) rotated by an angle."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = offset.T
    return np.column_stack((cos * x - sin * y, sin * x + cos * y))


SURFACE = ("material", "restitution", "restitution_falloff", "friction", "colour", "collides", "layer")


def elements_of(source: BodySource) -> tuple[BodySource, ...]:
    """Return the prototypes of an element: itself, a rope's node or plank, a cloth's node, a ragdoll's segments."""
    match source:
        case Rope(kind="planks"):
            plank = Capsule(position=(0.0, 0.0), length=pitch(source), radius=source.radius, **_matter(source))
            return (plank,)
        case Rope() | Cloth():
            return (Ball(position=(0.0, 0.0), radius=source.radius, **_matter(source)),)
        case Ragdoll():
            return _figure(source)
        case _:
            return (source,)


def elements_in(scene: SceneDescription) -> tuple[BodySource, ...]:
    """Return shape and material of the bodies of a scene, in scene order."""
    return tuple(element for source in scene.body_sources for element in elements_of(source))


def pitch(rope: Rope) -> float:
    """Return the rest length of a rope's links, m."""
    return (math.dist(rope.start, rope.end) if rope.length is None else rope.length) / rope.links


def _surface(source: BodySource) -> dict[str, Any]:
    return {key: getattr(source, key) for key in SURFACE}


def _matter(source: BodySource) -> dict[str, Any]:
    return {"mass": source.mass, "density": source.density, **_surface(source)}


@lru_cache(maxsize=256)
def _figure(ragdoll: Ragdoll) -> tuple[BodySource, ...]:
    """Return the segments of a ragdoll: capsules, and a ball as its head."""
    elements: list[BodySource] = []
    parts, height = segments(ragdoll), ragdoll.height
    behind = next(iter(parts)).partition("-")[0]
    whole = DEFAULT_MASS if ragdoll.mass is None else ragdoll.mass
    for name, segment in parts.items():
        more: dict[str, Any] = {
            "position": (0.0, 0.0),
            "radius": segment.radius * height,
            "mass": segment.mass_percent * 0.01 * whole,
        }
        more |= _surface(ragdoll)
        if ragdoll.colour is None:
            more["colour"] = FAR if name.startswith(behind) else NEAR
        if len(segment.ends) == 1:
            elements.append(Ball(**more))
        else:
            elements.append(Capsule(length=math.dist(*segment.ends) * height, **more))
    return tuple(elements)
