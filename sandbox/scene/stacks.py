"""Stacks: boxes in rows on top of each other, such as walls, towers and pyramids."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.discs import Count
from sandbox.scene.part import MAX_BODIES, Point, Velocity
from sandbox.scene.solids import Length
from sandbox.scene.surfaced import Mover

Gap = Annotated[float, Field(ge=0, le=1e9)]


class Stack(Mover):
    """Equal boxes, counted along each row from the lower left; `angle` tilts the whole stack about its base."""

    base: Point
    """the middle of the bottom, m"""
    size: tuple[Length, Length]
    """width and height of each box, m"""
    columns: Count
    """boxes in the bottom row; 1 for a tower"""
    rows: Count
    """how many rows"""
    fewer: Annotated[int, Field(ge=0, le=MAX_BODIES)] = 0
    """how many boxes each row has fewer than the one below: 0 for a wall, 1 for a pyramid"""
    gap: Gap = 0.0
    """between neighbours in a row, and between rows, m"""
    jitter: Gap = 0.0
    """Each box is moved along its row by up to ± this, m."""
    velocity: Velocity = (0.0, 0.0)
    """m/s"""

    @property
    def most_rows(self) -> int:
        """How many rows there can be until one holds no box."""
        return MAX_BODIES if self.fewer == 0 else -(-self.columns // self.fewer)

    @property
    def count(self) -> int:
        """How many boxes there are."""
        return self.columns * self.rows - self.fewer * (self.rows * (self.rows - 1) // 2)
