"""Checks of what refers to bodies: joints, thrusts and attractions."""

import math
from collections.abc import Iterator

from sandbox.scene.bodies import Bodies
from sandbox.scene.faults import Location
from sandbox.scene.joints import Groove, Joint, Pivot, Rod, RotaryLimit, Slide
from sandbox.scene.model import Scene

Found = tuple[Location, str]


def attachments(scene: Scene, bodies: Bodies) -> list[Found]:
    """Return the faults of a scene's joints, thrusts and attractions."""
    return [*_joints(scene, bodies), *_thrusts(scene, bodies), *_attractions(scene, bodies)]


def _joints(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    number = {name: k for k, name in enumerate(bodies.names)}
    seen: set[str] = set()
    for k, joint in enumerate(scene.joints):
        for side, name in enumerate(joint.between):
            if name not in number:
                yield ("joint", k, "between", side), f"no body is named {name!r}; {_known(bodies)}"
        if len(set(joint.between)) < len(joint.between):
            yield ("joint", k, "between"), "these are one and the same body; name two, or one to join it to the world"
        elif all(name in number and bodies.fixed[number[name]] for name in joint.between):
            yield ("joint", k, "between"), "nothing here can move: the body, or both of them, are fixed"
        for where, message in _figures(joint):
            yield ("joint", k, where), message
        if joint.name is not None and joint.name in seen:
            yield ("joint", k, "name"), f"a second joint named {joint.name!r}; names are unique"
        seen.add(joint.name or "")


def _figures(joint: Joint) -> Iterator[tuple[str, str]]:
    """Yield the keys of a joint that are wrong by themselves, and why."""
    match joint:
        case Pivot():
            if (joint.at is None) == (joint.anchors is None):
                yield "at", "state either `at`, a place in the world, or `anchors`, one in each body's own frame"
        case Rod():
            if joint.length == 0.0:
                yield "length", "a rod of no length; a pivot holds two points together"
        case Slide() | RotaryLimit():
            if joint.least > joint.most:
                yield "most", "is smaller than `least`"
        case Groove():
            if math.dist(*joint.groove) < 1e-9:
                yield "groove", "has no length; its two ends are at least 1e-09 m apart"
        case _:
            pass


def _thrusts(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    for k, thrust in enumerate(scene.thrusts):
        if thrust.body not in bodies.names:
            yield ("thrust", k, "body"), f"no body is named {thrust.body!r}; {_known(bodies)}"
        elif bodies.fixed[bodies.names.index(thrust.body)]:
            yield ("thrust", k, "body"), f"{thrust.body!r} is fixed; nothing can move it"
        if thrust.end is not None and thrust.end <= thrust.begin:
            yield ("thrust", k, "end"), "is not later than `begin`"


def _attractions(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    for k, attraction in enumerate(scene.attractions):
        toward = attraction.toward
        if isinstance(toward, str) and toward not in bodies.names:
            yield ("attraction", k, "toward"), f"no body is named {toward!r}; {_known(bodies)}"


def _known(bodies: Bodies) -> str:
    names = bodies.names
    return f"there are {', '.join(map(repr, names[:5]))}{' …' if len(names) > 5 else ''}" if names else "there is none"
