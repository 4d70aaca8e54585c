"""Drives by torque: the strokes of a flipper against its equation of motion, and what it meets."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.engines.flippers import BALL, BAR_MOMENT, END, LENGTH, MASS, MOMENT, REST, ball, bar, bat, press, scene
from tests.engines.flippers import TORQUE as COIL

TORQUE, RAMP, HOLD = 0.513, 0.030, 0.75
STROKE = END - REST
VISUAL_PINBALL = 1e-3
"""s, its tick"""
UP = (1, 2, 4)


def coil_stroke(to, level, begin, weight=None, tick=1e-5, **coil):
    """Time and speed with which a bat reaches a stop first from the other, by Visual Pinball's law of the coil.

    Stepped by the trapezium rule; `VISUAL_PINBALL` steps as that program does, whole ticks of 1 ms.

    Args:
        to: rad from its rest, 0 or STROKE.
        level: 1 or 0.
        begin: torque at the start, N·m.
        weight: torque of the weight, N·m, by the angle from the rest.
        tick: s.
        coil: what is not as in `TORQUE` of the module `flippers`.
    """
    coil = COIL | coil
    place, speed, current, time = STROKE - to, 0.0, begin, 0.0
    while True:
        left, wanted = STROKE - place, coil["torque"] if level else -coil["return_ratio"] * coil["torque"]
        if left < coil["hold_within"]:
            fade = (left / coil["hold_within"]) ** 4
            wanted *= fade + coil["hold_ratio"] * (1.0 - fade)
        change = coil["torque"] / coil["ramp"] * tick if coil["ramp"] else math.inf
        old, current = current, min(max(wanted, current - change), current + change)
        torque = (current if tick == VISUAL_PINBALL or not coil["ramp"] else 0.5 * (old + current)) + (
            weight(place) if weight else 0.0
        )
        new = speed + tick * torque / coil["moment"]
        mean = new if tick == VISUAL_PINBALL else 0.5 * (speed + new)
        if (place + mean * tick - to) * (1.0 if level else -1.0) >= 0.0 and mean:
            share = (to - place) / (mean * tick)
            return time + share * tick, abs(speed + share * (new - speed) if tick != VISUAL_PINBALL else new)
        place, time = min(max(place + mean * tick, 0.0), STROKE), time + tick
        speed = 0.0 if place in (0.0, STROKE) else new  # pressed onto the stop from which it starts


def measured(start, dt, gravity=(0.0, 0.0), substeps=1, **coil):
    """Time and speed of the first arrival at the end, and the time of the way back from there."""
    running = start(scene(bat(**coil), gravity=gravity, dt=dt, substeps=substeps))
    moment = coil.get("moment", MOMENT)
    press(running)
    before = running.frame()
    while True:
        running.step()
        now = running.frame()
        if now.angular_velocity[0] < 0.0 < before.angular_velocity[0] or now.angle[0] == END:
            break
        before = now
    up, speed = arrival(before, now, END, moment)
    while running.frame().angle[0] < END or running.frame().angular_velocity[0] or not settled(running):
        running.step()
    press(running, 0.0)
    begin, before = running.time, running.frame()
    while True:
        running.step()
        now = running.frame()
        if now.angular_velocity[0] > 0.0 > before.angular_velocity[0] or now.angle[0] == REST:
            break
        before = now
    return up, speed, arrival(before, now, REST, moment)[0] - begin


def arrival(before, now, stop, moment):
    """Time and speed of an arrival between two frames, under the mean of the torques at the two."""
    rate = 0.5 * (before.drives[0, 1] + now.drives[0, 1]) / moment
    spin, way = before.angular_velocity[0], stop - before.angle[0]
    speed = math.copysign(math.sqrt(spin**2 + 2.0 * rate * way), way)
    return before.time + 2.0 * way / (spin + speed), abs(speed)


def settled(running):
    """The current no longer changes."""
    before = running.frame().drives[0, 1]
    running.step()
    return running.frame().drives[0, 1] == before


def test_stroke_is_as_fast_as_visual_pinballs(start):
    up, speed, down = measured(start, 1e-3)
    there = coil_stroke(STROKE, 1, 0.0, tick=VISUAL_PINBALL)
    back = coil_stroke(0.0, 0, HOLD * TORQUE, tick=VISUAL_PINBALL)
    # Steps of 1 ms that take the new speed for the whole of a step are half a step ahead: 0.5 of 34 ms.
    assert up == pytest.approx(there[0], abs=1.1e-3)
    assert speed == pytest.approx(there[1], rel=0.01)
    assert speed * LENGTH == pytest.approx(5.34, rel=0.01)
    assert down == pytest.approx(back[0], rel=0.01)


@pytest.mark.parametrize("moment", [MOMENT, 3.0 * MOMENT])
@pytest.mark.parametrize(("hold_ratio", "within"), [(0.75, 6.0), (0.2, 6.0), (0.2, 12.0), (0.5, 3.0), (1.0, 0.0)])
@pytest.mark.parametrize(("ramp", "return_ratio"), [(0.0, 0.058), (0.03, 0.058), (0.01, 0.15)])
def test_hold_coil_obeys_visual_pinballs_law_at_every_setting(start, moment, hold_ratio, within, ramp, return_ratio):
    coil = {"moment": moment, "hold_ratio": hold_ratio, "hold_within": math.radians(within)}
    coil |= {"ramp": ramp, "return_ratio": return_ratio}
    up, speed, down = measured(start, 1e-3, **coil)
    there, back = coil_stroke(STROKE, 1, 0.0, **coil), coil_stroke(0.0, 0, hold_ratio * TORQUE, **coil)
    # A substep of 1 ms is 4° of the bat; what the law asks for.
    assert (up, speed, down) == pytest.approx((*there, back[0]), rel=0.01)


@pytest.mark.parametrize("gravity", [0.0, 0.77])
def test_stroke_obeys_the_equation_of_motion(start, gravity):
    arm = float(np.hypot(*scene(bat()).bodies.position[0]))

    def weight(place):
        return -MASS * gravity * arm * math.cos(REST + place)

    there = coil_stroke(STROKE, 1, 0.0, weight)
    back = coil_stroke(0.0, 0, HOLD * TORQUE, weight)
    up, speed, down = measured(start, 1e-4, (0.0, -gravity))
    # The arrival is read under the mean of two frames' torques, and near the end the torque falls by 1/150 in a step.
    assert (up, speed, down) == pytest.approx((*there, back[0]), rel=3e-4)


def test_stroke_converges_in_second_order_but_for_where_the_torque_jumps(start):
    """Angle and speed at 30 ms, when the torque has just risen: all of it is smooth before."""
    errors = []
    for substeps in UP:
        running = start(scene(bat(), dt=2e-3, substeps=substeps))
        press(running)
        for _ in range(15):
            running.step()
        rate = TORQUE / RAMP / MOMENT
        errors.append(abs(running.frame().angle[0] - REST - rate * 0.03**3 / 6.0))
        # The mean torque of each substep is the exact one, so that speeds are too.
        assert running.frame().angular_velocity[0] == pytest.approx(rate * 0.03**2 / 2.0, rel=1e-12)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.2)


def test_bat_stays_on_its_hinge_and_within_its_stops(start):
    running = start(scene(bat(), gravity=(0.0, -9.81)))
    arm = np.hypot(*running.frame().position[0])
    for k in range(400):
        if k % 60 == 0:
            press(running, float(k % 120 == 0))
        running.step()
        frame = running.frame()
        assert np.hypot(*frame.position[0]) == pytest.approx(arm, rel=1e-14)
        assert REST <= frame.angle[0] <= END
        way = frame.angular_velocity[0] * np.array([-frame.position[0, 1], frame.position[0, 0]])
        np.testing.assert_allclose(frame.velocity[0], way, atol=1e-13)


def test_bat_mirrored_moves_mirrored(start):
    """What turns the other way has its stops the other way round."""
    left, right = start(scene(bat())), start(scene(bat(stops=[-REST, -END], angle=-REST)))
    for running in (left, right):
        press(running)
    for _ in range(60):
        left.step()
        right.step()
        assert right.frame().angle[0] == pytest.approx(-left.frame().angle[0], abs=1e-13)


@pytest.mark.parametrize("arm", [0.02, 0.05, 0.075])
@pytest.mark.parametrize("held", [True, False], ids=["off its end stop", "off its rest"])
def test_ball_that_pushes_a_bat_off_its_stop_feels_its_inertia(start, arm, held):
    """Effective mass I/r²: J = (1 + e) v / (1/m + r²/I)."""
    speed, e = 3.0, 0.8
    drive = {"stops": [-0.5, 0.0]} if held else {}
    side = 1.0 if held else -1.0
    tables = ball(arm, side * (0.01 + BALL + 0.0015), 0.0, -side * speed, restitution=e, friction=0.0)
    running = start(scene(bar(**drive), {"ball": [tables]}))
    if held:
        press(running)
    while running.frame().velocity[0, 1] == -side * speed:
        running.step()
    frame = running.frame()
    impulse = MASS * abs(frame.velocity[0, 1] + side * speed)
    # Within the substep of 1 ms the bat's own torque acts too: 0.03 N·m · 1 ms, a thousandth of what the ball gives.
    assert impulse == pytest.approx((1.0 + e) * speed / (1.0 / MASS + arm**2 / BAR_MOMENT), rel=1e-3)
    assert abs(frame.angular_velocity[1]) == pytest.approx(impulse * arm / BAR_MOMENT, rel=2e-3)


@pytest.mark.parametrize("arm", [0.02, 0.05, 0.075])
def test_ball_that_presses_a_bat_onto_its_stop_is_thrown_back_as_by_a_wall(start, arm):
    running = start(scene(bar(), {"ball": [ball(arm, 0.01 + BALL + 0.0015, 0.0, -3.0, restitution=0.8)]}))
    for _ in range(5):
        running.step()
    frame = running.frame()
    assert frame.velocity[0, 1] == pytest.approx(2.4, rel=1e-12)
    assert (frame.angle[1], frame.angular_velocity[1]) == (0.0, 0.0)


@pytest.mark.parametrize("held", [True, False], ids=["held", "at rest"])
def test_ball_rests_on_a_bat_without_jitter(start, held):
    drive = {"stops": [-0.5, 0.0], "hold_within": 0.1} if held else {}
    lying = ball(0.06, 0.01 + BALL + 1e-4, restitution=0.5, friction=0.3)
    running = start(scene(bar(**drive), {"ball": [lying]}, gravity=(0.0, -0.77)))
    press(running, float(held))
    for k in range(1500):
        running.step()
        frame = running.frame()
        assert frame.angle[1] == 0.0
        if k > 500:
            assert np.abs(frame.velocity[0]).max() < 1e-12  # rounding of m/s that were
    assert 0.0 < frame.position[0, 1] - 0.01 < BALL


def test_two_balls_on_either_side_of_a_bat(start):
    """One presses it onto its stop, one off it, at once: momentum about the hinge is what the stop took or more."""
    below = ball(0.05, -(0.01 + BALL + 0.0015), 0.0, 3.0, name="below") | {"name": "below"}
    above = ball(0.03, 0.01 + BALL + 0.0015, 0.0, -3.0)
    running = start(scene(bar(), {"ball": [above, below]}))
    for _ in range(10):
        running.step()
    frame = running.frame()
    assert frame.velocity[0, 1] > 0.0 > frame.velocity[1, 1]
    assert 0.0 <= frame.angle[2] <= 0.5


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(1.0, 8.0)), min_size=4, max_size=4))
def test_no_ball_passes_a_flapping_bat(start, throws):
    """Balls thrown onto a bat that flaps, at 1 kHz: none ever is with its centre inside, nor past it in one step."""
    balls = [
        ball(0.005 + 0.065 * x, 0.06 + 0.05 * k + 0.02 * y, 0.0, -v, restitution=0.8) | {"name": f"b{k}"}
        for k, (x, y, v) in enumerate(throws)
    ]
    running = start(scene(bat(), {"ball": balls}, gravity=(0.0, -0.77)))
    number = len(balls)
    side = np.zeros(number)
    for k in range(120):
        if k % 40 == 0:
            press(running, float(k % 80 == 0))
        running.step()
        frame = running.frame()
        angle = frame.angle[number]
        across, along = np.array([-math.sin(angle), math.cos(angle)]), np.array([math.cos(angle), math.sin(angle)])
        height, reach = frame.position[:number] @ across, frame.position[:number] @ along
        over = (reach > 0.0) & (reach < LENGTH)
        # From one side of the middle line to the other, above the bat both times
        assert not (over & (side != 0.0) & (np.sign(height) != side)).any()
        side = np.where(over, np.sign(height), 0.0)


def test_account_closes_and_what_drives_gave_is_there(start):
    lying = ball(0.05, 0.01, restitution=0.8, friction=0.3)
    running = start(scene(bat(), {"ball": [lying]}, gravity=(0.0, -0.77)))
    running.account()
    energy = _energy(running)
    for k in range(600):
        if k in (300, 450):
            press(running, float(k == 300))
        running.step()
    entries = running.account()
    gained = _energy(running) - energy
    assert sum(entries.values()) == pytest.approx(gained, abs=1e-13)  # rounding of 0.3 J turned over
    assert entries["drives"] > 0.1  # J: half of the bat's 0.37 J goes into the ball, the rest into the stop
    assert entries["phantom"] == pytest.approx(0.0, abs=1e-12)


def _energy(running):
    from sandbox.engines.common.energy_balance import total_energy

    return total_energy(running)


def test_pair_with_coefficients_of_its_own_keeps_them_at_a_bat(start):
    """Coefficients that pymunk's factors cannot mix are set as two touch; a bat on its stop is a wall besides."""
    tables = bar()
    del tables["box"][0]["restitution"]
    tables["box"][0]["material"] = "rubber"
    materials = [{"name": "rubber", "restitution": 0.9}, {"name": "clay", "restitution": 0.0}]
    pair = {"between": ["rubber", "clay"], "restitution": 0.7}
    thrown = ball(0.05, 0.01 + BALL + 0.0015, 0.0, -3.0, material="clay")
    running = start(scene(tables, {"ball": [thrown], "material": materials, "pair": [pair]}))
    for _ in range(5):
        running.step()
    assert running.frame().velocity[0, 1] == pytest.approx(2.1, rel=1e-12)
