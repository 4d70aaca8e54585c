"""Impulses: single contacts against closed forms, the friction cone, warm starts, and momentum."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.sequential_impulses import (
    approach,
    match_impulses,
    rebound_speeds,
    solve_overlaps,
    solve_velocities,
)
from tests.engines.builders import EARTH, FLOOR, ball, scene_of, simulation_of
from tests.engines.stepping import advance


def contacts(*rows):
    """Return manifolds of rows (first, second, normal, separation, arms, friction)."""
    count = len(rows)
    first, second, normal, separation, arms, friction = zip(*rows, strict=True)
    return Manifolds(
        key=np.arange(count),
        first=np.array(first),
        second=np.array(second),
        normal=np.array(normal, float),
        separation=np.array(separation, float),
        point=np.zeros((count, 2)),
        rn=np.array(arms, float),
        rt=np.zeros((count, 2)),
        friction=np.array(friction, float),
        slip_target=np.zeros(count),
        surface_pair=np.arange(count),
    )


def solve(manifolds, velocity, spin, mass, moment, iterations=1, start=None, bounce=None, restitution=0.0):
    """Solve the velocity constraints; return velocity, spin and impulses."""
    velocity, spin = np.array(velocity, float), np.array(spin, float)
    inverse = 1.0 / np.array(mass, float), 1.0 / np.array(moment, float)
    if bounce is None:
        bounce = np.empty(manifolds.size)
        rebound_speeds(manifolds, velocity, spin, np.full(manifolds.size, restitution), bounce)
    impulse = np.zeros((manifolds.size, 2)) if start is None else np.array(start, float)
    solve_velocities(manifolds, bounce, velocity, spin, *inverse, impulse, iterations)
    return velocity, spin, impulse


masses = st.floats(-12, 12).map(lambda power: 10.0**power)
speeds = st.floats(0.01, 100)
angles = st.floats(0, 2 * math.pi)


@given(masses, masses, st.floats(0, 1), speeds)
def test_two_balls_rebound_by_the_closed_form(m1, m2, e, v):
    manifolds = contacts((0, 1, (1, 0), 0.0, (0.5, 0.5), 0.0))
    velocity, _, impulse = solve(manifolds, [[v, 0], [0, 0]], [0, 0], [m1, m2], [1, 1], restitution=e)
    total = m1 + m2
    # relative to the speed before: m₁ − e·m₂ may cancel
    assert velocity[0, 0] == pytest.approx((m1 - e * m2) * v / total, abs=1e-15 * 8 * v)
    assert velocity[1, 0] == pytest.approx((1 + e) * m1 * v / total, rel=1e-15 * 8)  # some roundings
    reduced = m1 / total * m2
    assert impulse[0] == pytest.approx([(1 + e) * reduced * v, 0.0], rel=1e-15 * 8)  # likewise


@given(speeds, angles, st.floats(-10, 10), st.floats(-10, 10), st.floats(0, 1), st.floats(0, 3), st.floats(0.1, 10))
def test_one_contact_stays_in_the_friction_cone_and_conserves_momentum(v, angle, slip, spin, e, mu, m):
    normal = np.array([math.cos(angle), math.sin(angle)])
    left = np.array([-normal[1], normal[0]])
    before = np.array([v * normal + slip * left, [0.3, -0.2]])
    mass, radius = np.array([1.0, m]), np.array([0.5, 0.7])
    moment = 0.5 * mass * radius**2
    spins = np.array([spin, 1.5])
    manifolds = contacts((0, 1, normal, 0.0, radius, mu))
    velocity, turned, impulse = solve(manifolds, before, spins, mass, moment, restitution=e)
    jn, jt = impulse[0]
    assert jn >= 0.0
    assert abs(jt) <= mu * jn * (1 + 1e-15)  # a product rounded
    momentum_change = jn * normal + jt * left
    assert mass[1] * (velocity[1] - before[1]) == pytest.approx(momentum_change, abs=1e-12)  # ulps of 100 N·s times 10
    assert mass[0] * (velocity[0] - before[0]) == pytest.approx(-momentum_change, abs=1e-12)  # likewise
    # Friction turns both discs in the same direction: angular momentum about the contact is conserved.
    assert moment * (turned - spins) == pytest.approx(-radius * jt, abs=1e-12)  # likewise


@given(st.floats(0.1, 10), st.floats(-5, 5), st.floats(-10, 10))
def test_sticking_friction_leaves_no_slip(v, slip, spin):
    manifolds = contacts((0, -1, (0, -1), 0.0, (0.5, 0.0), 1000.0))
    velocity, turned, impulse = solve(manifolds, [[slip, -v]], [spin], [2.0], [0.25])
    assert abs(impulse[0, 1]) < 1000.0 * impulse[0, 0]
    # the lowest point of the disc: v_x + ω r
    assert velocity[0, 0] + 0.5 * turned[0] == pytest.approx(0.0, abs=1e-14)  # ulps of 10 m/s


def test_sliding_friction_opposes_the_slip_and_reaches_the_cone():
    manifolds = contacts((0, -1, (0, -1), 0.0, (0.5, 0.0), 0.1))
    velocity, turned, impulse = solve(manifolds, [[5.0, -1.0]], [0.0], [2.0], [0.25])
    assert impulse[0, 0] == 2.0
    assert abs(impulse[0, 1]) == pytest.approx(0.2, rel=1e-15)  # one product
    assert velocity[0, 0] == pytest.approx(4.9, rel=1e-15)  # as above
    # 0.2 N·s at an arm of 0.5 m on 0.25 kg·m²; going right, it rolls clockwise
    assert turned[0] == pytest.approx(-0.4, rel=1e-14)


@given(speeds, st.floats(0, 1))
def test_separating_bodies_are_not_pulled_back(v, e):
    manifolds = contacts((0, 1, (1, 0), -0.1, (0.5, 0.5), 0.5))
    velocity, spin, impulse = solve(
        manifolds, [[-v, 1.0], [v, 0.0]], [3, 0], [1, 1], [1, 1], iterations=10, restitution=e
    )
    assert not impulse.any()
    assert velocity.tolist() == [[-v, 1.0], [v, 0.0]]
    assert spin.tolist() == [3, 0]


def test_immovable_bodies_get_no_impulse():
    manifolds = contacts((0, 1, (1, 0), -0.1, (0.5, 0.5), 0.5))
    infinite = [math.inf, math.inf]
    velocity, _, impulse = solve(manifolds, [[1.0, 0.0], [0.0, 0.0]], [0, 0], infinite, infinite, restitution=1.0)
    assert not impulse.any()
    assert velocity.tolist() == [[1.0, 0.0], [0.0, 0.0]]


def stack(count):
    """Return the contacts of a column of 1 kg balls, the lowest on the floor."""
    rows = [(0, -1, (0, -1), 0.0, (0.5, 0.0), 0.0)]
    rows += [(k, k + 1, (0, 1), 0.0, (0.5, 0.5), 0.0) for k in range(count - 1)]
    return contacts(*rows)


def residual(iterations, start=None):
    """Return the largest approach left in a stack of 10 after a kick of 0.1 m/s, and the impulses."""
    manifolds = stack(10)
    kicked = np.tile([0.0, -0.1], (10, 1))
    velocity, _, impulse = solve(
        manifolds, kicked, np.zeros(10), np.ones(10), np.ones(10), iterations, start, np.zeros(10)
    )
    left = np.empty(10)
    approach(manifolds, velocity, np.zeros(len(velocity)), left)
    return float(-left.min()), impulse


def test_warm_start_leaves_a_smaller_residual_than_a_cold_start():
    _, last = residual(5)
    for iterations in (1, 3, 10, 30):
        assert residual(iterations, last)[0] < residual(iterations)[0]
    _, exact = residual(3000)
    # the contact under k balls carries k kicks
    assert exact[:, 0] == pytest.approx(0.1 * np.arange(10, 0, -1), rel=1e-12)  # converged to rounding
    assert residual(1, exact)[0] < 1e-12  # likewise


def test_more_iterations_leave_a_smaller_residual():
    left = [residual(n)[0] for n in (1, 10, 100, 1000)]
    assert left == sorted(left, reverse=True)
    assert left[-1] < 1e-6 * left[0]


@given(st.lists(st.integers(0, 30), unique=True), st.lists(st.integers(0, 30), unique=True))
def test_impulses_are_matched_by_key(old, new):
    old_key, key = np.array(sorted(old), np.int64), np.array(sorted(new), np.int64)
    values = np.column_stack((old_key + 0.5, -old_key - 1.0)).astype(float).reshape(-1, 2)
    impulse = np.zeros((len(key), 2))
    match_impulses(key, old_key, values, impulse)
    expected = [[k + 0.5, -k - 1.0] if k in old else [0.0, 0.0] for k in key.tolist()]
    assert impulse.tolist() == expected


@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=10, max_size=10), st.integers(1, 20))
def test_momentum_is_conserved_among_many_bodies(velocities, iterations):
    rows = [(k, k + 1, (math.cos(k), math.sin(k)), -0.01, (0.5, 0.5), 0.7) for k in range(9)]
    mass = np.arange(1.0, 11.0)
    velocity, spin, impulse = solve(
        contacts(*rows), velocities, np.ones(10), mass, mass / 8, iterations, restitution=0.5
    )
    assert mass @ velocity == pytest.approx(mass @ np.array(velocities), abs=1e-12)  # ulps of some 100 N·s
    assert (impulse[:, 0] >= 0).all()
    assert (np.abs(impulse[:, 1]) <= 0.7 * impulse[:, 0] * (1 + 1e-15)).all()  # a product rounded
    assert np.isfinite(spin).all()


@given(st.lists(st.floats(0, 3), min_size=10, max_size=10), st.integers(1, 50))
def test_overlap_correction_conserves_momentum_and_never_pulls(targets, iterations):
    manifolds = stack(10).of(slice(1, 10))
    push, mass = np.zeros((10, 3)), np.arange(1.0, 11.0)
    solve_overlaps(manifolds, np.array(targets[1:]), push, 1.0 / mass, 1.0 / mass, np.zeros(9), iterations)
    assert mass @ push == pytest.approx([0, 0, 0], abs=1e-12)  # ulps of 100 N·s
    impulses = np.cumsum((mass * push[:, 1])[::-1])[::-1][1:]  # N·s, of each contact: all momentum above it
    assert (impulses >= -1e-12).all()  # ulps of 100 N·s
    if not any(targets[1:]):
        assert not push.any()


def test_overlap_correction_converges_to_the_target_speeds():
    manifolds, targets = stack(10).of(slice(1, 10)), np.linspace(0.0, 3.0, 9)
    worst = []
    for iterations in (1, 10, 100, 1000):
        push, inverse = np.zeros((10, 3)), 1.0 / np.arange(1.0, 11.0)
        solve_overlaps(manifolds, targets, push, inverse, inverse, np.zeros(9), iterations)
        speeds = np.empty(9)
        approach(manifolds, push, push[:, 2], speeds)
        worst.append(float((targets - speeds).max()))
    assert worst == sorted(worst, reverse=True)
    assert worst[-1] < 1e-9  # m/s; 1,000 passes over 9 contacts


def test_one_overlap_separates_at_the_target_speed():
    manifolds = contacts((0, 1, (1, 0), -0.1, (0.5, 0.5), 0.0))
    push, inverse = np.zeros((2, 3)), np.array([1.0, 0.5])
    solve_overlaps(manifolds, np.array([3.0]), push, inverse, inverse, np.zeros(1), 1)
    assert push == pytest.approx(np.array([[-2.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), rel=1e-15)  # a quotient


@pytest.mark.parametrize("power", [-12, -6, 0, 6, 12])
def test_run_matches_the_closed_form_at_any_mass_ratio(power):
    ratio, e = 10.0**power, 0.5
    balls = [ball(-1.5, 0, velocity=[4.0, 0.0], mass=ratio), ball(0, 0, mass=1.0)]
    balls = [{**each, "material": "wood"} for each in balls]
    pair = [{"between": ["wood", "wood"], "restitution": e}]
    scene = scene_of(*balls, material=[{"name": "wood"}], pair=pair, solver={"dt": 0.01})
    velocity = advance(simulation_of(scene), 50).frame().velocity
    assert velocity[0, 0] == pytest.approx((ratio - e) * 4.0 / (ratio + 1.0), abs=1e-14)  # ulps of 4 m/s
    assert velocity[1, 0] == pytest.approx(1.5 * ratio * 4.0 / (ratio + 1.0), rel=1e-14)  # some roundings


def test_contact_impulse_of_a_resting_ball_is_its_weight():
    simulation = simulation_of(scene_of(ball(0, 0.495, mass=3.0), world=EARTH, plane=[FLOOR], solver={"dt": 0.01}))
    advance(simulation, 100)
    simulation.contacts()
    advance(simulation, 100)
    # weight of 3 kg over 1 s, from the ball to the floor
    assert simulation.contacts().impulse == pytest.approx(np.array([[0.0, -3.0 * 9.81]]), rel=1e-12, abs=1e-15)
