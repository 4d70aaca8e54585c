"""Potential energy of springs and attraction, against hand-computed joules and against its conservation in runs."""

import math

import numpy as np
import pytest

from sandbox.engines.common.energy_balance import energy_of
from sandbox.measure.metrics.energy import energies
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import loads
from sandbox.trajectory import Frame
from tests.measure.metrics.test_energy import resting_run

SPRINGS = """
[[ball]]
name = "a"
position = [0.0, 0.0]
radius = 0.5
[[ball]]
name = "b"
position = [3.0, 4.0]
radius = 0.5
[[box]]
name = "c"
position = [0.0, -2.0]
angle = 0.5
size = [1.0, 1.0]
[[joint]]
kind = "spring"
between = ["a", "b"]
rest_length = 2.0
stiffness = 10.0
[[joint]]
kind = "spring"
between = ["a"]
anchors = [[0.0, 0.0], [0.0, 1.0]]
rest_length = 0.0
stiffness = 8.0
[[joint]]
kind = "rotary_spring"
between = ["a", "c"]
rest_angle = 0.2
stiffness = 200.0
"""


def test_springs_store_half_k_times_their_strain_squared() -> None:
    scene = loads(SPRINGS)
    # ½·10·(5 − 2)² + ½·8·1² + ½·200·(0.5 − 0.2)²
    # sums of 3
    assert energies(resting_run(scene), scene).potential == pytest.approx([45.0 + 4.0 + 9.0] * 4, rel=1e-15)


def test_spring_with_a_largest_force_stores_its_work() -> None:
    scene = loads(SPRINGS.replace("stiffness = 10.0", "stiffness = 10.0\nmax_force = 20.0"))
    # ½·10·2² up to a stretch of 2 m, and 20·1 beyond it; the others as without a limit
    assert energies(resting_run(scene), scene).potential == pytest.approx([40.0 + 4.0 + 9.0] * 4, rel=1e-15)  # as above


def test_spring_energy_is_halved_between_bodies_but_not_with_the_world() -> None:
    scene = loads(SPRINGS)
    parts = [energies(resting_run(scene), scene, body=n).potential[0] for n in range(3)]
    assert parts == pytest.approx([22.5 + 4.0 + 4.5, 22.5, 4.5], rel=1e-15)  # as above


def test_spring_of_a_retired_body_stores_nothing() -> None:
    scene = loads(SPRINGS)
    retired = resting_run(scene, retired_time=np.array([np.nan, 2.0, np.nan]))
    # The balls rest without gravity: only the energy of the spring between them changes.
    assert energies(retired, scene).total == pytest.approx([58.0, 58.0, 13.0, 13.0], rel=1e-15)  # as above


def test_frame_energy_includes_springs_if_the_scene_is_given() -> None:
    scene = loads(SPRINGS)
    bodies = scene.bodies
    present = np.ones(3, np.bool_)
    frame = Frame(0.0, bodies.position, bodies.velocity, bodies.angle, bodies.angular_velocity, present)
    assert energy_of(frame, bodies, (0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert energy_of(frame, bodies, (0.0, 0.0), scene)[1:] == pytest.approx((58.0, 58.0), rel=1e-15)  # as above


ATTRACTED = """
[[ball]]
name = "sun"
position = [0.0, 0.0]
radius = 0.1
mass = {mass}
fixed = {fixed}
[[ball]]
name = "planet"
position = [3.0, 4.0]
radius = 0.1
mass = 2.0
[[attraction]]
toward = {toward}
strength = 10.0
softening = {softening}
"""


@pytest.mark.parametrize(
    ("softening", "depth"),
    [(0.0, 2.0), (1e-9, 2.0), (5.0, 10.0 / 5.0 * math.pi / 4.0)],
    ids=["none", "too little to matter", "as far as the planet"],
)
@pytest.mark.parametrize("toward", ['"sun"', "[0.0, 0.0]"])
def test_attraction_potential_equals_its_integral(toward: str, softening: float, depth: float) -> None:
    """∫ s/(r² + ε²) dr from r to infinity: s/r, or (s/ε)·(π/2 − atan(r/ε))."""
    scene = loads(ATTRACTED.format(mass=1.0, fixed="true", toward=toward, softening=softening))
    # a few roundings
    assert energies(resting_run(scene), scene).potential == pytest.approx([-2.0 * depth] * 4, rel=1e-14)


def test_attraction_between_two_moving_bodies_counts_once() -> None:
    scene = loads(ATTRACTED.format(mass=5.0, fixed="false", toward='"sun"', softening=0.0))
    trajectory = resting_run(scene)
    assert energies(trajectory, scene).potential.tolist() == [-4.0] * 4
    assert [energies(trajectory, scene, body=n).potential[0] for n in range(2)] == [-2.0, -2.0]


@pytest.mark.fail_slow(30)
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize(
    ("text", "band"),
    [
        # The energy band of the semi-implicit scheme is ±ωh/2, ω = √(k/m) = 10: 0.005 of ½·100·0.25 J.
        (
            '[[ball]]\nname = "b"\nposition = [1.5, 0]\nradius = 0.1\n'
            '[[joint]]\nkind = "spring"\nbetween = ["b"]\nanchors = [[0, 0], [0, 0]]\n'
            "rest_length = 1.0\nstiffness = 100\n",
            0.006 * 12.5,
        ),
        # Kepler, e = 0.5 from the apoapsis: at the periapsis ω = |v|/r = √(1.5/0.125), and h·ω/2 = 0.0017 of 1.5 J.
        (
            '[[ball]]\nname = "b"\nposition = [1.5, 0]\nvelocity = [0, 0.5773502691896258]\nradius = 0.01\n'
            "[[attraction]]\ntoward = [0.0, 0.0]\nstrength = 1.0\n",
            0.003 * 1.5,
        ),
    ],
    ids=["spring", "Kepler"],
)
def test_energy_stays_within_the_band_of_the_scheme(engine: str, text: str, band: float) -> None:
    scene = loads(f"[world]\nduration = 6.0\n[solver]\ndt = 0.001\nrecord_every = 10\n{text}")
    found = energies(run(scene, engine, audit=False), scene)
    assert np.ptp(found.kinetic) > 5.0 * band  # otherwise the band would hold without the potential too
    assert np.abs(found.total - found.total[0]).max() < band
