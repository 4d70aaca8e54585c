"""One engine's part of a session, and the state from which it continues."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sandbox.action import ActionError, Force, Pull, Throttle
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Observer, Simulation
from sandbox.engines.registry import start as start_engine
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Passing, PlaneReach
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """State of a running scene from which another simulation can continue."""

    engine: str
    wanted: Settings
    bodies: Bodies
    frame: Frame
    origin: float
    """s, time from which steps are counted"""
    steps: float
    """number of steps since `origin`"""
    retired: Mapping[int, float]
    broken: Mapping[int, float]
    forces: Mapping[str, Force]
    throttles: Mapping[str, Throttle]
    pulls: Mapping[str, Pull]
    setup: Setup
    """with all joints, numbered as `broken`"""
    plane_reach: PlaneReach | None
    """as `Simulation.plane_reach`"""

    @property
    def scene(self) -> Scene:
        """The scene, with all changes that actions have made."""
        return self.setup.scene

    def present_setup(self) -> Setup:
        """Return the setup with the state of this moment."""
        return setup_at(self.setup, self.bodies, self.frame, self.broken, self.plane_reach)


def present_bodies(bodies: Bodies, frame: Frame) -> Bodies:
    """Return the present bodies, in the state of a frame."""
    present = np.flatnonzero(frame.present)
    some = bodies.some(present)
    return replace(
        some,
        position=frame.position[present],
        velocity=frame.velocity[present],
        angle=frame.angle[present],
        angular_velocity=frame.angular_velocity[present],
        roll=some.roll if frame.roll is None else frame.roll[present],
        layer=some.layer if frame.layer is None else frame.layer[present],
        visits=some.visits if frame.visits is None else frame.visits[present],
    )


def passing_in(frame: Frame) -> Passing:
    """Return the pairs of a body and the one-way wall that it is passing through, by indices of `present_bodies`."""
    if frame.passing is None:
        return ()
    present = np.flatnonzero(frame.present)
    body_indices = np.searchsorted(present, frame.passing[:, 0])
    return tuple(zip(body_indices.tolist(), frame.passing[:, 1].tolist(), strict=True))


@dataclass(eq=False)
class Segment:
    """A simulation that starts at some time of a session with the bodies present at that time.

    Body indices of the session do not change. The simulation's own indices leave out bodies that were gone at its
    start.
    """

    simulation: Simulation
    bodies: Bodies
    """all N bodies, by session index"""
    before: Frame | None = None
    """the state at the start of the segment, of the N bodies at that time; None for the first segment"""
    body_indices: IntArray | None = None
    """(n,) session index of each of the simulation's bodies; None if they are equal"""
    origin: float = 0.0
    """s, time from which its steps are counted"""
    steps: float = 0.0
    """number of steps since `origin`; after a resumption, including those before it"""
    whole: Setup | None = None
    """setup of the whole session, with all its bodies and joints; None for the first segment, whose own setup it is"""

    @property
    def setup(self) -> Setup:
        """Setup of the whole session, as this segment began, with the scene as it is now."""
        own = self.simulation.setup
        if self.whole is None:
            return own
        return replace(self.whole, scene=own.scene, bodies=replace(self.whole.bodies, elements=own.bodies.elements))

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by session index, at which joints broke in this segment."""
        own = self.simulation.broken
        if self.before is None:
            return own
        number = self.simulation.setup.links.number
        return {int(number[k]): self._start + time for k, time in own.items()}

    @property
    def time(self) -> float:
        """Simulated time, s. It is counted in steps, so that a resumed segment has the same times, bit for bit."""
        return self.origin + self.steps * self.simulation.settings.dt

    @property
    def _start(self) -> float:
        return 0.0 if self.before is None else self.before.time

    def add_body(self, bodies: Bodies) -> None:
        """Record that the simulation has one more body, the last of `bodies`."""
        if self.body_indices is not None:
            self.body_indices = np.append(self.body_indices, len(bodies) - 1)
        self.bodies = bodies

    def frame(self) -> Frame:
        """Return the present state of all bodies."""
        frame = self.simulation.frame()
        if self.before is None:
            return frame
        if self.body_indices is None:
            return replace(frame, time=self.time)
        count, known = len(self.bodies), len(self.before.position)
        position, velocity, angle, spin = np.zeros((count, 2)), np.zeros((count, 2)), np.zeros(count), np.zeros(count)
        present = np.zeros(count, np.bool_)
        position[:known], angle[:known] = self.before.position, self.before.angle  # last state of bodies that are gone
        for total, own in (
            (position, frame.position),
            (velocity, frame.velocity),
            (angle, frame.angle),
            (spin, frame.angular_velocity),
        ):
            total[self.body_indices] = own
        present[self.body_indices] = frame.present
        roll = None
        if frame.roll is not None:
            roll = np.zeros((count, 2))
            roll[self.body_indices] = frame.roll
        layer = self._expanded(frame.layer, self.bodies.layer, self.before.layer)
        visits = self._expanded(frame.visits, np.zeros_like(self.bodies.visits))
        passing = frame.passing
        if passing is not None:
            passing = np.column_stack((self.body_indices[passing[:, 0]], passing[:, 1]))
        return Frame(self.time, position, velocity, angle, spin, present, roll, layer, visits, frame.drives, passing)

    def _expanded(self, own: IntArray | None, everyone: IntArray, before: IntArray | None = None) -> IntArray | None:
        """Return an array of the simulation with a row for every body of the session; absent bodies keep `before`."""
        if own is None:
            return None
        everyone = everyone.copy()
        if before is not None:
            everyone[: len(before)] = before
        everyone[self.body_indices] = own
        return everyone

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        found = self.simulation.contacts()
        if self.before is None:
            return found
        return replace(found, time=found.time + self._start, pair=self._session_pairs(found.pair))

    @property
    def retired(self) -> Mapping[int, float]:
        """Time in s, by session index, at which bodies left the scene in this segment."""
        own = self.simulation.retired
        if self.before is None:
            return own
        return {self._session_index(n): self._start + time for n, time in own.items()}

    def watch(self, observer: Observer) -> None:
        """Register an observer that is called after every substep."""
        if self.before is None:
            self.simulation.watch(observer)
            return

        def observe(time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
            observer(
                self._start + time,
                self._expanded_positions(start),
                self._expanded_positions(end),
                self._session_pairs(touching),
            )

        self.simulation.watch(observe)

    def _session_index(self, own: int) -> int:
        return own if self.body_indices is None else int(self.body_indices[own])

    def _session_pairs(self, pair: IntArray) -> IntArray:
        """Return pairs (K, 2) in session indices. Static colliders have the same indices in every segment."""
        if self.body_indices is None or not len(self.body_indices):
            return pair
        return np.asarray(np.where(pair >= 0, self.body_indices[np.maximum(pair, 0)], pair))

    def _expanded_positions(self, position: FloatArray) -> FloatArray:
        """Return the centres of all bodies, (N, 2) m; nan for bodies that are gone."""
        if self.body_indices is None:
            return position
        everyone = np.full((len(self.bodies), 2), np.nan)
        everyone[self.body_indices[: len(position)]] = position
        return everyone


def setup_at(
    setup: Setup, bodies: Bodies, frame: Frame, broken: Collection[int] = (), plane_reach: PlaneReach | None = None
) -> Setup:
    """Return a setup with the state of a frame.

    Args:
        setup: with all joints of the session.
        bodies: all bodies of the session.
        frame: the state.
        broken: indices of the broken joints.
        plane_reach: extent of half-planes; default: it follows from the positions of the bodies.
    """
    return setup.placed(present_bodies(bodies, frame), frame.time, broken, frame.drives, passing_in(frame), plane_reach)


def start_segment(
    setup: Setup,
    engine: str,
    wanted: Settings,
    bodies: Bodies,
    frame: Frame,
    persistent: Iterable[Force | Throttle],
    broken: Collection[int] = (),
    plane_reach: PlaneReach | None = None,
) -> Segment:
    """Start a segment from a state.

    Args:
        setup: the scene with the bodies and joints of the session.
        engine: name of the engine.
        wanted: settings.
        bodies: all bodies, by session index.
        frame: the state.
        persistent: actions that still act: constant forces, and levels of thrusts.
        broken: indices of broken joints.
        plane_reach: of the simulation that is resumed; by default it follows from the positions of the bodies.

    Raises:
        Refusal: the engine does not support something that the scene or a setting needs.
        ActionError: the engine cannot take over a constant force.
    """
    simulation = start_engine(setup_at(setup, bodies, frame, broken, plane_reach), engine, wanted)
    for each in persistent:
        try:
            simulation.apply(each)
        except ActionError as error:
            simulation.close()
            description = (
                f"the constant force on {each.body!r}" if isinstance(each, Force) else f"the thrust {each.thrust!r}"
            )
            raise ActionError(f"{engine} cannot continue with {description}: {error}") from None
    body_indices = None if frame.present.all() else np.flatnonzero(frame.present)
    columns = ("position", "velocity", "angle", "angular_velocity")
    everyone = replace(bodies, **{column: getattr(frame, column) for column in columns})
    if frame.roll is not None:
        everyone = replace(everyone, roll=frame.roll)
    if frame.layer is not None:
        everyone = replace(everyone, layer=frame.layer)
    if frame.visits is not None:
        everyone = replace(everyone, visits=frame.visits)
    whole = replace(setup, bodies=everyone, time=frame.time)
    return Segment(simulation, bodies, frame, body_indices, frame.time, whole=whole)
