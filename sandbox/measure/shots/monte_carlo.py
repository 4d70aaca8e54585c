"""Success odds and final positions of a shot under execution noise, by Monte Carlo."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import ClassVar

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.echo import short_repr
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.engines.exact.tabletop.shots import ShotBatch
from sandbox.html_repr import HtmlRepr
from sandbox.jsonable import in_json
from sandbox.measure.proportion import Proportion
from sandbox.measure.shots.shot import (
    ShotSetup,
    Spread,
    perturb_stroke,
    shot_setup,
    without_miscues,
)
from sandbox.progress import Progress, ProgressCallback
from sandbox.scene.compile.scene import Scene
from sandbox.signals import defer_interrupt

DEFAULT_COUNT = 10_000
"""Default number of shots: the standard error of a probability of one half is 0.5 %, its 95 % interval ±1 %."""

SHOTS_PER_CHECK = 512
"""Shots of a thread between two checks for Ctrl-C: 0.2 s for break shots."""


@dataclass(frozen=True)
class RestStatistics:
    """Final position of a ball, over the shots after which it is on the table."""

    count: int
    """number of these shots"""
    mean: tuple[float, float]
    """m, mean of x and y"""
    spread: tuple[float, float]
    """m, standard deviation of x and y"""


@dataclass(frozen=True)
class BallOdds:
    """Odds of one ball."""

    potted: Proportion
    """frequency of falling into any pocket"""
    pockets: Mapping[str, Proportion]
    """by the names of the pockets into which it fell"""
    rest: RestStatistics | None
    """final position; None if it never remained on the table"""


@dataclass(frozen=True, eq=False)
class Odds(HtmlRepr):
    """Results of M strokes with random errors at a table of N balls.

    A miscue is not played; it counts as a stroke that pots nothing.
    """

    shot: ShotSetup = field(metadata=in_json(omit=True))
    """the shot"""
    spread: Spread
    """standard deviations of the errors"""
    seed: int
    """seed of the random errors"""
    nominal: ShotResult = field(metadata=in_json(omit=True))
    """result of the intended stroke"""
    errors: FloatArray = field(metadata=in_json(omit=True))
    """(M, 4) errors of the strokes: aim in rad, speed as a fraction, side and height as fractions of the radius"""
    batch: ShotBatch = field(metadata=in_json(omit=True))
    """results of the M − `miscues` played shots"""
    miscues: int
    """number of miscues"""
    interrupted: bool = False
    """whether Ctrl-C was pressed before all shots were played"""

    json_head: ClassVar = ("count", "seed", "spread", "interrupted", "miscues")
    json_properties: ClassVar = ("unfinished", "scratch", "any_pot", "balls")
    json_name: ClassVar = "OddsDocument"

    def __repr__(self) -> str:
        """Return the shot, the number of strokes, and the odds of a pot and of a scratch."""
        setup = self.shot
        where = f"{short_repr(setup.table.scene.title)}, shot {short_repr(setup.name)} at {short_repr(setup.ball)}"
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
        return int(np.count_nonzero(~np.asarray(self.batch.complete, np.bool_)))

    def chance(self, ball: str, pocket: str | None = None) -> Proportion:
        """Return how often a ball fell into a pocket.

        Args:
            ball: name of the ball.
            pocket: name of the pocket; default: any pocket.

        Raises:
            NoSuchShotError: no ball or pocket has that name.
        """
        into = self.batch.pocket[:, self.shot.ball_index(ball)]
        fell = into >= 0 if pocket is None else into == self.shot.pocket_index(pocket)
        return Proportion(int(np.count_nonzero(fell)), self.count)

    @property
    def scratch(self) -> Proportion:
        """Frequency of a scratch: the struck ball fell into a pocket."""
        return self.chance(self.shot.ball)

    @property
    def any_pot(self) -> Proportion:
        """Frequency of a pot: another ball fell into a pocket, and the struck ball did not."""
        fell = self.batch.pocket >= 0
        own = self.shot.ball_index(self.shot.ball)
        others = np.delete(fell, own, axis=1).any(axis=1)
        return Proportion(int(np.count_nonzero(others & ~fell[:, own])), self.count)

    def rest(self, ball: str) -> RestStatistics | None:
        """Return the statistics of the final position of a ball; None if it never remained on the table.

        Args:
            ball: name of the ball.

        Raises:
            NoSuchShotError: no ball has that name.
        """
        number = self.shot.ball_index(ball)
        stayed = self.batch.position[self.batch.pocket[:, number] < 0, number]
        if not len(stayed):
            return None
        (x, y), (dx, dy) = stayed.mean(axis=0).tolist(), stayed.std(axis=0).tolist()
        return RestStatistics(len(stayed), (x, y), (dx, dy))

    @property
    def balls(self) -> Mapping[str, BallOdds]:
        """Odds of each ball by its name."""
        odds_of = {}
        for ball in self.shot.table.names:
            into = {pocket: self.chance(ball, pocket) for pocket in self.shot.pockets}
            pockets = {pocket: chance for pocket, chance in into.items() if chance.hits}
            odds_of[ball] = BallOdds(self.chance(ball), pockets, self.rest(ball))
        return odds_of


def odds(
    scene: Scene | ShotSetup,
    shot: str | None = None,
    *,
    spread: Spread | None = None,
    count: int = DEFAULT_COUNT,
    seed: int | None = None,
    threads: int = 1,
    errors: FloatArray | None = None,
    on_progress: ProgressCallback | None = None,
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
        on_progress: progress callback; its fraction is the part of the shots that are played.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine does not support the scene.
        Exhaustion: the intended shot has too many events.

    Example:
        >>> found = sandbox.odds(sandbox.load("8-ball"), count=20, seed=1)
        >>> found.count, found.miscues
        (20, 0)
        >>> found.any_pot.low < 0.5  # the lower end of the 95 % interval
        True
    """
    setup = shot_setup(scene, shot)
    spread = Spread() if spread is None else spread
    seed = setup.table.scene.world.seed if seed is None else seed
    drawn = spread.draw(count, seed) if errors is None else np.asarray(errors, np.float64).reshape(-1, 4)
    nominal, done, miscues = setup.simulate(), 0, 0
    parts: list[ShotBatch] = []
    try:
        while done < len(drawn) or not parts:
            errors_of_part = drawn[done : done + SHOTS_PER_CHECK * threads]
            strokes, kept = without_miscues(perturb_stroke(setup.stroke, errors_of_part))
            batch = setup.simulate_batch(strokes, threads)
            with defer_interrupt():
                parts.append(batch)
                done, miscues = done + len(errors_of_part), miscues + int(np.count_nonzero(~kept))
            if on_progress is not None:
                on_progress(Progress(fraction=done / max(len(drawn), 1)))
    except KeyboardInterrupt:
        if not parts:
            raise
    whole = ShotBatch(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(ShotBatch)))
    return Odds(setup, spread, seed, nominal, drawn[:done], whole, miscues, done < len(drawn))
