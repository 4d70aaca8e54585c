"""Jacobi's elliptic functions sn, cn, dn and the incomplete integral of the first kind, by arithmetic-geometric means.

m = k² is the parameter and m₁ = 1 − m its complement. Functions take both, because a small one does not follow from the
other. Sources: Abramowitz & Stegun 1964, 16.4 and 17.6; Carlson 1995, "Numerical computation of real or complex
elliptic integrals", for the incomplete integral.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray

CONVERGED = 1e-9
"""Relative difference whose square, the next difference, is below rounding."""
SMALL = 2e-3
"""Carlson's series is truncated after the fifth order in this: the error is 64e-18."""


class Jacobi(NamedTuple):
    """The functions at T arguments."""

    amplitude: FloatArray
    """am u, rad, which grows without bound"""
    sn: FloatArray
    cn: FloatArray
    dn: FloatArray


def quarter_period(m1: float) -> float:
    """Return K(m), the quarter period of sn; inf at m = 1.

    Args:
        m1: 1 − m, 0…1.
    """
    if m1 == 0.0:
        return math.inf
    a, b = 1.0, math.sqrt(m1)
    while a - b > CONVERGED * a:
        mean = 0.5 * (a + b)
        a, b = mean, math.sqrt(a * b)
    return math.pi / (a + b)


def jacobi(u: FloatArray, m: float, m1: float) -> Jacobi:
    """Return Jacobi's elliptic functions by descending Landen transformations.

    Args:
        u: (T,)
        m: 0…1.
        m1: 1 − m, as accurate as it is known.
    """
    if m1 == 0.0:  # sn is a hyperbolic tangent, and am Gudermann's function
        with np.errstate(over="ignore"):
            flat = 1.0 / np.cosh(u)
        return Jacobi(2.0 * np.arctan(np.tanh(0.5 * u)), np.tanh(u), flat, flat)
    a, b, c = [1.0], math.sqrt(m1), [math.sqrt(m)]
    while c[-1] > CONVERGED * CONVERGED * a[-1]:
        mean = 0.5 * (a[-1] + b)
        # Half the difference, without its cancellation.
        half = 0.25 * c[-1] * c[-1] / mean
        b = math.sqrt(a[-1] * b)
        a.append(mean)
        c.append(half)
    half_turns = np.round(u * (a[-1] / math.pi))  # in half periods of sn, 2 K
    phi = 2.0 ** (len(a) - 1) * (a[-1] * u - math.pi * half_turns)
    for k in range(len(a) - 1, 0, -1):
        phi = 0.5 * (phi + np.arcsin((c[k] / a[k]) * np.sin(phi)))
    sign = np.where(np.mod(half_turns, 2.0) == 0.0, 1.0, -1.0)
    sn, cn = sign * np.sin(phi), sign * np.cos(phi)
    return Jacobi(phi + math.pi * half_turns, sn, cn, np.sqrt(m1 + m * cn * cn))


def first_kind(sine: float, cosine: float, m: float, m1: float) -> float:
    """Return F(φ | m), the incomplete integral of the first kind; ± inf where it diverges.

    Args:
        sine: sin φ, with φ from −π to π; given as both so that neither end of a swing loses digits.
        cosine: cos φ.
        m: 0…1.
        m1: 1 − m.
    """
    if m1 == 0.0:
        if cosine <= 0.0:
            return math.copysign(math.inf, sine)
        return math.asinh(sine / cosine)
    part = abs(sine) * _carlson(cosine * cosine, m1 + m * cosine * cosine, 1.0)
    return math.copysign(part if cosine >= 0.0 else 2.0 * quarter_period(m1) - part, sine)


def _carlson(x: float, y: float, z: float) -> float:
    """Return R_F(x, y, z) by duplication."""
    while True:
        mean = (x + y + z) / 3.0
        dx, dy = 1.0 - x / mean, 1.0 - y / mean
        dz = -dx - dy
        if max(abs(dx), abs(dy), abs(dz)) < SMALL:
            break
        rx, ry, rz = math.sqrt(x), math.sqrt(y), math.sqrt(z)
        shift = rx * ry + ry * rz + rz * rx
        x, y, z = 0.25 * (x + shift), 0.25 * (y + shift), 0.25 * (z + shift)
    second, third = dx * dy - dz * dz, dx * dy * dz
    series = 1.0 - second / 10.0 + third / 14.0 + second * second / 24.0 - 3.0 * second * third / 44.0
    return series / math.sqrt(mean)
