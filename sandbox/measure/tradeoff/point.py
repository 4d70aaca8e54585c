"""Point: one setting of one engine, with its error and cost."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sandbox.measure.finite import finite
from sandbox.scene.description.world import Settings


@dataclass(frozen=True)
class Point:
    """Error and cost of one setting of one engine. Unknown values are None."""

    engine: str
    """name of the engine"""
    asked: Settings
    """settings given to the engine; those that are None are chosen by it"""
    settings: Settings
    """settings as the engine resolved them"""
    changes: Mapping[str, Any]
    """differences from the `[solver]` of the scene"""
    status: str
    """`ok`, `diverged`, `failed`, `refused`, or `stopped` if it took too long"""
    reason: str | None
    """reason for a status other than `ok`"""
    metrics: Mapping[str, float | None]
    """every metric by name, in its unit; the worst over the seeds"""
    error: float | None
    """value of the chosen metric; None if the run has none"""
    cost: float | None
    """ms per simulated second: the minimum of separate repeats without recording"""
    cost_median: float | None
    """ms per simulated second: the median of the same repeats"""
    repeats: int
    """number of separate repeats; 0 if another point of the engine is as accurate and much cheaper. The cost is then
    that of the run that gave the error, including recording and audit"""
    counted: float | None
    """ms per simulated second computed from the work counters (`counted_cost`); equal on every machine"""
    is_own: bool
    """whether it is the setting of the scene"""
    work: Mapping[str, int]
    """deterministic counters: substeps, pair tests, contact iterations, events"""

    def __repr__(self) -> str:
        """Return engine, changes and status, error and cost."""
        changes = ", ".join(f"{key} {value}" for key, value in self.changes.items()) or "as the scene has it"
        error = "unknown" if self.error is None else f"{self.error:.3g}"
        cost = "unknown" if self.cost is None else f"{self.cost:.3g} ms per simulated second"
        return f"<Point {self.engine}, {changes}: {self.status}, error {error}, cost {cost}>"

    def document(self) -> dict[str, Any]:
        """Return the point as a JSON object; values that are not finite are null."""
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
        """Whether the status is `ok`, and error and cost are finite."""
        return self.status == "ok" and finite(self.error) is not None and finite(self.cost) is not None

    def frame(self, fps: float) -> float:
        """Return the computing time of the most expensive frame of a game, ms, for a usable point.

        If dt is longer than a frame, that is the time of one step.

        Args:
            fps: frames per second.
        """
        assert self.cost_median is not None
        return self.cost_median * max(1.0 / fps, self.settings.dt)
