"""Tables of a run, with a row for each frame and body, or for each contact, as csv or parquet.

Numbers are written so that reading them gives the same bits. Rows are written in chunks, so a table needs little memory
besides the run itself.
"""

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from sandbox.atomic_write import atomic_write
from sandbox.jsonable import to_json
from sandbox.trajectory import Trajectory

STATES = ("time", "body", "x", "y", "vx", "vy", "angle", "angular_velocity", "present")
"""Columns of states, SI units; nan for a body that does not exist yet."""
CONTACTS = ("time", "a", "b", "point_x", "point_y", "normal_x", "normal_y", "impulse_x", "impulse_y")
"""Columns of contacts, SI units; `a` and `b` are names."""
CHUNK = 1 << 16
"""Rows of a chunk, about 10 MB."""
METADATA = "sandbox"
"""Key of the metadata of a parquet file"""
NEEDS_PARQUET = 'parquet needs the `parquet` extra: pip install -e ".[parquet]"; csv works without it'

ColumnValues = npt.NDArray[Any] | tuple[npt.NDArray[np.int64], list[str]]
"""Values, or for texts the indices into a list of them."""


class MissingExtraError(Exception):
    """A required library is not installed; `str()` has the command that installs it."""


def can_write_parquet() -> bool:
    """Return whether the `parquet` extra is installed."""
    return find_spec("pyarrow") is not None


def write_states(trajectory: Trajectory, path: Path) -> int:
    """Write a row for each frame and body, in the order of both, and return the number of rows.

    Args:
        trajectory: the run.
        path: path of the file, ending in `.csv` or `.parquet`.

    Raises:
        OSError: the file cannot be written.
        MissingExtraError: parquet without its extra.
        ValueError: another suffix.
    """
    return _write(STATES, _states(trajectory), path, trajectory.info)


def write_contacts(trajectory: Trajectory, fixed_names: Sequence[str], path: Path) -> int:
    """Write a row for each contact, in the order of their first touch, and return the number of rows.

    Args:
        trajectory: the run.
        fixed_names: names of the static objects of its scene.
        path: path of the file, ending in `.csv` or `.parquet`.

    Raises:
        OSError: the file cannot be written.
        MissingExtraError: parquet without its extra.
        ValueError: another suffix.
    """
    return _write(CONTACTS, _contacts(trajectory, fixed_names), path, trajectory.info)


def _states(run: Trajectory) -> Iterator[list[ColumnValues]]:
    """Yield the columns of `STATES` in chunks of frames and bodies."""
    count, names = len(run.names), [str(name) for name in run.names.tolist()]
    frames = max(1, CHUNK // max(count, 1))
    for begin in range(0, len(run.time) if count else 0, frames):
        rows = slice(begin, begin + frames)
        for first in range(0, count, CHUNK):
            bodies = slice(first, first + CHUNK)
            time = run.time[rows]
            numbers = np.arange(count)[bodies]
            position, velocity = run.position[rows, bodies], run.velocity[rows, bodies]
            is_retired = time[:, None] >= run.retired_time[bodies]  # false where it is nan
            present = ~is_retired & ~np.isnan(position).all(axis=2)
            yield [
                np.repeat(time, len(numbers)),
                (np.tile(numbers, len(time)), names),
                *(position[..., k].ravel() for k in (0, 1)),
                *(velocity[..., k].ravel() for k in (0, 1)),
                run.angle[rows, bodies].ravel(),
                run.angular_velocity[rows, bodies].ravel(),
                present.ravel(),
            ]


def _contacts(run: Trajectory, fixed_names: Sequence[str]) -> Iterator[list[ColumnValues]]:
    """Yield the columns of `CONTACTS` in chunks."""
    # Static geometry has the numbers −1 − k: its names come last, in reverse order, as negative indices count.
    names = [*(str(name) for name in run.names.tolist()), *reversed(fixed_names)]
    for begin in range(0, len(run.contact_time), CHUNK):
        rows = slice(begin, begin + CHUNK)
        pair = np.where(run.contact_pair[rows] < 0, run.contact_pair[rows] + len(names), run.contact_pair[rows])
        vectors = (run.contact_point[rows], run.contact_normal[rows], run.contact_impulse[rows])
        yield [
            run.contact_time[rows],
            *((pair[:, k], names) for k in (0, 1)),
            *(vector[:, k] for vector in vectors for k in (0, 1)),
        ]


def _write(columns: Sequence[str], chunks: Iterator[list[ColumnValues]], path: Path, info: Mapping[str, Any]) -> int:
    match path.suffix.lower():
        case ".csv":
            with atomic_write(path) as temporary:
                return _write_csv(columns, chunks, temporary)
        case ".parquet":
            if not can_write_parquet():
                raise MissingExtraError(NEEDS_PARQUET)
            with atomic_write(path) as temporary:
                return _write_parquet(columns, chunks, temporary, info)
        case suffix:
            raise ValueError(f"a table ends in .csv or .parquet, not {suffix!r}")


def _write_csv(columns: Sequence[str], chunks: Iterator[list[ColumnValues]], path: Path) -> int:
    rows = 0
    with path.open("x", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for chunk in chunks:
            plain = [_listed(column) for column in chunk]
            writer.writerows(zip(*plain, strict=True))  # floats by their repr, the shortest that reads the same
            rows += len(plain[0])
    return rows


def _listed(column: ColumnValues) -> list[Any]:
    if isinstance(column, tuple):
        numbers, names = column
        return [names[number] for number in numbers.tolist()]
    if column.dtype == np.bool_:
        return ["true" if value else "false" for value in column.tolist()]
    return list(column.tolist())


def _write_parquet(
    columns: Sequence[str], chunks: Iterator[list[ColumnValues]], path: Path, info: Mapping[str, Any]
) -> int:
    """Write a table; its metadata have the `info` of the run, with scene, settings and versions, as JSON."""
    import pyarrow as pa
    from pyarrow import parquet

    words = pa.dictionary(pa.int32(), pa.string())
    kinds = {"body": words, "a": words, "b": words, "present": pa.bool_()}
    fields = [(column, kinds.get(column, pa.float64())) for column in columns]
    schema = pa.schema(fields, metadata={METADATA: json.dumps(to_json(info), ensure_ascii=False)})

    def array(column: ColumnValues) -> Any:
        if isinstance(column, tuple):
            numbers, names = column
            used, codes = np.unique(numbers, return_inverse=True)
            texts = [names[number] for number in used.tolist()]
            return pa.DictionaryArray.from_arrays(pa.array(codes.astype(np.int32)), pa.array(texts, pa.string()))
        return pa.array(np.ascontiguousarray(column))

    rows = 0
    with path.open("xb") as stream, parquet.ParquetWriter(stream, schema) as writer:
        for chunk in chunks:
            batch = pa.RecordBatch.from_arrays([array(column) for column in chunk], schema=schema)
            writer.write_batch(batch)
            rows += batch.num_rows
    return rows
