"""Outcome of one sample: one scenario with one set of parameters on one engine."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Self

from sandbox.jsonable import in_json
from sandbox.measure.proportion import Proportion

Verdict = Literal["exact", "degraded", "refused", "failed"]

VERDICTS: tuple[Verdict, ...] = ("exact", "degraded", "refused", "failed")
MEANINGS: dict[Verdict, str] = {
    "exact": "within 1e-6 of the known solution",
    "degraded": "inaccurate, but no rule is broken",
    "refused": "refused before the run, with a reason",
    "failed": "in more than 5 % of the starts a rule is broken, or the error is useless",
}
PASSED = ("exact", "degraded")


@dataclass(frozen=True)
class Task:
    """Request to a worker process: a scenario with its parameters, on an engine."""

    case: str
    """name of the scenario"""
    parameters: Mapping[str, float]
    """parameters that differ from the scenario's defaults"""
    engine: str
    """name of the engine"""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """changes to the settings of the scene"""
    overrides: tuple[str, ...] = ()
    """`KEY=VALUE`, changes to the scene"""
    start: int = 0
    """number of the start, as in `Starts`, some rotated as a whole (`orientation`); 0: that of the scene"""
    spread: float = 0.0
    """spread of the starts"""

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """Return the task of a JSON document."""
        return cls(**{**document, "overrides": tuple(document["overrides"])})


@dataclass(frozen=True)
class Outcome:
    """Result of a task."""

    verdict: Verdict
    reason: str
    """reason for the verdict"""
    rule: str | None = None
    """name of the first broken rule"""
    error: float | None = None
    """error as a fraction; None if the solution is not known or the run has none"""
    predicted: tuple[str, ...] = ()
    """kinds of the diagnostics of the preflight checks"""
    figures: Mapping[str, float] = field(default_factory=dict)
    """further quantities of the run, by name"""
    solver: Mapping[str, Any] = field(default_factory=dict)
    """settings as the engine resolved them"""
    seconds: float = 0.0
    """s, time of the task; of a level, of all its starts"""
    cost: float | None = None
    """counted cost of the run, s on the machine of the weights (`bounded_run`); None if there was no run"""
    slow: bool = False
    """whether the time limit stopped it: the verdict then depends on the machine"""

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Self:
        """Return the outcome of a JSON document."""
        return cls(**{**document, "predicted": tuple(document["predicted"])})


@dataclass(frozen=True)
class Sample:
    """One level of an axis, or a pair of levels, on one engine configuration."""

    axis: str
    """name of the axis or pair"""
    level: float | tuple[float, float]
    """the level; two of a pair"""
    engine: str
    """name of the engine"""
    settings: Mapping[str, Any]
    """settings of the engine configuration"""
    setup: str
    """name of the engine configuration"""
    outcome: Outcome = field(metadata=in_json(inline=True))
    survived: Proportion | None = None
    """starts in which no rule was broken; None if the engine refused the level, and for pairs, which are run once"""

    @property
    def verdict(self) -> Verdict:
        """Verdict of the outcome."""
        return self.outcome.verdict

    @property
    def rule(self) -> str | None:
        """Name of the first broken rule."""
        return self.outcome.rule

    @property
    def passed(self) -> bool:
        """Whether enough starts broke no rule."""
        return self.verdict in PASSED


@dataclass(frozen=True, kw_only=True)
class PairSample(Sample):
    """Pair of levels on one engine configuration."""

    axes: tuple[str, str]
    """names of the two parameters"""


def survived_tenths(sample: Sample) -> int | None:
    """Return the tenths of the starts that survived at a failed level, rounded down; None if none did."""
    if sample.verdict != "failed" or sample.survived is None or sample.survived.hits == 0:
        return None
    return 10 * sample.survived.hits // sample.survived.trials
