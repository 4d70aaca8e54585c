"""Sight: what the window draws of one moment, as plain values; no engine, no pygame."""

from collections.abc import Collection
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from sandbox.arrays import BoolArray, FloatArray
from sandbox.play.artillery.gunnery import Gunnery
from sandbox.play.billiards.aim import Aim
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import Links
from sandbox.scene.compile.setup import Setup
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame

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
class Flash:
    """A missed contact that was noticed a moment ago."""

    position: tuple[float, float]
    """m"""
    age: float
    """s of real time since it was noticed"""


class Flame(NamedTuple):
    """A thrust that fires."""

    body: int
    """its number"""
    place: tuple[float, float]
    """where it begins, from the centre of mass, in the body's own frame, m"""
    way: tuple[float, float]
    """from there to its tip, in the body's own frame, m"""


@dataclass(frozen=True, eq=False)
class Sight:
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
    flashes: tuple[Flash, ...] = ()
    picked: int | None = None
    """number of the body whose figures are shown"""
    pull: tuple[tuple[float, float], tuple[float, float]] | None = None
    """where a body is held, and the hand that pulls it, m"""
    broken: Collection[int] = ()
    """numbers of the scene's joints that have broken by then"""
    aim: Aim | None = None
    """of the next stroke, at a table"""
    gunnery: Gunnery | None = None
    """what is drawn of a game of artillery besides its bodies"""
    lit: frozenset[str] = frozenset()
    """names of the parts, `[[play.part]]`, whose lamps are lit"""
    below: float = 0.0
    """px at the upper left that words over the picture cover"""
    flames: tuple[Flame, ...] = ()
    """of the thrusts that fire"""
    setup: Setup | None = None
    """of the running session; None where `bodies` are those of the scene or of a recorded run"""

    @cached_property
    def links(self) -> Links:
        """The joints that are whole."""
        return (self.setup or self.scene).links.without(self.broken)


@dataclass(frozen=True)
class Status:
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
