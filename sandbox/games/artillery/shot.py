"""Shot: what a shot came to, and by how much the flight that was computed missed the exact one."""

import math
from typing import NamedTuple

from sandbox.scene.part import Point


class Shot(NamedTuple):
    """A shot that has come down, or left."""

    shooter: str
    weapon: str
    place: Point | None
    """where it came down, m; none where it left for good"""
    exact: Point | None
    """where the exact flight comes down, m"""
    flown: float
    """s"""
    time: float = 0.0
    """s, when it came down, or was seen to have left"""
    disturbed: bool = False
    """Air or gravity became others on its way: no one flight is the exact one."""

    @property
    def off(self) -> float | None:
        """How far the two are apart, m; none unless both come down."""
        return None if self.place is None or self.exact is None else math.dist(self.place, self.exact)

    @property
    def told(self) -> str:
        """In words."""
        if self.disturbed:
            return f"{'gone' if self.place is None else f'at {self.place[0]:.2f} m'}; the air changed on its way"
        if self.place is None:
            return "gone" if self.exact is None else f"gone; exactly at {self.exact[0]:.2f} m"
        if self.exact is None:
            return f"at {self.place[0]:.2f} m; exactly, gone"
        off = length(math.dist(self.place, self.exact))
        return f"at {self.place[0]:.2f} m, exactly {self.exact[0]:.2f} m: off by {off}"


def length(metres: float) -> str:
    """Return a length in words that has three digits."""
    for least, factor, unit in ((1.0, 1.0, "m"), (1e-3, 1e3, "mm"), (1e-6, 1e6, "µm"), (1e-9, 1e9, "nm")):
        if metres >= least:
            return f"{f'{metres * factor:#.3g}'.rstrip('.')} {unit}" if metres < 100.0 else f"{metres:.0f} m"
    return "less than 1 nm"
