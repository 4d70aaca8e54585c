"""Recorded runs: the state of a stored trajectory at any time, and its playback in real time."""

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from sandbox.action import Action, ActionError, Spawn, actions_from_json, in_order
from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.common.energy_balance import energy_of
from sandbox.games.session import LampLog
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.scene import zone_visits
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import from_session
from sandbox.step_clock import FixedStepClock
from sandbox.trajectory import Contacts, Frame, Trajectory
from sandbox.window.camera import ViewBox
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.playback.action_log import SceneHistory
from sandbox.window.playback.snapshot import MissedContactMarker, Snapshot, broken_joints
from sandbox.window.view_bounds import anchor_points, crowd_bounds, view_bounds

CONTACT_DURATION = 0.12
"""s of playback for which a contact is shown after its first touch; a single picture would be too short to see"""
MISSED_CONTACT_DURATION = 0.6
"""s of playback for which a missed contact is marked"""
TRAIL_DURATION = 1.0
"""s of playback, length of a trail"""
MAX_TRAIL_FRAMES = 60
"""maximum number of stored frames in a trail"""
TELEPORT_FACTOR = 2.0
"""A body that moved more than this times speed × time, plus its radius, was placed, not simulated. The radius allows
for bodies that are pushed apart."""


class RecordedRun:
    """A stored run, and its state at any time, as it is drawn.

    Args:
        trajectory: trajectory of at least one frame.
        name: name of the run in error messages.

    Raises:
        SceneError: the scene or the bodies of the run are missing or invalid.
    """

    def __init__(self, trajectory: Trajectory, name: str = "<run>") -> None:
        self.trajectory = trajectory
        self.scene = scene_of_run(trajectory, name)
        self.bodies = bodies_of_run(trajectory, self.scene, name)
        self._scenes = SceneHistory(self.scene, actions_of_run(trajectory, name))
        self._cached: Frame | None = None  # one picture needs the state of the same time several times
        try:
            self.breaks: FloatArray = trajectory.breaks(len(self.scene.joint_arrays))
        except ValueError as error:
            raise SceneError([Fault(name, None, "broken_time", str(error))]) from None
        try:
            self._lamps = LampLog.from_changes((trajectory.info.get("game") or {}).get("lamps", ()))
        except ValueError as error:
            raise SceneError([Fault(name, None, "info.game", str(error))]) from None

    @property
    def duration(self) -> float:
        """Time of the last frame, s."""
        return float(self.trajectory.time[-1])

    @cached_property
    def bounds(self) -> ViewBox:
        """Corners of a view of the whole run, m; without bodies that stray far from the rest."""
        if self.scene.play.area is not None or self.scene.play.view is not None:
            return view_bounds(self.scene)
        return crowd_bounds(self.trajectory.position, self.bodies.radius, anchor_points(self.scene))

    def frame(self, time: float) -> Frame:
        """Return the state at a time, s, by linear interpolation between stored frames.

        A body that appears, is retired, or is placed elsewhere between two frames keeps the earlier state.
        """
        if self._cached is None or self._cached.time != time:
            self._cached = self._frame_at(time)
        return self._cached

    def _frame_at(self, time: float) -> Frame:
        run = self.trajectory
        k = int(np.clip(np.searchsorted(run.time, time, side="right") - 1, 0, len(run.time) - 1))
        after = min(k + 1, len(run.time) - 1)
        span = float(run.time[after] - run.time[k])
        alpha = min(max((time - float(run.time[k])) / span, 0.0), 1.0) if span > 0.0 else 0.0
        gone = time >= run.retired_time
        present = ~gone & np.isfinite(run.position[k]).all(axis=1)
        continuous = self._moves_continuously(k, after, span) if alpha > 0.0 else np.zeros(len(present), np.bool_)
        weight = np.where(continuous, alpha, 0.0)

        def interpolated(states: FloatArray) -> FloatArray:
            first, second = states[k], states[after]
            each = weight if first.ndim == 1 else weight[:, None]
            with np.errstate(over="ignore", invalid="ignore"):  # the last frame of a run that diverged
                return np.asarray(np.where(each > 0.0, first + (second - first) * each, first))

        velocity, spin = interpolated(run.velocity), interpolated(run.angular_velocity)
        velocity[gone], spin[gone] = 0.0, 0.0
        roll = interpolated(run.spin)[:, :2] if len(run.spin) else None
        layer = run.layer[k].astype(np.int64).clip(0) if len(run.layer) else None
        return Frame(time, interpolated(run.position), velocity, interpolated(run.angle), spin, present, roll, layer)

    def _moves_continuously(self, k: int, after: int, span: float) -> BoolArray:
        """Return (N,) which bodies are neither retired nor placed elsewhere between two frames, `span` s apart."""
        run = self.trajectory
        retired = (run.retired_time > run.time[k]) & (run.retired_time <= run.time[after])
        with np.errstate(over="ignore", invalid="ignore"):
            moved = np.linalg.norm(run.position[after] - run.position[k], axis=1)
            speed = np.maximum(*(np.linalg.norm(run.velocity[row], axis=1) for row in (k, after)))
            # False for nan.
            return np.asarray((moved <= TELEPORT_FACTOR * speed * span + self.bodies.radius) & ~retired)

    def snapshot(
        self, time: float, overlays: frozenset[str], speed: float = 1.0, ghost: Frame | None = None
    ) -> Snapshot:
        """Return the snapshot of a time, s.

        Args:
            time: of the run.
            overlays: of `snapshot.OVERLAYS`.
            speed: of the playback, as a multiple of real time: markers are shown for a fixed real time.
            ghost: a state to draw beside it, hollow.
        """
        frame = self.frame(time)
        shows_overlap = self.scene.play.show == "overlap"
        return Snapshot(
            scene=self._scenes.at(time),
            bodies=self.bodies,
            frame=frame,
            overlays=overlays,
            contacts=self.contacts(time, speed),
            seconds=CONTACT_DURATION * speed,
            ghost=ghost,
            trails=self._trails(frame, TRAIL_DURATION * speed) if "trails" in overlays else (),
            overlapping=overlapping_bodies(self.scene, self.bodies, frame) if shows_overlap else None,
            flashes=tuple(self._missed_contacts(time, MISSED_CONTACT_DURATION * speed, speed)),
            broken=broken_joints(self.breaks, time),
            lit=self._lamps.at(time),
        )

    def contacts(self, time: float, speed: float = 1.0) -> Contacts:
        """Return the contacts that are shown at a time, s: those that began in the last `CONTACT_DURATION`."""
        run = self.trajectory
        recent = (run.contact_time > time - CONTACT_DURATION * speed) & (run.contact_time <= time)
        rows = np.flatnonzero(recent & ~zone_visits(run.contact_pair, self.scene))
        columns = (run.contact_point, run.contact_normal, run.contact_impulse)
        return Contacts(run.contact_time[rows], run.contact_pair[rows], *(column[rows] for column in columns))

    def _trails(self, frame: Frame, length: float) -> tuple[FloatArray, ...]:
        """Return (T, N, 2) m the positions in the stored frames of the last `length` s, and (1, N, 2) m those now."""
        run = self.trajectory
        first, last = np.searchsorted(run.time, (frame.time - length, frame.time), side="right")
        rows = np.arange(first, last)
        rows = rows[-1 :: -max(1, -(-len(rows) // MAX_TRAIL_FRAMES))][::-1]
        gone = run.time[rows, None] >= run.retired_time
        past = np.where(gone[..., None], np.nan, run.position[rows])
        now = np.where(frame.present[:, None], frame.position, np.nan)
        return past, now[None]

    def _missed_contacts(self, time: float, length: float, speed: float) -> Iterator[MissedContactMarker]:
        """Yield the contacts missed in the last `length` s, each at the position of its first body."""
        run = self.trajectory
        for row in np.flatnonzero((run.missed_time > time - length) & (run.missed_time <= time)).tolist():
            missed = float(run.missed_time[row])
            x, y = self._frame_at(missed).position[int(run.missed_pair[row, 0])].tolist()
            yield MissedContactMarker((x, y), (time - missed) / speed)


def scene_of_run(trajectory: Trajectory, name: str = "<run>") -> Scene:
    """Return the scene of a run.

    Raises:
        SceneError: it is missing or invalid.
    """
    document = trajectory.info.get("scene")
    if not isinstance(document, dict):
        raise SceneError([Fault(name, None, "info.scene", "the stored run does not contain its scene")])
    return from_session(document, name)


def actions_of_run(trajectory: Trajectory, name: str = "<run>") -> tuple[Action, ...]:
    """Return the actions of a run, in order of time.

    Raises:
        SceneError: they are invalid.
    """
    try:
        return in_order(actions_from_json(json.dumps(trajectory.info.get("actions", []))))
    except ActionError as error:
        raise SceneError([Fault(name, None, "info.actions", line) for line in str(error).splitlines()]) from None


def bodies_of_run(trajectory: Trajectory, scene: Scene, name: str = "<run>") -> Bodies:
    """Return the bodies of a run: those of its scene, and those that were spawned.

    Raises:
        SceneError: the run has other bodies than its scene and actions make.
    """
    bodies, actions = scene.bodies, in_order((*actions_of_run(trajectory, name), *scene.events))
    spawned = [action.single for action in actions if isinstance(action, Spawn)]
    names = [str(name) for name in trajectory.names.tolist()]
    for single, body_name in zip(spawned, names[len(bodies) :], strict=False):  # a run that ended early lacks the last
        bodies = bodies.joined_by(single, body_name)
    if list(bodies.names) != names:
        raise SceneError([Fault(name, None, "names", "the run's bodies do not match its scene and actions")])
    return bodies


class RecordedView:
    """Playback of a recorded run. It can be stepped and sought, but not changed; a step is a stored frame."""

    def __init__(self, run: RecordedRun) -> None:
        """Start at the first frame.

        Raises:
            pydantic.ValidationError: the solver settings of the run are invalid.
        """
        self.run = run
        self.clock = FixedStepClock()
        self.notifications: list[tuple[str, str]] = []
        self.settings = Settings.model_validate(run.trajectory.info["settings"])
        self._times = run.trajectory.time
        self._time = float(self._times[0])
        self.busy: str | None = None

    @property
    def scene(self) -> Scene:
        """Its scene."""
        return self.run.scene

    @property
    def bodies(self) -> Bodies:
        """The bodies by index."""
        return self.run.bodies

    @property
    def engine(self) -> str:
        """Name of the engine that computed the run."""
        return str(self.run.trajectory.info["engine"])

    @property
    def step_number(self) -> int:
        """Index of the last stored frame at or before the present time."""
        return max(int(np.searchsorted(self._times, self._time, side="right")) - 1, 0)

    @property
    def frame(self) -> Frame:
        """The state at the present time."""
        return self.run.frame(self._time)

    @property
    def displayed_frame(self) -> Frame:
        """The state that is drawn."""
        return self.frame

    @property
    def start_time(self) -> float:
        """The first time, s."""
        return float(self._times[0])

    @property
    def end_time(self) -> float:
        """The last time, s."""
        return float(self._times[-1])

    @property
    def at_end(self) -> bool:
        """Whether the present time is the last."""
        return self._time >= self.end_time

    @property
    def keyframe_times(self) -> tuple[float, ...]:
        """Times of checkpoints, s: none, as every frame is stored."""
        return ()

    @property
    def missed_contacts(self) -> int | None:
        """Contacts missed so far; None if the run was not audited."""
        run = self.run.trajectory
        return int((run.missed_time <= self._time).sum()) if run.missed_contacts is not None else None

    def update(self, elapsed: float, paused: bool) -> None:
        """Advance the present time by elapsed real time, s."""
        if paused or self.at_end:
            self.clock.reset()
            return
        self._time = min(self._time + self.clock.scale_time(elapsed), self.end_time)

    def step(self) -> None:
        """Go to the next stored frame."""
        self._time = float(self._times[min(self.step_number + 1, len(self._times) - 1)])

    def step_back(self) -> None:
        """Go to the stored frame before the present time."""
        k = self.step_number
        earlier = k if float(self._times[k]) < self._time else max(k - 1, 0)
        self._time = float(self._times[earlier])

    def scrub(self, time: float) -> None:
        """Go to a time, s."""
        self._time = min(max(time, self.start_time), self.end_time)

    def commit_scrub(self) -> None:
        """Do nothing: `scrub` has already changed the present time."""

    def energy(self) -> tuple[float, float, float]:
        """Return the kinetic, potential and total energy, J."""
        return energy_of(self.frame, self.bodies, self.scene.world.gravity, self.scene, self.run.breaks)

    @property
    def contacts(self) -> Contacts:
        """The contacts that are shown."""
        return self.run.contacts(self._time, self.clock.speed)

    def snapshot(
        self,
        overlays: frozenset[str],
        picked: int | None = None,
        pull: tuple[tuple[float, float], tuple[float, float]] | None = None,
    ) -> Snapshot:
        """Return the snapshot of the present time.

        Args:
            overlays: of `snapshot.OVERLAYS`.
            picked: index of the picked body.
            pull: ends of the mouse joint, m; None, as bodies of a recorded run cannot be pulled.
        """
        return replace(self.run.snapshot(self._time, overlays, self.clock.speed), picked=picked, pull=pull)

    def close(self) -> None:
        """Do nothing: no engine runs."""
