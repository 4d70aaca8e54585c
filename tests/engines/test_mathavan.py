"""Mathavan's cushion model: limits, laws and results of another program."""

import math
from itertools import pairwise

import numpy as np
import pytest

from sandbox.engines.tabletop import collisions as module
from sandbox.engines.tabletop.collisions import MATHAVAN2010, Five, collide_cushion

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of tables

R = 0.028575
SCALE = np.asarray([1.0, 1.0, R, R, R])  # spins as surface speeds, m/s

POOLTOOL = [
    ((0.41, 0.58, 36.15, 9.86, -48.7), 1.26, (0.215, -0.49256, 20.7996, 6.37061, -32.9517)),
    ((1.21, 1.19, 28.15, -46.36, -13.05), 1.28, (0.72012, -0.96515, -0.95632, -38.71877, 13.36327)),
    ((-0.32, 1.54, 28.54, 54.75, -25.9), 1.31, (-0.35256, -1.21381, -13.16808, 27.45744, -4.02467)),
    ((1.05, 1.98, -59.82, 56.82, -24.19), 1.23, (0.5313, -1.65721, -14.41512, 41.45376, 23.87338)),
    ((-0.54, 2.68, -3.44, 32.79, -56.36), 1.33, (-0.66616, -2.01453, -23.13257, -0.52509, -24.88043)),
    ((1.17, 0.83, 19.26, 51.78, -35.14), 1.31, (0.92495, -0.66744, 10.39523, 38.42011, -9.88426)),
]
"""Velocity and spin before, height of the nose in radii, velocity and spin after, from pooltool 0.6.0,
`mathavan_2010.model.solve`: e = 0.85, both frictions 0.2, into +y, in steps of 2e-5 N·s at 1 kg."""


def rebound(a: Five, height: float, e: float = 0.85, friction: float = 0.2, sliding: float = 0.2) -> Five:
    return collide_cushion(MATHAVAN2010, e, friction, sliding, a, R, height, 0.0, 1.0)


@pytest.mark.parametrize(("before", "height", "after"), POOLTOOL)
def test_results_match_pooltool(before: Five, height: float, after: Five) -> None:
    error = np.abs((np.asarray(rebound(before, height * R)) - np.asarray(after)) * SCALE)
    assert error.max() < 2e-3  # m/s: some thousand steps of 2e-5 m/s, and the times at which slip ends


@pytest.mark.parametrize("height", [0.8 * R, R, 1.28 * R])
def test_without_friction_only_the_normal_changes(height: float) -> None:
    after = rebound((0.7, 1.3, 5.0, -6.0, 7.0), height, friction=0.0, sliding=0.0)
    assert after == pytest.approx((0.7, -0.85 * 1.3, 5.0, -6.0, 7.0), rel=1e-6)  # one step of 2,000 is partial


def test_mirrored_ball_rebounds_mirrored() -> None:
    a, b = rebound((1.2, 1.0, -30.0, 40.0, 20.0), 1.28 * R), rebound((-1.2, 1.0, -30.0, -40.0, -20.0), 1.28 * R)
    assert a == pytest.approx((-b[0], b[1], b[2], -b[3], -b[4]), rel=1e-12)  # the same sums


def test_rebound_is_invariant_under_rotation() -> None:
    rotation = 0.7
    cos, sin = math.cos(rotation), math.sin(rotation)

    def rotated(a: Five) -> Five:
        return cos * a[0] - sin * a[1], sin * a[0] + cos * a[1], cos * a[2] - sin * a[3], sin * a[2] + cos * a[3], a[4]

    before: Five = (1.2, 1.0, -30.0, 40.0, 20.0)
    found = collide_cushion(MATHAVAN2010, 0.85, 0.2, 0.2, rotated(before), R, 1.28 * R, -sin, cos)
    assert found == pytest.approx(rotated(rebound(before, 1.28 * R)), rel=1e-9)  # rounding of 4,000 steps


def test_smaller_steps_converge(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = getattr(module.mathavan2010, "py_func", module.mathavan2010)
    results = []
    for steps in (250, 500, 1000, 2000):
        monkeypatch.setattr(module, "STEPS", steps)
        results.append(np.asarray(solve(0.85, 0.2, 0.2, (1.2, 1.0, -30.0, 40.0, 20.0), R, 1.28 * R, 0.0, 1.0)) * SCALE)
    gaps = [float(np.abs(a - b).max()) for a, b in pairwise(results)]
    orders = np.log2(np.divide(gaps[:-1], gaps[1:]))
    assert np.abs(orders - 1.0).max() < 0.2
