"""Stability: settings that penalty springs refuse, and that the bounds in the reasons are sharp."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.contract import Refusal
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.penalty import smallest_reduced_mass
from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.setup import Setup
from tests.engines.builders import EARTH, FLOOR, ball, scene_of, simulation_of

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

REFERENCE = ENGINES["reference"]


def falling_balls(restitution=0.5, count=1, **more):
    balls = [ball(1.01 * k, 0.6, name=f"b{k}", material="m", **more) for k in range(count)]
    return scene_of(
        *balls,
        world=EARTH,
        material=[{"name": "m", "restitution": restitution}],
        pair=[{"between": ["m", "m"], "restitution": restitution}],
        plane=[{**FLOOR, "material": "m"}],
    )


def reasons(scene, **choices):
    return REFERENCE.missing(scene, scene.solver.replace(response="penalty", **choices))


def number_after(text, phrase):
    return float(re.search(rf"{phrase} ([0-9.e+-]+)", text)[1])


@pytest.mark.parametrize("integrator", INTEGRATORS)
@given(stiffness=st.floats(1, 1e8), e=st.floats(0.05, 0.9), count=st.integers(1, 2))
def test_reported_step_and_stiffness_limits_are_stable_and_larger_ones_are_not(integrator, stiffness, e, count):
    scene = falling_balls(e, count)
    refusals = reasons(scene, integrator=integrator, stiffness=stiffness, dt=1.0)
    if not refusals:
        return
    assert len(refusals) == 1
    assert refusals[0].startswith(
        f"penalty springs of {stiffness:g} N/m would gain energy at h = 1 s with {integrator}"
    )
    h, softer = (
        number_after(refusals[0], "h = dt / substeps of at most"),
        number_after(refusals[0], "a solver.stiffness of at most"),
    )
    assert not reasons(scene, integrator=integrator, stiffness=stiffness, dt=h)
    assert reasons(scene, integrator=integrator, stiffness=stiffness, dt=1.05 * h)
    assert not reasons(scene, integrator=integrator, stiffness=softer, dt=1.0)
    assert reasons(scene, integrator=integrator, stiffness=1.1 * softer, dt=1.0)


def test_reason_names_only_a_stiffness_if_the_engine_chose_it():
    refusals = reasons(falling_balls(0.8), integrator="explicit_euler")
    assert len(refusals) == 1
    assert "h = dt" not in refusals[0]
    softer = number_after(refusals[0], "a solver.stiffness of at most")
    assert not reasons(falling_balls(0.8), integrator="explicit_euler", stiffness=softer)


def test_elastic_springs_are_never_stable_with_explicit_euler():
    refusals = reasons(falling_balls(1.0), integrator="explicit_euler", stiffness=1e4)
    assert "no step is stable" in refusals[0]


@pytest.mark.parametrize("e", [0.02, 0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("integrator", [None, "velocity_verlet", "leapfrog", "rk4"])
def test_default_settings_are_stable(e, integrator):
    for count in (1, 2):
        assert reasons(falling_balls(e, count), integrator=integrator) == ()


def test_zero_restitution_is_refused_without_explicit_damping():
    (refusals,) = reasons(falling_balls(0.0))
    assert all(part in refusals for part in ("restitution 0", "0.02", "solver.damping"))
    assert reasons(falling_balls(0.0), damping=1.0) == ()


@pytest.mark.parametrize("key", ["slop", "bias", "persistence"])
def test_impulse_settings_are_refused_for_penalty(key):
    (refusals,) = reasons(falling_balls(), **{key: 1})
    assert refusals.startswith(key) and "'impulse'" in refusals


@pytest.mark.parametrize("detection", ["bisect", "swept"])
def test_detections_without_overlap_are_refused(detection):
    (refusals,) = reasons(falling_balls(), detection=detection)
    assert refusals.startswith(f"detection {detection!r}") and "penalty" in refusals


@pytest.mark.parametrize("key", ["stiffness", "damping"])
def test_penalty_settings_are_refused_for_impulse(key):
    scene = falling_balls()
    with pytest.raises(Refusal, match=f"{key} .*'penalty'"):
        simulation_of(scene, **{key: 1.0})


@pytest.mark.parametrize(
    ("choice", "reason"),
    [
        ({"broad_phase": "oriented"}, "needs polygons, and the scene has none"),
        ({"half_kick": True}, "only pymunk has it"),
        ({"persistence": 3}, r"persistence 3 is not supported \(only 1\)"),
    ],
)
def test_unsupported_settings_are_refused_with_a_reason(choice, reason):
    with pytest.raises(Refusal, match=reason):
        simulation_of(falling_balls(), **choice)


def test_smallest_reduced_mass_is_that_of_the_lightest_pair():
    assert smallest_reduced_mass(Setup.of(falling_balls(mass=3.0))) == 3.0
    assert smallest_reduced_mass(Setup.of(falling_balls(mass=3.0, count=2))) == 1.5
    assert smallest_reduced_mass(Setup.of(scene_of(ball(0, 0, collides="none")))) == 1.0


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"])
def test_packing_at_the_stability_limit_gains_no_energy(integrator):
    """Seven elastic balls pressed together without gravity: the stiffest packing that the bound assumes."""
    ring = [(np.cos(a), np.sin(a)) for a in np.arange(6) * np.pi / 3]
    balls = [ball(0.99 * x, 0.99 * y, material="m", name=f"b{k}") for k, (x, y) in enumerate([(0, 0), *ring])]
    scene = scene_of(
        *balls, material=[{"name": "m"}], pair=[{"between": ["m", "m"], "restitution": 1.0}], solver={"dt": 0.01}
    )
    (refusals,) = reasons(scene, integrator=integrator, stiffness=1e6)
    stiffness = number_after(refusals, "a solver.stiffness of at most")
    simulation = simulation_of(scene, response="penalty", integrator=integrator, stiffness=stiffness)
    # Each of the twelve contact springs is compressed by 1 cm, the only source of energy.
    stored = 12 * 0.5 * stiffness * 0.01**2
    kinetic = []
    for _ in range(1000):
        simulation.step()
        kinetic.append(0.5 * float((simulation.frame().velocity ** 2).sum()))
    # Near ω·h = 2 the energy of a scheme oscillates in a wide band around the exact value but does not grow.
    assert max(kinetic) < 4.0 * stored
    assert max(kinetic[500:]) <= max(kinetic[:500]) * (1 + 1e-9)
