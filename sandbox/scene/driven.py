"""Driven: how drives hold their bodies, and what must be so for that."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sandbox.scene.bodies import Bodies, centre_of
from sandbox.scene.drives import Drive, Driven, PlungerDrive, TorqueDrive
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene, Single, default_name
from sandbox.scene.near import BoolArray, FloatArray
from sandbox.scene.part import Point

ROUNDED = 1e-9
"""rad by which a body may start beyond its stops, as a file rounds them"""


class Mount(NamedTuple):
    """How a drive holds a body, whatever has become of the two since."""

    number: int
    """of the drive"""
    drive: Drive
    home: Point
    """where the body's centre of mass starts, m"""
    hinge: Point
    """in the body's own frame, from its centre of mass, m; of a plunger that centre"""


def names_of(scene: Scene) -> list[str]:
    """Return a name for each drive; one without is called by its place in the file."""
    return [drive.name or default_name("drive", k) for k, drive in enumerate(scene.drives)]


def mounts(scene: Scene) -> dict[str, Mount]:
    """Return how each driven body is held, by its name."""
    if not scene.drives:
        return {}
    found, singles = {}, _singles(scene)
    for k, drive in enumerate(scene.drives):
        if drive.body in singles:
            single = singles[drive.body]
            found[drive.body] = _mount(k, drive, single)
    return found


def driven_in(scene: Scene, bodies: Bodies, *, turning: bool = False) -> BoolArray:
    """Return which bodies are driven, (N,); if asked for, only those that turn."""
    those = [drive.body for drive in scene.drives if not (turning and isinstance(drive, PlungerDrive))]
    return np.isin(bodies.names, those) if those else np.zeros(len(bodies), dtype=np.bool_)


def weighed(scene: Scene, bodies: Bodies) -> Bodies:
    """Return bodies with the moments of inertia that drives state for them: I about the hinge less m d²."""
    moment = bodies.moment.copy()
    for name, mount in mounts(scene).items():
        if isinstance(mount.drive, TorqueDrive) and mount.drive.moment is not None:
            number = bodies.names.index(name)
            least = _least(mount, float(bodies.mass[number]))
            moment[number] = max(mount.drive.moment - least, 0.0)
    return replace(bodies, moment=moment)


def driven(scene: Scene, bodies: Bodies) -> Iterator[tuple[Location, str]]:
    """Yield the faults of a scene's drives."""
    singles, seen = _singles(scene), set[str]()
    for k, drive in enumerate(scene.drives):
        if drive.body not in bodies.names:
            known = ", ".join(map(repr, [*singles][:5])) or "none"
            yield ("drive", k, "body"), f"no body is named {drive.body!r}; there are {known}"
        elif drive.body not in singles:
            yield ("drive", k, "body"), f"{drive.body!r} is one of many; a drive holds a body with a table of its own"
        else:
            single = singles[drive.body]
            faults = *_of_body(drive, single, scene, drive.body in seen), *_of_figures(drive, single, bodies)
            yield from ((("drive", k, key), why) for key, why in faults)
            seen.add(drive.body)


def _of_body(drive: Driven, single: Single, scene: Scene, twice: bool) -> Iterator[tuple[str, str]]:
    if twice:
        yield "body", f"{drive.body!r} has a drive already; a body has one"
    if single.fixed:
        yield "body", f"{drive.body!r} is fixed; leave that out, its drive holds it"
    if any(single.velocity) or single.angular_velocity:
        yield "body", f"{drive.body!r} starts with a velocity; a driven body starts at rest"
    if any(thrust.body == drive.body for thrust in scene.thrusts):
        yield "body", f"{drive.body!r} carries a thrust; a driven body is moved by its drive alone"


def _of_figures(drive: Drive, single: Single, bodies: Bodies) -> Iterator[tuple[str, str]]:
    if isinstance(drive, PlungerDrive):
        if not math.hypot(*drive.direction) > 0.0:
            yield "direction", f"{list(drive.direction)} has no direction; such as [0, 1] for upwards"
        return
    low, high = sorted(drive.stops)
    if low == high:
        yield "stops", "are one and the same angle; give two, where it rests and where it is driven to"
    elif not low - ROUNDED <= single.angle <= high + ROUNDED:
        yield "stops", f"{drive.body!r} starts at an angle of {single.angle:g}, not between {low:g} and {high:g} rad"
    if isinstance(drive, TorqueDrive) and drive.moment is not None:
        least = _least(_mount(0, drive, single), float(bodies.mass[bodies.names.index(drive.body)]))
        if drive.moment <= least:
            yield "moment", f"its mass alone makes {least:.3g} kg·m² about that pivot; state more, or less mass"


def _singles(scene: Scene) -> dict[str, Single]:
    return {
        each.name or default_name(kind, k): each
        for kind, those in scene.kinds.items()
        for k, each in enumerate(those)
        if isinstance(each, Single)
    }


def _hinge(drive: Drive, single: Single, home: Point) -> Point:
    if isinstance(drive, PlungerDrive):
        return 0.0, 0.0
    x, y = drive.pivot[0] - home[0], drive.pivot[1] - home[1]
    cos, sin = math.cos(single.angle), math.sin(single.angle)
    return cos * x + sin * y, cos * y - sin * x


def _mount(number: int, drive: Drive, single: Single) -> Mount:
    home = centre_of(single)
    return Mount(number, drive, home, _hinge(drive, single, home))


def _least(mount: Mount, mass: float) -> float:
    """Return m d², kg·m²: the least moment of inertia about the hinge that such a mass can have."""
    return mass * (mount.hinge[0] ** 2 + mount.hinge[1] ** 2)


def about_hinge(mount: Mount, mass: float, moment: float) -> float:
    """Return the moment of inertia about the hinge, kg·m², of a body of some mass and moment about its centre."""
    return moment + _least(mount, mass)


def at_rest(scene: Scene) -> FloatArray:
    """Return the state of each drive as a scene starts, (D, 3): level, torque or pull, pace."""
    return np.zeros((len(scene.drives), 3))
