"""Path of a curling puck: the closed form against integration, and against itself in parts."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sandbox.engines.tabletop.motion import SHORT, curled, figures_of, rolled
from sandbox.scene.description.surface import Floor

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

G, MU = 9.81, 0.01
DECELERATION = MU * G


@pytest.mark.parametrize("curl", [0.07, -0.4, 3.0])
@pytest.mark.parametrize("fraction", [1e-7, 0.3, 0.9, 0.999])
def test_closed_form_matches_numerical_integration(curl: float, fraction: float) -> None:
    vx, vy = 1.2, -1.9
    time = fraction * math.hypot(vx, vy) / DECELERATION

    def law(_: float, state: list[float]) -> list[float]:
        _, _, x, y = state
        speed = math.hypot(x, y)
        return [x, y, DECELERATION * (-x - curl * y) / speed, DECELERATION * (-y + curl * x) / speed]

    found = solve_ivp(law, (0.0, time), [0.0, 0.0, vx, vy], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    # accuracy of the oracle over up to 27 m; the velocity turns by up to 21 rad where 1/1000 of the speed is left
    assert np.asarray(curled(vx, vy, DECELERATION, curl, time)) == pytest.approx(found, abs=1e-9)


@given(curl=st.floats(-10, 10), speed=st.floats(1e-3, 100), fraction=st.floats(0, 1.2))
def test_closed_form_matches_the_complex_one(curl: float, speed: float, fraction: float) -> None:
    x, y, vx, vy = curled(speed, 0.0, DECELERATION, curl, fraction * speed / DECELERATION)
    remaining = max(1.0 - fraction, 0.0)
    turn = cmath.exp(-1j * curl * math.log(remaining)) if remaining else 0.0
    displacement = speed**2 / DECELERATION * (1.0 - remaining**2 * turn) / (2.0 - 1j * curl)
    # here 1 − s^(2−iκ) cancels, and the phase κ·ln s is rounded: 1e-13 of the whole path
    assert complex(x, y) == pytest.approx(displacement, abs=1e-13 * speed**2 / DECELERATION * (1 + abs(curl)))
    # the fraction is accurate to 1e-16; the direction near rest depends on its logarithm
    assert math.hypot(vx, vy) == pytest.approx(speed * remaining, abs=1e-15 * speed)


def test_short_time_form_continues_the_closed_form() -> None:
    times = [fraction * SHORT * 2.0 / DECELERATION for fraction in (1.0 - 1e-9, 1.0 + 1e-9)]
    below, above = (np.asarray(curled(2.0, 0.0, DECELERATION, 0.5, time)) / time for time in times)
    assert above[:2] == pytest.approx(below[:2], abs=1e-14)  # its second-order term is 1e-18


@given(
    spin=st.floats(-3, 3).filter(lambda spin: abs(spin) > 1e-6),
    time=st.floats(0.1, 30),
    parts=st.integers(1, 40),
    heading=st.floats(-math.pi, math.pi),
)
def test_path_in_parts_equals_the_whole_path(spin: float, time: float, parts: int, heading: float) -> None:
    floor = figures_of(Floor(sliding_friction=MU, spinning_friction=0.0004, bodies="pucks", curl=0.3))
    motion = (2.0 * math.cos(heading), 2.0 * math.sin(heading), 0.0, 0.0, spin)
    x, y, angle, last = rolled(motion, 0.145, floor, time)
    px = py = total_angle = 0.0
    for _ in range(parts):
        dx, dy, turn, motion = rolled(motion, 0.145, floor, time / parts)
        px, py, total_angle = px + dx, py + dy, total_angle + turn
    # rounding of 40 parts of 20 m; the direction of a vanishing velocity is ill-conditioned
    assert (px, py, total_angle) == pytest.approx((x, y, angle), abs=1e-12)
    assert motion == pytest.approx(last, abs=1e-12)


def test_puck_without_spin_moves_straight() -> None:
    floor = figures_of(Floor(sliding_friction=MU, spinning_friction=0.001, bodies="pucks", curl=0.3))
    spin_time = 1.0 * 0.145 / (2.0 * 0.001 * G)  # s, until a spin of 1 rad/s has stopped
    assert spin_time < 2.0 / DECELERATION
    _, _, _, (vx, vy, _, _, spin) = rolled((2.0, 0.0, 0.0, 0.0, 1.0), 0.145, floor, spin_time)
    x, y, _, last = rolled((vx, vy, 0.0, 0.0, 0.0), 0.145, floor, 100.0)
    assert spin == pytest.approx(0.0, abs=1e-15)  # rounding
    assert y / x == pytest.approx(vy / vx, rel=1e-14)  # rounding
    assert math.hypot(x, y) == pytest.approx((vx**2 + vy**2) / (2.0 * DECELERATION), rel=1e-14)
    assert last == (0.0, 0.0, 0.0, 0.0, 0.0)
