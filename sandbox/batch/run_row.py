"""Row of a run: its figures, as tables show them and `run --json` prints them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sandbox.jsonable import in_json
from sandbox.measure.metrics.energy import LedgerDocument


@dataclass(frozen=True)
class FinalBodyState:
    """State of a body at the end of a run."""

    position: tuple[float, ...]
    """(2,) m"""
    velocity: tuple[float, ...]
    """(2,) m/s"""
    angle: float
    """rad"""
    angular_velocity: float
    """rad/s"""
    spin: tuple[float, ...] | None = field(default=None, metadata=in_json(optional=True))
    """(3,) rad/s, about x, y and z; None without a `[surface]`"""


@dataclass(frozen=True)
class GameResult:
    """Result of a game."""

    score: float | None
    """points"""
    over: str | None
    """how the game ended; None if it did not"""
    player: str | None
    """who played"""
    otherwise: float | None
    """of a replay: s, first time at which the rules do something else than recorded; None if there is none"""


@dataclass(frozen=True)
class ReplayResult:
    """Comparison of a replayed session with its recording."""

    replayed: bool | None
    """whether it ended in the recorded state, bit for bit, and score; None if no state was recorded"""


@dataclass(frozen=True)
class RunLedger:
    """Energy ledger of a run."""

    ledger: LedgerDocument | None
    """None if the run has none"""


@dataclass(frozen=True, kw_only=True)
class RunRow:
    """Figures of one run. Picklable: workers return it."""

    id: str
    """hash of scene, engine, settings, seed, versions and actions"""
    scene: str
    """as the user named it"""
    title: str
    engine: str
    settings: Mapping[str, Any]
    """as the engine resolved them"""
    seed: int
    set: Mapping[str, object]
    """values that the command set, by path"""
    status: str
    """ok, diverged, refused or failed"""
    reason: str | None
    """why the status is not ok"""
    seconds: float | None
    """s, computing time of the steps, without compilation"""
    steps: int
    steps_per_second: float | None
    """1/s"""
    work: Mapping[str, int]
    """work counters of the engine"""
    realtime_factor: float | None
    """simulated time divided by computing time"""
    energy_start: float | None
    """J"""
    energy_end: float | None
    """J"""
    joint_error: float | None
    """largest in any recorded frame, relative or in rad; None without joints"""
    broken_joints: int
    contacts: int
    """contacts with an impulse; one that lasts counts once"""
    first_contact: float | None
    """s"""
    missed_contacts: int | None
    """None if they were not counted"""
    retired: Mapping[str, float]
    """s, when each removed body left the scene, by name"""
    pocketed: Mapping[str, str]
    """pocket of each captured ball"""
    state_hash: str | None
    replay: ReplayResult | None = field(metadata=in_json(inline=True))
    """None if the run is not a replay of a session"""
    game: GameResult | None = field(metadata=in_json(inline=True))
    """None if no game was played"""
    account: RunLedger | None = field(metadata=in_json(inline=True))
    """None if the ledger was not asked for"""
    final: Mapping[str, FinalBodyState] | None = field(metadata=in_json(optional=True))
    """state of each body at the end, by name; None if it was not asked for"""
    path: str | None
    """of the stored arrays"""
    repeated: bool
    """whether the run was read from the store"""
    damaged: str | None = field(metadata=in_json(optional=True))
    """file and fault of the damaged stored run that this one replaced"""

    @property
    def score(self) -> float | None:
        """Score of the game; None if none was played or counted."""
        return None if self.game is None else self.game.score
