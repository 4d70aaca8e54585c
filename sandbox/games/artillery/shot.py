"""Shot: what a shot came to, and by how much the flight that was computed missed the exact one."""

import math
from typing import NamedTuple

from sandbox.scene.description.base import Point


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
        """In words: where along x it came down, and how far from the exact solution along x and y."""
        return self.brief if self.place is None else f"landed at {self.brief}"

    @property
    def brief(self) -> str:
        """The same in fewer words."""
        landed = "out of bounds" if self.place is None else f"{self.place[0]:.2f} m"
        if self.disturbed:
            return f"{landed}; wind or gravity changed during the flight"
        if self.exact is None:
            return landed if self.place is None else f"{landed}, exact solution out of bounds"
        exact = f"{landed}, exact solution {self.exact[0]:.2f} m"
        if self.place is None:
            return exact
        across, up = (length(abs(a - b)) for a, b in zip(self.place, self.exact, strict=True))
        return f"{exact} (Δx {across}" + (")" if up == NOTHING else f", Δy {up})")


NOTHING = "less than 1 nm"


def length(metres: float) -> str:
    """Return a length in words that has three digits."""
    for least, factor, unit in ((1.0, 1.0, "m"), (1e-3, 1e3, "mm"), (1e-6, 1e6, "µm"), (1e-9, 1e9, "nm")):
        if metres >= least:
            return f"{f'{metres * factor:#.3g}'.rstrip('.')} {unit}" if metres < 100.0 else f"{metres:.0f} m"
    return NOTHING
