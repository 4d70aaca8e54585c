"""Closed forms of flight and bouncing against 40-digit arithmetic and each other, and unsupported scenes."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sandbox.arrays import FloatArray
from sandbox.measure.analytic import bounces, closed_form, free_flight, unsupported_reason, valid_until
from sandbox.measure.analytic.solve import solution
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.compile.ballistics import free_rotation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import World
from sandbox.scene.files.load import from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Trajectory
from tests import runs_by_hand

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

G = 9.81
GROUND = "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 3.0]\n"
BALL = '[[ball]]\nname = "ball"\nposition = [1.0, 5.5]\nradius = 0.5\nrestitution = 0.8\n'


def scene_of(*parts: str, world: str = "") -> Scene:
    return loads(f"[world]\ngravity = [0.0, -9.81]\n{world}\n" + "".join(parts))


def run_of(
    scene: Scene,
    time: object,
    contacts: tuple[tuple[float, tuple[int, int]], ...] = (),
    missed: tuple[tuple[float, tuple[int, int]], ...] = (),
    retired: dict[int, float] | None = None,
    names: tuple[str, ...] | None = None,
) -> Trajectory:
    """Return a run of which only times, contacts and retirements matter."""
    names = scene.bodies.names if names is None else names
    return replace(
        runs_by_hand.run_of(scene, time=np.asarray(time, dtype=float), contacts=contacts),
        names=np.asarray(names, dtype=str),
        retired_time=np.array([(retired or {}).get(k, np.nan) for k in range(len(names))]),
        missed_time=np.asarray([t for t, _ in missed], dtype=float),
        missed_pair=np.asarray([p for _, p in missed], dtype=np.int64).reshape(-1, 2),
    )


def flight_40(t: float, x: float, v: float, g: float, k: float, wind: float) -> tuple[mpmath.mpf, ...]:
    """Return position, velocity, and the sum of the magnitudes of the terms of each, at 40 digits."""
    with mpmath.workdps(40):
        t, x, v, g, k, wind = map(mpmath.mpf, (t, x, v, g, k, wind))
        if k == 0:
            terms = [x, v * t, g * t**2 / 2], [v, g * t]
        else:
            # For the smallest k, z² is lost beside 1 with fewer digits.
            with mpmath.workdps(800):
                z = k * t
                decay = mpmath.exp(-z)
                first, second = (1 - decay) / k, (z - 1 + decay) / k**2
            terms = [x, v * first, g * second, wind * k * second], [v * decay, g * first, wind * (1 - decay)]
        return tuple(sum(part) for part in terms) + tuple(sum(map(abs, part)) for part in terms)


@pytest.mark.parametrize("k", [0.0, 5e-324, 1e-16, 1e-5, 0.1, 0.99, 1.01, 50.0, 1e9])
@pytest.mark.parametrize("t", [0.0, 1e-6, 0.37, 1e4])
def test_free_flight_agrees_with_40_digits(k: float, t: float) -> None:
    start, speed, gravity, wind = (3.7, -1.9), (11.3, 7.1), (0.25, -G), (-4.3, 2.2)
    world = World(gravity=gravity, linear_drag=k, wind=wind)
    position, velocity = free_flight(np.array([t]), np.array(start), np.array(speed), world)
    for axis in (0, 1):
        x, v, x_size, v_size = flight_40(t, start[axis], speed[axis], gravity[axis], k, wind[axis])
        assert abs(position[0, axis] - x) <= 2e-15 * x_size  # nine roundings of at most 1.1e-16 each
        assert abs(velocity[0, axis] - v) <= 2e-15 * v_size  # likewise; e⁻ᶻ adds z·e⁻ᶻ of one rounding, z e⁻ᶻ < 1


@pytest.mark.parametrize(("drag", "damping"), [(0.0, 0.3), (0.7, 0.3), (0.7, 0.999999), (1e-9, 0.5)])
def test_free_flight_with_damping_agrees_with_an_integration(drag: float, damping: float) -> None:
    world, rate = World(gravity=(0.25, -G), linear_drag=drag, damping=damping, wind=(-4.3, 2.2)), -math.log(damping)

    def derivative(_: float, s: FloatArray) -> list[float]:
        acceleration = np.asarray(world.gravity) - drag * (s[3:5] - world.wind) - rate * s[3:5]
        return [*s[3:], *acceleration, -rate * s[5]]

    start = [3.7, -1.9, 0.4, 11.3, 7.1, 5.0]
    truth = solve_ivp(derivative, (0.0, 3.0), start, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    time = np.array([3.0])
    position, velocity = free_flight(time, np.array(start[:2]), np.array(start[3:5]), world)
    angle, spin = free_rotation(time, np.array(start[2]), np.array(start[5]), world)
    found = [*position[0], angle[0], *velocity[0], spin[0]]
    assert found == pytest.approx(truth, rel=1e-11, abs=1e-11)  # tolerance of the integration, over its steps


def test_solution_of_a_damped_scene_is_free_flight_only() -> None:
    flying = {"position": [0, 5], "velocity": [1, 2], "angular_velocity": 3.0, "radius": 0.1, "collides": "none"}
    world = {"gravity": [0.0, -G], "damping": 0.5, "duration": 1.0}
    scene = from_document({"world": world, "ball": [flying]})
    found = solution(scene)
    assert found.at(np.array([1.0])).spin[0, 0] == pytest.approx(1.5, rel=1e-15)  # one rounding
    spring = {"kind": "spring", "between": ["a"], "anchors": [[0, 0], [0, 0]], "rest_length": 0.0, "stiffness": 9.0}
    held = from_document({"world": world, "ball": [flying | {"name": "a"}], "joint": [spring]})
    assert solution(held) is None
    floor = {"point": [0, 0], "normal": [0, 1]}
    dropped = {"position": [0, 5], "radius": 0.1}
    assert solution(from_document({"world": world, "ball": [dropped], "plane": [floor]})) is None
    assert solution(from_document({"world": world | {"damping": 1.0}, "ball": [dropped], "plane": [floor]})) is not None


def test_free_flight_of_several_bodies_equals_that_of_each() -> None:
    random = np.random.default_rng(3)
    time, x, v = np.linspace(0.0, 4.0, 7), random.normal(size=(5, 2)), random.normal(size=(5, 2))
    world = World(gravity=(1.0, -G), linear_drag=0.4, wind=(2.0, -1.0))
    position, velocity = free_flight(time, x, v, world)
    assert position.shape == velocity.shape == (7, 5, 2)
    for n in range(5):
        one = free_flight(time, x[n], v[n], world)
        assert np.array_equal(position[:, n], one[0])
        assert np.array_equal(velocity[:, n], one[1])


def test_free_flight_under_quadratic_drag_is_refused() -> None:
    with pytest.raises(ValueError, match="quadratic drag"):
        free_flight(np.zeros(1), np.zeros(2), np.zeros(2), World(quadratic_drag=0.1))
    reason = unsupported_reason(scene_of(BALL, world="quadratic_drag = 0.1"))
    assert reason is not None
    assert "world.quadratic_drag" in reason
    assert unsupported_reason(scene_of(BALL, world="linear_drag = 0.1")) is None


@given(e=st.floats(0.01, 1.0), height=st.floats(0.0, 100.0), speed=st.floats(-20.0, 20.0), fraction=st.floats(0.0, 1.0))
@example(e=1.0 - 2.0**-53, height=5.0, speed=0.0, fraction=0.3)
@example(e=1.0 - 1e-9, height=5.0, speed=-3.0, fraction=0.7)
@example(e=0.5, height=0.0, speed=1e-160, fraction=0.5)
def test_bounces_agree_with_stepping_from_impact_to_impact(e, height, speed, fraction):
    with mpmath.workdps(40):
        g, v = mpmath.mpf(G), mpmath.mpf(speed)
        impact = mpmath.sqrt(v**2 + 2 * g * height)
        at = mpmath.mpf(0)
        last = (v + impact) / g
        for _ in range(12):
            at, v = at + last, e * impact
            impact, last = v, 2 * v / g
        when = float(at + fraction * last)
        elapsed = mpmath.mpf(when) - at
        expected, rate = v * elapsed - g * elapsed**2 / 2, v - g * elapsed
    got_height, got_rate = bounces(np.array([when]), height, speed, G, e)
    scale = float(np.hypot(speed, np.sqrt(2 * G * height)))
    # A dozen roundings of a time of size `when`, 1e-16 of it each.
    tolerance = 1e-13 * max(1.0, when) * max(1.0, scale)
    assert abs(got_height[0] - float(expected)) <= tolerance
    near_impact = min(abs(float(elapsed)), abs(float(last - elapsed))) <= 1e-12 * max(1.0, when)
    # Within rounding of an impact the speed may be that before or after it.
    assert near_impact or abs(got_rate[0] - float(rate)) <= G * tolerance


@given(e=st.floats(0.0, 1.0), height=st.floats(0.0, 1e6), speed=st.floats(-1e3, 1e3))
def test_bouncing_ball_never_sinks_or_gains_energy(e: float, height: float, speed: float) -> None:
    above, velocity = bounces(np.geomspace(1e-9, 1e9, 500), height, speed, G, e)
    energy = G * above + 0.5 * velocity**2
    start = G * height + 0.5 * speed**2
    assert np.all(above >= 0.0)
    assert np.all(energy <= start * (1 + 1e-12))  # a dozen roundings
    # Energy may rise by the rounding of v − g t after a fall from a great height.
    assert np.all(np.diff(energy) <= 1e-9 * start)


def test_ball_without_restitution_stays_where_it_lands() -> None:
    height, velocity = bounces(np.array([0.5, 2.0]), 5.0, 0.0, G, 0.0)
    assert height.tolist() == [5.0 - 0.5 * G * 0.25, 0.0]
    assert velocity.tolist() == [-G * 0.5, 0.0]


@pytest.mark.parametrize(("height", "gravity", "e"), [(-1.0, G, 0.5), (1.0, -G, 0.5), (1.0, G, 1.1), (1.0, G, np.nan)])
def test_bounces_rejects_arguments_out_of_range(height: float, gravity: float, e: float) -> None:
    with pytest.raises(ValueError, match="bounces need"):
        bounces(np.zeros(1), height, 0.0, gravity, e)


def test_without_gravity_a_ball_bounces_once() -> None:
    time = np.array([0.0, 1.0, 2.0, 3.0, 100.0])
    height, velocity = bounces(time, 4.0, -2.0, 0.0, 0.5)
    assert height.tolist() == [4.0, 2.0, 0.0, 1.0, 98.0]
    assert velocity.tolist() == [-2.0, -2.0, 1.0, 1.0, 1.0]
    height, velocity = bounces(time, 4.0, 2.0, 0.0, 0.5)
    assert height.tolist() == [4.0, 6.0, 8.0, 10.0, 204.0]
    assert velocity.tolist() == [2.0] * 5


def test_closed_form_without_gravity_is_reflected_by_a_plane() -> None:
    scene = loads(GROUND + BALL.replace("0.8", "1.0") + "velocity = [2.0, -4.0]\n")
    time = np.arange(5.0)
    form = closed_form(run_of(scene, time, contacts=((1.5, (0, -1)),)), scene, 0)
    assert form.valid.all()
    assert form.position[:, 0].tolist() == [1.0, 3.0, 5.0, 7.0, 9.0]
    assert form.position[:, 1].tolist() == [5.5, 1.5, 3.5, 7.5, 11.5]


def test_valid_until_is_the_first_contact_or_retirement() -> None:
    scene = scene_of(*(BALL.replace('ball"', f'{name}"') for name in "abcd"))
    run = run_of(
        scene,
        [0.0, 1.0],
        contacts=((0.2, (1, 2)), (0.3, (0, -1)), (0.4, (0, -1)), (0.6, (2, -1))),
        missed=((0.1, (0, 3)),),
        retired={1: 0.15, 2: 0.5},
    )
    assert [valid_until(run, n) for n in range(4)] == [0.1, 0.15, 0.2, 0.1]
    assert valid_until(run_of(scene, [0.0]), 0) == np.inf


def test_closed_form_of_a_dropped_ball_bounces_to_rest() -> None:
    scene = scene_of(GROUND, BALL)
    time = np.linspace(0.0, 12.0, 1201)
    form = closed_form(run_of(scene, time, contacts=((1.01, (0, -1)), (2.63, (0, -1)))), scene, 0)
    assert form.valid.all()
    height, speed = bounces(time, 5.0, 0.0, G, 0.8)
    assert np.array_equal(form.position[:, 0], np.ones(1201))
    assert form.position[:, 1] == pytest.approx(0.5 + height, abs=2e-15)  # sums of two numbers below 6
    assert np.array_equal(form.velocity[:, 1], speed)
    assert form.position[-1, 1] == pytest.approx(0.5, abs=1e-15)  # at rest on the ground


def test_closed_form_bounces_off_a_slope_perpendicular_to_gravity() -> None:
    flat = scene_of(GROUND, BALL)
    # The same drop, rotated by the angle of a 3-4-5 triangle, with the plane away from the origin.
    slope = loads(
        "[world]\ngravity = [-5.886, -7.848]\n[[plane]]\npoint = [10.0, 20.0]\nnormal = [0.3, 0.4]\n"
        '[[ball]]\nname = "ball"\nposition = [13.3, 24.4]\nradius = 0.5\nrestitution = 0.8\n'
    )
    time = np.linspace(0.0, 10.0, 101)
    one, other = (closed_form(run_of(scene, time), scene, 0) for scene in (flat, slope))
    height = (other.position - (10.0, 20.0)) @ (0.6, 0.8)
    assert height == pytest.approx(one.position[:, 1], abs=1e-12)  # a height rounded by 4e-15 m, over about 20 bounces
    assert (other.position - (10.0, 20.0)) @ (0.8, -0.6) == pytest.approx(np.zeros(101), abs=1e-14)  # roundings of 24 m


def test_closed_form_slides_along_a_frictionless_plane() -> None:
    moving = BALL + "velocity = [3.0, 0.0]\n"
    time = np.linspace(0.0, 4.0, 41)
    hit = ((1.01, (0, -1)),)
    smooth = scene_of(GROUND, moving)
    form = closed_form(run_of(smooth, time, contacts=hit), smooth, 0)
    assert form.valid.all()
    assert form.position[:, 0] == pytest.approx(1.0 + 3.0 * time, abs=4e-15)  # two roundings of up to 13 m


@pytest.mark.parametrize(
    ("world", "ground", "ball"),
    [
        ("linear_drag = 0.1", GROUND, ""),
        ("", GROUND.replace("[0.0, 3.0]", "[0.1, 3.0]"), ""),
        ("", GROUND, "friction = 0.5\nangular_velocity = 1.0\n"),
        ("", GROUND + GROUND, ""),
    ],
)
def test_first_flight_is_valid_where_bouncing_has_no_formula(world: str, ground: str, ball: str) -> None:
    scene = scene_of(ground, BALL + ball, world=world)
    time = np.linspace(0.0, 3.0, 301)
    form = closed_form(run_of(scene, time), scene, 0)
    normal = np.array([0.1, 3.0]) / np.hypot(0.1, 3.0) if "0.1, 3.0" in ground else np.array([0.0, 1.0])
    above = form.position @ normal - 0.5 > 0
    assert 0 < above.sum() < 301
    # No contact was recorded: validity ends where the formula itself reaches the ground.
    assert np.array_equal(form.valid, above)


def test_bouncing_is_valid_until_contact_with_another_ball() -> None:
    other = BALL.replace('"ball"', '"other"')
    scene = scene_of(GROUND, BALL, other)
    time = np.linspace(0.0, 3.0, 31)
    run = run_of(scene, time, contacts=((1.0, (0, -1)), (2.05, (0, 1))), retired={1: 1.55})
    first, second = (closed_form(run, scene, n) for n in (0, 1))
    assert np.array_equal(first.valid, time < 2.05)
    assert np.array_equal(second.valid, time < 1.55)
    missed = run_of(scene, time, missed=((1.0, (0, -1)),))
    assert closed_form(missed, scene, 0).valid.all()


def test_closed_form_is_none_for_unsupported_bodies() -> None:
    time = [0.0, 1.0, 2.0]
    windy = scene_of(BALL, world="quadratic_drag = 0.1")
    assert closed_form(run_of(windy, time), windy, 0) is None
    fixed = scene_of(BALL + "fixed = true\n")
    assert closed_form(run_of(fixed, time), fixed, 0) is None
    plain = scene_of(BALL)
    assert closed_form(run_of(plain, time, contacts=((0.0, (0, 1)),)), plain, 0) is None
    spawned = run_of(plain, time, names=("ball", "spawned"))
    assert closed_form(spawned, plain, 0) is None
    assert closed_form(spawned, plain, 1) is None


def test_closed_form_of_a_body_equals_that_of_its_scene() -> None:
    time = np.linspace(0.0, 1.0, 11)
    for name in ("pendulum_90", "slide_to_roll", "newtons_cradle", "kepler", "tower"):
        scene = load(find(name), ["world.duration=1.0", "solver.dt=0.1"])
        right, last = solved_run(scene, scene.solver), len(scene.bodies) - 1
        form = closed_form(run_of(scene, time, contacts=((0.0, (last, -1)),)), scene, last)
        assert form.spin is not None
        assert form.valid.all()
        assert form.position == pytest.approx(right.position[:, last], abs=1e-15)  # times are rounded differently
        assert form.spin == pytest.approx(right.angular_velocity[:, last], abs=1e-14)  # likewise
