"""Snapshot: the values that are drawn of one frame, with joint breaks and thruster flames; no engine, no pygame."""

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
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, Point
from sandbox.scene.description.forces import Thrust
from sandbox.scene.description.scene import default_name
from sandbox.scene.geometry.shapes import form_of
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame

NOTIFICATION_INTERVAL = 1.0
"""s of the scene between two notifications of broken joints"""


def broken_joints(breaks: FloatArray, time: float) -> list[int]:
    """Return the indices of the joints that have broken by a time, s; `breaks` (J,) holds their break times."""
    return np.flatnonzero(is_broken_at(breaks, np.asarray([time]))[0]).tolist() if len(breaks) else []


class BreakTimes:
    """When each joint broke."""

    def __init__(self, joints: int) -> None:
        """Start with all joints whole."""
        self.times: FloatArray = np.full(joints, np.inf)
        """(J,) s, inf if it never did; replaced by an update, never changed in place"""

    def update(self, broken: Mapping[int, float]) -> None:
        """Add the times at which joints broke, s. Times later than now stay: a replay leads there again."""
        numbers = list(broken)
        if numbers and not np.isfinite(self.times[numbers]).all():
            self.times = self.times.copy()
            self.times[numbers] = list(broken.values())

    def reset(self) -> None:
        """Count all joints as whole."""
        self.times = np.full(len(self.times), np.inf)


class BreakNotifier:
    """Notifies of broken joints: of the first at once, then once a second, as a cloth tears in many steps."""

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
"""What can be drawn besides static geometry, in the order of the keys 1 … 9, 0."""


@dataclass(frozen=True, eq=False)
class MissedContactMarker:
    """A missed contact that was detected a moment ago."""

    position: tuple[float, float]
    """m"""
    age: float
    """s of real time since it was detected"""


class ThrusterFlame(NamedTuple):
    """Flame of a thruster that fires."""

    body: int
    """index"""
    place: tuple[float, float]
    """its origin, from the centre of mass, in the body frame, m"""
    way: tuple[float, float]
    """from its origin to its tip, in the body frame, m"""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of a scene as it is drawn; it may lie between two steps."""

    scene: Scene
    bodies: Bodies
    """N, with those that were spawned"""
    frame: Frame
    overlays: frozenset[str] = frozenset({"shapes"})
    """of `OVERLAYS`"""
    contacts: Contacts = field(default_factory=Contacts.none)
    """of the last steps, with their impulses"""
    seconds: float = 0.0
    """simulated time of those steps, s"""
    ghost: Frame | None = None
    """state of the same bodies on another engine, drawn hollow; it may have fewer"""
    trails: tuple[FloatArray, ...] = ()
    """(T, N, 2) m each, last positions of the bodies, oldest first, nan if not present; any number of pieces"""
    overlapping: BoolArray | None = None
    """(N,) which bodies overlap something, in scenes that show it by colour"""
    flashes: tuple[MissedContactMarker, ...] = ()
    picked: int | None = None
    """index of the body that is inspected"""
    pull: tuple[tuple[float, float], tuple[float, float]] | None = None
    """ends of the mouse joint: the grip on a body, and the pointer, m"""
    broken: Collection[int] = ()
    """indices of the joints of the scene that have broken"""
    game: object | None = None
    """values that the `GameView` of the game draws, see `Rules.view_state`"""
    lit: frozenset[str] = frozenset()
    """names of the parts, `[[play.part]]`, whose lamps are lit"""
    below: float = 0.0
    """px at the top left that are covered by text"""
    flames: tuple[ThrusterFlame, ...] = ()
    """of the thrusters that fire"""
    setup: Setup | None = None
    """of the running session; None where `bodies` are those of the scene or of a recorded run"""

    @cached_property
    def links(self) -> JointArrays:
        """The joints that are not broken."""
        return (self.setup or self.scene).links.without(self.broken)


@dataclass(frozen=True)
class HudStatus:
    """What the window tells in words."""

    title: str
    engine: str
    settings: str
    """such as "dt 10 ms · 1 × 10" """
    step: int
    time: float
    """s, simulated"""
    paused: bool = False
    waits_for_start: bool = False
    """a real-time game that no key has started yet"""
    question: str | None = None
    """what is asked before something is lost"""
    out_of_sight: str | None = None
    """what can be done where nothing that moves is in the picture"""
    unfocused: bool = False
    """another window has the keyboard, and time stands still"""
    ended: str | None = None
    """why nothing comes after this moment"""
    replay: bool = False
    """a stored run: nothing can be changed"""
    speed: float = 1.0
    """asked, as a share of real time"""
    real_speed: float = 1.0
    """reached"""
    frames_per_second: float = 0.0
    trust: str = "unknown"
    """`unknown`, `trusted`, or `lost`: past the horizon of predictability"""
    horizon: float | None = None
    """s, when trust was lost"""
    ghost: str | None = None
    """the ghost's engine"""
    distance: float | None = None
    """m, the largest between a body and its ghost"""
    missed: int | None = None
    """contacts that the engine missed so far; None where none are looked for"""
    recording: str | None = None
    """what is being recorded, such as "gif 3.2 s" """
    busy: str | None = None
    """what the window is waiting for, such as "replaying 40 %" """
    picked: tuple[str, ...] = ()
    """lines about the picked body"""
    messages: tuple[tuple[str, str], ...] = ()
    """(level, text), newest last; levels `info`, `warning`, `error`"""
    faults: tuple[str, ...] = ()
    """of the scene file, while the old scene goes on"""
    claimed: tuple[tuple[str, str], ...] = ()
    """keys that the scene claims, and what each does"""


LONG = 1.1
"""of a body's reach, the flame of its strongest thrust, fully open"""


def active_thrusters(
    scene: Scene, bodies: Bodies, throttles: Mapping[str, Throttle], time: float
) -> tuple[ThrusterFlame, ...]:
    """Return the flames of the thrusts that act.

    Args:
        scene: what runs.
        bodies: by number.
        throttles: that were set, by the names of their thrusts.
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
        # By the root: a thrust of a tenth is seen too.
        long = LONG * float(bodies.radius[number]) * math.sqrt(level * force / strongest)
        found.append(ThrusterFlame(number, place, (-thrust.force[0] / force * long, -thrust.force[1] / force * long)))
    return tuple(found)


def _level(thrust: Thrust, throttle: Throttle | None, time: float) -> float:
    if time < thrust.begin or (thrust.end is not None and time >= thrust.end):
        return 0.0
    if throttle is not None:
        return throttle.level
    return 0.0 if thrust.key is not None else 1.0


@lru_cache(maxsize=64)
def _centre(element: BodySource) -> Point:
    """Return the centre of mass in the frame that an element was drawn in, m."""
    return form_of(element).centre
