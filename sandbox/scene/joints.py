"""Joints: what holds bodies together, or to the world, as a scene file says it.

`between` names one body or two. One alone is joined to the world. Angles are those of the second body as seen from
the first; of one alone, as seen from the world.
"""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Name, Part, Point

Force = Annotated[float, Field(gt=0, le=1e42)]
Distance = Annotated[float, Field(ge=0, le=1e9)]
Turned = Annotated[float, Field(ge=-1e12, le=1e12)]
Stiffness = Annotated[float, Field(gt=0, le=1e30)]
Damping = Annotated[float, Field(ge=0, le=1e30)]


class Joined(Part):
    """What all joints have."""

    name: Name | None = None
    """without one it is called by its kind and its place in the file, such as `joint-1`"""
    between: Annotated[tuple[Name, ...], Field(min_length=1, max_length=2)]
    """one body, held by the world, or two"""
    collide: bool = False
    """Let the two meet, other than by the joint."""
    strength: Force | None = None
    """N, or N·m of what holds an angle: the joint breaks once it has given more; without, it never does"""


class Anchored(Joined):
    """A joint that holds each body in one point."""

    anchors: tuple[Point, Point] = ((0.0, 0.0), (0.0, 0.0))
    """the two points that it holds, m, in the order of `between`: each in the frame of its body, from the body's
    position. With one body the first is the body's, and the second is a place in the world"""


class Rod(Anchored):
    """Keeps two points at a distance, as a rod without mass. A pin is the same (pymunk's word for it)."""

    kind: Literal["rod", "pin"]
    length: Distance | None = None
    """m; without, as the two points start"""


class Pivot(Joined):
    """Holds two bodies together in one point, about which they turn."""

    kind: Literal["pivot"]
    at: Point | None = None
    """where, in the world as it starts"""
    anchors: tuple[Point, Point] | None = None
    """or where in each body's own frame, from its position, m, in the order of `between`; with one body the first is
    the body's, and the second is a place in the world"""


class Slide(Anchored):
    """Keeps the distance of two points between two bounds: a string, if the lower is 0."""

    kind: Literal["slide"]
    least: Distance = 0.0
    """the smallest distance, m"""
    most: Distance
    """m"""


class Groove(Joined):
    """Lets a point of the second body slide along a groove in the first; the world's groove, of one body alone."""

    kind: Literal["groove"]
    groove: tuple[Point, Point]
    """its two ends in the first body's own frame, m"""
    anchor: Point = (0.0, 0.0)
    """of the other body, in its own frame"""


class RotaryLimit(Joined):
    """Keeps the angle between two bodies within bounds."""

    kind: Literal["rotary_limit"]
    least: Turned
    """the smallest angle, rad"""
    most: Turned
    """rad"""


class Motor(Joined):
    """Turns the second body, as seen from the first, at a rate."""

    kind: Literal["motor"]
    rate: Turned
    """rad/s"""
    max_torque: Force | None = None
    """N·m; without, as much as it takes"""


class Gear(Joined):
    """Keeps angle₂·ratio − angle₁ = phase: the first turns `ratio` times as fast as the second."""

    kind: Literal["gear"]
    ratio: Annotated[float, Field(ge=-1e6, le=1e6)]
    """angle₁ / angle₂"""
    phase: Turned | None = None
    """rad; without, as the two start"""


class Spring(Anchored):
    """A damped spring between two points: F = −k (l − l₀) − c l̇ along their line."""

    kind: Literal["spring"]
    rest_length: Distance | None = None
    """m; without, as the two points start"""
    stiffness: Stiffness
    """k, N/m"""
    damping: Damping = 0.0
    """c, N·s/m"""


class RotarySpring(Joined):
    """A damped spring of the angle between two bodies: τ = −k (φ − φ₀) − c φ̇."""

    kind: Literal["rotary_spring"]
    rest_angle: Turned | None = None
    """rad; without, as the two start"""
    stiffness: Stiffness
    """k, N·m/rad"""
    damping: Damping = 0.0
    """c, N·m·s/rad"""


Joint = Annotated[
    Rod | Pivot | Slide | Groove | RotaryLimit | Motor | Gear | Spring | RotarySpring, Field(discriminator="kind")
]
