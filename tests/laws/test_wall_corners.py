"""One wall with corners acts as walls that meet there: on a surface each edge collides, and the audit counts each."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory

SIDE, RADIUS, DT = 4.5, 0.03, 1.0 / 60.0
CORNERS = [(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE)]
CLOSED = [{"points": CORNERS, "closed": True, "restitution": 0.85}]
FOUR = [{"points": [CORNERS[k - 1], CORNERS[k]], "restitution": 0.85} for k in (1, 2, 3, 0)]
BEND = 1e-7
"""m, so that the vertices of a wall are not in one line and are kept"""
WITH_VERTICES = [{"points": [(0.1 * k, BEND * (k % 2)) for k in range(46)], "restitution": 0.85}]
SHOTS = st.tuples(*[st.floats(2.0, 4.0)] * 2, *[st.floats(-0.1, 0.1)] * 2)
"""start of a ball, m, and where it would cross the corner, relative to it"""


def scene_of(walls: list[dict[str, object]], position: object, velocity: object, duration: float = 1.0) -> Scene:
    ball = {"position": position, "velocity": velocity, "radius": RADIUS, "mass": 0.17}
    surface = {"sliding_friction": 0.2, "rolling_friction": 0.01, "spinning_friction": 0.0127}
    world, solver = {"duration": duration}, {"dt": DT}
    return from_document({"world": world, "solver": solver, "surface": surface, "wall": walls, "ball": [ball]})


def shot_into_corner(walls: list[dict[str, object]], shot: tuple[float, ...], radii: float, engine: str) -> Trajectory:
    """Run a shot into a corner that begins with a displacement of so many radii in a substep."""
    x, y, off_x, off_y = shot
    dx, dy = SIDE + off_x - x, SIDE + off_y - y
    speed = radii * RADIUS / DT / math.hypot(dx, dy)
    return run(scene_of(walls, [x, y], [speed * dx, speed * dy]), engine)


@pytest.mark.fail_slow(60)  # compiles the stepper
@pytest.mark.parametrize(("engine", "fastest"), [("reference", 40.0), ("pymunk", 1.28)])  # pymunk's limit: see `SKIN`
def test_closed_wall_acts_as_four_walls(engine: str, fastest: float) -> None:
    @given(SHOTS, st.floats(0.5, 1.0))
    def check(shot: tuple[float, ...], fraction: float) -> None:
        one, four = (shot_into_corner(walls, shot, fraction * fastest, engine) for walls in (CLOSED, FOUR))
        assert np.array_equal(one.position, four.position)
        assert (one.position > 0.0).all()
        assert (one.position < SIDE).all()
        assert one.missed_contacts == 0
        # Rounding; contacts with two edges in successive substeps are one row of one wall, and two of two walls.
        assert np.allclose(one.contact_impulse.sum(axis=0), four.contact_impulse.sum(axis=0), rtol=1e-12, atol=1e-12)

    check()


@pytest.mark.fail_slow(60)  # compiles the stepper
@given(SHOTS, st.floats(3.0, 20.0))
def test_ball_that_leaves_through_a_corner_is_counted_as_missed(shot: tuple[float, ...], radii: float) -> None:
    for walls in (CLOSED, FOUR):
        done = shot_into_corner(walls, shot, radii, "pymunk")
        is_outside = bool((np.abs(done.position - SIDE / 2.0) > SIDE / 2.0).any())
        assert is_outside == (done.missed_contacts != 0)


@pytest.mark.fail_slow(60)  # compiles the stepper
@pytest.mark.parametrize("engine", ["reference", "pymunk"])
@given(st.floats(0.1, 4.4), st.floats(0.5, 3.0), st.sampled_from([0.0, -0.01, -1.0]), st.floats(-1e-3, 1e-3))
@example(x=1.15, vx=1.0, vy=0.0, gap=-2e-4)  # it overlaps an edge that bends away, and comes to the next one
def test_vertices_of_a_wall_that_is_almost_straight_do_nothing(
    engine: str, x: float, vx: float, vy: float, gap: float
) -> None:
    plain = [{"points": [(0.0, 0.0), (SIDE, 0.0)], "restitution": 0.85}]
    one, many = (
        run(scene_of(walls, [x, RADIUS + gap], [vx, vy], 0.5), engine, audit=False) for walls in (plain, WITH_VERTICES)
    )
    on_wall = one.position[:, 0, 0] < SIDE  # beyond it, the ball passes the end
    # Edges are tilted by 1e-6, and hits on them remove an overlap up to the slop, 0.3 mm, in which a ball rests on a
    # straight wall. The end of an edge would deflect a ball by 0.1 rad.
    assert np.allclose(one.position[on_wall], many.position[on_wall], rtol=0.0, atol=4e-4)
