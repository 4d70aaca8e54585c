"""ArtilleryViewState: values that the view of artillery draws besides the bodies."""

from dataclasses import dataclass

from sandbox.arrays import FloatArray
from sandbox.scene.description.base import Point

EXPLOSION_DURATION = 0.7
"""s for which an explosion is drawn"""


@dataclass(frozen=True)
class GunView:
    """A tank and its gun."""

    number: int
    """of its body"""
    name: str
    angle: float
    """of the barrel, rad, anticlockwise from the right"""
    power: float
    """share of full speed"""
    health: float | None
    """0 to 1, where it is known"""
    aiming: bool
    """It is its turn, and nothing has been fired yet."""


@dataclass(frozen=True)
class ExplosionView:
    """A blast a moment ago."""

    age: float
    """s"""
    place: Point
    """m"""
    radius: float
    """m"""
    dirt: bool


@dataclass(frozen=True)
class FallingDirt:
    """Dirt of one column that is falling."""

    left: float
    """m"""
    right: float
    """m"""
    bottom: float
    """m, of where it is now"""
    top: float
    """m"""
    floor: float
    """m, that it falls onto"""


@dataclass(frozen=True, eq=False)
class ArtilleryViewState:
    """A moment of a game."""

    guns: tuple[GunView, ...]
    """those that still fight, or did then"""
    size: tuple[float, float]
    """of a tank, m"""
    wind: float | None
    """m/s, to the right, where it is known"""
    ways: tuple[FloatArray, ...] = ()
    """(P, 2) m, where the shells of the last shot have been"""
    flying: tuple[int, ...] = ()
    """numbers of the shells' bodies"""
    bursts: tuple[ExplosionView, ...] = ()
    clods: tuple[FallingDirt, ...] = ()
    tracer: FloatArray | None = None
    """(P, 2) m, where a shot would go"""
    landed: tuple[Point, Point] | None = None
    """where the last shot came down, and where it would have exactly, m"""
