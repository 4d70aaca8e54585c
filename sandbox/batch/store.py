"""The run store: a folder with one row a run in `runs.sqlite`, and the arrays of each in `<id>.npz`.

A run is known by a hash of all that decides its outcome, so the store keeps each once. The row is written
after the file is in place: what a crash leaves is at worst a file without a row, which the next add replaces.
"""

import hashlib
import json
import math
import re
import sqlite3
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import astuple, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from sandbox.action import Action, actions_to_json
from sandbox.measure.collisions import collisions
from sandbox.scene.document import to_document
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Trajectory

DATABASE = "runs.sqlite"
VERSION = 2
"""Of the table below. A store of an earlier one is brought up to date, a later one is refused."""
WAIT = 60.0
"""s, for another process to finish its write; each takes milliseconds, for files are written before."""
ID = re.compile(r"[0-9a-f]{20}")

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
    contacts INTEGER NOT NULL,
    missed_contacts INTEGER,
    path TEXT NOT NULL,
    score REAL
)
"""

LATER = {2: "ALTER TABLE runs ADD COLUMN score REAL"}
"""By version, what makes its table of that of the version before."""


class StoreError(Exception):
    """A folder cannot serve as a store; `str()` names it and says what would be right."""


@dataclass(frozen=True)
class StoredRun:
    """A row of the store. The fields are the columns, in their order."""

    id: str
    scene_hash: str
    scene_title: str
    engine: str
    settings: str
    """a JSON object"""
    seed: int
    versions: str
    """a JSON object"""
    status: str
    reason: str | None
    created: str
    """ISO 8601, UTC"""
    steps: int
    seconds: float | None
    energy_start: float | None
    """J; None where it is not a number"""
    energy_end: float | None
    """J; None where it is not a number"""
    contacts: int
    missed_contacts: int | None
    """None where the run was not audited"""
    path: str
    """file name of the arrays, in the store's folder"""
    score: float | None = None
    """of a game; None where none was played"""


COLUMNS = ", ".join(column.name for column in fields(StoredRun))
MARKS = ", ".join("?" for _ in fields(StoredRun))


def run_id(
    scene: Scene,
    engine: str,
    settings: Settings,
    seed: int,
    versions: Mapping[str, str],
    actions: tuple[Action, ...] = (),
    game: Mapping[str, object] | None = None,
) -> str:
    """Return the id of a run, 20 hex digits: a hash of everything that decides how it goes.

    The settings are the resolved ones; what the scene's own `[solver]` says does not count beside them. What `[play]`
    says does not either, but for a game that is played: `game` tells which, and who plays.
    """
    document = to_document(scene)
    document.pop("solver", None)
    document.pop("play", None)
    decides = {
        "scene": document,
        "engine": engine,
        "settings": settings.model_dump(mode="json"),
        "seed": seed,
        "versions": dict(versions),
        "actions": actions_to_json(actions),
    }
    return _hash(decides if game is None else decides | {"game": dict(game)})


def _hash(document: object) -> str:
    return hashlib.sha256(_json(document).encode("ascii")).hexdigest()[:20]


def _json(document: object) -> str:
    """Write JSON in one way only, so that equal values give equal texts."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)


class Store:
    """A folder of runs. Several processes may add to one folder at the same time.

    Args:
        directory: made where it does not exist.

    Raises:
        StoreError: the folder or its database cannot be used. Every method raises it where that comes to
            be so later.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)
        self._database = self.directory / DATABASE
        with self._faults():
            self.directory.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=self.directory):
                pass  # a folder that cannot be written to shows now, not after the run
            # Without an isolation level, transactions begin and end where this module says so.
            self._connection = sqlite3.connect(self._database, timeout=WAIT, isolation_level=None)
        try:
            with self._writing():  # looking and setting up are one, or two processes would both set up
                self._set_up()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the database. Closing twice does nothing."""
        self._connection.close()

    def find(self, run: str) -> StoredRun | None:
        """Return the run of an id, or None where it is not stored or its file is gone."""
        with self._faults():
            rows = self._connection.execute(f"SELECT {COLUMNS} FROM runs WHERE id = ?", (run,)).fetchall()
        stored = [StoredRun(*row) for row in rows]
        return stored[0] if stored and self.file(stored[0]).is_file() else None

    def file(self, run: StoredRun) -> Path:
        """Return where a run's arrays lie; `Trajectory.load` reads them."""
        return self.directory / run.path

    def rows(self) -> tuple[StoredRun, ...]:
        """Return every run in the order of adding, also those whose file is gone."""
        with self._faults():
            rows = self._connection.execute(f"SELECT {COLUMNS} FROM runs ORDER BY rowid").fetchall()
        return tuple(StoredRun(*row) for row in rows)

    def add(self, trajectory: Trajectory, run: str) -> StoredRun:
        """Store a run under its id and return its row; one that is there already stays as it is.

        Raises:
            ValueError: the id is none of `run_id`'s; it becomes a file name.
            StoreError: the folder cannot be written to.
        """
        if not ID.fullmatch(run):
            raise ValueError(f"{run!r} is no run id, which is 20 hex digits")
        found = self.find(run)
        if found is not None:
            return found
        row = _row(trajectory, run)
        # The slow part comes first, in a folder of its own, and the lock is held for a rename and a row only.
        with self._faults(), tempfile.TemporaryDirectory(dir=self.directory, prefix=f".{run}-") as staging:
            staged = trajectory.save(Path(staging) / row.path)
            with self._writing():
                found = self.find(run)  # another process may have been faster
                if found is not None:
                    return found
                staged.replace(self.file(row))
                insert = f"INSERT OR REPLACE INTO runs ({COLUMNS}) VALUES ({MARKS})"
                self._connection.execute(insert, astuple(row))
        return row

    def _set_up(self) -> None:
        version = int(self._connection.execute("PRAGMA user_version").fetchone()[0])
        if version > VERSION:
            raise StoreError(
                f"{self._database}: written by a newer sandbox, version {version} where this one knows "
                f"{VERSION}; update this one, or name another folder"
            )
        if version == VERSION:
            return
        if version:
            for later in range(version + 1, VERSION + 1):
                self._connection.execute(LATER[later])
        elif self._connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
            raise StoreError(f"{self._database}: a database of something else; name another folder")
        else:
            self._connection.execute(TABLE)
        self._connection.execute(f"PRAGMA user_version = {VERSION}")

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Hold the database's write lock; what was done inside counts as a whole or not at all."""
        with self._faults():
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._connection.execute("COMMIT")
            except BaseException:
                self._connection.rollback()
                raise

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Turn what can go wrong with a folder and its database into a `StoreError`."""
        try:
            yield
        except (FileExistsError, NotADirectoryError):
            raise StoreError(f"{self.directory}: is or lies in a file; runs are stored in a folder") from None
        except OSError as error:
            reason = error.strerror or error
            raise StoreError(f"{self.directory}: {reason}; name a folder that you may write to") from None
        except sqlite3.OperationalError as error:
            message = f"{self._database}: {error}; a store needs a folder that you may write to, with room left"
            raise StoreError(message) from None
        except sqlite3.DatabaseError as error:
            message = f"{self._database}: {error}; name another folder, or remove the file if it is not needed"
            raise StoreError(message) from None


def _row(trajectory: Trajectory, run: str) -> StoredRun:
    info = trajectory.info
    scene = info["scene"]
    return StoredRun(
        id=run,
        scene_hash=_hash(scene),
        scene_title=str(scene.get("title", "")),
        engine=info["engine"],
        settings=_json(info["settings"]),
        seed=info["seed"],
        versions=_json(info["versions"]),
        status=trajectory.status,
        reason=trajectory.reason,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        steps=info["steps"],
        seconds=_known(info["seconds"]),
        energy_start=_known(info["energy_start"]),
        energy_end=_known(info["energy_end"]),
        contacts=collisions(trajectory),
        missed_contacts=trajectory.missed_contacts,
        path=f"{run}.npz",
        score=_known((info.get("game") or {}).get("score")),
    )


def _known(value: float | None) -> float | None:
    """Return a number, infinite or not, or None for what SQL has no number for."""
    return None if value is None or math.isnan(value) else float(value)
