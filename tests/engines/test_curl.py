"""The way of a puck that curls: its closed form against integration, and against itself in parts."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sandbox.engines.tabletop.motion import SHORT, curled, figures_of, rolled
from sandbox.scene.description.surface import Floor

pytestmark = pytest.mark.full  # long runs and sweeps

G, MU = 9.81, 0.01
SLOWING = MU * G


@pytest.mark.parametrize("curl", [0.07, -0.4, 3.0])
@pytest.mark.parametrize("share", [1e-7, 0.3, 0.9, 0.999])
def test_the_closed_form_is_what_the_law_integrates_to(curl: float, share: float) -> None:
    vx, vy = 1.2, -1.9
    time = share * math.hypot(vx, vy) / SLOWING

    def law(_: float, state: list[float]) -> list[float]:
        _, _, x, y = state
        speed = math.hypot(x, y)
        return [x, y, SLOWING * (-x - curl * y) / speed, SLOWING * (-y + curl * x) / speed]

    found = solve_ivp(law, (0.0, time), [0.0, 0.0, vx, vy], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    # what the oracle itself is right to, over up to 27 m; the velocity turns by up to 21 rad where 1/1000 is left
    assert np.asarray(curled(vx, vy, SLOWING, curl, time)) == pytest.approx(found, abs=1e-9)


@given(curl=st.floats(-10, 10), speed=st.floats(1e-3, 100), share=st.floats(0, 1.2))
def test_the_closed_form_is_the_one_of_complex_numbers(curl: float, speed: float, share: float) -> None:
    x, y, vx, vy = curled(speed, 0.0, SLOWING, curl, share * speed / SLOWING)
    left = max(1.0 - share, 0.0)
    turn = cmath.exp(-1j * curl * math.log(left)) if left else 0.0
    way = speed**2 / SLOWING * (1.0 - left**2 * turn) / (2.0 - 1j * curl)
    # here 1 − s^(2−iκ) cancels, and a phase of κ·ln s carries its rounding: 1e-13 of the whole way
    assert complex(x, y) == pytest.approx(way, abs=1e-13 * speed**2 / SLOWING * (1 + abs(curl)))
    # the share itself is known to 1e-16, of which the direction near rest is the logarithm
    assert math.hypot(vx, vy) == pytest.approx(speed * left, abs=1e-15 * speed)


def test_the_short_form_continues_the_long_one() -> None:
    times = [share * SHORT * 2.0 / SLOWING for share in (1.0 - 1e-9, 1.0 + 1e-9)]
    below, above = (np.asarray(curled(2.0, 0.0, SLOWING, 0.5, time)) / time for time in times)
    assert above[:2] == pytest.approx(below[:2], abs=1e-14)  # its second-order term is 1e-18


def test_it_comes_to_rest_at_the_whole_way_and_no_later() -> None:
    whole = 2.3**2 / SLOWING / (2.0 - 0.08j)
    for late in (1.0, 1.5):
        x, y, vx, vy = curled(2.3, 0.0, SLOWING, 0.08, late * 2.3 / SLOWING)
        assert complex(x, y) == pytest.approx(whole, rel=1e-15)  # rounding
        assert (vx, vy) == (0.0, 0.0)
    assert whole.imag == pytest.approx(1.077, abs=1e-3)  # about 1 m, as stones do over 27 m


@given(
    spin=st.floats(-3, 3).filter(lambda spin: abs(spin) > 1e-6),
    time=st.floats(0.1, 30),
    parts=st.integers(1, 40),
    heading=st.floats(-math.pi, math.pi),
)
def test_a_way_in_parts_is_the_whole_way(spin: float, time: float, parts: int, heading: float) -> None:
    floor = figures_of(Floor(sliding_friction=MU, spinning_friction=0.0004, bodies="pucks", curl=0.3))
    motion = (2.0 * math.cos(heading), 2.0 * math.sin(heading), 0.0, 0.0, spin)
    x, y, angle, last = rolled(motion, 0.145, floor, time)
    px = py = turned = 0.0
    for _ in range(parts):
        dx, dy, more, motion = rolled(motion, 0.145, floor, time / parts)
        px, py, turned = px + dx, py + dy, turned + more
    # rounding of 40 parts of 20 m; in its last moments a direction is that of a velocity which is hardly there
    assert (px, py, turned) == pytest.approx((x, y, angle), abs=1e-12)
    assert motion == pytest.approx(last, abs=1e-12)


def test_who_no_longer_turns_goes_straight_on() -> None:
    floor = figures_of(Floor(sliding_friction=MU, spinning_friction=0.001, bodies="pucks", curl=0.3))
    stops = 1.0 * 0.145 / (2.0 * 0.001 * G)  # s, when a spin of 1 rad/s is gone
    assert stops < 2.0 / SLOWING
    _, _, _, (vx, vy, _, _, spin) = rolled((2.0, 0.0, 0.0, 0.0, 1.0), 0.145, floor, stops)
    x, y, _, last = rolled((vx, vy, 0.0, 0.0, 0.0), 0.145, floor, 100.0)
    assert spin == pytest.approx(0.0, abs=1e-15)  # rounding
    assert y / x == pytest.approx(vy / vx, rel=1e-14)  # rounding
    assert math.hypot(x, y) == pytest.approx((vx**2 + vy**2) / (2.0 * SLOWING), rel=1e-14)
    assert last == (0.0, 0.0, 0.0, 0.0, 0.0)
