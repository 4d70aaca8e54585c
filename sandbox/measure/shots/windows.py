"""Windows: intervals of the aim for which a ball falls into a pocket."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.shots.attempt import Attempt, attempt_of
from sandbox.scene.scene import Scene

REACH = 0.1
"""rad, default range of the search on each side of the intended aim"""

SHOTS = 8001
"""default number of shots in that range, 25 µrad apart"""

CLOSE = 1e-9
"""rad, accuracy of the ends of a window"""

WIDEST = 0.5 * math.pi
"""rad on each side of the aim: a window is not followed beyond"""


@dataclass(frozen=True, slots=True)
class Window:
    """Interval of the aim, rad, in which a ball falls into a pocket."""

    low: float
    """rad"""
    high: float
    """rad"""

    @property
    def centre(self) -> float:
        """Centre of the window, rad."""
        return 0.5 * (self.low + self.high)

    @property
    def half(self) -> float:
        """Half the width of the window, rad: the largest error of an aim at its centre."""
        return 0.5 * (self.high - self.low)

    def off(self, aim: float) -> float:
        """Return the distance of an aim from the window, rad; 0 inside it."""
        return max(self.low - aim, aim - self.high, 0.0)

    def __contains__(self, aim: float) -> bool:
        return self.low <= aim <= self.high


@dataclass(frozen=True, eq=False, slots=True)
class Windows:
    """All windows found around an intended aim."""

    ball: str
    """name of the ball"""
    pocket: str
    """name of the pocket"""
    aim: float
    """rad, intended aim"""
    reach: float
    """rad, range of the search on each side"""
    spacing: float
    """rad between shots; narrower windows, and narrower gaps in a window, may be missed"""
    found: tuple[Window, ...]
    """windows in ascending order"""

    @property
    def nearest(self) -> Window | None:
        """Window that contains the intended aim, or the nearest one; None if there is none."""
        return min(self.found, key=lambda one: one.off(self.aim), default=None)

    def document(self) -> dict[str, Any]:
        """Return the windows as one JSON object."""
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
    """Find the intervals of the aim for which a ball falls into a pocket; the rest of the stroke is unchanged.

    A window that extends beyond the range is followed with shots farther apart. Ends are accurate to 1e-9 rad.

    Args:
        scene: scene with a `[surface]` and a `[[shot]]`.
        ball: name of the ball.
        pocket: name of the pocket.
        shot: name of the shot; default: the first.
        reach: range of the search on each side of the intended aim, rad.
        shots: number of shots in that range.
        threads: number of threads.

    Raises:
        NoSuchShotError: the scene has no such shot, ball or pocket.
        Refusal: the exact engine does not support the scene.
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
