"""Results of the advice for a game as frozen values and as a JSON document."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from sandbox.jsonable import in_json, to_json
from sandbox.measure.game_advice.difference import CallbackDifference
from sandbox.measure.game_advice.step_code import StepCode
from sandbox.measure.proportion import Proportion


@dataclass(frozen=True)
class GameSetting:
    """Setting of a game with its error and cost, both measured. Unknown values are None."""

    substeps: int
    iterations: int
    changed: Mapping[str, float]
    """settings that differ from those of the game, by name"""
    error_px: float | None
    """px, largest distance of a body from the truth as long as it is known; None if the run failed"""
    body: str | None
    """that body"""
    time: float | None
    """s since the start at which it is there"""
    within_until: float | None
    """s, time from which on the error exceeds the tolerance; None if it does not"""
    callbacks: tuple[CallbackDifference, ...]
    """contacts for which callbacks are called, compared with the truth"""
    physics_ms: float
    """ms, time of `Space.step` in a frame, with the callbacks"""
    failure: str | None = None
    """why the game failed with this setting; None if it did not"""
    frames: int = 0
    """frames until the game ended"""
    is_within: bool = False
    """whether the error is within the tolerance, no contact is missed, late or extra, and the game ends as the truth
    does"""
    errors_px: tuple[float, ...] = field(default=(), metadata=in_json(omit=True))
    """px, largest distance of a body from the truth in each frame, as long as it is known"""

    @property
    def differing(self) -> int:
        """Number of contacts that are missed, late, early or extra."""
        return sum(each.missed + each.late + each.extra for each in self.callbacks)


@dataclass(frozen=True)
class GameSettingChange:
    """Effect of one change of the setting of the game."""

    change: str
    """such as `substeps 1 → 2`"""
    setting: GameSetting = field(metadata=in_json(inline=True))


@dataclass(frozen=True)
class PlaysHeld:
    """How a setting does in plays that differ a little from the recorded one."""

    present: Proportion
    """plays in which the present setting is within the tolerance"""
    chosen: Proportion | None
    """plays in which the recommended setting is, or without one the most accurate; None if no setting is within it"""
    displacement: float
    """largest displacement of the bodies at the start, in units of the game"""


@dataclass(frozen=True, eq=False)
class GameAdvice:
    """Advice for a game: how many substeps and iterations its physics needs."""

    program: str
    """as the user named it"""
    frames: int
    """recorded frames"""
    duration: float
    """s, time of the recorded session"""
    bodies: int
    """largest number of bodies in a frame"""
    tolerance_px: float
    """px, accepted error"""
    zoom: float
    """px per unit of length of the game"""
    dts: tuple[float, float, float]
    """s, least, median and largest step of the game"""
    truth_frames: int
    """frames of the truth until the game ended"""
    truth_substeps: int
    """substeps of the run that is taken for the truth"""
    truth_error_px: float
    """px, distance of the truth from the run with half its substeps, as long as it is known"""
    known_fraction: float
    """fraction of the positions of all bodies in all frames that are known"""
    unknown_from: Mapping[str, float]
    """s, time from which on the position of a body is not known to the end, by name"""
    present: GameSetting
    recommended: GameSetting | None
    """cheapest setting within the tolerance; None if none was found"""
    most_accurate: GameSetting | None
    """without a recommended setting: the one that keeps to the tolerance in most of the plays that differ a little, or
    has the fewest differing contacts and the smallest error"""
    changes: tuple[GameSettingChange, ...]
    """effect of each single change of the present setting"""
    plays: PlaysHeld
    """odds over plays that differ a little"""
    code: StepCode | None
    """lines of the game to change; None if there is nothing to change"""
    remarks: tuple[str, ...]
    """what else matters for the setting"""
    tried: int
    """number of settings that were tried"""
    runs: int
    """number of runs of the game"""
    seconds: float
    """s, time of the advice"""
    out_of_time: bool
    """whether the time limit ended the search for settings or the plays"""
    machine: Mapping[str, Any]
    """description of the machine"""
    versions: Mapping[str, str]
    """versions of Python and of the packages used"""

    json_properties: ClassVar = ("is_met",)

    @property
    def is_met(self) -> bool:
        """Whether a setting is within the tolerance."""
        return self.recommended is not None

    @property
    def chosen(self) -> GameSetting | None:
        """The recommended setting; without one, the most accurate."""
        return self.recommended or self.most_accurate

    def document(self) -> dict[str, Any]:
        """Return the advice as one JSON document."""
        document: dict[str, Any] = to_json(self)
        return document
