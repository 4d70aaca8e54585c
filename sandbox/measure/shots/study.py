"""Study of one shot: odds, sensitivity, aim windows and predictability horizon, as far as they are asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from sandbox.echo import short_repr
from sandbox.jsonable import in_json
from sandbox.measure.shots.aim_windows import Windows, windows
from sandbox.measure.shots.monte_carlo import DEFAULT_COUNT, Odds, odds
from sandbox.measure.shots.predictability import (
    PERTURBATION,
    TOLERANCE,
    By,
    Horizon,
    horizon,
)
from sandbox.measure.shots.sensitivity import Slope, sensitivity
from sandbox.measure.shots.shot import NoSuchShotError, ShotSetup, Spread
from sandbox.progress import ProgressCallback


@dataclass(frozen=True)
class FinalState:
    """Final state of a ball after the intended stroke."""

    position: tuple[float, float]
    """m"""
    pocket: str | None
    """name of the pocket that it fell into"""


@dataclass(frozen=True)
class NominalShot:
    """Result of the intended stroke."""

    duration: float
    """s"""
    final: Mapping[str, FinalState]
    """by the names of the balls"""


@dataclass(frozen=True, eq=False, slots=True)
class ShotStudy:
    """Results of a study; those that were not asked for are None or empty."""

    shot: ShotSetup
    """the shot"""
    odds: Odds
    """success odds"""
    slopes: tuple[Slope, ...] | None = field(metadata=in_json(key="sensitivity"))
    """sensitivity of the final positions"""
    windows: tuple[Windows, ...]
    """aim windows of each ball and pocket"""
    horizon: Horizon | None
    """predictability horizon"""
    interrupted: bool = field(default=False, metadata=in_json(omit=True))
    """whether Ctrl-C was pressed before the study was complete"""

    json_head: ClassVar = ("title", "shot", "nominal")

    @property
    def answered(self) -> bool:
        """Whether every pot has a window, and every shot came to rest."""
        return all(each.found for each in self.windows) and not self.odds.unfinished

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.shot.table.scene.title

    @property
    def nominal(self) -> NominalShot:
        """Result of the intended stroke."""
        nominal = self.odds.nominal
        positions = zip(nominal.names, nominal.position.tolist(), strict=True)
        final = {name: FinalState((x, y), nominal.pocketed.get(name)) for name, (x, y) in positions}
        return NominalShot(nominal.duration, final)


def study_shot(
    shot: ShotSetup,
    spread: Spread,
    *,
    count: int = DEFAULT_COUNT,
    seed: int | None = None,
    threads: int = 1,
    slopes: bool = False,
    pots: Sequence[tuple[str, str]] = (),
    foretold: bool = False,
    nudge: float = PERTURBATION,
    by: By = "aim",
    tolerance: float = TOLERANCE,
    on_progress: ProgressCallback | None = None,
) -> ShotStudy:
    """Study a shot. After Ctrl-C the study has the results found so far.

    Args:
        shot: the shot.
        spread: standard deviations of the errors of the stroke.
        count: number of strokes for the odds.
        seed: seed of the random errors; default: the seed of the scene.
        threads: number of threads.
        slopes: whether to compute the sensitivity.
        pots: names of a ball and a pocket, for aim windows.
        foretold: whether to compute the predictability horizon.
        nudge: perturbation for the horizon.
        by: perturbed quantity.
        tolerance: tolerance of the horizon, m.
        on_progress: progress callback; its fraction is the part of the strokes that are played.

    Raises:
        Exhaustion: a shot has too many events.
        NoSuchShotError: no ball or pocket has that name.
    """
    results = odds(shot, spread=spread, count=count, seed=seed, threads=threads, on_progress=on_progress)
    if results.interrupted:
        return ShotStudy(shot, results, None, (), None, True)
    slope, aim_windows, until, interrupted = None, list[Windows](), None, False
    try:
        slope = sensitivity(shot) if slopes else None
        for ball, pocket in pots:
            aim_windows.append(windows(shot, ball, pocket, threads=threads))
        until = horizon(shot, nudge=nudge, by=by, tolerance=tolerance, spread=spread) if foretold else None
    except KeyboardInterrupt:
        interrupted = True
    return ShotStudy(shot, results, slope, tuple(aim_windows), until, interrupted)


def pot_of(shot: ShotSetup, text: str) -> tuple[str, str]:
    """Return ball and pocket of a text `BALL:POCKET`; names may contain colons.

    Raises:
        NoSuchShotError: no ball or pocket has that name; the message lists the names.
    """
    for ball in shot.table.names:
        if text.startswith(f"{ball}:") and text[len(ball) + 1 :] in shot.pockets:
            return ball, text[len(ball) + 1 :]
    ball, colon, pocket = text.partition(":")
    if not colon:
        raise NoSuchShotError(f"{short_repr(text)} is not BALL:POCKET")
    shot.ball_index(ball)
    shot.pocket_index(pocket)
    raise NoSuchShotError(f"{short_repr(text)} is not BALL:POCKET")
