"""Results of a comparison as frozen values and as a JSON document, and the variants of a sweep."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, get_args

from sandbox.echo import short_repr
from sandbox.html_repr import HtmlRepr
from sandbox.jsonable import to_json
from sandbox.measure.compare.attribution import SettingEffect
from sandbox.measure.compare.contact_matching import ContactMatch, MatchKind
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.metrics.trajectory_error import Score
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_session
from sandbox.scene.files.overrides import combinations
from sandbox.trajectory import Trajectory

Sweep = Mapping[str, Sequence[Any]]
"""Values by key, such as `{"solver.integrator": ["explicit_euler", "rk4"]}`; several keys give each combination."""


@dataclass(frozen=True, eq=False)
class Variant:
    """Scene with one combination of swept values."""

    scene: Scene
    set: Mapping[str, Any] = field(default_factory=dict)
    """swept keys and their values in this variant"""


def variants_of(scene: Scene, sweep: Sweep) -> list[Variant]:
    """Return a scene with each combination of swept values, the last key changing fastest.

    Raises:
        ValueError: a key has no values, or there are too many combinations.
        SceneError: a key or a value is wrong.
    """
    for key, values in sweep.items():
        if isinstance(values, str) or not len(values):
            raise ValueError(f"sweep: {key} needs a sequence of values, such as [0.01, 0.001]")
    document = to_document(scene)
    points = combinations([(key, list(values)) for key, values in sweep.items()])
    return [Variant(from_session(document, "sweep", list(point)), dict(point)) for point in points]


def set_text(chosen: Mapping[str, Any]) -> str:
    """Return swept values as one line: `integrator rk4, dt 0.01`."""
    return ", ".join(f"{short_key(key)} {value_text(value)}" for key, value in chosen.items())


def short_key(key: str) -> str:
    """Return a key as a column heading: a setting without `solver.`."""
    return key.removeprefix("solver.")


def value_text(value: Any) -> str:
    """Return a value as text: a string without quotes, a number to 9 digits."""
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return f"{value:.9g}"
    return json.dumps(value, default=str)


def physics_of(scene: Scene) -> str:
    """Return a scene without its `[solver]` as text: scenes with the same text have the same truth."""
    return json.dumps({**to_document(scene), "solver": None}, sort_keys=True, default=str)


def truth_settings(own: Settings, all_settings: Sequence[Settings]) -> Settings:
    """Return the settings with which the truth of a variant is computed.

    The times of the frames are those of the variant. Iterations and substeps, which make a refined truth better, are
    the largest of all variants, so that the truth does not depend on the variant.
    """
    return own.replace(
        iterations=max(each.iterations for each in all_settings),
        substeps=max(each.substeps for each in all_settings),
    )


MAX_SHOWN = 4
"""Rows in the representation of a comparison."""
MAX_EVENTS = 100
"""Contacts of each kind and engine in a document."""


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
    score: Score = field(default_factory=Score)
    """errors up to `trusted_until`"""
    energy_drift: float | None = None
    """energy change as a fraction of the largest kinetic energy; see `metrics.invariants.energy_drift`"""
    energy_against: str | None = None
    """reference of the energy drift: `truth` or `start`"""
    momentum_drift: float | None = None
    """unexplained momentum change as a fraction of the largest Σ|m v|; see `metrics.invariants.momentum_drift`"""
    first_divergence: float | None = None
    """s, time of the first frame whose position error exceeds the tolerance; None if there is none"""
    events: tuple[ContactMatch, ...] | None = None
    """contacts of the run matched with those of the truth, up to `trusted_until`"""
    seconds: float | None = None
    """s, computing time of the steps"""
    why: tuple[SettingEffect, ...] = ()
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
        counts = ", ".join(f"{kind} {sum(e.kind == kind for e in self.events or ())}" for kind in get_args(MatchKind))
        return f"<Row {self.name}: {self.status}, max error {error}, contacts: {counts}>"

    def count(self, kind: str) -> int | None:
        """Return the number of contacts of a kind; None if there is no truth.

        Args:
            kind: `matched`, `missed`, `phantom` or `after_divergence`.
        """
        return None if self.events is None else sum(event.kind == kind for event in self.events)

    def document(self, truth: Truth | None) -> "RowDocument":
        """Return the row as it appears in the JSON document.

        Args:
            truth: truth that the row is scored against.
        """
        events = self.events or ()
        by_kind = {kind: [event for event in events if event.kind == kind] for kind in get_args(MatchKind)}
        delays = [abs(event.delta_time) for event in by_kind["matched"] if event.delta_time is not None]
        document = RowDocument(
            engine=self.engine,
            status=self.status,
            reason=self.reason,
            settings=self.settings,
            set=self.set,
            max_position_error=self.score.max_position,
            rms_position_error=self.score.rms_position,
            max_velocity_error=self.score.max_velocity,
            rms_velocity_error=self.score.rms_velocity,
            energy_drift=self.energy_drift,
            momentum_drift=self.momentum_drift,
            first_divergence=self.first_divergence,
            matched_contacts=self.count("matched"),
            missed_contacts=self.count("missed"),
            phantom_contacts=self.count("phantom"),
            contacts_after_divergence=self.count("after_divergence"),
            max_contact_delay=max(delays, default=None),
            trusted_until=None if truth is None else truth.trusted_until,
            seconds=self.seconds,
            energy_against=self.energy_against,
            events=events[:MAX_EVENTS],
            missed=by_kind["missed"][:MAX_EVENTS],
            phantom=by_kind["phantom"][:MAX_EVENTS],
            why=self.why,
            verdict=self.verdict,
        )
        if not self.set:
            return document
        return SweptRowDocument(**vars(document), truth=None if truth is None else truth.kind)


@dataclass(frozen=True)
class RowDocument:
    """JSON document of a row; the fields are those of `Row` and `Score`."""

    engine: str
    status: str
    reason: str | None
    settings: Mapping[str, Any]
    set: Mapping[str, Any]
    max_position_error: float | None
    rms_position_error: float | None
    max_velocity_error: float | None
    rms_velocity_error: float | None
    energy_drift: float | None
    momentum_drift: float | None
    first_divergence: float | None
    matched_contacts: int | None
    missed_contacts: int | None
    phantom_contacts: int | None
    contacts_after_divergence: int | None
    max_contact_delay: float | None
    trusted_until: float | None
    seconds: float | None
    energy_against: str | None
    events: Sequence[ContactMatch]
    missed: Sequence[ContactMatch]
    phantom: Sequence[ContactMatch]
    why: Sequence[SettingEffect]
    verdict: str | None


@dataclass(frozen=True)
class SweptRowDocument(RowDocument):
    """JSON document of a row of a sweep, with the kind of its own truth."""

    truth: str | None


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
        others = (
            "" if self.same_scene else "; this is the truth of the first value, because the sweep changes the scene"
        )
        return f"truth: {name} ({self.best.about}); {until}; tolerance {self.tolerance:.2g} m{others}"

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the comparison as one JSON document.

        Args:
            scene: name of the scene in the document, such as its path; default: its title.
        """
        found: dict[str, Any] = to_json(
            ComparisonDocument(
                scene=self.scene.title if scene is None else scene,
                title=self.scene.title,
                truth=self.truth,
                truth_about=self.doubt if self.best is None else self.best.about,
                truth_confirmed_by=None if self.best is None else self.best.witness,
                trusted_until=self.trusted_until,
                truth_difference=0.0 if self.best is None else self.best.difference,
                duration=self.scene.world.duration,
                tolerance=self.tolerance,
                engines=[row.document(self.truth_of(row.name)) for row in self.rows],
                interrupted=self.interrupted,
            )
        )
        return found


@dataclass(frozen=True)
class ComparisonDocument:
    """JSON document of a comparison."""

    scene: str
    title: str
    truth: str | None
    truth_about: str | None
    truth_confirmed_by: str | None
    trusted_until: float | None
    truth_difference: float
    duration: float
    tolerance: float
    engines: Sequence[RowDocument | SweptRowDocument]
    interrupted: bool
