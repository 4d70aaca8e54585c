"""Drives that nothing stops: plungers and strokes, and the balls that they push."""

import math

import numpy as np
import pytest

from tests.engines.flippers import BALL, ball, press, scene

pytestmark = pytest.mark.full  # long runs and sweeps

TRAVEL, SPEED = 0.043, 1.03  # m, m/s: a pinball machine's
RATE, BACK = 20.0, 5.0  # rad/s


def gate(**keys):
    """The tables of a bar about its left end that is turned by a quarter, and back."""
    body = {"name": "gate", "size": [0.08, 0.02], "position": [0.04, 0.0], "restitution": 0.5}
    drive = {"kind": "stroke", "pivot": [0.0, 0.0], "stops": [0.0, 0.5 * math.pi], "rate": RATE, "return_rate": BACK}
    return {"box": [body], "drive": [{"name": "flip", "body": "gate", **drive, **keys}]}


def rod(**keys):
    """The tables of a plunger that strikes upwards from the origin."""
    body = {"name": "rod", "size": [0.02, 0.1], "position": [0.0, -0.05]}
    drive = {"kind": "plunger", "direction": [0.0, 2.0], "travel": TRAVEL, "speed": SPEED, "draw_time": 0.2}
    return {"box": [body], "drive": [{"name": "flip", "body": "rod", **drive, **keys}]}


def after(running, steps):
    for _ in range(steps):
        running.step()
    return running.frame()


def test_stroke_turns_at_its_rate_and_stops_on_its_stops(start):
    running = start(scene(gate()))
    press(running, 0.3)  # anything above 0 is all the way
    frame = after(running, 30)
    assert frame.angle[0] == pytest.approx(0.03 * RATE, rel=1e-12)
    assert frame.angular_velocity[0] == RATE
    frame = after(running, 60)  # 0.5 π / 20 = 78.5 ms
    assert (frame.angle[0], frame.angular_velocity[0]) == (0.5 * math.pi, 0.0)
    press(running, 0.0)
    frame = after(running, 100)
    assert frame.angle[0] == pytest.approx(0.5 * math.pi - 0.1 * BACK, rel=1e-12)
    frame = after(running, 300)
    assert (frame.angle[0], frame.angular_velocity[0]) == (0.0, 0.0)
    assert frame.position[0] == pytest.approx([0.04, 0.0], abs=1e-15)


@pytest.mark.parametrize("back", [None, 0.0])
def test_stroke_without_a_way_back_of_its_own(start, back):
    running = start(scene(gate(**({} if back is None else {"return_rate": back}))))
    press(running)
    after(running, 10)
    press(running, 0.0)
    assert after(running, 5).angle[0] == pytest.approx(0.2 if back == 0.0 else 0.2 - 5e-3 * BACK, rel=1e-12)


def test_ball_is_thrown_by_a_stroke_as_by_a_wall_that_moves(start):
    """V' = u + e u, u = ω r the speed of the place that hits a ball at rest."""
    arm = 0.06
    running = start(scene(gate(), {"ball": [ball(arm, 0.01 + BALL + 0.0005, restitution=1.0)]}))
    press(running)
    frame = after(running, 10)
    # The blow comes within the first step, 0.02 rad on
    assert np.hypot(*frame.velocity[0]) == pytest.approx(1.5 * RATE * arm, rel=0.02)
    assert frame.angular_velocity[1] == RATE


@pytest.mark.parametrize("shape", ["box", "ball"])
def test_restitution_falls_with_the_speed_of_the_place_that_hits(start, shape):
    """E = e₀ / (1 + f v), v = ω r: of a bar, and of a disc that goes about a hinge 60 mm off."""
    arm, falloff, e = 0.06, 0.5, 0.8
    own = {"restitution": e, "restitution_falloff": falloff}
    tables = gate()
    tables["box"][0] |= own
    y = 0.01 + BALL + 0.0305
    if shape == "ball":
        disc = {"name": "gate", "position": [arm, 0.0], "radius": 0.01, **own}
        tables = {"ball": [disc], "drive": gate()["drive"]}
    balls = [*tables.get("ball", []), ball(arm, y)]
    running = start(scene(tables | {"ball": balls}, dt=1e-5, substeps=1))
    press(running)
    which = len(balls) - 1
    for _ in range(10_000):
        running.step()
        if running.frame().velocity[which].any():
            break
    after(running, 2)
    frame = running.frame()
    number = running.bodies.names.index("gate")
    # The place that hits goes round the hinge, its velocity along the normal, which is that in which the ball leaves
    normal = frame.velocity[which] / np.hypot(*frame.velocity[which])
    point = frame.position[which] - normal * BALL
    speed = RATE * (point[0] * normal[1] - point[1] * normal[0])
    told = speed * (1.0 + e / (1.0 + falloff * speed))
    assert np.hypot(*frame.velocity[which]) == pytest.approx(told, rel=2e-3)  # it has gone on for a few steps
    assert frame.angular_velocity[number] == RATE


def test_stroke_holds_against_whatever_hits_it(start):
    running = start(scene(gate(), {"ball": [ball(0.05, 0.05, 0.0, -8.0, mass=100.0) | {"mass": 100.0}]}))
    frame = after(running, 20)
    assert (frame.angle[1], frame.angular_velocity[1]) == (0.0, 0.0)
    assert frame.velocity[0, 1] > 0.0


def test_plunger_is_drawn_as_fast_as_a_hand_does_and_stays(start):
    running = start(scene(rod()))
    press(running, 0.5)
    frame = after(running, 50)  # a quarter of the time that a full pull takes
    assert frame.position[0, 1] == pytest.approx(-0.05 - 0.25 * TRAVEL, rel=1e-12)
    assert frame.velocity[0, 1] == pytest.approx(-TRAVEL / 0.2, rel=1e-12)
    frame = after(running, 100)
    assert frame.position[0, 1] == pytest.approx(-0.05 - 0.5 * TRAVEL, rel=1e-15)
    assert not frame.velocity.any()
    press(running, 0.25)  # eased forward by the same hand
    frame = after(running, 100)
    assert frame.position[0, 1] == pytest.approx(-0.05 - 0.25 * TRAVEL, rel=1e-15)


@pytest.mark.parametrize("pull", [0.25, 0.5, 1.0])
def test_plunger_springs_forward_as_a_cosine(start, pull):
    running = start(scene(rod(), dt=1e-3))
    press(running, pull)
    after(running, 250)
    press(running, 0.0)
    omega, fastest = SPEED / TRAVEL, 0.0
    for k in range(1, 100):
        frame = after(running, 1)
        angle = omega * k * 1e-3
        if angle >= 0.5 * math.pi:
            break
        drawn = -0.05 - frame.position[0, 1]
        assert drawn == pytest.approx(pull * TRAVEL * math.cos(angle), abs=1e-15)
        fastest = frame.velocity[0, 1]
    assert fastest == pytest.approx(pull * SPEED, rel=3e-3)  # a step or less before: 1 − cos(ω·1 ms)
    assert frame.position[0, 1] == -0.05
    assert not after(running, 1).velocity.any()


@pytest.mark.parametrize("pull", [0.25, 0.5, 1.0])
def test_ball_on_a_plunger_leaves_at_the_speed_of_its_pull(start, pull):
    lying = ball(0.0, BALL + 1e-5, restitution=0.3)
    running = start(scene(rod(), {"ball": [lying]}, gravity=(0.0, -0.77)))
    press(running, pull)
    after(running, 600)
    press(running, 0.0)
    fastest = max(after(running, 1).velocity[0, 1] for _ in range(100))
    assert fastest == pytest.approx(pull * SPEED, rel=0.03)  # e of the plunger's gain in a step, 25 mm/s, and gravity


def test_account_of_strokes_and_plungers_closes(start):
    from sandbox.engines.common.energy_balance import total_energy

    own, more = gate(), rod()
    more["box"][0]["position"] = [0.3, -0.05]
    both = {"box": own["box"] + more["box"], "drive": [*own["drive"], {**more["drive"][0], "name": "rod"}]}
    balls = [ball(0.06, 0.03, restitution=0.8) | {"name": "a"}, ball(0.3, BALL + 1e-4) | {"name": "b"}]
    running = start(scene(both, {"ball": balls}, gravity=(0.0, -0.77)))
    running.account()
    energy = total_energy(running)
    for k in range(500):
        if k in (100, 300):
            press(running, float(k == 100))
            press(running, float(k == 100), "rod")
        running.step()
    entries = running.account()
    assert sum(entries.values()) == pytest.approx(total_energy(running) - energy, abs=1e-13)
    assert entries["drives"] > 0.05  # J: the ball in the gate's way gets a third more than ½ · 80 g · (1.2 m/s)²
    assert entries["actions"] == pytest.approx(0.0, abs=1e-15)


def test_what_is_led_through_walls_is_no_missed_contact(engine):
    """A head of 40 mm that springs through a wall, its half a step: it passes by what it is, and nothing is amiss."""
    import sandbox
    from sandbox.action import Drive

    walls = [{"points": [[-1.0, -0.15], [1.0, -0.15]]}]
    made = scene(rod(travel=0.2, speed=40.0), {"wall": walls})
    told = tuple(Drive(time=time, drive="flip", level=level) for time, level in ((0.0, 1.0), (0.4, 0.0)))
    run = sandbox.run(made, engine, actions=told)
    assert run.position[:, 0, 1].min() == pytest.approx(-0.25, rel=1e-12)
    assert (run.missed_contacts, len(run.contact_time)) == (0, 0)
