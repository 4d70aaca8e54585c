"""Run store: a folder with one row per run in `runs.sqlite`, and the arrays of each run in `<id>.npz`.

The id of a run is a hash of everything that determines its outcome, so the store has each run once. The row is written
after the file. A crash can leave a file without a row, which the next `add` replaces.
"""

import errno
import hashlib
import json
import math
import re
import sqlite3
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import astuple, dataclass, fields
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self, get_type_hints

from sandbox.action import Action, actions_to_json
from sandbox.atomic_write import remove_stale, temporary_in
from sandbox.measure.metrics.contacts import collisions
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.signals import deliver_deferred_interrupt
from sandbox.trajectory import Trajectory

DATABASE = "runs.sqlite"
VERSION = 2
"""Version of the table below. A store of an earlier version is migrated, one of a later version is refused."""
WAIT = 60.0
"""s, for another process to finish its write, which takes milliseconds, because files are written before the lock."""
NOTICE = 1.0
"""s of waiting, after which it is reported: many times as long as any write."""
ECHO = 40
"""characters of a damaged value that a message quotes"""
STATUSES = ("ok", "diverged", "refused", "failed")
NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
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

MIGRATIONS = {2: "ALTER TABLE runs ADD COLUMN score REAL"}
"""Migrations: the statement that makes the table of a version from that of the version before."""


class StoreError(Exception):
    """A folder cannot be used as a store; `str()` names the folder and the remedy."""


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
    """s, computing time of the steps"""
    energy_start: float | None
    """J, energy at the start; null if it is not finite"""
    energy_end: float | None
    """J, energy at the end; null if it is not finite"""
    contacts: int
    """number of contacts with an impulse"""
    missed_contacts: int | None
    """number of contacts that the engine missed; null if the run was not audited"""
    path: str
    """file name of the arrays, in the store's folder"""
    score: float | None = None
    """score of the game; null if no game was played"""


Notice = Callable[[str], None]
"""Callback with a message for the user."""

_REMEDY = "name a folder with write permission"
_REMOVE = "name another folder, or remove the file if it is not needed"

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
    """Return the id of a run, 20 hex digits: a hash of everything that determines its outcome.

    `settings` are the resolved settings; the scene's own `[solver]` is ignored. `[play]` is ignored unless a game is
    played; `game` then has the game and its player.
    """
    document = to_document(scene)
    document.pop("solver", None)
    if game is None:
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
    """Return canonical JSON: equal values give equal texts."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)


class Store:
    """Folder of stored runs. Several processes may add to one folder at the same time.

    Args:
        directory: path of the folder, which is created if it does not exist. Partial files of killed processes are
            removed.
        notice: callback with messages that need no reaction: waiting for another process, damaged rows. Each message is
            given once.

    Raises:
        StoreError: the folder or its database cannot be used. Every method raises it if that happens later.
    """

    def __init__(self, directory: str | Path, notice: Notice | None = None) -> None:
        self.directory = Path(directory)
        self._database = self.directory / DATABASE
        self._notice = notice
        self._noticed: set[str] = set()
        with self._faults():
            self.directory.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=self.directory):
                pass  # a folder that cannot be written to shows now, not after the run
            remove_stale(self.directory)
            # Without an isolation level, transactions begin and end where this module says so.
            self._connection = sqlite3.connect(self._database, timeout=NOTICE, isolation_level=None)
        # Text that is not UTF-8 is an error of the row that holds it, which a decoding error would not name.
        self._connection.text_factory = lambda data: data.decode("utf-8", "surrogateescape")
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
        """Return the run with an id; None if it is not stored, its row is damaged, or its file is missing."""
        found = self._select("WHERE id = ?", (run,))
        return found[0] if found and self.file(found[0]).is_file() else None

    def file(self, run: StoredRun) -> Path:
        """Return the path of a run's arrays, for `Trajectory.load`."""
        return self.directory / run.path

    def rows(self) -> tuple[StoredRun, ...]:
        """Return all runs in the order of adding, without damaged rows; the file of a run may be missing."""
        return self._select("ORDER BY rowid")

    def add(self, trajectory: Trajectory, run: str, replace: bool = False) -> StoredRun:
        """Store a run under its id and return its row.

        Args:
            trajectory: the run.
            run: its id.
            replace: replace a run with the same id; otherwise that run is kept.

        Raises:
            ValueError: the id is not one of `run_id`; it becomes a file name.
            StoreError: the folder cannot be written to.
        """
        if not ID.fullmatch(run):
            raise ValueError(f"{run!r} is not a run id, which has 20 hex digits")
        found = None if replace else self.find(run)
        if found is not None:
            return found
        row = _row(trajectory, run)
        # The slow part comes first, to a temporary file, and the lock is held for a rename and a row only.
        with self._faults(), temporary_in(self.directory) as staged:
            trajectory.save(staged)
            with self._writing():
                found = None if replace else self.find(run)  # another process may have been faster
                if found is not None:
                    return found
                staged.replace(self.file(row))
                self._execute(f"INSERT OR REPLACE INTO runs ({COLUMNS}) VALUES ({MARKS})", astuple(row))
        return row

    def notice(self, message: str) -> None:
        """Report a message, once."""
        if self._notice is not None and message not in self._noticed:
            self._noticed.add(message)
            self._notice(message)

    def _select(self, which: str, parameters: Sequence[Any] = ()) -> tuple[StoredRun, ...]:
        """Return the valid rows of a selection, and report the damaged ones."""
        with self._faults():
            rows = self._execute(f"SELECT {COLUMNS} FROM runs {which}", parameters)
        sound = []
        for values in rows:
            fault = _fault_of(values)
            if fault is None:
                sound.append(StoredRun(*values))
            else:
                self.notice(f"{self._database}: a damaged row is ignored, and its run is repeated: {fault}")
        return tuple(sound)

    def _set_up(self) -> None:
        version = int(self._execute("PRAGMA user_version")[0][0])
        if version > VERSION:
            raise StoreError(
                f"{self._database}: written by a newer version of sandbox (format {version}; this one "
                f"reads {VERSION}); update sandbox, or name another folder"
            )
        if version == 0 and self._execute("SELECT count(*) FROM sqlite_master")[0][0]:
            raise StoreError(f"{self._database}: not a database of runs; name another folder")
        if version == 0:
            self._execute(TABLE)
        for later in range(version + 1, VERSION + 1) if version > 0 else ():
            self._execute(MIGRATIONS[later])
        if version < 0 or _layout(self._connection) != _layout_of_table():
            raise StoreError(
                f"{self._database}: damaged, or not a database of runs: its table does not have "
                f"format {version}; {_REMOVE}"
            )
        if version != VERSION:
            self._execute(f"PRAGMA user_version = {VERSION}")

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Hold the write lock of the database; the statements inside are one transaction."""
        with self._faults():
            self._execute("BEGIN IMMEDIATE")
            try:
                yield
                self._execute("COMMIT")
            except BaseException:
                self._connection.rollback()
                raise

    def _execute(self, statement: str, parameters: Sequence[Any] = ()) -> list[Any]:
        """Execute a statement and return its rows. While another process holds the lock, wait; Ctrl-C ends the wait.

        Raises:
            sqlite3.Error: it cannot be executed.
            StoreError: the lock was held for too long.
        """
        until = monotonic() + WAIT
        while True:
            try:
                return self._connection.execute(statement, parameters).fetchall()
            except sqlite3.OperationalError as error:
                if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY:  # the low byte is the kind of an error
                    raise
            deliver_deferred_interrupt()
            if monotonic() >= until:
                raise StoreError(
                    f"{self._database}: another process has locked it for {WAIT:g} s; stop that process, or wait "
                    "until it is done"
                )
            self.notice(f"{self._database}: waiting up to {WAIT:g} s for another process that has locked it")

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Raise errors of the folder and its database as `StoreError`."""
        try:
            yield
        except (FileExistsError, NotADirectoryError):
            raise StoreError(f"{self.directory}: is a file or inside a file; runs need a folder") from None
        except OSError as error:
            remedy = "free some disk space, or name another folder" if error.errno in NO_ROOM else _REMEDY
            raise StoreError(f"{self.directory}: {error.strerror or error}; {remedy}") from None
        except UnicodeError:
            raise StoreError(f"{self._database}: holds text that is not UTF-8; {_REMOVE}") from None
        except sqlite3.OperationalError as error:
            message = f"{self._database}: {error}; the folder needs write permission and free disk space"
            raise StoreError(message) from None
        except sqlite3.Error as error:
            raise StoreError(f"{self._database}: {error}; {_REMOVE}") from None


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


def _fault_of(values: Sequence[Any]) -> str | None:
    """Return the fault of a row of the database, whose columns may have values of any type; None if it is valid."""
    for (column, allowed), value in zip(get_type_hints(StoredRun).items(), values, strict=True):
        if not isinstance(value, allowed) or (isinstance(value, str) and not _is_text(value)):
            return f"{column} is {repr(value)[:ECHO]}"
    row = StoredRun(*values)
    if not ID.fullmatch(row.id):
        return f"id is {row.id[:ECHO]!r}, not 20 hex digits"
    if row.path != f"{row.id}.npz":
        return f"path is {row.path[:ECHO]!r}, not {row.id}.npz"
    if row.status not in STATUSES:
        return f"status is {row.status[:ECHO]!r}, not one of {', '.join(STATUSES)}"
    for name, text in (("settings", row.settings), ("versions", row.versions)):
        if not _is_json_object(text):
            return f"{name} is not a JSON object: {text[:ECHO]!r}"
    return None


def _is_text(value: str) -> bool:
    """Tell whether a text was UTF-8: other bytes have become surrogates."""
    try:
        value.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _is_json_object(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _layout(connection: sqlite3.Connection) -> tuple[list[Any], list[Any]]:
    """Return the columns of the table of runs, and the triggers and views, which may change what statements do."""
    columns = connection.execute("PRAGMA table_xinfo(runs)").fetchall()
    others = connection.execute("SELECT type, name FROM sqlite_master WHERE type = 'trigger' OR type = 'view'")
    return columns, others.fetchall()


def _layout_of_table() -> tuple[list[Any], list[Any]]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.execute(TABLE)
        return _layout(connection)


def _known(value: float | None) -> float | None:
    """Return a number, which may be infinite; None for nan, for which SQL has no number."""
    return None if value is None or math.isnan(value) else float(value)
