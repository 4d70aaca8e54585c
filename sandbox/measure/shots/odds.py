"""Odds: probability that a ball falls into a pocket, and final positions, under random errors of the stroke."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.echo import short_repr
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.engines.exact.tabletop.shots import ShotBatch
from sandbox.html_repr import HtmlRepr
from sandbox.interrupt import uninterrupted
from sandbox.measure.shots.attempt import Attempt, attempt_of
from sandbox.measure.shots.spread import Spread, sound, strayed
from sandbox.measure.shots.wilson import wilson
from sandbox.scene.scene import Scene

COUNT = 10_000
"""Default number of shots: the standard error of a probability of one half is 0.5 %, its 95 % interval ±1 %."""

TOGETHER = 512
"""Shots of a thread between two checks for an interrupt: 0.2 s for break shots."""

Progress = Callable[[float], None]
"""Progress callback: called from time to time with the fraction of the shots that are played, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Chance:
    """Frequency of an event in a number of shots."""

    hits: int
    """number of shots with the event"""
    trials: int
    """number of shots"""

    @property
    def share(self) -> float:
        """Estimate of the probability, hits / trials; nan without trials."""
        return self.hits / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the probability (Wilson 1927)."""
        return wilson(self.hits, self.trials)

    def __str__(self) -> str:
        """Give the probability with its confidence interval, in per cent."""
        if not self.trials:
            return "unknown"
        low, high = self.interval
        return f"{100.0 * self.share:.1f} % (95 % interval {100.0 * low:.1f} to {100.0 * high:.1f} %)"

    def document(self) -> dict[str, Any]:
        """Return the frequency as one JSON object."""
        low, high = self.interval
        return {"hits": self.hits, "trials": self.trials, "probability": self.share, "low": low, "high": high}


@dataclass(frozen=True, slots=True)
class Rest:
    """Final position of a ball, over the shots after which it is on the table."""

    count: int
    """number of these shots"""
    mean: tuple[float, float]
    """m, mean of x and y"""
    spread: tuple[float, float]
    """m, standard deviation of x and y"""


@dataclass(frozen=True, eq=False)
class Odds(HtmlRepr):
    """Results of M strokes with random errors at a table of N balls.

    A miscue is not played; it counts as a stroke that pots nothing.
    """

    attempt: Attempt
    """the shot"""
    spread: Spread
    """standard deviations of the errors"""
    seed: int
    """seed of the random errors"""
    nominal: ShotResult
    """result of the intended stroke"""
    errors: FloatArray
    """(M, 4) errors of the strokes: aim in rad, speed as a fraction, side and height as fractions of the radius"""
    fan: ShotBatch
    """results of the M − `miscues` played shots"""
    miscues: int
    """number of miscues"""
    interrupted: bool = False
    """whether Ctrl-C was pressed before all shots were played"""

    def __repr__(self) -> str:
        """Return the shot, the number of strokes, and the odds of a pot and of a scratch."""
        attempt = self.attempt
        where = (
            f"{short_repr(attempt.table.scene.title)}, shot {short_repr(attempt.name)} at {short_repr(attempt.ball)}"
        )
        lines = [
            f"<Odds {where}: {self.count:,} strokes, seed {self.seed}, {self.miscues:,} miscues",
            f"any other ball potted: {self.any_pot}",
            f"struck ball potted: {self.scratch}",
        ]
        return "\n  ".join(lines) + ">"

    @property
    def count(self) -> int:
        """M, the number of strokes."""
        return len(self.errors)

    @property
    def unfinished(self) -> int:
        """Number of incomplete shots: not all balls at rest within the time limit, or too many events."""
        return int(np.count_nonzero(~np.asarray(self.fan.complete, np.bool_)))

    def chance(self, ball: str, pocket: str | None = None) -> Chance:
        """Return how often a ball fell into a pocket.

        Args:
            ball: name of the ball.
            pocket: name of the pocket; default: any pocket.

        Raises:
            NoSuchShotError: no ball or pocket has that name.
        """
        into = self.fan.pocket[:, self.attempt.number(ball)]
        fell = into >= 0 if pocket is None else into == self.attempt.pocket(pocket)
        return Chance(int(np.count_nonzero(fell)), self.count)

    @property
    def scratch(self) -> Chance:
        """Frequency of a scratch: the struck ball fell into a pocket."""
        return self.chance(self.attempt.ball)

    @property
    def any_pot(self) -> Chance:
        """Frequency of a pot: another ball fell into a pocket, and the struck ball did not."""
        fell = self.fan.pocket >= 0
        own = self.attempt.number(self.attempt.ball)
        others = np.delete(fell, own, axis=1).any(axis=1)
        return Chance(int(np.count_nonzero(others & ~fell[:, own])), self.count)

    def rest(self, ball: str) -> Rest | None:
        """Return the statistics of the final position of a ball; None if it never remained on the table.

        Args:
            ball: name of the ball.

        Raises:
            NoSuchShotError: no ball has that name.
        """
        number = self.attempt.number(ball)
        stayed = self.fan.position[self.fan.pocket[:, number] < 0, number]
        if not len(stayed):
            return None
        (x, y), (dx, dy) = stayed.mean(axis=0).tolist(), stayed.std(axis=0).tolist()
        return Rest(len(stayed), (x, y), (dx, dy))

    def document(self) -> dict[str, Any]:
        """Return the odds as one JSON object, without the single shots."""
        names, pockets = self.attempt.table.names, self.attempt.pockets
        balls = {}
        for ball in names:
            rest = self.rest(ball)
            into = {pocket: self.chance(ball, pocket) for pocket in pockets}
            balls[ball] = {
                "potted": self.chance(ball).document(),
                "pockets": {pocket: chance.document() for pocket, chance in into.items() if chance.hits},
                "rest": None if rest is None else asdict(rest),
            }
        return {
            "count": self.count,
            "seed": self.seed,
            "spread": asdict(self.spread),
            "interrupted": self.interrupted,
            "miscues": self.miscues,
            "unfinished": self.unfinished,
            "scratch": self.scratch.document(),
            "any_pot": self.any_pot.document(),
            "balls": balls,
        }


def odds(
    scene: Scene | Attempt,
    shot: str | None = None,
    *,
    spread: Spread | None = None,
    count: int = COUNT,
    seed: int | None = None,
    threads: int = 1,
    errors: FloatArray | None = None,
    progress: Progress | None = None,
) -> Odds:
    """Play a shot many times with random errors of the stroke, and count the results.

    Equal seeds give equal odds, bit for bit, with any number of threads. An interrupt keeps the shots played so far.

    Args:
        scene: scene with a `[surface]` and a `[[shot]]`.
        shot: name of the shot; default: the first.
        spread: standard deviations of the errors; default: `Spread()`.
        count: number of strokes.
        seed: seed of the random errors; default: the seed of the scene.
        threads: number of threads.
        errors: (M, 4) errors to play in place of random ones: aim in rad, speed as a fraction, side and height as
            fractions of the radius.
        progress: progress callback, called with the fraction of the shots that are played, 0 to 1.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine does not support the scene.
        Exhaustion: the intended shot has too many events.
    """
    attempt = attempt_of(scene, shot)
    spread = Spread() if spread is None else spread
    seed = attempt.table.scene.world.seed if seed is None else seed
    drawn = spread.draw(count, seed) if errors is None else np.asarray(errors, np.float64).reshape(-1, 4)
    nominal, played, miscues = attempt.played(), 0, 0
    parts: list[ShotBatch] = []
    try:
        while played < len(drawn) or not parts:
            some = drawn[played : played + TOGETHER * threads]
            strokes, kept = sound(strayed(attempt.stroke, some))
            fan = attempt.fan(strokes, threads)
            with uninterrupted():
                parts.append(fan)
                played, miscues = played + len(some), miscues + int(np.count_nonzero(~kept))
            if progress is not None:
                progress(played / max(len(drawn), 1))
    except KeyboardInterrupt:
        if not parts:
            raise
    whole = ShotBatch(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(ShotBatch)))
    return Odds(attempt, spread, seed, nominal, drawn[:played], whole, miscues, played < len(drawn))
