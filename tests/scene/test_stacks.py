"""Stacks: walls, towers and pyramids of boxes."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, from_document, loads
from tests.scene.faults import assert_faults, faults_of

PYRAMID = {"base": [1.0, 2.0], "size": [0.4, 0.2], "columns": 4, "rows": 4, "fewer": 1}


def scene_of(seed: int = 0, **stack: Any) -> Scene:
    return from_document({"world": {"seed": seed}, "stack": [{**PYRAMID, **stack}]})


def test_pyramid_has_one_box_fewer_in_each_row_numbered_from_the_lower_left() -> None:
    bodies = scene_of(name="stone").bodies
    assert bodies.names == tuple(f"stone-{n}" for n in range(1, 11))
    # 1e-15: each coordinate is one or two sums of numbers of about 1
    expected = [[0.4, 2.1], [0.8, 2.1], [1.2, 2.1], [1.6, 2.1], [0.6, 2.3], [1.0, 2.3], [1.4, 2.3]]
    assert bodies.position[:7] == pytest.approx(np.array(expected), abs=1e-15)
    assert bodies.position[9] == pytest.approx(np.array([1.0, 2.7]), abs=1e-15)


def test_boxes_of_a_wall_are_the_gap_apart() -> None:
    size = {"columns": 3, "rows": 5, "fewer": 0}
    for gap in (0.0, 0.05):
        position = scene_of(gap=gap, **size).bodies.position.reshape(5, 3, 2)
        assert np.diff(position[..., 0], axis=1) == pytest.approx(0.4 + gap, abs=1e-15)  # rounding
        assert np.diff(position[..., 1], axis=0) == pytest.approx(0.2 + gap, abs=1e-15)  # rounding
        assert position[0, :, 1] == pytest.approx(2.1, abs=1e-15)  # the lowest row lies on the base


def test_boxes_have_the_mass_and_moment_of_rectangles() -> None:
    bodies = scene_of(density=3.0).bodies
    mass = 3.0 * 0.4 * 0.2
    assert bodies.mass == pytest.approx(mass, rel=1e-15)
    assert bodies.moment == pytest.approx(mass * (0.4**2 + 0.2**2) / 12.0, rel=1e-14)  # a few roundings
    assert not bodies.round.any()
    assert scene_of().bodies.mass.tolist() == [1.0] * 10


def test_angle_rotates_the_stack_about_its_base() -> None:
    straight, tilted = scene_of().bodies, scene_of(angle=0.5).bodies
    assert tilted.angle.tolist() == [0.5] * 10
    cos, sin = math.cos(0.5), math.sin(0.5)
    offset = (straight.position - [1.0, 2.0]) @ np.array([[cos, sin], [-sin, cos]])
    assert tilted.position == pytest.approx(np.add(offset, [1.0, 2.0]), abs=1e-15)  # rounding


def test_jitter_offsets_boxes_along_their_rows_depending_on_the_seed() -> None:
    regular = scene_of(columns=30, rows=30).bodies.position
    first, again, other = (scene_of(seed, columns=30, rows=30, jitter=0.1).bodies.position for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    offset = first - regular
    assert np.array_equal(offset[:, 1], np.zeros(len(offset)))
    assert np.abs(offset[:, 0]).max() <= 0.1 + 1e-14  # rounding of the difference
    assert np.abs(offset[:, 0].mean()) < 5 * 0.1 / math.sqrt(3 * len(offset))  # 5 σ of a mean of uniform numbers


def test_second_stack_does_not_change_the_first() -> None:
    one = from_document({"stack": [{**PYRAMID, "jitter": 0.1}]}).bodies
    two = from_document({"stack": [{**PYRAMID, "jitter": 0.1}, {**PYRAMID, "jitter": 0.1, "base": [50, 0]}]}).bodies
    assert np.array_equal(one.position, two.position[:10])
    assert two.names[10] == "stack-2-1"


@given(
    columns=st.integers(1, 12), rows=st.integers(1, 12), fewer=st.integers(0, 3), gap=st.floats(0.0, 1.0),
    width=st.floats(0.01, 10.0), height=st.floats(0.01, 10.0),
)  # fmt: skip
def test_stack_has_the_given_rows_centred_on_its_base(columns, rows, fewer, gap, width, height):
    keys = {"columns": columns, "rows": rows, "fewer": fewer, "gap": gap, "size": [width, height], "base": [0, 0]}
    if fewer * (rows - 1) >= columns:
        assert "is empty" in faults_of({"stack": [keys]})[0].message
        return
    scene = scene_of(**keys)
    bodies = scene.bodies
    assert len(bodies) == sum(columns - fewer * row for row in range(rows))
    scale = columns * (width + gap)
    assert bodies.position[:, 0].mean() == pytest.approx(0.0, abs=1e-14 * scale)  # rounding of sums
    top_centre = rows * height + (rows - 1) * gap - 0.5 * height
    assert bodies.position[-1, 1] == pytest.approx(top_centre, rel=1e-14)  # a few roundings
    assert loads(dumps(scene)) == scene


@pytest.mark.parametrize("engine", ["pymunk", "reference", "box2d"])
def test_fixed_stack_stays_where_it_is_when_a_ball_hits_it(engine: str) -> None:
    wall = {"base": [3.0, 0.0], "size": [0.5, 0.2], "columns": 2, "rows": 5, "gap": 0.1, "fixed": True, "name": "brick"}
    ball = {"name": "ball", "position": [0.0, 0.4], "radius": 0.1, "velocity": [5.0, 0.0], "restitution": 1.0}
    scene = from_document(
        {
            "world": {"duration": 1.0},
            "solver": {"dt": 0.005},
            "stack": [wall | {"restitution": 1.0}],
            "ball": [ball],
        }
    )
    result = run(scene, engine)
    bricks = [k for k, name in enumerate(scene.bodies.names) if name.startswith("brick")]
    assert (result.position[:, bricks] == result.position[0, bricks]).all()
    assert result.velocity[-1, scene.bodies.number_of["ball"], 0] == pytest.approx(-5.0, rel=0.01)  # float32 on box2d
    assert loads(dumps(scene)) == scene


def test_fixed_stack_has_no_velocity() -> None:
    for key in ("velocity", "angular_velocity"):
        value = [1.0, 0.0] if key == "velocity" else 1.0
        (fault,) = faults_of({"stack": [PYRAMID | {"fixed": True, key: value}]})
        assert fault.path == f"stack[0].{key}"


def test_empty_row_and_too_many_boxes_are_faults() -> None:
    text = "[[stack]]\nbase = [0, 0]\nsize = [1, 1]\ncolumns = {}\nrows = {}\nfewer = {}\n"
    assert_faults(text.format(5, 4, 2), "5: stack[0].rows: at most 3")
    assert_faults(text.format(1001, 1000, 0), "1: stack[0]: the limit is 1,000,000")
