"""Driven bodies on two engines with independent solvers, and against closed forms of their collisions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines import switching
from sandbox.engines.common.energy_balance import total_energy
from tests.engines.flippers import BALL_RADIUS, BAR_MOMENT, MASS, MOMENT, REST, ball, bar, flipper, press, scene
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

ROD = {
    "box": [{"name": "rod", "size": [0.02, 0.1], "position": [0.0, -0.05]}],
    "drive": [{"name": "flip", "kind": "plunger", "body": "rod", "direction": [0, 1], "travel": 0.043, "speed": 1.03}],
}
FREE_DRIVE = {"torque": 1e-9, "return_ratio": 0.0, "stops": [-1.0, 1.0]}
"""Settings of a drive that exerts no torque at rest, far from its stops."""


def on_flipper(along, gap):
    """Return the position of a ball above a flipper at rest, with a gap in m."""
    slope = np.array([0.0046, 0.0702]) / math.hypot(0.0046, 0.0702)
    x, y = np.array([along, 0.0116 - 0.0046 * along / 0.0702]) + slope * (BALL_RADIUS + gap)
    cos, sin = math.cos(REST), math.sin(REST)
    return cos * x - sin * y, sin * x + cos * y


CASES = {
    # tables, initial level, time at which the level changes, and end time, ms
    "lies on a bat": (
        (flipper(), {"ball": [ball(*on_flipper(0.04, 1e-6), restitution=0.0, friction=0.3)]}),
        0.0,
        5,
        70,
    ),
    "lies on a bat without a hold coil": (
        (flipper(hold_ratio=1.0), {"ball": [ball(*on_flipper(0.04, 1e-6), restitution=0.0, friction=0.3)]}),
        0.0,
        5,
        70,
    ),
    "falls onto a bat": ((flipper(), {"ball": [ball(0.045, 0.06, restitution=0.8, friction=0.3)]}), 0.0, 330, 400),
    "meets a stroke": (
        (flipper(), {"ball": [ball(0.045, 0.05, 0.0, -1.0, restitution=0.8, friction=0.3)]}),
        0.0,
        22,
        46,
    ),
    "lies on a plunger": ((ROD, {"ball": [ball(0.0, BALL_RADIUS + 1e-5, restitution=0.3)]}), 0.1, 300, 360),
}


def outcome(case, engine, substeps, **solver):
    """Return the final state of the ball: position, m; velocity and surface speed of its spin, m/s."""
    tables, before, when, end = CASES[case]
    simulation = switching.start(scene(*tables, gravity=(0.0, -0.77), substeps=substeps, **solver), engine)
    press(simulation, float(before > 0.0))
    for k in range(end):
        if k == when:
            press(simulation, float(before == 0.0))
        simulation.step()
    frame = simulation.frame()
    return np.r_[frame.position[0], frame.velocity[0], BALL_RADIUS * frame.angular_velocity[0]]


@pytest.mark.parametrize("case", CASES)
def test_engines_agree_with_the_same_scheme(case):
    """The engines differ only in the correction of overlaps beyond the slop.

    At 32 kHz no overlap exceeds the slop: bodies overlap by at most 5 m/s · 1/32 ms, an eighth of it.
    """
    expected = outcome(case, "pymunk", 32)
    np.testing.assert_allclose(outcome(case, "reference", 32), expected, atol=1e-12)  # 10,000 roundings of 1e-16


@pytest.mark.parametrize("integrator", ["semi_implicit_euler", "velocity_verlet", "rk4"])
@pytest.mark.parametrize("case", ["meets a stroke", "lies on a plunger"])
def test_integrators_agree_to_first_order_in_the_step(case, integrator):
    """A hit is detected up to a step late, when the flipper or the rod has another speed.

    The comparison ends after the first hit: the number of later hits in a stroke is chaotic at any step size.

    The flipper accelerates by τ r / I = 205 m/s² at 52 mm, the rod by ω² s = 25 m/s² on release.
    """
    n = 16
    gain = {"meets a stroke": 0.513 * 0.052 / MOMENT, "lies on a plunger": 1.03**2 / 0.043}[case]
    errors = outcome(case, "reference", n, integrator=integrator) - outcome(case, "pymunk", n)
    assert np.abs(errors).max() < (1.0 + 0.8) * gain * 1e-3 / n


LEAD = 1.0 - 1e-9
"""Initial gap as a fraction of the first step's travel, so that the step ends with almost no overlap."""

each_impact = given(
    arm=st.floats(0.01, 0.075),
    speed=st.floats(0.1, 8.0),
    e=st.floats(0.0, 1.0),
    mass=st.floats(0.01, 1.0),
    side=st.sampled_from([1.0, -1.0]),
)


@each_impact
def test_ball_and_free_bar_rebound_by_the_closed_form(start, arm, speed, e, mass, side):
    """J = (1 + e) v / (1/m + r²/I), about the hinge: v' = v − J/m, ω = J r / I."""
    y = side * (0.01 + BALL_RADIUS + LEAD * 1e-3 * speed)
    thrown = ball(arm, y, 0.0, -side * speed, restitution=e, friction=0.0)
    simulation = start(scene(bar(**FREE_DRIVE), {"ball": [thrown | {"mass": mass}]}))
    simulation.step()
    frame = simulation.frame()
    impulse = (1.0 + e) * speed / (1.0 / mass + arm**2 / BAR_MOMENT)
    assert frame.velocity[0, 1] == pytest.approx(-side * (speed - impulse / mass), abs=1e-12 * speed)
    assert frame.angular_velocity[1] == pytest.approx(-side * impulse * arm / BAR_MOMENT, rel=1e-10)


@each_impact
def test_angular_momentum_about_the_hinge_is_conserved(start, arm, speed, e, mass, side):
    """Includes friction, with half of the bar's width as lever: the hinge takes momentum but no angular momentum."""
    y = side * (0.01 + BALL_RADIUS + LEAD * 1e-3 * speed)
    thrown = ball(
        arm - 0.7e-3 * speed, y, 0.7 * speed, -side * speed, restitution=e, friction=0.5, angular_velocity=5.0
    )
    tables = bar(**FREE_DRIVE)
    tables["box"][0]["friction"] = 0.8
    simulation = start(scene(tables, {"ball": [thrown | {"mass": mass}]}))
    moments = simulation.bodies.moment[0], BAR_MOMENT

    def momentum():
        frame = simulation.frame()
        (x, y), (vx, vy) = frame.position[0], frame.velocity[0]
        return mass * (x * vy - y * vx) + float(np.dot(moments, frame.angular_velocity))

    before = momentum()
    simulation.step()
    assert simulation.frame().angular_velocity[1]
    # Friction, at most 0.4 of twice the momentum, acts on either surface; the surfaces differ by the overlap.
    assert momentum() == pytest.approx(before, abs=0.8 * mass * speed * (1.0 - LEAD) * 1e-3 * speed + 1e-14)


SPRINGS = {"response": "penalty", "stiffness": 4e6, "integrator": "velocity_verlet"}
"""Stiff enough for a hit to last 0.25 ms: √(k (1/m + r²/I)) = 13,000 /s at 50 mm."""


@pytest.mark.parametrize("pressed", [True, False], ids=["onto its stop", "free"])
def test_penalty_springs_see_the_same_effective_mass_as_impulses(pressed):
    """Pressed onto its stop a bar acts as a wall; otherwise its effective mass at the contact is I/r²."""
    arm, speed, e = 0.05, 3.0, 0.8
    thrown = ball(arm, 0.01 + BALL_RADIUS + 0.0015, 0.0, -speed, restitution=e, friction=0.0)
    scene_with_drive = scene(bar() if pressed else bar(**FREE_DRIVE), {"ball": [thrown]}, substeps=256, **SPRINGS)
    simulation = switching.start(scene_with_drive, "reference")
    frame = advance(simulation, 2).frame()
    inverse_mass = 0.0 if pressed else arm**2 / BAR_MOMENT
    impulse = (1.0 + e) * speed / (1.0 / MASS + inverse_mass)
    # A step of 4 µs is a twentieth of √(m/k), and a bar that rotates by 58 rad/s · 0.25 ms is hit 0.2 mm farther in.
    assert frame.velocity[0, 1] == pytest.approx(impulse / MASS - speed, abs=0.01 * speed)
    if pressed:
        assert (frame.angle[1], frame.angular_velocity[1]) == (0.0, 0.0)
    else:
        assert frame.angular_velocity[1] == pytest.approx(-impulse * arm / BAR_MOMENT, rel=0.01)


def test_penalty_springs_hold_a_ball_on_a_flipper_held_by_its_drive():
    """The ball penetrates by m g/k; the bar does not move, as the load is less than the torque of the drive."""
    resting = ball(0.06, 0.01 + BALL_RADIUS, restitution=0.0, friction=0.3)
    scene_with_drive = scene(
        bar(stops=[-0.5, 0.0], angle=0.0),
        {"ball": [resting]},
        gravity=(0.0, -0.77),
        response="penalty",
        stiffness=1e4,
        damping=1.0,
        substeps=4,
    )
    simulation = switching.start(scene_with_drive, "reference")
    press(simulation)
    frame = advance(simulation, 500).frame()
    assert (frame.angle[1], frame.angular_velocity[1]) == (0.0, 0.0)
    assert 0.01 + BALL_RADIUS - frame.position[0, 1] == pytest.approx(MASS * 0.77 / 1e4, rel=1e-3)
    for _ in range(2):
        press(simulation, 0.0)
        advance(simulation, 100)
    assert simulation.frame().angle[1] < -0.1  # released, it falls under the ball


@pytest.mark.parametrize("collision", ["discrete", "shrink", "penalty"])
@pytest.mark.parametrize("integrator", ["explicit_euler", "semi_implicit_euler", "velocity_verlet", "rk4"])
def test_ledger_of_every_kind_of_drive_closes_with_any_scheme(integrator, collision):
    """The scene has a flipper, a diverter and a plunger with a ball each, a crate on the flipper, and a pendulum."""
    gate = {"name": "gate", "size": [0.08, 0.02], "position": [0.54, 0.0], "restitution": 0.5}
    crate = {"name": "crate", "size": [0.02, 0.03], "position": [0.03, 0.08], "mass": 0.05, "friction": 0.4}
    rod = {"name": "rod", "size": [0.02, 0.1], "position": [0.3, -0.05]}
    stroke = {"kind": "stroke", "pivot": [0.5, 0.0], "stops": [0.0, 1.5], "rate": 20.0, "return_rate": 5.0}
    balls = [(0.05, 0.01), (0.56, 0.03), (0.3, BALL_RADIUS + 1e-4), (-0.2, 0.0)]
    scene_with_drive = scene(
        {
            "polygon": flipper()["polygon"],
            "box": [gate, crate, rod],
            "ball": [ball(x, y, restitution=0.7, friction=0.3) | {"name": f"b{k}"} for k, (x, y) in enumerate(balls)],
            "wall": [{"points": [[-1.0, -0.3], [2.0, -0.3]], "restitution": 0.5}],
            "joint": [{"kind": "rod", "between": ["b3"], "anchors": [[0.0, 0.0], [-0.3, 0.0]]}],
            "drive": [
                *flipper()["drive"],
                {"name": "gate", "body": "gate", **stroke},
                {**ROD["drive"][0], "name": "rod", "draw_time": 0.1},
            ],
        },
        gravity=(0.0, -0.77),
        integrator=integrator,
        **(
            {"response": "penalty", "stiffness": 1e3, "damping": 0.2}
            if collision == "penalty"
            else {"detection": collision}
        ),
    )
    simulation = switching.start(scene_with_drive, "reference")
    simulation.account()
    energy = total_energy(simulation)
    for k in range(400):
        if k in (100, 250):
            for drive in ("flip", "gate", "rod"):
                press(simulation, float(k == 100), drive)
        simulation.step()
    entries = simulation.account()
    assert sum(entries.values()) == pytest.approx(total_energy(simulation) - energy, abs=1e-13)  # rounding of 1 J
    assert entries["drives"] > 0.3  # J
    assert entries["phantom"] == pytest.approx(0.0, abs=1e-8)  # from the bias of the pendulum's rod
    assert entries["actions"] == pytest.approx(0.0, abs=1e-15)


def test_engines_book_the_same_work_of_drives():
    """A drive that draws a plunger against its weight does 80 g · 9.81 m/s² · 43 mm of work."""
    for engine in ("pymunk", "reference"):
        tables = {**ROD, "box": [{**ROD["box"][0], "mass": 0.08}]}
        simulation = switching.start(scene(tables, gravity=(0.0, 9.81), dt=0.01), engine)
        simulation.account()
        press(simulation)
        advance(simulation, 150)
        entries = simulation.account()
        assert entries["drives"] == pytest.approx(0.08 * 9.81 * 0.043, rel=1e-12)
        assert entries["integrator"] == pytest.approx(0.0, abs=1e-15)
