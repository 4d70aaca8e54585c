"""World: the surroundings of a scene, `[world]`."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.part import Acceleration, Part, Point, Velocity

Drag = Annotated[float, Field(ge=0, le=1e9)]


class World(Part):
    """The surroundings: gravity, air, time, and the box outside which bodies are retired."""

    gravity: tuple[Acceleration, Acceleration] = (0.0, 0.0)
    """m/s²"""
    duration: Annotated[float, Field(gt=0, le=1e9)] = 10.0
    """s, of a headless run"""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """All randomness of a scene comes from it."""
    linear_drag: Drag = 0.0
    """k, 1/s: a = −k (v − wind)"""
    quadratic_drag: Drag = 0.0
    """c, 1/m: a = −c |v − wind| (v − wind)"""
    wind: Velocity = (0.0, 0.0)
    """m/s"""
    bounds: tuple[Point, Point] | None = None
    """Lower-left and upper-right corner, m. A body whose centre leaves the box is retired."""
