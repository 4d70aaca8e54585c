"""Shell flights: ranges against closed forms and scipy's DOP853, and the effects of ground and edges."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from sandbox.engines.reference.integrators import INTEGRATORS, transition
from sandbox.games.artillery.ballistics import Flight, crossing, first_strike, inputs_of, landing, plain_air, rk4
from sandbox.games.artillery.terrain import Ground
from sandbox.measure.landing_error import exact_landing
from sandbox.scene.description.world import World
from tests.games.artillery.grounds import G, flat, hills, shot, world

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples


def range_and_time(air: World, velocity: np.ndarray) -> tuple[float, float]:
    """Return the range, m, and the time of flight, s, of a shot over level ground."""
    found = exact_landing(air, velocity)
    return found.position[0], found.time


def test_scalar_rk4_equals_that_of_the_reference_engine() -> None:
    air, h = World(gravity=(0.4, -G), linear_drag=0.03, quadratic_drag=0.002, wind=(6.0, -1.0)), 0.05
    point, state = (3.0, 7.0, 40.0, 55.0), np.array([[[3.0, 7.0]], [[40.0, 55.0]]])
    for _ in range(200):
        point = rk4(air, plain_air(air), point, h)
        state = INTEGRATORS["rk4"].step(transition, 0.0, state, inputs_of(air, 1), h)
    assert point == pytest.approx(state.reshape(-1).tolist(), rel=1e-12)  # rounding of 200 steps


def test_range_in_vacuum() -> None:
    """v² sin 2α / g after 2 v sin α / g."""
    for degrees in (10.0, 45.0, 80.0):
        a = math.radians(degrees)
        distance, time = range_and_time(world(), shot(50.0, degrees))
        # landing times are accurate to 1e-13 s
        assert distance == pytest.approx(2500.0 * math.sin(2.0 * a) / G, abs=1e-9)
        assert time == pytest.approx(100.0 * math.sin(a) / G, abs=1e-12)
    assert range_and_time(world(), shot(50.0, 45.0))[0] == pytest.approx(254.842, abs=5e-4)  # as documented


@pytest.mark.parametrize(
    ("wind", "distance", "time"), [(-8.0, 103.615, 6.02594), (0.0, None, 6.02594), (5.0, None, 6.02594)]
)
def test_range_with_linear_drag(wind: float, distance: float | None, time: float) -> None:
    """The landing time is the root of the height (v_y + g/k)(1 − e^−kt)/k − g t/k; x is analogous, with the wind."""
    k, v = 0.2, shot(50.0, 45.0)
    height = lambda t: (v[1] + G / k) * -math.expm1(-k * t) / k - G * t / k  # noqa: E731
    t = brentq(height, 1.0, 20.0, xtol=1e-14, rtol=1e-15)
    x = (v[0] - wind) * -math.expm1(-k * t) / k + wind * t
    found = range_and_time(world(k, 0.0, wind), v)
    assert found[0] == pytest.approx(x, abs=1e-9)
    assert found[1] == pytest.approx(t, abs=1e-11)
    assert found[1] == pytest.approx(time, abs=5e-6)  # as documented
    if distance is not None:
        assert found[0] == pytest.approx(distance, abs=5e-4)  # as documented


@pytest.mark.parametrize(
    ("quadratic", "wind", "distance", "time"),
    [(0.01, -8.0, 69.1143, 5.12227), (0.02, 0.0, None, None), (0.002, 12.0, None, None)],
)
def test_range_with_quadratic_drag(quadratic: float, wind: float, distance: float | None, time: float | None) -> None:
    def rates(_: float, y: np.ndarray) -> list[float]:
        x, z = y[2] - wind, y[3]
        drag = quadratic * math.hypot(x, z)
        return [y[2], y[3], -drag * x, -G - drag * z]

    def ground(_: float, y: np.ndarray) -> float:
        return float(y[1])

    ground.terminal, ground.direction = True, -1.0  # type: ignore[attr-defined]
    start = [0.0, 0.0, *shot(50.0, 45.0)]
    truth = solve_ivp(rates, (0.0, 20.0), start, "DOP853", events=ground, rtol=1e-13, atol=1e-13)
    found = range_and_time(world(0.0, quadratic, wind), shot(50.0, 45.0))
    assert found[0] == pytest.approx(truth.y_events[0][0][0], abs=1e-8)  # errors of both integrators
    assert found[1] == pytest.approx(truth.t_events[0][0], abs=1e-9)
    if distance is not None and time is not None:
        assert found == (pytest.approx(distance, abs=5e-5), pytest.approx(time, abs=5e-6))  # as documented


@given(st.floats(0.0, 10.0), st.sampled_from([(0.0, 0.0), (0.3, 0.0), (0.0, 0.01), (0.1, 0.005)]))
def test_a_flight_can_be_continued_from_any_of_its_points(time: float, drags: tuple[float, float]) -> None:
    air = world(*drags, 6.0)
    whole = Flight(air, np.zeros(2), shot(60.0, 70.0))
    position, velocity = whole.at(time)
    rest = Flight(air, position, velocity)
    # The Runge–Kutta steps differ then: 1e-9 m each, the tolerance `FINE`.
    assert rest.at(2.0)[0] == pytest.approx(whole.at(time + 2.0)[0], abs=1e-8)


@given(st.integers(0, 30), st.floats(5, 175), st.floats(5, 80), st.sampled_from([(0.0, 0.0), (0.1, 0.0)]))
def test_shell_lands_on_the_surface_and_was_above_it_before(
    seed: int, degrees: float, speed: float, drags: tuple[float, float]
) -> None:
    ground, air = hills(seed, 0.4), world(*drags, 4.0)
    start = np.array([150.0, float(ground.surface(150.0)) + 2.0])
    found = landing(air, start, shot(speed, degrees), ground)
    if found is None:
        return
    x, y = found.position
    is_at_an_end = x == pytest.approx(0.0, abs=1e-6) or x == pytest.approx(300.0, abs=1e-6)  # rounding
    assert is_at_an_end or y == pytest.approx(float(ground.surface(x)), abs=1e-7)  # rounding
    flight = Flight(air, start, shot(speed, degrees))
    for time in np.linspace(0.0, found.time, 50)[:-1]:
        x, y = flight.at(float(time))[0]
        assert y > float(ground.surface(x)) - 1e-2  # a graze of a vertex of the ground between two samples, 8 ms apart


def test_rubber_edges_mirror_the_flight() -> None:
    """In still air a shot that bounces off an edge lands at the mirror image of the free shot."""
    ground = flat(0.0, 200.0)
    for air in (world(), world(0.1), world(0.0, 0.005)):
        free = landing(air, np.array([1000.0, 0.0]), shot(55.0, 50.0), flat(0.0, 2000.0))
        bounced = landing(air, np.array([60.0, 0.0]), shot(55.0, 50.0), ground, "rubber")
        assert free is not None
        assert bounced is not None
        beyond = 60.0 + free.position[0] - 1000.0
        mirrored = 200.0 - abs(200.0 - beyond) if beyond < 400.0 else beyond - 400.0
        assert bounced.position[0] == pytest.approx(mirrored, abs=1e-7)  # quadratic drag: other steps after the bounce
        assert bounced.time == pytest.approx(free.time, abs=1e-8)


def test_wrapped_ground_is_periodic_and_open_ground_ends() -> None:
    ground = flat(0.0, 100.0)
    free = landing(world(0.1, 0.0, 7.0), np.array([1000.0, 0.0]), shot(60.0, 60.0), flat(0.0, 2000.0))
    wrapped = landing(world(0.1, 0.0, 7.0), np.array([70.0, 0.0]), shot(60.0, 60.0), ground, "wrap")
    assert free is not None
    assert wrapped is not None
    assert wrapped.position[0] == pytest.approx((70.0 + free.position[0] - 1000.0) % 100.0, abs=1e-8)
    assert landing(world(), np.array([50.0, 0.0]), shot(60.0, 45.0), ground, "open") is None


def test_discs_are_hit_before_the_ground_behind_them() -> None:
    ground, discs = flat(0.0), np.array([[252.0, 7.0, 2.0], [100.0, 30.0, 1.0]])
    found = landing(world(), np.array([100.0, 0.5]), shot(40.0, 40.0), ground, discs=discs)
    assert found is not None
    assert math.dist(found.position, (252.0, 7.0)) == pytest.approx(2.0, abs=1e-9)
    assert first_strike(discs, np.array([90.0, 30.0]), np.array([110.0, 30.0])) == (pytest.approx(0.45), 1)
    # From inside: the segment has no entry.
    assert first_strike(discs, np.array([100.0, 30.0]), np.array([110.0, 30.0])) is None


def test_segment_enters_the_ground_at_its_first_crossing() -> None:
    peak = Ground(np.array([0.0, 0.0, 10.0, 0.0, 0.0]), 5.0)
    found = crossing(peak, np.array([0.5, 4.0]), np.array([4.5, 4.0]))
    assert found is not None
    assert 0.5 + 4.0 * found.here == pytest.approx(1.9)
    assert crossing(peak, np.array([0.5, 11.0]), np.array([4.5, 10.5])) is None
    assert crossing(peak, np.array([-2.0, -1.0]), np.array([-1.0, -1.0])) is None  # beside the ground, at any height
