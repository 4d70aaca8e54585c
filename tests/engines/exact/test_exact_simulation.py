"""The exact engine as a simulation: frames, contacts, actions, refusals, bounds."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

from sandbox.action import ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.registry import start
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

G = 9.81

MIXED_SCENE = {
    "world": {"gravity": [0.3, -G]},
    "material": [{"name": "m", "restitution": 0.7, "friction": 0.3}],
    "plane": [{"point": [0, -1], "normal": [0.1, 1], "material": "m"}],
    "wall": [{"points": [[-3, 4], [-3, -0.4], [0, -0.2], [3, -1], [3, 4]], "thickness": 0.1, "material": "m"}],
    "post": [{"position": [0.3, 1.0], "radius": 0.3, "material": "m"}],
    "ball": [
        {"position": [-1.0, 2.0], "velocity": [2, 0], "radius": 0.2, "mass": 2.0, "material": "m"},
        {"position": [0.1, 2.0], "radius": 0.15, "angular_velocity": 20, "material": "m"},
        {"position": [1.5, 1.0], "velocity": [-3, 1], "radius": 0.25, "material": "m"},
        {"position": [-2.0, 1.0], "radius": 0.3, "fixed": True, "material": "m"},
        {"position": [2.0, 3.0], "radius": 0.1, "collides": "fixed", "material": "m"},
        {"position": [0.0, 3.0], "radius": 0.1, "collides": "none"},
    ],
}

BOUNCING_SCENE = {
    "world": {"gravity": [0, -G]},
    "plane": [{"point": [0, 0], "normal": [0, 1], "friction": 0.4}],
    "ball": [{"position": [0, 1.5], "velocity": [1, 0], "radius": 0.5, "restitution": 0.5}],
}


def simulation_of(document, dt=0.01):
    return ExactEngine().start(from_document({**document, "solver": {"dt": dt}}))


@pytest.mark.parametrize("document", [MIXED_SCENE, BOUNCING_SCENE])
def test_frames_are_bit_identical_for_any_dt(document):
    # 2⁻⁸ and 2⁻²: both reach 1.5 s without rounding.
    fine, coarse = advance(simulation_of(document, 2.0**-8), 384), advance(simulation_of(document, 0.25), 6)
    assert fine.time == coarse.time == 1.5
    assert fine.state_hash() == coarse.state_hash()


def test_action_has_the_same_effect_for_any_dt():
    hashes = set()
    for dt, steps in ((2.0**-8, 128), (0.25, 2)):
        simulation = advance(simulation_of(MIXED_SCENE, dt), steps)
        simulation.apply(Impulse(time=0.5, body="ball-1", impulse=(1.0, 2.0), angular=0.1))
        hashes.add(advance(simulation, 2 * steps).state_hash())
    assert len(hashes) == 1


@pytest.mark.parametrize("document", [MIXED_SCENE, BOUNCING_SCENE])
def test_contact_impulses_sum_to_the_momentum_change(document):
    simulation = simulation_of(document)
    simulation.contacts()
    contacts, frame = advance(simulation, 200).contacts(), simulation.frame()
    mass, gravity = simulation.bodies.mass[:, None], np.array(document["world"]["gravity"])
    expected = mass * (simulation.bodies.velocity + gravity * simulation.time) * ~simulation.bodies.fixed[:, None]
    momentum = mass * frame.velocity
    for (first, second), impulse in zip(contacts.pair.tolist(), contacts.impulse, strict=True):
        momentum[first] += impulse * (not simulation.bodies.fixed[first])
        if second >= 0:
            momentum[second] -= impulse * (not simulation.bodies.fixed[second])
    # relative to the impulse of the weight
    assert momentum == pytest.approx(expected, abs=1e-12 * 2 * G * simulation.time)


def test_first_query_returns_resting_contacts():
    simulation = advance(simulation_of(BOUNCING_SCENE), 300)
    contacts = simulation.contacts()
    assert contacts.pair.tolist() == [[0, -1]]
    assert contacts.time.tolist() == [3.0]
    later = advance(simulation, 100).contacts()
    assert later.time.tolist() == [3.0]
    assert later.impulse[0] == pytest.approx([0, -G], abs=1e-13)  # its weight over one second


@pytest.mark.parametrize("count", [2, 3, 5])
def test_touching_balls_in_a_line_transfer_momentum(count):
    row = [{"position": [0.2 * k, 0], "radius": 0.1, "restitution": 1} for k in range(5)]
    moving = {"velocity": [1, 0], "radius": 0.1, "restitution": 1}
    row += [{"position": [-1.0 - 0.2 * k, 0], **moving} for k in range(count)]
    simulation = advance(simulation_of({"ball": row}), 300)
    speeds = np.sort(simulation.frame().velocity[:, 0])
    assert speeds == pytest.approx([0.0] * 5 + [1.0] * count, abs=1e-14)  # k balls in, k balls out, to rounding


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.3, 0.0])
def test_symmetric_rack_breaks_without_hanging_and_conserves_momentum(restitution):
    rack = [
        {"position": [0.1 * math.sqrt(3) * r * (1 + 1e-15), 0.2 * (k - r / 2)], "radius": 0.1}
        for r in range(5)
        for k in range(r + 1)
    ]
    balls = [{"position": [-1, 0], "velocity": [3, 0], "radius": 0.1}, *rack]
    simulation = simulation_of({"ball": [{**ball, "restitution": restitution} for ball in balls]})
    advance(simulation, 300)
    velocity = simulation.frame().velocity
    assert velocity.sum(axis=0) == pytest.approx([3.0, 0.0], abs=3e-14)  # rounding of some hundred impacts
    energy = float((velocity**2).sum())
    assert energy == pytest.approx(9.0, rel=1e-13) if restitution == 1.0 else energy < 9.0
    frame = simulation.frame().position
    distances = np.hypot(*(frame[:, None] - frame[None]).transpose(2, 0, 1))[np.triu_indices(16, 1)]
    assert distances.min() > 0.2 - 1e-12  # no overlap beyond rounding


def test_pile_finishes_or_is_exhausted_with_a_reason():
    wall = {"points": [[-1, 4], [-1, 0], [1, 0], [1, 4]], "restitution": 0.3, "friction": 0.3}
    balls = [
        {"position": [-0.8 + 0.3 * (k % 6) + 0.02 * (k // 6), 0.2 + 0.31 * (k // 6)], "radius": 0.1} for k in range(30)
    ]
    balls = [{**ball, "restitution": 0.5, "friction": 0.3} for ball in balls]
    simulation = simulation_of({"world": {"gravity": [0, -G]}, "wall": [wall], "ball": balls}, dt=0.02)
    try:
        advance(simulation, 10)
    except Exhaustion as exhaustion:
        assert "events within" in str(exhaustion)
        assert "pymunk, reference" in str(exhaustion)
        with pytest.raises(RuntimeError, match="has ended"):
            simulation.step()
    assert np.isfinite(simulation.frame().position).all()


def test_pile_with_too_many_events_is_exhausted_early(monkeypatch):
    monkeypatch.setattr("sandbox.engines.exact.simulation.PER_SECOND", 20_000)  # low: fast uncompiled
    monkeypatch.setattr("sandbox.engines.exact.simulation.PER_SECOND_AND_BALL", 1)
    normals = {(0, 0): [0, 1], (-0.001, 0): [1, 0], (1.27, 0): [-1, 0]}
    walls = [{"point": list(point), "normal": normal, "friction": 1.0} for point, normal in normals.items()]
    positions = [[0.056 + 0.105 * (k % 12), 0.05 + (0.1 + 1e-6) * (k // 12)] for k in range(120)]
    balls = [{"position": position, "radius": 0.05, "restitution": 0.0, "friction": 1.0} for position in positions]
    simulation = simulation_of({"world": {"gravity": [0, -G]}, "plane": walls, "ball": balls}, dt=0.01)
    with pytest.raises(Exhaustion, match=r"5,000 events within 0.0312 s where the limit is 20,000 per second"):
        advance(simulation, 100)
    # Two batches of an eighth of the budget each, after at most one slower batch.
    assert simulation.events < 10_000


def test_too_fast_ball_exhausts_the_simulation(monkeypatch):
    monkeypatch.setattr("sandbox.engines.exact.simulation.PER_SECOND", 20_000)
    walls = [{"point": [0, 0], "normal": [1, 0]}, {"point": [0.3, 0], "normal": [-1, 0]}]
    ball = {"position": [0.15, 0], "velocity": [1e9, 0], "radius": 0.1, "restitution": 1}
    simulation = simulation_of({"plane": walls, "ball": [ball]}, dt=1.0)
    with pytest.raises(Exhaustion, match=r"5,000 events within 0\.0312 s .*, last of 'ball-1' and 'plane-"):
        simulation.step()


def test_refusals_name_the_missing_feature_and_a_supporting_engine():
    drag = from_document({**BOUNCING_SCENE, "world": {"gravity": [0, -G], "linear_drag": 0.1}})
    with pytest.raises(Refusal, match=r"^exact .* drag.*pymunk"):
        start(drag, "exact")
    scene, engine = from_document(BOUNCING_SCENE), ExactEngine()
    for choice in (
        {"integrator": "rk4"},
        {"slop": 0.01},
        {"stiffness": 1e3},
        {"half_kick": True},
        {"broad_phase": "grid"},
    ):
        (reason,) = engine.missing(scene, scene.solver.replace(**choice))
        assert next(iter(choice)) in reason
        assert "remove it" in reason
    assert engine.missing(scene, scene.solver.replace(substeps=7, iterations=3)) == ()


def test_overlaps_are_refused_but_touching_bodies_are_not():
    def balls(gap, **more):
        pair = [{"position": [0, 0], "radius": 0.5}, {"position": [1 + gap, 0], "radius": 0.5, **more}]
        return from_document({"ball": pair})

    engine = ExactEngine()
    (reason,) = engine.missing(balls(-0.1), balls(0).solver)
    assert reason.startswith("'ball-1' and 'ball-2' overlap by 0.1 m")
    assert engine.missing(balls(-1e-10), balls(0).solver) == ()
    assert engine.missing(balls(-0.1, collides="fixed"), balls(0).solver) == ()
    sunk = from_document({**BOUNCING_SCENE, "ball": [{"position": [0, 0.4], "radius": 0.5}]})
    (reason,) = engine.missing(sunk, sunk.solver)
    assert "'ball-1' and 'plane-1' overlap by 0.1 m" in reason


def test_invalid_actions_change_nothing():
    simulation = advance(simulation_of(MIXED_SCENE), 5)
    before = simulation.state_hash()
    for action, message in (
        (Force(time=0, body="ball-1", force=(1.0, 0.0)), "pymunk and reference"),
        (Move(time=0, body="ball-1", position=(0.3, 1.0)), "overlap"),
        (Spawn(time=0, ball=Ball(position=(0.3, 1.0), radius=0.1)), "overlap"),
        (SetParameter(time=0, path="world.linear_drag", value=0.1), "drag"),
        (Remove(time=0, body="nobody"), "nobody"),
    ):
        with pytest.raises(ActionError, match=message):
            simulation.apply(action)
        assert simulation.state_hash() == before


def test_upward_gravity_lifts_a_resting_ball_off_the_floor():
    simulation = advance(simulation_of(BOUNCING_SCENE), 400)
    rolling = simulation.frame().velocity[0].copy()
    simulation.apply(SetParameter(time=4.0, path="world.gravity", value=[0.0, 1.0]))
    frame = advance(simulation, 100).frame()
    assert frame.velocity[0] == pytest.approx([rolling[0], 1.0], abs=1e-15)  # it rises from the floor
    assert frame.position[0, 1] == pytest.approx(1.0, abs=1e-14)


def test_moved_and_spawned_balls_collide_at_their_new_positions():
    balls = [{"position": [0, 0], "velocity": [1, 0], "radius": 0.5, "restitution": 1}]
    simulation = simulation_of({"ball": balls})
    simulation.apply(Spawn(time=0, ball=Ball(name="new", position=(2.0, 0.0), radius=0.5, restitution=1.0)))
    advance(simulation, 150)
    assert simulation.frame().velocity[:, 0].tolist() == [0.0, 1.0]
    assert simulation.frame().position[:, 0] == pytest.approx([1.0, 2.5], abs=1e-15)
    simulation.apply(Move(time=1.5, body="ball-1", position=(5.0, 0.0)))
    advance(simulation, 200)
    assert simulation.frame().velocity[:, 0].tolist() == [1.0, 0.0]
    simulation.apply(Remove(time=3.5, body="new"))
    frame = simulation.frame()
    assert frame.present.tolist() == [True, False]
    assert dict(simulation.retired) == {1: 3.5}


PROGRAM = """
import json, sys
from sandbox.engines.exact.engine import ExactEngine
from sandbox.scene.files.load import from_document
for document, steps in json.loads(sys.stdin.read()):
    simulation = ExactEngine().start(from_document(document))
    simulation.contacts()
    for _ in range(steps):
        simulation.step()
    contacts = simulation.contacts()
    print(simulation.state_hash(), contacts.time.tobytes().hex()[:4000], contacts.impulse.sum(axis=0).tolist())
"""


@pytest.mark.fail_slow(60)  # takes over half a second
def test_compiled_and_plain_kernels_agree_bit_for_bit():
    import json

    random = np.random.default_rng(7)
    gas = {
        "wall": [{"points": [[0, 0], [4, 0], [4, 4], [0, 4]], "closed": True, "restitution": 1.0}],
        "ball": [
            {"position": [0.5 + k % 4, 0.5 + k // 4], "velocity": random.normal(size=2).tolist(), "radius": 0.25}
            for k in range(16)
        ],
    }
    incline = {**BOUNCING_SCENE, "plane": [{"point": [0, 0], "normal": [0.5, 0.8660254037844386], "friction": 0.5}]}
    cases = json.dumps([[BOUNCING_SCENE, 300], [gas, 200], [incline, 200], [MIXED_SCENE, 150]])
    outputs = set()
    for disabled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        process = subprocess.run(
            [sys.executable, "-c", PROGRAM], input=cases, env=environment, capture_output=True, text=True, check=True
        )
        outputs.add(process.stdout)
    assert len(outputs) == 1
    assert len(outputs.pop().splitlines()) == 4
