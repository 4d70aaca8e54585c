"""Film: a stored run as pictures. It knows the state at any time of the run, and draws it as the window does."""

import json
import math
from collections.abc import Iterator
from functools import cached_property

import numpy as np
import pygame

from sandbox.action import Action, ActionError, Spawn, actions_from_json, in_order
from sandbox.arrays import BoolArray, FloatArray
from sandbox.games.session import LampLog
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.scene import zone_visits
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import from_session
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame, Trajectory
from sandbox.window.camera import Box, Camera
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.playback.action_log import SceneHistory
from sandbox.window.playback.snapshot import MissedContactMarker, Snapshot, broken_joints
from sandbox.window.render.palette import FAINT, INK
from sandbox.window.render.renderer import InsetRenderer, Renderer
from sandbox.window.render.text import draw_text, text_size
from sandbox.window.ui.energy_plot import RunGraph
from sandbox.window.view_bounds import anchor_points, crowd_bounds, view_bounds

LINGER = 0.12
"""s of the film that a contact stays in sight after its first touch; one picture would be too short to see"""
FLASH = 0.6
"""s of the film that a missed contact is marked"""
NARROW = 320
"""px: a caption would cover too much of what is smaller"""
TRAIL, TRAIL_PLACES = 1.0, 60
"""How far back a trail goes, s of the film, and through how many stored frames at most."""


class RecordedRun:
    """A run to be looked at.

    Args:
        trajectory: the run; it has at least one frame.
        name: what faults call it.

    Raises:
        SceneError: the run does not say which scene and bodies it is of, or not correctly.
    """

    def __init__(self, trajectory: Trajectory, name: str = "<run>") -> None:
        self.trajectory = trajectory
        self.scene = scene_of_run(trajectory, name)
        self.bodies = bodies_of_run(trajectory, self.scene, name)
        self._scenery = SceneHistory(self.scene, actions_of_run(trajectory, name))
        self._picture, self._inset = Renderer(), InsetRenderer()
        self._last: Frame | None = None  # one picture asks for the same time again and again
        try:
            self.breaks: FloatArray = trajectory.breaks(len(self.scene.links))
        except ValueError as error:
            raise SceneError([Fault(name, None, "broken_time", str(error))]) from None
        try:
            self._lamps = LampLog.of((trajectory.info.get("game") or {}).get("lamps", ()))
        except ValueError as error:
            raise SceneError([Fault(name, None, "info.game", str(error))]) from None
        self._graph = RunGraph(trajectory, self.scene, self.bodies)

    @property
    def duration(self) -> float:
        """Time of the last frame, s."""
        return float(self.trajectory.time[-1])

    def frame(self, time: float) -> Frame:
        """Return the state at a time, s, between stored frames linearly.

        A body that appears, is retired, or is put elsewhere between two frames stays where the earlier one has it.
        """
        if self._last is None or self._last.time != time:
            self._last = self._frame_at(time)
        return self._last

    def _frame_at(self, time: float) -> Frame:
        run = self.trajectory
        k = int(np.clip(np.searchsorted(run.time, time, side="right") - 1, 0, len(run.time) - 1))
        after = min(k + 1, len(run.time) - 1)
        span = float(run.time[after] - run.time[k])
        share = min(max((time - float(run.time[k])) / span, 0.0), 1.0) if span > 0.0 else 0.0
        gone = time >= run.retired_time
        present = ~gone & np.isfinite(run.position[k]).all(axis=1)
        steady = self._steady(k, after, span) if share > 0.0 else np.zeros(len(present), np.bool_)
        weight = np.where(steady, share, 0.0)

        def between(states: FloatArray) -> FloatArray:
            here, there = states[k], states[after]
            each = weight if here.ndim == 1 else weight[:, None]
            with np.errstate(over="ignore", invalid="ignore"):  # the last frame of a run that diverged
                return np.asarray(np.where(each > 0.0, here + (there - here) * each, here))

        velocity, spin = between(run.velocity), between(run.angular_velocity)
        velocity[gone], spin[gone] = 0.0, 0.0
        roll = between(run.spin)[:, :2] if len(run.spin) else None
        layer = run.layer[k].astype(np.int64).clip(0) if len(run.layer) else None
        return Frame(time, between(run.position), velocity, between(run.angle), spin, present, roll, layer)

    def _steady(self, k: int, after: int, span: float) -> BoolArray:
        """Tell who moves from one frame to the next as bodies do: neither retired between them nor put elsewhere."""
        run = self.trajectory
        retired = (run.retired_time > run.time[k]) & (run.retired_time <= run.time[after])
        with np.errstate(over="ignore", invalid="ignore"):
            moved = np.linalg.norm(run.position[after] - run.position[k], axis=1)
            speed = np.maximum(*(np.linalg.norm(run.velocity[at], axis=1) for at in (k, after)))
            # Twice what its speed explains, and a radius for bodies that are pushed apart; nan is not steady.
            return np.asarray((moved <= 2.0 * speed * span + self.bodies.radius) & ~retired)

    def sight(self, time: float, overlays: frozenset[str], speed: float = 1.0, ghost: Frame | None = None) -> Snapshot:
        """Return what is drawn of a time, s.

        Args:
            time: of the run.
            overlays: of `sight.OVERLAYS`.
            speed: of the film, as a share of real time: what lingers does so for as long as it is to be seen.
            ghost: a state to draw beside it, hollow.
        """
        frame = self.frame(time)
        by_contact = self.scene.play.show == "overlap"
        return Snapshot(
            scene=self._scenery.at(time),
            bodies=self.bodies,
            frame=frame,
            overlays=overlays,
            contacts=self.contacts(time, speed),
            seconds=LINGER * speed,
            ghost=ghost,
            trails=self._trails(frame, TRAIL * speed) if "trails" in overlays else (),
            overlapping=overlapping_bodies(self.scene, self.bodies, frame) if by_contact else None,
            flashes=tuple(self._flashes(time, FLASH * speed, speed)),
            broken=broken_joints(self.breaks, time),
            lit=self._lamps.at(time),
        )

    def contacts(self, time: float, speed: float = 1.0) -> Contacts:
        """Return the contacts that are in sight at a time, s: those that began a moment of the film ago."""
        run = self.trajectory
        recent = (run.contact_time > time - LINGER * speed) & (run.contact_time <= time)
        rows = np.flatnonzero(recent & ~zone_visits(run.contact_pair, self.scene))
        columns = (run.contact_point, run.contact_normal, run.contact_impulse)
        return Contacts(run.contact_time[rows], run.contact_pair[rows], *(column[rows] for column in columns))

    def _trails(self, frame: Frame, length: float) -> tuple[FloatArray, ...]:
        """Return the places of the last stored frames, and the present ones."""
        run = self.trajectory
        first, last = np.searchsorted(run.time, (frame.time - length, frame.time), side="right")
        rows = np.arange(first, last)
        rows = rows[-1 :: -max(1, -(-len(rows) // TRAIL_PLACES))][::-1]
        gone = run.time[rows, None] >= run.retired_time
        past = np.where(gone[..., None], np.nan, run.position[rows])
        now = np.where(frame.present[:, None], frame.position, np.nan)
        return past, now[None]

    def _flashes(self, time: float, length: float, speed: float) -> Iterator[MissedContactMarker]:
        """Yield the contacts missed a moment ago, each where its first body was."""
        run = self.trajectory
        for row in np.flatnonzero((run.missed_time > time - length) & (run.missed_time <= time)).tolist():
            missed = float(run.missed_time[row])
            x, y = self._frame_at(missed).position[int(run.missed_pair[row, 0])].tolist()
            yield MissedContactMarker((x, y), (time - missed) / speed)

    @cached_property
    def box(self) -> Box:
        """What a picture of the whole run shows, m; what strays far from the rest does not count."""
        if self.scene.play.area is not None or self.scene.play.view is not None:
            return view_bounds(self.scene)
        return crowd_bounds(self.trajectory.position, self.bodies.radius, anchor_points(self.scene))

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        time: float,
        overlays: frozenset[str] = frozenset({"shapes"}),
        speed: float = 1.0,
        caption: bool = True,
    ) -> None:
        """Draw the state at a time, s.

        Args:
            surface: where; it needs no display.
            camera: which part of the world.
            time: of the run.
            overlays: of `sight.OVERLAYS`.
            speed: of the film, as a share of real time.
            caption: write title, engine and time into the upper left corner, where there is room for them.
        """
        unit = ui_scale_of(surface.get_size())
        sight = self.sight(time, overlays, speed)
        self._picture.draw(surface, camera, sight, unit=unit)
        self._inset.draw(surface, camera, sight, surface.get_rect(), unit=unit)
        if "energy" in overlays:
            self._graph.draw(surface, time, unit)
        if caption and surface.get_width() >= NARROW:
            self._write_caption(surface, time, unit)

    def _write_caption(self, surface: pygame.Surface, time: float, unit: float) -> None:
        left, size = 14.0 * unit, 17.0 * unit
        title = self.scene.title or "untitled"
        draw_text(surface, title, (left, 12.0 * unit), size, INK, bold=True)
        digits = max(2, len(f"{self.duration:.2f}"))
        words = f"{self.trajectory.info['engine']}   {time:{digits}.2f} s"
        height = text_size(title, size, bold=True)[1]
        draw_text(surface, words, (left, 12.0 * unit + 1.15 * height), 14.0 * unit, FAINT, mono=True)


def ui_scale_of(size: tuple[int, int]) -> float:
    """Return the factor by which lines and words of a picture are scaled: 1 where it is meant to be seen as it is."""
    return max(0.75, min(size[0] / 960.0, size[1] / 540.0))


def frame_times(start: float, end: float, fps: float, speed: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Return when a film's pictures are, (K,) s of the run, and how long each is shown, (K,) s, on the whole exactly.

    Args:
        start: of the film, s of the run.
        end: of the film, s of the run.
        fps: pictures a second.
        speed: seconds of the run a second.
    """
    seconds = (end - start) / speed
    count = max(1, math.ceil(seconds * fps - 0.5 - 1e-9))  # half a picture counts down, however it was rounded
    shown: FloatArray = np.full(count, 1.0 / fps)
    if seconds > 0.0:
        shown[-1] = seconds - (count - 1) / fps
    return np.asarray(start + np.arange(count) * (speed / fps)), shown


def scene_of_run(trajectory: Trajectory, name: str = "<run>") -> Scene:
    """Return the scene that a run is of.

    Raises:
        SceneError: the run does not say, or not correctly.
    """
    document = trajectory.info.get("scene")
    if not isinstance(document, dict):
        raise SceneError([Fault(name, None, "info.scene", "the stored run does not contain its scene")])
    return from_session(document, name)


def actions_of_run(trajectory: Trajectory, name: str = "<run>") -> tuple[Action, ...]:
    """Return what was done in a run, in order of time.

    Raises:
        SceneError: that is not said correctly.
    """
    try:
        return in_order(actions_from_json(json.dumps(trajectory.info.get("actions", []))))
    except ActionError as error:
        raise SceneError([Fault(name, None, "info.actions", line) for line in str(error).splitlines()]) from None


def bodies_of_run(trajectory: Trajectory, scene: Scene, name: str = "<run>") -> Bodies:
    """Return the bodies of a run: its scene's, and those that were spawned.

    Raises:
        SceneError: the run has others than its scene and actions make.
    """
    bodies, actions = scene.bodies, actions_of_run(trajectory, name)
    spawned = [action.single for action in actions if isinstance(action, Spawn)]
    names = [str(name) for name in trajectory.names.tolist()]
    for single, called in zip(spawned, names[len(bodies) :], strict=False):  # a run that ended early lacks the last
        bodies = bodies.joined_by(single, called)
    if list(bodies.names) != names:
        raise SceneError([Fault(name, None, "names", "the run's bodies do not match its scene and actions")])
    return bodies
