"""One engine's part of a session, and the state from which it continues."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sandbox.action import Action, ActionError, Force, Pull, Steer, Throttle
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Observer, Simulation
from sandbox.engines.registry import start as start_engine
from sandbox.engines.sensors import OpenVisit
from sandbox.engines.session_actions import PersistentActions
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
    joined: Mapping[int, float]
    forces: Mapping[str, Force]
    throttles: Mapping[str, Throttle]
    motor_levels: Mapping[str, float]
    steering: Mapping[str, Steer]
    pulls: Mapping[str, Pull]
    setup: Setup
    """with all joints, numbered as `broken`"""
    plane_reach: PlaneReach | None
    """as `Simulation.plane_reach`"""
    sensor_visits: Mapping[tuple[int, int], OpenVisit] | None
    """visits of sensors that last, by the pairs of their contacts; None if they are not tracked"""
    events: tuple[Action, ...]
    """events of the scene that have not happened yet"""

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
    selected = bodies.some(present)
    return replace(
        selected,
        position=frame.position[present],
        velocity=frame.velocity[present],
        angle=frame.angle[present],
        angular_velocity=frame.angular_velocity[present],
        roll=selected.roll if frame.roll is None else frame.roll[present],
        layer=selected.layer if frame.layer is None else frame.layer[present],
        visits=selected.visits if frame.visits is None else frame.visits[present],
    )


def passing_in(frame: Frame) -> Passing:
    """Return the pairs of a body and the one-way wall or body that it is passing, by indices of `present_bodies`."""
    if frame.passing is None:
        return ()
    own_index = np.cumsum(frame.present) - 1
    passed = frame.passing[:, 1]
    passed = np.where(passed >= 0, own_index[np.maximum(passed, 0)], passed)
    return tuple(zip(own_index[frame.passing[:, 0]].tolist(), passed.tolist(), strict=True))


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
    session_setup: Setup | None = None
    """setup of the whole session, with all its bodies and joints; None for the first segment: its own setup"""

    @property
    def setup(self) -> Setup:
        """Setup of the whole session, as this segment began, with the scene as it is now."""
        own_setup = self.simulation.setup
        if self.session_setup is None:
            return own_setup
        return replace(
            self.session_setup.with_scene(own_setup.scene),  # also values of motors that were set
            bodies=replace(self.session_setup.bodies, elements=own_setup.bodies.elements),
        )

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by session index, at which joints broke in this segment."""
        broken = self.simulation.broken
        if self.before is None:
            return broken
        joint_index = self.simulation.setup.joints.number
        return {int(joint_index[k]): self._start + time for k, time in broken.items()}

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
        count, before_count = len(self.bodies), len(self.before.position)
        position, velocity, angle, spin = np.zeros((count, 2)), np.zeros((count, 2)), np.zeros(count), np.zeros(count)
        present = np.zeros(count, np.bool_)
        # Bodies that are gone keep their last state.
        position[:before_count], angle[:before_count] = self.before.position, self.before.angle
        for session_array, own_array in (
            (position, frame.position),
            (velocity, frame.velocity),
            (angle, frame.angle),
            (spin, frame.angular_velocity),
        ):
            session_array[self.body_indices] = own_array
        present[self.body_indices] = frame.present
        roll = None
        if frame.roll is not None:
            roll = np.zeros((count, 2))
            roll[self.body_indices] = frame.roll
        layer = self._expanded(frame.layer, self.bodies.layer, self.before.layer)
        visits = self._expanded(frame.visits, np.zeros_like(self.bodies.visits))
        passing = frame.passing
        if passing is not None:
            passing = self._session_pairs(passing)
        return Frame(self.time, position, velocity, angle, spin, present, roll, layer, visits, frame.drives, passing)

    def _expanded(self, values: IntArray | None, initial: IntArray, last: IntArray | None = None) -> IntArray | None:
        """Return an array of the simulation with a row for every body of the session; absent bodies keep `last`."""
        if values is None:
            return None
        initial = initial.copy()
        if last is not None:
            initial[: len(last)] = last
        initial[self.body_indices] = values
        return initial

    def contacts(self) -> Contacts:
        """Return the contacts since the last call."""
        contacts = self.simulation.contacts()
        if self.before is None:
            return contacts
        return replace(contacts, time=contacts.time + self._start, pair=self._session_pairs(contacts.pair))

    @property
    def retired(self) -> Mapping[int, float]:
        """Time in s, by session index, at which bodies left the scene in this segment."""
        retired = self.simulation.retired
        if self.before is None:
            return retired
        return {self._session_index(n): self._start + time for n, time in retired.items()}

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

    def _session_index(self, index: int) -> int:
        return index if self.body_indices is None else int(self.body_indices[index])

    def _session_pairs(self, pair: IntArray) -> IntArray:
        """Return pairs (K, 2) in session indices. Static colliders have the same indices in every segment."""
        if self.body_indices is None or not len(self.body_indices):
            return pair
        return np.asarray(np.where(pair >= 0, self.body_indices[np.maximum(pair, 0)], pair))

    def _expanded_positions(self, position: FloatArray) -> FloatArray:
        """Return the centres of all bodies, (N, 2) m; nan for bodies that are gone."""
        if self.body_indices is None:
            return position
        expanded = np.full((len(self.bodies), 2), np.nan)
        expanded[self.body_indices[: len(position)]] = position
        return expanded


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
    persistent: PersistentActions,
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
        persistent: actions that still act: constant forces, levels of thrusts, tyres and motors.
        broken: indices of broken joints.
        plane_reach: of the simulation that is resumed; by default it follows from the positions of the bodies.

    Raises:
        Refusal: the engine does not support something that the scene or a setting needs.
        ActionError: the engine cannot take over a constant force.
    """
    simulation = start_engine(setup_at(setup, bodies, frame, broken, plane_reach), engine, wanted)
    for action in persistent.actions(simulation.setup.joints):
        try:
            simulation.apply(action)
        except ActionError as error:
            simulation.close()
            description = {
                "force": lambda each: f"the constant force on {each.body!r}",
                "throttle": lambda each: f"the thrust {each.thrust!r}",
                "steer": lambda each: f"the tyre {each.tyre!r}",
                "actuate": lambda each: f"the motors {', '.join(map(repr, each.levels))}",
            }[action.kind](action)
            raise ActionError(f"{engine} cannot continue with {description}: {error}") from None
    body_indices = None if frame.present.all() else np.flatnonzero(frame.present)
    columns = ("position", "velocity", "angle", "angular_velocity")
    session_bodies = replace(bodies, **{column: getattr(frame, column) for column in columns})
    if frame.roll is not None:
        session_bodies = replace(session_bodies, roll=frame.roll)
    if frame.layer is not None:
        session_bodies = replace(session_bodies, layer=frame.layer)
    if frame.visits is not None:
        session_bodies = replace(session_bodies, visits=frame.visits)
    session_setup = replace(setup, bodies=session_bodies, time=frame.time)
    return Segment(simulation, bodies, frame, body_indices, frame.time, session_setup=session_setup)
