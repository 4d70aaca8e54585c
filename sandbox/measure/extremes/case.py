"""Case: a family of scenes with parameters, by which rules each is judged, and what is known of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

Parameters = Mapping[str, float]
Document = dict[str, Any]
"""A scene as TOML would hold it."""


def lifted(scene: Scene) -> float:
    """Return what is at stake in a scene, J: its kinetic energy, and what gravity can set free or lift.

    A body can fall to the lowest level floor, or else to the lowest body, and by its own width at least.
    """
    bodies, moves = scene.bodies, ~scene.bodies.fixed
    gravity = np.asarray(scene.world.gravity)
    pull = float(np.hypot(*gravity))
    kinetic = 0.5 * float((bodies.mass * (bodies.velocity**2).sum(axis=1))[moves].sum())
    if pull == 0.0 or not moves.any():
        return kinetic
    depth = bodies.position @ (gravity / pull)
    lowest = max(
        [float(np.asarray(plane.point) @ gravity / pull) for plane in scene.planes], default=float(depth.max())
    )
    drop = np.maximum(lowest - depth, 2.0 * bodies.thin)
    return kinetic + float((bodies.mass * pull * drop)[moves].sum())


@dataclass(frozen=True)
class Case:
    """A family of scenes."""

    name: str
    about: str
    """one line: what happens in it"""
    defaults: Parameters
    build: Callable[[Parameters], Document]
    """makes a scene of all parameters; those beyond the file format's bounds make one that it refuses"""
    rules: frozenset[str]
    """of `rules.RULES`, those that apply besides `bounded` and `repeat`, which always do"""
    error: Callable[[Scene, Trajectory], float] | None = None
    """how far a run is from what is known, as a share; None where nothing is"""
    error_of: str = ""
    """of what it is a share"""
    useless: float = np.inf
    """share from which on an answer is of no use, and fails the rule `truth`"""
    gain: float | Callable[[Scene, Settings, str], float] = 0.01
    """share of the stake by which energy may exceed that of the start; or what tells it, by settings and engine"""
    stake: Callable[[Scene], float] = lifted
    """J, against which a gain is held"""
    through: Callable[[Scene, Trajectory], str | None] | None = None
    """who got through what, for the rule `through`"""

    def document(self, parameters: Parameters) -> Document:
        """Return the scene with some parameters other than by default.

        Raises:
            KeyError: it has no parameter of a name.
        """
        unknown = set(parameters) - set(self.defaults)
        if unknown:
            raise KeyError(f"{self.name} has no {', '.join(sorted(unknown))}")
        return self.build({**self.defaults, **parameters})
