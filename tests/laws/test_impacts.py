"""What two bodies may do to each other, however it is computed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.laws.ways import HARD, SOFT, Way, named, pair

ROUNDING = 1e-11  # 60 roundings of 1e-16, amplified by mass ratios up to 1e3
speeds = st.floats(0.2, 3.0)
restitutions = st.sampled_from([0.0, 0.3, 0.5, 0.8, 1.0])
masses = st.tuples(st.floats(0.1, 100.0), st.floats(0.1, 100.0))
offsets = st.floats(-0.9, 0.9)


def after(way: Way, scene):
    done = way.run(scene)
    assert len(done.contact_time) == 1
    return done, done.velocity[0], done.velocity[-1]


@named(HARD)
@settings(max_examples=12)
@given(e=restitutions, mass=masses, offset=offsets, speed=speeds)
def test_momentum_is_kept_and_the_parting_speed_is_e_times_the_approach(way, e, mass, offset, speed):
    done, before, now = after(way, pair(e, mass, offset, speed))
    m = np.asarray(mass)[:, None]
    scale = float(np.abs(m * before).sum())
    assert np.abs((m * (now - before)).sum(axis=0)).max() <= ROUNDING * scale
    normal = done.contact_normal[0]
    approach, parting = (before[0] - before[1]) @ normal, (now[1] - now[0]) @ normal
    assert parting == pytest.approx(e * approach, abs=ROUNDING * speed)
    tangent = np.array([-normal[1], normal[0]])
    assert np.abs((now - before) @ tangent).max() <= ROUNDING * speed  # nothing rubs


@named(HARD)
@settings(max_examples=8)
@given(e=restitutions, mass=masses, offset=offsets, speed=speeds, mu=st.sampled_from([0.05, 0.5, 10.0]))
def test_friction_stays_in_its_cone_keeps_angular_momentum_and_never_reverses_slip(way, e, mass, offset, speed, mu):
    done, before, now = after(way, pair(e, mass, offset, speed, friction=mu))
    normal, impulse = done.contact_normal[0], done.contact_impulse[0]
    tangent = np.array([-normal[1], normal[0]])
    pushed, rubbed = impulse @ normal, impulse @ tangent
    assert pushed > 0
    assert abs(rubbed) <= mu * pushed * (1 + ROUNDING)
    m, moment, spin = np.asarray(mass), 0.5 * np.asarray(mass) * 0.25, done.angular_velocity[-1]

    # Angular momentum about the point where they touched; each centre is half a contact distance from it.
    turned = moment @ spin + 0.5 * (m[1] * (now[1] - before[1]) - m[0] * (now[0] - before[0])) @ tangent
    assert abs(turned) <= ROUNDING * float(np.abs(m[:, None] * before).sum())
    slip_before = (before[1] - before[0]) @ tangent
    slip = (now[1] - now[0]) @ tangent - 0.5 * (spin[0] + spin[1])
    assert slip * slip_before >= -ROUNDING * speed**2
    if abs(rubbed) < mu * pushed * (1 - 1e-9):  # inside the cone: it sticks
        assert abs(slip) <= ROUNDING * speed


@named(HARD)
@settings(max_examples=6)
@given(e=restitutions, mass=masses, offset=offsets, speed=speeds)
def test_kinetic_energy_is_lost_by_the_formula(way, e, mass, offset, speed):
    """½ m_red (1 − e²) times the square of the approach along the normal."""
    done, before, now = after(way, pair(e, mass, offset, speed))
    m = np.asarray(mass)
    reduced = m[0] * m[1] / m.sum()
    approach = (before[0] - before[1]) @ done.contact_normal[0]
    lost = 0.5 * m @ (before**2).sum(axis=1) - 0.5 * m @ (now**2).sum(axis=1)
    scale = 0.5 * m[0] * speed**2
    assert lost == pytest.approx(0.5 * reduced * (1 - e * e) * approach**2, abs=ROUNDING * scale)


@named([*HARD, SOFT])
def test_impulses_on_record_are_the_change_of_momentum(way):
    scene = pair(0.8, (3.0, 0.7), 0.4, 2.0, friction=0.3)
    done = way.run(scene)
    change = scene.bodies.mass[1] * (done.velocity[-1, 1] - done.velocity[0, 1])
    np.testing.assert_allclose(done.contact_impulse.sum(axis=0), change, atol=1e-12)  # of 1 N·s, by some 50 roundings


@named(HARD)
@pytest.mark.parametrize("ratio", [1e-12, 1e-6, 1.0, 1e6, 1e12])
def test_two_balls_of_any_masses_part_by_the_formula(way, ratio):
    """Case 10: v₁′ = (m₁ − e m₂) v/M, v₂′ = (1 + e) m₁ v/M."""
    e, m1, m2, v = 0.7, ratio, 1.0, 1.5
    _, _, now = after(way, pair(e, (m1, m2), 0.0, v))
    # Impulses are found from the two masses by two divisions and some sums: relative to the faster of the two.
    tolerance = 1e-13 * v * max(1.0, 1.0 / min(ratio, 1.0) * 1e-3)
    expected = np.array([(m1 - e * m2) * v / (m1 + m2), (1 + e) * m1 * v / (m1 + m2)])
    np.testing.assert_allclose(now[:, 0], expected, rtol=1e-12, atol=min(tolerance, 1e-12 * v))


@named(HARD)
def test_equal_elastic_balls_part_at_a_right_angle(way):
    """Case 11. The cosine is a sum of two products of rounded velocities: some units of 1e-16."""
    _, _, now = after(way, pair(1.0, (1.0, 1.0), 0.5, 2.0))
    assert abs(now[0] @ now[1]) <= 1e-14 * np.linalg.norm(now[0]) * np.linalg.norm(now[1])


def test_soft_impact_has_nearly_the_restitution_of_the_pair():
    """Springs reach it as h → 0; at 30 substeps a contact within 2 %."""
    for e in (0.3, 0.8, 1.0):
        done, before, now = after(SOFT, pair(e, (1.0, 2.0), 0.3, 1.0))
        normal = done.contact_normal[0]
        ratio = ((now[1] - now[0]) @ normal) / ((before[0] - before[1]) @ normal)
        assert ratio == pytest.approx(e, rel=0.02)
