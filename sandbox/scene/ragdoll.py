"""Ragdoll: a jointed figure seen from the side, as a scene file says it, and what its body consists of.

Lengths are shares of its height after Drillis and Contini (1966), as in Winter, Biomechanics and Motor Control of
Human Movement, figure 4.1: heights of ankle .039, knee .285, hip .530, shoulder .818, chin .870; upper arm .186,
forearm .146, hand .108, foot .152 long. Thicknesses, the middle of the back, where the ankle stands on the foot, and
the bounds of the wrist are our own choice. Angles of joints are positive where they bend forward, but for knees,
which bend back, and ankles, which point the toes down.
"""

from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from sandbox.scene.part import Point, Velocity
from sandbox.scene.surfaced import Mover

DEFAULT_MASS = 75.0
"""kg"""


class Ragdoll(Mover):
    """A figure that stands upright in mid-stride; `angle` and `angular_velocity` turn all of it about its position."""

    position: Point
    """the ground under it, m"""
    height: Annotated[float, Field(ge=1e-3, le=1e6)] = 1.75
    """m"""
    mass: Annotated[float, Field(ge=1e-9, le=1e30)] | None = None
    """of all of it, kg; without, 75"""
    facing: Literal["right", "left"] = "right"
    """which way its front is"""
    velocity: Velocity = (0.0, 0.0)
    """m/s"""


class Segment(NamedTuple):
    """A part of the body as it stands straight and faces right, its soles at the origin.

    All lengths are shares of its height.
    """

    share: float
    """of the mass, %"""
    ends: tuple[Point, ...]
    """the centres of its capsule's half discs; of the head the one of its ball"""
    radius: float
    parent: str = ""
    """what a joint joins it to"""
    joint: Point = (0.0, 0.0)
    """where"""
    bounds: tuple[float, float] = (0.0, 0.0)
    """least and most of its angle to its parent, degrees, positive anticlockwise"""


TRUNK = {
    "pelvis": Segment(21.75, ((0.0, 0.674), (0.0, 0.530)), 0.065),
    "chest": Segment(21.75, ((0.0, 0.818), (0.0, 0.674)), 0.065, "pelvis", (0.0, 0.674), (-35.0, 35.0)),
    "head": Segment(6.9, ((0.0, 0.935),), 0.065, "chest", (0.0, 0.870), (-50.0, 50.0)),
}
LIMBS = {
    "upper-arm": Segment(2.7, ((0.0, 0.818), (0.0, 0.632)), 0.027, "chest", (0.0, 0.818), (-60.0, 180.0)),
    "forearm": Segment(1.6, ((0.0, 0.632), (0.0, 0.486)), 0.022, "upper-arm", (0.0, 0.632), (0.0, 145.0)),
    "hand": Segment(0.6, ((0.0, 0.486), (0.0, 0.398)), 0.020, "forearm", (0.0, 0.486), (-70.0, 70.0)),
    "thigh": Segment(14.2, ((0.0, 0.530), (0.0, 0.285)), 0.045, "pelvis", (0.0, 0.530), (-20.0, 120.0)),
    "shank": Segment(4.3, ((0.0, 0.285), (0.0, 0.039)), 0.030, "thigh", (0.0, 0.285), (-135.0, 0.0)),
    "foot": Segment(1.4, ((-0.0185, 0.0195), (0.0945, 0.0195)), 0.0195, "shank", (0.0, 0.039), (-50.0, 20.0)),
}
"""those of one side"""

STRIDE = {
    "right": {"upper-arm": -12.0, "forearm": 15.0, "thigh": 10.0, "shank": -10.0, "foot": 0.0},
    "left": {"upper-arm": 12.0, "forearm": 10.0, "thigh": -5.0, "shank": -5.0, "foot": 10.0},
}
"""the angles of joints at the start, degrees; the others are straight"""

NEAR, FAR = "#e69f00", "#56b4e9"
"""Colours of one that states none: the limbs behind its trunk are told from those before it."""


def segments(ragdoll: Ragdoll) -> dict[str, Segment]:
    """Return the segments by name, in the order of the bodies: what is behind the trunk comes first."""
    near, far = ("right", "left") if ragdoll.facing == "right" else ("left", "right")
    return {**_limbs(far), **TRUNK, **_limbs(near)}


def _limbs(side: str) -> dict[str, Segment]:
    return {
        f"{side}-{name}": limb._replace(parent=limb.parent if limb.parent in TRUNK else f"{side}-{limb.parent}")
        for name, limb in LIMBS.items()
    }
