"""Sensors of a running scene: which objects overlap which sensors, and their visits as contacts.

The overlaps are a function of the scene and of the state at the end of a time step dt, not of the engine, so that all
engines agree bit for bit where their states do. Detection is discrete: a body that passes a sensor between the ends of
two steps is not detected.

Every shape is a convex hull of corners, widened by a radius. Two shapes overlap if their hulls do, or are nearer to
each other than the sum of the radii. Shapes that only touch do not overlap.
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.echo import short_repr
from sandbox.engines.common.contact_log import too_many_contacts
from sandbox.engines.contract import Exhaustion
from sandbox.queries import ObjectHull, static_hulls, visible_objects
from sandbox.resource_limits import CONTACTS
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Sensor
from sandbox.scene.description.scene import default_name, first_sensor
from sandbox.scene.geometry.shapes import geometry_of, pieces_of
from sandbox.trajectory import Contacts, Frame, SensorVisit


class _SensorPiece(NamedTuple):
    """A convex piece of a sensor."""

    corners: FloatArray
    """(V, 2) m, counter-clockwise, about the centre of mass of its body, or in the world"""
    radius: float
    """m"""
    middle: FloatArray
    """(2,) m, centre of a disc that contains the piece, in the same frame"""
    reach: float
    """m, radius of that disc"""


class _CompiledSensor(NamedTuple):
    """A sensor, and the objects that it can detect."""

    body: int | None
    """index of the body that it moves with; None if it is fixed in the world"""
    pieces: tuple[_SensorPiece, ...]
    bodies: BoolArray
    """(N,) bodies that it can detect"""
    static: BoolArray
    """(F,) static objects that it can detect"""


class _StaticHulls(NamedTuple):
    """Walls, a hull for each segment, and posts, as arguments of `mark_static`; and half-planes."""

    owner: IntArray
    first: IntArray
    corner: FloatArray
    radius: FloatArray
    middle: FloatArray
    reach: FloatArray
    point: FloatArray
    """(P, 2) m, a point of each half-plane; these are the first static objects"""
    normal: FloatArray
    """(P, 2) unit normal of each"""


def sensor_names(scene: Scene) -> tuple[str, ...]:
    """Return the names of the sensors of a scene, in its order."""
    return tuple(each.name or default_name("sensor", k) for k, each in enumerate(scene.sensors))


class SceneSensors:
    """Sensors of a scene, to be evaluated in states of its bodies."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Compile the sensors of a scene.

        Args:
            scene: the scene.
            bodies: bodies of the states; more than those of the scene if some were added.
        """
        self.scene, self.bodies = scene, bodies
        self._static = _static_arrays(scene)
        self._sensors = tuple(_compile(scene, bodies, sensor) for sensor in scene.sensors)

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        """Return itself: it never changes, so that copies of a simulation can share it."""
        return self

    def overlaps(self, frame: Frame) -> IntArray:
        """Return the pairs (K, 2) of an object and a sensor that overlap, with the indices of `Contacts`.

        They are sorted by the sensor, then bodies by their index, then static objects.

        Args:
            frame: state of all bodies.
        """
        first, pairs = first_sensor(self.scene), list[IntArray]()
        for k in range(len(self._sensors)):
            found = self.detected(k, frame)
            pairs.append(np.column_stack((found, np.full(len(found), first - k))))
        return np.concatenate(pairs) if pairs else np.empty((0, 2), np.int64)

    def detected(self, number: int, frame: Frame) -> IntArray:
        """Return the objects that overlap a sensor, with the indices of `Contacts`: bodies, then static objects.

        Args:
            number: of the sensor, from 0.
            frame: state of all bodies.
        """
        from sandbox.engines.common.hull_overlap import mark_bodies, mark_static  # compiled: only where it is needed

        sensor, bodies = self._sensors[number], self.bodies
        found = np.zeros(len(sensor.bodies), np.bool_)
        found_static = np.zeros(len(sensor.static), np.bool_)
        if sensor.body is not None and not frame.present[sensor.body]:
            return np.empty(0, np.int64)
        shapes, is_detectable = bodies.shapes, sensor.bodies & frame.present
        for piece in sensor.pieces:
            hull, middle = self._placed(sensor, piece, frame)
            mark_bodies(
                hull, piece.radius, middle, piece.reach, frame.position, frame.angle, bodies.radius, is_detectable,
                shapes.body, shapes.first, shapes.corner, shapes.radius, found,
            )  # fmt: skip
            if sensor.static.any():
                static = self._static
                mark_static(
                    hull, piece.radius, middle, piece.reach, static.owner, static.first, static.corner, static.radius,
                    static.middle, static.reach, sensor.static, found_static,
                )  # fmt: skip
                below = ((hull[None] - static.point[:, None]) * static.normal[:, None]).sum(axis=2) < piece.radius
                found_static[: len(below)] |= below.any(axis=1) & sensor.static[: len(below)]
        return np.concatenate((np.flatnonzero(found), -1 - np.flatnonzero(found_static)))

    def detectable(self, number: int) -> BoolArray:
        """Return the bodies that a sensor can detect, (N,).

        Args:
            number: of the sensor, from 0.
        """
        return self._sensors[number].bodies

    def centre(self, number: int, frame: Frame) -> FloatArray:
        """Return the centre of a sensor in a state, (2,) m: of several pieces, that of the first."""
        sensor = self._sensors[number]
        return self._placed(sensor, sensor.pieces[0], frame)[1]

    @staticmethod
    def _placed(sensor: _CompiledSensor, piece: _SensorPiece, frame: Frame) -> tuple[FloatArray, FloatArray]:
        """Return the corners (V, 2) and the middle (2,) of a piece in the world, m."""
        if sensor.body is None:
            return piece.corners, piece.middle
        from sandbox.engines.common.hull_overlap import place

        (x, y), angle = frame.position[sensor.body].tolist(), float(frame.angle[sensor.body])
        own = np.vstack((piece.corners, piece.middle))
        placed = np.empty_like(own)
        place(own, x, y, angle, placed)
        return placed[:-1], placed[-1]


def _compile(scene: Scene, bodies: Bodies, sensor: Sensor) -> _CompiledSensor:
    body = None if sensor.body is None else bodies.number_of[sensor.body]
    moves = body is not None and not bodies.fixed[body]
    x, y = (0.0, 0.0) if body is None else geometry_of(bodies.elements[bodies.element[body]]).centre
    ignored = frozenset[str]() if sensor.body is None else frozenset({sensor.body})
    is_seen = visible_objects(scene, bodies, ignored, frozenset(sensor.detects or ()))
    is_detectable = np.asarray([is_seen[k] for k in range(len(bodies))], np.bool_)
    is_static = np.asarray([is_seen[-1 - k] for k in range(len(scene.fixed))], np.bool_)
    pieces = []
    for piece in pieces_of(sensor):
        corners = np.asarray(piece.corners, np.float64) - (x, y)
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        reach = float(np.hypot(*(corners - middle).T).max()) + piece.radius
        pieces.append(_SensorPiece(corners, piece.radius, middle, reach))
    return _CompiledSensor(
        body,
        tuple(pieces),
        is_detectable if moves else is_detectable & ~bodies.fixed,
        is_static if moves else np.zeros(len(is_static), np.bool_),
    )


def _static_arrays(scene: Scene) -> _StaticHulls:
    hulls: list[ObjectHull] = list(static_hulls(scene))
    corner = np.concatenate((np.empty((0, 2)), *(each.corners for each in hulls)))
    radius = np.asarray([each.radius for each in hulls], np.float64)
    middle = np.asarray([each.corners.mean(axis=0) for each in hulls], np.float64).reshape(-1, 2)
    extent = [float(np.hypot(*(each.corners - m).T).max()) for each, m in zip(hulls, middle, strict=True)]
    normal = np.asarray([each.normal for each in scene.planes], np.float64).reshape(-1, 2)
    return _StaticHulls(
        owner=np.asarray([-1 - each.owner for each in hulls], np.int64),
        first=np.cumsum([0, *(len(each.corners) for each in hulls)]),
        corner=corner,
        radius=radius,
        middle=middle,
        reach=np.asarray(extent, np.float64) + radius,
        point=np.asarray([each.point for each in scene.planes], np.float64).reshape(-1, 2),
        normal=normal / np.hypot(*normal.T)[:, None],
    )


class OpenVisit(NamedTuple):
    """A visit of a sensor that has not ended."""

    begin: float
    """s, end of the first step after which object and sensor overlapped"""
    point: tuple[float, float]
    """m, centre of the sensor at that time"""
    normal: tuple[float, float]
    """unit vector from the object to that point"""


class _Visit(NamedTuple):
    """A visit of a sensor that has ended."""

    object: int
    sensor: int
    opened: OpenVisit
    end: float


class SensorTracker:
    """Visits of the sensors of a running scene, from the first call of `start` on."""

    def __init__(self, open_visits: Mapping[tuple[int, int], OpenVisit] | None = None) -> None:
        """Create a tracker that is not started, or that continues some visits, by their pairs."""
        self._open = dict(open_visits or {})
        self.is_started = open_visits is not None
        """whether visits are tracked"""
        self._ended: list[_Visit] = []  # since the last call of `take`, after at least one step
        self._recorded: list[_Visit] | None = None  # ended since the last call of `visits`; None before the first
        self._has_stepped = False
        self._sensors: SceneSensors | None = None
        self._last = np.empty((0, 2), np.int64)

    @property
    def open_visits(self) -> dict[tuple[int, int], OpenVisit] | None:
        """Visits that have not ended, by their pairs; None before the start."""
        return dict(self._open) if self.is_started else None

    def sensors(self, scene: Scene, bodies: Bodies) -> SceneSensors:
        """Return the compiled sensors; kept until scene or bodies change."""
        known = self._sensors
        if known is None or known.scene is not scene or known.bodies is not bodies:
            known = self._sensors = SceneSensors(scene, bodies)
        return known

    def start(self, scene: Scene, bodies: Bodies, frame: Frame) -> None:
        """Start the tracking, unless it is started; objects that overlap sensors now begin their visits."""
        if not self.is_started:
            self.is_started = True
            self._update(self.sensors(scene, bodies), frame)

    def step(self, scene: Scene, bodies: Bodies, frame: Frame) -> None:
        """Update the visits at the end of a step.

        Raises:
            Exhaustion: there are more visits since the last call of `take`, or of `visits`, than can be recorded.
        """
        self._update(self.sensors(scene, bodies), frame)
        self._has_stepped = True

    def _update(self, sensors: SceneSensors, frame: Frame) -> None:
        pairs = sensors.overlaps(frame)
        if np.array_equal(pairs, self._last) and len(pairs) == len(self._open):
            return
        self._last = pairs
        present, first = {(a, b) for a, b in pairs.tolist()}, first_sensor(sensors.scene)
        for pair in [each for each in self._open if each not in present]:
            visit = _Visit(*pair, self._open.pop(pair), frame.time)
            if self._has_stepped:  # else it was not open at the end of any step since the last call of `take`
                self._ended.append(visit)
            if self._recorded is not None:
                self._recorded.append(visit)
        for index, sensor in pairs.tolist():
            if (index, sensor) not in self._open:
                x, y = sensors.centre(first - sensor, frame).tolist()
                dx, dy = (0.0, 0.0) if index < 0 else (x - frame.position[index, 0], y - frame.position[index, 1])
                length = math.hypot(dx, dy)
                normal = (dx / length, dy / length) if 0.0 < length < math.inf else (0.0, 1.0)
                self._open[index, sensor] = OpenVisit(frame.time, (x, y), normal)
        kept = len(self._open) + max(len(self._ended), len(self._recorded or ()))
        if kept > CONTACTS.value:
            raise Exhaustion(too_many_contacts(kept))

    def take(self) -> Contacts:
        """Return the visits that were open at the end of a step since the last call, or are open now, as contacts."""
        rows = [(each.object, each.sensor, each.opened) for each in self._ended]
        rows += [(index, sensor, opened) for (index, sensor), opened in self._open.items()]
        self._ended, self._has_stepped = [], False
        if not rows:
            return Contacts.none()
        rows.sort(key=lambda row: row[2].begin)
        return Contacts(
            np.asarray([opened.begin for _, _, opened in rows], np.float64),
            np.asarray([row[:2] for row in rows], np.int64),
            np.asarray([opened.point for _, _, opened in rows], np.float64),
            np.asarray([opened.normal for _, _, opened in rows], np.float64),
            np.zeros((len(rows), 2)),
        )

    def visits(self, scene: Scene, names: tuple[str, ...]) -> tuple[SensorVisit, ...]:
        """Return the visits that ended since the last call, and those that have not ended, by the time of their begin.

        The first call returns those that have not ended.

        Args:
            scene: the scene.
            names: names of the bodies.
        """
        rows: list[tuple[int, int, float, float]] = [
            (each.object, each.sensor, each.opened.begin, each.end) for each in self._recorded or ()
        ]
        rows += [(index, sensor, opened.begin, math.nan) for (index, sensor), opened in self._open.items()]
        self._recorded = []
        fixed = scene.fixed_names
        return tuple(
            SensorVisit(fixed[-1 - sensor], names[index] if index >= 0 else fixed[-1 - index], begin, end)
            for index, sensor, begin, end in sorted(rows, key=lambda row: row[2])
        )


def number_of_sensor(scene: Scene, name: str) -> int:
    """Return the number of a sensor, from 0.

    Raises:
        ValueError: the scene has no sensor of that name.
    """
    names = sensor_names(scene)
    if name not in names:
        known = ", ".join(map(repr, names)) or "none"
        raise ValueError(f"the scene has no sensor {short_repr(name)}; its sensors: {known}")
    return names.index(name)


def join_rows(contacts: Contacts, visits: Contacts) -> Contacts:
    """Return contacts of an engine and visits of sensors in the order of time."""
    if not len(visits):
        return contacts
    joined = Contacts.joined([contacts, visits])
    order = np.argsort(joined.time, kind="stable")
    columns: Iterable[FloatArray] = (joined.point, joined.normal, joined.impulse)
    return Contacts(joined.time[order], joined.pair[order], *(column[order] for column in columns))
