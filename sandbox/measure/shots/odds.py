"""Odds: how likely each ball falls into each pocket, and where balls stay, if a stroke strays as a player's does."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from sandbox.engines.exact.rolling.fan import Fan
from sandbox.engines.exact.rolling.outcome import Outcome
from sandbox.interrupt import uninterrupted
from sandbox.measure.shots.attempt import Attempt, attempt_of
from sandbox.measure.shots.spread import Spread, sound, strayed
from sandbox.measure.shots.wilson import wilson
from sandbox.scene.model import Scene
from sandbox.trajectory import FloatArray

COUNT = 10_000
"""Shots of an ensemble: a probability of a half is then known to 1 %."""

TOGETHER = 512
"""Shots that a thread plays between looks at whether it is interrupted: 0.2 s of breaks."""

Progress = Callable[[float], None]
"""Called now and then with the share of the shots that are played, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Chance:
    """How often something came about."""

    hits: int
    trials: int

    @property
    def share(self) -> float:
        """Hits a trial."""
        return self.hits / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Between what the probability lies, with 95 % confidence."""
        return wilson(self.hits, self.trials)

    def document(self) -> dict[str, Any]:
        """Return it as one JSON object."""
        low, high = self.interval
        return {"hits": self.hits, "trials": self.trials, "probability": self.share, "low": low, "high": high}


@dataclass(frozen=True, slots=True)
class Rest:
    """Where a ball came to rest, over the shots that left it on the table."""

    count: int
    mean: tuple[float, float]
    """m"""
    spread: tuple[float, float]
    """m, standard deviations along x and y"""


@dataclass(frozen=True, eq=False)
class Odds:
    """What came of an ensemble of M strokes at N balls. What miscued was not played, and pots nothing."""

    attempt: Attempt
    spread: Spread
    seed: int
    nominal: Outcome
    """the stroke as it is meant"""
    errors: FloatArray
    """(M, 4) as drawn"""
    fan: Fan
    """the M − `miscues` shots that were played"""
    miscues: int
    interrupted: bool = False
    """whether these are not all that were asked for"""

    @property
    def count(self) -> int:
        """How many strokes there were."""
        return len(self.errors)

    @property
    def unfinished(self) -> int:
        """How many shots were given up: not all came to rest in time, or there were too many events."""
        return int(np.count_nonzero(~np.asarray(self.fan.complete, np.bool_)))

    def chance(self, ball: str, pocket: str | None = None) -> Chance:
        """Return how often a ball fell into a pocket, or into any.

        Raises:
            NoSuchShotError: no ball or pocket has that name.
        """
        into = self.fan.pocket[:, self.attempt.number(ball)]
        fell = into >= 0 if pocket is None else into == self.attempt.pocket(pocket)
        return Chance(int(np.count_nonzero(fell)), self.count)

    @property
    def scratch(self) -> Chance:
        """How often the ball that is struck fell."""
        return self.chance(self.attempt.ball)

    @property
    def any_pot(self) -> Chance:
        """How often any other ball fell, and the one that is struck did not."""
        fell = self.fan.pocket >= 0
        own = self.attempt.number(self.attempt.ball)
        others = np.delete(fell, own, axis=1).any(axis=1)
        return Chance(int(np.count_nonzero(others & ~fell[:, own])), self.count)

    def rest(self, ball: str) -> Rest | None:
        """Return where a ball came to rest; None where it never stayed on the table.

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
        """Return all of it but the shots themselves as one JSON object."""
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
    """Play a shot many times, each a little off, and count what came of it.

    The same seed gives the same odds bit for bit, whatever the number of threads. An interrupt keeps what was played.

    Args:
        scene: with a `[surface]` and a `[[shot]]`.
        shot: which, by its name; by default the first.
        spread: by how much strokes stray: aim, rad; speed, a share; side and height, of the radius.
        count: how many strokes.
        seed: of what is drawn; by default the scene's.
        threads: how many play at once.
        errors: (M, 4) rad, share, of the radius twice: played instead of what would be drawn.
        progress: who is told how far it is.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine lacks something.
        Exhaustion: the shot as it is meant has too many events.
    """
    attempt = attempt_of(scene, shot)
    spread = Spread() if spread is None else spread
    seed = attempt.table.scene.world.seed if seed is None else seed
    drawn = spread.draw(count, seed) if errors is None else np.asarray(errors, np.float64).reshape(-1, 4)
    nominal, played, miscues = attempt.played(), 0, 0
    parts: list[Fan] = []
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
    whole = Fan(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Fan)))
    return Odds(attempt, spread, seed, nominal, drawn[:played], whole, miscues, played < len(drawn))
