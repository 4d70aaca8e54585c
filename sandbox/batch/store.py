"""Run store: a folder with one row per run in `runs.sqlite`, and the arrays of each run in `<id>.npz`.

The id of a run is a hash of everything that determines its outcome, so the store has each run once. The row is written
after the file. A crash can leave a file without a row, which the next `add` replaces.

The table `runs` has the columns of `StoredRun`, and then one for each value that a command set, swept or sampled, named
by its path, such as "ball.cue.velocity"; it is null in runs that did not set it. The database is in WAL mode: one
process writes while others read. Beyond `FLAT_RUNS` runs, files go to 256 subfolders, named by the first two digits of
the id, because folders of 10⁵ files are slow to list.
"""

import errno
import hashlib
import json
import sqlite3
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self

from sandbox.action import Action, actions_to_json
from sandbox.atomic_write import remove_stale, temporary_in
from sandbox.batch.stored_run import (
    COLUMNS,
    ID,
    SOLVER,
    TABLE,
    StoredRun,
    column_of,
    fault_of,
    has_column,
    hash_of,
    is_setting,
    paths_of,
    quoted_column,
    sql_value,
)
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.signals import deliver_deferred_interrupt
from sandbox.trajectory import Trajectory

DATABASE = "runs.sqlite"
VERSION = 4
"""Version of the table. A store of another version is refused."""
WAIT = 60.0
"""s, for another process to finish its write, which takes milliseconds, because files are written before the lock."""
NOTICE = 1.0
"""s of waiting, after which it is reported: many times as long as any write."""
NO_ROOM = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)
FLAT_RUNS = 1_000
"""Runs whose files lie in the folder itself."""
MAX_VALUE_COLUMNS = 1_900
"""Columns of set values; SQLite allows 2,000 columns in a table."""
DIGEST_BLOCK = 2**20
"""bytes that are hashed at a time"""

INDEX = "CREATE INDEX IF NOT EXISTS runs_by_plan_key ON runs (plan_key)"


class StoreError(Exception):
    """A folder cannot be used as a store; `str()` names the folder and the remedy."""


Notice = Callable[[str], None]
"""Callback with a message for the user."""

_REMEDY = "name a folder with write permission"
_REMOVE = "name another folder, or remove the file if it is not needed"
_SELECTED = ", ".join(COLUMNS)


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
    played, and its `speed` always; `game` then has the game and its player.
    """
    return id_of_document(to_document(scene), engine, settings, seed, versions, actions, game)


def id_of_document(
    document: Mapping[str, Any],
    engine: str,
    settings: Settings,
    seed: int,
    versions: Mapping[str, str],
    actions: tuple[Action, ...] = (),
    game: Mapping[str, object] | None = None,
) -> str:
    """Return the id of a run as `run_id` does, from the document of its scene."""
    scene = {key: value for key, value in document.items() if key not in ("solver", "play")}
    if game is not None and "play" in document:  # the rules read all of it but the speed of the window
        scene["play"] = {key: value for key, value in document["play"].items() if key != "speed"}
    decides = {
        "scene": scene,
        "engine": engine,
        "settings": settings.model_dump(mode="json"),
        "seed": seed,
        "versions": dict(versions),
        "actions": actions_to_json(actions),
    }
    return hash_of(decides if game is None else decides | {"game": dict(game)})


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
        self._columns: set[str] = set()
        """paths of set values that have a column"""
        self._count = 0
        """number of runs"""
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
            with self._faults():
                self._execute("PRAGMA journal_mode = WAL")  # stays as it is on file systems without shared memory
                self._execute("PRAGMA synchronous = NORMAL")  # a crash of the system may lose the last rows only
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
        return self._with_file(self._select("WHERE id = ?", (run,)))

    def find_planned(self, plan_key: str) -> StoredRun | None:
        """Return the run that was stored last under the key of a plan; None as for `find`."""
        return self._with_file(self._select("WHERE plan_key = ? ORDER BY rowid DESC LIMIT 1", (plan_key,)))

    def has_planned(self, plan_key: str) -> bool:
        """Return whether there is a row with the key of a plan; it may be damaged, or its file missing."""
        with self._faults():
            return bool(self._execute("SELECT 1 FROM runs WHERE plan_key = ? LIMIT 1", (plan_key,)))

    def file(self, run: StoredRun) -> Path | None:
        """Return the path of a run's arrays, for `Trajectory.load`; None if only its figures are stored."""
        return None if run.path is None else self.directory / run.path

    def rows(self) -> tuple[StoredRun, ...]:
        """Return all runs in the order of adding, without damaged rows; the file of a run may be missing."""
        return self._select("ORDER BY rowid")

    def fault_of_file(self, run: StoredRun) -> str | None:
        """Return the fault of a run's file: it is not the one that was stored; None if it is, or if there is none.

        Raises:
            StoreError: the file cannot be opened.
        """
        file = self.file(run)
        if file is None or run.digest is None:
            return None
        try:
            size, digest = file.stat().st_size, _digest_of(file)
        except OSError as error:
            raise StoreError(f"{file}: {error.strerror or error}; the file must be readable") from None
        if size != run.size:
            return f"{file} is not a stored run: it has {size:,} bytes, and {run.size:,} were stored"
        return None if digest == run.digest else f"{file} is not a stored run: its content has changed"

    def add(
        self,
        row: StoredRun,
        arrays: bytes | None = None,
        *,
        values: Mapping[str, Any] | None = None,
        replace_run: bool = False,
    ) -> StoredRun:
        """Store a run under its id and return its row.

        Args:
            row: its row, whose `path`, `size` and `digest` are set here.
            arrays: content of its file (`Trajectory.to_bytes`); None to keep figures only.
            values: values that the command set, by path; each has a column.
            replace_run: replace a run with the same id; otherwise that run is kept.

        Raises:
            ValueError: the id is not one of `run_id`; it becomes a file name.
            StoreError: the folder cannot be written to.
        """
        if not ID.fullmatch(row.id):
            raise ValueError(f"{row.id!r} is not a run id, which has 20 hex digits")
        found = None if replace_run else self.find(row.id)
        if found is not None:
            return found
        if arrays is None:
            row = replace(row, path=None, size=None, digest=None)
            return self._insert(row, values or {}, replace_run, None)
        row = replace(row, path=self._new_path(row.id), size=len(arrays), digest=_digest(hashlib.sha256(arrays)))
        # The slow part comes first, to a temporary file, and the lock is held for a rename and a row only.
        with self._faults(), temporary_in(self.directory) as staged:
            staged.write_bytes(arrays)
            return self._insert(row, values or {}, replace_run, staged)

    def add_rows(self, rows: Sequence[tuple[StoredRun, Mapping[str, Any]]]) -> None:
        """Store runs without arrays, each with its set values, in one transaction; runs with their ids are replaced.

        Raises:
            StoreError: the folder cannot be written to.
        """
        with self._writing():
            for row, values in rows:
                self._write_row(row, values)

    def add_run(self, run: Trajectory, run_id: str, replace_run: bool = False) -> StoredRun:
        """Store a run under an id, with its arrays, and return its row; see `add`."""
        return self.add(StoredRun.of(run, run_id), run.to_bytes(), replace_run=replace_run)

    def set_plan_key(self, run: StoredRun, plan_key: str) -> None:
        """Store another plan key of a run, which replaces the one before."""
        with self._writing():
            self._execute("UPDATE runs SET plan_key = ? WHERE id = ?", (plan_key, run.id))

    def _with_file(self, found: Sequence[StoredRun]) -> StoredRun | None:
        if not found:
            return None
        file = self.file(found[0])
        return found[0] if file is None or file.is_file() else None

    def _new_path(self, run: str) -> str:
        """Return the path for the arrays of a new run, relative to the folder, which is created."""
        flat, sharded = paths_of(run)
        if self._count < FLAT_RUNS or (self.directory / flat).exists():
            return flat
        with self._faults():
            (self.directory / sharded).parent.mkdir(exist_ok=True)
        return sharded

    def _insert(self, row: StoredRun, values: Mapping[str, Any], replace_run: bool, staged: Path | None) -> StoredRun:
        """Write a row, and rename its file; return the run that another process has stored meanwhile, if any."""
        with self._writing():
            found = None if replace_run else self.find(row.id)  # another process may have been faster
            if found is not None:
                return found
            if staged is not None:
                assert row.path is not None
                staged.replace(self.directory / row.path)
            self._write_row(row, values)
        return row

    def _write_row(self, row: StoredRun, values: Mapping[str, Any]) -> None:
        """Insert a row, or replace that of its id."""
        cells = {column: getattr(row, column) for column in COLUMNS} | self._value_cells(row, values)
        names, marks = ", ".join(map(quoted_column, cells)), ", ".join("?" for _ in cells)
        self._execute(f"INSERT OR REPLACE INTO runs ({names}) VALUES ({marks})", tuple(cells.values()))
        self._count += 1

    def _value_cells(self, row: StoredRun, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the cells of set values by column; columns that are new are added to the table.

        Columns of settings have the setting of every run, whether it was set or not.

        Raises:
            StoreError: the table would have too many columns.
        """
        wanted = {column_of(path): value for path, value in values.items() if has_column(path)}
        if not set(wanted) <= self._columns:
            self._columns = set(value_columns(self._connection))  # another process may have added some
            for column in wanted:
                self._add_column(column)
        settings = json.loads(row.settings)
        known = {column: settings.get(column.removeprefix(SOLVER)) for column in self._columns if is_setting(column)}
        cells = {column: value for column, value in (wanted | known).items() if column in self._columns}
        return {column: sql_value(value) for column, value in cells.items()}

    def _add_column(self, column: str) -> None:
        if column in self._columns:
            return
        same = next((each for each in self._columns if each.lower() == column.lower()), None)
        if same is not None:  # SQL ignores case
            self.notice(f"{self._database}: {column} has no column beside {same}; it is in set_values")
            return
        if len(self._columns) >= MAX_VALUE_COLUMNS:
            raise StoreError(
                f"{self._database}: its runs set more than {MAX_VALUE_COLUMNS:,} different values, more than a "
                "table has columns; name another folder"
            )
        self._execute(f"ALTER TABLE runs ADD COLUMN {quoted_column(column)}")
        if is_setting(column):
            path = f'$."{column.removeprefix(SOLVER)}"'
            self._execute(f"UPDATE runs SET {quoted_column(column)} = json_extract(settings, ?)", (path,))
        self._columns.add(column)

    def notice(self, message: str) -> None:
        """Report a message, once."""
        if self._notice is not None and message not in self._noticed:
            self._noticed.add(message)
            self._notice(message)

    def _select(self, which: str, parameters: Sequence[Any] = ()) -> tuple[StoredRun, ...]:
        """Return the valid rows of a selection, and report the damaged ones."""
        with self._faults():
            rows = self._execute(f"SELECT {_SELECTED} FROM runs {which}", parameters)
        sound = []
        for values in rows:
            fault = fault_of(values)
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
        if 0 < version < VERSION:
            raise StoreError(
                f"{self._database}: written by an earlier version of sandbox (format {version}; this one "
                f"reads {VERSION}); {_REMOVE}"
            )
        if version == 0 and self._execute("SELECT count(*) FROM sqlite_master")[0][0]:
            raise StoreError(f"{self._database}: not a database of runs; name another folder")
        if version == 0:
            self._execute(TABLE)
        columns, others = _layout(self._connection)
        wanted, _ = _layout_of_table()
        if version < 0 or columns[: len(wanted)] != wanted or others or not _are_values(columns[len(wanted) :]):
            raise StoreError(
                f"{self._database}: damaged, or not a database of runs: its table does not have "
                f"format {version}; {_REMOVE}"
            )
        self._execute(INDEX)
        if version != VERSION:
            self._execute(f"PRAGMA user_version = {VERSION}")
        self._columns = set(value_columns(self._connection))
        self._count = int(self._execute("SELECT count(*) FROM runs")[0][0])

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


def value_columns(connection: sqlite3.Connection, count: int = len(COLUMNS)) -> list[str]:
    """Return the columns of set values, in the order in which they were added; they follow `count` other columns."""
    return [str(column[1]) for column in connection.execute("PRAGMA table_xinfo(runs)").fetchall()[count:]]


def _layout(connection: sqlite3.Connection) -> tuple[list[Any], list[Any]]:
    """Return the columns of the table of runs, and the triggers and views, which may change what statements do."""
    columns = connection.execute("PRAGMA table_xinfo(runs)").fetchall()
    others = connection.execute("SELECT type, name FROM sqlite_master WHERE type = 'trigger' OR type = 'view'")
    return columns, others.fetchall()


def _layout_of_table() -> tuple[list[Any], list[Any]]:
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.execute(TABLE)
        return _layout(connection)


def _are_values(columns: Sequence[Any]) -> bool:
    """Return whether columns are of set values: paths, without a type, nullable, and without a default."""
    return all("." in str(name) and row[2:] == ("", 0, None, 0, 0) for row in columns for name in row[1:2])


def _digest_of(file: Path) -> str:
    """Return the digest of a file.

    Raises:
        OSError: it cannot be read.
    """
    hashed = hashlib.sha256()
    with file.open("rb") as stream:
        while block := stream.read(DIGEST_BLOCK):
            hashed.update(block)
    return _digest(hashed)


def _digest(hashed: Any) -> str:
    return str(hashed.hexdigest()[:32])
