"""A simulation whose engine, settings and bodies can be changed while it runs.

Each segment is a simulation of its own that starts from the last state of the segment before; body indices and time
continue. Other engine state, such as the impulses of lasting contacts, is reset.
"""

import copy
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol, Self, Unpack

from sandbox.action import (
    Action,
    ActionError,
    Explosion,
    Join,
    Launch,
    Pull,
    SetParameter,
    Spawn,
    Steer,
    Switch,
    Throttle,
    Unjoin,
    Value,
)
from sandbox.echo import MAX_MESSAGE, MAX_NAMED, shorten
from sandbox.engines.common.base import step_and_record
from sandbox.engines.common.energy_balance import LedgerHandover
from sandbox.engines.contract import Divergence, Exhaustion, Observer, Refusal, StateSnapshot
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.mouse_joint import MouseJoints
from sandbox.engines.registry import UnknownEngineError
from sandbox.engines.registry import start as start_engine
from sandbox.engines.segment import Checkpoint, Segment, start_segment
from sandbox.engines.sensors import SensorTracker, join_rows, number_of_sensor
from sandbox.engines.session_actions import (
    EventQueue,
    PersistentActions,
    added_joint,
    events_from,
    explosion_impulses,
    intact_joint_names,
    launch_state,
    remaining_event,
    removed_joint,
)
from sandbox.frame_table import FrameTable
from sandbox.queries import RayHit, SceneQueries
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import PlaneReach
from sandbox.scene.description.world import COMMON, Settings, SettingsChanges
from sandbox.scene.errors import SettingsError
from sandbox.scene.files.load import as_scene
from sandbox.schedule import ROUNDING
from sandbox.trajectory import Contacts, Frame, SensorVisit


def start(
    scene: Scene | Setup | str | Path,
    engine: str = "pymunk",
    settings: Settings | None = None,
    **changes: Unpack[SettingsChanges],
) -> "SwitchableSimulation":
    """Start a scene on an engine, to be stepped by hand.

    Args:
        scene: the scene, or its name or path, as `load` takes it; or a setup, to start from another state.
        engine: name of the engine.
        settings: settings of the solver; default: the `[solver]` of the scene.
        changes: changes to these settings, such as `dt=0.001`.

    Returns:
        A `Simulation` that accepts every action, also `Switch`, `Launch` and `Pull`.

    Raises:
        UnknownEngineError: no engine has that name.
        Refusal: the engine does not support something that the scene or a setting needs.
        SceneError: the name or path is not that of a valid scene.
        SettingsError: a setting is invalid.

    Example:
        >>> simulation = sandbox.start("bounce", dt=0.01)
        >>> simulation.step()
        >>> round(simulation.time, 3)
        0.01
    """
    setup = Setup.of(scene if isinstance(scene, Setup) else as_scene(scene))
    if changes:
        settings = (settings or setup.scene.solver).replace(**changes)
    return SwitchableSimulation(setup, engine, settings)


class SwitchableSimulation:
    """Running scene whose engine and settings can be changed during the run. It is a `Simulation`.

    Attributes:
        engine: name of the present engine.
        wanted: settings as requested; those that are None are chosen by the engine.
    """

    def __init__(self, start: Scene | Setup, engine: str = "pymunk", settings: Settings | None = None) -> None:
        setup = Setup.of(start)
        self.engine = engine
        """name of the present engine"""
        self.wanted = setup.scene.solver if settings is None else settings
        """settings as requested; those that are None are chosen by the engine"""
        self._segment = Segment(start_engine(setup, engine, self.wanted), setup.bodies)
        self._retired: dict[int, float] = {}
        self._broken: dict[int, float] = {}
        self._joined: dict[int, float] = {}
        self._events = EventQueue(events_from(setup))
        self._work: Counter[str] = Counter()
        self._pulls = MouseJoints()
        self._persistent = PersistentActions()
        # Contacts of earlier segments since the last call of `contacts`; None before the first call.
        self._earlier_contacts: list[Contacts] | None = None
        self._observer: Observer | None = None
        self._ledger = LedgerHandover()
        self._sensors = SensorTracker()

    def __repr__(self) -> str:
        title = f" of {shorten(self.scene.title)!r}" if self.scene.title else ""
        bodies = "1 body" if len(self.bodies) == 1 else f"{len(self.bodies):,} bodies"
        return f"<Simulation{title} on {self.engine} at {self.time:g} s, {bodies}>"

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return an independent simulation in the same state, without the observer.

        Raises:
            SnapshotError: the engine cannot copy its state.
        """
        memo[id(self)] = copied = type(self).__new__(type(self))
        memo[id(self.wanted)] = self.wanted
        state = {key: value for key, value in self.__dict__.items() if key != "_observer"}
        copied.__dict__ = {**copy.deepcopy(state, memo), "_observer": None}
        return copied

    def snapshot(self) -> StateSnapshot[Self]:
        """Return a copy of the whole state, also of contacts, contact log and energy account, but not of the observer.

        Raises:
            SnapshotError: the engine cannot copy its state.
        """
        return StateSnapshot(self)

    def restore(self, snapshot: StateSnapshot[Self]) -> None:
        """Return to the state of a snapshot, from which the simulation continues as it did then, bit for bit.

        Engine, settings, bodies and scene become those of that time.

        Args:
            snapshot: of this or another simulation; it can be restored any number of times.

        Raises:
            ValueError: it is a snapshot of something else.
        """
        resumed = snapshot.resumed()
        if type(resumed) is not type(self):
            raise ValueError(f"{snapshot!r} is not a snapshot of a {type(self).__name__}")
        observer, replaced = self._observer, self._segment.simulation
        self.__dict__ = resumed.__dict__
        replaced.close()
        if observer is not None:
            self.watch(observer)

    def checkpoint(self) -> Checkpoint:
        """Return a checkpoint, from which `resumed` continues."""
        return Checkpoint(
            engine=self.engine,
            wanted=self.wanted,
            bodies=self.bodies,
            frame=self.frame(),
            origin=self._segment.origin,
            steps=self._segment.steps,
            retired=dict(self.retired),
            broken=dict(self.broken),
            joined=dict(self._joined),
            forces=self._active_actions().forces,
            throttles=self._persistent.throttles,
            motor_levels=self._persistent.motor_levels,
            steering=self._persistent.steering,
            pulls=self._pulls.pulls,
            setup=self.setup,
            plane_reach=self.plane_reach,
            sensor_visits=self._sensors.open_visits,
            events=self._events.pending,
        )

    @classmethod
    def resumed(cls, point: Checkpoint) -> Self:
        """Continue from a checkpoint.

        In free flight, the states equal those of an uninterrupted run, bit for bit, if the method of the engine depends
        on the state only. In contact they differ, because a checkpoint does not contain the contact data of the engine.

        Args:
            point: the checkpoint.

        Raises:
            Refusal: the engine cannot start from that state.
            ActionError: the engine cannot take over a constant force.
        """
        simulation = cls.__new__(cls)
        simulation.engine, simulation.wanted = point.engine, point.wanted
        simulation._persistent = PersistentActions(point.forces, point.throttles, point.steering, point.motor_levels)
        simulation._segment = start_segment(
            point.setup,
            point.engine,
            point.wanted,
            point.bodies,
            point.frame,
            simulation._persistent,
            point.broken,
            point.plane_reach,
        )
        simulation._segment.origin, simulation._segment.steps = point.origin, point.steps
        simulation._retired, simulation._broken, simulation._work = dict(point.retired), dict(point.broken), Counter()
        simulation._joined = dict(point.joined)
        simulation._events = EventQueue(point.events)
        simulation._earlier_contacts, simulation._observer, simulation._ledger, simulation._pulls = (
            None,
            None,
            LedgerHandover(),
            MouseJoints(point.pulls),
        )
        simulation._sensors = SensorTracker(point.sensor_visits)
        return simulation

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._segment.time

    @property
    def patience(self) -> float | None:
        """Largest computing time of a step, s, after which it raises `Exhaustion`; None: unlimited."""
        return self._segment.simulation.patience

    @patience.setter
    def patience(self, seconds: float | None) -> None:
        self._segment.simulation.patience = seconds

    @property
    def scene(self) -> Scene:
        """The scene, with all changes that actions have made."""
        return self._segment.simulation.scene

    @property
    def setup(self) -> Setup:
        """State from which the present engine started, of all bodies and joints, with the scene as it is now."""
        return self._segment.setup

    @property
    def settings(self) -> Settings:
        """The settings, with every default chosen by the engine filled in."""
        return self._segment.simulation.settings

    @property
    def bodies(self) -> Bodies:
        """Bodies at their start as arrays; spawned bodies are appended."""
        return self._segment.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """Time in s, by body index, at which bodies were removed, left `world.bounds` or ended their lifetime."""
        return MappingProxyType({**self._retired, **self._segment.retired}) if self._retired else self._segment.retired

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by index in `setup.joints`, at which joints broke."""
        return MappingProxyType({**self._broken, **self._segment.broken}) if self._broken else self._segment.broken

    @property
    def joined(self) -> Mapping[int, float]:
        """Time in s, by index in `setup.joints`, at which joints were added."""
        return MappingProxyType(self._joined)

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of half-planes as (x, y, distance), m; None if they are infinite."""
        return self._segment.simulation.plane_reach

    @property
    def pulls(self) -> Mapping[str, Pull]:
        """Active pulls by the name of the body."""
        return self._pulls.pulls

    @property
    def throttles(self) -> Mapping[str, Throttle]:
        """Throttles that were set, by the name of the thrust."""
        return self._persistent.throttles

    @property
    def steering(self) -> Mapping[str, Steer]:
        """Levels of tyres that were set, by the name of the tyre."""
        return self._persistent.steering

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start, summed over all engines used."""
        total = Counter(self._work)
        total.update(self._segment.simulation.work)
        return dict(total)

    def step(self) -> None:
        """Advance by one time step dt.

        Raises:
            Divergence: the state is not finite, or exceeds the bounds.
            Exhaustion: the step needs more memory or work than its limit.
        """
        self._make_step(1.0, lambda: self._segment.simulation.step())

    def advance(self, steps: int, frames: FrameTable, *, until_event: bool = False) -> None:
        """Advance by at most so many time steps, and record the frames that are due, as `Simulation.advance`.

        Args:
            steps: largest number of steps.
            frames: table of the frames.
            until_event: whether no step but the last may have contacts or remove bodies.

        Raises:
            Divergence, Exhaustion: as `step`.
        """
        self._apply_events()
        segment, before = self._segment, frames.steps
        if self._events.pending:
            steps = max(min(steps, math.ceil((self._events.next - self.time) / self.settings.dt - ROUNDING)), 1)
        # Mouse joints act in each step, sensors detect after each, and frames of a later segment have other indices.
        if self._pulls.any or self._sensors.is_started or segment.before is not None:
            step_and_record(self, 1 if until_event else steps, frames)
            return
        try:
            segment.simulation.advance(steps, frames, until_event=until_event)
        except Divergence as divergence:
            segment.steps += frames.steps - before + 1
            raise Divergence(self.time, divergence.body, divergence.what) from None
        except BaseException:
            segment.steps += frames.steps - before
            raise
        segment.steps += frames.steps - before

    def finish(self, part: float) -> None:
        """Advance by a last fraction of dt, or by dt with `makes_whole_steps`. No step can follow.

        Args:
            part: fraction of dt, 0 < part < 1.

        Raises:
            Divergence: as `step`.
            ValueError: `part` is out of range.
        """
        length = 1.0 if self.makes_whole_steps else part
        self._make_step(length, lambda: self._segment.simulation.finish(part))

    @property
    def makes_whole_steps(self) -> bool:
        """Whether no step is shorter than dt, so that a run may end after its duration."""
        return self._segment.simulation.makes_whole_steps

    def _make_step(self, part: float, advance: Callable[[], None]) -> None:
        """Apply events and mouse joints, and advance the engine, for a fraction of a step."""
        self._apply_events()
        simulation = self._segment.simulation
        if self._pulls.any:
            with self._ledger.attributing_pulls(simulation):
                self._pulls.apply_impulses(simulation, self.settings.dt * part)
        self._segment.steps += part
        try:
            advance()
        except Divergence as divergence:
            raise Divergence(self.time, divergence.body, divergence.what) from None
        except Exhaustion:
            self._segment.steps -= part
            raise
        if self._sensors.is_started:
            self._sensors.step(self.scene, self.bodies, self.frame())

    def apply(self, action: Action) -> None:
        """Apply an action at once. Its `time` is ignored.

        Args:
            action: the action.

        Raises:
            ActionError: the action cannot be applied. The simulation is left unchanged.
        """
        apply = _SESSION_ACTIONS.get(type(action))
        if apply is not None:
            apply(self, action)
            return
        self._segment.simulation.apply(action)
        self._persistent.record(action)
        if type(action) is SetParameter:
            self._segment.bodies = replace(self._segment.bodies, elements=self._segment.simulation.bodies.elements)

    def _pull(self, action: Pull) -> None:
        self._pulls.set_pull(action, self._segment.simulation)

    def _launch(self, action: Launch) -> None:
        frame, bodies, is_launched = launch_state(action, self.scene, self.bodies, self.frame())
        retired = {n: time for n, time in self.retired.items() if not is_launched[n]}
        self._hand_over(self.engine, self.wanted, bodies, frame, retired)

    def _spawn(self, action: Spawn) -> None:
        name = action.single.name or self.bodies.new_name("spawned", self.scene.fixed_names)
        if name in self.bodies.names:
            raise ActionError(f"a body or fixed object is already named {name!r}")
        named = action.named(name)
        self._segment.simulation.apply(named)
        self._segment.add_body(self.bodies.joined_by(named.single, name))

    def _apply_events(self) -> None:
        """Apply the events of the scene that are due; those of bodies and joints that have left are passed over.

        Raises:
            Exhaustion: one cannot be applied.
        """
        if not self._events.pending:
            return
        now = self.time + ROUNDING * self.settings.dt  # as for actions
        if self._events.next > now:
            return
        for due in self._events.due(now):
            event = remaining_event(due, self.setup, self.bodies, self.frame(), self.broken)
            if event is None:
                continue
            try:
                self.apply(event)
            except ActionError as error:
                raise Exhaustion(f"the event {event.kind!r} of {event.time:g} s cannot be applied: {error}") from None

    def _explode(self, action: Explosion) -> None:
        for impulse in explosion_impulses(action, self.scene, self.bodies, self.frame()):
            self._segment.simulation.apply(impulse)

    def _join(self, action: Join) -> None:
        frame = self.frame()
        rows = added_joint(action, self.setup, self.bodies, frame, self.broken)
        setup = replace(self.setup, bodies=self.bodies, joints=self.setup.joints.joined(rows))  # with spawned bodies
        self._hand_over(self.engine, self.wanted, self.bodies, frame, dict(self.retired), self.plane_reach, setup)
        self._joined |= dict.fromkeys(rows.number.tolist(), self.time)

    def _unjoin(self, action: Unjoin) -> None:
        rows = removed_joint(action, self.setup, self.broken)
        broken = {**self.broken, **dict.fromkeys(rows, self.time)}
        plane_reach, retired = self.plane_reach, dict(self.retired)
        self._hand_over(self.engine, self.wanted, self.bodies, self.frame(), retired, plane_reach, broken=broken)

    def _switch(self, action: Switch) -> None:
        try:
            wanted = self.wanted.replace(**action.settings)
        except SettingsError as error:
            faults = (f"{shorten(each.path, MAX_NAMED)}: {each.message}" for each in error.faults)
            raise ActionError(shorten("; ".join(faults), MAX_MESSAGE)) from None
        engine, plane_reach = action.engine or self.engine, self.plane_reach if action.resumes else None
        self._hand_over(engine, wanted, self.bodies, self.frame(), dict(self.retired), plane_reach)

    def _hand_over(
        self,
        engine: str,
        wanted: Settings,
        bodies: Bodies,
        frame: Frame,
        retired: dict[int, float],
        plane_reach: PlaneReach | None = None,
        setup: Setup | None = None,
        broken: dict[int, float] | None = None,
    ) -> None:
        """Start the next segment from a state, with the present joints or other ones.

        Raises:
            ActionError: the engine cannot continue from the state. Nothing has changed then.
        """
        try:
            persistent, setup = self._active_actions(), setup or self.setup
            broken = dict(self.broken) if broken is None else broken
            segment = start_segment(setup, engine, wanted, bodies, frame, persistent, broken, plane_reach)
            if self._ledger.is_on:
                segment.simulation.account()
        except (Refusal, UnknownEngineError) as refusal:
            raise ActionError(str(refusal)) from None
        with self._ledger.replacing(self, segment.simulation):
            self._replace_segment(segment, retired, broken)
            self.engine, self.wanted = engine, wanted

    def _replace_segment(self, segment: Segment, retired: dict[int, float], broken: dict[int, float]) -> None:
        """Replace the present segment, and close its simulation."""
        previous = self._segment
        if segment.simulation.settings.dt == previous.simulation.settings.dt:  # keeps frames at k·dt
            segment.origin, segment.steps = previous.origin, previous.steps
        segment.simulation.patience = previous.simulation.patience
        if self._earlier_contacts is not None:
            self._earlier_contacts.append(previous.contacts())
            segment.simulation.contacts()
        self._work.update(previous.simulation.work)
        self._retired, self._broken = retired, broken
        previous.simulation.close()
        self._segment = segment
        if self._observer is not None:
            self._segment.watch(self._observer)

    def _active_actions(self) -> PersistentActions:
        """Return the persistent actions, without those on bodies and motors that have left the scene."""
        if self._persistent.forces:
            present = zip(self.bodies.names, self.frame().present.tolist(), strict=True)
            self._persistent.remove_forces(name for name, is_present in present if not is_present)
        if self._persistent.motor_levels:
            self._persistent.keep_motors(intact_joint_names(self.setup, self.broken))
        return self._persistent

    def frame(self) -> Frame:
        """Return the present state."""
        return self._segment.frame()

    def queries(self, ignore: Iterable[str] = (), categories: Iterable[str] = ()) -> SceneQueries:
        """Return ray casts and distances in the present state, which stay those of this state.

        Args:
            ignore: names of bodies and static objects that are not seen.
            categories: collision categories that are seen; default: all.

        Raises:
            ValueError: the scene has no such object or category.
        """
        setup = replace(self.setup, bodies=self.bodies)  # with spawned bodies
        return SceneQueries(setup, self.frame(), ignore=ignore, categories=categories)

    def cast_ray(
        self,
        start: Point,
        end: Point,
        radius: float = 0.0,
        *,
        ignore: Iterable[str] = (),
        categories: Iterable[str] = (),
    ) -> RayHit | None:
        """Return the first object on the way of a ray, or of a disc, in the present state; None if nothing is hit.

        `queries` casts many rays in one call.

        Args:
            start: m.
            end: m.
            radius: of a disc that moves from start to end, m; default: a ray.
            ignore: names of bodies and static objects that are not seen.
            categories: collision categories that are seen; default: all.

        Raises:
            ValueError: a coordinate or the radius is invalid, or the scene has no such object or category.

        Example:
            >>> hit = sandbox.start("bounce").cast_ray((0.0, 8.0), (0.0, 0.0))
            >>> hit.name, hit.point
            ('ball', (0.0, 6.0))
        """
        return self.queries(ignore, categories).cast_ray(start, end, radius)

    def sensed(self, sensor: str) -> tuple[str, ...]:
        """Return the names of the objects that overlap a sensor in the present state: bodies, then static objects.

        Args:
            sensor: name of the sensor.

        Raises:
            ValueError: the scene has no sensor of that name.

        Example:
            >>> simulation = sandbox.start("sensors")
            >>> while not simulation.sensed("sight"):
            ...     simulation.step()
            >>> simulation.sensed("sight"), round(simulation.time, 3)
            (('ball',), 0.625)
        """
        number = number_of_sensor(self.scene, sensor)
        found = self._sensors.sensors(self.scene, self.bodies).detected(number, self.frame()).tolist()
        return tuple(self.bodies.names[k] if k >= 0 else self.scene.fixed_names[-1 - k] for k in found)

    def sensor_visits(self) -> tuple[SensorVisit, ...]:
        """Return the visits of sensors that ended since the last call, and those that last, by their begin.

        The recording starts with the first call, which returns the visits that last.
        """
        self._start_sensors()
        return self._sensors.visits(self.scene, self.bodies.names)

    def _start_sensors(self) -> None:
        if self.scene.sensors and not self._sensors.is_started:
            self._sensors.start(self.scene, self.bodies, self.frame())

    def contacts(self) -> Contacts:
        """Return the contacts since the last call; the first call starts the recording.

        A contact that lasts through a change of engine becomes a new contact. A visit of a sensor has a row in each
        call while it lasts, without impulse; its second index is that of the sensor, whose name is in
        `scene.fixed_names`.
        """
        self._start_sensors()
        earlier, self._earlier_contacts = self._earlier_contacts or [], []
        present = self._segment.contacts()
        found = Contacts.joined([*earlier, present]) if earlier else present
        return join_rows(found, self._sensors.take()) if self._sensors.is_started else found

    def account(self) -> Mapping[Cause, float]:
        """Return the energy change, J, by each cause since the first call, summed over all engines used."""
        return self._ledger.entries(self._segment.simulation)

    def watch(self, observer: Observer) -> None:
        """Register an observer that is called after every substep."""
        self._observer = observer
        self._earlier_contacts = self._earlier_contacts or []
        self._segment.watch(observer)

    def state_hash(self) -> str:
        """Return a hash of the time and of the exact state of every body."""
        return self.frame().state_hash()

    def close(self) -> None:
        """Release the resources of the engine."""
        self._segment.simulation.close()


_SESSION_ACTIONS: Mapping[type, Callable[[SwitchableSimulation, Any], None]] = {
    Explosion: SwitchableSimulation._explode,
    Pull: SwitchableSimulation._pull,
    Switch: SwitchableSimulation._switch,
    Launch: SwitchableSimulation._launch,
    Spawn: SwitchableSimulation._spawn,
    Join: SwitchableSimulation._join,
    Unjoin: SwitchableSimulation._unjoin,
}
"""Method that applies each action of a session; all others are those of an engine."""


class Switchable(Protocol):
    """Running scene to which a `Switch` can be applied."""

    @property
    def wanted(self) -> Settings:
        """Settings as requested; those that are None are chosen by the engine."""

    def apply(self, action: Action) -> object:
        """Apply an action now."""


def switch_engine(session: Switchable, engine: str) -> str | None:
    """Continue with another engine from the present state.

    Settings that only the present engine knows get the default of the other.

    Returns:
        A message that names those settings, or None.

    Raises:
        ActionError: the other engine cannot continue from here.
    """
    try:
        session.apply(Switch(time=0.0, engine=engine))
    except ActionError as error:
        own = [key for key in session.wanted.model_dump(exclude_defaults=True) if key not in COMMON]
        if not own:
            raise
        defaults: dict[str, Value] = {key: False if key == "half_kick" else None for key in own}
        try:
            session.apply(Switch(time=0.0, engine=engine, settings=defaults))
        except ActionError:
            raise error from None
        return f"chosen by {engine}: {', '.join(own)}"
    return None
