"""Reference engine against pymunk: with explicit_euler, discrete and impulse it implements pymunk's scheme.

The engines differ under drag, which the pymunk adapter applies by exponential steps, and where contacts share a body:
pymunk solves them in the order of its tree, the reference by ascending body index, and ten iterations leave different
residuals. For contacts that share no body the order has no effect. Chaos amplifies any difference in order or rounding
(pymunk's planes are long segments whose normals have errors of 1e-13): in a gas differences about double with every
collision, and no agreement is left after tens of collisions per ball.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.scene.description.discs import Ball
from tests.engines.builders import EARTH, FLOOR, PYMUNK_SETTINGS, ball, scene_of, shipped, side_by_side, simulation_of
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples


def difference(theirs, ours):
    """Return the largest difference between two frames, m, m/s, rad or rad/s."""
    a, b = theirs.frame(), ours.frame()
    assert a.time == b.time
    assert np.array_equal(a.present, b.present)
    pairs = (a.position, b.position), (a.velocity, b.velocity), (a.angle, b.angle)
    return max(float(np.abs(x - y).max()) for x, y in (*pairs, (a.angular_velocity, b.angular_velocity)))


def bit_identical(theirs, ours):
    a, b = theirs.frame(), ours.frame()
    pairs = (a.position, b.position), (a.velocity, b.velocity), (a.angle, b.angle)
    return all(np.array_equal(x, y) for x, y in (*pairs, (a.angular_velocity, b.angular_velocity)))


coordinates, speeds = st.floats(-1e6, 1e6), st.floats(-1e4, 1e4)


@given(
    st.lists(st.tuples(coordinates, coordinates, speeds, speeds, st.floats(-50, 50)), min_size=1, max_size=5),
    st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
    st.floats(1e-5, 0.5),
    st.integers(1, 4),
    st.sampled_from(["none", "all"]),
)
def test_free_flight_is_bit_identical(states, gravity, dt, substeps, collides):
    balls = [
        # far enough apart to never collide where collisions are enabled
        ball(x + (1e9 * k if collides == "all" else 0.0), y, velocity=[vx, vy], angular_velocity=w, collides=collides)
        for k, (x, y, vx, vy, w) in enumerate(states)
    ]
    scene = scene_of(*balls, world={"gravity": list(gravity)}, solver={"dt": dt, "substeps": substeps})
    assert all(bit_identical(theirs, ours) for theirs, ours in side_by_side(scene, 10))


STEPS = {
    "tutorial/bounce": 6000,
    "benchmark/two_balls": 1000,
    "benchmark/newtons_cradle": 1000,
    "benchmark/incline": 2000,
}


@pytest.mark.parametrize("name", STEPS)
def test_shipped_scenes_agree_at_every_frame(name):
    # m, m/s and rad after seconds of contact: different rounding adds up to 1e-13 on the incline
    assert max(difference(*both) for both in side_by_side(shipped(name), STEPS[name])) < 1e-12


def test_gas_agrees_for_its_first_second():
    # 225 balls and about 150 impacts: each amplifies differences, and almost no ball has had five
    assert max(difference(*both) for both in side_by_side(shipped("benchmark/gas"), 200)) < 1e-9


def test_pile_agrees_until_contacts_share_bodies():
    """Contacts that share bodies are solved in another order: agreement to the residual of ten iterations."""
    balls = [ball(0.51 * (k % 2), 0.52 + 0.9 * k, name=f"b{k}", restitution=0.1) for k in range(6)]
    walls = [{"point": [-0.6, 0], "normal": [1, 0]}, {"point": [1.1, 0], "normal": [-1, 0]}, FLOOR]
    scene = scene_of(*balls, world=EARTH, plane=walls, solver={"dt": 0.005})
    differences = []
    for theirs, ours in side_by_side(scene, 800):
        differences.append(difference(theirs, ours))
    assert max(differences[:20]) < 1e-12  # one contact per ball so far: rounding
    assert max(differences) > 1e-6
    # Both end at rest in the same order, each contact within the slop of 5 mm.
    assert np.abs(theirs.frame().position - ours.frame().position).max() < 0.01
    assert np.abs(ours.frame().velocity).max() < 1e-9  # m/s; settled


@given(
    st.floats(-3, 3), st.floats(-8, 0), st.floats(-20, 20), st.floats(0, 1), st.floats(0, 2), st.floats(0.1, 3),
    st.floats(-0.5, 0.5),
)  # fmt: skip
def test_single_ball_on_a_slope_agrees(vx, vy, spin, e, mu, mass, tilt):
    slope = {"point": [0, 0], "normal": [math.sin(tilt), math.cos(tilt)], "friction": mu}
    thrown = ball(0, 1.0, velocity=[vx, vy], angular_velocity=spin, restitution=e, mass=mass)
    scene = scene_of(thrown, world=EARTH, plane=[slope], solver={"dt": 0.01})
    # pymunk's plane is a segment of about 1e4 m, with an error of 1e-13 in its normal
    assert max(difference(*both) for both in side_by_side(scene, 40)) < 1e-9


@given(st.floats(-0.4, 0.4), st.floats(1, 5), st.floats(0, 1), st.floats(0, 1), st.floats(0.01, 100))
def test_two_balls_with_friction_agree_to_rounding(offset, speed, e, mu, mass):
    stuff = {"material": [{"name": "m"}], "pair": [{"between": ["m", "m"], "restitution": e, "friction": mu}]}
    balls = [
        ball(-1.5, offset, velocity=[speed, 0], angular_velocity=3.0, material="m"),
        ball(0, 0, mass=mass, material="m"),
    ]
    scene = scene_of(*balls, **stuff, solver={"dt": 0.01})
    # rounding, amplified by the mass ratio
    assert max(difference(*both) for both in side_by_side(scene, 100)) < 1e-10


def run_with_actions(actions):
    """Run a mixed scene on both engines, apply each action at the start of its step, and yield both after each step."""
    rubber = {"material": [{"name": "rubber", "restitution": 0.5, "friction": 0.3}]}
    balls = [
        ball(-3, 2, name="a", material="rubber"),
        ball(0, 0.4975, name="b", material="rubber"),
        ball(3, 2, name="c", mass=2.0, material="rubber"),
    ]
    scene = scene_of(
        *balls, **rubber, world={**EARTH, "bounds": [[-50, -50], [50, 50]]}, plane=[FLOOR], solver={"dt": 0.005}
    )
    theirs, ours = simulation_of(scene, "pymunk"), simulation_of(scene, **PYMUNK_SETTINGS)
    for k in range(200):
        for action in actions.get(k, ()):
            theirs.apply(action)
            ours.apply(action)
        theirs.step()
        ours.step()
        yield theirs, ours


NEW = Ball(name="new", position=(-5.0, 3.0), velocity=(1.0, 0.0), radius=0.3, restitution=0.2)

SESSIONS = {
    "impulse": {20: [Impulse(time=0, body="b", impulse=(1.0, 3.0), angular=0.4)]},
    "force": {20: [Force(time=0, body="b", force=(2.0, 0.0), torque=0.1)], 90: [Force(time=0, body="b", force=(0, 0))]},
    "move": {20: [Move(time=0, body="a", position=(-6.0, 4.0), velocity=(0.5, 0.0))]},
    "move, and keep moving": {20: [Move(time=0, body="c", position=(6, 1))]},
    "spawn": {20: [Spawn(time=0, ball=NEW)]},
    "remove": {20: [Remove(time=0, body="a")], 40: [Remove(time=0, body="c")]},
    "gravity": {20: [SetParameter(time=0, path="world.gravity", value=[1.0, -5.0])]},
    "drag": {20: [SetParameter(time=0, path="world.linear_drag", value=0.3)]},
    "restitution": {5: [SetParameter(time=0, path="material.rubber.restitution", value=0.9)]},
    "friction": {5: [SetParameter(time=0, path="material.rubber.friction", value=0.0)]},
    "leaving": {20: [Impulse(time=0, body="a", impulse=(-200.0, 0.0))]},
}  # fmt: skip


@pytest.mark.parametrize("name", SESSIONS)
def test_actions_have_the_same_effect(name):
    differences = [difference(*both) for both in run_with_actions(SESSIONS[name])]
    if name == "drag":
        # first-order difference: the pymunk adapter applies drag by an exponential step, the reference by an Euler step
        assert 1e-6 < max(differences) < 0.005
    else:
        assert max(differences) < 1e-9  # rounding of pymunk's planes, small because there are few contacts


def test_body_that_leaves_the_bounds_retires_at_the_same_time():
    for theirs, ours in run_with_actions(SESSIONS["leaving"]):
        assert dict(theirs.retired) == dict(ours.retired)
    assert list(ours.retired) == [0]


@pytest.mark.parametrize("name", STEPS)
def test_contact_rows_agree(name):
    scene = shipped(name)
    rows = []
    for simulation in (simulation_of(scene, "pymunk"), simulation_of(scene, **PYMUNK_SETTINGS)):
        simulation.contacts()
        rows.append(advance(simulation, STEPS[name]).contacts())
    theirs, ours = rows
    assert theirs.pair.tolist() == ours.pair.tolist()
    assert theirs.time.tolist() == ours.time.tolist()
    assert np.abs(theirs.normal - ours.normal).max() < 1e-12  # pymunk's planes: see above
    assert np.abs(theirs.point - ours.point).max() < 1e-11  # as above, on a segment of some 1e4 m
    assert np.abs(theirs.impulse - ours.impulse).max() < 1e-11  # sums over 2,000 steps
