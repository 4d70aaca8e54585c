"""Free flight in closed form, under uniform gravity, linear drag, lift and damping."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from sandbox.arrays import FloatArray
from sandbox.scene.description.world import World

_SERIES = tuple((-1) ** n / math.factorial(n + 2) for n in range(20))


def free_flight(
    time: FloatArray, position: FloatArray, velocity: FloatArray, world: World, turning: FloatArray | float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities of a body without contacts, under a = g − k (v − wind) − λ v and lift.

    With z = (k + λ) t: v = v₀ e⁻ᶻ + (g + k·wind) t φ₁ and x = x₀ + v₀ t φ₁ + (g + k·wind) t² φ₂, where
    φ₁ = (1 − e⁻ᶻ)/z and φ₂ = (z − 1 + e⁻ᶻ)/z² tend to 1 and ½: no cancellation for small z, and at z = 0 the
    exact parabola.

    With lift, k is k − iΩ and vectors are complex numbers. Without gravity, drag and wind that is a circle of radius
    |v₀/Ω|, with gravity a cycloid that drifts at g/Ω, to the left of gravity for Ω > 0.

    Args:
        time: (T,) s since the start.
        position: (2,) or (N, 2) m, at the start.
        velocity: of the same shape, m/s.
        world: its gravity, linear drag, damping and wind are used.
        turning: () or (N,) Ω, rad/s: lift coefficient times angular velocity.

    Returns:
        Positions and velocities, (T, 2) or (T, N, 2).

    Raises:
        ValueError: the world has quadratic drag, or damping with lift.
    """
    if world.quadratic_drag > 0:
        raise ValueError("free flight under quadratic drag has no closed form")
    if np.any(turning):
        return _lifted_flight(time, position, velocity, world, np.asarray(turning, dtype=np.float64))
    x, v = np.asarray(position, dtype=np.float64), np.asarray(velocity, dtype=np.float64)
    rate = world.linear_drag + world.damping_rate
    pull, wind = np.asarray(world.gravity), np.asarray(world.wind)
    if world.has_damping:  # without damping the wind moves a body at its own velocity in the end
        wind = wind * (world.linear_drag / rate)
    return _flown(time, x, v, rate, pull, wind)


def _lifted_flight(
    time: FloatArray, position: FloatArray, velocity: FloatArray, world: World, turning: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return `free_flight` with lift."""
    if world.has_damping:
        raise ValueError("free flight with lift and damping, which slows the spin, has no closed form")
    x, v = (np.asarray(each, dtype=np.float64) @ (1.0, 1.0j) for each in (position, velocity))
    flown = _flown(time, x, v, world.linear_drag - 1j * turning, complex(*world.gravity), complex(*world.wind))
    positions, velocities = (np.stack((each.real, each.imag), axis=-1) for each in flown)
    return positions, velocities


def _flown(
    time: FloatArray, x: npt.NDArray[Any], v: npt.NDArray[Any], rate: Any, pull: Any, wind: Any
) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return positions and velocities by the formulas of `free_flight`; vectors are rows, or complex numbers."""
    t = np.asarray(time, dtype=np.float64).reshape(-1, *(1,) * x.ndim)
    z = rate * t
    phi_1, phi_2 = _phi(z)
    flown = x + v * (t * phi_1) + pull * (t * t * phi_2) + wind * (t * z * phi_2)
    return flown, v * np.exp(-z) + pull * (t * phi_1) + wind * -np.expm1(-z)


def free_rotation(time: FloatArray, angle: FloatArray, spin: FloatArray, world: World) -> tuple[FloatArray, FloatArray]:
    """Return angles, rad, and angular velocities, rad/s, of bodies that nothing but damping turns: ω̇ = −λ ω.

    Args:
        time: (T,) s since the start.
        angle: () or (N,) rad, at the start.
        spin: of the same shape, rad/s.
        world: its damping is used.

    Returns:
        Angles and angular velocities, (T,) or (T, N).
    """
    w = np.asarray(spin, dtype=np.float64)
    t = np.asarray(time, dtype=np.float64).reshape(-1, *(1,) * w.ndim)
    z = world.damping_rate * t
    return angle + t * _phi(z)[0] * w, np.asarray(w * np.exp(-z))


def _phi(z: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return (1 − e⁻ᶻ)/z and (z − 1 + e⁻ᶻ)/z² for Re z ≥ 0; for |z| < 1 the second is its Taylor series."""
    size = np.abs(z)
    large = np.where(size > 1.0, z, 1.0)
    small = np.where(size < 1.0, z, 1.0)
    series = np.zeros_like(z)
    for coefficient in reversed(_SERIES):
        series = series * small + coefficient
    nonzero = np.where(size > 0, z, 1.0)
    first = np.where(size > 0, -np.expm1(-nonzero) / nonzero, 1.0)
    # Two divisions, because a square could overflow.
    return first, np.where(size < 1, series, (large + np.expm1(-large)) / large / large)
