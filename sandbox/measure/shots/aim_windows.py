"""Aim windows: intervals of the aim for which a ball falls into a pocket."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.jsonable import in_json
from sandbox.measure.shots.shot import ShotSetup, shot_setup
from sandbox.scene.compile.scene import Scene

DEFAULT_REACH = 0.1
"""rad, default range of the search on each side of the intended aim"""

DEFAULT_SHOTS = 8001
"""default number of shots in that range, 25 µrad apart"""

END_ACCURACY = 1e-9
"""rad, accuracy of the ends of a window"""

MAX_REACH = 0.5 * math.pi
"""rad on each side of the aim, beyond which a window is not followed"""


@dataclass(frozen=True)
class Window:
    """Interval of the aim, rad, in which a ball falls into a pocket."""

    low: float
    """rad"""
    high: float
    """rad"""

    json_properties: ClassVar = ("centre", "half")

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
    found: tuple[Window, ...] = field(metadata=in_json(key="windows"))
    """windows in ascending order"""

    json_head: ClassVar = ("ball", "pocket", "aim", "within")
    json_name: ClassVar = "WindowsDocument"

    @property
    def nearest(self) -> Window | None:
        """Window that contains the intended aim, or the nearest one; None if there is none."""
        return min(self.found, key=lambda one: one.off(self.aim), default=None)

    @property
    def within(self) -> bool:
        """Whether the intended aim is in a window."""
        nearest = self.nearest
        return nearest is not None and self.aim in nearest


def windows(
    scene: Scene | ShotSetup,
    ball: str,
    pocket: str,
    shot: str | None = None,
    *,
    reach: float = DEFAULT_REACH,
    shots: int = DEFAULT_SHOTS,
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

    Example:
        >>> table = sandbox.loads('''
        ... surface = {}
        ... ball = [
        ...     { name = "cue", position = [0, 0], radius = 0.0286 },
        ...     { name = "red", position = [0.5, 0], radius = 0.0286 },
        ... ]
        ... pocket = [{ name = "far", position = [1, 0.1], radius = 0.06 }]
        ... shot = [{ ball = "cue", aim = 0, speed = 2 }]
        ... ''')
        >>> for window in sandbox.windows(table, "red", "far").found:
        ...     print(f"{window.low:.4f} to {window.high:.4f} rad")
        -0.0398 to -0.0102 rad
    """
    setup = shot_setup(scene, shot)
    number, hole = setup.ball_index(ball), setup.pocket_index(pocket)

    def falls(aims: FloatArray) -> BoolArray:
        strokes = [setup.stroke.model_copy(update={"aim": aim}) for aim in aims.tolist()]
        return np.asarray(setup.simulate_batch(strokes, threads).pocket[:, number] == hole)

    aim = setup.stroke.aim
    while True:
        aims = np.linspace(aim - reach, aim + reach, shots)
        falling = falls(aims)
        if not (falling[0] or falling[-1]) or reach >= MAX_REACH:
            break
        reach = min(2.0 * reach, MAX_REACH)
    turns = np.flatnonzero(falling[1:] != falling[:-1])
    ends = _bisect_ends(falls, aims[turns], aims[turns + 1], falling[turns])
    edges = [*([float(aims[0])] if falling[0] else []), *ends.tolist(), *([float(aims[-1])] if falling[-1] else [])]
    found = tuple(Window(low, high) for low, high in zip(edges[::2], edges[1::2], strict=True))
    return Windows(ball, pocket, aim, reach, float(aims[1] - aims[0]), found)


def _bisect_ends(
    falls: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray, before: BoolArray
) -> FloatArray:
    """Return where each of K brackets changes from `before` to its opposite, (K,); all are bisected together."""
    while len(low) and float((high - low).max()) > END_ACCURACY:
        middle = 0.5 * (low + high)
        same = falls(middle) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(0.5 * (low + high))
