"""Springs that only pull: slack they have no force, and their dampers never push."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # kernels compile

STIFFNESS, REST = 400.0, 1.0
ENGINES = ("pymunk", "box2d", "reference")
METHODS: list[tuple[str, dict[str, Any]]] = [
    *((engine, {}) for engine in ENGINES),
    ("reference", {"integrator": "velocity_verlet"}),
    ("reference", {"joints": "xpbd"}),
    ("reference", {"joints": "relaxation", "stretch": 0.5}),
    ("reference", {"joints": "rattle", "integrator": "velocity_verlet"}),
]


def band(x: float, vx: float, damping: float = 0.0, **world: Any) -> Scene:
    """Return a scene of a ball of 1 kg on a band from the origin."""
    joint = {"kind": "spring", "between": ["a"], "rest_length": REST, "stiffness": STIFFNESS, "damping": damping}
    ball = {"name": "a", "position": [x, 0.0], "velocity": [vx, 0.0], "radius": 0.1, "mass": 1.0}
    return from_document(
        {
            "world": {"gravity": [0.0, 0.0], **world},
            "solver": {"dt": 0.0005},
            "ball": [ball],
            "joint": [{**joint, "pulls_only": True}],
        }
    )


def advanced(scene: Scene, engine: str, seconds: float, **more: Any) -> sandbox.Simulation:
    simulation = sandbox.start(scene, engine, scene.solver.replace(**more))
    for _ in range(round(seconds / scene.solver.dt)):
        simulation.step()
    return simulation


@pytest.mark.parametrize(("engine", "more"), METHODS, ids=str)
def test_band_returns_a_body_and_is_slack_again(engine: str, more: dict[str, Any]) -> None:
    """A ball at 2 m/s is turned round in half a period, π/20 s, and flies back freely through the anchor's side."""
    half = math.pi / math.sqrt(STIFFNESS)
    frame = advanced(band(0.8, 2.0), engine, 0.1 + half + 0.4, **more).frame()
    # methods of first order, and those that dissipate: m and m/s
    tolerance = 0.06 if more.get("joints") == "xpbd" else 0.01
    assert frame.velocity[0, 0] == pytest.approx(-2.0, abs=2.0 * tolerance)
    assert frame.position[0, 0] == pytest.approx(1.0 - 2.0 * 0.4, abs=tolerance)


@pytest.mark.parametrize("engine", ENGINES)
def test_damper_of_a_band_never_pushes(engine: str) -> None:
    """A damper resists contraction only as far as the band pulls, so that the body never slows down on its way in.

    An overdamped spring would stop it. The band gives it the speed at which its damper takes all of its force.
    """
    simulation = advanced(band(1.5, 0.0, damping=200.0), engine, 0.0)
    speeds = []
    for _ in range(2000):
        simulation.step()
        speeds.append(-float(simulation.frame().velocity[0, 0]))
    assert min(np.diff(speeds)) >= (-1e-7 if engine == "box2d" else 0.0)  # m/s, rounding of 32 bits
    # m/s: |v| = k (l − l₀)/c at first, while the body comes in with a time constant of m/c = 5 ms
    assert speeds[-1] == pytest.approx(STIFFNESS * 0.5 / 200.0, rel=0.05)
    # thrown inward while taut, faster than that: the band does nothing
    simulation = advanced(band(1.2, -5.0, damping=200.0), engine, 0.1)
    assert simulation.frame().velocity[0, 0] == pytest.approx(-5.0, abs=1e-6)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_energy_of_a_band_is_accounted(engine: str) -> None:
    """The damper takes what the body has lost when the band is slack again, where it stores nothing."""
    simulation = sandbox.start(band(0.8, 2.0, damping=1.0), engine)
    simulation.account()
    for _ in range(800):
        simulation.step()
    frame = simulation.frame()
    assert float(np.hypot(*frame.position[0])) < REST
    change = 0.5 * float(frame.velocity[0] @ frame.velocity[0]) - 0.5 * 2.0**2
    entries = simulation.account()
    assert change < -0.1
    # J: pymunk evaluates stiffness and velocity at different times of a step
    assert sum(entries.values()) == pytest.approx(change, abs=1e-9 if engine == "reference" else 2e-3), entries


def test_scene_with_a_band_has_no_closed_form_of_a_spring() -> None:
    springs = sandbox.compare(band(0.8, 2.0, duration=0.2), engines=["reference"])
    assert "closed form" not in str(springs.truth)
