"""Diagnostic: one certain or possible problem of a run of a scene, with a remedy; or a note about the scene."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

from sandbox.jsonable import in_json
from sandbox.measure.proportion import Proportion
from sandbox.scene.description.world import Settings

ROUNDING = 1e-9
"""Relative: a limit that is exceeded by less counts as kept, because both sides are rounded."""

CANDIDATES = {"substeps", "iterations", "safe_dt"}
"""Details that name a setting as a remedy"""

Detail = float | int | str
Details = dict[str, Detail]


@dataclass(frozen=True)
class Occurrence:
    """Frequency of a problem in trial runs from perturbed starts."""

    engine: str
    """name of the engine"""
    until: float | None
    """s, duration of the trial runs; None: that of the scene"""
    starts: Proportion
    """starts in which it occurs"""
    in_file: bool
    """whether it occurs from the start of the file"""
    event: str = "occurs"
    """what occurs, as a clause, such as `energy rises by a fraction 0.3 of the exchanged energy`"""

    def __str__(self) -> str:
        """Return the frequency: `occurs in 9 of 30 starts on pymunk (95 % interval 17 to 48 %)`."""
        hits, trials = self.starts.hits, self.starts.trials
        covered = "" if self.until is None else f", in the first {self.until:.3g} s"
        if trials == 1:
            return f"{self.event} in {'the' if hits else 'no'} trial run on {self.engine}{covered}"
        count = f"{hits:,}" if hits else "none"
        return f"{self.event} in {count} of {trials:,} starts on {self.engine}{covered} {self.starts.interval_text}"


@dataclass(frozen=True)
class TriedRemedy:
    """Setting that may avoid a problem, and how often the problem occurs with it."""

    name: str
    """name of the setting"""
    value: float
    starts: Proportion
    """starts in which the problem occurs or the run diverges, up to the first of these"""

    @property
    def holds(self) -> bool:
        """Whether the problem does not occur in any of the starts."""
        return self.starts.hits == 0

    def __str__(self) -> str:
        """Return the value with up to six digits."""
        return f"{self.value:.6g}"


@dataclass(frozen=True)
class Diagnostic:
    """Problem of a scene, or a note about it."""

    kind: str
    """identifier of the problem, such as `tunnelling`"""
    problem: str = field(metadata=in_json(omit=True))
    """description"""
    details: Details = field(default_factory=dict, metadata=in_json(inline=True))
    """the numbers and names in the description, by key"""
    remedy: str = field(default="", metadata=in_json(omit=True))
    """clause that names what avoids the problem according to formulas"""
    seen: Occurrence | None = field(default=None, metadata=in_json(optional=True))
    """frequency in trial runs; None for a prediction by formulas that no trial run can confirm, and for notes"""
    tried: tuple[TriedRemedy, ...] | None = field(default=None, metadata=in_json(key="remedies", optional=True))
    """settings that were tried as remedies, up to the first that holds; None: there were none"""

    json_head: ClassVar = ("kind", "message")

    @property
    def message(self) -> str:
        """Description with frequency and remedy."""
        return "; ".join(self._clauses())

    @property
    def is_observed(self) -> bool:
        """Whether a trial run showed it."""
        return self.seen is not None and self.seen.starts.hits > 0

    @property
    def odds(self) -> float | None:
        """Odds of the problem: the fraction of trial runs that show it, or a bound by a formula for one body."""
        if self.seen is not None and self.is_observed:
            return self.seen.starts.probability
        odds = self.details.get("odds")
        return None if odds is None else float(odds)

    @property
    def odds_of_any(self) -> float | None:
        """Odds that the problem occurs to any of its bodies, whose odds by a formula count as independent."""
        if self.odds is None or self.is_observed:
            return self.odds
        return 1.0 - (1.0 - self.odds) ** (1 + int(self.details.get("other_bodies", 0)))

    def _clauses(self) -> Iterator[str]:
        yield self.problem
        if self.seen is not None:
            yield str(self.seen)
        if not self.tried:
            yield from [self.remedy] if self.remedy else []
            return
        *failed, last = self.tried
        failed += [] if last.holds else [last]
        if failed:
            by_name = {each.name: [other for other in failed if other.name == each.name] for each in failed}
            texts = (f"solver.{name} = {', '.join(map(str, some))}" for name, some in by_name.items())
            yield f"still so with {' or '.join(texts)}"
        if not last.holds and self.remedy and not CANDIDATES & self.details.keys():
            yield self.remedy  # of another kind than the settings that were tried
        if last.holds:
            count = last.starts.trials
            setting = f"solver.{last.name} = {last}"
            yield f"with {setting} in none of {count:,} starts" if count > 1 else f"not with {setting}"


def floor_3_digits(limit: float) -> str:
    """Return a limit with three digits, rounded down, so that the written value satisfies it up to rounding."""
    from decimal import ROUND_FLOOR, Context  # takes 5 ms, and most scenes have no diagnostic

    return f"{float(Context(prec=3, rounding=ROUND_FLOOR).create_decimal(limit * (1.0 + ROUNDING))):g}"


def required_iterations(needed: float, settings: Settings) -> tuple[int, float]:
    """Return the iterations, and the dt, s, either of which alone raises iterations/h to a required value.

    Args:
        needed: required iterations per second.
        settings: the present settings.
    """
    iterations = math.ceil(needed * settings.h * (1.0 - ROUNDING))
    return iterations, settings.iterations * settings.substeps / needed
