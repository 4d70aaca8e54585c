"""Jacobi's functions and the integrals that they invert, against scipy and 40-digit arithmetic."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipj, ellipkm1

from sandbox.measure.analytic.elliptic import first_kind, jacobi, quarter_period

MODULI = [0.0, 1e-12, 0.3, 0.5, 0.9, 0.99240388, 1.0 - 1e-9, 1.0]


@pytest.mark.parametrize("m", MODULI)
def test_jacobi_functions_agree_with_scipy(m: float) -> None:
    u = np.linspace(-12.0, 12.0, 97)
    own, (sn, cn, dn, am) = jacobi(u, m, 1.0 - m), ellipj(u, m)
    # The error is scipy's: near m = 1 it switches to a series that is accurate to about 1e-9.
    tolerance = 2e-8 if 1.0 - 1e-8 < m < 1.0 else 2e-13
    for mine, theirs in zip(own, (am, sn, cn, dn), strict=True):
        assert mine == pytest.approx(theirs, abs=tolerance)


@pytest.mark.parametrize("m1", [1e-30, 1e-9, 1e-3, 0.5])
def test_jacobi_functions_agree_with_40_digits_near_parameter_1(m1: float) -> None:
    u = np.array([0.0, 0.1, 1.0, 3.3, 9.0])
    own = jacobi(u, 1.0 - m1, m1)
    with mpmath.workdps(40):
        m = 1 - mpmath.mpf(m1)
        expected = [[float(mpmath.ellipfun(name, x, m=m)) for x in u.tolist()] for name in ("sn", "cn", "dn")]
    for mine, exact in zip(own[1:], expected, strict=True):
        # About ten roundings of numbers near 1; arc sines near ½π magnify them unless 1 − m is close to rounding to 0.
        assert mine == pytest.approx(exact, abs=4e-15 if m1 > 1e-10 else 2e-12)


@pytest.mark.parametrize("m1", [0.0, 1e-300, 1e-20, 1e-6, 0.1, 0.5, 1.0])
def test_quarter_period_agrees_with_scipy(m1: float) -> None:
    assert quarter_period(m1) == pytest.approx(float(ellipkm1(m1)), rel=1e-15)  # a few roundings


@given(angle=st.floats(-3.1, 3.1), m1=st.floats(1e-6, 1.0))
def test_amplitude_inverts_the_elliptic_integral(angle: float, m1: float) -> None:
    u = first_kind(math.sin(angle), math.cos(angle), 1.0 - m1, m1)
    # 1 − m is at least 1e-6 and rounds by 1e-16; u depends on its logarithm.
    assert float(jacobi(np.array([u]), 1.0 - m1, m1).amplitude[0]) == pytest.approx(angle, abs=1e-12)


def test_elliptic_integral_to_the_top_diverges_on_the_separatrix() -> None:
    assert first_kind(1.0, 0.0, 1.0, 0.0) == math.inf
    assert first_kind(math.sin(1.0), math.cos(1.0), 1.0, 0.0) == pytest.approx(math.asinh(math.tan(1.0)), rel=1e-15)
