"""ReferenceSimulation: the contract, contacts, extreme values and every combination of settings."""

import copy
import itertools
import pickle
import threading

import numpy as np
import pytest

from sandbox.action import Force, Impulse, Remove
from sandbox.engines.contract import Divergence, Refusal
from sandbox.engines.reference.broad_phase import BROAD_PHASES
from sandbox.engines.reference.continuous import DETECTIONS
from sandbox.engines.reference.integrators import INTEGRATORS
from tests.engines.builders import EARTH, FLOOR, ball, scene_of, simulation_of, small_pile
from tests.engines.stepping import advance


def mixed_scene():
    """Return a scene with a plane, a wall, a post, and balls that slide, bounce, fly and rest."""
    stuff = [{"name": "m", "restitution": 0.5, "friction": 0.3}]
    balls = [
        ball(-2, 0.6, velocity=[3, 0], material="m", name="a"),
        ball(0, 0.7, material="m", name="b", mass=3.0),
        ball(0.1, 2.0, velocity=[0, -2], radius=0.25, material="m", name="c"),
        ball(1.5, 0.4, fixed=True, material="m", name="rock"),
        ball(5, 5, collides="none", name="ghost"),
        ball(-1, 3, collides="fixed", material="m", name="loner"),
    ]
    return scene_of(
        *balls,
        world={**EARTH, "linear_drag": 0.1, "wind": [1.0, 0.0]},
        material=stuff,
        pair=[{"between": ["m", "m"], "restitution": 0.5, "friction": 0.3}],
        plane=[{**FLOOR, "material": "m"}],
        wall=[{"points": [[3, 0], [3, 3], [2.5, 4]], "thickness": 0.1, "material": "m"}],
        post=[{"position": [-3, 1], "radius": 0.3, "material": "m"}],
        solver={"dt": 0.01, "substeps": 2},
    )


COMBINATIONS = [
    (integrator, detection, ("impulse", "penalty")[(i + k) % 2], list(BROAD_PHASES)[(i + k) % 4])
    for i, integrator in enumerate(INTEGRATORS)
    for k, detection in enumerate(DETECTIONS)
]
"""Each integrator with each detection, and with these each response and each broad phase in turn."""


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(("integrator", "detection", "response", "broad_phase"), COMBINATIONS)
def test_every_combination_runs_or_refuses_with_a_reason(integrator, detection, response, broad_phase):
    settings = {"integrator": integrator, "detection": detection, "response": response, "broad_phase": broad_phase}
    try:
        simulation = simulation_of(mixed_scene(), **settings)
    except Refusal as refusal:
        assert response == "penalty"
        expected = "leaves no overlap" if detection in ("bisect", "swept") else "would gain energy"
        assert any(expected in reason for reason in refusal.reasons)
        return
    assert response == "impulse" or detection in ("discrete", "shrink")
    assert {key: getattr(simulation.settings, key) for key in settings} == settings
    advance(simulation, 50)
    frame = simulation.frame()
    assert np.abs(frame.position).max() < 10.0
    assert np.abs(frame.velocity).max() < 12.0
    assert (frame.position[[0, 1, 2, 5], 1] > 0.1).all()
    assert frame.position[3].tolist() == [1.5, 0.4]


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(("integrator", "detection"), [*zip(INTEGRATORS, [*DETECTIONS, "discrete"], strict=True)])
def test_runs_are_bit_identical_and_queries_change_nothing(integrator, detection):
    queried, unqueried = (simulation_of(mixed_scene(), integrator=integrator, detection=detection) for _ in range(2))
    for _ in range(60):
        queried.step()
        queried.contacts()
        queried.frame()
        unqueried.step()
    assert queried.state_hash() == unqueried.state_hash()


def test_no_ledger_is_kept_without_accounting():
    simulation = advance(simulation_of(mixed_scene()), 20)
    assert simulation._energy is None


@pytest.mark.parametrize("settings", [{}, {"detection": "swept"}, {"detection": "shrink"}, {"response": "penalty"}])
def test_observer_receives_every_part_of_every_substep(settings):
    simulation, observed = simulation_of(mixed_scene(), **settings), []
    simulation.watch(lambda *args: observed.append(args))
    begin = simulation.frame().position
    advance(simulation, 40)
    assert len(observed) >= 80
    assert np.array_equal(observed[0][1], begin)
    for previous, following in itertools.pairwise(observed):
        assert np.array_equal(previous[2], following[1])
        assert previous[0] <= following[0]
    assert np.array_equal(observed[-1][2], simulation.frame().position)
    assert {tuple(pair) for _, _, _, pairs in observed for pair in pairs.tolist()} >= {(0, -1), (1, -1)}


@pytest.mark.parametrize("fraction", [0.0, 1.0, -0.5, 1.5, float("nan")])
def test_invalid_fraction_of_a_last_step_is_refused(fraction):
    with pytest.raises(ValueError, match="a last part of"):
        simulation_of(mixed_scene()).finish(fraction)


@pytest.mark.parametrize("detection", DETECTIONS)
@pytest.mark.parametrize("fraction", [0.25, 0.5, 0.7])
def test_partial_last_step_ends_the_run(detection, fraction):
    simulation = advance(simulation_of(mixed_scene(), detection=detection), 30)
    simulation.finish(fraction)
    assert simulation.time == (30 + fraction) * 0.01
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()
    with pytest.raises(RuntimeError, match="ended"):
        simulation.apply(Impulse(time=0, body="a", impulse=(1, 0)))
    assert np.isfinite(simulation.frame().position).all()


def test_partial_last_step_moves_by_its_fraction():
    simulation = simulation_of(scene_of(ball(0, 0, velocity=[8, 0]), solver={"dt": 0.5, "substeps": 4}))
    simulation.finish(0.625)
    assert simulation.frame().position[0, 0] == 2.5


def test_simulation_cannot_be_pickled_or_copied_in_part():
    simulation = simulation_of(mixed_scene())
    for copier in (pickle.dumps, copy.copy):
        with pytest.raises(TypeError, match="cannot be pickled"):
            copier(simulation)


def test_close_ends_the_simulation():
    simulation = simulation_of(mixed_scene())
    simulation.close()
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()
    assert len(simulation.frame().position) == 6


def test_second_thread_is_refused_during_a_step():
    simulation = simulation_of(mixed_scene())
    waiting, release, errors = threading.Event(), threading.Event(), []

    def hold(*_):
        waiting.set()
        release.wait(30)

    simulation.watch(hold)
    thread = threading.Thread(target=simulation.step)
    thread.start()
    assert waiting.wait(30)
    for call in (simulation.step, lambda: simulation.apply(Remove(time=0, body="a"))):
        try:
            call()
        except RuntimeError as error:
            errors.append(str(error))
    release.set()
    thread.join()
    assert len(errors) == 2
    assert all("in progress" in error for error in errors)
    simulation.step()


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_body_beyond_the_numeric_range_diverges_and_the_frame_can_be_read(integrator):
    scene = scene_of(ball(0, 0, name="still"), ball(9.9e15, 5, velocity=[9e11, 0], name="thrown"), solver={"dt": 10.0})
    simulation = simulation_of(scene, integrator=integrator)
    simulation.apply(Force(time=0, body="thrown", force=(9e10, 0.0)))
    with pytest.raises(Divergence, match="'thrown' is not finite, or is out of range") as caught:
        advance(simulation, 100_000)
    assert caught.value.body == "thrown"
    frame = simulation.frame()
    assert frame.position[1, 0] > 1e17 or frame.velocity[1, 0] > 1e13
    assert simulation.frame().position[0].tolist() == [0, 0]
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()


def test_action_on_another_body_does_not_disturb_overlap_correction():
    """Overlap is corrected at the same rate while actions apply to another body."""
    scene = scene_of(
        ball(0, 0.4, name="deep"), ball(9, 9, collides="none", name="far"), world=EARTH, plane=[FLOOR],
        solver={"dt": 0.01},
    )  # fmt: skip
    undisturbed, disturbed = simulation_of(scene), simulation_of(scene)
    for _ in range(20):
        disturbed.apply(Impulse(time=0, body="far", impulse=(0.1, 0)))
        assert np.array_equal(advance(disturbed, 1).frame().position[0], advance(undisturbed, 1).frame().position[0])


@pytest.mark.parametrize("x", [1e3, 1e6, 1e9, 1e12, 1e16])
def test_positions_far_from_the_origin_stay_finite_and_bounded(x):
    scene = scene_of(ball(x, 0, velocity=[1, 0]), ball(x, 0, radius=2.0), solver={"dt": 0.01})
    for name in BROAD_PHASES:
        frame = advance(simulation_of(scene, broad_phase=name), 30).frame()
        assert np.abs(frame.position - [x, 0]).max() <= max(5.0, 4 * np.spacing(x))
        assert np.abs(frame.velocity).max() <= 1.0 + 1e-12


@pytest.mark.parametrize("detection", DETECTIONS)
@pytest.mark.parametrize(("light", "heavy"), [(1e-15, 1e30), (1e-15, 1e-15), (1e30, 1e30), (1.0, 1e12)])
def test_elastic_collision_of_extreme_masses_matches_the_closed_form(light, heavy, detection):
    scene = scene_of(
        ball(-1.1, 0, velocity=[5, 0], mass=light, material="m"),
        ball(0, 0, mass=heavy, material="m"),
        material=[{"name": "m"}],
        pair=[{"between": ["m", "m"], "restitution": 1.0}],
        solver={"dt": 0.01},
    )
    velocity = advance(simulation_of(scene, detection=detection), 20).frame().velocity[:, 0]
    total = light + heavy
    assert velocity[0] == pytest.approx((light - heavy) / total * 5, abs=1e-12)  # some roundings
    assert velocity[1] == pytest.approx(2 * light / total * 5, rel=1e-12)  # likewise


@pytest.mark.parametrize("detection", ["discrete", "swept", "bisect"])
def test_nanometre_balls_come_to_rest(detection):
    scene = scene_of(ball(0, 3e-9, radius=1e-9, mass=1e-15), world=EARTH, plane=[FLOOR], solver={"dt": 1e-6})
    y = advance(simulation_of(scene, detection=detection), 300).frame().position[0, 1]
    assert y == pytest.approx(1e-9, abs=1e-10)  # the slop, a hundredth of the radius, and residual settling


def test_engine_chooses_suitable_settings():
    def chosen_settings(scene):
        return simulation_of(scene).settings

    mixed_sizes = [ball(2 * k, 0, radius=0.01 if k else 0.9, name=f"b{k}") for k in range(30)]
    settings = chosen_settings(scene_of(*mixed_sizes))
    for scene in (small_pile(12), small_pile(60), scene_of(*mixed_sizes)):
        assert chosen_settings(scene).broad_phase in BROAD_PHASES
    assert chosen_settings(small_pile(60)).broad_phase != "all_pairs"  # 1,770 pairs, of which about 120 are near
    assert settings.broad_phase != "grid"  # all would be in one cell, sized by the largest ball
    assert (settings.integrator, settings.detection, settings.response) == ("explicit_euler", "discrete", "impulse")
    assert settings.slop == pytest.approx(1e-4, rel=1e-12)  # a product
    springs = simulation_of(mixed_scene(), response="penalty").settings
    assert springs.integrator == "semi_implicit_euler"
    assert springs.stiffness is not None


def test_explicit_settings_are_kept():
    stated = {"slop": 0.02, "bias": 0.5, "iterations": 3, "broad_phase": "sweep", "integrator": "rk4"}
    settings = simulation_of(mixed_scene(), **stated).settings
    assert {key: getattr(settings, key) for key in stated} == stated


def test_work_is_counted():
    simulation = simulation_of(mixed_scene(), broad_phase="circles")
    advance(simulation, 60)
    work = simulation.work
    assert work["substeps"] == 120
    assert work["broad_tests"] >= 120 * 6  # collidable pairs: a, b, c with each other and with the rock
    assert 0 < work["contacts"] <= work["pair_tests"]


def test_scene_without_bodies_runs():
    simulation = advance(simulation_of(scene_of(plane=[FLOOR])), 3)
    assert simulation.frame().position.shape == (0, 2)
    assert len(simulation.contacts()) == 0
