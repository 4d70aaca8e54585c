"""Snapshot of a frame: all values that drawing needs, without engine or pygame. Joint breaks and thruster flames."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from sandbox.action import Throttle
from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import JointArrays
from sandbox.scene.compile.potential import is_broken_at
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, Point
from sandbox.scene.description.forces import Thrust
from sandbox.scene.description.scene import default_name
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.trajectory import Contacts, Frame

NOTIFICATION_INTERVAL = 1.0
"""s of simulated time between notifications of broken joints"""


def broken_joints(breaks: FloatArray, time: float) -> list[int]:
    """Return the indices of the joints that have broken by a time, s; `breaks` (J,) holds their break times."""
    return np.flatnonzero(is_broken_at(breaks, np.asarray([time]))[0]).tolist() if len(breaks) else []


class BreakNotifier:
    """Notifications of broken joints: immediate for the first, then at most one per second, as a cloth tears slowly."""

    def __init__(self) -> None:
        self._notified, self._last_time = 0, 0.0

    def update(self, broken: int, now: float) -> list[tuple[str, str]]:
        """Return notifications, (level, text), for a number of broken joints at a time, s."""
        if broken < self._notified or now < self._last_time:  # after a seek backwards
            self._notified, self._last_time = broken, now
        more = broken - self._notified
        if not more or not (self._notified == 0 or now >= self._last_time + NOTIFICATION_INTERVAL):
            return []
        self._notified, self._last_time = broken, now
        return [("info", "a joint broke" if more == 1 else f"{more:,} joints broke")]


OVERLAYS = (
    "shapes",
    "velocities",
    "contacts",
    "impulses",
    "bounds",
    "joints",
    "centres",
    "names",
    "trails",
    "energy",
)
"""Layers of drawing besides static geometry, in the order of the keys 1 … 9, 0."""


@dataclass(frozen=True, eq=False)
class MissedContactMarker:
    """Marker of a recently missed contact."""

    position: tuple[float, float]
    """m"""
    age: float
    """s of real time since it was detected"""


class ThrusterFlame(NamedTuple):
    """Flame of an active thruster."""

    body: int
    """index"""
    origin: tuple[float, float]
    """origin relative to the centre of mass, in the body frame, m"""
    direction: tuple[float, float]
    """vector from the origin to the tip, in the body frame, m"""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of a scene to be drawn; it may be interpolated between two steps."""

    scene: Scene
    bodies: Bodies
    """N bodies, including spawned ones"""
    frame: Frame
    overlays: frozenset[str] = frozenset({"shapes"})
    """names of overlays, from `OVERLAYS`"""
    contacts: Contacts = field(default_factory=Contacts.none)
    """contacts of the last steps, with impulses"""
    seconds: float = 0.0
    """simulated time of those steps, s"""
    ghost: Frame | None = None
    """state of the bodies on another engine, drawn hollow; it may have fewer bodies"""
    trails: tuple[FloatArray, ...] = ()
    """(T, N, 2) m each, past positions, oldest first, nan if not present; any number of pieces"""
    overlapping: BoolArray | None = None
    """(N,) whether each body overlaps another, in scenes that show it by colour"""
    flashes: tuple[MissedContactMarker, ...] = ()
    picked: int | None = None
    """index of the selected body"""
    pull: tuple[tuple[float, float], tuple[float, float]] | None = None
    """ends of the mouse joint: the grip on a body, and the pointer, m"""
    broken: Collection[int] = ()
    """indices of the broken joints"""
    game: object | None = None
    """values that the `GameView` of the game draws, see `Rules.view_state`"""
    lit: frozenset[str] = frozenset()
    """names of the parts, `[[play.part]]`, whose lamps are lit"""
    below: float = 0.0
    """px at the top left covered by text"""
    flames: tuple[ThrusterFlame, ...] = ()
    """flames of the active thrusters"""
    steering: Mapping[str, float] = field(default_factory=dict)
    """level of the steering of tyres that are steered, by their names"""
    setup: Setup | None = None
    """setup of the running session; None if `bodies` are those of the scene or of a stored run"""

    @cached_property
    def joints(self) -> JointArrays:
        """The unbroken joints."""
        return (self.scene.joint_arrays if self.setup is None else self.setup.joints).without(self.broken)


@dataclass(frozen=True)
class HudStatus:
    """Values of the head-up display."""

    title: str
    engine: str
    settings: str
    """summary such as "dt 10 ms · 1 × 10" """
    step: int
    time: float
    """s, simulated"""
    paused: bool = False
    waits_for_start: bool = False
    start_keys: str = ""
    """the most important keys of a game that waits for its start"""
    """whether a real-time game waits for the first key"""
    question: str | None = None
    """confirmation that is asked for before data is lost"""
    out_of_sight: str | None = None
    """notice while no moving body is in view"""
    unfocused: bool = False
    """whether the window has lost the keyboard focus, which pauses the scene"""
    ended: str | None = None
    """reason why the run ends at this time"""
    replay: bool = False
    """whether a stored run is shown, which cannot be changed"""
    speed: float = 1.0
    """requested speed, as a multiple of real time"""
    real_speed: float = 1.0
    """measured speed"""
    frames_per_second: float = 0.0
    trust: str = "unknown"
    """`unknown`, `trusted`, or `lost` (past the predictability horizon)"""
    horizon: float | None = None
    """s, time at which trust was lost"""
    ghost: str | None = None
    """name of the ghost's engine"""
    distance: float | None = None
    """m, largest distance between a body and its ghost"""
    missed: int | None = None
    """number of contacts that the engine has missed; None if they are not detected"""
    recording: str | None = None
    """format and length of the recording in progress, such as "gif 3.2 s" """
    busy: str | None = None
    """progress of a background task, such as "replaying 40 %" """
    picked: tuple[str, ...] = ()
    """lines about the selected body"""
    messages: tuple[tuple[str, str], ...] = ()
    """(level, text), newest last; levels `info`, `warning`, `error`"""
    faults: tuple[str, ...] = ()
    """of a scene file that could not be loaded, while the previous scene keeps running"""
    claimed: tuple[tuple[str, str], ...] = ()
    """(keys, action) bound by the scene"""


FLAME_LENGTH = 1.1
"""Length of the flame of a body's strongest thruster at full throttle, in body radii."""


def active_thrusters(
    scene: Scene, bodies: Bodies, throttles: Mapping[str, Throttle], time: float
) -> tuple[ThrusterFlame, ...]:
    """Return the flames of the active thrusters.

    Args:
        scene: the scene.
        bodies: including spawned ones.
        throttles: current settings, by thruster name.
        time: s.
    """
    found = []
    for k, thrust in enumerate(scene.thrusts):
        level = _level(thrust, throttles.get(thrust.name or default_name("thrust", k)), time)
        force = math.hypot(*thrust.force)
        if level * force == 0.0 or thrust.body not in bodies.number_of:
            continue
        number = bodies.number_of[thrust.body]
        strongest = max(math.hypot(*each.force) for each in scene.thrusts if each.body == thrust.body)
        x, y = _centre(bodies.elements[int(bodies.element[number])])
        place = thrust.point[0] - x, thrust.point[1] - y
        # Square root, so that a tenth of the thrust is still visible.
        length = FLAME_LENGTH * float(bodies.radius[number]) * math.sqrt(level * force / strongest)
        flame = -thrust.force[0] / force * length, -thrust.force[1] / force * length
        found.append(ThrusterFlame(number, place, flame))
    return tuple(found)


def _level(thrust: Thrust, throttle: Throttle | None, time: float) -> float:
    if time < thrust.begin or (thrust.end is not None and time >= thrust.end):
        return 0.0
    if throttle is not None:
        return throttle.level
    return 0.0 if thrust.key is not None else 1.0


@lru_cache(maxsize=64)
def _centre(element: BodySource) -> Point:
    """Return the centre of mass in the frame in which an element is defined, m."""
    return geometry_of(element).centre
