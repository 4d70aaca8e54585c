"""Cushion collisions do not increase energy, for any friction and nose height."""

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.engines.tabletop.collisions import HAN2005, MATHAVAN2010, SIMPLE, Five, collide_cushion

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

R = 0.03

fractions = st.floats(0.0, 1.0)
frictions = st.sampled_from([0.0, 0.2, 1.0, 30.0, 1000.0])
noses = st.one_of(st.floats(0.1, 1.9), st.sampled_from([1e-17, 1e-12, 1e-4, 1.999999]))
spins = st.floats(-5.0, 5.0)


def energy(motion: Five) -> float:
    vx, vy, wx, wy, wz = motion
    return 0.5 * (vx * vx + vy * vy) + 0.2 * R * R * (wx * wx + wy * wy + wz * wz)


@pytest.mark.parametrize("model", [SIMPLE, HAN2005, MATHAVAN2010])
@given(fractions, frictions, frictions, noses, st.floats(-1.5, 1.5), st.tuples(spins, spins, spins))
@example(0.85, 1000.0, 1000.0, 1.5, 1.2, (1.0, -2.0, 3.0))  # the slip changed sign in each step, with growing magnitude
@example(1.0, 0.2, 0.2, 1e-17, 0.1, (0.0, 0.0, 0.0))  # a nose at floor height exerts no normal impulse
def test_cushion_does_not_increase_energy(
    model: int, e: float, friction: float, grip: float, nose: float, angle: float, rims: tuple[float, float, float]
) -> None:
    before = (math.cos(angle), math.sin(angle), *(rim / R for rim in rims))
    after = collide_cushion(model, e, friction, grip, before, R, nose * R, 1.0, 0.0)
    assert energy(after) <= energy(before) * (1.0 + 1e-12)  # rounding of about a thousand steps
