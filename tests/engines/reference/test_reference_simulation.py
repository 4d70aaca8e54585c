"""ReferenceSimulation: the contract, contacts, extremes, and every combination of its choices."""

import copy
import itertools
import pickle
import threading

import numpy as np
import pytest

from sandbox.action import ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.contract import Divergence, Refusal
from sandbox.engines.reference.broad_phase import BROAD_PHASES
from sandbox.engines.reference.continuous import DETECTIONS
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.scene.description.discs import Ball
from tests.engines.reference.pieces import EARTH, FLOOR, ball, running, scene_of, small_pile, stepped


def mixed():
    """A little of everything: plane, wall, post, balls that rub, bounce, fly and stay."""
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


@pytest.mark.full
@pytest.mark.parametrize(
    ("integrator", "detection", "response", "broad_phase"),
    list(itertools.product(INTEGRATORS, DETECTIONS, ["impulse", "penalty"], BROAD_PHASES)),
)
def test_every_combination_runs_or_refuses_with_a_reason(integrator, detection, response, broad_phase):
    choice = {"integrator": integrator, "detection": detection, "response": response, "broad_phase": broad_phase}
    try:
        simulation = running(mixed(), **choice)
    except Refusal as refusal:
        assert response == "penalty"
        expected = "leaves no overlap" if detection in ("bisect", "swept") else "would gain energy"
        assert any(expected in reason for reason in refusal.reasons)
        return
    assert response == "impulse" or detection in ("discrete", "shrink")
    assert {key: getattr(simulation.settings, key) for key in choice} == choice
    stepped(simulation, 50)
    frame = simulation.frame()
    assert np.abs(frame.position).max() < 10.0
    assert np.abs(frame.velocity).max() < 12.0
    assert (frame.position[[0, 1, 2, 5], 1] > 0.1).all()
    assert frame.position[3].tolist() == [1.5, 0.4]


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("detection", DETECTIONS)
def test_two_runs_are_the_same_bit_for_bit_and_asking_changes_nothing(integrator, detection):
    asked, never = (running(mixed(), integrator=integrator, detection=detection) for _ in range(2))
    for _ in range(60):
        asked.step()
        asked.contacts()
        asked.frame()
        never.step()
    assert asked.state_hash() == never.state_hash()


@pytest.mark.parametrize("settings", [{}, {"detection": "swept"}, {"detection": "bisect"}, {"response": "penalty"}])
def test_contacts_asked_often_or_once_sum_to_the_same(settings):
    often, once = running(mixed(), **settings), running(mixed(), **settings)
    often.contacts()
    once.contacts()
    sums = {}
    for _ in range(150):
        often.step()
        once.step()
        taken = often.contacts()
        for time, pair, impulse in zip(taken.time.tolist(), taken.pair.tolist(), taken.impulse, strict=True):
            sums[time, *pair] = sums.get((time, *pair), 0.0) + impulse
    whole = once.contacts()
    assert len(whole) == len(sums) > 5
    for time, pair, impulse in zip(whole.time.tolist(), whole.pair.tolist(), whole.impulse, strict=True):
        assert sums[time, *pair] == pytest.approx(impulse, rel=1e-12, abs=1e-12)  # added up in another order


def test_never_asking_keeps_no_ledger():
    simulation = stepped(running(mixed()), 20)
    assert simulation._energy is None


def test_the_first_call_returns_what_touches_now_and_its_impulse_counts_from_then():
    simulation = stepped(running(scene_of(ball(0, 0.499), world=EARTH, plane=[FLOOR], solver={"dt": 0.01})), 50)
    first = simulation.contacts()
    assert first.pair.tolist() == [[0, -1]]
    assert first.time.tolist() == [simulation.time]
    assert first.normal.tolist() == [[0.0, -1.0]]
    assert not first.impulse.any()
    simulation.step()
    then = simulation.contacts()
    assert then.time.tolist() == first.time.tolist()
    assert then.impulse[0] == pytest.approx([0.0, -0.0981], rel=1e-9)  # the weight of a step, settled


@pytest.mark.parametrize("settings", [{}, {"detection": "swept"}, {"detection": "shrink"}, {"response": "penalty"}])
def test_an_observer_sees_every_piece_of_every_substep(settings):
    simulation, seen = running(mixed(), **settings), []
    simulation.watch(lambda *args: seen.append(args))
    begin = simulation.frame().position
    stepped(simulation, 40)
    assert len(seen) >= 80
    assert np.array_equal(seen[0][1], begin)
    for one, following in itertools.pairwise(seen):
        assert np.array_equal(one[2], following[1])
        assert one[0] <= following[0]
    assert np.array_equal(seen[-1][2], simulation.frame().position)
    assert {tuple(pair) for _, _, _, pairs in seen for pair in pairs.tolist()} >= {(0, -1), (1, -1)}


def test_frames_are_values():
    simulation = running(mixed())
    before = simulation.frame()
    kept = before.position.copy()
    simulation.step()
    assert np.array_equal(before.position, kept)
    with pytest.raises(ValueError, match="read-only"):
        before.position[0] = 0.0


def test_time_is_counted_and_not_summed():
    simulation = stepped(running(scene_of(ball(0, 0), solver={"dt": 0.1, "substeps": 3})), 1000)
    assert simulation.time == 1000 * 0.1


@pytest.mark.parametrize("part", [0.0, 1.0, -0.5, 1.5, float("nan")])
def test_there_is_no_such_last_part(part):
    with pytest.raises(ValueError, match="a last part of"):
        running(mixed()).finish(part)


@pytest.mark.parametrize("detection", DETECTIONS)
@pytest.mark.parametrize("part", [0.25, 0.5, 0.7])
def test_a_last_part_ends_the_run(detection, part):
    simulation = stepped(running(mixed(), detection=detection), 30)
    simulation.finish(part)
    assert simulation.time == (30 + part) * 0.01
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()
    with pytest.raises(RuntimeError, match="ended"):
        simulation.apply(Impulse(time=0, body="a", impulse=(1, 0)))
    assert np.isfinite(simulation.frame().position).all()


def test_a_last_part_moves_by_that_part():
    simulation = running(scene_of(ball(0, 0, velocity=[8, 0]), solver={"dt": 0.5, "substeps": 4}))
    simulation.finish(0.625)
    assert simulation.frame().position[0, 0] == 2.5


def test_it_refuses_to_be_copied():
    simulation = running(mixed())
    for copier in (pickle.dumps, copy.copy, copy.deepcopy):
        with pytest.raises(TypeError, match="cannot be copied"):
            copier(simulation)


def test_close_ends_it():
    simulation = running(mixed())
    simulation.close()
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()
    assert len(simulation.frame().position) == 6


def test_a_second_thread_is_turned_away():
    simulation = running(mixed())
    waiting, go_on, errors = threading.Event(), threading.Event(), []

    def hold(*_):
        waiting.set()
        go_on.wait(30)

    simulation.watch(hold)
    thread = threading.Thread(target=simulation.step)
    thread.start()
    assert waiting.wait(30)
    for deed in (simulation.step, lambda: simulation.apply(Remove(time=0, body="a"))):
        try:
            deed()
        except RuntimeError as error:
            errors.append(str(error))
    go_on.set()
    thread.join()
    assert len(errors) == 2
    assert all("in progress" in error for error in errors)
    simulation.step()


def test_who_leaves_the_bounds_is_retired_then():
    scene = scene_of(
        ball(0, 0, velocity=[10, 0], name="fast"),
        ball(0, 5, velocity=[1, 0], name="slow"),
        world={"bounds": [[-1, -9], [1, 9]]},
        solver={"dt": 0.03},
    )
    simulation = stepped(running(scene), 10)
    assert dict(simulation.retired) == {0: 4 * 0.03}
    frame = simulation.frame()
    assert frame.present.tolist() == [False, True]
    assert frame.velocity.tolist() == [[0, 0], [1, 0]]
    with pytest.raises(ActionError, match="removed"):
        simulation.apply(Impulse(time=0, body="fast", impulse=(1, 0)))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_who_is_thrown_beyond_all_bounds_diverges_and_can_be_read(integrator):
    scene = scene_of(ball(0, 0, name="still"), ball(9.9e15, 5, velocity=[9e11, 0], name="thrown"), solver={"dt": 10.0})
    simulation = running(scene, integrator=integrator)
    simulation.apply(Force(time=0, body="thrown", force=(9e10, 0.0)))
    with pytest.raises(Divergence, match="'thrown' is not finite, or is out of range") as told:
        stepped(simulation, 100_000)
    assert told.value.body == "thrown"
    frame = simulation.frame()
    assert frame.position[1, 0] > 1e17 or frame.velocity[1, 0] > 1e13
    assert simulation.frame().position[0].tolist() == [0, 0]
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()


BAD = [
    Impulse(time=0, body="nobody", impulse=(1, 0)),
    Impulse(time=0, body="rock", impulse=(1, 0)),
    Impulse(time=0, body="a", impulse=(1e42, 0)),
    Force(time=0, body="rock", force=(1, 0)),
    Move(time=0, body="a", position=(0, -2000)),
    Move(time=0, body="rock", position=(0, 1), velocity=(1, 0)),
    Spawn(time=0, ball=Ball(name="a", position=(0, 9), radius=1.0)),
    Spawn(time=0, ball=Ball(name="z", position=(0, -1e6), radius=1.0)),
    SetParameter(time=0, path="world.duration", value=3.0),
    SetParameter(time=0, path="material.m.restitution", value=2.0),
    Remove(time=0, body="nobody"),
]


@pytest.mark.parametrize("number", range(len(BAD)))
def test_what_cannot_be_done_changes_nothing(number):
    tried, other = stepped(running(mixed()), 20), stepped(running(mixed()), 20)
    with pytest.raises(ActionError):
        tried.apply(BAD[number])
    assert stepped(tried, 30).state_hash() == stepped(other, 30).state_hash()


def test_an_action_elsewhere_does_not_disturb_what_is_pushed_apart():
    """Overlap goes on being undone at the same pace, whatever is done to others meanwhile."""
    scene = scene_of(
        ball(0, 0.4, name="deep"), ball(9, 9, collides="none", name="far"), world=EARTH, plane=[FLOOR],
        solver={"dt": 0.01},
    )  # fmt: skip
    alone, poked = running(scene), running(scene)
    for _ in range(20):
        poked.apply(Impulse(time=0, body="far", impulse=(0.1, 0)))
        assert np.array_equal(stepped(poked, 1).frame().position[0], stepped(alone, 1).frame().position[0])


@pytest.mark.parametrize("detection", DETECTIONS)
def test_spawned_and_removed_balls_meet_and_no_longer_meet(detection):
    scene = scene_of(ball(0, 0.495, name="base"), world=EARTH, plane=[FLOOR], solver={"dt": 0.01})
    simulation = running(scene, detection=detection)
    simulation.apply(Spawn(time=0, ball=Ball(name="new", position=(0, 1.6), radius=0.5)))
    stepped(simulation, 150)
    assert simulation.frame().position[1, 1] == pytest.approx(1.485, abs=0.01)  # slops of two contacts
    simulation.apply(Remove(time=0, body="base"))
    stepped(simulation, 150)
    assert simulation.frame().position[1, 1] == pytest.approx(0.495, abs=0.01)  # it fell through where that was
    assert list(simulation.retired) == [0]


@pytest.mark.parametrize("place", [1e3, 1e6, 1e9, 1e12, 1e16])
def test_far_places_are_finite_and_bounded(place):
    scene = scene_of(ball(place, 0, velocity=[1, 0]), ball(place, 0, radius=2.0), solver={"dt": 0.01})
    for name in BROAD_PHASES:
        frame = stepped(running(scene, broad_phase=name), 30).frame()
        assert np.abs(frame.position - [place, 0]).max() <= max(5.0, 4 * np.spacing(place))
        assert np.abs(frame.velocity).max() <= 1.0 + 1e-12


@pytest.mark.parametrize("detection", DETECTIONS)
@pytest.mark.parametrize(("light", "heavy"), [(1e-15, 1e30), (1e-15, 1e-15), (1e30, 1e30), (1.0, 1e12)])
def test_masses_of_any_size_bounce_off_each_other(light, heavy, detection):
    scene = scene_of(
        ball(-1.1, 0, velocity=[5, 0], mass=light, material="m"),
        ball(0, 0, mass=heavy, material="m"),
        material=[{"name": "m"}],
        pair=[{"between": ["m", "m"], "restitution": 1.0}],
        solver={"dt": 0.01},
    )
    velocity = stepped(running(scene, detection=detection), 20).frame().velocity[:, 0]
    total = light + heavy
    assert velocity[0] == pytest.approx((light - heavy) / total * 5, abs=1e-12)  # some roundings
    assert velocity[1] == pytest.approx(2 * light / total * 5, rel=1e-12)  # likewise


@pytest.mark.parametrize("detection", ["discrete", "swept", "bisect"])
def test_the_smallest_balls_land_too(detection):
    scene = scene_of(ball(0, 3e-9, radius=1e-9, mass=1e-15), world=EARTH, plane=[FLOOR], solver={"dt": 1e-6})
    y = stepped(running(scene, detection=detection), 300).frame().position[0, 1]
    assert y == pytest.approx(1e-9, abs=1e-10)  # the slop, a hundredth of the radius, and what settles


def test_the_engine_chooses_what_suits():
    def chosen(scene):
        return running(scene).settings

    unlike = [ball(2 * k, 0, radius=0.01 if k else 0.9, name=f"b{k}") for k in range(30)]
    settings = chosen(scene_of(*unlike))
    for scene in (small_pile(12), small_pile(60), scene_of(*unlike)):
        assert chosen(scene).broad_phase in BROAD_PHASES
    assert chosen(small_pile(60)).broad_phase != "all_pairs"  # 1,770 pairs, of which some 120 are near
    assert settings.broad_phase != "grid"  # all would be in one cell of the largest ball
    assert (settings.integrator, settings.detection, settings.response) == ("explicit_euler", "discrete", "impulse")
    assert settings.slop == pytest.approx(1e-4, rel=1e-12)  # a product
    springs = running(mixed(), response="penalty").settings
    assert springs.integrator == "semi_implicit_euler"
    assert springs.stiffness is not None


def test_what_is_stated_is_kept():
    stated = {"slop": 0.02, "bias": 0.5, "iterations": 3, "broad_phase": "sweep", "integrator": "rk4"}
    settings = running(mixed(), **stated).settings
    assert {key: getattr(settings, key) for key in stated} == stated


def test_work_is_counted():
    simulation = running(mixed(), broad_phase="circles")
    stepped(simulation, 60)
    work = simulation.work
    assert work["substeps"] == 120
    assert work["broad_tests"] >= 120 * 6  # pairs that may meet: a, b, c with each other, and with the rock
    assert 0 < work["contacts"] <= work["pair_tests"]


def test_a_scene_of_nothing_runs():
    simulation = stepped(running(scene_of(plane=[FLOOR])), 3)
    assert simulation.frame().position.shape == (0, 2)
    assert len(simulation.contacts()) == 0
