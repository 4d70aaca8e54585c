"""How drives hold their bodies, and the checks of drives."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies, centre_of
from sandbox.scene.description.base import BodySpec, Point
from sandbox.scene.description.forces import Drive, Driven, PlungerDrive, TorqueDrive
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.errors import Location

ROUNDED = 1e-9
"""rad, tolerance of the start angle beyond its stops, for rounding in a file."""


class Mount(NamedTuple):
    """How a drive holds a body."""

    number: int
    """index of the drive"""
    drive: Drive
    home: Point
    """start position of the body's centre of mass, m"""
    hinge: Point
    """hinge in the body's frame, from its centre of mass, m; for a plunger that centre"""


def names_of(scene: SceneDescription) -> list[str]:
    """Return the name of each drive; by default from its kind and index."""
    return [drive.name or default_name("drive", k) for k, drive in enumerate(scene.drives)]


def mounts(scene: SceneDescription) -> dict[str, Mount]:
    """Return how each driven body is held, by its name."""
    if not scene.drives:
        return {}
    found, singles = {}, _singles(scene)
    for k, drive in enumerate(scene.drives):
        if drive.body in singles:
            single = singles[drive.body]
            found[drive.body] = _mount(k, drive, single)
    return found


def driven_in(scene: SceneDescription, bodies: Bodies, *, turning: bool = False) -> BoolArray:
    """Return which bodies are driven, (N,); optionally only those that rotate."""
    those = [drive.body for drive in scene.drives if not (turning and isinstance(drive, PlungerDrive))]
    return np.isin(bodies.names, those) if those else np.zeros(len(bodies), dtype=np.bool_)


def unmoved(scene: SceneDescription, bodies: Bodies) -> BoolArray:
    """Return which bodies no joint can move, (N,): fixed ones, and those led by a stroke or a plunger."""
    led = [drive.body for drive in scene.drives if not isinstance(drive, TorqueDrive)]
    return bodies.fixed | np.isin(bodies.names, led) if led else bodies.fixed


def weighed(scene: SceneDescription, bodies: Bodies) -> Bodies:
    """Return bodies with the moments of inertia that their drives state: I about the hinge minus m d²."""
    moment = bodies.moment.copy()
    for name, mount in mounts(scene).items():
        if isinstance(mount.drive, TorqueDrive) and mount.drive.moment is not None:
            number = bodies.number_of[name]
            least = _least(mount, float(bodies.mass[number]))
            moment[number] = max(mount.drive.moment - least, 0.0)
    return replace(bodies, moment=moment)


def driven(scene: SceneDescription, bodies: Bodies) -> Iterator[tuple[Location, str]]:
    """Yield the faults of drives."""
    singles, seen = _singles(scene), set[str]()
    for k, drive in enumerate(scene.drives):
        if drive.body not in bodies.number_of:
            known = ", ".join(map(repr, [*singles][:5])) or "none"
            yield ("drive", k, "body"), f"no body is named {drive.body!r}; bodies with a table of their own: {known}"
        elif drive.body not in singles:
            yield (
                ("drive", k, "body"),
                f"{drive.body!r} is made by a generator; a drive needs a body with a table of its own",
            )
        else:
            single = singles[drive.body]
            faults = *_of_body(drive, single, scene, drive.body in seen), *_of_figures(drive, single, bodies)
            yield from ((("drive", k, key), why) for key, why in faults)
            seen.add(drive.body)


def _of_body(drive: Driven, single: BodySpec, scene: SceneDescription, twice: bool) -> Iterator[tuple[str, str]]:
    if twice:
        yield "body", f"{drive.body!r} already has a drive; a body can have one drive only"
    if single.fixed:
        yield "body", f"{drive.body!r} is fixed; remove `fixed`, because the drive holds the body"
    if any(single.velocity) or single.angular_velocity:
        yield "body", f"{drive.body!r} has an initial velocity; a driven body must start at rest"
    if any(thrust.body == drive.body for thrust in scene.thrusts):
        yield "body", f"{drive.body!r} has a thrust; only its drive can move a driven body"


def _of_figures(drive: Drive, single: BodySpec, bodies: Bodies) -> Iterator[tuple[str, str]]:
    if isinstance(drive, PlungerDrive):
        if not math.hypot(*drive.direction) > 0.0:
            yield "direction", f"{list(drive.direction)} has no direction; use a vector such as [0, 1] for upwards"
        return
    low, high = sorted(drive.stops)
    if low == high:
        yield "stops", "must be two different angles: the rest angle and the driven angle"
    elif not low - ROUNDED <= single.angle <= high + ROUNDED:
        yield (
            "stops",
            f"{drive.body!r} starts at {single.angle:g} rad; the angle must be between {low:g} and {high:g} rad",
        )
    if isinstance(drive, TorqueDrive) and drive.moment is not None:
        least = _least(_mount(0, drive, single), float(bodies.mass[bodies.number_of[drive.body]]))
        if drive.moment <= least:
            yield "moment", f"must be greater than {least:.3g} kg·m², the moment of the body's mass about this pivot"


def _singles(scene: SceneDescription) -> dict[str, BodySpec]:
    return {
        each.name or default_name(kind, k): each
        for kind, those in scene.kinds.items()
        for k, each in enumerate(those)
        if isinstance(each, BodySpec)
    }


def _hinge(drive: Drive, single: BodySpec, home: Point) -> Point:
    if isinstance(drive, PlungerDrive):
        return 0.0, 0.0
    x, y = drive.pivot[0] - home[0], drive.pivot[1] - home[1]
    cos, sin = math.cos(single.angle), math.sin(single.angle)
    return cos * x + sin * y, cos * y - sin * x


def _mount(number: int, drive: Drive, single: BodySpec) -> Mount:
    home = centre_of(single)
    return Mount(number, drive, home, _hinge(drive, single, home))


def _least(mount: Mount, mass: float) -> float:
    """Return m d², kg·m²: the smallest moment of inertia about the hinge for a mass."""
    return mass * (mount.hinge[0] ** 2 + mount.hinge[1] ** 2)


def about_hinge(mount: Mount, mass: float, moment: float) -> float:
    """Return the moment of inertia about the hinge, kg·m², from mass and moment about the centre."""
    return moment + _least(mount, mass)


def at_rest(scene: SceneDescription) -> FloatArray:
    """Return the initial state of each drive, (D, 3): level, torque or pull, rate of the pull."""
    return np.zeros((len(scene.drives), 3))
