"""Resting, rolling and sliding contact against closed forms."""

import math

import pytest

from sandbox.engines.exact.engine import ExactEngine
from sandbox.scene.files.load import from_document

G = 9.81


def simulation_of(document, dt=0.01):
    return ExactEngine().start(from_document({"world": {"gravity": [0, -G]}, "solver": {"dt": dt}, **document}))


def advance(simulation, seconds):
    for _ in range(round(seconds / simulation.settings.dt)):
        simulation.step()
    return simulation.frame()


def test_sliding_disc_rolls_after_v_over_3_mu_g():
    floor = {"point": [0, 0], "normal": [0, 1], "friction": 0.2}
    simulation = simulation_of({"plane": [floor], "ball": [{"position": [0, 0.5], "velocity": [3, 0], "radius": 0.5}]})
    frame = advance(simulation, 2.0)
    end = 3 / (3 * 0.2 * G)
    distance = 3 * end - 0.1 * G * end**2 + 2 * (2 - end)
    assert frame.velocity[0] == pytest.approx([2.0, 0.0], abs=1e-14)  # rounding of a few operations, likewise below
    assert frame.angular_velocity[0] == pytest.approx(-4.0, abs=1e-14)
    assert frame.position[0] == pytest.approx([distance, 0.5], abs=1e-14)
    assert simulation.events == 2  # the start of contact and of rolling


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_ball_comes_to_rest_in_a_corner(friction):
    rough = {"friction": friction, "restitution": 0.5}
    planes = [{"point": [0, 0], "normal": [-1, 1], **rough}, {"point": [0, 0], "normal": [1, 1.5], **rough}]
    ball = {"position": [0.3, 3], "radius": 0.5, "angular_velocity": 30}
    simulation = simulation_of({"plane": planes, "ball": [ball]})
    simulation.contacts()
    advance(simulation, 8.0)
    earlier = simulation.contacts()
    frame = advance(simulation, 2.0)
    assert frame.velocity[0].tolist() == [0, 0]
    assert frame.angular_velocity[0] == (30.0 if friction == 0 else 0.0)
    x, y = frame.position[0]
    assert (y - x) / math.sqrt(2) == pytest.approx(0.5, abs=1e-12)  # truncation of two series of bounces
    assert (x + 1.5 * y) / math.hypot(1, 1.5) == pytest.approx(0.5, abs=1e-12)
    later = simulation.contacts()
    assert len(later) == 2
    assert later.impulse.sum(axis=0) == pytest.approx([0, -2 * G], abs=1e-13)  # its weight over two seconds
    assert set(later.time) <= set(earlier.time)


def test_ball_rolls_over_a_joint_and_off_the_end():
    wall = {"points": [[-1, 0], [0, 0], [1, 0]], "thickness": 0.1, "friction": 0.3}
    ball = {"position": [-0.9, 0.15], "velocity": [3.0, 0], "angular_velocity": -30.0, "radius": 0.1}
    simulation = simulation_of({"wall": [wall], "ball": [ball]})
    simulation.contacts()
    frame = advance(simulation, 1.0)
    flight = 1.0 - 1.9 / 3.0
    # v² > g (r + half the thickness): it leaves at once. The error is a hop of 5e-4 m/s at the end of the wall.
    assert frame.position[0] == pytest.approx([1 + 3 * flight, 0.15 - G * flight**2 / 2], abs=1e-3)
    assert simulation.contacts().pair[0].tolist() == [0, -1]


def test_ball_on_top_of_a_post_hops_in_place():
    post = {"position": [0, 0], "radius": 0.5, "restitution": 0.5}
    frame = advance(simulation_of({"post": [post], "ball": [{"position": [0, 2], "radius": 0.3}]}), 2.0)
    assert frame.position[0] == pytest.approx([0, 0.8], abs=1.3e-8)  # v²/2g of one hop
    assert abs(frame.velocity[0, 1]) <= 5e-4


def test_resting_ball_is_knocked_off_the_floor_and_lands_again():
    floor = {"point": [0, 0], "normal": [0, 1]}
    balls = [
        {"position": [0, 0.5], "radius": 0.5, "restitution": 0.5},
        {"position": [0.5, 3.0], "radius": 0.5, "restitution": 0.5, "velocity": [0, -2]},
    ]
    frame = advance(simulation_of({"plane": [floor], "ball": balls}), 5.0)
    assert frame.position[:, 1] == pytest.approx([0.5, 0.5], abs=1e-12)  # both rest again, up to truncation
    assert frame.velocity[0, 0] + frame.velocity[1, 0] == pytest.approx(0.0, abs=1e-14)  # frictionless floor: rounding


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_ball_hits_a_resting_ball_after_the_closed_form_time(speed):
    floor = {"point": [0, 0], "normal": [0, 1]}
    resting = {"position": [0, 0.5], "radius": 0.5, "restitution": 0.5}
    falling = {"position": [0.6, 3.3], "radius": 0.5, "restitution": 0.5, "velocity": [0, -speed]}
    simulation = simulation_of({"plane": [floor], "ball": [resting, falling]})
    simulation.contacts()
    advance(simulation, 1.0)
    found = simulation.contacts()
    height = 3.3 - 0.5 - 0.8  # to where the centres, 0.6 m apart across, are 1 m apart
    expected = (math.sqrt(speed**2 + 2 * G * height) - speed) / G
    assert found.time[(found.pair == [0, 1]).all(axis=1)][0] == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("gravity", [[3.0, -9.0], [-3.0, -9.0], [0.0, -9.0], [9.0, -9.0]])
@pytest.mark.parametrize("normal", [[0.28, 0.96], [-0.28, 0.96], [0.0, 1.0]])
def test_ball_thrown_off_a_plane_returns_after_the_closed_form_time(gravity, normal):
    plane = {"point": [0, 0], "normal": normal}
    start, speed = [0.5 * n for n in normal], 4.0
    ball = {"position": start, "velocity": [speed * n for n in normal], "radius": 0.5}
    simulation = simulation_of({"world": {"gravity": gravity}, "plane": [plane], "ball": [ball]})
    simulation.contacts()
    expected = 2 * speed / -(gravity[0] * normal[0] + gravity[1] * normal[1])
    advance(simulation, expected + 0.1)
    assert simulation.contacts().time[0] == pytest.approx(expected, rel=1e-13)
