"""Questions to a run store: tables, filters, groups and their statistics, trajectories on demand.

    runs = sandbox.open_store("study")
    runs.table(where="solver.dt < 0.01 and status = 'ok'")     # pandas, polars or numpy
    runs.group(["ball.ball.restitution"], ["contacts"])        # mean, deviation, quantiles, success rate
    runs.trajectory("1a2b3c")                                  # by the beginning of an id

Filters are SQL expressions over the columns of `StoredRuns.columns`. They can only read the table of runs.
"""

import csv
import difflib
import json
import math
import os
import re
import sqlite3
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Literal, Self, overload
from urllib.parse import quote

import numpy as np
import numpy.typing as npt

from sandbox.atomic_write import atomic_write
from sandbox.batch.observables import OBSERVED
from sandbox.batch.store import DATABASE, VERSION, Store, StoreError, value_columns
from sandbox.batch.stored_run import SOLVER, quoted_column
from sandbox.echo import short_repr
from sandbox.measure.proportion import wilson_interval
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import quoted
from sandbox.signals import reraise_interrupt
from sandbox.trajectory import Trajectory

if TYPE_CHECKING:
    import pandas
    import polars

TableKind = Literal["pandas", "polars", "numpy"]
Columns = dict[str, npt.NDArray[Any]]
"""Values of each column; None in columns of objects, nan in columns of numbers, for cells without a value."""

NUMBERS = (
    "steps", "seconds", "energy_start", "energy_end", "first_contact", "contacts", "missed_contacts", "joint_error",
    "broken_joints", "score",
)  # fmt: skip
"""Columns of figures"""
FIRST = ("id", "scene", "title", "engine")
FIGURES = ("seed", "status", "reason", *NUMBERS)
LAST = ("state_hash", "versions")
WARNINGS = "CASE WHEN json_valid(details) THEN nullif(json_extract(details, '$.warnings'), '[]') END"
"""Warnings of a run that is ok, a JSON array; null without any"""
CPU = "CASE WHEN json_valid(details) THEN json_extract(details, '$.cpu') END"
"""Processor that computed a run"""
FINAL = {
    "x": "position[0]", "y": "position[1]", "vx": "velocity[0]", "vy": "velocity[1]", "angle": "angle",
    "angular_velocity": "angular_velocity",
}  # fmt: skip
"""Columns of the state of a body at the end, such as `final.ball.x`, which a table has only if they are named: their
places in its JSON"""
LAST_DETAILS = "SELECT details FROM runs WHERE rowid IN (SELECT max(rowid) FROM runs GROUP BY scene, status)"
"""Details of the last run of each scene and status, whose bodies have columns; runs that are refused have none"""
MAX_COLUMNS = 2_000
"""of a query of SQLite"""
PROVENANCE = ("settings", "created", "cpu")
"""Columns that a file has beside those of a table"""
MORE = ("warnings", "created", "cpu", "scene_hash", "path", "size", "settings", "set_values", "work", "details")
"""Further columns that a table has only if they are named"""
PROGRESS_STEPS = 100_000
"""Instructions of the database between two looks for Ctrl-C, a few milliseconds"""
READ_ACTIONS = (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ, sqlite3.SQLITE_FUNCTION)
_TOKEN = re.compile(r"""'(?:[^']|'')*'|"(?:[^"]|"")*"|`[^`]*`|\[[^\]]*\]|--[^\n]*|/\*.*?\*/""", re.DOTALL)
"""Parts of an expression in which no name is replaced: texts, quoted names, comments."""
_DOTTED = re.compile(r"[A-Za-z_]\w*(?:\.(?:[\w*]+|\"[^\"]*\"))+")


class QueryError(ValueError):
    """A question is wrong: an expression, or the name of a column. `str()` is the reason."""


@dataclass(frozen=True)
class QuantityStatistics:
    """Statistics of one quantity over the runs of a group that have a value and the status `ok`."""

    count: int
    """runs with a value"""
    mean: float
    """nan without a value"""
    deviation: float
    """standard deviation of the sample; nan of fewer than two values"""
    quantiles: Mapping[str, float]
    """by their fractions, such as `0.5`; linear between values"""


@dataclass(frozen=True)
class RunGroup:
    """Runs with equal values of some columns."""

    keys: Mapping[str, Any]
    runs: int
    ok: int
    """runs with the status `ok`"""
    success_rate: float
    """fraction of all runs of the group that succeed"""
    success_low: float
    """lower bound of the rate, with a confidence of 95 % together with the upper one (Wilson 1927)"""
    success_high: float
    """upper bound of the rate"""
    versions: int
    """different versions of sandbox and its packages among the runs of one engine, the most; 1 unless they are mixed"""
    quantities: Mapping[str, QuantityStatistics]


class StoredRuns:
    """The runs of a store, for reading; another process may be writing to it.

    Args:
        directory: folder of the store.

    Raises:
        StoreError: the folder has no store, or it cannot be read.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)
        self._database = self.directory / DATABASE
        try:
            if not self._database.is_file():
                raise StoreError(
                    f"{self.directory}: no stored runs; `sandbox run SCENE --out {self.directory}` stores runs"
                )
            self._connection = self._opened()
            (version,) = self._connection.execute("PRAGMA user_version").fetchone()
            if version != VERSION:
                self._connection.close()
                Store(self.directory).close()  # says why it cannot be used
                self._connection = self._opened()
            self._connection.text_factory = lambda data: data.decode("utf-8", "replace")
            values = value_columns(self._connection)
            ends = self._connection.execute(LAST_DETAILS).fetchall()
        except OSError as error:
            raise StoreError(f"{self.directory}: {error.strerror or error}") from None
        except sqlite3.Error as error:
            raise StoreError(f"{self._database}: {error}; it is damaged, or not a database of runs") from None
        settings = [f"{SOLVER}{key}" for key in Settings.model_fields if f"{SOLVER}{key}" not in values]
        self.value_columns = tuple(name for name in values if not name.startswith(OBSERVED))
        """paths of the values that runs have set, swept or sampled"""
        self.observed_columns = tuple(name for name in values if name.startswith(OBSERVED))
        """values of the functions of `--observe`"""
        self.columns = (*self.default_columns(), *settings, "world.seed", *MORE)
        """names of all columns"""
        sources = {"title": "scene_title", "world.seed": "seed", "warnings": WARNINGS, "cpu": CPU}
        finals = _final_sources([text for (text,) in ends], MAX_COLUMNS - len(self.columns) - 1)
        sources |= finals
        self.columns += tuple(finals)
        sources |= {name: f"json_extract(settings, '$.{name.removeprefix(SOLVER)}')" for name in settings}
        parts = (f"{sources.get(name, quoted_column(name))} AS {quoted_column(name)}" for name in self.columns)
        self._order = [quoted_column(name) for name in ("scene", "engine", *self.value_columns, "seed", "id")]
        self._source = f"(SELECT rowid AS added, {', '.join(parts)} FROM runs)"
        self._connection.set_authorizer(_authorize)
        self._connection.set_progress_handler(lambda: 0, PROGRESS_STEPS)  # lets Python handle signals

    def _opened(self) -> sqlite3.Connection:
        """Return a connection that only reads.

        The database is opened for writing where that is allowed, because the last connection then removes the files of
        the WAL; queries cannot change anything. A folder without write permission is read as it is.
        """
        location = f"file:{quote(str(self._database.absolute()))}"
        if os.access(self.directory, os.W_OK) and os.access(self._database, os.W_OK):
            connection = sqlite3.connect(f"{location}?mode=rw", uri=True)
            connection.execute("PRAGMA query_only = ON")
            return connection
        has_log = Path(f"{self._database}-wal").exists()
        return sqlite3.connect(f"{location}?mode=ro" + ("" if has_log else "&immutable=1"), uri=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the database."""
        self._connection.close()

    def __len__(self) -> int:
        return int(self._execute("SELECT count(*) FROM runs")[0][0])

    def __repr__(self) -> str:
        """Return the folder, the number of runs by status, and the values that they set."""
        counts = ", ".join(f"{count:,} {status}" for status, count in self.statuses().items())
        values = f"; values: {', '.join(self.value_columns)}" if self.value_columns else ""
        values += f"; {', '.join(self.observed_columns)}" if self.observed_columns else ""
        return f"<StoredRuns in {self.directory}: {counts or 'no runs'}{values}>"

    def statuses(self, where: str | None = None) -> dict[str, int]:
        """Return the number of runs by status, the most frequent first.

        Raises:
            QueryError: the filter is wrong.
        """
        text = f"SELECT status, count(*) FROM {self._source}{self._filter(where)} GROUP BY status ORDER BY 2 DESC"
        return {str(status): int(count) for status, count in self._execute(text)}

    @overload
    def table(
        self,
        where: str | None = None,
        columns: Sequence[str] | None = None,
        sort: Sequence[str] = (),
        limit: int | None = None,
        *,
        kind: Literal["numpy"],
    ) -> Columns: ...

    @overload
    def table(
        self,
        where: str | None = None,
        columns: Sequence[str] | None = None,
        sort: Sequence[str] = (),
        limit: int | None = None,
        *,
        kind: Literal["pandas"],
    ) -> "pandas.DataFrame": ...

    @overload
    def table(
        self,
        where: str | None = None,
        columns: Sequence[str] | None = None,
        sort: Sequence[str] = (),
        limit: int | None = None,
        *,
        kind: Literal["polars"],
    ) -> "polars.DataFrame": ...

    @overload
    def table(
        self,
        where: str | None = None,
        columns: Sequence[str] | None = None,
        sort: Sequence[str] = (),
        limit: int | None = None,
        kind: TableKind | None = None,
    ) -> "pandas.DataFrame | polars.DataFrame | Columns": ...

    def table(
        self,
        where: str | None = None,
        columns: Sequence[str] | None = None,
        sort: Sequence[str] = (),
        limit: int | None = None,
        kind: TableKind | None = None,
    ) -> Any:
        """Return runs as a table.

        Unless sorted, runs are in the order of their scenes, engines, values and seeds, which does not depend on the
        order in which workers complete them.

        Args:
            where: SQL expression that selects runs, such as `solver.dt < 0.01 and status = 'ok'`.
            columns: names of `columns`; default: the scene, the engine, the values that were set, and all figures,
                with those of `--observe`.
            sort: columns to sort by; `-` before a name sorts in descending order.
            limit: largest number of rows: the first ones of `sort`, or the last ones that were added.
            kind: `pandas` or `polars` for a data frame, `numpy` for arrays by column; default: what is installed, in
                this order.

        Raises:
            QueryError: the filter or a name is wrong.
            ImportError: the package of `kind` is not installed.
        """
        found = self.arrays(where, columns, sort, limit)
        if kind is None:
            kind = next((each for each in ("pandas", "polars") if find_spec(each) is not None), "numpy")
        if kind == "pandas":
            import pandas

            return pandas.DataFrame(found)
        if kind == "polars":
            import polars

            return polars.DataFrame({name: values.tolist() for name, values in found.items()}, strict=False)
        return found

    def arrays(
        self,
        where: str | None = None,
        columns: Sequence[str] | None = None,
        sort: Sequence[str] = (),
        limit: int | None = None,
    ) -> Columns:
        """Return runs as one array per column; see `table`.

        Raises:
            QueryError: the filter or a name is wrong.
        """
        names = list(dict.fromkeys(self.default_columns() if columns is None else map(self.column, columns)))
        order = ", ".join([*map(self._sort_term, sort), *self._order])
        source = f"{self._source}{self._filter(where)}"
        if limit is not None and not sort:  # the last ones that were added
            last = f"SELECT added FROM {source} ORDER BY added DESC LIMIT {int(limit)}"
            source = f"{self._source} WHERE added IN ({last})"
        text = f"SELECT {', '.join(map(quoted_column, names))} FROM {source} ORDER BY {order}"
        rows = self._execute(text + (f" LIMIT {int(limit)}" if limit is not None else ""))
        cells = list(zip(*rows, strict=True)) if rows else [()] * len(names)
        return {name: _array(name, values) for name, values in zip(names, cells, strict=True)}

    def default_columns(self) -> tuple[str, ...]:
        """Return the columns of a table for which none are named."""
        return (*FIRST, *self.value_columns, *FIGURES, *self.observed_columns, *LAST)

    def group(
        self,
        by: Sequence[str],
        of: Sequence[str] = (),
        where: str | None = None,
        success: str = "status = 'ok'",
        quantiles: Sequence[float] = (0.1, 0.5, 0.9),
    ) -> list[RunGroup]:
        """Return the statistics of runs with equal values of some columns, in the order of these values.

        Args:
            by: names of columns; none for one group of all runs.
            of: columns with numbers, of which statistics are computed over the runs with the status `ok`.
            where: SQL expression that selects runs.
            success: SQL expression that is true for runs that succeed.
            quantiles: fractions, from 0 to 1.

        Raises:
            QueryError: an expression or a name is wrong, or a column of `of` has no numbers.
        """
        keys, quantities = [self.column(name) for name in by], [self.column(name) for name in of]
        parts = [*map(quoted_column, (*keys, *quantities, "engine", "versions"))]
        parts += [f"({self.expression(success)}\n)", "status = 'ok'"]
        rows = self._execute(f"SELECT {', '.join(parts)} FROM {self._source}{self._filter(where)}")
        groups: dict[tuple[Any, ...], list[tuple[Any, ...]]] = {}
        for row in rows:
            groups.setdefault(row[: len(keys)], []).append(row[len(keys) :])
        for k, name in enumerate(quantities):
            cells = [row[k] for members in groups.values() for row in members]
            if any(cell is not None for cell in cells) and not any(map(_is_number, cells)):
                raise QueryError(f"{name} has no numbers")
        return [
            _group(dict(zip(keys, values, strict=True)), groups[values], quantities, quantiles)
            for values in sorted(groups, key=_sort_key)
        ]

    def versions(self, where: str | None = None) -> dict[str, dict[str, int]]:
        """Return the number of runs of each engine by their versions, a JSON object each, the oldest first.

        Raises:
            QueryError: the filter is wrong.
        """
        selected = f"SELECT engine, versions, count(*) FROM {self._source}{self._filter(where)}"
        found: dict[str, dict[str, int]] = {}
        for engine, versions, count in self._execute(f"{selected} GROUP BY 1, 2 ORDER BY min(added)"):
            found.setdefault(str(engine), {})[str(versions)] = int(count)
        return found

    def trajectory(self, run: str) -> Trajectory:
        """Return a run with its arrays.

        Args:
            run: its id, or the beginning of it if no other id begins so.

        Raises:
            QueryError: there is no such run, or several; or its arrays were not kept.
            OSError: its file cannot be read.
            ValueError: its file is damaged.
        """
        found = self._one(run, "path")
        if found[1] is None:
            raise QueryError(f"run {found[0]} was stored without arrays (--keep summary)")
        return Trajectory.load(self.directory / str(found[1]))

    def trajectories(self, where: str | None = None) -> Iterator[tuple[str, Trajectory]]:
        """Yield the id and the trajectory of runs with arrays, in the order of `table`; each is read when it is due.

        Raises:
            QueryError: the filter is wrong.
            OSError: a file cannot be read.
            ValueError: a file is damaged.
        """
        selected = f"{self._source}{self._filter(where)} {'AND' if where else 'WHERE'} path IS NOT NULL"
        for run, path in self._execute(f"SELECT id, path FROM {selected} ORDER BY {', '.join(self._order)}"):
            yield str(run), Trajectory.load(self.directory / str(path))

    def final(self, run: str) -> dict[str, dict[str, Any]]:
        """Return the last state of each body of a run, by name: position, velocity, angle, angular velocity.

        Args:
            run: its id, or the beginning of it.

        Raises:
            QueryError: there is no such run, or several.
        """
        _, details = self._one(run, "details")
        states: dict[str, dict[str, Any]] = json.loads(details or "{}").get("final", {})
        return states

    def to_csv(self, path: str | Path, where: str | None = None, columns: Sequence[str] | None = None) -> int:
        """Write runs as a CSV file, and return their number; cells without a value are empty.

        The default columns are those of `table`, and `settings` (JSON), `created` and `cpu`.

        Raises:
            QueryError: the filter or a name is wrong.
            OSError: the file cannot be written.
        """
        found = self.arrays(where, columns or (*self.default_columns(), *PROVENANCE))
        with atomic_write(Path(path)) as temporary, temporary.open("x", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(found)
            writer.writerows(cell_rows(found))
        return _row_count(found)

    def to_parquet(self, path: str | Path, where: str | None = None, columns: Sequence[str] | None = None) -> int:
        """Write runs as a Parquet file, and return their number. It needs pyarrow, the extra `parquet`.

        The default columns are those of `to_csv`.

        Raises:
            QueryError: the filter or a name is wrong.
            OSError: the file cannot be written.
            ImportError: pyarrow is not installed.
        """
        import pyarrow
        from pyarrow import parquet

        found = self.arrays(where, columns or (*self.default_columns(), *PROVENANCE))
        cells = {name: [row[k] for row in cell_rows(found)] for k, name in enumerate(found)}
        typed = {name: _one_type(values) for name, values in cells.items()}
        with atomic_write(Path(path)) as temporary:
            parquet.write_table(pyarrow.table(typed), str(temporary))
        return _row_count(found)

    def column(self, name: str) -> str:
        """Return the name of a column.

        Raises:
            QueryError: there is none of that name.
        """
        if name in self.columns:
            return name
        close = difflib.get_close_matches(name, self.columns, n=1)
        hint = f"did you mean {short_repr(close[0])}?" if close else f"columns: {', '.join(self.default_columns())}"
        raise QueryError(f"no column is named {short_repr(name)}; {hint}")

    def expression(self, text: str) -> str:
        """Return an expression of a user as SQL: paths such as `ball.cue.velocity` become quoted names of columns.

        Raises:
            QueryError: it has a path that is no column.
        """
        dotted = sorted((name for name in self.columns if "." in name), key=len, reverse=True)
        found: list[str] = []
        k = 0
        while k < len(text):
            token = _TOKEN.match(text, k)
            if token is not None:
                found.append(token[0])
                k = token.end()
                continue
            if k and (text[k - 1].isalnum() or text[k - 1] in "_."):
                found.append(text[k])
                k += 1
                continue
            name = next((each for each in dotted if text.startswith(each, k) and _ends(text, k + len(each))), None)
            if name is None and (unknown := _DOTTED.match(text, k)) is not None:
                name = self.column(unknown[0])  # raises
            found.append(text[k] if name is None else quoted_column(name))
            k += 1 if name is None else len(name)
        return "".join(found)

    def _filter(self, where: str | None) -> str:
        """Return the WHERE clause of a filter; a line break ends a comment in it."""
        return "" if where is None else f" WHERE ({self.expression(where)}\n)"

    def _sort_term(self, name: str) -> str:
        return f"{quoted_column(self.column(name.removeprefix('-')))} {'DESC' if name.startswith('-') else 'ASC'}"

    def _one(self, run: str, column: str) -> tuple[str, Any]:
        """Return the id and a column of the run whose id begins with a text.

        Raises:
            QueryError: there is no such run, or several.
        """
        rows = self._execute(f"SELECT id, {column} FROM runs WHERE substr(id, 1, ?) = ? LIMIT 2", (len(run), run))
        if len(rows) != 1:
            subject = "several runs have" if rows else "no run has"
            raise QueryError(f"{subject} an id that begins with {short_repr(run)}")
        return str(rows[0][0]), rows[0][1]

    @reraise_interrupt()
    def _execute(self, text: str, parameters: Sequence[Any] = ()) -> list[Any]:
        """Execute a query; Ctrl-C ends it.

        Raises:
            QueryError: it is wrong.
            StoreError: the database cannot be read.
        """
        try:
            return self._connection.execute(text, parameters).fetchall()
        except (sqlite3.ProgrammingError, sqlite3.Warning) as error:
            raise QueryError(str(error)) from None
        except sqlite3.Error as error:
            code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
            if code == sqlite3.SQLITE_AUTH:
                raise QueryError("an expression can only read the columns of the runs") from None
            if code != sqlite3.SQLITE_ERROR:
                raise StoreError(f"{self._database}: {error}") from None
            unknown = re.fullmatch(r"no such column: (.*)", str(error))
            if unknown is not None:
                self.column(unknown[1])  # raises, with the closest name
            raise QueryError(str(error)) from None


def open_store(directory: str | Path) -> StoredRuns:
    """Open the folder of `sandbox run … --out DIR` for questions; see `StoredRuns`.

    Raises:
        StoreError: the folder has no store, or it cannot be read.

    Example:
        After `sandbox run gas --seeds 3 --set world.duration=0.1 --out study`:

        >>> with sandbox.open_store("study") as runs:
        ...     len(runs), runs.statuses()
        (3, {'ok': 3})
    """
    return StoredRuns(directory)


def cell_rows(found: Columns) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of a table, with None for cells without a value."""
    for row in zip(*(values.tolist() for values in found.values()), strict=True):
        yield tuple(None if cell != cell else cell for cell in row)


def _final_sources(texts: Sequence[str | None], count: int) -> dict[str, str]:
    """Return the columns of the states at the end, at most `count`, and the SQL of each.

    Args:
        texts: details of runs, with the names of their bodies.
        count: largest number of columns.
    """
    found: dict[str, str] = {}
    for text in texts:
        try:
            details = json.loads(text or "{}")
        except ValueError:  # a damaged row
            continue
        bodies = details.get("final") if isinstance(details, dict) else None
        for name in bodies if isinstance(bodies, dict) else ():
            if '"' not in name and "\\" not in name:  # which paths of SQLite cannot have
                stem = name.replace("'", "''")
                for part, key in FINAL.items():
                    found[f"final.{quoted(name)}.{part}"] = f"json_extract(details, '$.final.\"{stem}\".{key}')"
    return dict(islice(found.items(), max(count, 0)))


def _row_count(found: Columns) -> int:
    return len(next(iter(found.values()), ()))


def _authorize(action: int, table: str | None, column: str | None, *_: object) -> int:
    """Allow what reads the runs, and nothing else."""
    is_allowed = action in READ_ACTIONS and (action != sqlite3.SQLITE_READ or table == "runs")
    is_allowed &= not (action == sqlite3.SQLITE_FUNCTION and column == "load_extension")
    return sqlite3.SQLITE_OK if is_allowed else sqlite3.SQLITE_DENY


def _ends(text: str, k: int) -> bool:
    """Return whether a name ends at a place of a text."""
    return k == len(text) or not (text[k].isalnum() or text[k] in "_.")


def _array(name: str, values: Sequence[Any]) -> npt.NDArray[Any]:
    """Return the cells of a column as an array: integers, numbers with nan, or objects with None.

    A cell of a figure that is not a number is damaged, and has no value.
    """
    if name in (*NUMBERS, "seed"):
        values = [value if _is_number(value) else None for value in values]
    if values and all(type(value) is int and abs(value) < 2**63 for value in values):
        return np.asarray(values, np.int64)
    has_numbers = name in NUMBERS or any(map(_is_number, values))
    if has_numbers and all(value is None or _is_number(value) for value in values):
        return np.asarray([math.nan if value is None else float(value) for value in values])
    found = np.empty(len(values), object)
    found[:] = values
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _one_type(values: list[Any]) -> list[Any]:
    """Return cells of one type, which a Parquet column needs: mixed ones become texts."""
    types = {str if isinstance(value, bytes) else type(value) for value in values if value is not None}
    if len(types - {int, float}) == 0 or len(types) == 1:
        return [float(value) if types == {int, float} and value is not None else value for value in values]
    return [None if value is None else str(value) for value in values]


def _sort_key(values: tuple[Any, ...]) -> tuple[tuple[int, Any], ...]:
    """Return a key that orders values of different types: missing ones, then numbers, then texts."""
    return tuple((0, 0) if v is None else (1, v) if _is_number(v) else (2, str(v)) for v in values)


def _group(
    keys: Mapping[str, Any], rows: Sequence[tuple[Any, ...]], quantities: Sequence[str], quantiles: Sequence[float]
) -> RunGroup:
    """Return the statistics of a group.

    Its rows have the quantities, engine, versions, success, and whether the status is ok.
    """
    by_engine = Counter(engine for engine, _ in {(row[-4], row[-3]) for row in rows})
    successes = sum(bool(row[-2]) for row in rows)
    low, high = wilson_interval(successes, len(rows))
    return RunGroup(
        keys=keys,
        runs=len(rows),
        ok=sum(bool(row[-1]) for row in rows),
        success_rate=successes / len(rows),
        success_low=low,
        success_high=high,
        versions=max(by_engine.values()),
        quantities={
            name: _statistics([row[k] for row in rows if row[-1] and _is_number(row[k])], quantiles)
            for k, name in enumerate(quantities)
        },
    )


def _statistics(cells: Sequence[float], quantiles: Sequence[float]) -> QuantityStatistics:
    values = np.asarray(cells, np.float64)
    found = np.quantile(values, quantiles) if len(values) else np.full(len(quantiles), math.nan)
    return QuantityStatistics(
        count=len(values),
        mean=float(values.mean()) if len(values) else math.nan,
        deviation=float(values.std(ddof=1)) if len(values) > 1 else math.nan,
        quantiles={f"{fraction:g}": float(value) for fraction, value in zip(quantiles, found, strict=True)},
    )
