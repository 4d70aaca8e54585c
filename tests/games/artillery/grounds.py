"""Terrains and worlds for the tests of artillery."""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.games.artillery.scene import Terrain, heights_of, levelled, settled
from sandbox.games.artillery.terrain import Ground
from sandbox.scene.description.world import World

G = 9.81


def world(linear: float = 0.0, quadratic: float = 0.0, wind: float = 0.0) -> World:
    return World(gravity=(0.0, -G), linear_drag=linear, quadratic_drag=quadratic, wind=(wind, 0.0))


def shot(speed: float, degrees: float) -> FloatArray:
    angle = math.radians(degrees)
    return speed * np.array([math.cos(angle), math.sin(angle)])


def flat(height: float, width: float = 400.0, columns: int = 400) -> Ground:
    return Ground(np.full(columns, settled(height)), width)


def hills(seed: int, roughness: float, pads: Sequence[float] = (), width: float = 300.0) -> Ground:
    """Return ground as a scene builds it, levelled around the positions `pads`, m."""
    heights = heights_of(Terrain(width=width, columns=300, roughness=roughness), seed)
    for at in pads:
        heights = levelled(heights, width, at, 2.5)
    return Ground(np.array(heights), width)
