"""Vertices of a wall: joined segments have no edge, and a straight wall in pieces acts as one straight wall."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.engines.common.colliders import straightened, wall_segments
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Wall
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

ENGINES = "pymunk", "reference"

SHAPES: dict[str, dict[str, Any]] = {
    "box": {"size": [0.6, 0.4]},
    "ball": {"radius": 0.2},
    "capsule": {"length": 0.6, "radius": 0.2},
    "polygon": {"points": [[-0.3, -0.2], [0.3, -0.2], [0.35, 0.1], [0.0, 0.3], [-0.35, 0.1]]},
}

FLAT_LOSS = 1e-3
"""Fraction of its speed that a frictionless body may lose on a wall whose vertices are out of line by 1e-6 m: each
vertex that rises takes a little."""


def sliding_body(
    kind: str,
    points: list[list[float]],
    speed: float = 3.0,
    size: float = 1.0,
    side: float = 1.0,
    thickness: float = 0.0,
    dt: float = 0.004,
    duration: float = 2.0,
    spin: float = 0.0,
    gap: float = 0.0,
    **wall: object,
) -> Scene:
    """Return a frictionless body that slides from x = −4 along a wall on the x axis, above or below it."""
    half = thickness / 2.0
    shape = {}
    for key, value in SHAPES[kind].items():
        shape[key] = (np.asarray(value) * size).tolist()
    body = {"name": "body", "position": [-4.0, side * (0.2 * size + half + gap)], "velocity": [speed, 0.0], **shape}
    body["angular_velocity"] = spin
    if side < 0:
        body["angle"] = 0.0 if kind == "ball" else math.pi
    return from_document(
        {
            "title": "sliding",
            "world": {"gravity": [0.0, -9.81 * side], "duration": duration},
            "solver": {"dt": dt},
            "wall": [{"name": "floor", "points": points, "thickness": thickness, **wall}],
            kind: [body],
        }
    )


def wall_points(pieces: int, rise: float = 0.0, reverse: bool = False) -> list[list[float]]:
    """Return a wall from x = −5 to 5 in pieces of equal length, whose vertices are out of line by up to `rise`."""
    xs = np.linspace(-5.0, 5.0, pieces + 1)
    points = [[float(x), rise * math.sin(1.3 * k)] for k, x in enumerate(xs)]
    return points[::-1] if reverse else points


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("kind", SHAPES)
@given(
    pieces=st.integers(2, 60),
    speed=st.floats(0.1, 6.0),
    size=st.floats(0.1, 2.0),
    side=st.sampled_from([-1.0, 1.0]),
    thickness=st.sampled_from([0.0, 0.01, 0.3]),
    reverse=st.booleans(),
    one_way=st.booleans(),
)
@settings(max_examples=6)
def test_straight_wall_in_pieces_is_bit_identical_to_one_wall(
    engine: str,
    kind: str,
    pieces: int,
    speed: float,
    size: float,
    side: float,
    thickness: float,
    reverse: bool,
    one_way: bool,
) -> None:
    runs = [
        sandbox.run(
            sliding_body(
                kind, wall_points(n, 0.0, reverse), speed, size, side, thickness, duration=0.3, one_way=one_way
            ),
            engine=engine,
        )
        for n in (1, pieces)
    ]
    for name in ("position", "velocity", "angle", "angular_velocity", "contact_pair", "contact_impulse"):
        assert np.array_equal(getattr(runs[0], name), getattr(runs[1], name)), name


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("pieces", [7, 100])
def test_vertices_nearly_in_line_do_not_stop_a_body(engine: str, kind: str, side: float, pieces: int) -> None:
    for thickness in (0.0, 0.1):
        run = sandbox.run(
            sliding_body(
                kind, wall_points(pieces, 1e-6, pieces % 2 == 0), side=side, thickness=thickness, duration=1.0
            ),
            engine=engine,
        )
        assert run.velocity[-1, 0, 0] == pytest.approx(3.0, rel=FLAT_LOSS)
        assert run.position[-1, 0, 0] == pytest.approx(-1.0, abs=3.0 * FLAT_LOSS)  # over 3 m
        assert side * run.position[:, 0, 1].min() > 0.19 if side > 0 else run.position[:, 0, 1].max() < -0.19


@pytest.mark.parametrize("broad_phase", ["all_pairs", "circles", "sweep", "grid", "oriented"])
@pytest.mark.parametrize("detection", ["discrete", "bisect", "shrink"])
def test_vertices_are_smooth_with_every_detection_and_broad_phase(detection: str, broad_phase: str) -> None:
    scene = sliding_body("box", wall_points(33, 1e-6), duration=0.6)
    run = sandbox.run(
        scene, engine="reference", integrator="velocity_verlet", detection=detection, broad_phase=broad_phase
    )
    assert run.velocity[-1, 0, 0] == pytest.approx(3.0, rel=FLAT_LOSS)


@pytest.mark.parametrize("engine", [*ENGINES, "exact"])
@pytest.mark.parametrize(("pieces", "rise"), [(20, 0.0), (23, 1e-9), (20, 1e-7), (23, 1e-5)])
def test_ball_rolls_over_vertices(engine: str, rise: float, pieces: int) -> None:
    scene = sliding_body("ball", wall_points(pieces, rise), spin=-15.0, gap=2.0 * rise, friction=0.5)
    run = sandbox.run(scene, engine=engine)
    assert run.velocity[-1, 0, 0] == pytest.approx(3.0, rel=FLAT_LOSS)
    assert np.abs(run.position[:, 0, 1] - 0.2).max() < 0.003  # the default slop of a ball of 0.2 m is 0.002 m


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("engine", ENGINES)
def test_vertices_of_a_one_way_wall_let_nothing_through(engine: str, kind: str) -> None:
    run = sandbox.run(sliding_body(kind, wall_points(20, 1e-4), gap=0.002, one_way=True), engine=engine)
    assert run.position[:, 0, 1].min() > 0.19


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("engine", ENGINES)
def test_corners_and_ends_of_a_wall_stay_solid(engine: str, kind: str) -> None:
    """A body thrown at a ridge, at the end of a wall or into a corner rebounds."""
    for points, position, velocity in (
        ([[-2.0, -1.0], [0.0, 0.0], [2.0, -1.0]], [0.0, 1.0], [0.0, -2.0]),
        ([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], [-1.0, 0.001], [2.0, 0.0]),
        ([[-2.0, 0.0], [0.0, 0.0], [0.0, 2.0]], [-1.0, 1.0], [2.0, -2.0]),
    ):
        body = {"name": "body", "position": position, "velocity": velocity, "restitution": 1.0, **SHAPES[kind]}
        document = {
            "title": "corner",
            "world": {"duration": 1.0},
            "solver": {"dt": 0.002},
            "wall": [{"points": points, "thickness": 0.02}],
            kind: [body],
        }
        run = sandbox.run(from_document(document), engine=engine)
        rebound = run.velocity[-1, 0] @ velocity
        assert rebound < 0.0, (points, run.velocity[-1, 0])


@pytest.mark.parametrize("engine", ENGINES)
def test_step_in_a_wall_stops_a_sliding_body(engine: str) -> None:
    points = [[-5.0, 0.0], [-3.0, 0.0], [-1.0, 0.0], [-1.0, 0.5], [5.0, 0.5]]
    run = sandbox.run(sliding_body("box", points), engine=engine)
    assert run.position[:, 0, 0].max() < -1.3 + 0.013  # v·dt, and the overlap of a step at rest
    assert abs(run.velocity[-1, 0, 0]) < 0.1


def test_collinear_points_are_merged_and_corners_are_kept() -> None:
    wall = Wall(points=((0, 0), (0.1, 0.1), (0.3, 0.3), (0.7, 0.7), (1, 1), (2, 0), (3, -1 - 1e-9)))
    assert straightened(wall) == ((0, 0), (1, 1), (2, 0), (3, -1 - 1e-9))
    assert straightened(Wall(points=((0, 0), (2, 0), (1, 0)))) == ((0, 0), (2, 0), (1, 0))  # reverses direction
    square = wall_segments(Wall(points=((0, 0), (1, 0), (1, 1), (0, 1)), closed=True))
    assert [part.before for part in square] == [(0, 1), (0, 0), (1, 0), (1, 1)]
    assert [part.after for part in square] == [(1, 1), (0, 1), (0, 0), (1, 0)]


@example(angle=0.1, pieces=7, length=3.0)
@given(angle=st.floats(-math.pi, math.pi), pieces=st.integers(2, 200), length=st.floats(0.1, 1e3))
@settings(deadline=None)
def test_line_with_rounded_intermediate_points_is_one_segment(angle: float, pieces: int, length: float) -> None:
    points = tuple(
        (length * k / pieces * math.cos(angle), length * k / pieces * math.sin(angle)) for k in range(pieces + 1)
    )
    assert len(wall_segments(Wall(points=points))) == 1
