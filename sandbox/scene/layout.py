"""Layout: where the bodies of one mover start, as arrays; n of them."""

from dataclasses import dataclass

import numpy as np

from sandbox.scene.near import BoolArray, FloatArray, IntArray
from sandbox.scene.part import Point


@dataclass(frozen=True, eq=False)
class Layout:
    """The starting state of n bodies."""

    position: FloatArray
    """(n, 2) m, of the centres of mass"""
    velocity: FloatArray
    """(n, 2) m/s"""
    angle: FloatArray
    """(n,) rad"""
    angular_velocity: FloatArray
    """(n,) rad/s"""
    fixed: BoolArray
    """(n,) never moves"""
    element: IntArray
    """(n,) which element of the mover each is"""
    endings: tuple[str, ...] | None = None
    """what each adds to the mover's name; none where they are counted from 1"""
    alone: bool = False
    """They pass through each other."""
    elements: int = 1
    """how many elements the mover has"""
    roll: FloatArray | None = None
    """(n, 2) rad/s, of spheres on a floor, about x and y; none where nothing rolls"""
    lifetime: FloatArray | None = None
    """(n,) s, how long each is there; none where all are for ever"""

    def __len__(self) -> int:
        return len(self.position)


NOBODY = Layout(
    position=np.empty((0, 2)),
    velocity=np.empty((0, 2)),
    angle=np.empty(0),
    angular_velocity=np.empty(0),
    fixed=np.empty(0, np.bool_),
    element=np.empty(0, np.int64),
    elements=0,
)
"""No bodies at all."""


def alike(
    position: FloatArray,
    velocity: FloatArray | Point,
    angle: FloatArray | float,
    spin: FloatArray | float,
    fixed: BoolArray | None = None,
) -> Layout:
    """Return the layout of n bodies of one element, those that are fixed at rest."""
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
    """Return offsets (n, 2) turned by an angle."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = offset.T
    return np.column_stack((cos * x - sin * y, sin * x + cos * y))
