"""Cases with a known answer, on every engine that models them."""

import math

import numpy as np
import pytest

from sandbox.engines.registry import ENGINES
from sandbox.measure.metrics.energy import energies
from sandbox.scene.files.load import from_document
from tests.laws.ways import HARD, INTEGRATORS, SOFT, Way, drop, named

G = 9.81
FIRST_ORDER = {"explicit_euler": 0.5, "semi_implicit_euler": -0.5}
"""A projectile's height is off by this times g·h·T."""
FLIGHTS = [*(Way(engine, {}) for engine in ENGINES), *(Way("reference", {"integrator": word}) for word in INTEGRATORS)]


def error_of(way: Way) -> float:
    if way.engine == "exact":
        return 0.0
    return FIRST_ORDER.get(way.settings.get("integrator", "explicit_euler"), 0.0)


@named(FLIGHTS)
def test_projectile(way):
    """Case 1: y = y₀ + v₀ T − ½ g T², with the scheme's own error of ± g·h·T/2 or none."""
    scene = from_document(
        {
            "world": {"gravity": [0.0, -G], "duration": 2.0},
            "ball": [{"position": [1, 2], "velocity": [3, 10], "radius": 0.1}],
        }
    )
    done = way.run(scene)
    t = done.time
    exact = np.column_stack((1 + 3 * t, 2 + 10 * t - 0.5 * G * t * t + error_of(way) * G * 0.01 * t))
    np.testing.assert_allclose(done.position[:, 0], exact, atol=1e-12)  # 200 sums of numbers near 10, each off by 1e-15
    np.testing.assert_allclose(done.velocity[:, 0], np.column_stack((3 + 0 * t, 10 - G * t)), atol=1e-12)


@named(HARD)
def test_bounce_from_5_m(way):
    """Case 7, e = 0.8: peaks 3.2, 2.048, 1.31072 m. A fixed step finds each within its error of velocity, 2 g·h."""
    h = 0.001
    done = way.run(drop(0.8, 5.0, 6.0), dt=h)
    height = done.position[:, 0, 1] - 0.5
    speed = math.sqrt(2 * G * 5.0)
    peaks = []
    for n in (1, 2, 3):
        start = speed / G + 2 * speed / G * sum(0.8**k for k in range(1, n))
        end = start + 2 * speed / G * 0.8**n
        peaks.append(height[(done.time > start) & (done.time < end)].max())
        v = speed * 0.8**n
        at_frames = 0.5 * G * (h / 2) ** 2  # a peak lies up to half a frame off
        tolerance = at_frames if way.engine == "exact" else 2 * G * h * v / G * 2 + at_frames
        assert peaks[-1] == pytest.approx(5.0 * 0.64**n, abs=tolerance)
    first = done.contact_time[0]
    assert first == pytest.approx(1.0096376, abs=5e-8 if way.engine == "exact" else 2 * h)  # eight digits are given


@pytest.mark.full
@named(HARD)
def test_elastic_ball_for_100_s(way):
    """Case 8. What a scheme does to energy, each in its own band."""
    scene = drop(1.0, 5.0, 100.0)
    done = way.run(scene, record_every=10)
    energy = energies(done, scene).total
    change = float(np.abs(energy / energy[0] - 1).max())
    scheme = way.settings.get("integrator", "explicit_euler")
    if way.engine == "exact":
        assert change <= 1e-11  # 50 impacts, each rounded a few times
    elif FIRST_ORDER.get(scheme):
        # Within a flight its error is g·h·v/2 over g·5 m, at 10 m/s 0.01; from impact to impact that is undone.
        assert change <= 0.03
    else:
        assert change <= 1e-9  # impulses at half the step give back what they took, to rounding


@named([*HARD, SOFT])
def test_ball_comes_to_rest_on_the_plane(way):
    """Case 9: within the slop of 1 % of the radius and what a substep of gravity sinks; springs m g/k.

    A scheme that moves positions by the kick undoes a step that would end in overlap: its ball may hover by g·h².
    """
    scene = drop(0.3, 0.5, 5.0)
    done = way.run(scene)
    settings = done.info["settings"]
    h = settings["dt"] / settings["substeps"]
    deepest = G / (settings["stiffness"] or math.inf) if way is SOFT else 0.01 * 0.5 + 2 * G * h * h
    height = done.position[-1, 0, 1] - 0.5
    assert -deepest - 1e-6 <= height <= (G * h * h if way.engine == "reference" else 0.0) + 1e-6
    assert np.abs(done.velocity[-1]).max() <= 1e-3 * G * h  # bounces die out by 0.3 a step, springs by their dampers
    # Together the contacts gave what fell its way up, and bore the weight: momentum m g T.
    assert done.contact_impulse[:, 1].sum() == pytest.approx(-G * 5.0, abs=1e-5)


@named(HARD)
@pytest.mark.parametrize("swinging", [1, 2, 3])
def test_newtons_cradle_sends_out_as_many_as_came_in(way, swinging):
    """Case 12, balls a hair apart, so that impacts come one by one."""
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
    done = way.run(scene, dt=5e-4)  # v·h is half a gap: no two pairs meet within one step
    expected = [0.0] * (5 - swinging) + [1.0] * swinging
    np.testing.assert_allclose(done.velocity[-1, :, 0], expected, atol=1e-12)  # ten impacts, each to rounding


@named(HARD)
def test_a_gas_keeps_its_energy_and_its_momentum_with_the_walls(way):
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
    scene = from_document(
        {
            "world": {"duration": 10.0},
            "material": [{"name": "s"}],
            "pair": [{"between": ["s", "s"], "restitution": 1.0}],
            "plane": [{"point": p, "normal": n, "material": "s"} for p, n in sides],
            "ball": balls,
        }
    )
    done = way.run(scene, dt=0.005)
    energy = energies(done, scene).total
    # Two that hit at once within a step are solved together; what ten passes leave over is 1e-6 of the energy.
    assert np.abs(energy / energy[0] - 1).max() <= (1e-12 if way.engine == "exact" else 1e-2)
    given = done.contact_impulse[done.contact_pair[:, 1] < 0].sum(axis=0)
    change = (done.velocity[-1] - done.velocity[0]).sum(axis=0)
    np.testing.assert_allclose(-given, change, atol=1e-11)  # by some 200 impacts of 1 N·s
