"""Thin walls of several edges on box2d: bodies with corners slide over their joints, and both sides are solid."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.action import Spawn
from sandbox.engines.box2d_adapter.chains import loops_of, sides_of
from sandbox.measure.preflight import notes
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Wall
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # several runs each

SLOP = 0.005
"""m, slop of the scenes; 1 m is then one of Box2D's lengths"""


def scene(
    points: list[list[float]],
    *boxes: dict[str, Any],
    gravity: tuple[float, float] = (0.0, -9.81),
    duration: float = 3.0,
    **wall: Any,
) -> Scene:
    return from_document(
        {
            "world": {"gravity": gravity, "duration": duration},
            "solver": {"dt": 1.0 / 60.0, "slop": SLOP},
            "wall": [{"name": "ground", "points": points, **wall}],
            "box": [{"name": f"box {k}", **each} for k, each in enumerate(boxes)],
        }
    )


@given(
    kink=st.sampled_from([-2.9, -0.3, 0.3, 2.9, 10.0, 30.0, 45.0]),
    height=st.floats(0.15, 0.6),
    slenderness=st.floats(1.0, 4.0),
    start=st.floats(2.0, 3.0),
    speed=st.floats(2.0, 4.0),
    reverse=st.booleans(),
)
@settings(max_examples=40)
def test_box_that_slides_over_a_kink_keeps_the_speed_it_has_on_the_reference(
    kink: float, height: float, slenderness: float, start: float, speed: float, reverse: bool
) -> None:
    """Within 10 %: both lose the part of the speed across the slope, box2d more of it where the box tips."""
    points = [[0.0, 0.0], [5.0, 0.0], [40.0, -35.0 * math.tan(math.radians(kink))]]
    body = {"position": [start, 0.5 * height], "size": [height * slenderness, height], "velocity": [speed, 0.0]}
    sliding = scene(points[::-1] if reverse else points, body)
    runs = [sandbox.run(sliding, engine=engine) for engine in ("box2d", "reference")]
    ours, theirs = (float(np.hypot(*run.velocity[-1, 0])) for run in runs)
    assert ours == pytest.approx(theirs, rel=0.1, abs=0.05)


def test_wall_in_many_pieces_is_a_straight_one() -> None:
    """Points out of line by 1e-6 m, which are not merged, move a sliding box by less than 1e-4 m."""
    body = {"position": [1.0, 0.2], "size": [0.6, 0.4], "velocity": [2.0, 0.0]}
    rough = [[0.2 * k, 1e-6 * math.sin(1.3 * k)] for k in range(51)]
    ends = [
        sandbox.run(scene(points, body), engine="box2d").position[-1, 0, 0] for points in (rough, [[0, 0], [10, 0]])
    ]
    assert ends[0] == pytest.approx(ends[1], abs=1e-4)


BEHIND = 0.05
"""m, distance of the other side behind the points of a wall, `DEPTH_LENGTHS`"""

OPEN = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.2]]
ROOM = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]


@pytest.mark.parametrize(
    ("points", "position", "velocity", "depth"),
    [
        (OPEN, (1.0, 1.0), (0.0, -4.0), 0.0),
        (OPEN, (1.0, -1.0), (0.0, 4.0), BEHIND),
        (OPEN, (-1.0, 0.0), (4.0, 0.0), 0.0),
        (ROOM, (2.0, 1.0), (0.0, -4.0), 0.0),
        (ROOM, (2.0, -1.0), (0.0, 4.0), BEHIND),
        (ROOM, (-1.0, 2.0), (4.0, 0.0), BEHIND),
    ],
    ids=["on top", "from below", "at the end", "in a room", "below a room", "beside a room"],
)
def test_both_sides_and_the_ends_are_solid(
    points: list[list[float]], position: tuple[float, float], velocity: tuple[float, float], depth: float
) -> None:
    """A ball that appears after the start turns back at the wall, on the other side the depth too early."""
    box = {"position": [3.0, 1.0], "size": [0.5, 0.5]}
    lying = scene(points, box, gravity=(0.0, 0.0), duration=0.45, restitution=1.0, closed=points is ROOM)
    ball = Ball(name="ball", position=position, velocity=velocity, radius=0.1, restitution=1.0)
    run = sandbox.run(lying, engine="box2d", actions=[Spawn(time=0.0, ball=ball)])
    nearest = float(np.nanmin(np.abs(run.position[:, -1] @ np.sign(velocity))))
    assert nearest == pytest.approx(0.1 + depth, abs=4.0 / 60.0)  # a frame of 1/60 s at 4 m/s
    assert run.velocity[-1, -1] == pytest.approx(-np.asarray(velocity), abs=0.1)


def test_wall_with_bodies_on_both_sides_remains_segments_and_is_noted() -> None:
    boxes = [{"position": [1.0, y], "size": [0.4, 0.4]} for y in (1.0, -1.0)]
    divided = scene(OPEN, *boxes)
    (note,) = [each for each in notes(divided, "box2d") if each.kind == "joined_edges"]
    assert "'ground' join, as it has bodies on both sides" in note.message
    assert [each for each in notes(scene(OPEN, boxes[0]), "box2d") if each.kind == "joined_edges"] == []
    assert loops_of(divided.walls[0], np.asarray([[1.0, 1.0], [1.0, -1.0]]), BEHIND) is None


@given(
    radius=st.floats(0.2, 5.0),
    sides=st.integers(3, 40),
    angle=st.floats(0.0, 6.0),
    distance=st.floats(0.01, 3.0).filter(lambda d: abs(d - 1.0) > 0.01),
)
def test_side_of_a_closed_wall_is_the_inside_or_the_outside(
    radius: float, sides: int, angle: float, distance: float
) -> None:
    """Along the ray to a corner, and to the middle of an edge: the side changes at the wall alone."""
    corners = np.asarray([(math.cos(t), math.sin(t)) for t in math.tau * np.arange(sides) / sides]) * radius
    loop = np.vstack((corners, corners[:1]))
    for target in (corners[0], 0.5 * (corners[0] + corners[1])):
        assert sides_of(loop, True, distance * target[None]).tolist() == [1.0 if distance < 1.0 else -1.0]


@given(
    depth=st.floats(0.001, 0.3),
    turns=st.lists(st.floats(0.01, 1.5).flatmap(lambda t: st.sampled_from([t, -t])), min_size=1, max_size=6),
    above=st.booleans(),
)
def test_second_side_is_parallel_to_the_first(depth: float, turns: list[float], above: bool) -> None:
    """Edge for edge, at the depth behind it: away from the body."""
    heading = np.cumsum([0.0, *turns])
    points = np.vstack(([0.0, 0.0], np.cumsum(2.0 * np.column_stack((np.cos(heading), np.sin(heading))), axis=0)))
    wall = Wall(name="wall", points=tuple((x, y) for x, y in points.tolist()))
    body = np.asarray([[1.0, 1e-3 if above else -1e-3]])
    found = loops_of(wall, body, depth)
    assert found is not None  # edges of 2 m are longer than what a mitre of 1.5 rad takes
    (loop,) = found
    count = len(points)
    front, back = loop[:count], loop[count:][::-1]
    assert sorted(map(tuple, front.tolist())) == sorted(map(tuple, points.tolist()))
    edge = front[1:] - front[:-1]
    right = np.column_stack((edge[:, 1], -edge[:, 0])) / np.hypot(*edge.T)[:, None]
    for ends in (slice(None, -1), slice(1, None)):
        gap = ((back - front)[ends] * right).sum(axis=1)
        assert gap == pytest.approx(np.full(len(edge), -depth), rel=1e-9)
    first = 0 if (front[0] == points[0]).all() else -1
    assert float((body[0] - points[0]) @ right[first]) == pytest.approx(1e-3)  # the body is in front
