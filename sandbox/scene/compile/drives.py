"""Mounts of driven bodies: start position and hinge of each body with a drive."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies, centre_of
from sandbox.scene.description.base import BodySpec, Point
from sandbox.scene.description.forces import AnyDrive, PlungerDrive, TorqueDrive
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.geometry.vectors import rotate


class Mount(NamedTuple):
    """Mount of a driven body."""

    number: int
    """index of the drive"""
    drive: AnyDrive
    home: Point
    """start position of the body's centre of mass, m"""
    hinge: Point
    """hinge in the body's frame, from its centre of mass, m; for a plunger that centre"""


def names_of(scene: SceneDescription) -> list[str]:
    """Return the name of each drive; by default from its kind and index."""
    return [drive.name or default_name("drive", k) for k, drive in enumerate(scene.drives)]


def mounts(scene: SceneDescription) -> dict[str, Mount]:
    """Return the mount of each driven body, by its name."""
    if not scene.drives:
        return {}
    found, singles = {}, single_bodies(scene)
    for k, drive in enumerate(scene.drives):
        if drive.body in singles:
            single = singles[drive.body]
            found[drive.body] = mount_of(k, drive, single)
    return found


def is_driven(scene: SceneDescription, bodies: Bodies, *, turning: bool = False) -> BoolArray:
    """Return which bodies have a drive or are kinematic, (N,); optionally only those that can rotate."""
    driven = [drive.body for drive in scene.drives if not (turning and isinstance(drive, PlungerDrive))]
    return bodies.kinematic | np.isin(bodies.names, driven) if driven else bodies.kinematic


def is_immovable(scene: SceneDescription, bodies: Bodies) -> BoolArray:
    """Return which bodies nothing can push, (N,): fixed and kinematic ones, and those of a stroke or plunger drive."""
    prescribed = [drive.body for drive in scene.drives if not isinstance(drive, TorqueDrive)]
    return bodies.immovable | np.isin(bodies.names, prescribed) if prescribed else bodies.immovable


def with_drive_moments(scene: SceneDescription, bodies: Bodies) -> Bodies:
    """Return bodies with the moments of inertia that their drives state: I about the hinge minus m d²."""
    moment = bodies.moment.copy()
    for name, mount in mounts(scene).items():
        if isinstance(mount.drive, TorqueDrive) and mount.drive.moment is not None:
            index = bodies.number_of[name]
            lowest = moment_of_mass(mount, float(bodies.mass[index]))
            moment[index] = max(mount.drive.moment - lowest, 0.0)
    return replace(bodies, moment=moment)


def single_bodies(scene: SceneDescription) -> dict[str, BodySpec]:
    """Return the single bodies, which have a table each, by name."""
    return {
        each.name or default_name(kind, k): each
        for kind, elements in scene.kinds.items()
        for k, each in enumerate(elements)
        if isinstance(each, BodySpec)
    }


def _hinge(drive: AnyDrive, single: BodySpec, home: Point) -> Point:
    if isinstance(drive, PlungerDrive):
        return 0.0, 0.0
    x, y = drive.pivot[0] - home[0], drive.pivot[1] - home[1]
    return rotate(x, y, math.cos(single.angle), -math.sin(single.angle))


def mount_of(number: int, drive: AnyDrive, single: BodySpec) -> Mount:
    """Return the mount of a body, given the index of its drive."""
    home = centre_of(single)
    return Mount(number, drive, home, _hinge(drive, single, home))


def moment_of_mass(mount: Mount, mass: float) -> float:
    """Return m d², kg·m²: the smallest moment of inertia about the hinge for a mass."""
    return mass * (mount.hinge[0] ** 2 + mount.hinge[1] ** 2)


def about_hinge(mount: Mount, mass: float, moment: float) -> float:
    """Return the moment of inertia about the hinge, kg·m², from mass and moment about the centre."""
    return moment + moment_of_mass(mount, mass)


def initial_drive_states(scene: SceneDescription) -> FloatArray:
    """Return the initial state of each drive, (D, 3): level, torque or pull, rate of the pull."""
    return np.zeros((len(scene.drives), 3))
