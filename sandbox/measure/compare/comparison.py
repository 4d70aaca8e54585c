"""Comparison: scores of engines against the truth, as frozen values and as a JSON document."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

from sandbox.echo import short_repr
from sandbox.html_repr import HtmlRepr
from sandbox.measure.compare.alignment import Event, Kind
from sandbox.measure.compare.errors import Score
from sandbox.measure.compare.sweep import set_text
from sandbox.measure.compare.truth import Truth
from sandbox.measure.compare.why import Knob
from sandbox.measure.finite import finite
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

MAX_SHOWN = 4
"""Rows in the representation of a comparison."""
MOST_EVENTS = 100
"""Told of each engine in a document."""


@dataclass(frozen=True)
class Row:
    """Score of one engine. Unknown values are None."""

    engine: str
    """name of the engine"""
    status: str
    """`ok`, `diverged`, `failed` or `refused`"""
    reason: str | None
    """reason for a status other than `ok`"""
    settings: Mapping[str, Any]
    """settings as the engine resolved them"""
    score: Score
    """errors up to `trusted_until`"""
    energy_drift: float | None
    """energy change as a fraction of the largest kinetic energy; see `drift.energy_drift`"""
    energy_against: str | None
    """reference of the energy drift: `truth` or `start`"""
    momentum_drift: float | None
    """unexplained momentum change as a fraction of the largest Σ|m v|; see `drift.momentum_drift`"""
    first_divergence: float | None
    """s, time of the first frame whose position error exceeds the tolerance; None if there is none"""
    events: tuple[Event, ...] | None
    """contacts of the run matched with those of the truth, up to `trusted_until`"""
    seconds: float | None
    """s, computing time of the steps"""
    why: tuple[Knob, ...] = ()
    """effect of other settings on the error"""
    verdict: str | None = None
    """conclusion from `why`, as one sentence"""
    set: Mapping[str, Any] = field(default_factory=dict)
    """swept keys and their values; empty without a sweep"""

    @property
    def name(self) -> str:
        """Engine and swept values, such as `reference, integrator rk4`."""
        return f"{self.engine}, {set_text(self.set)}" if self.set else self.engine

    def __repr__(self) -> str:
        """Return engine and status, the largest error and the number of contacts of each kind."""
        error = "unknown" if self.score.max_position is None else f"{self.score.max_position:.3g} m"
        counts = ", ".join(f"{kind} {sum(e.kind == kind for e in self.events or ())}" for kind in get_args(Kind))
        return f"<Row {self.name}: {self.status}, max error {error}, contacts: {counts}>"

    def count(self, kind: str) -> int | None:
        """Return the number of contacts of a kind; None if there is no truth.

        Args:
            kind: `matched`, `missed`, `phantom` or `after_divergence`.
        """
        return None if self.events is None else sum(event.kind == kind for event in self.events)

    def document(self, trusted_until: float | None) -> dict[str, Any]:
        """Return the row as a JSON object; values that are not finite are null.

        Args:
            trusted_until: time up to which the truth is trusted, s.
        """
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
            "set": dict(self.set),
            **{key: finite(value) for key, value in figures.items()},
            "energy_against": self.energy_against,
            "events": [_event(event) for event in events[:MOST_EVENTS]],
            "missed": [_event(e) for e in [e for e in events if e.kind == "missed"][:MOST_EVENTS]],
            "phantom": [_event(e) for e in [e for e in events if e.kind == "phantom"][:MOST_EVENTS]],
            "why": [knob.document() for knob in self.why],
            "verdict": self.verdict,
        }


@dataclass(frozen=True, eq=False)
class Comparison(HtmlRepr):
    """Scores of one scene on several engines, or with several values of a setting."""

    scene: Scene
    """the scene; in a sweep, with its first value"""
    best: Truth | None
    """truth of `scene`; None if there is none: no engine can run the scene, or two methods disagree"""
    tolerance: float
    """m, position error beyond which a run has diverged"""
    rows: tuple[Row, ...]
    """score of each engine and combination of values"""
    trajectories: Mapping[str, Trajectory]
    """run of each row that has one, by the row's `name`"""
    doubt: str | None = None
    """reason why there is no truth"""
    interrupted: bool = False
    """whether Ctrl-C was pressed before every engine had run"""
    truths: Mapping[str, Truth | None] = field(default_factory=dict)
    """truth of each row by its `name`, if a sweep changes the scene or the times of its frames; the other rows have
    `best`"""
    same_scene: bool = True
    """whether all rows have the same scene: a sweep changes only its `[solver]`"""

    def truth_of(self, name: str) -> Truth | None:
        """Return the truth that a row is scored against.

        Args:
            name: `name` of the row.
        """
        return self.truths.get(name, self.best)

    def __repr__(self) -> str:
        """Return the title, the truth, and the largest errors of the first rows."""
        head = f"<Comparison {short_repr(self.scene.title)}: truth {self.truth or 'unknown'}"
        if self.best is not None:
            head += f", trusted until {self.best.trusted_until:.4g} s of {self.scene.world.duration:.4g} s"
        lines = [f"{head}; tolerance {self.tolerance:.2g} m"]
        for row in self.rows[:MAX_SHOWN]:
            error = row.score.max_position
            lines.append(f"{row.name}: {row.status}" + ("" if error is None else f", max error {error:.3g} m"))
        if len(self.rows) > MAX_SHOWN:
            lines[-1] += f"; and {len(self.rows) - MAX_SHOWN:,} more rows"
        return "\n  ".join(lines) + ">"

    @property
    def truth(self) -> str | None:
        """Kind of the truth: `closed_form`, `exact` or `refined`; None if there is none."""
        return None if self.best is None else self.best.kind

    @property
    def trusted_until(self) -> float | None:
        """Time up to which errors are measured, s; None if there is no truth."""
        return None if self.best is None else self.best.trusted_until

    def sentence(self) -> str:
        """Return a sentence with the kind and source of the truth, its end and the tolerance."""
        if self.best is None:
            return f"truth: none ({self.doubt})"
        whole = self.scene.world.duration
        name = self.best.kind.replace("_", " ")
        until = f"trusted until {self.best.trusted_until:.4g} s of {whole:.4g} s"
        if self.best.difference:
            until += f"; accurate to about {self.best.difference:.1g} m"
        others = "" if self.same_scene else "; the truth of the first value: the sweep changes the scene"
        return f"truth: {name} ({self.best.about}); {until}; tolerance {self.tolerance:.2g} m{others}"

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the comparison as one JSON document.

        Args:
            scene: name of the scene in the document, such as its path; default: its title.
        """
        return {
            "scene": self.scene.title if scene is None else scene,
            "title": self.scene.title,
            "truth": self.truth,
            "truth_about": self.doubt if self.best is None else self.best.about,
            "truth_confirmed_by": None if self.best is None else self.best.witness,
            "trusted_until": self.trusted_until,
            "truth_difference": 0.0 if self.best is None else self.best.difference,
            "duration": self.scene.world.duration,
            "tolerance": self.tolerance,
            "engines": [self._row_document(row) for row in self.rows],
            "interrupted": self.interrupted,
        }

    def _row_document(self, row: Row) -> dict[str, Any]:
        best = self.truth_of(row.name)
        document = row.document(None if best is None else best.trusted_until)
        return {**document, "truth": None if best is None else best.kind} if row.set else document


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
