"""The order of the tables in a scene file does not decide what is called the truth."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.compare.ground_truth import truth_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

RADIUS = 0.5
LATTICE = [(RADIUS * (2 * k + row % 2), RADIUS * math.sqrt(3.0) * row) for row in range(-2, 3) for k in range(-2, 3)]
"""centres of touching balls in rows"""
CUES = [((-4.0, 0.0), (5.0, 0.0)), ((5.0, 0.0), (-5.0, 0.0)), ((0.0, 6.0), (0.0, -5.0)), ((0.5, 6.0), (0.0, -5.0))]
"""position and velocity of balls that meet rows of them in the middle of one or of two"""


def scene_of(order: list[int], lattice: list[int], cues: list[int]) -> Scene:
    """Return a scene with resting balls in a lattice and balls that approach them, in an order of their tables."""
    balls = [{"name": f"l{k}", "position": LATTICE[k], "radius": RADIUS, "restitution": 1.0} for k in lattice]
    for k in cues:
        position, velocity = CUES[k]
        balls.append(
            {"name": f"c{k}", "position": position, "velocity": velocity, "radius": RADIUS, "restitution": 1.0}
        )
    ordered = [balls[k] for k in order]
    return from_document({"world": {"duration": 1.5}, "solver": {"dt": 1.0 / 60.0}, "ball": ordered})


@st.composite
def two_orders(draw: st.DrawFn) -> tuple[Scene, Scene]:
    lattice = draw(st.lists(st.integers(0, len(LATTICE) - 1), min_size=1, max_size=6, unique=True))
    cues = draw(st.lists(st.integers(0, len(CUES) - 1), min_size=1, max_size=2, unique=True))
    if {2, 3} <= set(cues):  # these two overlap
        cues = cues[:1]
    orders = (draw(st.permutations(range(len(lattice) + len(cues)))) for _ in range(2))
    one, other = (scene_of(list(order), lattice, cues) for order in orders)
    return one, other


@pytest.mark.fail_slow(60)  # compiles the exact engine
@given(two_orders())
def test_truth_does_not_depend_on_the_order_of_the_tables(scenes: tuple[Scene, Scene]) -> None:
    tolerance = 0.01 * RADIUS
    truths = [truth_of(scene, scene.solver, tolerance) for scene in scenes]
    assert None not in truths
    one, other = truths
    end = min(one.trusted_until, other.trusted_until)
    index = [list(other.trajectory.names).index(name) for name in one.trajectory.names]
    both = one.trajectory.time <= end
    apart = np.abs(one.trajectory.position[both] - other.trajectory.position[both][:, index])
    assert apart.max() <= tolerance  # each is trusted to that


def test_ball_that_hits_two_at_once_ends_the_truth_at_the_impact() -> None:
    for order in ([0, 1, 2], [1, 0, 2]):
        balls = [
            {"name": "upper", "position": [0.0, RADIUS]},
            {"name": "lower", "position": [0.0, -RADIUS]},
            {"name": "cue", "position": [-2.0, 0.0], "velocity": [5.0, 0.0]},
        ]
        balls = [{**balls[k], "radius": RADIUS, "restitution": 1.0} for k in order]
        scene = from_document({"world": {"duration": 1.0}, "solver": {"dt": 0.01}, "ball": balls})
        truth = truth_of(scene, scene.solver, 0.005)
        impact = (2.0 - math.sqrt(3.0) * RADIUS) / 5.0
        assert impact - 0.01 <= truth.trusted_until <= impact
