"""Torque drives: strokes of a flipper against its equation of motion, and its collisions."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.engines.flippers import (
    BALL_RADIUS,
    BAR_MOMENT,
    END,
    LENGTH,
    MASS,
    MOMENT,
    REST,
    ball,
    bar,
    flipper,
    press,
    scene,
)
from tests.engines.flippers import TORQUE as COIL
from tests.engines.stepping import advance

TORQUE, RAMP, HOLD = 0.513, 0.030, 0.75
STROKE = END - REST
VISUAL_PINBALL = 1e-3
"""Tick of Visual Pinball, s."""
SUBSTEPS = (1, 2, 4)


def coil_stroke(to, level, begin, weight=None, tick=1e-5, **coil):
    """Return time and speed at which a flipper first reaches a stop from the other, by Visual Pinball's coil law.

    Integrated by the trapezium rule; with `VISUAL_PINBALL` as the tick, by the steps of that program.

    Args:
        to: target angle from the rest stop, rad: 0 or STROKE.
        level: level of the drive, 1 or 0.
        begin: initial torque, N·m.
        weight: torque of the weight, N·m, by the angle from the rest stop.
        tick: time step, s.
        coil: settings that differ from `TORQUE` of the module `flippers`.
    """
    coil = COIL | coil
    angle, speed, current, time = STROKE - to, 0.0, begin, 0.0
    while True:
        left, target = STROKE - angle, coil["torque"] if level else -coil["return_ratio"] * coil["torque"]
        if left < coil["hold_within"]:
            fade = (left / coil["hold_within"]) ** 4
            target *= fade + coil["hold_ratio"] * (1.0 - fade)
        change = coil["torque"] / coil["ramp"] * tick if coil["ramp"] else math.inf
        old, current = current, min(max(target, current - change), current + change)
        torque = (current if tick == VISUAL_PINBALL or not coil["ramp"] else 0.5 * (old + current)) + (
            weight(angle) if weight else 0.0
        )
        new = speed + tick * torque / coil["moment"]
        mean = new if tick == VISUAL_PINBALL else 0.5 * (speed + new)
        if (angle + mean * tick - to) * (1.0 if level else -1.0) >= 0.0 and mean:
            fraction = (to - angle) / (mean * tick)
            return time + fraction * tick, abs(speed + fraction * (new - speed) if tick != VISUAL_PINBALL else new)
        angle, time = min(max(angle + mean * tick, 0.0), STROKE), time + tick
        speed = 0.0 if angle in (0.0, STROKE) else new  # at a stop


def measure_stroke(start, dt, gravity=(0.0, 0.0), substeps=1, **coil):
    """Return time and speed of the first arrival at the end stop, and the duration of the return."""
    simulation = start(scene(flipper(**coil), gravity=gravity, dt=dt, substeps=substeps))
    moment = coil.get("moment", MOMENT)
    press(simulation)
    before = simulation.frame()
    while True:
        simulation.step()
        now = simulation.frame()
        if now.angular_velocity[0] < 0.0 < before.angular_velocity[0] or now.angle[0] == END:
            break
        before = now
    up, speed = arrival(before, now, END, moment)
    while simulation.frame().angle[0] < END or simulation.frame().angular_velocity[0] or not is_settled(simulation):
        simulation.step()
    press(simulation, 0.0)
    begin, before = simulation.time, simulation.frame()
    while True:
        simulation.step()
        now = simulation.frame()
        if now.angular_velocity[0] > 0.0 > before.angular_velocity[0] or now.angle[0] == REST:
            break
        before = now
    return up, speed, arrival(before, now, REST, moment)[0] - begin


def arrival(before, now, stop, moment):
    """Return time and speed of an arrival between two frames, with the mean of their torques."""
    rate = 0.5 * (before.drives[0, 1] + now.drives[0, 1]) / moment
    spin, angle = before.angular_velocity[0], stop - before.angle[0]
    speed = math.copysign(math.sqrt(spin**2 + 2.0 * rate * angle), angle)
    return before.time + 2.0 * angle / (spin + speed), abs(speed)


def is_settled(simulation):
    """Return whether the torque no longer changes in a step."""
    before = simulation.frame().drives[0, 1]
    simulation.step()
    return simulation.frame().drives[0, 1] == before


def test_stroke_is_as_fast_as_in_visual_pinball(start):
    up, speed, down = measure_stroke(start, 1e-3)
    stroke = coil_stroke(STROKE, 1, 0.0, tick=VISUAL_PINBALL)
    returning = coil_stroke(0.0, 0, HOLD * TORQUE, tick=VISUAL_PINBALL)
    # Visual Pinball's steps of 1 ms use the new speed for a whole step, which is half a step ahead: 0.5 of 34 ms.
    assert up == pytest.approx(stroke[0], abs=1.1e-3)
    assert speed == pytest.approx(stroke[1], rel=0.01)
    assert speed * LENGTH == pytest.approx(5.34, rel=0.01)
    assert down == pytest.approx(returning[0], rel=0.01)


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("moment", "hold_ratio", "within", "ramp", "return_ratio"),
    [
        (MOMENT, 0.75, 6.0, 0.0, 0.058), (3.0 * MOMENT, 0.2, 6.0, 0.03, 0.058), (MOMENT, 0.2, 12.0, 0.01, 0.15),
        (3.0 * MOMENT, 0.5, 3.0, 0.0, 0.058), (MOMENT, 1.0, 0.0, 0.03, 0.058), (3.0 * MOMENT, 1.0, 0.0, 0.01, 0.15),
    ],
)  # fmt: skip
def test_hold_coil_obeys_visual_pinballs_law_at_every_setting(start, moment, hold_ratio, within, ramp, return_ratio):
    coil = {"moment": moment, "hold_ratio": hold_ratio, "hold_within": math.radians(within)}
    coil |= {"ramp": ramp, "return_ratio": return_ratio}
    up, speed, down = measure_stroke(start, 1e-3, **coil)
    stroke, returning = coil_stroke(STROKE, 1, 0.0, **coil), coil_stroke(0.0, 0, hold_ratio * TORQUE, **coil)
    # In a substep of 1 ms the flipper turns by 4°.
    assert (up, speed, down) == pytest.approx((*stroke, returning[0]), rel=0.01)


@pytest.mark.parametrize("gravity", [0.0, 0.77])
def test_stroke_obeys_the_equation_of_motion(start, gravity):
    arm = float(np.hypot(*scene(flipper()).bodies.position[0]))

    def weight(angle):
        return -MASS * gravity * arm * math.cos(REST + angle)

    stroke = coil_stroke(STROKE, 1, 0.0, weight)
    returning = coil_stroke(0.0, 0, HOLD * TORQUE, weight)
    up, speed, down = measure_stroke(start, 1e-4, (0.0, -gravity))
    # The arrival uses the mean torque of two frames, and near the end the torque falls by 1/150 in a step.
    assert (up, speed, down) == pytest.approx((*stroke, returning[0]), rel=3e-4)


def test_smooth_part_of_a_stroke_converges_in_second_order(start):
    """Angle and speed at 30 ms, at the end of the torque ramp: the motion is smooth up to there."""
    errors = []
    for substeps in SUBSTEPS:
        simulation = start(scene(flipper(), dt=2e-3, substeps=substeps))
        press(simulation)
        advance(simulation, 15)
        rate = TORQUE / RAMP / MOMENT
        errors.append(abs(simulation.frame().angle[0] - REST - rate * 0.03**3 / 6.0))
        # The mean torque of each substep is exact, and so are speeds.
        assert simulation.frame().angular_velocity[0] == pytest.approx(rate * 0.03**2 / 2.0, rel=1e-12)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.2)


def test_flipper_stays_on_its_hinge_and_within_its_stops(start):
    simulation = start(scene(flipper(), gravity=(0.0, -9.81)))
    arm = np.hypot(*simulation.frame().position[0])
    for k in range(400):
        if k % 60 == 0:
            press(simulation, float(k % 120 == 0))
        simulation.step()
        frame = simulation.frame()
        assert np.hypot(*frame.position[0]) == pytest.approx(arm, rel=1e-14)
        assert REST <= frame.angle[0] <= END
        expected = frame.angular_velocity[0] * np.array([-frame.position[0, 1], frame.position[0, 0]])
        np.testing.assert_allclose(frame.velocity[0], expected, atol=1e-13)


@pytest.mark.parametrize("arm", [0.02, 0.05, 0.075])
@pytest.mark.parametrize("held", [True, False], ids=["off its end stop", "off its rest"])
def test_ball_that_pushes_a_flipper_off_its_stop_feels_its_inertia(start, arm, held):
    """Effective mass I/r²: J = (1 + e) v / (1/m + r²/I)."""
    speed, e = 3.0, 0.8
    drive = {"stops": [-0.5, 0.0]} if held else {}
    side = 1.0 if held else -1.0
    ball_table = ball(arm, side * (0.01 + BALL_RADIUS + 0.0015), 0.0, -side * speed, restitution=e, friction=0.0)
    simulation = start(scene(bar(**drive), {"ball": [ball_table]}))
    if held:
        press(simulation)
    while simulation.frame().velocity[0, 1] == -side * speed:
        simulation.step()
    frame = simulation.frame()
    impulse = MASS * abs(frame.velocity[0, 1] + side * speed)
    # The torque of the drive also acts within the substep of 1 ms: 0.03 N·m · 1 ms, a thousandth of the ball's impulse.
    assert impulse == pytest.approx((1.0 + e) * speed / (1.0 / MASS + arm**2 / BAR_MOMENT), rel=1e-3)
    assert abs(frame.angular_velocity[1]) == pytest.approx(impulse * arm / BAR_MOMENT, rel=2e-3)


@pytest.mark.parametrize("arm", [0.02, 0.05, 0.075])
def test_ball_that_presses_a_flipper_onto_its_stop_rebounds_as_from_a_wall(start, arm):
    simulation = start(scene(bar(), {"ball": [ball(arm, 0.01 + BALL_RADIUS + 0.0015, 0.0, -3.0, restitution=0.8)]}))
    frame = advance(simulation, 5).frame()
    assert frame.velocity[0, 1] == pytest.approx(2.4, rel=1e-12)
    assert (frame.angle[1], frame.angular_velocity[1]) == (0.0, 0.0)


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("held", [True, False], ids=["held", "at rest"])
def test_ball_rests_on_a_flipper_without_jitter(start, held):
    drive = {"stops": [-0.5, 0.0], "hold_within": 0.1} if held else {}
    resting = ball(0.06, 0.01 + BALL_RADIUS + 1e-4, restitution=0.5, friction=0.3)
    simulation = start(scene(bar(**drive), {"ball": [resting]}, gravity=(0.0, -0.77)))
    press(simulation, float(held))
    for k in range(1500):
        simulation.step()
        frame = simulation.frame()
        assert frame.angle[1] == 0.0
        if k > 500:
            assert np.abs(frame.velocity[0]).max() < 1e-12  # rounding of the initial speeds, in m/s
    assert 0.0 < frame.position[0, 1] - 0.01 < BALL_RADIUS


@pytest.mark.fail_slow(60)  # takes over half a second
@settings(max_examples=15)
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(1.0, 8.0)), min_size=4, max_size=4))
def test_no_ball_passes_a_flapping_flipper(start, throws):
    """Balls thrown onto a flipper in motion, at 1 kHz: none changes sides of its middle line in one step."""
    balls = [
        ball(0.005 + 0.065 * x, 0.06 + 0.05 * k + 0.02 * y, 0.0, -v, restitution=0.8) | {"name": f"b{k}"}
        for k, (x, y, v) in enumerate(throws)
    ]
    simulation = start(scene(flipper(), {"ball": balls}, gravity=(0.0, -0.77)))
    count = len(balls)
    side = np.zeros(count)
    for k in range(120):
        if k % 40 == 0:
            press(simulation, float(k % 80 == 0))
        simulation.step()
        frame = simulation.frame()
        angle = frame.angle[count]
        across, along = np.array([-math.sin(angle), math.cos(angle)]), np.array([math.cos(angle), math.sin(angle)])
        height, reach = frame.position[:count] @ across, frame.position[:count] @ along
        within_length = (reach > 0.0) & (reach < LENGTH)
        # From one side of the middle line to the other, within the length of the flipper both times.
        assert not (within_length & (side != 0.0) & (np.sign(height) != side)).any()
        side = np.where(within_length, np.sign(height), 0.0)


def test_pair_coefficients_apply_at_a_flipper(start):
    """Coefficients that are no product of factors come from the collision handler; a bar on its stop is a wall."""
    tables = bar()
    del tables["box"][0]["restitution"]
    tables["box"][0]["material"] = "rubber"
    materials = [{"name": "rubber", "restitution": 0.9}, {"name": "clay", "restitution": 0.0}]
    pair = {"between": ["rubber", "clay"], "restitution": 0.7}
    thrown = ball(0.05, 0.01 + BALL_RADIUS + 0.0015, 0.0, -3.0, material="clay")
    simulation = start(scene(tables, {"ball": [thrown], "material": materials, "pair": [pair]}))
    advance(simulation, 5)
    assert simulation.frame().velocity[0, 1] == pytest.approx(2.1, rel=1e-12)
