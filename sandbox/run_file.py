"""Run files: the `.npz` file of a stored run, which is validated completely when it is read.

Sizes are checked first, so that a damaged header or a decompression bomb allocates nothing: the members of the archive,
then the header of each array against its size in the archive, against the other arrays, and against the free memory.
Then `info` is validated as a typed model, and the contents of the arrays against the scene in `info`.

The format: a zip archive with one `.npy` member for each array of `Trajectory`, of native byte order and without
pickled objects, and `info`, a JSON object as an array of one text.
"""

import errno
import json
import os
import re
import struct
import sys
import zipfile
import zlib
from collections.abc import Mapping
from functools import cache
from math import prod
from pathlib import Path
from typing import IO, Annotated, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from sandbox.action import Action, Spawn, dt_changes
from sandbox.arrays import state_hash
from sandbox.echo import MAX_NAMED, printable, shorten
from sandbox.resource_limits import CONTACTS, FREE_FRACTION, SESSION_SIZE, TooLargeError, free_memory
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Name
from sandbox.scene.description.scene import first_sensor
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_session

Array = npt.NDArray[Any]

SHAPES: dict[str, tuple[str | int, ...]] = {
    "time": ("T",),
    "names": ("N",),
    "contact_time": ("C",),
    "missed_time": ("M",),
    "position": ("T", "N", 2),
    "velocity": ("T", "N", 2),
    "angle": ("T", "N"),
    "angular_velocity": ("T", "N"),
    "contact_pair": ("C", 2),
    "contact_point": ("C", 2),
    "contact_normal": ("C", 2),
    "contact_impulse": ("C", 2),
    "retired_time": ("N",),
    "missed_pair": ("M", 2),
    "broken_time": ("J",),
    "contact_end": ("C",),
    "energy": ("E",),
    "account": ("E", "K"),
    "spin": ("T", "N", 3),
    "layer": ("T", "N"),
    "info": (),
}
"""Shapes of the arrays; a letter is a length, which the first array with that letter determines."""

KINDS = {"names": "U", "info": "U", "contact_pair": "i8", "missed_pair": "i8", "layer": "i"}
"""Types of the arrays that are not float64: text, int64, and integers of any width."""

OPTIONAL = frozenset({"broken_time", "contact_end", "energy", "account", "spin", "layer"})
"""Arrays that are missing in runs of earlier versions, or of scenes without joints, energy accounting and so on."""

EMPTY = {"spin": (0, 0, 3), "layer": (0, 0)}
"""Shapes of arrays that may be stored without values."""

DAMAGE = (ValueError, EOFError, RuntimeError, OverflowError, struct.error, zipfile.BadZipFile, zlib.error)
"""Exceptions raised by reading a damaged archive, besides OSError and MemoryError."""

MAX_DIRECTORY = 64 * 2**10
"""Largest size of the archive's directory, bytes, which zipfile reads at once; the 20 members of a run take 1 KiB."""

_END = struct.Struct("<4s4H2LH")
"""End of central directory: signature, disks and counts, size and offset of the directory, length of a comment."""
_LOCATOR = struct.Struct("<4sLQL")
_END_64 = struct.Struct("<4sQ2H2L4Q")
"""Zip64 end of central directory, of archives beyond 4 GiB: its size is the last but one value."""

BYTES_PER_CHARACTER = 4
"""of text in a numpy array"""

_HEADER = re.compile(
    rb"\{'descr': '([<>|=]?)([a-zA-Z]\d{0,9})', 'fortran_order': (?:True|False), "
    rb"'shape': \((|\d{1,18},|\d{1,18}(?:, \d{1,18})+)\), \} *\n"
)
"""Header as numpy writes it; other headers are of records or objects, which no run has."""

Finite = Annotated[float, Field(allow_inf_nan=False)]
Time = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
"""s"""
StoredCount = Annotated[int, Field(ge=0, lt=2**63)]
StoredNumber = Annotated[int, Field(gt=-(2**63), lt=2**63)] | Finite


class StoredPart(BaseModel):
    """A strict part of `info`. Keys of later versions are ignored."""

    model_config = ConfigDict(strict=True, extra="ignore", frozen=True)


class GameInfo(StoredPart):
    """Game that was played, as `HeadlessGame.to_dict` returns it."""

    name: str = ""
    player: str | None = None
    score: StoredNumber
    over: str | None = None
    lines: tuple[tuple[str, str], ...] = ()
    presses: tuple[tuple[Time, str, Finite], ...] = ()
    otherwise: Time | None = None
    log: tuple[tuple[Time, str], ...] = ()
    lamps: tuple[tuple[Time, tuple[str, ...]], ...] = ()


class WorstJointInfo(StoredPart):
    """The joint with the largest relative error of a run."""

    name: str
    error: float
    """m or rad; may be infinite after a divergence"""
    unit: Literal["m", "rad"]


class Info(StoredPart):
    """Description and results of a run, as `measure.run` writes them. Earlier versions lack the keys with defaults."""

    scene: dict[str, Any]
    """a scene document, which is validated separately"""
    engine: Name
    settings: Settings
    actions: tuple[Action, ...] = ()
    seed: StoredCount
    versions: dict[str, str]
    status: Literal["ok", "diverged", "refused", "failed"]
    reason: str | None
    warnings: tuple[str, ...] = ()
    steps: StoredCount
    seconds: Annotated[Finite, Field(ge=0)]
    work: dict[str, Annotated[StoredNumber, Field(ge=0)]] = Field(default_factory=dict)
    audited: bool
    state_hash: str | None = None
    energy_start: float | None
    """J; may be infinite or nan after a divergence"""
    energy_end: float | None
    joint_error: float | None = None
    worst_joint: WorstJointInfo | None = None
    broken: StoredCount = 0
    causes: tuple[str, ...] = ()
    game: GameInfo | None = None


@cache
def _names() -> TypeAdapter[list[Name]]:
    """Return the validator of names, which is built when it is first needed."""
    return TypeAdapter(list[Name])


class _Header(NamedTuple):
    """Header of a stored array."""

    member: zipfile.ZipInfo
    kind: str
    """numpy's type code without the byte order"""
    shape: tuple[int, ...]

    def __str__(self) -> str:
        """Return shape and type, such as `51 x 1 x 2 of float64`."""
        return f"{_shape_name(self.shape)} of {_type_name(self.kind)}"


def read_run_file(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Read a stored run: the arrays that it has, by their names in `Trajectory`, and `info`.

    Raises:
        OSError: the file cannot be opened or read.
        TooLargeError: the arrays would not fit into memory.
        ValueError: the file is not a stored run, or is damaged. `str()` has the file, the array or key, and the fault.
    """
    with path.open("rb") as stream:
        try:
            _check_directory(stream)
            with zipfile.ZipFile(stream) as archive:
                headers = _headers(archive)
                lengths = _check_shapes(headers)
                _check_memory(headers)
                stated = _read_info(archive, headers.pop("info"))
                _check_lengths(lengths, stated)
                arrays = {name: _read(archive, header) for name, header in headers.items()}
            _check_contents(arrays, stated.scene, stated.info)
            _check_completed(arrays, stated)
        except TooLargeError as error:
            raise TooLargeError(f"{path}: {error}") from None
        except MemoryError:
            raise TooLargeError(f"{path}: does not fit into memory") from None
        except OSError as error:
            if error.errno != errno.EINVAL:  # a damaged file may state a position before its start
                raise
            raise _fault(path, error) from None
        except DAMAGE as error:
            raise _fault(path, error) from None
    return arrays, stated.document


def _fault(path: Path, error: Exception) -> ValueError:
    message = printable(shorten(str(error), MAX_NAMED)) or type(error).__name__
    return ValueError(f"{path} is not a stored run: {message}")


def _check_directory(stream: IO[bytes]) -> None:
    """Check the size of an archive's directory, because zipfile creates an object for each entry.

    Source: .ZIP file format specification (APPNOTE), 4.3.14 to 4.3.16. Archives that numpy writes have no comment.

    Raises:
        ValueError: the end of the archive is not as numpy writes it, or its directory is larger than that of any run.
    """
    longest = _END_64.size + _LOCATOR.size + _END.size
    stream.seek(-min(stream.seek(0, os.SEEK_END), longest), os.SEEK_END)
    tail = stream.read(longest).rjust(longest, b"\0")
    signature, *_, size, _, comment = _END.unpack(tail[-_END.size :])
    if signature != b"PK\5\6" or comment:
        raise ValueError("the end of the archive is missing")
    if tail[_END_64.size :].startswith(b"PK\6\7"):
        signature, *_, size, _ = _END_64.unpack(tail[: _END_64.size])
        if signature != b"PK\6\6":
            raise ValueError("the end of the archive is damaged")
    if size > MAX_DIRECTORY:
        raise ValueError(f"the directory of the archive takes {size:,} bytes; that of a run {MAX_DIRECTORY:,} at most")


def _headers(archive: zipfile.ZipFile) -> dict[str, _Header]:
    """Read the header of every array; arrays of other names are ignored.

    Raises:
        ValueError: an array is missing, occurs twice, or is not stored as numpy stores arrays.
    """
    headers: dict[str, _Header] = {}
    for member in archive.infolist():
        name = member.filename.removesuffix(".npy")
        if name not in SHAPES or name == member.filename:
            continue
        if name in headers:
            raise ValueError(f"it has {name} twice")
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or member.flag_bits & 1:
            raise ValueError(f"{name} is encrypted, or compressed by another method than deflate")
        with archive.open(member) as stream:
            headers[name] = _header(name, member, stream)
    missing = sorted(SHAPES.keys() - headers.keys() - OPTIONAL)
    if missing:
        raise ValueError(f"it has no {', '.join(missing)}")
    return {name: headers[name] for name in SHAPES if name in headers}


def _header(name: str, member: zipfile.ZipInfo, stream: IO[bytes]) -> _Header:
    start = stream.read(8)
    length_as = {b"\x93NUMPY\x01\x00": "<H", b"\x93NUMPY\x02\x00": "<I", b"\x93NUMPY\x03\x00": "<I"}.get(start)
    if length_as is None:
        raise ValueError(f"{name} is not an array")
    start += stream.read(struct.calcsize(length_as))
    (length,) = struct.unpack(length_as, start[8:])
    found = _HEADER.fullmatch(stream.read(length)) if length < 2**16 else None
    if found is None:
        raise ValueError(f"{name} is not an array of numbers or text")
    order, kind, shape = found[1].decode(), found[2].decode(), tuple(map(int, re.findall(rb"\d+", found[3])))
    width = int(kind[1:] or 0)
    if kind[0] not in "biufcSU" or (order and width > 1 and np.dtype(f"{order}i4") != np.dtype("i4")):
        raise ValueError(f"{name} is of {_type_name(order + kind)}, not {_type_name(KINDS.get(name, 'f8'))}")
    size = prod(shape) * width * (BYTES_PER_CHARACTER if kind[0] == "U" else 1)
    stored = member.file_size - len(start) - length
    if size != stored:
        raise ValueError(
            f"{name} is {_shape_name(shape)} of {_type_name(kind)}, {size:,} bytes, but there are {stored:,}"
        )
    return _Header(member, kind, shape)


def _check_shapes(headers: Mapping[str, _Header]) -> dict[str, int]:
    """Check types and shapes of the arrays against each other; return the length for each letter.

    Raises:
        ValueError: an array has another type or shape.
    """
    lengths: dict[str, int] = {}
    for name, header in headers.items():
        kind, shape = KINDS.get(name, "f8"), SHAPES[name]
        if len(header.shape) == len(shape):
            for letter, length in zip(shape, header.shape, strict=True):
                if isinstance(letter, str):
                    lengths.setdefault(letter, length)
        wanted = tuple(lengths.get(letter, letter) if isinstance(letter, str) else letter for letter in shape)
        if not header.kind.startswith(kind) or header.shape not in (wanted, EMPTY.get(name)):
            raise ValueError(f"{name} is {header}, not {_shape_name(wanted)} of {_type_name(kind)}")
    return lengths


def _check_memory(headers: Mapping[str, _Header]) -> None:
    """Check that the arrays fit into memory.

    Raises:
        TooLargeError: they do not.
    """
    free, size = int(free_memory() * FREE_FRACTION), sum(header.member.file_size for header in headers.values())
    if size > free:
        raise TooLargeError(f"its arrays take {size / 1e9:.3g} GB, but {free / 1e9:.3g} GB can be used")
    refusal = SESSION_SIZE.refusal("its info has a size of", headers["info"].member.file_size // BYTES_PER_CHARACTER)
    if refusal is not None:
        raise TooLargeError(refusal)


class _Stated(NamedTuple):
    """`info` as stored and as a model, and its scene."""

    document: dict[str, Any]
    info: Info
    scene: Scene


def _read_info(archive: zipfile.ZipFile, header: _Header) -> _Stated:
    """Read and validate `info` and its scene.

    Raises:
        ValueError: `info` or its scene is invalid.
    """
    text = str(_read(archive, header))
    try:
        model = Info.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        hint = "; add your own with sandbox.add_integrator first" if first["loc"][-1:] == ("integrator",) else ""
        raise ValueError(f"{'.'.join(('info', *map(str, first['loc'])))}: {first['msg']}{hint}") from None
    document: dict[str, Any] = json.loads(text, parse_int=_integer)
    try:
        scene = from_session(document["scene"], "info.scene")
    except SceneError as error:
        raise ValueError(str(error.faults[0])) from None
    return _Stated(document, model, scene)


def _integer(text: str) -> int:
    """Read an integer. The model reads integers of any length as floats.

    Raises:
        ValueError: the integer has more than 64 bits, which no run writes.
    """
    value = int(text)
    if not -(2**63) <= value < 2**63:
        raise ValueError(f"info: an integer of {len(text)} digits")
    return value


def _check_lengths(lengths: Mapping[str, int], stated: _Stated) -> None:
    """Check the lengths of the arrays against `info`.

    Raises:
        TooLargeError: there are more contacts than the limit of a run.
        ValueError: the lengths differ from those of the run in `info`.
    """
    info, scene = stated.info, stated.scene
    frames, bodies, known = lengths["T"], lengths["N"], len(scene.bodies)
    spawned = scene.spawned_by_events + sum(isinstance(action, Spawn) for action in info.actions)
    without = info.status == "refused" or (
        info.status == "failed" and info.steps == 0
    )  # such as a run that exceeded its time limit
    if (frames == 0 and not without) or (frames > 0 and info.status == "refused") or frames > info.steps + 2:
        raise ValueError(f"time has {frames:,} frames of a run of {info.steps:,} steps that is {info.status}")
    if not known <= bodies <= known + spawned:
        raise ValueError(f"names has {bodies:,} bodies, but info.scene {known:,}, and {spawned:,} were spawned")
    refusal = CONTACTS.refusal("its contacts are", max(lengths["C"], lengths["M"]))
    if refusal:
        raise TooLargeError(refusal)
    joints, accounted, causes = (lengths.get(letter, 0) for letter in "JEK")
    if joints and joints != len(scene.joint_arrays):
        raise ValueError(f"broken_time has {joints:,} joints, but info.scene {len(scene.joint_arrays):,}")
    if accounted not in (0, frames):
        raise ValueError(f"energy has {accounted:,} values of {frames:,} frames")
    if causes != (len(info.causes) if accounted else 0):
        raise ValueError(f"account has {causes:,} causes, but info.causes names {len(info.causes):,}")


def _check_contents(arrays: Mapping[str, Array], scene: Scene, info: Info) -> None:
    """Check the contents of the arrays. States of bodies may be any numbers here, because a run may have diverged.

    Raises:
        ValueError: a time, a name or an index is not one of this run.
    """
    time, fixed, bodies = arrays["time"], len(scene.fixed_names), len(arrays["names"])
    for name in ("time", "contact_time"):
        times = arrays[name]
        if not (np.isfinite(times).all() and (times >= 0.0).all() and (times[1:] >= times[:-1]).all()):
            raise ValueError(f"{name}: its times do not increase from 0")
    # Engines that make whole steps only end up to a step after the duration.
    longest = max([info.settings.dt, *(dt for _, dt in dt_changes(info.actions))])
    end = scene.world.duration * (1.0 + 1e-6)  # rounding
    if len(time) and (time[-1] > end + longest or (time[:-1] > end).any()):
        raise ValueError(f"time ends at {time[-1]:g} s, after the scene's duration of {scene.world.duration:g} s")
    if not (arrays["missed_time"] >= 0.0).all():
        raise ValueError("missed_time: a time is not a number ≥ 0")
    for name in ("retired_time", "broken_time"):
        times = arrays.get(name, np.empty(0))
        if not (np.isnan(times) | (np.isfinite(times) & (times >= 0.0))).all():
            raise ValueError(f"{name}: a time is neither nan nor a number ≥ 0")
    ends = arrays.get("contact_end", np.empty(0))
    if len(ends) and not (np.isnan(ends) | (np.isfinite(ends) & (ends >= arrays["contact_time"]))).all():
        raise ValueError("contact_end: a time is neither nan nor a number ≥ contact_time")
    for name in ("contact_pair", "missed_pair"):
        pair = arrays[name]
        is_visit = pair[:, 1] <= first_sensor(scene)  # a sensor, with a body or static object
        lowest = np.where(is_visit, -len(scene.fixed), 0)
        if (pair[:, 0] < lowest).any() or (pair[:, 1] < -fixed).any() or pair.max(initial=-1) > bodies - 1:
            raise ValueError(f"{name}: refers to an object that the scene does not have")
    layer = arrays.get("layer", np.empty(0, np.int16))
    if layer.size and not (layer.min() >= -1 and layer.max() < len(scene.layers)):
        raise ValueError(f"layer: a number is not one of the scene's {len(scene.layers)} layers")
    names = arrays["names"].tolist()
    try:
        _names().validate_python(names)
    except ValidationError as error:
        raise ValueError(f"names: a name is invalid: {error.errors()[0]['msg']}") from None
    if len(set(names)) < len(names) or tuple(names[: len(scene.bodies)]) != tuple(scene.bodies.names):
        raise ValueError("names: the bodies are not those of info.scene")


def _check_completed(arrays: Mapping[str, Array], stated: _Stated) -> None:
    """Check the states of a run that ended without a failure, and its last one against the hash in `info`.

    The hash covers more than the arrays if the scene has layers, zones, drives or one-way walls, and the removal of
    bodies is not stored exactly: there it is not compared.

    Raises:
        ValueError: a state is not finite, two frames have the same time, or the last state is not that of the run.
    """
    info, scene, time = stated.info, stated.scene, arrays["time"]
    if info.status != "ok" or not len(time):
        return
    if (time[1:] <= time[:-1]).any():
        raise ValueError("time: two frames of a complete run have the same time")
    known = len(scene.bodies)  # a body has no state before it is spawned
    for name in ("position", "velocity", "angle", "angular_velocity"):
        if not np.isfinite(arrays[name][:, :known]).all():
            raise ValueError(f"{name}: has values that are not finite, although the run is complete")
    has_one_way = scene.bodies.one_way or any(wall.one_way for wall in scene.walls)
    hidden = len(scene.layers) > 1 or scene.zones or scene.drives or has_one_way
    if info.state_hash is None or hidden or not np.isnan(arrays["retired_time"]).all():
        return
    last = [arrays[name][-1] for name in ("position", "velocity", "angle", "angular_velocity")]
    last.append(np.ones(len(arrays["names"]), np.bool_))
    spin = arrays.get("spin", np.empty(0))
    if spin.size:
        last.append(spin[-1, :, :2])
    # A complete run ends at the stated duration, and its engine at a whole number of steps, which differ by rounding.
    dt, end = info.settings.dt, float(time[-1])
    if all(state_hash(each, last) != info.state_hash for each in (end, round(end / dt) * dt)):
        raise ValueError("the last state is not the one whose hash is in info")


def _read(archive: zipfile.ZipFile, header: _Header) -> Array:
    with archive.open(header.member) as stream:
        array: Array = np.lib.format.read_array(stream, allow_pickle=False)
    if array.dtype.kind == "U" and np.frombuffer(array.tobytes(), np.uint32).max(initial=0) > sys.maxunicode:
        raise ValueError(f"{header.member.filename.removesuffix('.npy')} contains invalid characters")
    return array


def _shape_name(shape: tuple[str | int, ...]) -> str:
    return " x ".join(map(str, shape)) or "one value"


def _type_name(code: str) -> str:
    """Return the name of a type by its numpy code, with or without a width."""
    names = {"U": "text", "i": "integers", "f8": "float64", "i8": "int64", "f4": "float32", "i4": "int32"}
    return names.get(code) or names.get(code[:1], f"type {code}")
