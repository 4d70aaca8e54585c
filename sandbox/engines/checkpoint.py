"""Checkpoint: all that can be known of a running scene from outside, as values; what a relay is taken up from."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sandbox.action import Force, Pull, Throttle
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.scene.standing import Passing
from sandbox.trajectory import Frame


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A moment of a running scene."""

    scene: Scene
    engine: str
    wanted: Settings
    bodies: Bodies
    frame: Frame
    origin: float
    """s, from which on steps count"""
    steps: float
    """since then"""
    retired: Mapping[int, float]
    broken: Mapping[int, float]
    forces: Mapping[str, Force]
    throttles: Mapping[str, Throttle]
    pulls: Mapping[str, Pull]


def cast(bodies: Bodies, frame: Frame) -> Bodies:
    """Return the bodies that are there, in the state of a frame."""
    there = np.flatnonzero(frame.present)
    some = bodies.some(there)
    return replace(
        some,
        position=frame.position[there],
        velocity=frame.velocity[there],
        angle=frame.angle[there],
        angular_velocity=frame.angular_velocity[there],
        roll=some.roll if frame.roll is None else frame.roll[there],
        layer=some.layer if frame.layer is None else frame.layer[there],
        visits=some.visits if frame.visits is None else frame.visits[there],
    )


def passing_in(frame: Frame) -> Passing:
    """Return who passes which one-way wall in a frame, by the numbers of those who are there."""
    if frame.passing is None:
        return ()
    there = np.flatnonzero(frame.present)
    numbers = np.searchsorted(there, frame.passing[:, 0])
    return tuple(zip(numbers.tolist(), frame.passing[:, 1].tolist(), strict=True))
