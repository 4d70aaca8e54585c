"""Configurations in which the laws are tested: each engine with its defaults, and the choices of the reference."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from sandbox.engines.registry import ENGINES, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tests.engines.builders import make_scene


class EngineConfig(NamedTuple):
    """An engine with settings."""

    engine: str
    settings: dict[str, Any]

    def rounding(self, tolerance: float) -> float:
        """Return a tolerance for rounding errors, given that of 64-bit numbers."""
        return tolerance * ENGINES[self.engine].epsilon / 2.0**-52

    def impact_rounding(self, tolerance: float) -> float:
        """Return a tolerance for results of impacts with an offset, relative to the speed of approach.

        Box2D solves an impact with the normal at the start of a step and from a distance of four slops on, here 0.02 of
        the contact distance: in a glancing impact it is turned by some percent.
        """
        return 0.1 if self.engine == "box2d" else tolerance

    @property
    def knows_impulses(self) -> bool:
        """Whether contacts have impulses."""
        return ENGINES[self.engine].knows_impulses

    def run(self, scene: Scene, **more: Any) -> Trajectory:
        """Run a scene; the run must end with status "ok"."""
        settings = {"dt": 0.01, **self.settings, **more}
        result = run(scene, self.engine, audit=False, **settings)
        assert result.status == "ok", result.reason
        return result

    def start(self, scene: Scene) -> Any:
        """Start a scene."""
        return start(scene, self.engine, scene.solver.replace(**self.settings))


INTEGRATORS = ("explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4")

PENALTY = EngineConfig(
    "reference", {"response": "penalty", "integrator": "velocity_verlet", "substeps": 50, "stiffness": 2e4}
)
"""Penalty springs: laws hold to the accuracy of the step, here a hundredth of the duration of a contact of 1 kg."""

IMPULSE_CONFIGS = [
    *(EngineConfig(engine, {}) for engine in ENGINES),
    *(EngineConfig("reference", {"integrator": word}) for word in INTEGRATORS[1:]),
    *(
        EngineConfig("reference", {"integrator": "velocity_verlet", "detection": word})
        for word in ("bisect", "swept", "shrink")
    ),
]
"""Impulses: laws of an impact hold to rounding."""


def each_config(configs: list[EngineConfig]) -> Any:
    """Return a parametrization over configurations, with ids of their engines and settings."""
    return pytest.mark.parametrize(
        "config",
        [
            pytest.param(w, id="-".join((w.engine, *(v for v in w.settings.values() if isinstance(v, str)))))
            for w in configs
        ],
    )


def pair(e: float, mass: tuple[float, float], offset: float, speed: float, **keys: Any) -> Scene:
    """Return a ball that hits one at rest after about 0.5 s, with an offset in units of the contact distance 1 m."""
    between = {"between": ["a", "a"], "restitution": e, "friction": keys.pop("friction", 0.0)}
    resting = {"name": "two", "position": [0.0, 0.0], "radius": 0.5, "mass": mass[1], "material": "a"}
    x = -float(np.sqrt(1 - offset**2)) - 0.503 * speed
    moving = {**resting, "name": "one", "position": [x, offset], "velocity": [speed, 0.0], "mass": mass[0]}
    return from_document(
        {"world": {"duration": 1.0}, "material": [{"name": "a"}], "pair": [between], "ball": [moving, resting]} | keys
    )


def drop(e: float, height: float, duration: float, radius: float = 0.5) -> Scene:
    """Return a ball dropped from a height, m, above a plane."""
    return make_scene(
        world={"gravity": [0.0, -9.81], "duration": duration},
        plane=[{"point": [0.0, 0.0], "normal": [0.0, 1.0], "restitution": e}],
        ball=[{"position": [0.0, radius + height], "radius": radius}],
    )
