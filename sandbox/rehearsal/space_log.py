"""Log of the pymunk spaces of a game: states of all bodies after each frame, and the calls of collision callbacks.

Bodies, shapes and joints have numbers in the order in which the game adds them to its spaces, so that they are found
again in another run. The number of an object that a collision callback adds follows from its contact.
"""

import hashlib
import sys
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from types import FrameType
from typing import Any, ClassVar, NamedTuple
from unittest.mock import patch
from weakref import WeakKeyDictionary, WeakSet

import numpy as np
import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies

from sandbox.arrays import FloatArray, IntArray
from sandbox.rehearsal.step_settings import SPACE_ATTRIBUTES
from sandbox.rehearsal.variable_names import body_names, type_name

PHASES = ("begin", "pre_solve", "post_solve", "separate")
FIELDS = BodyFields.BODY_ID | BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
WIDTH = 6
HASH_BYTES = 4
CAUSED = 2**32
"""Numbers of objects that callbacks add begin here"""
WORLD = -1
"""Number of the static body of a space"""


class GameChange(NamedTuple):
    """Body or joint that a game adds to a space, or removes from it, after its first step."""

    frame: int
    is_added: bool
    is_joint: bool
    number: int
    """number of the body or of the joint"""


class GameShape(NamedTuple):
    """Form of a shape, relative to its body."""

    kind: str
    """`circle`, `segment` or `polygon`"""
    points: tuple[tuple[float, float], ...]
    """centre of a circle, ends of a segment, vertices of a polygon, in units of the game"""
    radius: float
    is_sensor: bool

    @classmethod
    def of(cls, shape: pymunk.Shape) -> "GameShape":
        """Return the form of a shape."""
        if isinstance(shape, pymunk.Circle):
            kind, points = "circle", [shape.offset]
        elif isinstance(shape, pymunk.Segment):
            kind, points = "segment", [shape.a, shape.b]
        else:
            assert isinstance(shape, pymunk.Poly)
            kind, points = "polygon", shape.get_vertices()
        return cls(kind, tuple((each.x, each.y) for each in points), shape.radius, shape.sensor)


class LoggedFrame(NamedTuple):
    """States of all bodies at the end of a frame."""

    bodies: IntArray
    """(N,) numbers of the bodies, ascending"""
    states: FloatArray
    """(N, 6) x, y, angle, velocity and angular velocity, in units of the game"""


class GameCallback(NamedTuple):
    """Collision callback of a game."""

    function: str
    """qualified name"""
    type_a: str
    """name of the collision type in the game, or its number; `any` for any type"""
    type_b: str
    phase: str
    """`begin`, `pre_solve`, `post_solve` or `separate`"""

    def __str__(self) -> str:
        """Return the callback as the game registers it."""
        return f"on_collision({self.type_a}, {self.type_b}) {self.phase} {self.function}"


class SpaceLog:
    """Log of all spaces of a program.

    Args:
        keeps_states: whether it keeps the states of each frame, or their hashes only.
    """

    def __init__(self, *, keeps_states: bool = True) -> None:
        self.frame = 0
        self.frames: list[LoggedFrame] = []
        self.hashes: list[str] = []
        self.callbacks: dict[GameCallback, int] = {}
        """number of each callback"""
        self.calls: dict[tuple[int, int, tuple[int, int]], int] = {}
        """calls by frame, callback and shapes, in order"""
        self.steps = 0
        """calls of `Space.step`"""
        self._keeps_states = keeps_states
        self._stepped: dict[pymunk.Space, None] = {}  # since the end of the last frame
        self.shape_bodies: dict[int, int] = {}
        """number of the body of each shape; `WORLD` for the static body of a space"""
        self.shapes: dict[int, GameShape] = {}
        """form of each shape, when the game adds it"""
        self.changes: list[GameChange] = []
        """bodies and joints that the game adds and removes, in order"""
        self.shape_changes: list[tuple[int, bool, int]] = []
        """frame, whether it is added, and number of each shape that the game adds or removes after the first step"""
        self.body_names: dict[int, str] = {}
        """names of bodies by number, as far as the program has variables for them"""
        self._numbers: WeakKeyDictionary[Any, int] = WeakKeyDictionary()  # of each body, shape and joint
        self._counts: Counter[str] = Counter()
        self._caused: Counter[tuple[str, int, tuple[int, int]]] = Counter()
        self._by_id: dict[int, int] = {}  # number of a body by its id, which the batch functions of pymunk know
        self._present: WeakSet[Any] = WeakSet()
        self.dts: list[float] = []
        """arguments of `Space.step`, s"""
        self.step_calls: Counter[tuple[str, int]] = Counter()
        """calls of `Space.step` by file and line"""
        self.settings: dict[str, float] = {}
        """settings of the space that makes the first step, by the names of `RehearsalSettings`"""
        self.gravity = 0.0, 0.0
        """gravity of that space, in units of the game per s²"""
        self.window: tuple[int, int] | None = None
        """size of the window at the first step, px; None without a window"""
        self.impulse_readers: set[int] = set()
        """numbers of the callbacks that read the impulse or the energy of a contact"""
        self.cause: tuple[int, tuple[int, int]] | None = None
        """callback that runs, and the numbers of its shapes"""
        self._buffer = Buffer()

    @property
    def is_stepped(self) -> bool:
        """Whether a space has made a step since the end of the last frame."""
        return bool(self._stepped)

    def has_stepped(self, space: pymunk.Space) -> bool:
        """Return whether a space has made a step since the end of the last frame."""
        return space in self._stepped

    def note_step(self, space: pymunk.Space, dt: float, caller: FrameType) -> None:
        """Note that a space makes a step."""
        if not self.steps:
            self._note_start(space, caller)
        self._stepped[space] = None
        self.steps += 1
        self.dts.append(dt)
        self.step_calls[caller.f_code.co_filename, caller.f_lineno] += 1

    def note_added(self, objects: tuple[Any, ...]) -> None:
        """Number objects that are added to a space, and note those that the game adds later."""
        for each in objects:
            self._number(each)
            if isinstance(each, pymunk.Shape):
                self._note_shape(each, is_added=True)
            if not isinstance(each, pymunk.Shape) and each not in self._present:
                self._present.add(each)
                self._note_change(each, is_added=True)

    def note_removed(self, objects: tuple[Any, ...]) -> None:
        """Note objects that are removed from a space."""
        for each in objects:
            if isinstance(each, pymunk.Shape):
                self._note_shape(each, is_added=False)
            if each in self._present:
                self._present.discard(each)
                self._note_change(each, is_added=False)

    def _note_start(self, space: pymunk.Space, caller: FrameType) -> None:
        """Note settings and window, and the names of bodies in the code that makes the first step."""
        self.settings = {name: getattr(space, attribute) for name, attribute in SPACE_ATTRIBUTES.items()}
        self.gravity = space.gravity.x, space.gravity.y
        self.window = _window_size()
        if space.constraints:
            self.settings["joint_bias"] = max(joint.error_bias for joint in space.constraints)
        for body, name in body_names(caller):
            self.body_names.setdefault(self._number(body), name)

    def _note_change(self, thing: pymunk.Body | pymunk.Constraint, *, is_added: bool) -> None:
        if self.steps:
            is_joint = isinstance(thing, pymunk.Constraint)
            self.changes.append(GameChange(self.frame, is_added, is_joint, self._number(thing)))

    def _note_shape(self, shape: pymunk.Shape, *, is_added: bool) -> None:
        if self.steps:
            self.shape_changes.append((self.frame, is_added, self._number(shape)))

    def _number(self, thing: pymunk.Body | pymunk.Shape | pymunk.Constraint) -> int:
        """Return the number of an object; a new one the first time."""
        known = self._numbers.get(thing)
        if known is not None:
            return known
        kind = _kind(thing)
        if self.cause is None:
            number = self._counts[kind]
            self._counts[kind] += 1
        else:
            number = self._number_by_cause(kind, *self.cause)
        self._numbers[thing] = number
        if isinstance(thing, pymunk.Body):
            self._by_id[thing.id] = number
        elif isinstance(thing, pymunk.Shape):
            body = thing.body
            is_world = body is None or (body.space is not None and body is body.space.static_body)
            self.shape_bodies[number] = WORLD if is_world or body is None else self._number(body)
            self.shapes[number] = GameShape.of(thing)
        return number

    def _number_by_cause(self, kind: str, callback: int, pair: tuple[int, int]) -> int:
        """Return the number of an object that a callback adds, which follows from the contact.

        Contacts may come in another order with other settings, and the objects that they add with them.
        """
        self._caused[kind, callback, pair] += 1
        key = f"{kind} {callback} {pair} {self._caused[kind, callback, pair]}"
        number = CAUSED + zlib.crc32(key.encode())
        if kind == "Body":
            function = list(self.callbacks)[callback].function
            self._counts[function] += 1
            self.body_names[number] = f"body {self._counts[function]} of {function}"
        return number

    def note_call(self, callback: int, arbiter: pymunk.Arbiter) -> None:
        """Note a call of a callback."""
        a, b = (self._number(shape) for shape in arbiter.shapes)
        self.cause = callback, (min(a, b), max(a, b))
        key = self.frame, *self.cause
        self.calls[key] = self.calls.get(key, 0) + 1

    def end_frame(self) -> None:
        """Keep the states at the end of the frame, of the spaces that have made a step in it."""
        rows, numbers = [], []
        for space in self._stepped:
            buffer = self._buffer
            buffer.clear()
            get_space_bodies(space, FIELDS, buffer)
            ids = np.frombuffer(buffer.int_buf(), np.uintp)
            if not len(ids):
                continue
            numbers.append(np.array([self._number_of_id(each, space) for each in ids.tolist()]))
            rows.append(np.frombuffer(buffer.float_buf(), np.float64).reshape(-1, WIDTH).copy())
        bodies = np.concatenate(numbers) if numbers else np.empty(0, np.int64)
        states = np.concatenate(rows) if rows else np.empty((0, WIDTH))
        order = np.argsort(bodies, kind="stable")
        order = order[bodies[order] != WORLD]
        found = LoggedFrame(bodies[order], states[order])
        if self._keeps_states:
            self.frames.append(found)
        content = found.bodies.tobytes() + found.states.tobytes()
        self.hashes.append(hashlib.blake2b(content, digest_size=HASH_BYTES).hexdigest())
        self.frame += 1
        self._stepped.clear()

    def _number_of_id(self, identity: int, space: pymunk.Space) -> int:
        if identity not in self._by_id:  # a body that no call of `Space.add` has added, as in a copy of a space
            for body in space.bodies:
                self._by_id[body.id] = self._number(body)
        return self._by_id.get(identity, WORLD)


def _window_size() -> tuple[int, int] | None:
    pygame = sys.modules.get("pygame")  # a program without a window may lack pygame
    surface = None if pygame is None else pygame.display.get_surface()
    return None if surface is None else surface.get_size()


def _kind(thing: object) -> str:
    return next(kind.__name__ for kind in (pymunk.Body, pymunk.Shape, pymunk.Constraint) if isinstance(thing, kind))


class LoggedCallback:
    """Collision callback of a game whose calls are logged. It can be copied and pickled if the callback can."""

    active: ClassVar[SpaceLog | None] = None
    """log of the running game"""

    def __init__(self, function: Callable[..., Any], number: int) -> None:
        self._function, self._number = function, number

    def __call__(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: Any) -> Any:
        """Log the call, and make it."""
        log = LoggedCallback.active
        if log is None:
            return self._function(arbiter, space, data)
        log.note_call(self._number, arbiter)
        try:
            return self._function(arbiter, space, data)
        finally:
            log.cause = None


@contextmanager
def spaces_logged(log: SpaceLog, before_step: Callable[[pymunk.Space], None]) -> Iterator[None]:
    """Log all pymunk spaces that are stepped within a `with` block.

    Args:
        log: to which frames and calls are added.
        before_step: called before each step of the game.
    """
    step, add, remove = pymunk.Space.step, pymunk.Space.add, pymunk.Space.remove
    on_collision = pymunk.Space.on_collision

    def stepped(space: pymunk.Space, dt: float) -> None:
        if dt:  # pymunk makes no step of length 0
            before_step(space)
            log.note_step(space, dt, sys._getframe(1))
        step(space, dt)

    def added(space: pymunk.Space, *objects: Any) -> None:
        add(space, *objects)
        log.note_added(objects)

    def removed(space: pymunk.Space, *objects: Any) -> None:
        remove(space, *objects)
        log.note_removed(objects)

    def registered(
        space: pymunk.Space,
        collision_type_a: int | None = None,
        collision_type_b: int | None = None,
        begin: Any = None,
        pre_solve: Any = None,
        post_solve: Any = None,
        separate: Any = None,
        data: Any = None,
    ) -> None:
        game = sys._getframe(1)
        types = _type_text(collision_type_a, game), _type_text(collision_type_b, game)
        given = dict(zip(PHASES, (begin, pre_solve, post_solve, separate), strict=True))
        for phase, function in given.items():
            if function is None or function is pymunk.empty_callback or isinstance(function, LoggedCallback):
                continue
            text = getattr(function, "__qualname__", type(function).__qualname__)
            name = GameCallback(text.replace("<locals>.", ""), *types, phase)
            given[phase] = LoggedCallback(function, log.callbacks.setdefault(name, len(log.callbacks)))
        on_collision(space, collision_type_a, collision_type_b, **given, data=data)

    def noting(own: property) -> property:
        assert own.fget is not None
        read = own.fget

        def value(arbiter: pymunk.Arbiter) -> Any:
            if log.cause is not None:
                log.impulse_readers.add(log.cause[0])
            return read(arbiter)

        return property(value)

    LoggedCallback.active = log
    try:
        with ExitStack() as stack:
            for name in ("total_impulse", "total_ke"):
                stack.enter_context(patch.object(pymunk.Arbiter, name, noting(getattr(pymunk.Arbiter, name))))
            stack.enter_context(patch.object(pymunk.Space, "step", stepped))
            stack.enter_context(patch.object(pymunk.Space, "add", added))
            stack.enter_context(patch.object(pymunk.Space, "remove", removed))
            stack.enter_context(patch.object(pymunk.Space, "on_collision", registered))
            yield
    finally:
        LoggedCallback.active = None


def _type_text(value: int | None, frame: FrameType) -> str:
    return "any" if value is None else type_name(value, frame) or str(value)
