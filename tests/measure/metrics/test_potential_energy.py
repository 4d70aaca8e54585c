"""Potential energy of springs and attraction, against hand-computed joules and against its conservation in runs."""

import math

import numpy as np
import pytest

from sandbox.measure.metrics.energy import energies
from sandbox.scene.files.load import loads
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
    # ½·10·(5 − 2)², and with a largest force ½·10·2² up to a stretch of 2 m, and 20·1 beyond it
    for text, first in ((SPRINGS, 45.0), (SPRINGS.replace("= 10.0", "= 10.0\nmax_force = 20.0"), 40.0)):
        scene = loads(text)
        expected = first + 4.0 + 9.0  # ½·8·1² and ½·200·(0.5 − 0.2)²
        assert energies(resting_run(scene), scene).potential == pytest.approx([expected] * 4, rel=1e-15)  # sums of 3


def test_spring_energy_is_halved_between_bodies_but_not_with_the_world() -> None:
    scene = loads(SPRINGS)
    parts = [energies(resting_run(scene), scene, body=n).potential[0] for n in range(3)]
    assert parts == pytest.approx([22.5 + 4.0 + 4.5, 22.5, 4.5], rel=1e-15)  # as above


def test_spring_of_a_retired_body_stores_nothing() -> None:
    scene = loads(SPRINGS)
    retired = resting_run(scene, retired_time=np.array([np.nan, 2.0, np.nan]))
    # The balls rest without gravity: only the energy of the spring between them changes.
    assert energies(retired, scene).total == pytest.approx([58.0, 58.0, 13.0, 13.0], rel=1e-15)  # as above


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
