"""Rows of the run store: the columns of the table `runs`, and the checks of a row that is read.

A row has the figures of a run as columns of their own, so that SQL can filter and aggregate them. Every value that a
command set, swept or sampled is a further column, named by its path, such as "ball.cue.velocity"; see `store`.
"""

import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any, Self, get_type_hints

from sandbox.measure.metrics.contacts import collisions, first_collision
from sandbox.scene.errors import quoted
from sandbox.scene.files.overrides import parse_path
from sandbox.trajectory import Trajectory

STATUSES = ("ok", "diverged", "refused", "failed")
ID = re.compile(r"[0-9a-f]{20}")
SOLVER = "solver."
"""Paths of settings begin with it."""
ECHO = 40
"""characters of a damaged value that a message quotes"""

TABLE = """
CREATE TABLE runs (
    id TEXT PRIMARY KEY,
    scene_hash TEXT NOT NULL,
    scene_title TEXT NOT NULL,
    engine TEXT NOT NULL,
    settings TEXT NOT NULL,
    seed INTEGER NOT NULL,
    versions TEXT NOT NULL,
    status TEXT NOT NULL,
    reason TEXT,
    created TEXT NOT NULL,
    steps INTEGER NOT NULL,
    seconds REAL,
    energy_start REAL,
    energy_end REAL,
    contacts INTEGER,
    missed_contacts INTEGER,
    path TEXT,
    score REAL,
    scene TEXT,
    set_values TEXT,
    first_contact REAL,
    joint_error REAL,
    broken_joints INTEGER,
    state_hash TEXT,
    work TEXT,
    plan_key TEXT,
    size INTEGER,
    digest TEXT,
    details TEXT
)
"""


@dataclass(frozen=True)
class StoredRun:
    """Row of the store. The fields are the columns, in their order."""

    id: str
    """20 hex digits: hash of everything that determines the outcome"""
    scene_hash: str
    """20 hex digits: hash of the scene"""
    scene_title: str
    """title of the scene"""
    engine: str
    """name of the engine"""
    settings: str
    """JSON object: settings as the engine resolved them"""
    seed: int
    """seed of the scene"""
    versions: str
    """JSON object: versions of Python, sandbox and the packages used"""
    status: str
    """`ok`, `diverged`, `refused` or `failed`"""
    reason: str | None
    """reason for a status other than `ok`"""
    created: str
    """time of creation, ISO 8601, UTC"""
    steps: int
    """number of steps of dt"""
    seconds: float | None
    """s, computing time of the steps, without compilation"""
    energy_start: float | None
    """J, energy at the start; null if it is not finite"""
    energy_end: float | None
    """J, energy at the end; null if it is not finite"""
    contacts: int | None
    """number of contacts with an impulse; null if they were not counted (`--keep end`)"""
    missed_contacts: int | None
    """number of contacts that the engine missed; null if the run was not audited"""
    path: str | None
    """file of the arrays, relative to the store's folder; null if only figures were kept"""
    score: float | None = None
    """score of the game; null if no game was played"""
    scene: str | None = None
    """the scene as the command named it; null, as the following columns, in rows of `Store.add`"""
    set_values: str | None = None
    """JSON object: values that the command set, swept or sampled, by path; each has a column of its own too"""
    first_contact: float | None = None
    """s, start of the first contact; null without contacts, or if they were not counted"""
    joint_error: float | None = None
    """largest error of a joint in any recorded frame, relative or in rad; null without joints"""
    broken_joints: int | None = None
    """number of joints that broke"""
    state_hash: str | None = None
    """hash of the state at the end; equal states have equal hashes"""
    work: str | None = None
    """JSON object: work counters of the engine"""
    plan_key: str | None = None
    """hash of the scene file and of all values set; finds the run without reading its scene"""
    size: int | None = None
    """bytes, size of the file of the arrays"""
    digest: str | None = None
    """32 hex digits: SHA-256 of that file, shortened"""
    details: str | None = None
    """JSON object: final state of each body, removed and pocketed bodies, game, energy ledger, observed values,
    warnings, processor"""

    @classmethod
    def of(
        cls,
        run: Trajectory,
        run_id: str,
        *,
        scene: str | None = None,
        values: Mapping[str, Any] | None = None,
        plan_key: str | None = None,
        details: Mapping[str, Any] | None = None,
    ) -> Self:
        """Return the row of a run.

        Args:
            run: the run.
            run_id: its id.
            scene: the scene as the user named it.
            values: values that the command set, by path.
            plan_key: hash by which a plan finds the run.
            details: further results, which JSON can hold.
        """
        info = run.info
        document = info["scene"]
        return cls(
            id=run_id,
            scene_hash=hash_of(document),
            scene_title=str(document.get("title", "")),
            engine=info["engine"],
            settings=canonical_json(info["settings"]),
            seed=info["seed"],
            versions=canonical_json(info["versions"]),
            status=run.status,
            reason=run.reason,
            created=datetime.now(UTC).isoformat(timespec="seconds"),
            steps=info["steps"],
            seconds=_known(info["seconds"]),
            energy_start=_known(info["energy_start"]),
            energy_end=_known(info["energy_end"]),
            contacts=collisions(run),
            missed_contacts=run.missed_contacts,
            path=None,
            score=_known((info.get("game") or {}).get("score")),
            scene=scene,
            set_values=dump_json(dict(values or {})),
            first_contact=first_collision(run),
            joint_error=_known(info.get("joint_error")),
            broken_joints=info.get("broken", 0),
            state_hash=info.get("state_hash"),
            work=canonical_json(info.get("work", {})),
            plan_key=plan_key,
            details=None if details is None else dump_json(details),
        )

    @property
    def is_recorded_failure(self) -> bool:
        """Whether the run ended its process or exceeded its time; one that fails by itself ends in a state."""
        return self.status == "failed" and self.steps == 0 and self.state_hash is None


COLUMNS = tuple(column.name for column in fields(StoredRun))
_TYPES = tuple(get_type_hints(StoredRun).items())
_JSON_COLUMNS = ("settings", "versions", "set_values", "work", "details")


def paths_of(run_id: str) -> tuple[str, str]:
    """Return the paths that the arrays of a run may have: in the folder of the store, or in one of 256 folders."""
    return f"{run_id}.npz", f"{run_id[:2]}/{run_id}.npz"


def fault_of(values: Sequence[Any]) -> str | None:
    """Return the fault of a row of the database, whose columns may have values of any type; None if it is valid."""
    for (column, allowed), value in zip(_TYPES, values, strict=True):
        if not isinstance(value, allowed) or (isinstance(value, str) and not _is_text(value)):
            return f"{column} is {repr(value)[:ECHO]}"
    row = StoredRun(*values)
    if not ID.fullmatch(row.id):
        return f"id is {row.id[:ECHO]!r}, not 20 hex digits"
    if row.path is not None and row.path not in paths_of(row.id):
        return f"path is {row.path[:ECHO]!r}, not {row.id}.npz"
    if row.status not in STATUSES:
        return f"status is {row.status[:ECHO]!r}, not one of {', '.join(STATUSES)}"
    for name in _JSON_COLUMNS:
        text = getattr(row, name)
        if text is not None and not _is_json_object(text):
            return f"{name} is not a JSON object: {text[:ECHO]!r}"
    return None


def column_of(path: str) -> str:
    """Return the column of a set value: its path in one spelling, so that `ball[0].mass` is `ball.0.mass`."""
    return ".".join(map(quoted, parse_path(path)))


def has_column(path: str) -> bool:
    """Return whether a set value has a column: the title and the seed have columns of their own."""
    return "." in path and column_of(path) != "world.seed"


def is_setting(column: str) -> bool:
    """Return whether a column is of a setting, whose value is known of every run."""
    return column.startswith(SOLVER)


@lru_cache(maxsize=4096)
def quoted_column(name: str) -> str:
    """Return the name of a column as SQL text."""
    escaped = name.replace('"', '""')
    return f'"{escaped}"'


def sql_value(value: Any) -> Any:
    """Return a value of a scene as SQL holds it: numbers and texts as they are, booleans as 0 and 1, lists as JSON."""
    if value is None or isinstance(value, str | int | float):
        return value
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def hash_of(document: object) -> str:
    """Return 20 hex digits: a hash of a JSON document."""
    return hashlib.sha256(canonical_json(document).encode("ascii")).hexdigest()[:20]


def dump_json(document: object) -> str:
    """Return JSON as a column has it.

    Raises:
        ValueError: a number is not finite.
    """
    return json.dumps(document, ensure_ascii=False, allow_nan=False)


def canonical_json(document: object) -> str:
    """Return canonical JSON: equal values give equal texts."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _is_text(value: str) -> bool:
    """Return whether a text was UTF-8: other bytes have become surrogates."""
    return value.isascii() or not any("\ud800" <= letter <= "\udfff" for letter in value)


def _is_json_object(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _known(value: float | None) -> float | None:
    """Return a number, which may be infinite; None for nan, for which SQL has no number."""
    return None if value is None or math.isnan(value) else float(value)
