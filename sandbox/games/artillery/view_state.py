"""View state of artillery: values that the view draws in addition to the bodies."""

from dataclasses import dataclass

from sandbox.arrays import FloatArray
from sandbox.scene.description.base import Point

EXPLOSION_DURATION = 0.7
"""s for which an explosion is drawn"""


@dataclass(frozen=True)
class GunView:
    """A tank and its gun."""

    number: int
    """index of its body"""
    name: str
    angle: float
    """rad, of the barrel, anticlockwise from the right"""
    power: float
    """fraction of full speed"""
    health: float | None
    """0 to 1; None if unknown"""
    aiming: bool
    """whether it is the tank's turn, and it has not fired yet"""


@dataclass(frozen=True)
class ExplosionView:
    """An explosion."""

    age: float
    """s since its start"""
    position: Point
    """m, centre"""
    radius: float
    """m"""
    dirt: bool
    """whether it added dirt"""


@dataclass(frozen=True)
class FallingDirt:
    """Falling dirt of one column."""

    left: float
    """m"""
    right: float
    """m"""
    bottom: float
    """m, present height of its lower end"""
    top: float
    """m, present height of its upper end"""
    floor: float
    """m, height of the surface below it"""


@dataclass(frozen=True, eq=False)
class ArtilleryViewState:
    """State of a game at one time."""

    guns: tuple[GunView, ...]
    """guns of the tanks that are alive; of all tanks for a state of the past"""
    size: tuple[float, float]
    """m, width and height of a tank"""
    wind: float | None
    """m/s, positive to the right; None if unknown"""
    paths: tuple[FloatArray, ...] = ()
    """(P, 2) m, paths of the shells of the last shot"""
    flying: tuple[int, ...] = ()
    """indices of the bodies of shells in flight and rollers"""
    bursts: tuple[ExplosionView, ...] = ()
    clods: tuple[FallingDirt, ...] = ()
    tracer: FloatArray | None = None
    """(P, 2) m, predicted path of a shot"""
    landed: tuple[Point, Point] | None = None
    """m, impact of the last shot, and impact of its exact trajectory"""
