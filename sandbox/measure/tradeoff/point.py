"""Point: one setting of one engine, with its error and its cost."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sandbox.measure.finite import finite
from sandbox.scene.settings import Settings


@dataclass(frozen=True)
class Point:
    """What one setting costs, and what it buys. What is unknown is None."""

    engine: str
    asked: Settings
    """what the engine was given; what is None there was left to it"""
    settings: Settings
    """as the engine filled them in"""
    changes: Mapping[str, Any]
    """what differs from the scene's own `[solver]`"""
    status: str
    """`ok`, `diverged`, `failed`, `refused`, or `stopped` where it took too long"""
    reason: str | None
    """why it is not `ok`"""
    metrics: Mapping[str, float | None]
    """every metric by name, in its unit; over several seeds the worst"""
    error: float | None
    """of the metric that was asked for; None where the run gives none"""
    cost: float | None
    """ms per simulated second: the least of separate repeats, nothing recorded"""
    cost_median: float | None
    repeats: int
    """0 where another point of its engine is as right and by far cheaper: the cost is then of the run that gave the
    error, with its frames kept and audited"""
    counted: float | None
    """ms per simulated second by the counters of the run (`counted_cost`): the same on every machine"""
    is_own: bool
    """whether it is the scene's own setting"""
    work: Mapping[str, int]
    """deterministic counters: substeps, pair tests, contact iterations, events"""

    def document(self) -> dict[str, Any]:
        """Return it as a JSON object; figures that are not finite are null."""
        return {
            "engine": self.engine,
            "settings": self.settings.model_dump(mode="json"),
            "changes": dict(self.changes),
            "error": finite(self.error),
            "cost_ms_per_second": finite(self.cost),
            "cost_median_ms_per_second": finite(self.cost_median),
            "repeats": self.repeats,
            "counted_cost_ms_per_second": finite(self.counted),
            "scene_setting": self.is_own,
            "status": self.status,
            "reason": self.reason,
            "metrics": {name: finite(value) for name, value in self.metrics.items()},
            "work": dict(self.work),
        }

    @property
    def usable(self) -> bool:
        """Whether it has both figures, and these are finite, so that it can be weighed."""
        return self.status == "ok" and finite(self.error) is not None and finite(self.cost) is not None

    def frame(self, fps: float) -> float:
        """Return what the dearest frame of a game takes, ms: one step where dt is longer than a frame. It is usable."""
        assert self.cost_median is not None
        return self.cost_median * max(1.0 / fps, self.settings.dt)
