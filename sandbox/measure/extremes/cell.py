"""Cell: what came of one scene at one level on one engine."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, Self

Word = Literal["exact", "degraded", "refused", "failed"]

WORDS: tuple[Word, ...] = ("exact", "degraded", "refused", "failed")
MEANINGS: dict[Word, str] = {
    "exact": "within 1e-6 of the known solution",
    "degraded": "inaccurate, but no rule is broken",
    "refused": "refused before the run, with a reason",
    "failed": "a rule is broken, or the error is too large to be useful",
}
PASSED = ("exact", "degraded")


@dataclass(frozen=True)
class Task:
    """What a worker is asked: which case, with which parameters, on what."""

    case: str
    parameters: Mapping[str, float]
    engine: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    """to the scene's settings"""
    overrides: tuple[str, ...] = ()
    """`KEY=VALUE`, of the scene"""

    def document(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return asdict(self)

    @classmethod
    def read(cls, document: Mapping[str, Any]) -> Self:
        """Read what `document` wrote."""
        return cls(**{**document, "overrides": tuple(document["overrides"])})


@dataclass(frozen=True)
class Outcome:
    """What a worker answers, or what is said in place of one that died."""

    verdict: Word
    reason: str
    rule: str | None = None
    """the first that was broken"""
    error: float | None = None
    """share by which it was off what is known; None where nothing is, or it cannot be told"""
    predicted: tuple[str, ...] = ()
    """kinds of what was warned of"""
    figures: Mapping[str, float] = field(default_factory=dict)
    solver: Mapping[str, Any] = field(default_factory=dict)
    """the settings in full, as the engine resolved them"""
    seconds: float = 0.0
    slow: bool = False
    """whether it was stopped as it took too long: then the verdict is the machine's too"""

    @classmethod
    def read(cls, document: Mapping[str, Any]) -> Self:
        """Read one from JSON."""
        return cls(**{**document, "predicted": tuple(document["predicted"])})


@dataclass(frozen=True)
class Cell:
    """One cell of the matrix."""

    axis: str
    level: float | tuple[float, float]
    """two of a pair"""
    engine: str
    setup: str
    settings: Mapping[str, Any]
    """what the setup says beside the scene"""
    outcome: Outcome

    @property
    def verdict(self) -> Word:
        """How it went."""
        return self.outcome.verdict

    @property
    def rule(self) -> str | None:
        """The rule that was broken first."""
        return self.outcome.rule

    @property
    def passed(self) -> bool:
        """Whether it ran and broke no rule."""
        return self.verdict in PASSED

    def document(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        told = asdict(self.outcome)
        return {
            "axis": self.axis,
            "level": list(self.level) if isinstance(self.level, tuple) else self.level,
            "engine": self.engine,
            "settings": dict(self.settings),
            "setup": self.setup,
            **told,
        }
