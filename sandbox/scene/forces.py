"""Forces: what acts on bodies from afar or from within, as a scene file says it."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Name, Part, Point

Newton = Annotated[float, Field(ge=-1e30, le=1e30)]
Second = Annotated[float, Field(ge=0, le=1e9)]

ThrustKey = Literal["up", "down", "left", "right"]
"""an arrow key of the window"""


class Attraction(Part):
    """Draws every moving body towards a place or a body: a = strength / (r² + softening²), as the sun does."""

    name: Name | None = None
    """without one it is called by its kind and its place in the file, such as `joint-1`"""
    toward: Point | Name
    """a place, m, or a body's name; a body that moves is drawn back as strongly"""
    strength: Annotated[float, Field(ge=-1e30, le=1e30)]
    """G·M, m³/s²; negative drives away"""
    softening: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """m"""


class Thrust(Part):
    """A force that a body carries along, such as a spaceship's engine: it turns with the body."""

    name: Name | None = None
    """without one it is called by its kind and its place in the file, such as `joint-1`"""
    body: Name
    """name of the body that carries it"""
    force: tuple[Newton, Newton]
    """N, in the body's own frame"""
    point: Point = (0.0, 0.0)
    """where it acts, in the body's own frame, from its position, m"""
    begin: Second = 0.0
    """s"""
    end: Second | None = None
    """s; without, it never ends"""
    key: ThrustKey | None = None
    """It acts only while this key is held, or a `throttle` action has opened it."""
