"""Drift: changes of energy and momentum without a cause."""

from dataclasses import replace

import numpy as np
import pytest

from sandbox.measure.analytic.trajectory import solved_run
from sandbox.measure.metrics.invariants import energy_drift, momentum_drift
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find


def falling(world: str = "") -> Scene:
    return loads(
        f"[world]\ngravity = [0, -10]\nduration = 1.0\n{world}\n[solver]\ndt = 0.01\n"
        "[[ball]]\nposition = [0, 100]\nradius = 1\nmass = 3\n"
    )


def test_energy_drift_of_explicit_euler_is_its_known_error() -> None:
    """It ends m·g·(g·h·T/2) too high; as a fraction of ½·m·(gT)² this is h/T."""
    scene = falling()
    drift = energy_drift(run(scene, audit=False), scene, solved_run(scene, scene.solver), True)
    assert drift.fraction == pytest.approx(0.01, rel=1e-10)  # of differences of 3000 J: 1e-13 · 3000 / 150
    assert drift.against == "truth"


def test_energy_lost_in_impacts_is_no_drift_against_the_truth() -> None:
    scene = load(find("bounce"), ["world.duration=12.0", "solver.dt=0.002"])
    truth, found = solved_run(scene, scene.solver), run(scene, audit=False)
    against_truth = energy_drift(found, scene, truth, True).fraction
    against_start = energy_drift(found, scene, truth, False)
    assert against_truth == pytest.approx(0.0, abs=2e-3)  # at rest in the end, at a depth of the slop: 5 mm of 5 m
    # All of m·g·5 m is lost. The largest kinetic energy is of a frame up to dt before impact: lower by 2·g·dt/v.
    assert against_start.fraction == pytest.approx(-1.0, abs=4e-3)
    assert against_start.against == "start"


def test_momentum_is_explained_by_gravity_and_contacts() -> None:
    scene = load(find("bounce"))
    drift = momentum_drift(run(scene, audit=False), scene)
    assert drift < 1e-12  # 6,000 roundings of numbers about 10


def test_unrecorded_contact_shows_as_momentum_drift() -> None:
    scene = load(find("bounce"))
    found = run(scene, audit=False)
    impulse = found.contact_impulse.copy()
    impulse[0] = 0.0
    scale = float(np.abs(found.velocity).max())
    lost = abs(found.contact_impulse[0, 1]) / scale
    assert momentum_drift(replace(found, contact_impulse=impulse), scene) == pytest.approx(lost, rel=1e-9)  # see above


def test_impulses_between_moving_balls_cancel_and_those_of_fixed_balls_count() -> None:
    scene = loads(
        "[world]\nduration = 1.0\n[solver]\ndt = 0.01\n"
        "[[ball]]\nposition = [-3, 0]\nradius = 0.5\nfixed = true\nrestitution = 1\n"
        "[[ball]]\nposition = [0, 0]\nvelocity = [-8, 0]\nradius = 0.5\nrestitution = 1\n"
        "[[ball]]\nposition = [2, 0]\nvelocity = [-4, 0]\nradius = 0.5\nrestitution = 1\n"
    )
    found = run(scene, audit=False)
    assert len(found.contact_time) > 1
    assert momentum_drift(found, scene) == pytest.approx(0.0, abs=1e-14)  # a few roundings


@pytest.mark.parametrize("world", ["linear_drag = 0.1", "bounds = [[-200, 97], [200, 200]]"])
def test_momentum_drift_is_none_with_drag_or_lost_bodies(world: str) -> None:
    scene = falling(world)
    assert momentum_drift(run(scene, audit=False), scene) is None


def test_refused_run_has_no_drift() -> None:
    scene = load(find("bounce"), ["solver.integrator='rk4'"])
    refused = run(scene, audit=False)
    assert refused.status == "refused"
    assert energy_drift(refused, scene, None, False).fraction is None
    assert momentum_drift(refused, scene) is None
