"""Results of a comparison, whose fields are those of its JSON document, and the variants of a sweep."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Self, get_args

from sandbox.echo import short_repr
from sandbox.html_repr import HtmlRepr
from sandbox.jsonable import in_json, to_json
from sandbox.measure.compare.attribution import SettingEffect
from sandbox.measure.compare.contact_matching import ContactMatch, MatchKind
from sandbox.measure.compare.end_statistics import EndStatistics
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.starts import DEFAULT_SPREAD
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
class Score:
    """Errors over all moving bodies and all frames up to `trusted_until`, named as in `METRICS`; None if unknown."""

    max_position: float | None = field(default=None, metadata=in_json(key="max_position_error"))
    """m, largest position error"""
    rms_position: float | None = field(default=None, metadata=in_json(key="rms_position_error"))
    """m, root mean square over frames and bodies"""
    max_velocity: float | None = field(default=None, metadata=in_json(key="max_velocity_error"))
    """m/s, largest velocity error"""
    rms_velocity: float | None = field(default=None, metadata=in_json(key="rms_velocity_error"))
    """m/s, root mean square over frames and bodies"""
    max_angle: float | None = field(default=None, metadata=in_json(key="max_angle_error"))
    """rad, largest error of an angle; whole turns count"""

    @classmethod
    def of(cls, run: Trajectory, context: EvaluationContext) -> Self:
        """Measure a run."""
        return cls(**{each.name: METRICS[each.name].measure(run, context) for each in fields(cls)})


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
    set: Mapping[str, Any] = field(default_factory=dict)
    """swept keys and their values; empty without a sweep"""
    truth: str | None = None
    """kind of the truth that the row is scored against"""
    trusted_until: float | None = None
    """s, time up to which that truth is trusted"""
    is_truth: bool = False
    """whether the run is that truth itself, so that its errors are 0"""
    score: Score = field(default_factory=Score, metadata=in_json(inline=True))
    """errors up to `trusted_until`"""
    energy_drift: float | None = None
    """energy change as a fraction of the largest kinetic energy; see `metrics.invariants.energy_drift`"""
    energy_against: str | None = None
    """reference of the energy drift: `truth` or `start`"""
    momentum_drift: float | None = None
    """unexplained momentum change as a fraction of the largest Σ|m v|; see `metrics.invariants.momentum_drift`"""
    first_divergence: float | None = None
    """s, time of the first frame whose position error exceeds the tolerance; None if there is none"""
    events: tuple[ContactMatch, ...] | None = field(default=None, metadata=in_json(omit=True))
    """contacts of the run matched with those of the truth, up to `trusted_until`"""
    seconds: float | None = None
    """s, computing time of the steps"""
    why: tuple[SettingEffect, ...] = ()
    """effect of other settings on the error"""
    verdict: str | None = None
    """conclusion from `why`, as one sentence"""
    start_errors: FreshStarts | None = None
    """largest position errors from perturbed starts, m; None without them, or if the truth is not trusted to the end"""
    end_statistics: EndStatistics | None = None
    """statistics of the end over perturbed starts; None without them, or if the truth is trusted to the end"""

    json_properties: ClassVar = (
        "matched_contacts",
        "missed_contacts",
        "phantom_contacts",
        "contacts_after_divergence",
        "max_contact_delay",
        ("events", "listed_events"),
        ("missed", "listed_missed"),
        ("phantom", "listed_phantom"),
    )

    @property
    def name(self) -> str:
        """Engine and swept values, such as `reference, integrator rk4`."""
        return f"{self.engine}, {set_text(self.set)}" if self.set else self.engine

    def __repr__(self) -> str:
        """Return engine and status, the largest error and the number of contacts of each kind."""
        error = "unknown" if self.score.max_position is None else f"{self.score.max_position:.3g} m"
        error = "0, the truth" if self.is_truth else error
        counts = ", ".join(f"{kind} {len(self.contacts(kind))}" for kind in get_args(MatchKind))
        return f"<Row {self.name}: {self.status}, max error {error}, contacts: {counts}>"

    def contacts(self, kind: str) -> list[ContactMatch]:
        """Return the contacts of a kind: `matched`, `missed`, `phantom` or `after_divergence`."""
        return [event for event in self.events or () if event.kind == kind]

    def count(self, kind: str) -> int | None:
        """Return the number of contacts of a kind; None if there is no truth."""
        return None if self.events is None else len(self.contacts(kind))

    @property
    def matched_contacts(self) -> int | None:
        """Number of contacts that the truth has too."""
        return self.count("matched")

    @property
    def missed_contacts(self) -> int | None:
        """Number of contacts of the truth alone."""
        return self.count("missed")

    @property
    def phantom_contacts(self) -> int | None:
        """Number of contacts of the run alone."""
        return self.count("phantom")

    @property
    def contacts_after_divergence(self) -> int | None:
        """Number of contacts of either alone, after one of their bodies had diverged."""
        return self.count("after_divergence")

    @property
    def max_contact_delay(self) -> float | None:
        """Largest time difference of matched contacts, s."""
        delays = [abs(each.delta_time) for each in self.contacts("matched") if each.delta_time is not None]
        return max(delays, default=None)

    @property
    def listed_events(self) -> Sequence[ContactMatch]:
        """Contacts that a document lists: the first `MAX_EVENTS`."""
        return (self.events or ())[:MAX_EVENTS]

    @property
    def listed_missed(self) -> Sequence[ContactMatch]:
        """Contacts of the truth alone that a document lists."""
        return self.contacts("missed")[:MAX_EVENTS]

    @property
    def listed_phantom(self) -> Sequence[ContactMatch]:
        """Contacts of the run alone that a document lists."""
        return self.contacts("phantom")[:MAX_EVENTS]


class StudyAgainstTruth(HtmlRepr):
    """Study of a scene whose errors are measured against its truth: `Comparison` and `Tradeoff`."""

    scene: Scene
    best: Truth | None
    """the truth; None if there is none"""
    doubt: str | None
    """reason why there is no truth"""

    @property
    def truth(self) -> str | None:
        """Kind of the truth: `closed_form`, `exact` or `refined`; None if there is none."""
        return None if self.best is None else self.best.kind

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.scene.title

    @property
    def duration(self) -> float:
        """Duration of the scene, s."""
        return self.scene.world.duration

    @property
    def truth_about(self) -> str | None:
        """Source of the truth, or the reason why there is none."""
        return self.doubt if self.best is None else self.best.about

    @property
    def trusted_until(self) -> float | None:
        """Time up to which errors are measured, s; None if there is no truth."""
        return None if self.best is None else self.best.trusted_until


@dataclass(frozen=True, eq=False)
class Comparison(StudyAgainstTruth):
    """Scores of one scene on several engines, or with several values of a setting."""

    scene: Scene = field(metadata=in_json(omit=True))
    """the scene; in a sweep, with its first value"""
    best: Truth | None = field(metadata=in_json(omit=True))
    """truth of `scene`; None if there is none: no engine can run the scene, or two methods disagree"""
    tolerance: float
    """m, position error beyond which a run has diverged"""
    rows: tuple[Row, ...] = field(metadata=in_json(key="engines"))
    """score of each engine and combination of values"""
    trajectories: Mapping[str, Trajectory] = field(metadata=in_json(omit=True))
    """run of each row that has one, by the row's `name`"""
    doubt: str | None = field(default=None, metadata=in_json(omit=True))
    """reason why there is no truth"""
    interrupted: bool = False
    """whether Ctrl-C was pressed before every engine had run"""
    truths: Mapping[str, Truth | None] = field(default_factory=dict, metadata=in_json(omit=True))
    """truth of each row by its `name`, if a sweep changes the scene or the times of its frames; the other rows have
    `best`"""
    same_scene: bool = field(default=True, metadata=in_json(omit=True))
    """whether all rows have the same scene: a sweep changes only its `[solver]`"""
    starts: int = 1
    """number of perturbed starts that were asked for; 1: none"""
    spread: float = DEFAULT_SPREAD
    """largest change of a start, as a fraction (`Starts`)"""
    starts_about: str | None = None
    """perturbed starts that were run, or the reason why there are none; None if none were asked for, or all rows are
    the truth itself"""

    json_head: ClassVar = (
        ("scene", "title"),
        "title",
        "truth",
        "truth_about",
        "truth_confirmed_by",
        "trusted_until",
        "truth_difference",
        "duration",
    )

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
    def truth_confirmed_by(self) -> str | None:
        """Method that confirms the truth."""
        return None if self.best is None else self.best.witness

    @property
    def truth_difference(self) -> float:
        """Distance of a refined truth from the previous halving of dt, m; 0 of the others."""
        return 0.0 if self.best is None else self.best.difference

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
        found: dict[str, Any] = to_json(self)
        return found if scene is None else {**found, "scene": scene}
