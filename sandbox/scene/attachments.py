"""Checks of what refers to bodies: joints, thrusts, attractions and drives."""

import math
from collections.abc import Iterator, Sequence

from sandbox.scene.bodies import Bodies
from sandbox.scene.driven import driven
from sandbox.scene.drives import Driven
from sandbox.scene.faults import Location
from sandbox.scene.forces import Attraction, Thrust
from sandbox.scene.joints import Gear, Groove, Joint, Pivot, Rod, RotaryLimit, Slide
from sandbox.scene.linking import ends_of
from sandbox.scene.model import Scene, default_name

Found = tuple[Location, str]

SHORTEST = 1e-9
"""m, of rods and grooves"""

LEAST_RATIO = 1e-6
"""of gears; engines divide by it"""


def attachments(scene: Scene, bodies: Bodies) -> list[Found]:
    """Return the faults of a scene's joints, thrusts, attractions and drives."""
    return [*_joints(scene, bodies), *_thrusts(scene, bodies), *_attractions(scene, bodies), *_drives(scene, bodies)]


def _joints(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    number = {name: k for k, name in enumerate(bodies.names)}
    yield from _names("joint", scene.joints)
    for k, joint in enumerate(scene.joints):
        for side, name in enumerate(joint.between):
            if name not in number:
                yield ("joint", k, "between", side), f"no body is named {name!r}; {_known(bodies)}"
        if len(set(joint.between)) < len(joint.between):
            yield ("joint", k, "between"), "these are one and the same body; name two, or one to join it to the world"
        elif all(name in number and bodies.fixed[number[name]] for name in joint.between):
            yield ("joint", k, "between"), "nothing here can move: the body, or both of them, are fixed"
        else:
            yield from _coincident(k, joint, bodies, number)
        for where, message in _figures(joint):
            yield ("joint", k, where), message


def _names(kind: str, those: Sequence[Joint | Thrust | Attraction | Driven]) -> Iterator[Found]:
    """Yield those whose name another one of the kind has, stated or by its place in the file."""
    seen: set[str] = set()
    for k, each in enumerate(those):
        name = each.name or default_name(kind, k)
        if name in seen:
            yield (kind, k, "name"), f"a second {kind} named {name!r}; names are unique"
        seen.add(name)


def _coincident(k: int, joint: Joint, bodies: Bodies, number: dict[str, int]) -> Iterator[Found]:
    """Yield a rod that starts between points in one place, where it has no direction."""
    if not isinstance(joint, Rod) or any(name not in number for name in joint.between) or joint.length == 0.0:
        return
    start, end = ends_of(joint, bodies, number)
    if math.dist(start, end) < SHORTEST:
        message = (
            f"the two points that it holds start at ({start[0]:g}, {start[1]:g}) m both, where a rod has no direction; "
            "put them apart by `anchors`, or use a pivot"
        )
        yield ("joint", k, "anchors" if "anchors" in joint.model_fields_set else "between"), message


def _figures(joint: Joint) -> Iterator[tuple[str, str]]:
    """Yield the keys of a joint that are wrong by themselves, and why."""
    match joint:
        case Pivot():
            if (joint.at is None) == (joint.anchors is None):
                yield "at", "state either `at`, a place in the world, or `anchors`, one in each body's own frame"
        case Rod():
            if joint.length is not None and joint.length < SHORTEST:
                yield "length", f"a rod of no length; at least {SHORTEST:g} m. A pivot holds two points together"
        case Gear():
            if abs(joint.ratio) < LEAST_RATIO:
                yield "ratio", f"is next to nothing; from {LEAST_RATIO:g} or -{LEAST_RATIO:g} on, gears turn each other"
        case Slide() | RotaryLimit():
            if joint.least > joint.most:
                yield "most", "is smaller than `least`"
        case Groove():
            if math.dist(*joint.groove) < SHORTEST:
                yield "groove", f"has no length; its two ends are at least {SHORTEST:g} m apart"
        case _:
            pass


def _thrusts(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    yield from _names("thrust", scene.thrusts)
    for k, thrust in enumerate(scene.thrusts):
        if thrust.body not in bodies.names:
            yield ("thrust", k, "body"), f"no body is named {thrust.body!r}; {_known(bodies)}"
        elif bodies.fixed[bodies.names.index(thrust.body)]:
            yield ("thrust", k, "body"), f"{thrust.body!r} is fixed; nothing can move it"
        if thrust.end is not None and thrust.end <= thrust.begin:
            yield ("thrust", k, "end"), "is not later than `begin`"


def _attractions(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    yield from _names("attraction", scene.attractions)
    for k, attraction in enumerate(scene.attractions):
        toward = attraction.toward
        if isinstance(toward, str) and toward not in bodies.names:
            yield ("attraction", k, "toward"), f"no body is named {toward!r}; {_known(bodies)}"


def _drives(scene: Scene, bodies: Bodies) -> Iterator[Found]:
    yield from _names("drive", scene.drives)
    yield from driven(scene, bodies)


def _known(bodies: Bodies) -> str:
    names = bodies.names
    return f"there are {', '.join(map(repr, names[:5]))}{' …' if len(names) > 5 else ''}" if names else "there is none"
