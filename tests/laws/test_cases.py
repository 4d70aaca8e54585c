"""Cases with a known answer, on every engine that models them."""

import math

import numpy as np
import pytest

from sandbox.engines.registry import ENGINES
from sandbox.measure.metrics.energy import energies
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.laws.engine_configs import IMPULSE_CONFIGS, INTEGRATORS, PENALTY, EngineConfig, drop, each_config

G = 9.81
FIRST_ORDER = {"explicit_euler": 0.5, "semi_implicit_euler": -0.5}
"""Error of a projectile's height, in units of g·h·T."""
FLIGHTS = [
    *(EngineConfig(engine, {}) for engine in ENGINES),
    *(EngineConfig("reference", {"integrator": word}) for word in INTEGRATORS),
]


def error_of(config: EngineConfig) -> float:
    if config.engine == "exact":
        return 0.0
    return FIRST_ORDER.get(scheme_of(config), 0.0)


def scheme_of(config: EngineConfig) -> str:
    return config.settings.get("integrator", "semi_implicit_euler" if config.engine == "box2d" else "explicit_euler")


@each_config(FLIGHTS)
def test_projectile_has_the_closed_form_and_the_error_of_its_scheme(config):
    """Case 1: y = y₀ + v₀ T − ½ g T², plus the error of the scheme, ± g·h·T/2 or none."""
    scene = make_scene(
        world={"gravity": [0.0, -G], "duration": 2.0}, ball=[{"position": [1, 2], "velocity": [3, 10], "radius": 0.1}]
    )
    result = config.run(scene)
    t = result.time
    exact = np.column_stack((1 + 3 * t, 2 + 10 * t - 0.5 * G * t * t + error_of(config) * G * 0.01 * t))
    # 200 sums of numbers near 10, each rounded by 1e-15
    tolerance = config.rounding(1e-12)
    np.testing.assert_allclose(result.position[:, 0], exact, atol=tolerance)
    np.testing.assert_allclose(result.velocity[:, 0], np.column_stack((3 + 0 * t, 10 - G * t)), atol=tolerance)


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config(IMPULSE_CONFIGS)
def test_bounce_from_5_m(config):
    """Case 7, e = 0.8: peaks 3.2, 2.048, 1.31072 m. With a fixed step each is within the error of velocity, 2 g·h."""
    h = 0.001
    result = config.run(drop(0.8, 5.0, 6.0), dt=h)
    height = result.position[:, 0, 1] - 0.5
    speed = math.sqrt(2 * G * 5.0)
    peaks = []
    for n in (1, 2, 3):
        start = speed / G + 2 * speed / G * sum(0.8**k for k in range(1, n))
        end = start + 2 * speed / G * 0.8**n
        peaks.append(height[(result.time > start) & (result.time < end)].max())
        v = speed * 0.8**n
        at_frames = 0.5 * G * (h / 2) ** 2  # a peak is up to half a frame away from a frame
        tolerance = at_frames if config.engine == "exact" else 2 * G * h * v / G * 2 + at_frames
        assert peaks[-1] == pytest.approx(5.0 * 0.64**n, abs=tolerance)
    first = result.contact_time[0]
    assert first == pytest.approx(1.0096376, abs=5e-8 if config.engine == "exact" else 2 * h)  # eight digits are given


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config(IMPULSE_CONFIGS)
def test_elastic_ball_keeps_its_energy_for_100_s(config):
    """Case 8: the energy stays within the band of the scheme."""
    scene = drop(1.0, 5.0, 100.0)
    result = config.run(scene, record_every=10)
    energy = energies(result, scene).total
    change = float(np.abs(energy / energy[0] - 1).max())
    scheme = scheme_of(config)
    if config.engine == "exact":
        assert change <= 1e-11  # 50 impacts, each with a few rounding errors
    elif config.engine == "box2d":  # each impact begins at the start of a step: energy is lost, never gained
        assert (energy <= energy[0] * (1.0 + 0.03)).all()  # within a flight as below
    elif FIRST_ORDER.get(scheme):
        # Within a flight the error is g·h·v/2 over g·5 m, 0.01 at 10 m/s; it does not accumulate over impacts.
        assert change <= 0.03
    else:
        assert change <= 1e-9  # errors of impulses at half the step cancel, to rounding


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config([*IMPULSE_CONFIGS, PENALTY])
def test_ball_comes_to_rest_on_the_plane(config):
    """Case 9: within the slop of 1 % of the radius plus the sink of a substep of gravity; m g/k for springs.

    A scheme that moves positions by the kick undoes a step that would end in overlap, so its ball may hover by g·h².
    """
    scene = drop(0.3, 0.5, 5.0)
    result = config.run(scene)
    settings = result.info["settings"]
    h = settings["dt"] / settings["substeps"]
    depth = G / (settings["stiffness"] or math.inf) if config is PENALTY else 0.01 * 0.5 + 2 * G * h * h
    height = result.position[-1, 0, 1] - 0.5
    assert -depth - 1e-6 <= height <= (G * h * h if config.engine == "reference" else 0.0) + 1e-6
    assert np.abs(result.velocity[-1]).max() <= 1e-3 * G * h  # bounces decay by 0.3 a step, springs by their dampers
    # The impulses of all contacts sum to the momentum of the weight, m g T.
    assert not config.knows_impulses or result.contact_impulse[:, 1].sum() == pytest.approx(-G * 5.0, abs=1e-5)


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config(IMPULSE_CONFIGS)
@pytest.mark.parametrize("swinging", [1, 2, 3])
def test_newtons_cradle_ejects_as_many_balls_as_hit_it(config, swinging):
    """Case 12, with small gaps between the balls, so that impacts are sequential."""
    gap, e = 1e-3, 1.0
    balls = [{"position": [k * (1.0 + gap), 0.0], "radius": 0.5} for k in range(5)]
    for ball in balls[:swinging]:
        ball["position"][0] -= 0.5
        ball["velocity"] = [1.0, 0.0]
    pair = {"between": ["s", "s"], "restitution": e}
    scene = from_document(
        {"world": {"duration": 2.0}, "material": [{"name": "s"}], "pair": [pair],
         "ball": [{**ball, "material": "s"} for ball in balls]}
    )  # fmt: skip
    # Box2D counts balls within 4 slops as touching, and solves them together.
    close = {"slop": 1e-4} if config.engine == "box2d" else {}
    result = config.run(scene, dt=5e-4, **close)  # v·h is half a gap: no two pairs collide within one step
    expected = [0.0] * (5 - swinging) + [1.0] * swinging
    # rounding of ten impacts
    np.testing.assert_allclose(result.velocity[-1, :, 0], expected, atol=config.rounding(1e-12))


@pytest.mark.fail_slow(60)  # takes over half a second
@each_config(IMPULSE_CONFIGS)
def test_gas_conserves_energy_and_its_momentum_changes_by_wall_impulses(config):
    rng = np.random.Generator(np.random.PCG64(5))
    balls = [
        {
            "position": [0.7 + 1.3 * (k % 4), 0.7 + 1.3 * (k // 4)],
            "radius": 0.3,
            "velocity": rng.uniform(-1, 1, 2).tolist(),
            "material": "s",
        }
        for k in range(12)
    ]
    sides = [([0, 0], [1, 0]), ([0, 0], [0, 1]), ([6, 6], [-1, 0]), ([6, 6], [0, -1])]
    scene = make_scene(
        world={"duration": 10.0},
        material=[{"name": "s"}],
        pair=[{"between": ["s", "s"], "restitution": 1.0}],
        plane=[{"point": p, "normal": n, "material": "s"} for p, n in sides],
        ball=balls,
    )
    result = config.run(scene, dt=0.005)
    energy = energies(result, scene).total
    # Two hits within a step are solved together; the residual of ten iterations is 1e-6 of the energy.
    assert np.abs(energy / energy[0] - 1).max() <= (1e-12 if config.engine == "exact" else 1e-2)
    if not config.knows_impulses:
        return
    impulse_on_walls = result.contact_impulse[result.contact_pair[:, 1] < 0].sum(axis=0)
    change = (result.velocity[-1] - result.velocity[0]).sum(axis=0)
    np.testing.assert_allclose(-impulse_on_walls, change, atol=1e-11)  # rounding of about 200 impacts of 1 N·s
