"""Results of the advice for a game as frozen values and as a JSON document."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from sandbox.jsonable import in_json, to_json
from sandbox.measure.advice.forecast import Risk
from sandbox.measure.advice.game_code import GameCode
from sandbox.measure.compare.end_statistics import EndStatistics
from sandbox.measure.compare.metrics import WorstError
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.proportion import Proportion
from sandbox.measure.tradeoff.objective import less_margin
from sandbox.scene.description.world import Settings

FallbackKind = Literal["invariant", "budget", "accuracy", "actions"]
KnobStart = Literal["present", "recommended", "fallback"]


@dataclass(frozen=True)
class MeasuredSetting:
    """Setting of an engine with its error and cost, all measured in this run. Unknown values are None."""

    engine: str
    """name of the engine"""
    settings: Settings
    """settings as the engine resolved them"""
    asked: Settings = field(metadata=in_json(omit=True))
    """settings given to the engine; those that are None are chosen by it"""
    status: str
    """`ok`, `diverged`, `failed`, `refused`, or `stopped` if the run took too long"""
    reason: str | None
    """reason for a status other than `ok`"""
    error: float | None
    """error, in the unit of the metric"""
    error_px: float | None
    """error on the screen, px; None if the metric is no length"""
    invariant: float | None
    """invariant that also holds beyond the predictability horizon, in its unit; None if the advice has none"""
    missed_contacts: float | None
    """contacts that the engine missed"""
    objections: tuple[str, ...] = ()
    """reasons not to recommend the setting although its error may be within the tolerance, as clauses"""
    worst: WorstError | None = None
    """body, time and place of the largest distance from the truth; None without a truth"""
    within_until: float | None = None
    """s, time from which on the error exceeds the tolerance; None if it does not, or if that was not measured"""
    frame_ms: float | None = None
    """computing time of a frame, ms: the median of the timings; of a step, if that is longer than a frame; None if it
    was not timed"""
    ratio: float | None = None
    """cost per simulated second relative to the present setting; None if one of them was not timed"""
    ratio_interval: tuple[float, float] | None = None
    """95 % confidence interval of the ratio, with 5 timings or more"""
    repeats: int = 0
    """number of timings"""


@dataclass(frozen=True)
class Knob:
    """Effect of one change of a setting."""

    change: str
    """the change, such as `substeps 4 → 8`"""
    setting: MeasuredSetting = field(metadata=in_json(inline=True))
    """the changed setting; its `ratio` is relative to the present setting"""
    cost_ratio: float | None
    """cost relative to the setting without the change"""
    error_ratio: float | None
    """error relative to the setting without the change"""
    cost_ratio_interval: tuple[float, float] | None = None
    """95 % confidence interval of the cost ratio, with 5 timings or more"""


@dataclass(frozen=True)
class OtherEngine:
    """Price of another engine."""

    engine: str
    """name of the engine"""
    setting: MeasuredSetting | None
    """cheapest setting within the tolerance, or the most accurate one if there is none; None if it has no setting"""
    is_within_tolerance: bool
    """whether that setting is within the tolerance, less the margin"""
    missing: str | None
    """reason why the engine cannot run the scene; None if it can"""


@dataclass(frozen=True)
class ReplayedActions:
    """Run of a setting with the actions of a recording."""

    setting: str
    """`present`, `recommended`, `fallback`; `rejected`: within the tolerance, but not without fault with the actions;
    or `tried`, where nothing moves without them"""
    label: str
    """the setting in words"""
    status: str
    reason: str | None
    missed_contacts: int | None
    """contacts that the engine missed"""
    over_starts: Proportion | None = None
    """perturbed starts, with the actions up to a frame later, from which it is ok and misses no contact; None if the
    effort allows too few"""
    finer_substeps: int | None = None
    """substeps of a frame in the finer run with the actions, to which this one is compared; None if there was none"""
    departs_at: float | None = None
    """s, time from which on a body is farther than the tolerance of positions from the finer run; None if none is"""
    departed: str | None = None
    """that body"""
    farthest: float | None = None
    """m, largest distance of a body from the finer run"""
    sooner_over_starts: Proportion | None = None
    """of the perturbed starts, those in which it departs from a finer run within less than 80 % of the time of
    the present setting; None for the present one, and if the effort allows too few"""


@dataclass(frozen=True, eq=False)
class Advice:
    """Advice for a game: which dt, how many iterations, which engine."""

    scene: str
    """title of the scene"""
    engine: str
    """name of the present engine"""
    fps: float
    """frames per second of the game"""
    zoom: float
    """px/m, scale of errors on the screen"""
    metric: str
    """name of the metric of the error"""
    metric_about: str
    """description of the metric"""
    metric_reason: str | None
    """reason why errors are no positions; None if they are"""
    unit: str
    """unit of the error; empty for a fraction"""
    tolerance: float
    """largest accepted error, in the unit of the metric"""
    tolerance_px: float | None
    """the same on the screen, px; None if the metric is no length"""
    margin: float
    """fraction of the tolerance that a recommended setting leaves unused"""
    position_tolerance: float
    """m, largest accepted error of a position, also if errors are no positions"""
    budget: float | None
    """ms, computing time per frame that is available; None if not given"""
    invariant: str | None
    """metric that also holds beyond the predictability horizon; None if positions are predictable to the end"""
    invariant_tolerance: float | None
    """largest accepted value of the invariant, in its unit"""
    truth: str | None
    """kind of the truth: `closed_form`, `exact` or `refined`; None if there is none"""
    truth_about: str | None
    """source of the truth, or the reason why there is none"""
    trusted_until: float | None
    """s, time up to which errors count; None without a truth"""
    duration: float
    """s, duration of the scene"""
    left_at: Mapping[str, float]
    """s, time from which on bodies do not count, because they have fallen past everything that could stop them, by
    name"""
    risks: tuple[Risk, ...]
    """forecast for the present setting, the most severe first"""
    notes: tuple[str, ...]
    """facts about the scene that matter for the settings"""
    present: MeasuredSetting
    """the present setting"""
    is_in_loop: bool
    """whether the present dt is that of a frame, so that the game steps once a frame"""
    recommended: MeasuredSetting | None
    """cheapest setting of the present engine within the tolerance"""
    confirmation: FreshStarts | None
    """its errors from fresh starts; None if no other starts confirm it"""
    starts_about: str | None
    """differences of the starts from which it was tried; None if only from that of the scene"""
    fallback: MeasuredSetting | None
    """another setting if the recommended one is missing or over the budget"""
    fallback_kind: FallbackKind | None
    """choice of the fallback: the cheapest that keeps the `invariant`, the most accurate within the `budget`, the most
    accurate of all (`accuracy`), or the cheapest within the tolerance, which misses contacts with the `actions`"""
    ends: EndStatistics | None
    """statistics of the end of the recommended setting, or of a fallback that keeps the `invariant`, over fresh starts;
    None if the truth is trusted to the end, or they are not known"""
    remaining_risks: tuple[Risk, ...]
    """forecast for the recommended setting, or for the fallback without one"""
    knob_start: KnobStart | None
    """choice of the setting that the knobs are changed from: `present`, `recommended` or `fallback`"""
    knob_setting: MeasuredSetting | None
    """that setting"""
    knobs: tuple[Knob, ...]
    """effect of each single change"""
    others: tuple[OtherEngine, ...]
    """the other engines"""
    code: GameCode | None
    """lines for the game that set the recommended setting, or the fallback without one"""
    recorded_actions: int
    """actions of the player in a recording, without which errors, costs and forecast are computed"""
    replays: tuple[ReplayedActions, ...]
    """runs with these actions"""
    is_still_without_actions: bool
    """whether no body of a recording moves farther than the tolerance of positions without its actions"""
    tried: int
    """number of settings that were tried"""
    tried_here: int
    """number of them on the present engine"""
    untried: int
    """number of settings left out because of their cost or the time limit"""
    out_of_time: bool
    """whether the time limit ended the search"""
    interrupted: bool
    """whether Ctrl-C ended the advice; what was measured before is kept"""
    machine: Mapping[str, Any]
    """description of the machine"""
    versions: Mapping[str, str]
    """versions of Python and of the packages used"""

    json_properties: ClassVar = ("title", ("fits_budget", "recommended_fits_budget"))

    def __repr__(self) -> str:
        """Return the scene, the engine and the recommended setting."""
        if self.recommended is None:
            return f"<Advice for {self.scene!r} on {self.engine}: no setting within the tolerance>"
        own = self.recommended.settings
        return f"<Advice for {self.scene!r} on {self.engine}: {own.substeps} substeps, {own.iterations} iterations>"

    @property
    def is_met(self) -> bool:
        """Whether the recommended setting exists and fits the budget, if there is one."""
        return self.recommended is not None and self.fits_budget(self.recommended) is not False

    @property
    def chosen(self) -> MeasuredSetting | None:
        """The recommended setting; without one, the fallback."""
        return self.recommended or self.fallback

    @property
    def is_predictable(self) -> bool:
        """Whether there is a truth that is trusted to the end of the scene."""
        return self.trusted_until is not None and self.trusted_until >= self.duration

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.scene

    @property
    def recommended_fits_budget(self) -> bool | None:
        """Whether a frame of the recommended setting takes at most the budget."""
        return None if self.recommended is None else self.fits_budget(self.recommended)

    def fits_budget(self, setting: MeasuredSetting) -> bool | None:
        """Return whether a frame of a setting takes at most the budget; None without a budget or a timing."""
        if self.budget is None or setting.frame_ms is None:
            return None
        return setting.frame_ms <= self.budget

    def is_within_tolerance(self, setting: MeasuredSetting) -> bool | None:
        """Return whether the error of a setting is within the tolerance; None if the error is unknown."""
        return None if setting.error is None else setting.error <= self.tolerance

    def is_within_margin(self, setting: MeasuredSetting) -> bool:
        """Return whether the error of a setting is known and leaves the margin unused."""
        return setting.error is not None and setting.error <= less_margin(self.tolerance, self.margin)

    def document(self, scene: str | None = None) -> dict[str, Any]:
        """Return the advice as one JSON document.

        Args:
            scene: name of the scene in the document, such as its path; default: its title.
        """
        found: dict[str, Any] = to_json(self)
        return found if scene is None else {**found, "scene": scene}
