"""Values derived from the start state of a scene, computed once and kept as long as the scene or setup exists."""

import weakref
from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup

Derived = TypeVar("Derived")


def derived_once(derive: Callable[[Setup], Derived]) -> Callable[[Scene | Setup], Derived]:
    """Return a function of a scene or setup that derives its value at the first call and returns it at later ones.

    Scenes and setups are immutable, so the value does not change; it must be immutable too, and must not refer to the
    setup. A scene and the setups of its start share their value. Values are found by identity: hashing or comparing a
    scene would cost more than most derivations.
    """
    known: dict[int, tuple[weakref.ref[Scene | Setup], Derived]] = {}

    @wraps(derive)
    def derived(start: Scene | Setup) -> Derived:
        source = start.scene if isinstance(start, Setup) and start.is_start else start
        key = id(source)
        found = known.get(key)
        if found is not None and found[0]() is source:
            return found[1]
        value = derive(Setup.of(start))
        known[key] = weakref.ref(source, lambda _: known.pop(key, None)), value
        return value

    return derived
