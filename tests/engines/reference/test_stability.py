"""Stability: what penalty springs refuse, and that the bound which is named is one."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.engines.contract import Refusal
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.penalty import smallest_reduced_mass
from sandbox.engines.registry import ENGINES
from tests.engines.reference.pieces import EARTH, FLOOR, ball, running, scene_of

pytestmark = pytest.mark.full  # long runs and sweeps

REFERENCE = ENGINES["reference"]


def falling(restitution=0.5, count=1, **more):
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


def named(text, what):
    return float(re.search(rf"{what} ([0-9.e+-]+)", text)[1])


@pytest.mark.parametrize("integrator", INTEGRATORS)
@settings(max_examples=20)
@given(stiffness=st.floats(1, 1e8), e=st.floats(0.05, 0.9), count=st.integers(1, 2))
def test_the_step_and_the_stiffness_that_are_named_are_stable_and_more_is_not(integrator, stiffness, e, count):
    scene = falling(e, count)
    told = reasons(scene, integrator=integrator, stiffness=stiffness, dt=1.0)
    if not told:
        return
    assert len(told) == 1
    assert told[0].startswith(f"penalty springs of {stiffness:g} N/m would gain energy at h = 1 s with {integrator}")
    h, softer = named(told[0], "h = dt / substeps of at most"), named(told[0], "a solver.stiffness of at most")
    assert not reasons(scene, integrator=integrator, stiffness=stiffness, dt=h)
    assert reasons(scene, integrator=integrator, stiffness=stiffness, dt=1.05 * h)
    assert not reasons(scene, integrator=integrator, stiffness=softer, dt=1.0)
    assert reasons(scene, integrator=integrator, stiffness=1.1 * softer, dt=1.0)


def test_where_the_engine_chose_the_stiffness_it_names_one_and_no_step():
    told = reasons(falling(0.8), integrator="explicit_euler")
    assert len(told) == 1
    assert "h = dt" not in told[0]
    softer = named(told[0], "a solver.stiffness of at most")
    assert not reasons(falling(0.8), integrator="explicit_euler", stiffness=softer)


def test_elastic_springs_are_stable_at_no_step_of_explicit_euler():
    told = reasons(falling(1.0), integrator="explicit_euler", stiffness=1e4)
    assert "no step is stable" in told[0]


@pytest.mark.parametrize("e", [0.02, 0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("integrator", [None, "velocity_verlet", "leapfrog", "rk4"])
def test_what_the_engine_chooses_by_itself_is_stable(e, integrator):
    for count in (1, 2):
        assert reasons(falling(e, count), integrator=integrator) == ()


def test_a_restitution_of_nothing_is_refused_unless_a_damping_is_stated():
    (told,) = reasons(falling(0.0))
    assert all(part in told for part in ("restitution 0", "0.02", "solver.damping"))
    assert reasons(falling(0.0), damping=1.0) == ()


@pytest.mark.parametrize("key", ["slop", "bias", "persistence"])
def test_figures_of_impulses_are_refused(key):
    (told,) = reasons(falling(), **{key: 1})
    assert told.startswith(key) and "'impulse'" in told


@pytest.mark.parametrize("detection", ["bisect", "swept"])
def test_detections_without_overlap_are_refused(detection):
    (told,) = reasons(falling(), detection=detection)
    assert told.startswith(f"detection {detection!r}") and "penalty" in told


@pytest.mark.parametrize("key", ["stiffness", "damping"])
def test_figures_of_springs_are_refused_to_impulses(key):
    scene = falling()
    with pytest.raises(Refusal, match=f"{key} .*'penalty'"):
        running(scene, **{key: 1.0})


@pytest.mark.parametrize(
    ("choice", "reason"),
    [
        ({"broad_phase": "oriented"}, "needs polygons, and the scene has none"),
        ({"half_kick": True}, "half_kick applies to pymunk only"),
        ({"persistence": 3}, "it keeps contacts for 1 substep"),
    ],
)
def test_what_the_reference_lacks_it_says(choice, reason):
    with pytest.raises(Refusal, match=reason):
        running(falling(), **choice)


def test_the_lightest_is_the_smallest_reduced_mass():
    assert smallest_reduced_mass(falling(mass=3.0)) == 3.0
    assert smallest_reduced_mass(falling(mass=3.0, count=2)) == 1.5
    assert smallest_reduced_mass(scene_of(ball(0, 0, collides="none"))) == 1.0


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"])
def test_a_packing_at_the_stable_limit_gains_no_energy(integrator):
    """Seven elastic balls pressed together without gravity: the stiffest packing that was counted on."""
    around = [(np.cos(a), np.sin(a)) for a in np.arange(6) * np.pi / 3]
    balls = [ball(0.99 * x, 0.99 * y, material="m", name=f"b{k}") for k, (x, y) in enumerate([(0, 0), *around])]
    scene = scene_of(
        *balls, material=[{"name": "m"}], pair=[{"between": ["m", "m"], "restitution": 1.0}], solver={"dt": 0.01}
    )
    (told,) = reasons(scene, integrator=integrator, stiffness=1e6)
    stiffness = named(told, "a solver.stiffness of at most")
    simulation = running(scene, response="penalty", integrator=integrator, stiffness=stiffness)
    # Each of the twelve springs is 1 cm short. Nothing else puts energy in.
    stored = 12 * 0.5 * stiffness * 0.01**2
    kinetic = []
    for _ in range(1000):
        simulation.step()
        kinetic.append(0.5 * float((simulation.frame().velocity ** 2).sum()))
    # Near ω·h = 2 a scheme's energy swings in a band about its own, wider than the true one; it does not grow.
    assert max(kinetic) < 4.0 * stored
    assert max(kinetic[500:]) <= max(kinetic[:500]) * (1 + 1e-9)
