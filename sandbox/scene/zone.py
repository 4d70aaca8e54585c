"""Zone: a place that notes whose centre comes in, `[[zone]]`, and what it does to it; and the layers of a scene.

A visit begins when the centre of a body is inside while the body is on one of the zone's layers, and ends when the
centre is outside; whatever happens to its layer meanwhile, one visit is one note. What collides with nothing
(`collides = "none"`) is not noted, nor is what a drive leads.
"""

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from sandbox.scene.part import Acceleration, Colour, Name, Part, Point, Radius
from sandbox.scene.surfaced import GROUND

if TYPE_CHECKING:
    from sandbox.scene.model import Scene
    from sandbox.scene.near import BoolArray, IntArray

Layers = Annotated[tuple[Name, ...], Field(min_length=1, max_length=10)]
"""On which layers something is; things meet where they share one."""

MAX_LAYERS = 10
"""of one scene: three kinds of bodies on each are told apart by the 32 bits of a filter, and two are for zones"""

MAX_ZONES = 1000
"""of one scene: what each body visits is part of the state"""

AWAY, INSIDE, HELD, LET_GO = range(4)
"""How a body is with a zone: not in it, in it, standing at its centre, or let go from there and still in it."""

Width = Annotated[float, Field(gt=0, le=1e9)]


class Zone(Part):
    """A place that is not solid: a circle (`position`, `radius`), a polygon (`points`), a strip (and `thickness`)."""

    name: Name | None = None
    """one without a name is called by its kind and its place in the file"""
    layers: Layers = (GROUND,)
    """on which it is"""
    position: Point | None = None
    """of a circle's centre, m"""
    radius: Radius | None = None
    """of a circle, m"""
    points: Annotated[tuple[Point, ...], Field(min_length=2, max_length=1000)] | None = None
    """corners of a polygon, or the middle line of a strip, m"""
    thickness: Width | None = None
    """full thickness of a strip, m"""
    to_layer: Name | None = None
    """to which it takes whom it notes, such as the mouth of a ramp"""
    holds: bool = False
    """Who comes in stands still at its centre, one at a time, until an action moves or drives it: a kicker's hole."""
    gravity: tuple[Acceleration, Acceleration] | None = None
    """m/s², instead of the world's, of whom is inside and on one of its layers; where several are, of the last"""
    colour: Colour | None = None
    """in the window, `#rrggbb`"""


def notes(pair: "IntArray", scene: "Scene") -> "BoolArray":
    """Tell which contacts, by their pairs (C, 2), are notes of a scene's zones and no collisions, (C,)."""
    found: BoolArray = pair[:, 1] < -len(scene.fixed) - len(scene.pockets)
    return found


def layers_of(scene: "Scene") -> tuple[str, ...]:
    """Return the layers that a scene speaks of, in the order of their numbers: the ground first."""
    named: dict[str, None] = {GROUND: None}
    for thing in scene.fixed:
        named |= dict.fromkeys(thing.layers or ())
    for zone in scene.zones:
        named |= dict.fromkeys(zone.layers)
        if zone.to_layer is not None:
            named[zone.to_layer] = None
    for mover in scene.movers:
        named[mover.layer] = None
    return tuple(named)


def mask_of(layers: Layers | None, known: tuple[str, ...]) -> int:
    """Return layers as the bits of their numbers; None is all."""
    if layers is None:
        return (1 << len(known)) - 1
    return sum(1 << known.index(name) for name in {*layers})
