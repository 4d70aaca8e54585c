"""Kinematic drives: plungers and strokes, and the balls that they push."""

import math

import numpy as np
import pytest

from tests.engines.flippers import BALL_RADIUS, ball, press, scene
from tests.engines.stepping import advance

every_engine = pytest.mark.parametrize("engine", ["pymunk", "box2d", "reference"], indirect=True, scope="module")
"""engines that model kinematic drives; the others of this folder's fixture model drives by torque as well"""

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

TRAVEL, SPEED = 0.043, 1.03  # m, m/s: of a pinball machine
RATE, RETURN_RATE = 20.0, 5.0  # rad/s


def gate(**keys):
    """Return the tables of a bar that a stroke drive turns about its left end by a quarter turn and back."""
    body = {"name": "gate", "size": [0.08, 0.02], "position": [0.04, 0.0], "restitution": 0.5}
    drive = {
        "kind": "stroke",
        "pivot": [0.0, 0.0],
        "stops": [0.0, 0.5 * math.pi],
        "rate": RATE,
        "return_rate": RETURN_RATE,
    }
    return {"box": [body], "drive": [{"name": "flip", "body": "gate", **drive, **keys}]}


def rod(**keys):
    """Return the tables of a plunger that strikes upwards from the origin."""
    body = {"name": "rod", "size": [0.02, 0.1], "position": [0.0, -0.05]}
    drive = {"kind": "plunger", "direction": [0.0, 2.0], "travel": TRAVEL, "speed": SPEED, "draw_time": 0.2}
    return {"box": [body], "drive": [{"name": "flip", "body": "rod", **drive, **keys}]}


@every_engine
def test_stroke_turns_at_its_rate_and_stops_on_its_stops(start):
    simulation = start(scene(gate()))
    press(simulation, 0.3)  # any level above 0 is a full stroke
    frame = advance(simulation, 30).frame()
    assert frame.angle[0] == pytest.approx(0.03 * RATE, rel=1e-12)
    assert frame.angular_velocity[0] == RATE
    frame = advance(simulation, 60).frame()  # 0.5 π / 20 = 78.5 ms
    assert (frame.angle[0], frame.angular_velocity[0]) == (0.5 * math.pi, 0.0)
    press(simulation, 0.0)
    frame = advance(simulation, 100).frame()
    assert frame.angle[0] == pytest.approx(0.5 * math.pi - 0.1 * RETURN_RATE, rel=1e-12)
    frame = advance(simulation, 300).frame()
    assert (frame.angle[0], frame.angular_velocity[0]) == (0.0, 0.0)
    assert frame.position[0] == pytest.approx([0.04, 0.0], abs=1e-15)


@every_engine
@pytest.mark.parametrize("return_rate", [None, 0.0])
def test_stroke_without_a_return_rate_holds_or_returns(start, return_rate):
    simulation = start(scene(gate(**({} if return_rate is None else {"return_rate": return_rate}))))
    press(simulation)
    advance(simulation, 10)
    press(simulation, 0.0)
    assert advance(simulation, 5).frame().angle[0] == pytest.approx(
        0.2 if return_rate == 0.0 else 0.2 - 5e-3 * RETURN_RATE, rel=1e-12
    )


@every_engine
def test_stroke_throws_a_ball_like_a_moving_wall(start):
    """V' = u + e u with u = ω r, the speed of the point that hits the ball at rest."""
    arm = 0.06
    simulation = start(scene(gate(), {"ball": [ball(arm, 0.01 + BALL_RADIUS + 0.0005, restitution=1.0)]}))
    press(simulation)
    frame = advance(simulation, 10).frame()
    # The impact is within the first step, at 0.02 rad.
    assert np.hypot(*frame.velocity[0]) == pytest.approx(1.5 * RATE * arm, rel=0.02)
    assert frame.angular_velocity[1] == RATE


@pytest.mark.parametrize("shape", ["box", "ball"])
def test_restitution_falls_with_the_speed_of_the_contact_point(start, shape):
    """E = e₀ / (1 + f v) with v = ω r, for a bar and for a disc that rotates about a hinge at 60 mm."""
    arm, falloff, e = 0.06, 0.5, 0.8
    coefficients = {"restitution": e, "restitution_falloff": falloff}
    tables = gate()
    tables["box"][0] |= coefficients
    y = 0.01 + BALL_RADIUS + 0.0305
    if shape == "ball":
        disc = {"name": "gate", "position": [arm, 0.0], "radius": 0.01, **coefficients}
        tables = {"ball": [disc], "drive": gate()["drive"]}
    balls = [*tables.get("ball", []), ball(arm, y)]
    simulation = start(scene(tables | {"ball": balls}, dt=1e-5, substeps=1))
    press(simulation)
    ball_index = len(balls) - 1
    for _ in range(10_000):
        simulation.step()
        if simulation.frame().velocity[ball_index].any():
            break
    advance(simulation, 2)
    frame = simulation.frame()
    gate_index = simulation.bodies.names.index("gate")
    # The contact point rotates about the hinge; the ball leaves along the normal, and the normal speed counts.
    normal = frame.velocity[ball_index] / np.hypot(*frame.velocity[ball_index])
    point = frame.position[ball_index] - normal * BALL_RADIUS
    speed = RATE * (point[0] * normal[1] - point[1] * normal[0])
    expected = speed * (1.0 + e / (1.0 + falloff * speed))
    # the gate has moved on for a few steps
    assert np.hypot(*frame.velocity[ball_index]) == pytest.approx(expected, rel=2e-3)
    assert frame.angular_velocity[gate_index] == RATE


@every_engine
def test_stroke_is_not_stopped_by_a_heavy_ball(start):
    simulation = start(scene(gate(), {"ball": [ball(0.05, 0.05, 0.0, -8.0, mass=100.0) | {"mass": 100.0}]}))
    frame = advance(simulation, 20).frame()
    assert (frame.angle[1], frame.angular_velocity[1]) == (0.0, 0.0)
    assert frame.velocity[0, 1] > 0.0


@every_engine
def test_plunger_is_drawn_at_its_draw_speed_and_stays(start):
    simulation = start(scene(rod()))
    press(simulation, 0.5)
    frame = advance(simulation, 50).frame()  # a quarter of the draw time of a full pull
    assert frame.position[0, 1] == pytest.approx(-0.05 - 0.25 * TRAVEL, rel=1e-12)
    assert frame.velocity[0, 1] == pytest.approx(-TRAVEL / 0.2, rel=1e-12)
    frame = advance(simulation, 100).frame()
    assert frame.position[0, 1] == pytest.approx(-0.05 - 0.5 * TRAVEL, rel=1e-15)
    assert not frame.velocity.any()
    press(simulation, 0.25)  # moved forward at the draw speed
    frame = advance(simulation, 100).frame()
    assert frame.position[0, 1] == pytest.approx(-0.05 - 0.25 * TRAVEL, rel=1e-15)


@every_engine
@pytest.mark.parametrize("pull", [0.25, 0.5, 1.0])
def test_released_plunger_follows_a_cosine(start, pull):
    simulation = start(scene(rod(), dt=1e-3))
    press(simulation, pull)
    advance(simulation, 250)
    press(simulation, 0.0)
    omega, fastest = SPEED / TRAVEL, 0.0
    for k in range(1, 100):
        frame = advance(simulation, 1).frame()
        angle = omega * k * 1e-3
        if angle >= 0.5 * math.pi:
            break
        drawn = -0.05 - frame.position[0, 1]
        assert drawn == pytest.approx(pull * TRAVEL * math.cos(angle), abs=1e-15)
        fastest = frame.velocity[0, 1]
    assert fastest == pytest.approx(pull * SPEED, rel=3e-3)  # at most a step before the end: 1 − cos(ω·1 ms)
    assert frame.position[0, 1] == -0.05
    assert not advance(simulation, 1).frame().velocity.any()


@every_engine
@pytest.mark.parametrize("pull", [0.25, 1.0])
def test_ball_on_a_plunger_leaves_at_the_speed_of_its_pull(start, pull):
    resting = ball(0.0, BALL_RADIUS + 1e-5, restitution=0.3)
    simulation = start(scene(rod(), {"ball": [resting]}, gravity=(0.0, -0.77)))
    press(simulation, pull)
    advance(simulation, 600)
    press(simulation, 0.0)
    fastest = max(advance(simulation, 1).frame().velocity[0, 1] for _ in range(100))
    # e times the plunger's gain in a step, 25 mm/s, and gravity
    assert fastest == pytest.approx(pull * SPEED, rel=0.03)


@every_engine
def test_driven_body_that_passes_a_wall_is_no_missed_contact(engine):
    """A plunger that springs through a wall at 40 mm a step: driven bodies pass walls by design."""
    import sandbox
    from sandbox.action import Drive

    walls = [{"points": [[-1.0, -0.15], [1.0, -0.15]]}]
    scene_with_wall = scene(rod(travel=0.2, speed=40.0), {"wall": walls})
    actions = tuple(Drive(time=time, drive="flip", level=level) for time, level in ((0.0, 1.0), (0.4, 0.0)))
    run = sandbox.run(scene_with_wall, engine, actions=actions)
    assert run.position[:, 0, 1].min() == pytest.approx(-0.25, rel=1e-12)
    assert (run.missed_contacts, len(run.contact_time)) == (0, 0)
