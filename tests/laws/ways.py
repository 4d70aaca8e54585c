"""Every way to compute a scene that the laws are held against: each engine as it is, and the reference's choices."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from sandbox.engines.registry import ENGINES, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory


class Way(NamedTuple):
    """An engine with settings."""

    engine: str
    settings: dict[str, Any]

    def run(self, scene: Scene, **more: Any) -> Trajectory:
        """Run a scene this way; it must come through."""
        settings = {"dt": 0.01, **self.settings, **more}
        done = run(scene, self.engine, audit=False, **settings)
        assert done.status == "ok", done.reason
        return done

    def start(self, scene: Scene) -> Any:
        """Start a scene this way."""
        return start(scene, self.engine, scene.solver.replace(**self.settings))


INTEGRATORS = ("explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4")

SOFT = Way("reference", {"response": "penalty", "integrator": "velocity_verlet", "substeps": 50, "stiffness": 2e4})
"""Springs: the laws hold for them to the accuracy of the step, here a hundredth of a contact of 1 kg."""

HARD = [
    *(Way(engine, {}) for engine in ENGINES),
    *(Way("reference", {"integrator": word}) for word in INTEGRATORS[1:]),
    *(Way("reference", {"integrator": "velocity_verlet", "detection": word}) for word in ("bisect", "swept", "shrink")),
]
"""Impulses: what the laws say of an impact holds to rounding."""


def named(ways: list[Way]) -> Any:
    """Return a parametrization over ways, each by its name."""
    return pytest.mark.parametrize(
        "way",
        [
            pytest.param(w, id="-".join((w.engine, *(v for v in w.settings.values() if isinstance(v, str)))))
            for w in ways
        ],
    )


def pair(e: float, mass: tuple[float, float], offset: float, speed: float, **keys: Any) -> Scene:
    """Return a ball that hits one at rest, off its middle by a part of the contact distance 1, after some 0.5 s."""
    between = {"between": ["a", "a"], "restitution": e, "friction": keys.pop("friction", 0.0)}
    still = {"name": "two", "position": [0.0, 0.0], "radius": 0.5, "mass": mass[1], "material": "a"}
    x = -float(np.sqrt(1 - offset**2)) - 0.503 * speed
    moving = {**still, "name": "one", "position": [x, offset], "velocity": [speed, 0.0], "mass": mass[0]}
    return from_document(
        {"world": {"duration": 1.0}, "material": [{"name": "a"}], "pair": [between], "ball": [moving, still]} | keys
    )


def drop(e: float, height: float, duration: float, radius: float = 0.5) -> Scene:
    """Return a ball dropped from a height, m, above a plane."""
    return from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": duration},
            "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0], "restitution": e}],
            "ball": [{"position": [0.0, radius + height], "radius": radius}],
        }
    )
