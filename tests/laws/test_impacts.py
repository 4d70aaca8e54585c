"""Laws of the impact of two bodies, in every configuration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.laws.engine_configs import IMPULSE_CONFIGS, PENALTY, EngineConfig, each_config, pair

ROUNDING = 1e-11  # 60 rounding errors of 1e-16, amplified by mass ratios up to 1e3
speeds = st.floats(0.2, 3.0)
restitutions = st.sampled_from([0.0, 0.3, 0.5, 0.8, 1.0])
masses = st.tuples(st.floats(0.1, 100.0), st.floats(0.1, 100.0))
offsets = st.floats(-0.9, 0.9)


def collide(config: EngineConfig, scene):
    result = config.run(scene)
    assert len(result.contact_time) == 1
    return result, result.velocity[0], result.velocity[-1]


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config(IMPULSE_CONFIGS)
@settings(max_examples=12)
@given(e=restitutions, mass=masses, offset=offsets, speed=speeds)
def test_momentum_is_conserved_and_separation_speed_is_e_times_approach(config, e, mass, offset, speed):
    result, before, now = collide(config, pair(e, mass, offset, speed))
    m, rounding = np.asarray(mass)[:, None], config.impact_rounding(ROUNDING)
    scale = float(np.abs(m * before).sum())
    assert np.abs((m * (now - before)).sum(axis=0)).max() <= config.rounding(ROUNDING) * scale
    normal = result.contact_normal[0]
    approach, separation = (before[0] - before[1]) @ normal, (now[1] - now[0]) @ normal
    assert separation == pytest.approx(e * approach, abs=rounding * speed)
    tangent = np.array([-normal[1], normal[0]])
    assert np.abs((now - before) @ tangent).max() <= rounding * speed  # no friction


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config(IMPULSE_CONFIGS)
@settings(max_examples=8)
@given(e=restitutions, mass=masses, offset=offsets, speed=speeds, mu=st.sampled_from([0.05, 0.5, 10.0]))
def test_friction_is_in_its_cone_conserves_angular_momentum_and_never_reverses_slip(config, e, mass, offset, speed, mu):
    result, before, now = collide(config, pair(e, mass, offset, speed, friction=mu))
    rounding, normal = config.impact_rounding(ROUNDING), result.contact_normal[0]
    impulse = result.contact_impulse[0] if config.knows_impulses else mass[1] * (now[1] - before[1])
    tangent = np.array([-normal[1], normal[0]])
    normal_impulse, friction_impulse = impulse @ normal, impulse @ tangent
    assert normal_impulse > 0
    assert abs(friction_impulse) <= (mu + rounding * max(mu, 1.0)) * normal_impulse
    m, moment, spin = np.asarray(mass), 0.5 * np.asarray(mass) * 0.25, result.angular_velocity[-1]

    # Angular momentum about the contact point; each centre is half a contact distance from it.
    angular_momentum = moment @ spin + 0.5 * (m[1] * (now[1] - before[1]) - m[0] * (now[0] - before[0])) @ tangent
    assert abs(angular_momentum) <= rounding * float(np.abs(m[:, None] * before).sum())
    slip_before = (before[1] - before[0]) @ tangent
    slip = (now[1] - now[0]) @ tangent - 0.5 * (spin[0] + spin[1])
    assert slip * slip_before >= -rounding * speed**2
    # Without impulses it is not known well enough whether it sticks.
    if config.knows_impulses and abs(friction_impulse) < mu * normal_impulse * (1 - 1e-9):  # inside the cone: sticking
        assert abs(slip) <= rounding * speed


@each_config(IMPULSE_CONFIGS)
@settings(max_examples=6)
@given(e=restitutions, mass=masses, offset=offsets, speed=speeds)
def test_loss_of_kinetic_energy_is_that_of_the_formula(config, e, mass, offset, speed):
    """The loss is ½ m_red (1 − e²) times the square of the approach speed along the normal."""
    result, before, now = collide(config, pair(e, mass, offset, speed))
    m = np.asarray(mass)
    reduced = m[0] * m[1] / m.sum()
    approach = (before[0] - before[1]) @ result.contact_normal[0]
    loss = 0.5 * m @ (before**2).sum(axis=1) - 0.5 * m @ (now**2).sum(axis=1)
    scale = 0.5 * m[0] * speed**2
    assert loss == pytest.approx(
        0.5 * reduced * (1 - e * e) * approach**2, abs=config.impact_rounding(ROUNDING) * scale
    )


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config([config for config in (*IMPULSE_CONFIGS, PENALTY) if config.knows_impulses])
def test_recorded_impulses_are_the_change_of_momentum(config):
    scene = pair(0.8, (3.0, 0.7), 0.4, 2.0, friction=0.3)
    result = config.run(scene)
    change = scene.bodies.mass[1] * (result.velocity[-1, 1] - result.velocity[0, 1])
    # of 1 N·s, about 50 rounding errors
    np.testing.assert_allclose(result.contact_impulse.sum(axis=0), change, atol=1e-12)


@each_config(IMPULSE_CONFIGS)
@pytest.mark.parametrize("ratio", [1e-12, 1e-6, 1.0, 1e6, 1e12])
def test_two_balls_of_any_masses_separate_by_the_formula(config, ratio):
    """Case 10: v₁′ = (m₁ − e m₂) v/M, v₂′ = (1 + e) m₁ v/M."""
    e, m1, m2, v = 0.7, ratio, 1.0, 1.5
    _, _, now = collide(config, pair(e, (m1, m2), 0.0, v))
    expected = np.array([(m1 - e * m2) * v / (m1 + m2), (1 + e) * m1 * v / (m1 + m2)])
    # Impulses follow from the two masses by two divisions and a few sums: rounding, relative to the faster ball.
    rtol, atol = config.rounding(1e-12), config.rounding(1e-13) * v
    np.testing.assert_allclose(now[:, 0], expected, rtol=rtol, atol=atol)


@each_config(IMPULSE_CONFIGS)
def test_equal_elastic_balls_separate_at_a_right_angle(config):
    """Case 11. The cosine is a sum of two products of rounded velocities: a few units of 1e-16."""
    _, _, now = collide(config, pair(1.0, (1.0, 1.0), 0.5, 2.0))
    assert abs(now[0] @ now[1]) <= config.rounding(1e-14) * np.linalg.norm(now[0]) * np.linalg.norm(now[1])


@pytest.mark.fail_slow(60)  # takes over half a second
def test_penalty_impact_has_nearly_the_restitution_of_the_pair():
    """Penalty springs reach it as h → 0; with 30 substeps per contact within 2 %."""
    for e in (0.3, 0.8, 1.0):
        result, before, now = collide(PENALTY, pair(e, (1.0, 2.0), 0.3, 1.0))
        normal = result.contact_normal[0]
        ratio = ((now[1] - now[0]) @ normal) / ((before[0] - before[1]) @ normal)
        assert ratio == pytest.approx(e, rel=0.02)
