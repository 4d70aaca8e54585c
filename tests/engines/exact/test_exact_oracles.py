"""Exact engine against independent oracles: mpmath at 40 digits and scipy's DOP853 with events."""

import math

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sandbox.engines.exact.engine import ExactEngine
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

G = 9.81
mpmath.mp.dps = 40


def bouncing_scene(restitution, height=5.0, dt=0.5):
    return make_scene(
        world={"gravity": [0, -G]},
        solver={"dt": dt},
        plane=[{"point": [0, 0], "normal": [0, 1]}],
        ball=[{"position": [0, height + 0.5], "radius": 0.5, "restitution": restitution}],
    )


def test_200_elastic_bounces_agree_with_40_digits():
    simulation = ExactEngine().start(bouncing_scene(1.0))
    simulation.contacts()
    while simulation.events < 200:
        simulation.step()
    contacts = simulation.contacts()
    g = mpmath.mpf(G)
    fall = mpmath.sqrt(10 / g)
    for k in range(200):
        # A time of 404 s rounds at 6e-14; 200 speeds and intervals round at 1e-16 each.
        assert abs(contacts.time[k] - (2 * k + 1) * fall) < 1e-12
    time = mpmath.mpf(simulation.time)
    phase = mpmath.fmod(time - fall, 2 * fall)
    height = mpmath.mpf("0.5") + phase * (g * fall) - g * phase**2 / 2
    assert abs(simulation.frame().position[0, 1] - height) < 1e-11  # 10 m/s times the error in time


@pytest.mark.parametrize("restitution", [0.0, 0.2, 0.5, 0.8, 0.95])
def test_bouncing_ends_at_the_zeno_time(restitution):
    simulation = ExactEngine().start(bouncing_scene(restitution, dt=0.1))
    simulation.contacts()
    first = math.sqrt(2 * 5 / G)
    end = first * (1 + restitution) / (1 - restitution)
    while simulation.time < end:
        simulation.step()
    contacts = simulation.contacts()
    assert contacts.time[-1] == pytest.approx(end, abs=1e-12 * max(1.0, end))  # truncated at 1e-13
    frame = simulation.frame()
    assert frame.velocity[0].tolist() == [0.0, 0.0]
    assert frame.position[0, 1] == pytest.approx(0.5, abs=1e-13)  # truncation of the series and rounding of positions


def gas_by_mpmath(position, velocity, radius, size, collisions):
    """Return time, positions and velocities after some collisions of balls in a box, by brute force in 40 digits."""
    x = [[mpmath.mpf(float(c)) for c in row] for row in position]
    v = [[mpmath.mpf(float(c)) for c in row] for row in velocity]
    r, box = mpmath.mpf(radius), mpmath.mpf(size)
    time, count = mpmath.mpf(0), 0
    while count < collisions:
        earliest, event = mpmath.inf, None
        for i in range(len(x)):
            for axis in (0, 1):
                speed = v[i][axis]
                if speed != 0:
                    t = ((box - r if speed > 0 else r) - x[i][axis]) / speed
                    if t < earliest:
                        earliest, event = t, (i, None, axis)
            for j in range(i):
                d = [x[i][k] - x[j][k] for k in (0, 1)]
                w = [v[i][k] - v[j][k] for k in (0, 1)]
                b = d[0] * w[0] + d[1] * w[1]
                if b >= 0:
                    continue
                a, c = w[0] ** 2 + w[1] ** 2, d[0] ** 2 + d[1] ** 2 - 4 * r * r
                root = b * b - a * c
                if root > 0 and (-b - mpmath.sqrt(root)) / a < earliest:
                    earliest, event = (-b - mpmath.sqrt(root)) / a, (i, j, 0)
        time += earliest
        for i in range(len(x)):
            for k in (0, 1):
                x[i][k] += v[i][k] * earliest
        i, j, axis = event
        if j is None:
            v[i][axis] = -v[i][axis]
            continue
        count += 1
        n = [(x[i][k] - x[j][k]) / (2 * r) for k in (0, 1)]
        closing = sum((v[i][k] - v[j][k]) * n[k] for k in (0, 1))
        for k in (0, 1):
            v[i][k] -= closing * n[k]
            v[j][k] += closing * n[k]
    return time, x, v


def test_gas_of_16_agrees_with_40_digits_up_to_its_50th_collision():
    random = np.random.default_rng(3)
    position = np.array([(0.5 + k % 4, 0.5 + k // 4) for k in range(16)]) + random.uniform(-0.1, 0.1, (16, 2))
    velocity = random.normal(size=(16, 2))
    walls = [((0, 0), (0, 1)), ((0, 0), (1, 0)), ((4, 4), (0, -1)), ((4, 4), (-1, 0))]
    scene = make_scene(
        solver={"dt": 0.01},
        plane=[{"point": list(p), "normal": list(n)} for p, n in walls],
        ball=[
            {"position": x.tolist(), "velocity": v.tolist(), "radius": 0.25, "restitution": 1.0}
            for x, v in zip(position, velocity, strict=True)
        ],
    )
    time, x, _ = gas_by_mpmath(position, velocity, 0.25, 4, 50)
    simulation = ExactEngine().start(scene)
    simulation.contacts()
    steps, remainder = divmod(float(time), 0.01)
    advance(simulation, int(steps))
    simulation.finish(remainder / 0.01)
    contacts = simulation.contacts()
    times = contacts.time[contacts.pair[:, 1] >= 0]
    assert len(times) in (49, 50)  # rounding decides whether the last one, at the end time, is included
    # A gas of 16 balls loses 11 digits in 100 collisions, so about 5 of 16 in 50.
    assert np.abs(simulation.frame().position - np.array(x, dtype=np.float64)).max() < 1e-9


def flight_by_dop853(state, gaps, restitution, until):
    """Return times of impact and the final state of a ball that flies among obstacles.

    Each obstacle is a function that returns the gap and the normal at a position.
    """

    def flight(_, s):
        return [s[2], s[3], 0.0, -G]

    def event(gap):
        def crossing(_, s):
            return gap(s[:2])[0]

        crossing.terminal, crossing.direction = True, -1.0
        return crossing

    time, times = 0.0, []
    while True:
        tolerances = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-13, "max_step": 0.02}
        run = solve_ivp(flight, (time, until), state, events=[event(gap) for gap in gaps], **tolerances)
        state, time = run.y[:, -1], float(run.t[-1])
        if run.status == 0:
            return times, state
        hit = next(k for k, found in enumerate(run.t_events) if len(found))
        times.append(time)
        normal = gaps[hit](state[:2])[1]
        closing = -(state[2:] @ normal)
        state = np.concatenate((state[:2] + 1e-13 * normal, state[2:] + (1 + restitution) * closing * normal))


def test_ball_among_planes_a_post_and_a_wall_end_agrees_with_dop853():
    """Flat and curved obstacles exercise both the quadratic and the quartic solver."""
    radius, e = 0.2, 0.9

    def plane(point, normal):
        normal = np.asarray(normal) / np.hypot(*normal)
        return lambda x: (float((x - point) @ normal) - radius, normal)

    def circle(centre, size):
        def gap(x):
            offset = x - centre
            distance = np.hypot(*offset)
            return distance - size - radius, offset / distance

        return gap

    start = np.array([0.1, 2.0, 0.7, 0.3])
    gaps = [
        plane((0.0, 0.0), (0.0, 1.0)),
        plane((-2.0, 0.0), (1.0, 0.1)),
        plane((2.5, 0.0), (-1.0, 0.0)),
        circle((0.4, 0.6), 0.3),
        circle((1.5, 0.8), 0.01),
    ]
    times, state = flight_by_dop853(start, gaps, e, 4.0)
    scene = make_scene(
        world={"gravity": [0, -G]},
        plane=[
            {"point": [0, 0], "normal": [0, 1]},
            {"point": [-2, 0], "normal": [1, 0.1]},
            {"point": [2.5, 0], "normal": [-1, 0]},
        ],
        wall=[{"points": [[1.5, 0.8], [1.5, -9.0]], "thickness": 0.02}],
        post=[{"position": [0.4, 0.6], "radius": 0.3}],
        ball=[{"position": [0.1, 2.0], "velocity": [0.7, 0.3], "radius": radius, "restitution": e}],
    )
    simulation = ExactEngine().start(scene)
    simulation.contacts()
    advance(simulation, 400)
    contacts = simulation.contacts()
    assert len(times) >= 8
    assert {-4, -5} <= set(contacts.pair[:, 1].tolist())  # the wall's end and the post
    # An impact on a curve amplifies an error of 1e-13 about 5 times; there are ten impacts, a few of them on curves.
    np.testing.assert_allclose(contacts.time, times, atol=1e-9)
    np.testing.assert_allclose(simulation.frame().position[0], state[:2], atol=1e-8)
