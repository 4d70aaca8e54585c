"""Names and behaviour of pymunk 6 on pymunk 7, for games that were written for it.

pymunk 7 replaced `Space.add_collision_handler` by `Space.on_collision`, and callbacks that return a bool by
`Arbiter.process_collision`. It also changed types and results that games of pymunk 6 use. `pymunk6_names` gives a
program the former ones; `removed_name` explains an error that one of them caused.

Sources: pymunk's changelog, and the code of pymunk 6.11.1 and 7.3.1 with their engines Chipmunk and Munk2D.
`tools/oracles/pymunk6.py` compares games with pymunk 6 itself.
"""

import sys
import types
import warnings
import weakref
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, TypeVar

import pymunk
from pymunk._chipmunk_cffi import lib

PHASES = ("begin", "pre_solve", "post_solve", "separate")
"""Phases of a collision, in the order of their callbacks"""

T = TypeVar("T")
HandlerKey = tuple[int, int] | int | None
"""Two collision types in ascending order; one of a wildcard handler; None of the default handler"""
Callback = Callable[[pymunk.Arbiter, pymunk.Space, Any], Any]


class CollisionHandler:
    """Four callbacks for collisions, as in pymunk 6: `func(arbiter, space, data)`.

    Args:
        owner: the handlers of the space.
        types: collision types in the order of `arbiter.shapes`; empty for the default handler.
    """

    def __init__(self, owner: "CollisionHandlers", types: tuple[int, ...]) -> None:
        self._owner, self.types = owner, types
        self._data: dict[Any, Any] = {}
        self.callbacks: dict[str, Callback] = {}
        """callbacks that are set, by their phases"""

    @property
    def data(self) -> dict[Any, Any]:
        """Dictionary that the callbacks get."""
        return self._data

    def _get(self, phase: str) -> Callback | None:
        return self.callbacks.get(phase)

    def _set(self, phase: str, callback: Callback) -> None:
        self.callbacks[phase] = callback
        self._owner.register(self, phase)

    begin = property(
        lambda self: self._get("begin"),
        lambda self, callback: self._set("begin", callback),
        doc="Called in the first step of a contact; False ignores it until the shapes separate.",
    )
    pre_solve = property(
        lambda self: self._get("pre_solve"),
        lambda self, callback: self._set("pre_solve", callback),
        doc="Called in each step of a contact, before the solver; False ignores it in this step.",
    )
    post_solve = property(
        lambda self: self._get("post_solve"),
        lambda self, callback: self._set("post_solve", callback),
        doc="Called in each step of a contact, after the solver.",
    )
    separate = property(
        lambda self: self._get("separate"),
        lambda self, callback: self._set("separate", callback),
        doc="Called when the shapes of a contact separate, or one of them is removed.",
    )


class CollisionHandlers:
    """Collision handlers of one space, with the rules of pymunk 6.

    - A pair of shapes has one handler: that of its two collision types in either order, or the default handler.
    - A phase that this handler does not set calls the wildcard handlers of both shapes; a phase that it sets does not.
    - After a `begin` that returns False neither `pre_solve` nor `post_solve` is called until the shapes separate.
    - A value that is no bool counts as True, with a warning; a callback that raises an exception counts as False.

    pymunk 7 calls all handlers that match. So the phases that a handler of two types sets are registered for these
    types, and those that a wildcard handler or the default handler sets once for all collisions: one of the two acts.
    A copy of a space finds its handlers by their registered methods, which are copied with it.
    """

    def __init__(self) -> None:
        self._handlers: dict[HandlerKey, CollisionHandler] = {}
        self._space: weakref.ref[pymunk.Space] | None = None

    @classmethod
    def of(cls, space: Any) -> "CollisionHandlers":
        """Return the handlers of a space, also if it is a copy."""
        found: CollisionHandlers | None = vars(space).get("_pymunk6_handlers")
        if found is None:
            registered = (getattr(each, phase) for each in space._handlers.values() for phase in PHASES)
            owners = (getattr(callback, "__self__", None) for callback in registered)
            found = next((owner for owner in owners if isinstance(owner, cls)), None) or cls()
            found._space = weakref.ref(space)
            space._pymunk6_handlers = found
        return found

    def __getstate__(self) -> dict[str, Any]:
        return {"_handlers": self._handlers, "_space": None}  # a copy of the space sets its own

    def handler(self, key: HandlerKey, *types: int) -> CollisionHandler:
        """Return the handler of a key; a new one gets the collision types."""
        if key not in self._handlers:
            self._handlers[key] = CollisionHandler(self, types)
        return self._handlers[key]

    def register(self, handler: CollisionHandler, phase: str) -> None:
        """Have pymunk call the handlers in a phase that one of them sets."""
        space = None if self._space is None else self._space()
        if space is None:
            return
        is_for_all = len(handler.types) < 2
        callback: dict[str, Any] = {phase: getattr(self, f"_{phase}"), "data": is_for_all}
        space.on_collision(*((None, None) if is_for_all else handler.types), **callback)

    def _begin(self, arbiter: Any, space: pymunk.Space, is_for_all: bool) -> None:
        accepted: bool | None = False  # if a callback raises an exception
        try:
            accepted = self._call("begin", arbiter, space, is_for_all)
        finally:
            if accepted is False:
                arbiter._arbiter.state = lib.CP_ARBITER_STATE_IGNORE

    def _pre_solve(self, arbiter: Any, space: pymunk.Space, is_for_all: bool) -> None:
        if arbiter._arbiter.state == lib.CP_ARBITER_STATE_IGNORE:
            return
        accepted: bool | None = False
        try:
            accepted = self._call("pre_solve", arbiter, space, is_for_all)
        finally:
            if accepted is not None:
                arbiter.process_collision = accepted

    def _post_solve(self, arbiter: Any, space: pymunk.Space, is_for_all: bool) -> None:
        self._call("post_solve", arbiter, space, is_for_all)

    def _separate(self, arbiter: Any, space: pymunk.Space, is_for_all: bool) -> None:
        self._call("separate", arbiter, space, is_for_all)

    def _call(self, phase: str, arbiter: Any, space: pymunk.Space, is_for_all: bool) -> bool | None:
        """Call the callbacks of a phase, and return whether all accept the collision.

        Returns:
            None if the other registration acts: that for the two types if their handler sets the phase, else that for
            all collisions.
        """
        contact = arbiter._arbiter
        was_swapped, contact.swapped = contact.swapped, False
        try:
            a, b = (shape.collision_type for shape in arbiter.shapes)
            pair = self._handlers.get((min(a, b), max(a, b)))
            if (pair is not None and phase in pair.callbacks) == is_for_all:
                return None
            if pair is not None and pair.types[0] != a:
                contact.swapped = True  # `arbiter.shapes` has the order of the handler
                a, b = b, a
            handler = self._handlers.get(None) if pair is None else pair
            if handler is not None and phase in handler.callbacks:
                return _is_accepted(handler, phase, arbiter, space)
            try:
                accepted = self._call_wildcard(a, phase, arbiter, space)
            finally:  # the second is called even if the first rejects the collision or raises an exception
                contact.swapped = not contact.swapped  # its shape comes first
                also_accepted = self._call_wildcard(b, phase, arbiter, space)
            return accepted and also_accepted
        finally:
            contact.swapped = was_swapped

    def _call_wildcard(self, collision_type: int, phase: str, arbiter: pymunk.Arbiter, space: pymunk.Space) -> bool:
        handler = self._handlers.get(collision_type)
        return handler is None or phase not in handler.callbacks or _is_accepted(handler, phase, arbiter, space)


def _is_accepted(handler: CollisionHandler, phase: str, arbiter: pymunk.Arbiter, space: pymunk.Space) -> bool:
    """Call a callback and return its answer; True and a warning if it is no bool."""
    callback = handler.callbacks[phase]
    answer = callback(arbiter, space, handler.data)
    if isinstance(answer, bool):
        return answer
    if phase in ("begin", "pre_solve"):
        code: types.CodeType = callback.__code__  # as in pymunk 6, also if it has none
        warnings.warn_explicit(
            f"Function '{code.co_name}' should return a bool to indicate if the collision should be processed or not "
            "when used as 'begin' or 'pre_solve' collision callback.",
            UserWarning,
            code.co_filename,
            code.co_firstlineno,
            callback.__module__,
        )
    return True


class OrderedSet(set[T]):
    """Set whose items come in the order in which they were given, so that a game that adds them is repeatable."""

    def __init__(self, items: Iterable[T]) -> None:
        self._items = tuple(items)
        super().__init__(self._items)

    def __iter__(self) -> Iterator[T]:
        return (each for each in self._items if each in self)


def _add_collision_handler(space: pymunk.Space, collision_type_a: int, collision_type_b: int) -> CollisionHandler:
    key = min(collision_type_a, collision_type_b), max(collision_type_a, collision_type_b)
    return CollisionHandlers.of(space).handler(key, collision_type_a, collision_type_b)


def _add_wildcard_collision_handler(space: pymunk.Space, collision_type_a: int) -> CollisionHandler:
    return CollisionHandlers.of(space).handler(collision_type_a, collision_type_a)


def _add_default_collision_handler(space: pymunk.Space) -> CollisionHandler:
    return CollisionHandlers.of(space).handler(None)


def _listed(owner: type, name: str, collect: Callable[[Any], Any]) -> property:
    """Return a property whose view is collected anew each time."""
    own: property = vars(owner)[name]
    return property(lambda self: collect(own.__get__(self)), doc=own.__doc__)


def _replacements() -> Iterator[tuple[Any, str, Any]]:
    """Yield owners, names and values of what pymunk 7 removed or changed."""
    yield pymunk.Space, "add_collision_handler", _add_collision_handler
    yield pymunk.Space, "add_wildcard_collision_handler", _add_wildcard_collision_handler
    yield pymunk.Space, "add_default_collision_handler", _add_default_collision_handler
    module: Any = types.ModuleType("pymunk.collision_handler")
    module.CollisionHandler = CollisionHandler
    yield pymunk, "CollisionHandler", CollisionHandler
    yield pymunk, "collision_handler", module
    for name in ("shapes", "bodies", "constraints"):
        yield pymunk.Space, name, _listed(pymunk.Space, name, list)
    for name in ("shapes", "constraints"):
        yield pymunk.Body, name, _listed(pymunk.Body, name, OrderedSet)
    yield pymunk.Vec2d, "__bool__", lambda _: True  # a tuple of two
    nearest, first = pymunk.Space.point_query_nearest, pymunk.Space.segment_query_first

    def nearest_solid(
        space: pymunk.Space, point: Any, max_distance: float, shape_filter: pymunk.ShapeFilter
    ) -> pymunk.PointQueryInfo | None:
        found = nearest(space, point, max_distance, shape_filter)
        if found is None or not found.shape.sensor:
            return found
        solid = (each for each in space.point_query(point, max_distance, shape_filter) if not each.shape.sensor)
        return min(solid, key=lambda each: each.distance, default=None)

    def first_solid(
        space: pymunk.Space, start: Any, end: Any, radius: float, shape_filter: pymunk.ShapeFilter
    ) -> pymunk.SegmentQueryInfo | None:
        found = first(space, start, end, radius, shape_filter)
        if found is None or not found.shape.sensor:
            return found
        solid = (each for each in space.segment_query(start, end, radius, shape_filter) if not each.shape.sensor)
        return min(solid, key=lambda each: each.alpha, default=None)

    yield pymunk.Space, "point_query_nearest", nearest_solid
    yield pymunk.Space, "segment_query_first", first_solid
    segment_query, attach, body = pymunk.Shape.segment_query, pymunk.Shape._init, vars(pymunk.Shape)["body"]

    def segment_query_of_shape(shape: pymunk.Shape, start: Any, end: Any, radius: float = 0) -> pymunk.SegmentQueryInfo:
        missed: Any = pymunk.SegmentQueryInfo(None, pymunk.Vec2d(*end), pymunk.Vec2d(0.0, 0.0), 1.0)  # type: ignore[arg-type]
        return segment_query(shape, start, end, radius) or missed

    def attached(shape: Any, its_body: pymunk.Body | None, cp_shape: Any) -> None:
        attach(shape, its_body, cp_shape)
        shape._pymunk6_body = its_body  # pymunk 7 keeps a weak reference only

    def set_body(shape: Any, its_body: pymunk.Body | None) -> None:
        body.__set__(shape, its_body)
        shape._pymunk6_body = its_body

    yield pymunk.Shape, "segment_query", segment_query_of_shape
    yield pymunk.Shape, "_init", attached
    yield pymunk.Shape, "body", body.setter(set_body)


@contextmanager
def pymunk6_names() -> Iterator[None]:
    """Give pymunk the names and the behaviour of pymunk 6 within a `with` block.

    - `Space.add_collision_handler`, `add_wildcard_collision_handler`, `add_default_collision_handler`, and the type
      `pymunk.CollisionHandler`; spaces keep their handlers after the block.
    - `Space.shapes`, `bodies` and `constraints` are lists, `Body.shapes` and `constraints` are sets; each is a copy.
    - `Space.point_query_nearest` and `segment_query_first` find no sensor shapes.
    - `Shape.segment_query` that hits nothing returns a value without a shape, and every `Vec2d` is true.
    - A shape keeps its body alive.

    It changes pymunk's classes for the whole process.

    Example:
        >>> import pymunk
        >>> from sandbox.pymunk_capture.pymunk6 import pymunk6_names
        >>> with pymunk6_names():
        ...     space = pymunk.Space()
        ...     space.add_collision_handler(1, 2).begin = lambda arbiter, space, data: False
    """
    with ExitStack() as stack:
        for owner, name, value in list(_replacements()):
            stack.enter_context(_defined(owner, name, value))
        stack.enter_context(_module("pymunk.collision_handler", vars(pymunk)["collision_handler"]))
        yield


@contextmanager
def _defined(owner: Any, name: str, value: Any) -> Iterator[None]:
    """Give a class or module an attribute within a `with` block."""
    missing = object()
    before = vars(owner).get(name, missing)
    setattr(owner, name, value)
    try:
        yield
    finally:
        if before is missing:
            delattr(owner, name)
        else:
            setattr(owner, name, before)


@contextmanager
def _module(name: str, module: types.ModuleType) -> Iterator[None]:
    """Make a module importable within a `with` block."""
    before = sys.modules.get(name)
    sys.modules[name] = module
    try:
        yield
    finally:
        if before is None:
            del sys.modules[name]
        else:
            sys.modules[name] = before
