"""Sight: what the window draws of one moment, as plain values; no engine, no pygame.

Breaks: when joints broke, which have by a time, and what is to be said of it.

Burning: the thrusts that fire at a moment, as the flames that are drawn of them.
"""

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

NOTIFY_EVERY = 1.0
"""s of the scene between two notes"""


def broken_joints(breaks: FloatArray, time: float) -> list[int]:
    """Return the numbers of the joints that have broken by a time, s; `breaks` (J,) says when each does."""
    return np.flatnonzero(is_broken_at(breaks, np.asarray([time]))[0]).tolist() if len(breaks) else []


class BreakTimes:
    """When each joint broke, as far as it has been seen."""

    def __init__(self, joints: int) -> None:
        """None of so many has."""
        self.times: FloatArray = np.full(joints, np.inf)
        """(J,) s, inf where it never did; what was handed out does not change"""

    def update(self, broken: Mapping[int, float]) -> None:
        """Learn when joints broke, s. Those that broke later than now are kept: the same way leads there again."""
        numbers = list(broken)
        if numbers and not np.isfinite(self.times[numbers]).all():
            self.times = self.times.copy()
            self.times[numbers] = list(broken.values())

    def reset(self) -> None:
        """Count all joints as whole."""
        self.times = np.full(len(self.times), np.inf)


class BreakNotifier:
    """Says how many joints broke, the first at once, then once a second: a cloth tears on and on."""

    def __init__(self) -> None:
        self._told, self._when = 0, 0.0

    def told(self, broken: int, now: float) -> list[tuple[str, str]]:
        """Return what is to be said, (level, text), where so many are broken at a time, s."""
        if broken < self._told or now < self._when:  # it has gone back
            self._told, self._when = broken, now
        more = broken - self._told
        if not more or not (self._told == 0 or now >= self._when + NOTIFY_EVERY):
            return []
        self._told, self._when = broken, now
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
"""What can be drawn besides fixed things, in the order of the keys 1 … 9, 0."""


@dataclass(frozen=True, eq=False)
class MissedContactMarker:
    """A missed contact that was noticed a moment ago."""

    position: tuple[float, float]
    """m"""
    age: float
    """s of real time since it was noticed"""


class ThrusterFlame(NamedTuple):
    """A thrust that fires."""

    body: int
    """its number"""
    place: tuple[float, float]
    """where it begins, from the centre of mass, in the body's own frame, m"""
    way: tuple[float, float]
    """from there to its tip, in the body's own frame, m"""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment of a scene, as it is drawn. Frames may lie between two steps."""

    scene: Scene
    bodies: Bodies
    """N of them, with those that were spawned"""
    frame: Frame
    overlays: frozenset[str] = frozenset({"shapes"})
    """of `OVERLAYS`"""
    contacts: Contacts = field(default_factory=Contacts.none)
    """those open now, with their impulses since the last picture"""
    seconds: float = 0.0
    """simulated time in which those impulses were given, s"""
    ghost: Frame | None = None
    """the same bodies as another engine has them, drawn hollow; it may know fewer"""
    trails: tuple[FloatArray, ...] = ()
    """(T, N, 2) m, the last places of the bodies, oldest first, nan where not there; any number of pieces"""
    overlapping: BoolArray | None = None
    """(N,) where the scene is one that shows contact by colour: who overlaps something"""
    flashes: tuple[MissedContactMarker, ...] = ()
    picked: int | None = None
    """number of the body whose figures are shown"""
    pull: tuple[tuple[float, float], tuple[float, float]] | None = None
    """where a body is held, and the hand that pulls it, m"""
    broken: Collection[int] = ()
    """numbers of the scene's joints that have broken by then"""
    game: object | None = None
    """values that the `GameView` of the game draws, see `Rules.view_state`"""
    lit: frozenset[str] = frozenset()
    """names of the parts, `[[play.part]]`, whose lamps are lit"""
    below: float = 0.0
    """px at the upper left that words over the picture cover"""
    flames: tuple[ThrusterFlame, ...] = ()
    """of the thrusts that fire"""
    setup: Setup | None = None
    """of the running session; None where `bodies` are those of the scene or of a recorded run"""

    @cached_property
    def links(self) -> JointArrays:
        """The joints that are whole."""
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
