"""Collisions of pucks: momentum, angular momentum, restitution and the friction cone."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest import approx

from sandbox.engines.tabletop.collisions import STILL, Five, collide_pucks

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of tables

SPEED, SIZE = st.floats(-10, 10), st.floats(0.01, 10)
MOTION = st.tuples(SPEED, SPEED, st.just(0.0), st.just(0.0), SPEED)


def energy(motion: Five, mass: float, radius: float) -> float:
    vx, vy, _, _, spin = motion
    return 0.5 * mass * (vx * vx + vy * vy) + 0.25 * mass * radius * radius * spin * spin


@given(
    a=MOTION, b=MOTION, masses=st.tuples(SIZE, SIZE), radii=st.tuples(SIZE, SIZE), angle=st.floats(-4, 4),
    restitution=st.floats(0, 1), friction=st.floats(0, 2),
)  # fmt: skip
def test_collision_of_pucks_obeys_the_laws(
    a: Five, b: Five, masses: tuple[float, float], radii: tuple[float, float], angle: float,
    restitution: float, friction: float,
) -> None:  # fmt: skip
    (ma, mb), (ra, rb), n = masses, radii, (math.cos(angle), math.sin(angle))
    closing = (a[0] - b[0]) * n[0] + (a[1] - b[1]) * n[1]
    if closing < 0.0:
        a, b, closing = (-a[0], -a[1], *a[2:]), (-b[0], -b[1], *b[2:]), -closing
    c, d = collide_pucks(restitution, friction, a, b, (1 / ma, 1 / mb), radii, *n)
    rounding = 1e-12 * (ma + mb) * 200  # rounding of sums of momenta and energies of up to 200 times the masses
    for k in (0, 1):
        assert ma * c[k] + mb * d[k] == approx(ma * a[k] + mb * b[k], abs=rounding)
    separation_speed = (d[0] - c[0]) * n[0] + (d[1] - c[1]) * n[1]
    assert separation_speed == approx(restitution * closing, abs=1e-11)  # rounding of speeds of 20 m/s, masses 1000:1
    jx, jy = ma * (a[0] - c[0]), ma * (a[1] - c[1])
    normal_impulse, friction_impulse = jx * n[0] + jy * n[1], jy * n[0] - jx * n[1]
    assert abs(friction_impulse) <= friction * normal_impulse + rounding
    # Friction turns both in the same direction, by r·J / I = 2·J / (m·r). Accuracy: 1e-14 m/s over a radius.
    assert c[4] == approx(a[4] - 2.0 * friction_impulse / (ma * ra), abs=1e-11)
    other = mb * ((d[1] - b[1]) * n[0] - (d[0] - b[0]) * n[1])
    assert d[4] == approx(b[4] - 2.0 * other / (mb * rb), abs=1e-11)
    slip = (a[1] - b[1]) * n[0] - (a[0] - b[0]) * n[1] + ra * a[4] + rb * b[4]
    final_slip = (c[1] - d[1]) * n[0] - (c[0] - d[0]) * n[1] + ra * c[4] + rb * d[4]
    assert final_slip * slip >= -1e-9  # slip may end but never reverses
    assert abs(final_slip) <= abs(slip) + 1e-10  # rounding
    assert energy(c, ma, ra) + energy(d, mb, rb) <= energy(a, ma, ra) + energy(b, mb, rb) + rounding * radii[0] ** 2


def test_immovable_body_rebounds_a_puck_with_its_restitution() -> None:
    after, wall = collide_pucks(0.5, 0.0, (2.0, 1.0, 0.0, 0.0, 3.0), STILL, (2.0, 0.0), (0.1, 0.0), 1.0, 0.0)
    assert after == (-1.0, 1.0, 0.0, 0.0, 3.0)
    assert wall == STILL


def test_rough_wall_ends_the_slip_of_a_puck() -> None:
    (_, vy, _, _, spin), _ = collide_pucks(
        0.5, 100.0, (2.0, 1.0, 0.0, 0.0, 0.0), STILL, (2.0, 0.0), (0.1, 0.0), 1.0, 0.0
    )
    assert vy == approx(2.0 / 3.0, rel=1e-15)  # a disc keeps two thirds
    assert vy + 0.1 * spin == approx(0.0, abs=1e-15)  # rounding
