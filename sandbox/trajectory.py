"""Results of a simulation: frames, contacts, and whole trajectories as arrays."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray, state_hash
from sandbox.atomic_write import atomic_write
from sandbox.echo import MAX_MESSAGE, short_repr, shorten
from sandbox.html_repr import HtmlRepr

REST_SPEED = 1e-9
"""m/s and rad/s: rounding errors of a body at rest are below it, and engines stop bodies at far higher speeds"""


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """State of N bodies at one time, in scene order. The arrays are read-only."""

    time: float
    """s, simulated time"""
    position: FloatArray
    """(N, 2) m, centres of mass"""
    velocity: FloatArray
    """(N, 2) m/s"""
    angle: FloatArray
    """(N,) rad, counter-clockwise"""
    angular_velocity: FloatArray
    """(N,) rad/s"""
    present: BoolArray
    """(N,) false once a body has been removed or retired; it then keeps its last position and has zero velocity"""
    roll: FloatArray | None = None
    """(N, 2) rad/s, angular velocity about x and y of spheres on a `[surface]`; None without a surface"""
    layer: IntArray | None = None
    """(N,) index of the collision layer of each body in `scene.layers`; None if the scene has a single layer"""
    visits: IntArray | None = None
    """(N, Z) state of each body in each zone: 0 outside, 1 inside, 2 held at the centre, 3 released but still inside;
    None without zones"""
    drives: FloatArray | None = None
    """(D, 3) state of each drive: level; torque in N·m, or pull of a plunger in m; rate of that pull in m/s. None
    without drives"""
    passing: IntArray | None = None
    """(P, 2) pairs of a body and the one-way wall, −1 − k, or one-way body that it is passing; None without
    any"""

    def __post_init__(self) -> None:
        """Freeze the arrays, which frames may share."""
        state = self.position, self.velocity, self.angle, self.angular_velocity, self.present
        for array in (*state, self.roll, self.layer, self.visits, self.drives, self.passing):
            if array is not None:
                array.setflags(write=False)

    def __repr__(self) -> str:
        """Return the time, the number of bodies and the largest speed."""
        count = int(np.count_nonzero(self.present))
        removed = len(self.present) - count
        with np.errstate(invalid="ignore", over="ignore"):
            fastest = float(np.hypot(*self.velocity[self.present].T).max()) if count else 0.0
        bodies = _bodies(len(self.present)) + (f", {removed:,} removed" if removed else "")
        return f"<Frame at {self.time:g} s: {bodies}, largest speed {fastest:.4g} m/s>"

    @property
    def is_at_rest(self) -> bool:
        """Whether no body moves or turns, up to `REST_SPEED`."""
        rates = (self.velocity, self.angular_velocity, *(() if self.roll is None else (self.roll,)))
        return all(float(np.abs(rate).max(initial=0.0)) <= REST_SPEED for rate in rates)

    @property
    def spin(self) -> FloatArray | None:
        """(N, 3) rad/s, angular velocity of spheres on a `[surface]`, right-handed, z up; None without a surface."""
        return None if self.roll is None else np.column_stack((self.roll, self.angular_velocity))

    def state_hash(self) -> str:
        """Return a SHA-256 hash of the time and of the exact state of all bodies and drives."""
        return state_hash(self.time, self._arrays())

    def _arrays(self) -> list[npt.NDArray[Any]]:
        arrays = [self.position, self.velocity, self.angle, self.angular_velocity, self.present]
        more = (self.roll, self.layer, self.visits, self.drives, self.passing)
        return arrays + [array for array in more if array is not None]


def _bodies(count: int) -> str:
    return f"{count:,} {'body' if count == 1 else 'bodies'}"


class ContactEvent(NamedTuple):
    """One contact of two bodies, or of a body and a fixed object."""

    time: float
    """s, time of the first touch"""
    pair: tuple[int, int]
    """body indices, the lower first; a fixed object is −1 − k and comes second, as does a sensor with any object"""
    point: tuple[float, float]
    """m, contact point at the first touch"""
    normal: tuple[float, float]
    """unit vector at the first touch, from the first of the pair to the second"""
    impulse: tuple[float, float]
    """N·s, total impulse of the first of the pair on the second"""


class SensorVisit(NamedTuple):
    """A visit of a sensor: an object overlapped it at the end of each step from `begin` to before `end`."""

    sensor: str
    """name of the sensor"""
    object: str
    """name of the body or static object"""
    begin: float
    """s, end of the first step after which they overlapped, or the start of the recording"""
    end: float
    """s, end of the first step after which they did not; nan if they overlap still"""


@dataclass(frozen=True, eq=False, slots=True)
class Contacts:
    """C contacts as arrays, one row each, ordered by the time of the first touch."""

    time: FloatArray
    """(C,) s, time of the first touch"""
    pair: IntArray
    """(C, 2) body indices; a fixed object is −1 − k"""
    point: FloatArray
    """(C, 2) m, contact point at the first touch"""
    normal: FloatArray
    """(C, 2) unit vector from the first of the pair to the second"""
    impulse: FloatArray
    """(C, 2) N·s, impulse on the second of the pair"""

    @classmethod
    def none(cls) -> Self:
        """Return an empty set of contacts."""
        return cls(np.empty(0), np.empty((0, 2), np.int64), *(np.empty((0, 2)) for _ in range(3)))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Concatenate sets of contacts."""
        columns = ("time", "pair", "point", "normal", "impulse")
        return cls(*(np.concatenate([getattr(part, column) for part in parts]) for column in columns))

    def merged(self) -> Self:
        """Return the contacts with rows of equal time and pair merged into one; their impulses are summed.

        A contact that lasts for several steps has one row a step, each with the time of the first touch.
        """
        if len(self) < 2:
            return self
        order = np.lexsort((self.pair[:, 1], self.pair[:, 0], self.time))  # stable: the first recorded row stays first
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
        """Return the number of contacts, and the earliest and latest first touch."""
        span = f", first touches from {self.time.min():.6g} to {self.time.max():.6g} s" if len(self) else ""
        return f"<Contacts: {len(self):,}{span}>"

    def some(self, which: BoolArray) -> Self:
        """Return the contacts selected by a boolean mask, (C,)."""
        vectors = (self.point[which], self.normal[which], self.impulse[which])
        return type(self)(self.time[which], self.pair[which], *vectors)

    def __len__(self) -> int:
        return len(self.time)

    def __iter__(self) -> Iterator[ContactEvent]:
        if not len(self):  # most steps have none; making five empty lists takes longer than everything else here
            return
        columns = (self.time, self.pair, self.point, self.normal, self.impulse)
        for time, *vectors in zip(*(column.tolist() for column in columns), strict=True):
            yield ContactEvent(time, *map(tuple, vectors))


class RunFailedError(RuntimeError):
    """A run was refused, diverged or failed.

    Attributes:
        run: the run, with the frames up to its end.
    """

    def __init__(self, run: "Trajectory") -> None:
        super().__init__(f"{run.info['engine']}: {run.status}: {run.reason}")
        self.run = run

    def __reduce__(self) -> tuple[type[Self], tuple["Trajectory"]]:
        """Keep the run when the error is pickled for another process."""
        return type(self), (self.run,)


@dataclass(frozen=True, eq=False)
class Trajectory(HtmlRepr):
    """Recorded run: T frames of N bodies, and C contacts. The attributes are the arrays of a stored run."""

    time: FloatArray
    """(T,) s, simulated time of each frame"""
    position: FloatArray
    """(T, N, 2) m, centres of mass; nan before a body is added"""
    velocity: FloatArray
    """(T, N, 2) m/s"""
    angle: FloatArray
    """(T, N) rad, counter-clockwise"""
    angular_velocity: FloatArray
    """(T, N) rad/s"""
    names: npt.NDArray[np.str_]
    """(N,) names of the bodies"""
    contact_time: FloatArray
    """(C,) s, time of the first touch"""
    contact_pair: IntArray
    """(C, 2) body indices from 0; −1 − k for the k-th fixed object, in the order planes, walls, posts, pockets, zones,
    sensors. Visits of zones and sensors have such a second index; the first is a body, or a static object in a sensor
    """
    contact_point: FloatArray
    """(C, 2) m, contact point at the first touch"""
    contact_normal: FloatArray
    """(C, 2) unit vector from the first of the pair to the second"""
    contact_impulse: FloatArray
    """(C, 2) N·s, impulse on the second of the pair, summed over the contact"""
    retired_time: FloatArray
    """(N,) s, time at which a body left `world.bounds`, reached the end of its lifetime or was removed; nan if it did
    not"""
    missed_time: FloatArray
    """(M,) s, start of the substep in which the engine missed a contact"""
    missed_pair: IntArray
    """(M, 2) the pair whose contact was missed, with the indices of `contact_pair`"""
    broken_time: FloatArray = field(default_factory=lambda: np.empty(0))
    """(J,) s, time at which a joint broke; nan if it did not. Empty if the scene has no joints"""
    energy: FloatArray = field(default_factory=lambda: np.empty(0))
    """(T,) J, kinetic and potential energy of all bodies; empty without energy accounting"""
    account: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    """(T, K) J, cumulative energy change by each cause in `info["causes"]`; empty without energy accounting"""
    spin: FloatArray = field(default_factory=lambda: np.empty((0, 0, 3)))
    """(T, N, 3) rad/s, angular velocity of spheres on a `[surface]`, right-handed, z up; empty without a surface"""
    layer: IntArray = field(default_factory=lambda: np.empty((0, 0), np.int16))
    """(T, N) index of the collision layer of each body in `scene.layers`; −1 before a body is added. Empty if the scene
    has a single layer"""
    contact_end: FloatArray = field(default_factory=lambda: np.empty(0))
    """(C,) s, end of each visit of a sensor; nan for other contacts, and for visits that last to the end. Empty if the
    scene has no sensors"""
    info: Mapping[str, Any] = field(default_factory=dict)
    """scene, engine, settings, actions, seed, status, reason, steps, seconds, work, energy_start, energy_end,
    joint_error (the largest constraint violation, relative to a length; None without joints), worst_joint (its joint,
    with the violation in m or rad), broken (number of broken joints), audited, state_hash (of the last state),
    versions; causes (names of the columns of `account`)"""

    @classmethod
    def from_frames(
        cls,
        frames: Mapping[str, npt.NDArray[Any]],
        names: Sequence[str],
        contacts: Contacts,
        retired_time: FloatArray,
        info: Mapping[str, Any],
        *,
        missed_time: FloatArray | None = None,
        missed_pair: IntArray | None = None,
        broken_time: FloatArray | None = None,
        contact_end: FloatArray | None = None,
    ) -> Self:
        """Assemble a run from the arrays of its frames and its contacts.

        Args:
            frames: `time`, `position`, `velocity`, `angle` and `angular_velocity`; optionally `energy`, `account`,
                `spin` and `layer`.
            names: names of the N bodies.
            contacts: the contacts.
            retired_time: (N,) s.
            info: facts about the run.
            missed_time: (M,) s; default: no missed contacts.
            missed_pair: (M, 2); default: no missed contacts.
            broken_time: (J,) s; default: no joints.
            contact_end: (C,) s; default: no sensors.
        """
        return cls(
            names=np.asarray(names, dtype=np.str_),
            contact_time=contacts.time,
            contact_pair=contacts.pair,
            contact_point=contacts.point,
            contact_normal=contacts.normal,
            contact_impulse=contacts.impulse,
            retired_time=retired_time,
            missed_time=np.empty(0) if missed_time is None else missed_time,
            missed_pair=np.empty((0, 2), np.int64) if missed_pair is None else missed_pair,
            broken_time=np.empty(0) if broken_time is None else broken_time,
            contact_end=np.empty(0) if contact_end is None else contact_end,
            info=info,
            **frames,
        )

    def present(self, frames: IntArray | slice = slice(None)) -> BoolArray:
        """Return which bodies have not been retired at some frames, (K, N).

        Args:
            frames: indices of K frames, or a slice; default: all.
        """
        gone = np.where(np.isnan(self.retired_time), np.inf, self.retired_time)
        return np.asarray(self.time[frames, None] < gone)

    def __repr__(self) -> str:
        """Return scene, engine and status, the sizes of the arrays, and the key figures."""
        title, engine = self.info.get("scene", {}).get("title", ""), self.info.get("engine")
        about = " ".join(
            part for part in (short_repr(title) if title else "", f"on {engine}" if engine else "") if part
        )
        end = f" to {self.time[-1]:g} s" if len(self.time) else ""
        counts = f"{_bodies(len(self.names))}, {len(self.time):,} frames{end}, {len(self.contact_time):,} contacts"
        lines = [f"<Trajectory{about and ' ' + about}: {self.info.get('status', 'unknown')}, {counts}"]
        if self.info.get("reason"):
            lines.append(shorten(str(self.info["reason"]), MAX_MESSAGE))
        lines += [shorten(each, MAX_MESSAGE) for each in self.warnings]
        figures = []
        start, final = self.info.get("energy_start"), self.info.get("energy_end")
        if start is not None and final is not None:
            figures.append(f"energy {start:.4g} → {final:.4g} J")
        if len(self.contact_time):
            figures.append(f"first contact {self.contact_time.min():.6g} s")
        if self.info.get("audited"):
            figures.append(f"missed contacts {len(self.missed_time):,}")
        if figures:
            lines.append(", ".join(figures))
        return "\n  ".join(lines) + ">"

    @property
    def status(self) -> str:
        """`ok`, `diverged`, `refused` or `failed`."""
        return str(self.info["status"])

    @property
    def reason(self) -> str | None:
        """Reason for a status other than `ok`; None if the status is `ok`."""
        reason = self.info["reason"]
        return None if reason is None else str(reason)

    def raise_if_failed(self) -> Self:
        """Return the run if its status is `ok`.

        Raises:
            RunFailedError: it is not; a refused run has no frames.
        """
        if self.status != "ok":
            raise RunFailedError(self)
        return self

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know about a run that is `ok`, such as energy that it gained without a source."""
        return tuple(self.info.get("warnings", ()))

    @property
    def missed_contacts(self) -> int | None:
        """Number of contacts that the engine missed; None if the run was not audited."""
        return len(self.missed_time) if self.info["audited"] else None

    def breaks(self, joints: int) -> FloatArray:
        """Return the time at which each joint broke, (J,) s; inf if it did not.

        Args:
            joints: J, the number of joints in the scene.

        Raises:
            ValueError: the run had a different number of joints.
        """
        if not len(self.broken_time):
            return np.full(joints, np.inf)
        if len(self.broken_time) != joints:
            raise ValueError(f"the run had {len(self.broken_time):,} joints, the scene has {joints:,}")
        return np.where(np.isnan(self.broken_time), np.inf, self.broken_time)

    @property
    def sensor_visits(self) -> tuple[SensorVisit, ...]:
        """Visits of sensors, by their begin."""
        if not len(self.contact_end):
            return ()
        from sandbox.scene.description.scene import fixed_names_in

        fixed, bodies = fixed_names_in(self.info["scene"]), self.names.tolist()
        first = len(fixed) - len(self.info["scene"]["sensor"])
        rows = zip(self.contact_time.tolist(), self.contact_pair.tolist(), self.contact_end.tolist(), strict=True)
        return tuple(
            SensorVisit(fixed[-1 - sensor], bodies[index] if index >= 0 else fixed[-1 - index], begin, end)
            for begin, (index, sensor), end in rows
            if -1 - sensor >= first
        )

    def number(self, name: str) -> int:
        """Return the index of a body.

        Args:
            name: name of the body.

        Raises:
            KeyError: no body has that name.
        """
        found = np.flatnonzero(self.names == name)
        if not len(found):
            raise KeyError(name)
        return int(found[0])

    def at(self, frames: list[int]) -> Self:
        """Return a trajectory with the selected frames only. The contacts are kept.

        Args:
            frames: indices of the frames.
        """
        keys = ["time", "position", "velocity", "angle", "angular_velocity"]
        if len(self.energy):
            keys += ["energy", "account"]
        if len(self.spin):
            keys.append("spin")
        if len(self.layer):
            keys.append("layer")
        return replace(self, **{key: getattr(self, key)[frames] for key in keys})

    def of_first(self, count: int) -> Self:
        """Return the run of its first bodies, without those that were added later and without their contacts.

        Args:
            count: number of bodies.
        """
        if count >= len(self.names):
            return self
        keys = ["position", "velocity", "angle", "angular_velocity"]
        keys += [key for key in ("spin", "layer") if len(getattr(self, key))]
        columns = {key: getattr(self, key)[:, :count] for key in keys}
        kept, missed = (self.contact_pair < count).all(axis=1), (self.missed_pair < count).all(axis=1)
        contact_keys = ["contact_time", "contact_pair", "contact_point", "contact_normal", "contact_impulse"]
        contact_keys += ["contact_end"] if len(self.contact_end) else []
        columns |= {key: getattr(self, key)[kept] for key in contact_keys}
        columns |= {key: getattr(self, key)[missed] for key in ("missed_time", "missed_pair")}
        return replace(self, names=self.names[:count], retired_time=self.retired_time[:count], **columns)

    def save(self, path: str | Path) -> Path:
        """Write the arrays to a compressed `.npz` file.

        The file is written under a temporary name and then renamed, so an interrupted save leaves no partial file.

        Args:
            path: path of the file.

        Returns:
            The path of the file.
        """
        path = Path(path)
        with atomic_write(path) as temporary, temporary.open("xb") as stream:
            self._write(stream)
        return path

    def to_bytes(self) -> bytes:
        """Return the content of the file that `save` writes."""
        with BytesIO() as stream:
            self._write(stream)
            return stream.getvalue()

    def _write(self, stream: BinaryIO) -> None:
        """Write the compressed arrays."""
        without = {"info", *(key for key in ("spin", "layer", "contact_end") if not len(getattr(self, key)))}
        arrays = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in without}
        arrays["info"] = np.asarray(json.dumps(dict(self.info), ensure_ascii=False))
        np.savez_compressed(stream, **arrays)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a trajectory that `save` wrote.

        Args:
            path: path of the file.

        Raises:
            OSError: the file cannot be opened.
            TooLargeError: the arrays would not fit into memory.
            ValueError: the file is not a stored run, or is damaged.
        """
        from sandbox.run_file import read_run_file  # only reading a run needs the models of its scene and actions

        arrays, info = read_run_file(Path(path))
        return cls(**arrays, info=info)
