"""Study: all that was asked about one shot."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sandbox.echo import short_repr
from sandbox.measure.shots.attempt import Attempt, NoSuchShotError
from sandbox.measure.shots.horizon import NUDGE, TOLERANCE, By, Horizon, horizon
from sandbox.measure.shots.odds import COUNT, Odds, Progress, odds
from sandbox.measure.shots.sensitivity import Slope, sensitivity
from sandbox.measure.shots.spread import Spread
from sandbox.measure.shots.windows import Windows, windows


@dataclass(frozen=True, eq=False, slots=True)
class Study:
    """A shot's odds, and what else was asked; None, or none, of what was not."""

    attempt: Attempt
    odds: Odds
    slopes: tuple[Slope, ...] | None
    windows: tuple[Windows, ...]
    horizon: Horizon | None
    interrupted: bool = False
    """Ctrl-C was pressed before all that was asked for was found."""

    @property
    def answered(self) -> bool:
        """Whether every window that was asked for is there, and no shot was given up."""
        return all(each.found for each in self.windows) and not self.odds.unfinished

    def document(self) -> dict[str, Any]:
        """Return all of it as one JSON object."""
        nominal = self.odds.nominal
        into, places = nominal.pocketed, nominal.position.tolist()
        final = {
            name: {"position": place, "pocket": into.get(name)}
            for name, place in zip(nominal.names, places, strict=True)
        }
        return {
            "title": self.attempt.table.scene.title,
            "shot": self.attempt.document(),
            "nominal": {"duration": nominal.duration, "final": final},
            "odds": self.odds.document(),
            "sensitivity": None if self.slopes is None else [slope.document() for slope in self.slopes],
            "windows": [each.document() for each in self.windows],
            "horizon": None if self.horizon is None else self.horizon.document(),
        }


def study(
    attempt: Attempt,
    spread: Spread,
    *,
    count: int = COUNT,
    seed: int | None = None,
    threads: int = 1,
    slopes: bool = False,
    pots: Sequence[tuple[str, str]] = (),
    foretold: bool = False,
    nudge: float = NUDGE,
    by: By = "aim",
    tolerance: float = TOLERANCE,
    progress: Progress | None = None,
) -> Study:
    """Ask about a shot; after Ctrl-C the study has what was found by then.

    Args:
        attempt: which.
        spread: by how much strokes stray.
        count: how many are drawn.
        seed: of what is drawn; by default the scene's.
        threads: how many play at once.
        slopes: ask for the sensitivity.
        pots: balls and pockets, to ask for their windows.
        foretold: ask for the horizon.
        nudge: of the horizon.
        by: what is nudged.
        tolerance: m, of the horizon.
        progress: who is told how many of the strokes are played.

    Raises:
        Exhaustion: a shot has too many events.
        NoSuchShotError: no ball or pocket has such a name.
    """
    chances = odds(attempt, spread=spread, count=count, seed=seed, threads=threads, progress=progress)
    if chances.interrupted:
        return Study(attempt, chances, None, (), None, True)
    slope, found, until, interrupted = None, list[Windows](), None, False
    try:
        slope = sensitivity(attempt) if slopes else None
        for ball, pocket in pots:
            found.append(windows(attempt, ball, pocket, threads=threads))
        until = horizon(attempt, nudge=nudge, by=by, tolerance=tolerance, spread=spread) if foretold else None
    except KeyboardInterrupt:
        interrupted = True
    return Study(attempt, chances, slope, tuple(found), until, interrupted)


def pot_of(attempt: Attempt, text: str) -> tuple[str, str]:
    """Split `BALL:POCKET` where a ball's and a pocket's names meet; names may hold colons themselves.

    Raises:
        NoSuchShotError: there is no such ball or pocket; the message has those that there are.
    """
    for ball in attempt.table.names:
        if text.startswith(f"{ball}:") and text[len(ball) + 1 :] in attempt.pockets:
            return ball, text[len(ball) + 1 :]
    ball, colon, pocket = text.partition(":")
    if not colon:
        raise NoSuchShotError(f"{short_repr(text)} is not BALL:POCKET")
    attempt.number(ball)
    attempt.pocket(pocket)
    raise NoSuchShotError(f"{short_repr(text)} is not BALL:POCKET")
