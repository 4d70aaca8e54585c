"""Row of a run: its figures, as tables show them and `run --json` prints them.

A row is made from the row of the store, so that a run that was just computed and one that was stored long ago look
the same. What has no column is in `details`, a JSON object: see `details_of`.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.batch.observables import observed_values
from sandbox.batch.stored_run import StoredRun
from sandbox.jsonable import finite, in_json, to_json
from sandbox.measure.metrics.energy import LedgerDocument, ledger_of
from sandbox.provenance import machine
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory


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
    warnings: Sequence[str]
    """what to know about a run that is ok"""
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
    worst_joint: Mapping[str, Any] | None
    """its joint: name, error (None if infinite), unit of the error; None without joints"""
    broken_joints: int
    contacts: int | None
    """contacts with an impulse; one that lasts counts once; None if they were not counted"""
    first_contact: float | None
    """s; None without contacts, or if they were not counted"""
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
    observed: Mapping[str, float | int | str | None] | None = field(metadata=in_json(optional=True))
    """values of the functions of `--observe`, by name; None if there was none"""
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

    @classmethod
    def of(
        cls,
        stored: StoredRun,
        *,
        label: str,
        values: Mapping[str, Any],
        path: str | None,
        final: bool = True,
        ledger: bool = False,
        replay: ReplayResult | None = None,
        repeated: bool = False,
        damaged: str | None = None,
    ) -> Self:
        """Return the figures of a run.

        Args:
            stored: its row in a store, with details.
            label: the scene as the user named it.
            values: values that the command set, by path.
            path: of the stored arrays.
            final: include the final state.
            ledger: include the energy ledger.
            replay: comparison with the recording, of a replay.
            repeated: whether it was read from a store.
            damaged: file and fault of the stored run that it replaced.
        """
        details = json.loads(stored.details or "{}")
        seconds, simulated = stored.seconds, details.get("simulated", 0.0)
        game, settings = details.get("game"), json.loads(stored.settings)
        return cls(
            id=stored.id,
            scene=label,
            title=stored.scene_title,
            engine=stored.engine,
            settings={key: settings[key] for key in Settings.model_fields if key in settings},
            seed=stored.seed,
            set=values,
            status=stored.status,
            reason=stored.reason,
            warnings=details.get("warnings", []),
            seconds=finite(seconds),
            steps=stored.steps,
            steps_per_second=finite(stored.steps / seconds if seconds else None),
            work=json.loads(stored.work or "{}"),
            realtime_factor=finite(simulated / seconds if seconds else None),
            energy_start=finite(stored.energy_start),
            energy_end=finite(stored.energy_end),
            joint_error=finite(stored.joint_error),
            worst_joint=details.get("worst_joint"),
            broken_joints=stored.broken_joints or 0,
            contacts=stored.contacts,
            first_contact=stored.first_contact,
            missed_contacts=stored.missed_contacts,
            retired=details.get("retired", {}),
            pocketed=details.get("pocketed", {}),
            state_hash=stored.state_hash,
            replay=replay,
            game=None if game is None else GameResult(**game),
            account=RunLedger(_ledger(details.get("ledger"))) if ledger else None,
            final={name: _final_state(state) for name, state in details.get("final", {}).items()} if final else None,
            observed=observed_values(details),
            path=path,
            repeated=repeated,
            damaged=damaged,
        )


GAME = ("score", "over", "player", "otherwise")
"""Keys of `info["game"]` in a stored run, in the order of the fields of `GameResult`."""


def details_of(run: Trajectory, scene: Scene, has_game: bool) -> dict[str, Any]:
    """Return the results of a run that have no column, as JSON holds them.

    Args:
        run: the run.
        scene: its scene.
        has_game: whether a game was played.
    """
    game = run.info.get("game") or {}
    retired = zip(run.names.tolist(), run.retired_time.tolist(), strict=True)
    return {
        "simulated": float(run.time[-1]) if len(run.time) else 0.0,
        "audited": bool(run.info["audited"]),
        "warnings": list(run.warnings),
        "worst_joint": to_json(run.info.get("worst_joint")),
        "retired": {name: time for name, time in retired if time == time},
        "pocketed": _pocketed(run, scene),
        "game": {key: game.get(key) for key in GAME} if has_game else None,
        "ledger": to_json(ledger_of(run, scene).document()) if len(run.energy) else None,
        "final": _final_states(run),
        "cpu": machine()["cpu"],
    }


def _final_states(run: Trajectory) -> dict[str, dict[str, Any]]:
    """Return the last state of each body by name; empty if nothing was recorded."""
    if not len(run.time):
        return {}
    names = ["position", "velocity", "angle", "angular_velocity", *(["spin"] if len(run.spin) else [])]
    return state_documents(run.names.tolist(), {name: getattr(run, name)[-1] for name in names})


def state_documents(names: Sequence[str], columns: Mapping[str, FloatArray]) -> dict[str, dict[str, Any]]:
    """Return the state of each body by name, as JSON holds it.

    Args:
        names: of the N bodies.
        columns: (N, …) each quantity, by its name.
    """
    states = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = {name: dict(zip(columns, state, strict=True)) for name, state in zip(names, states, strict=True)}
    is_finite = all(np.isfinite(column).all() for column in columns.values())
    return rows if is_finite else to_json(rows)  # JSON has no nan


def _pocketed(run: Trajectory, scene: Scene) -> dict[str, str]:
    """Return the pocket of each captured ball, which lies exactly at the centre of the pocket."""
    if not len(run.time) or not scene.pockets:
        return {}
    names = scene.fixed_names[len(scene.fixed) :]
    holes = {pocket.position: name for pocket, name in zip(scene.pockets, names, strict=False)}  # zones follow
    places = zip(run.names.tolist(), run.position[-1].tolist(), strict=True)
    return {name: holes[x, y] for name, (x, y) in places if (x, y) in holes}


def _final_state(state: Mapping[str, Any]) -> FinalBodyState:
    values: dict[str, Any] = {
        key: tuple(map(_number, v)) if isinstance(v, list) else _number(v) for key, v in state.items()
    }
    return FinalBodyState(**values)


def _number(value: float | None) -> float:
    """Return a number of JSON, which has null for nan."""
    return math.nan if value is None else value


def _ledger(document: Mapping[str, Any] | None) -> LedgerDocument | None:
    if document is None:
        return None
    numbers = {key: _number(value) for key, value in document.items() if key != "causes"}
    return LedgerDocument(causes={key: _number(value) for key, value in document["causes"].items()}, **numbers)
