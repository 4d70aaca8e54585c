"""Comparison: what came of holding engines against the truth, as frozen values and as a JSON document."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from sandbox.measure.compare.alignment import Event, Kind
from sandbox.measure.compare.errors import Score
from sandbox.measure.compare.truth import Truth
from sandbox.measure.compare.why import Knob
from sandbox.measure.finite import finite
from sandbox.scene.model import Scene
from sandbox.trajectory import Trajectory

MOST_EVENTS = 100
"""Told of each engine in a document."""


@dataclass(frozen=True)
class Row:
    """One engine, scored. What is unknown is None."""

    engine: str
    status: str
    """`ok`, `diverged`, `failed` or `refused`"""
    reason: str | None
    """why it is not `ok`"""
    settings: Mapping[str, Any]
    score: Score
    """errors up to `trusted_until`"""
    energy_drift: float | None
    """a share; see `drift.energy_drift`"""
    energy_against: str | None
    """`truth` or `start`"""
    momentum_drift: float | None
    """a share; see `drift.momentum_drift`"""
    first_divergence: float | None
    """s, of the first frame whose position error exceeds the tolerance; None where none does"""
    events: tuple[Event, ...] | None
    """contacts beside the truth's, up to `trusted_until`"""
    seconds: float | None
    """s, of the steps alone"""
    why: tuple[Knob, ...] = ()
    """what other settings do to the error"""
    verdict: str | None = None
    """the sentence that follows from it"""

    def __repr__(self) -> str:
        """Name engine and status, the largest error and how many contacts there are of each kind."""
        error = "unknown" if self.score.max_position is None else f"{self.score.max_position:.3g} m"
        counts = ", ".join(f"{kind} {sum(e.kind == kind for e in self.events or ())}" for kind in get_args(Kind))
        return f"<Row {self.engine}: {self.status}, max error {error}, contacts: {counts}>"

    def count(self, kind: str) -> int | None:
        """Return how many contacts were `matched`, `missed`, `phantom` or `after_divergence`."""
        return None if self.events is None else sum(event.kind == kind for event in self.events)

    def document(self, trusted_until: float | None) -> dict[str, Any]:
        """Return the row as a JSON object; figures that are not finite are null."""
        events = self.events or ()
        pairs = [e for e in events if e.kind == "matched"]
        figures = {
            "max_position_error": self.score.max_position,
            "rms_position_error": self.score.rms_position,
            "max_velocity_error": self.score.max_velocity,
            "rms_velocity_error": self.score.rms_velocity,
            "energy_drift": self.energy_drift,
            "momentum_drift": self.momentum_drift,
            "first_divergence": self.first_divergence,
            "matched_contacts": self.count("matched"),
            "missed_contacts": self.count("missed"),
            "phantom_contacts": self.count("phantom"),
            "contacts_after_divergence": self.count("after_divergence"),
            "max_contact_delay": max((abs(e.delta_time) for e in pairs if e.delta_time is not None), default=None),
            "trusted_until": trusted_until,
            "seconds": self.seconds,
        }
        return {
            "engine": self.engine,
            "status": self.status,
            "reason": self.reason,
            "settings": dict(self.settings),
            **{key: finite(value) for key, value in figures.items()},
            "energy_against": self.energy_against,
            "events": [_event(event) for event in events[:MOST_EVENTS]],
            "missed": [_event(e) for e in [e for e in events if e.kind == "missed"][:MOST_EVENTS]],
            "phantom": [_event(e) for e in [e for e in events if e.kind == "phantom"][:MOST_EVENTS]],
            "why": [knob.document() for knob in self.why],
            "verdict": self.verdict,
        }


@dataclass(frozen=True, eq=False)
class Comparison:
    """One scene on several engines."""

    scene: Scene
    best: Truth | None
    """None where nothing is known: no engine can run the scene, or two methods contradict each other"""
    tolerance: float
    """m"""
    rows: tuple[Row, ...]
    trajectories: Mapping[str, Trajectory]
    """the run of each engine that has one"""
    doubt: str | None = None
    """why there is no truth"""

    def __repr__(self) -> str:
        """Name the scene and the truth, and the largest error of each engine."""
        off = (
            f"{row.engine} {row.status}"
            if row.score.max_position is None
            else f"{row.engine} {row.score.max_position:.3g} m"
            for row in self.rows
        )
        return f"<Comparison {self.scene.title!r}: {self.sentence()}; max error: {', '.join(off)}>"

    @property
    def truth(self) -> str | None:
        """`closed_form`, `exact` or `refined`."""
        return None if self.best is None else self.best.kind

    @property
    def trusted_until(self) -> float | None:
        """Up to when errors count, s."""
        return None if self.best is None else self.best.trusted_until

    def sentence(self) -> str:
        """Say what the truth is, and how far it goes."""
        if self.best is None:
            return f"truth: none: {self.doubt}"
        whole = self.scene.world.duration
        name = self.best.kind.replace("_", " ")
        until = f"trusted until {self.best.trusted_until:.4g} s of {whole:.4g} s"
        return f"truth: {name} ({self.best.about}); {until}; tolerance {self.tolerance:.2g} m"

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the comparison as one JSON document.

        Args:
            scene: what the scene is called in it, such as its path; else its title.
        """
        return {
            "scene": self.scene.title if scene is None else scene,
            "title": self.scene.title,
            "truth": self.truth,
            "truth_about": self.doubt if self.best is None else self.best.about,
            "truth_confirmed_by": None if self.best is None else self.best.witness,
            "trusted_until": self.trusted_until,
            "duration": self.scene.world.duration,
            "tolerance": self.tolerance,
            "engines": [row.document(self.trusted_until) for row in self.rows],
        }


def _event(event: Event) -> dict[str, Any]:
    return {
        "kind": event.kind,
        "between": list(event.between),
        "time": event.time,
        "engine_time": event.engine_time,
        "delta_time": event.delta_time,
        "delta_position": finite(event.delta_position),
        "delta_impulse": finite(event.delta_impulse),
        "lasting": event.lasting,
    }
