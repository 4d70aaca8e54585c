"""Tilt bob, against closed forms and against a numerical integrator."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sandbox.games.pinball.tilt import (
    BOB_LENGTH,
    DAMPING_RATIO,
    GRAVITY,
    JOLT_ACCELERATION,
    JOLT_TIME,
    TRIP_ANGLE,
    TiltBob,
)

OMEGA = math.sqrt(GRAVITY / BOB_LENGTH)
PERIOD = 2.0 * math.pi / OMEGA


def amplitude(bob: TiltBob) -> float:
    """Return the amplitude of the free swing of an undamped bob, rad."""
    return math.hypot(abs(bob.angle), abs(bob.rate) / OMEGA)


def bob_without_ring(damping: float = 0.0) -> TiltBob:
    """Return a bob without a ring."""
    return TiltBob(damping, math.inf)


@given(st.floats(0.01, 10.0), st.floats(0.001, 0.5))
def test_push_gives_the_amplitude_of_the_closed_form(push: float, seconds: float) -> None:
    bob = bob_without_ring()
    bob.swing(seconds, push)
    expected = 2.0 * push / GRAVITY * abs(math.sin(OMEGA * seconds / 2.0))
    assert amplitude(bob) == pytest.approx(expected, abs=1e-12 * push)  # rounding of 500 exact substeps


def test_swing_agrees_with_a_numerical_integrator() -> None:
    bob = TiltBob(DAMPING_RATIO, math.inf)
    bob.swing(JOLT_TIME, complex(3.0, -2.0))
    bob.swing(0.3, 0j)
    for axis, push in (("real", 3.0), ("imag", -2.0)):

        def rates(t: float, y: np.ndarray, push: float = push) -> list[float]:
            drive = push if t < JOLT_TIME else 0.0
            return [y[1], -(OMEGA**2) * y[0] - 2.0 * DAMPING_RATIO * OMEGA * y[1] - drive / BOB_LENGTH]

        pushed = solve_ivp(rates, (0.0, JOLT_TIME), [0.0, 0.0], rtol=1e-11, atol=1e-13, max_step=JOLT_TIME / 10)
        end = solve_ivp(
            lambda t, y: rates(JOLT_TIME, y), (0.0, 0.3), pushed.y[:, -1], rtol=1e-11, atol=1e-13
        )  # fmt: skip
        assert getattr(bob.angle, axis) == pytest.approx(end.y[0, -1], abs=1e-7)  # error of the integrator at 25 ms


def test_full_nudge_has_seven_degrees_amplitude_and_strikes_the_ring_at_its_end() -> None:
    bob = bob_without_ring()
    bob.swing(JOLT_TIME, JOLT_ACCELERATION)
    assert math.degrees(amplitude(bob)) == pytest.approx(7.08, abs=0.01)  # rounding of the constant
    assert math.degrees(abs(bob.angle)) == pytest.approx(0.874, abs=0.001)  # rounding of the constant
    with_ring = TiltBob(0.0)
    assert with_ring.swing(JOLT_TIME, JOLT_ACCELERATION) == 0
    assert with_ring.swing(0.005, 0j) == 1


def test_smallest_push_that_trips_is_a_seventh_of_a_nudge() -> None:
    least = TRIP_ANGLE * GRAVITY / (2.0 * math.sin(OMEGA * JOLT_TIME / 2.0))
    assert least / JOLT_ACCELERATION == pytest.approx(0.1413, abs=1e-4)  # rounding of the constant
    for factor, strokes in ((0.995, 0), (1.005, 1)):  # the ring is tested every 1 ms, near the maximum of the swing
        bob = TiltBob(0.0)
        bob.swing(JOLT_TIME, factor * least)
        assert bob.swing(PERIOD / 2.0, 0j) == strokes


@pytest.mark.parametrize(("later", "trips"), [(PERIOD, True), (PERIOD / 2.0, False)])
def test_two_small_pushes_trip_only_in_phase(later: float, trips: bool) -> None:
    small = 0.6 * TRIP_ANGLE * GRAVITY / (2.0 * math.sin(OMEGA * JOLT_TIME / 2.0))
    bob = TiltBob(0.0)
    strokes = bob.swing(JOLT_TIME, small) + bob.swing(later - JOLT_TIME, 0j)
    assert strokes == 0
    strokes = bob.swing(JOLT_TIME, small) + bob.swing(PERIOD, 0j)
    assert (strokes > 0) is trips


@given(st.complex_numbers(max_magnitude=20.0), st.floats(0.001, 0.2))
def test_bob_never_leaves_the_ring(push: complex, seconds: float) -> None:
    bob = TiltBob()
    for acceleration in (push, -push, 0j):
        bob.swing(seconds, acceleration)
        assert abs(bob.angle) <= TRIP_ANGLE * (1.0 + 1e-12)  # rounding of a unit vector


def test_bob_comes_to_rest() -> None:
    bob = TiltBob()
    bob.swing(JOLT_TIME, JOLT_ACCELERATION)
    assert not bob.still
    bob.swing(15.0 * PERIOD, 0j)  # e^(−2π·.05·15) = 0.9 %, of at most the 0.017 rad of the ring
    assert abs(bob.angle) < 0.01 * TRIP_ANGLE
    bob.swing(30.0 * PERIOD, 0j)
    assert bob.still
