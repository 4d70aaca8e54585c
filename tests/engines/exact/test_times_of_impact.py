"""Near-grazing pairs: events are found exactly when rational arithmetic finds them."""

import math
from fractions import Fraction

import numpy as np
import pytest

from sandbox.engines.exact.common.roots import line_entry, pair_entry


def touches(dx, dy, vx, vy, reach):
    """Return, by rational arithmetic, whether two approaching circles collide."""
    dx, dy, vx, vy, reach = (Fraction(float(each)) for each in (dx, dy, vx, vy, reach))
    cross = dx * vy - dy * vx
    return dx * vx + dy * vy < 0 and (vx * vx + vy * vy) * reach * reach > cross * cross


@pytest.mark.fail_slow(60)  # takes over half a second
def test_20000_near_grazing_pairs_match_exact_arithmetic():
    random = np.random.default_rng(5)
    wrong = hits = 0
    for _ in range(20_000):
        distance, heading = 10 ** random.uniform(0.5, 2), random.uniform(0, 2 * math.pi)
        # The path passes the centre at a distance of 1 ± 1e-13 to 1e-9 radii.
        miss = 1.0 + random.choice([-1, 1]) * 10 ** random.uniform(-13, -9)
        along = math.sqrt(distance**2 - miss**2)
        ux, uy = math.cos(heading), math.sin(heading)
        dx, dy = along * ux - miss * uy, along * uy + miss * ux
        speed = 10 ** random.uniform(-2, 2)
        vx, vy = -speed * ux, -speed * uy
        found = pair_entry(dx, dy, vx, vy, 1.0, speed)
        hit = touches(dx, dy, vx, vy, 1.0)
        hits += hit
        wrong += (found < math.inf) != hit
        if hit and found < math.inf:
            gap = math.hypot(dx + vx * found, dy + vy * found) - 1.0
            assert abs(gap) < 1e-13 * distance  # coordinates up to 100 round at 1e-14
    assert 5_000 < hits < 15_000
    assert wrong == 0


@pytest.mark.parametrize("gravity", [9.81, 0.0, -9.81])
def test_leaving_a_plane_is_not_hitting_it(gravity):
    for c in (0.0, 1e-17, 1e-12):
        tau = line_entry(c, 3.0, -gravity)
        assert tau == (pytest.approx(6.0 / gravity, rel=1e-12) if gravity > 0 else math.inf)  # c moves it by c/3


def test_line_entry_is_accurate_where_naive_roots_lose_all_digits():
    # c + b τ + a τ²/2 with b² ≫ 2 a c: the naive form subtracts two numbers that agree in all digits.
    assert line_entry(1e-9, -1e5, -9.81) == pytest.approx(1e-14, rel=1e-15)
    assert line_entry(5.0, 0.0, -9.81) == pytest.approx(math.sqrt(10 / 9.81), rel=1e-15)
    assert line_entry(5.0, -1.0, 9.81) == math.inf  # turns back before it arrives
