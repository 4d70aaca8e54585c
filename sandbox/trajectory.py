"""What comes out of a simulation: frames, contacts, and whole trajectories as arrays."""

import hashlib
import json
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from sandbox.whole import whole

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

LATER = frozenset({"broken_time", "energy", "account", "spin", "layer"})
"""Arrays of a trajectory that those stored by earlier versions lack."""


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """The state of N bodies at one time, in scene order. The arrays cannot be written to."""

    time: float
    """s"""
    position: FloatArray
    """(N, 2) m"""
    velocity: FloatArray
    """(N, 2) m/s"""
    angle: FloatArray
    """(N,) rad"""
    angular_velocity: FloatArray
    """(N,) rad/s"""
    present: BoolArray
    """(N,) false once removed or retired: the body then stays where it was, with no velocity"""
    roll: FloatArray | None = None
    """(N, 2) rad/s, about x and y, of spheres on a floor; none where nothing rolls"""
    layer: IntArray | None = None
    """(N,) on which each is, by its number in the scene's `layers`; none where there is one alone"""
    visits: IntArray | None = None
    """(N, Z) how each is with each zone, by the words of `scene.zone`; none where there are none"""
    drives: FloatArray | None = None
    """(D, 3) of the scene's drives: level; torque, N·m, of a plunger its pull, m, and how fast that grows, m/s"""
    passing: IntArray | None = None
    """(P, 2) who is being let through a one-way wall, and which, −1 − k; none where nobody is"""

    def __post_init__(self) -> None:
        """Freeze the arrays, which frames may share."""
        for array in self._arrays():
            array.setflags(write=False)

    @property
    def spin(self) -> FloatArray | None:
        """(N, 3) rad/s, right-handed, z up, of spheres on a floor; none where nothing rolls."""
        return None if self.roll is None else np.column_stack((self.roll, self.angular_velocity))

    def state_hash(self) -> str:
        """Return a SHA-256 of time, every body's state and every drive's, bit for bit."""
        digest = hashlib.sha256(np.float64(self.time).tobytes())
        for array in self._arrays():
            digest.update(array.tobytes())
        return digest.hexdigest()

    def _arrays(self) -> list[npt.NDArray[Any]]:
        arrays = [self.position, self.velocity, self.angle, self.angular_velocity, self.present]
        more = (self.roll, self.layer, self.visits, self.drives, self.passing)
        return arrays + [array for array in more if array is not None]


class ContactEvent(NamedTuple):
    """One contact, from its first touch on."""

    time: float
    """of the first touch, s"""
    pair: tuple[int, int]
    """body numbers, the lower first; a fixed thing is −1 − k and stands second"""
    point: tuple[float, float]
    """of the first touch, m"""
    normal: tuple[float, float]
    """of the first touch, from the first of the pair to the second"""
    impulse: tuple[float, float]
    """given by the first of the pair to the second while it lasted, N·s"""


@dataclass(frozen=True, eq=False, slots=True)
class Contacts:
    """C contacts as arrays, one row each, in the order of their first touch."""

    time: FloatArray
    """(C,) s"""
    pair: IntArray
    """(C, 2) body numbers; fixed things are −1 − k"""
    point: FloatArray
    """(C, 2) m"""
    normal: FloatArray
    """(C, 2)"""
    impulse: FloatArray
    """(C, 2) N·s"""

    @classmethod
    def none(cls) -> Self:
        """Return no contacts."""
        return cls(np.empty(0), np.empty((0, 2), np.int64), *(np.empty((0, 2)) for _ in range(3)))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Return contacts one after the other."""
        columns = ("time", "pair", "point", "normal", "impulse")
        return cls(*(np.concatenate([getattr(part, column) for part in parts]) for column in columns))

    def merged(self) -> Self:
        """Return the same with one row a contact, its impulse summed, where one that lasted was told of many times.

        One that lasts keeps the time of its first touch: rows of one time and one pair are the same contact.
        """
        if len(self) < 2:
            return self
        order = np.lexsort((self.pair[:, 1], self.pair[:, 0], self.time))  # stable: the first row told stays first
        time, pair = self.time[order], self.pair[order]
        new = np.append(True, (time[1:] != time[:-1]) | (pair[1:] != pair[:-1]).any(axis=1))
        first = np.flatnonzero(new)
        if len(first) == len(order):
            return self
        impulse = np.add.reduceat(self.impulse[order], first, axis=0)
        kept = np.argsort(order[first], kind="stable")
        rows = order[first][kept]
        return type(self)(self.time[rows], self.pair[rows], self.point[rows], self.normal[rows], impulse[kept])

    def __repr__(self) -> str:
        """Count them."""
        return f"<Contacts: {len(self):,}>"

    def some(self, which: BoolArray) -> Self:
        """Return some of them, (C,)."""
        vectors = (self.point[which], self.normal[which], self.impulse[which])
        return type(self)(self.time[which], self.pair[which], *vectors)

    def __len__(self) -> int:
        return len(self.time)

    def __iter__(self) -> Iterator[ContactEvent]:
        if not len(self):  # of most steps; five empty lists take longer than all else that asks
            return
        columns = (self.time, self.pair, self.point, self.normal, self.impulse)
        for time, *vectors in zip(*(column.tolist() for column in columns), strict=True):
            yield ContactEvent(time, *map(tuple, vectors))


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A whole run: T frames of N bodies, and its C contacts. Attributes bear the names of the stored arrays."""

    time: FloatArray
    """(T,) s"""
    position: FloatArray
    """(T, N, 2) m; a body that is not there yet is nan"""
    velocity: FloatArray
    """(T, N, 2) m/s"""
    angle: FloatArray
    """(T, N) rad"""
    angular_velocity: FloatArray
    """(T, N) rad/s"""
    names: npt.NDArray[np.str_]
    """(N,)"""
    contact_time: FloatArray
    """(C,) s"""
    contact_pair: IntArray
    """(C, 2) body numbers; −1 − k for the k-th fixed thing: planes, walls, posts, pockets, zones"""
    contact_point: FloatArray
    """(C, 2) m"""
    contact_normal: FloatArray
    """(C, 2) from the first of the pair to the second"""
    contact_impulse: FloatArray
    """(C, 2) N·s, given by the first of the pair to the second"""
    retired_time: FloatArray
    """(N,) s, when a body left world.bounds or was removed; nan where it did neither"""
    missed_time: FloatArray
    """(M,) s, start of the step in which the engine missed a contact"""
    missed_pair: IntArray
    """(M, 2) who should have touched, numbered as in `contact_pair`"""
    broken_time: FloatArray = field(default_factory=lambda: np.empty(0))
    """(J,) s, when a joint broke; nan where it did not. Empty where nothing is known of joints: none broke then"""
    energy: FloatArray = field(default_factory=lambda: np.empty(0))
    """(T,) J, of all bodies, under the gravity of each time; empty where no account was kept"""
    account: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    """(T, K) J, what each cause, as in info's `causes`, has brought by then; empty where no account was kept"""
    spin: FloatArray = field(default_factory=lambda: np.empty((0, 0, 3)))
    """(T, N, 3) rad/s, right-handed, z up, of spheres on a floor; empty where nothing rolls"""
    layer: IntArray = field(default_factory=lambda: np.empty((0, 0), np.int16))
    """(T, N) on which layer each body is, by its number in the scene's `layers`, −1 before it is there; empty where
    there is one alone"""
    info: Mapping[str, Any] = field(default_factory=dict)
    """What was run and how it went: scene (as a document), engine, settings, actions, seed, status, reason, steps,
    seconds, work, energy_start, energy_end, joint_error (the largest, as a part of a length; None without joints),
    broken (how many joints), audited, state_hash (of the end), versions; causes (names, where an account was
    kept)."""

    def __repr__(self) -> str:
        """Name scene, engine and status, and count what the arrays hold."""
        title, engine = self.info.get("scene", {}).get("title", ""), self.info.get("engine")
        about = " ".join(part for part in (repr(title) if title else "", f"on {engine}" if engine else "") if part)
        end = f" to {self.time[-1]:g} s" if len(self.time) else ""
        bodies = f"{len(self.names):,} {'body' if len(self.names) == 1 else 'bodies'}"
        counts = f"{bodies}, {len(self.time):,} frames{end}, {len(self.contact_time):,} contacts"
        return f"<Trajectory{about and ' ' + about}: {self.info.get('status', 'unknown')}, {counts}>"

    @property
    def status(self) -> str:
        """`ok`, `diverged`, `refused` or `failed`."""
        return str(self.info["status"])

    @property
    def reason(self) -> str | None:
        """Why the status is not `ok`."""
        reason = self.info["reason"]
        return None if reason is None else str(reason)

    @property
    def missed_contacts(self) -> int | None:
        """How many contacts the engine missed; unknown (None) where the run was not audited."""
        return len(self.missed_time) if self.info["audited"] else None

    def breaks(self, joints: int) -> FloatArray:
        """Return when each of so many joints broke, (J,) s; inf where it never did.

        Raises:
            ValueError: the run had another number of joints.
        """
        if not len(self.broken_time):
            return np.full(joints, np.inf)
        if len(self.broken_time) != joints:
            raise ValueError(f"the run had {len(self.broken_time):,} joints, described are {joints:,}")
        return np.where(np.isnan(self.broken_time), np.inf, self.broken_time)

    def number(self, name: str) -> int:
        """Return a body's number.

        Raises:
            KeyError: no body has that name.
        """
        found = np.flatnonzero(self.names == name)
        if not len(found):
            raise KeyError(name)
        return int(found[0])

    def at(self, frames: list[int]) -> Self:
        """Return the trajectory with only some of its frames, by their numbers."""
        keys = ["time", "position", "velocity", "angle", "angular_velocity"]
        if len(self.energy):
            keys += ["energy", "account"]
        if len(self.spin):
            keys.append("spin")
        if len(self.layer):
            keys.append("layer")
        return replace(self, **{key: getattr(self, key)[frames] for key in keys})

    def save(self, path: str | Path) -> Path:
        """Write the arrays as one compressed `.npz`, to a temporary name first: never half a file."""
        path = Path(path)
        without = {"info", *(key for key in ("spin", "layer") if not len(getattr(self, key)))}
        arrays = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in without}
        arrays["info"] = np.asarray(json.dumps(dict(self.info), ensure_ascii=False))
        with whole(path) as temporary, temporary.open("xb") as stream:
            np.savez_compressed(stream, **arrays)
        return path

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote.

        Raises:
            OSError: the file cannot be opened.
            ValueError: it is no stored trajectory, or damaged.
        """
        with Path(path).open("rb") as stream:
            try:
                with np.lib.npyio.NpzFile(stream, allow_pickle=False) as arrays:
                    missing = {f.name for f in fields(cls)} - set(arrays.files) - LATER
                    if missing:
                        raise ValueError(f"it has no {', '.join(sorted(missing))}")
                    values = {f.name: arrays[f.name] for f in fields(cls) if f.name in arrays.files}
                return cls(**{**values, "info": json.loads(str(values["info"]))})
            except (ValueError, EOFError, OSError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
                raise ValueError(f"{path} is no stored run: {error}") from None
