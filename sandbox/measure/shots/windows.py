"""Windows: between which angles of aim a ball falls into a pocket: what players ask."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sandbox.measure.shots.attempt import Attempt, attempt_of
from sandbox.scene.model import Scene
from sandbox.trajectory import BoolArray, FloatArray

REACH = 0.1
"""rad to each side of what is meant that are looked through"""

SHOTS = 8001
"""in that range, 25 µrad apart"""

CLOSE = 1e-9
"""rad to which a window's ends are found"""

WIDEST = 0.5 * math.pi
"""rad to each side; farther off no window is followed"""


@dataclass(frozen=True, slots=True)
class Window:
    """Angles of aim, rad, between which a ball falls into a pocket."""

    low: float
    high: float

    @property
    def centre(self) -> float:
        """The angle to aim at, rad."""
        return 0.5 * (self.low + self.high)

    @property
    def half(self) -> float:
        """How far off it the aim may be, rad."""
        return 0.5 * (self.high - self.low)

    def off(self, aim: float) -> float:
        """Return how far an aim is beside it, rad; 0 of one that is in it."""
        return max(self.low - aim, aim - self.high, 0.0)

    def __contains__(self, aim: float) -> bool:
        return self.low <= aim <= self.high


@dataclass(frozen=True, eq=False, slots=True)
class Windows:
    """All the windows that were found about an aim."""

    ball: str
    pocket: str
    aim: float
    """rad, as it is meant"""
    reach: float
    """rad to each side that were looked through"""
    spacing: float
    """rad between shots: a narrower window may have been overlooked, and so may a narrower gap in one"""
    found: tuple[Window, ...]

    @property
    def nearest(self) -> Window | None:
        """The window that the aim is in, or the nearest one."""
        return min(self.found, key=lambda one: one.off(self.aim), default=None)

    def document(self) -> dict[str, Any]:
        """Return it as one JSON object."""
        rows = [asdict(one) | {"centre": one.centre, "half": one.half} for one in self.found]
        nearest = self.nearest
        return {
            "ball": self.ball,
            "pocket": self.pocket,
            "aim": self.aim,
            "within": nearest is not None and self.aim in nearest,
            "reach": self.reach,
            "spacing": self.spacing,
            "windows": rows,
        }


def windows(
    scene: Scene | Attempt,
    ball: str,
    pocket: str,
    shot: str | None = None,
    *,
    reach: float = REACH,
    shots: int = SHOTS,
    threads: int = 1,
) -> Windows:
    """Look for the angles of aim at which a ball falls into a pocket, the stroke being otherwise as it is meant.

    A window that goes on beyond the range is followed, with shots farther apart. Ends are right to 1e-9 rad.

    Args:
        scene: with a `[surface]` and a `[[shot]]`.
        ball: which.
        pocket: which.
        shot: which, by its name; by default the first.
        reach: rad to each side that are looked through.
        shots: how many are played in that range.
        threads: how many play at once.

    Raises:
        NoSuchShotError: the scene has no such shot, ball or pocket.
        Refusal: the exact engine lacks something.
    """
    attempt = attempt_of(scene, shot)
    number, hole = attempt.number(ball), attempt.pocket(pocket)

    def falls(aims: FloatArray) -> BoolArray:
        strokes = [attempt.stroke.model_copy(update={"aim": aim}) for aim in aims.tolist()]
        return np.asarray(attempt.fan(strokes, threads).pocket[:, number] == hole)

    aim = attempt.stroke.aim
    while True:
        aims = np.linspace(aim - reach, aim + reach, shots)
        falling = falls(aims)
        if not (falling[0] or falling[-1]) or reach >= WIDEST:
            break
        reach = min(2.0 * reach, WIDEST)
    turns = np.flatnonzero(falling[1:] != falling[:-1])
    ends = _closed_in(falls, aims[turns], aims[turns + 1], falling[turns])
    edges = [*([float(aims[0])] if falling[0] else []), *ends.tolist(), *([float(aims[-1])] if falling[-1] else [])]
    found = tuple(Window(low, high) for low, high in zip(edges[::2], edges[1::2], strict=True))
    return Windows(ball, pocket, aim, reach, float(aims[1] - aims[0]), found)


def _closed_in(
    falls: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray, before: BoolArray
) -> FloatArray:
    """Return where each of K brackets turns from `before` into its contrary, all of them halved at once."""
    while len(low) and float((high - low).max()) > CLOSE:
        middle = 0.5 * (low + high)
        same = falls(middle) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(0.5 * (low + high))
